"""Robots by name or path: file formats, shipped robots, and the checks for files of users."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from os import PathLike, fspath
from pathlib import Path

from armblocks.errors import FormatError, UnknownNameError, check_type
from armblocks.files import read_bounded
from armblocks.formats.robot_format import RobotFormat
from armblocks.formats.robot_formats import ROBOT_FORMATS, ROBOT_SUFFIXES
from armblocks.formats.shipped import ROBOT_FILE, list_robots, shipped_folder
from armblocks.robot import FrictionModel, Robot, warn_of_implausible_values, warn_of_inertias


def load_robot(
    name_or_path: str | PathLike[str], *, name: str | None = None, friction_model: FrictionModel | None = None
) -> Robot:
    """A shipped robot by its name, ``"kr180"``, or a robot file by its path.

    A text with a path separator or with the suffix of a robot format is a path, any other text is a name.
    ``name`` selects one of several robots of a script, by the script's variable or by the robot's name.
    ``friction_model`` replaces that of the file; scripts have none and get that of releases 9.5 to 10. The
    robot's ``source`` is the shipped name or the path.

    Raises ``UnknownNameError`` for a name that is not shipped and for a ``name`` that is not in the file,
    ``FormatError`` for a file that is missing, has no known format or cannot be read. Issues warnings for
    physically impossible inertias (``InertiaWarning``) and for numbers with a probably wrong unit or sign in
    a file of the user. For shipped robots, ``armblocks show`` prints them.
    """
    check_type(
        name_or_path,
        (str, PathLike),
        "the name of a shipped robot, or the path of a file",
        where="load_robot",
    )
    text = fspath(name_or_path)
    if not isinstance(name_or_path, str) or is_path(text):
        robot = _pick(_read_file(Path(text)), text, name)
        robot = replace(robot, source=text)
        warn_of_inertias(robot)
        warn_of_implausible_values(robot)
    else:
        robot = shipped_robot(text)
        if name is not None:
            robot = _pick({text: robot}, text, name)
    return robot if friction_model is None else robot.with_friction_model(friction_model)


@cache
def shipped_robot(name: str) -> Robot:
    """A shipped robot by its name; raises ``UnknownNameError`` with the nearest."""
    known = list_robots()
    if name not in known:
        raise UnknownNameError("shipped robot", name, known)
    path = shipped_folder("robots") / name / ROBOT_FILE
    (robot,) = _read_file(path).values()
    return replace(robot, source=name)


def is_path(name_or_path: str) -> bool:
    """Whether a text is a path and not the name of a shipped item."""
    return "/" in name_or_path or "\\" in name_or_path or name_or_path.lower().endswith(ROBOT_SUFFIXES)


def _read_file(path: Path) -> Mapping[str, Robot]:
    if path.is_dir():
        raise FormatError(
            "this is a folder",
            where=str(path),
            allowed="a robot file: " + ", ".join(ROBOT_SUFFIXES),
            fix=f"give the path of a file in it, such as {path.name}/{ROBOT_FILE}",
        )
    format = _format(str(path))
    return format.read(read_bounded(path, format.most_bytes), str(path))


def read_robots(data: bytes, name: str) -> Mapping[str, Robot]:
    """The robots of a file's bytes, by their names in the file.

    ``name`` is the name of the file in messages; its suffix determines the format. Raises ``FormatError``.
    """
    format = _format(name)
    if len(data) > format.most_bytes:
        raise FormatError(
            f"it has {len(data)} bytes",
            where=name,
            allowed=f"at most {format.most_bytes}",
            fix="split the file, or write the robot as JSON",
        )
    return format.read(data, name)


def _format(name: str) -> RobotFormat:
    suffix = Path(name).suffix.lower()
    for format in ROBOT_FORMATS:
        if suffix in format.suffixes:
            return format
    raise FormatError(
        f"'{Path(name).suffix}' is not a suffix of a robot file",
        where=name,
        allowed=", ".join(f"{suffix} ({f.name})" for f in ROBOT_FORMATS for suffix in f.suffixes),
        fix="rename the file",
    )


def _pick(robots: Mapping[str, Robot], where: str, name: str | None) -> Robot:
    """The selected robot of a file."""
    if not robots:
        raise FormatError(
            "the file defines no robot",
            where=where,
            allowed="kuka = robot(L, …) or SerialLink(L, …)",
            fix="define a robot in the script, or choose another file",
        )
    if name is not None:
        for variable, robot in robots.items():
            if name in (variable, robot.name):
                return robot
        raise UnknownNameError(
            "robot", name, [*robots, *(robot.name for robot in robots.values())], where=where
        )
    if len(robots) > 1:
        raise FormatError(
            f"the file defines {len(robots)} robots",
            where=where,
            allowed=", ".join(robots),
            fix="say which: name=…",
        )
    return next(iter(robots.values()))
