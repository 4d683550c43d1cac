"""References of a diagram file to robots, tables of values and Python functions.

A block's parameter refers to a robot: ``"kr180"`` is a shipped robot, ``"arms/mine.m"`` a robot file,
relative to the diagram's folder. It may also be a key of the diagram's table ``robots``, so that a robot of
several blocks is written once::

    "robots": {
      "arm": {"robot": "puma560", "friction": "none"},
      "Pendulum": {"format": 1, "name": "Pendulum", "links": […]}
    }

An entry is a whole robot document, or a variant of another robot with the keys

- ``robot``: a shipped name or a path,
- ``friction``: ``"none"``, ``"viscous"`` (without Coulomb friction) or ``"coulomb"`` (without viscous
  friction),
- ``friction_model``: the name of the friction formula.

A table of values over time is the reference to its file (:mod:`armblocks.formats.data_files`), or its rows. A
Python function is ``file.py:name``; it is loaded only if the user trusts the diagram.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from armblocks.diagram import TimeTable, UserFunction
from armblocks.errors import ArmblocksError, FormatError, UnknownNameError
from armblocks.formats.data_files import DataFiles, TableReference, UnrestrictedFiles
from armblocks.formats.json_document import Node, closed_members
from armblocks.formats.robot_facts import shipped_summary
from armblocks.formats.robot_files import is_path, shipped_robot
from armblocks.formats.robot_json import robot_from_json, robot_to_json
from armblocks.formats.shipped import list_robots
from armblocks.formats.table_files import load_table
from armblocks.robot import FrictionModel, Robot

ResolveRobot = Callable[[str], Robot]
"""A function that returns the robot of a shipped name or a path: ``load_robot``."""

MAX_INLINE_NUMBERS = 10_000
"""Maximum size of a table whose numbers are written into the diagram file."""

TABLE_PREFIX = "#"
"""Prefix of the ``source`` of a robot from the diagram's table; its key in the table follows."""

_FRICTION: dict[str, Callable[[Robot], Robot]] = {
    "none": lambda robot: robot.nofriction(),
    "viscous": lambda robot: robot.nofriction(viscous=False),
    "coulomb": lambda robot: robot.nofriction(coulomb=False),
}


class RobotReader:
    """Loads the robots and tables of one document. Errors have file and line."""

    def __init__(
        self,
        table: Node | None,
        folder: Path | None,
        resolve_robot: ResolveRobot,
        data: DataFiles | None = None,
    ) -> None:
        self._data = data or UnrestrictedFiles()
        self._folder = folder
        self._resolve_robot = resolve_robot
        self._table_robots: dict[str, Robot] = {}
        for key, node in ({} if table is None else table.members()).items():
            self._table_robots[key] = replace(self._entry(node), source=TABLE_PREFIX + key)

    def robot(self, node: Node) -> Robot:
        """The robot of a block's parameter."""
        name = node.text()
        return self._table_robots[name] if name in self._table_robots else self._resolved(node)

    def table(self, node: Node) -> TimeTable:
        """The table of a file, whose path is relative to the folder of the document."""
        try:
            return self._data.table(_table_reference(node), self._folder)
        except ArmblocksError as error:
            problem = f"{error.where}: {error.what}" if error.where else error.what
            raise node.error(problem, allowed=error.allowed, fix=error.fix) from error

    def function(self, node: Node) -> UserFunction:
        """The Python function of a file in the folder of the document, if code is trusted."""
        try:
            return self._data.function(node.text(), self._folder)
        except ArmblocksError as error:
            raise node.error(error.what, allowed=error.allowed, fix=error.fix) from error

    def _entry(self, node: Node) -> Robot:
        if "robot" not in node.members():
            return robot_from_json(node)
        members = closed_members(node, ("robot", "friction", "friction_model"))
        robot = self._resolved(members["robot"])
        if "friction_model" in members:
            model = members["friction_model"].choice([model.value for model in FrictionModel])
            robot = robot.with_friction_model(FrictionModel(model))
        if "friction" in members:
            robot = _FRICTION[members["friction"].choice(_FRICTION)](robot)
        return robot

    def _resolved(self, node: Node) -> Robot:
        reference = node.text()
        try:
            if self._folder is not None and is_path(reference):
                return self._resolve_robot(str(self._folder / reference))
            return self._resolve_robot(reference)
        except UnknownNameError as error:
            valid_names = [*error.known, *self._table_robots]
            raise UnknownNameError(error.kind, error.name, valid_names, where=node.where) from error
        except ArmblocksError as error:
            problem = f"{error.where}: {error.what}" if error.where else error.what
            raise node.error(problem, allowed=error.allowed, fix=error.fix) from error


class RobotWriter:
    """Writes references to the robots of one document, and collects its ``table``."""

    def __init__(self, folder: Path | None, resolve_robot: ResolveRobot, project: Path | None = None) -> None:
        self._project = project
        self._folder = folder
        self._resolve_robot = resolve_robot
        self._known: dict[Robot, str] = {}
        self.table: dict[str, object] = {}

    def reference(self, robot: Robot) -> str:
        """A shipped name or a path of an equal robot, else a key of the table."""
        if robot not in self._known:
            entry = shortest_reference(robot, self._folder, self._resolve_robot)
            if isinstance(entry, str):
                self._known[robot] = entry
            else:
                self._known[robot] = self._new_key(robot)
                self.table[self._known[robot]] = entry
        return self._known[robot]

    def function_reference(self, function: UserFunction) -> str:
        """The file and the name of a function."""
        file, _, name = function.source.rpartition(":")
        if not file:
            raise FormatError(
                f"the function {function.name} is not defined in a file",
                allowed="functions at the top level of a .py file",
                fix="move it to a file and import it",
                where=f"function {function.name}",
            )
        return f"{self._path(file)}:{name}"

    def table_reference(self, table: TimeTable) -> object:
        """The reference to the table's file if the file still has the same numbers, else its rows.

        A file of the project is always a reference.
        """
        if table.source and (self._project is not None or _is_unchanged(table)):
            path = self._path(table.source)
            if not table.time and not table.columns:
                return path
            column_selection = {"time": table.time, "columns": list(table.columns)}
            return {"file": path, **{key: value for key, value in column_selection.items() if value}}
        rows = np.asarray(table)
        if rows.size > MAX_INLINE_NUMBERS:
            raise FormatError(
                f"a table of {rows.shape[0]} rows is not from a file",
                where=table.source,
                allowed=f"tables of up to {MAX_INLINE_NUMBERS} numbers, or a file with the same table",
                fix="write the rows to a .csv or .npz file and use the result of load_table",
            )
        return rows.tolist()

    def _path(self, source: str) -> str:
        """The path of a file from the diagram's folder, through other folders of the project if necessary."""
        path = Path(source)
        if self._project is not None and self._folder is not None and path.is_relative_to(self._project):
            return Path(os.path.relpath(path, self._folder)).as_posix()
        return relative_to_folder(source, self._folder)

    def _new_key(self, robot: Robot) -> str:
        """A unique key: the previous key of the robot or its name, changed if another robot has it."""
        name = (
            robot.source.removeprefix(TABLE_PREFIX) if robot.source.startswith(TABLE_PREFIX) else robot.name
        )
        used_keys = {*self.table, *list_robots()}
        stem = "robot" if is_path(name) or not name else name
        keys = (stem if number == 1 else f"{stem} {number}" for number in range(1, len(used_keys) + 2))
        return next(key for key in keys if key not in used_keys)


def _is_unchanged(table: TimeTable) -> bool:
    """Whether the file of a table still contains the table."""
    try:
        return load_table(table.source, time=table.time, columns=table.columns) == table
    except ArmblocksError:
        return False


def _table_reference(node: Node) -> TableReference:
    if isinstance(node.value, str):
        return TableReference(file=node.value)
    members = closed_members(node, ("file", "time", "columns"))
    if "file" not in members:
        raise node.error("the key 'file' is missing", allowed="the path of a file", fix='add "file"')
    return TableReference(
        file=members["file"].text(),
        time=members["time"].text() if "time" in members else "",
        columns=tuple(entry.text() for entry in members["columns"].elements())
        if "columns" in members
        else (),
    )


def shortest_reference(
    robot: Robot, folder: Path | None, resolve_robot: ResolveRobot
) -> str | Mapping[str, object]:
    """The shortest reference to a robot. A path is used only if the robot's file still gives an equal
    robot."""
    for reference, base in _candidates(robot, folder, resolve_robot):
        modelled = base.with_friction_model(robot.friction_model)
        model: dict[str, object] = {}
        if robot.friction_model is not base.friction_model:
            model["friction_model"] = robot.friction_model.value
        if modelled == robot:
            return {"robot": reference, **model} if model else reference
        for word, remove_friction in _FRICTION.items():
            if remove_friction(modelled) == robot:
                return {"robot": reference, "friction": word, **model}
    return robot_to_json(robot)


def _candidates(
    robot: Robot, folder: Path | None, resolve_robot: ResolveRobot
) -> Iterator[tuple[str, Robot]]:
    """Possible references to this robot, with the robots that they give."""
    for name in list_robots():
        if shipped_summary(name).title == robot.name:
            yield name, shipped_robot(name)
    if robot.source and is_path(robot.source) and Path(robot.source).is_file():
        try:
            base = resolve_robot(robot.source)
        except ArmblocksError:
            return  # the file has changed: the whole robot is written
        yield relative_to_folder(robot.source, folder), base


def relative_to_folder(source: str, folder: Path | None) -> str:
    """A path relative to the diagram's folder if it is inside, with ``/`` on all systems."""
    if folder is None:
        return Path(source).as_posix()
    try:
        relative_path = Path(source).resolve().relative_to(folder.resolve()).as_posix()
    except ValueError:
        return Path(source).resolve().as_posix()
    return relative_path
