"""How a diagram file says which robot a block means.

``"kr180"`` a shipped robot; ``"arms/mine.m"`` a robot file, relative to the diagram's folder; or an object::

    {"robot": "puma560", "friction": "none"}

``robot`` may be a name, a path or a whole robot document. ``friction`` is ``"none"``, ``"viscous"`` (Coulomb
friction is left out) or ``"coulomb"`` (viscous friction is left out); ``friction_model`` names the formula;
``name`` picks one of several robots of a script.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

from armblocks.errors import ArmblocksError, UnknownNameError
from armblocks.formats.json_document import Node, closed_members
from armblocks.formats.robot_files import is_path, list_robots, shipped_robot
from armblocks.formats.robot_json import robot_from, robot_to
from armblocks.robot import FrictionModel, Robot

ResolveRobot = Callable[[str], Robot]
"""From a shipped name or an absolute path to a robot: ``load_robot``."""

_FRICTION: dict[str, Callable[[Robot], Robot]] = {
    "none": lambda robot: robot.nofriction(),
    "viscous": lambda robot: robot.nofriction(viscous=False),
    "coulomb": lambda robot: robot.nofriction(coulomb=False),
}


def robot_of_reference(node: Node, folder: Path | None, resolve_robot: ResolveRobot) -> Robot:
    """The robot that a reference means. Raises ``FormatError`` or ``UnknownNameError`` with file and line."""
    if isinstance(node.value, str):
        return _resolved(node, folder, resolve_robot)
    members = closed_members(node, ("robot", "friction", "friction_model"), required=("robot",))
    inner = members["robot"]
    robot = robot_from(inner) if isinstance(inner.value, dict) else _resolved(inner, folder, resolve_robot)
    if "friction_model" in members:
        model = members["friction_model"].choice([model.value for model in FrictionModel])
        robot = robot.with_friction_model(FrictionModel(model))
    if "friction" in members:
        robot = _FRICTION[members["friction"].choice(_FRICTION)](robot)
    return robot


def reference_of_robot(robot: Robot, folder: Path | None, resolve_robot: ResolveRobot) -> object:
    """The shortest reference that gives an equal robot: a shipped name, a path, or the whole document.

    A path is tried where the robot says that it came from a file that still exists.
    """
    for reference, base in _candidates(robot, folder, resolve_robot):
        modelled = base.with_friction_model(robot.friction_model)
        extra: dict[str, object] = {}
        if robot.friction_model is not base.friction_model:
            extra["friction_model"] = robot.friction_model.value
        if modelled == robot:
            return {"robot": reference, **extra} if extra else reference
        for word, without in _FRICTION.items():
            if without(modelled) == robot:
                return {"robot": reference, "friction": word, **extra}
    return {"robot": robot_to(robot)}


def _resolved(node: Node, folder: Path | None, resolve_robot: ResolveRobot) -> Robot:
    reference = node.text()
    try:
        if folder is not None and is_path(reference):
            return resolve_robot(str(folder / reference))
        return resolve_robot(reference)
    except UnknownNameError as error:
        raise UnknownNameError(error.kind, error.name, error.known, where=node.where) from error
    except ArmblocksError as error:
        what = f"{error.where}: {error.what}" if error.where else error.what
        raise node.error(what, allowed=error.allowed, fix=error.fix) from error


def _candidates(
    robot: Robot, folder: Path | None, resolve_robot: ResolveRobot
) -> Iterator[tuple[str, Robot]]:
    """References that may mean this robot, with the robots that they give."""
    for name in list_robots():
        base = shipped_robot(name)
        if base.name == robot.name:
            yield name, base
    if robot.source and is_path(robot.source) and Path(robot.source).is_file():
        try:
            base = resolve_robot(robot.source)
        except ArmblocksError:
            return  # the file has changed: the robot itself is written
        yield _relative(robot.source, folder), base


def _relative(source: str, folder: Path | None) -> str:
    """A path as seen from the diagram's folder where it lies inside, with ``/`` on every system."""
    if folder is None:
        return Path(source).as_posix()
    try:
        inside = Path(os.path.abspath(source)).relative_to(os.path.abspath(folder))
    except ValueError:
        return Path(os.path.abspath(source)).as_posix()
    return inside.as_posix()
