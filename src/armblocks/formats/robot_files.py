"""Robots by name or path: file formats, shipped robots, and the checks for files of users."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from os import PathLike, fspath
from pathlib import Path

from armblocks.errors import FormatError, UnknownNameError, check_type
from armblocks.files import read_bounded
from armblocks.formats.file_findings import FileContext, warn_of_findings
from armblocks.formats.robot_format import RobotFormat
from armblocks.formats.robot_formats import ROBOT_FORMATS, ROBOT_SUFFIXES
from armblocks.formats.robot_json import write_robot
from armblocks.formats.shipped import ROBOT_FILE, list_robots, shipped_folder
from armblocks.robot import FrictionModel, Robot, warn_of_implausible_values, warn_of_inertias, with_tip


def load_robot(
    name_or_path: str | PathLike[str],
    *,
    name: str | None = None,
    friction_model: FrictionModel | None = None,
    tip: str | None = None,
    packages: Mapping[str, str | PathLike[str]] | None = None,
    arguments: Mapping[str, object] | None = None,
) -> Robot:
    """A shipped robot by its name, ``"kr180"``, or a robot file by its path.

    - ``name_or_path``: a text with a path separator or with the suffix of a robot format is a path, any other
      text is a name. The robot's ``source`` is the shipped name or the path.
    - ``name``: selects one of several robots of a script, by the script's variable or by the robot's name.
    - ``friction_model``: replaces the model of the file. Scripts get the model of releases 9.5 to 10.
    - ``tip``: the link that carries the tool, see :func:`armblocks.robot.with_tip`. By default the tip of the
      file; in a URDF file, this is the end of the chain with the most degrees of freedom.
    - ``packages``: folders of ROS packages by name. Other packages are searched for in the folders above the
      file.
    - ``arguments``: values of the arguments of a xacro file.

    Raises ``UnknownNameError`` for a name that is not shipped and for a ``name`` or ``tip`` that is not in
    the file. Raises ``FormatError`` for a file that is missing, has no known format or cannot be read.

    Warns of physically impossible inertias (``InertiaWarning``), of numbers with a probably wrong unit or
    sign, and of parts of the file that are not read. For shipped robots, ``armblocks show`` prints these
    warnings.
    """
    context = file_context(packages, arguments)
    robot = load_robot_in(name_or_path, context, name=name)
    if is_file(name_or_path):
        warn_of_findings(context.findings)
        warn_of_inertias(robot)
        warn_of_implausible_values(robot)
    robot = robot if tip is None else with_tip(robot, tip)
    return robot if friction_model is None else robot.with_friction_model(friction_model)


def file_context(
    packages: Mapping[str, str | PathLike[str]] | None, arguments: Mapping[str, object] | None
) -> FileContext:
    """The context for reading a file anywhere, with the arguments of :func:`load_robot`."""
    return FileContext(
        packages={key: Path(folder) for key, folder in (packages or {}).items()},
        arguments={key: str(value) for key, value in (arguments or {}).items()},
    )


def load_robot_in(
    name_or_path: str | PathLike[str], context: FileContext, *, name: str | None = None
) -> Robot:
    """The robot of :func:`load_robot`; findings are added to the context, and no warnings are issued."""
    check_type(
        name_or_path,
        (str, PathLike),
        "the name of a shipped robot, or the path of a file",
        where="load_robot",
    )
    text = fspath(name_or_path)
    if is_file(name_or_path):
        return robot_in_bytes(robot_file_bytes(Path(text)), Path(text), context, name=name)
    robot = shipped_robot(text)
    return robot if name is None else _selected_robot({text: robot}, text, name)


@cache
def shipped_robot(name: str) -> Robot:
    """A shipped robot by its name; raises ``UnknownNameError`` with the nearest name."""
    robot_names = list_robots()
    if name not in robot_names:
        raise UnknownNameError("shipped robot", name, robot_names)
    path = shipped_folder("robots") / name / ROBOT_FILE
    robot = robot_in_bytes(robot_file_bytes(path), path, FileContext())
    return replace(robot, source=name)


def robot_in_bytes(data: bytes, path: Path, context: FileContext, *, name: str | None = None) -> Robot:
    """The robot of the bytes of a file, as :func:`load_robot_in` reads it from the file."""
    inside = replace(context, folder=path.absolute().parent)
    robots = format_of(str(path), data).robots(data, str(path), inside)
    return replace(_selected_robot(robots, str(path), name), source=str(path))


def is_file(name_or_path: str | PathLike[str]) -> bool:
    """Whether this is the path of a file, and not the name of a shipped robot."""
    return not isinstance(name_or_path, str) or is_path(name_or_path)


def is_path(name_or_path: str) -> bool:
    """Whether a text is a path and not the name of a shipped item."""
    return "/" in name_or_path or "\\" in name_or_path or name_or_path.lower().endswith(ROBOT_SUFFIXES)


def robot_file_bytes(path: Path) -> bytes:
    """The content of a robot file. Raises ``FormatError`` for folders, other suffixes and too large files."""
    if path.is_dir():
        raise FormatError(
            "this is a folder",
            where=str(path),
            allowed="a robot file: " + ", ".join(ROBOT_SUFFIXES),
            fix=f"give the path of a file in it, such as {path.name}/{ROBOT_FILE}",
        )
    data = read_bounded(path, max(format.max_bytes for format in _formats_with_suffix(str(path))))
    _check_size(data, str(path))
    return data


def read_robots(data: bytes, name: str, context: FileContext | None = None) -> Mapping[str, Robot]:
    """The robots of a file's bytes, by their names in the file.

    ``name`` is the name of the file in messages; its suffix determines the format. ``context``: the files
    that it may refer to; by default none. Raises ``FormatError``, and issues warnings for parts that are not
    read.
    """
    format = _check_size(data, name)
    context = context or FileContext()
    robots = format.robots(data, name, context)
    warn_of_findings(context.findings)
    return robots


def _check_size(data: bytes, name: str) -> RobotFormat:
    """The format of a file. Raises ``FormatError`` if the file is too large for it."""
    format = format_of(name, data)
    if len(data) > format.max_bytes:
        raise FormatError(
            f"the file has {len(data)} bytes",
            where=name,
            allowed=f"at most {format.max_bytes}",
            fix="split the file, or write the robot as JSON",
        )
    return format


def robot_bytes(robot: Robot, name: str) -> bytes:
    """The content of a file with this name: in the format of the suffix, else the canonical JSON document.

    Raises ``FormatError`` for robots that the format cannot describe.
    """
    suffix = Path(name).suffix.lower()
    for format in ROBOT_FORMATS:
        if suffix in format.suffixes and format.write is not None:
            return format.write(robot)
    return write_robot(robot)


def format_of(name: str, data: bytes | None = None) -> RobotFormat:
    """The format of a file. Formats with the same suffix are distinguished by the content, if it is given.

    Raises ``FormatError`` for other suffixes.
    """
    formats = _formats_with_suffix(name)
    if data is not None:
        for format in formats:
            if format.recognises is not None and format.recognises(data):
                return format
    return next((format for format in formats if format.recognises is None), formats[0])


def _formats_with_suffix(name: str) -> list[RobotFormat]:
    suffix = Path(name).suffix.lower()
    formats = [format for format in ROBOT_FORMATS if suffix in format.suffixes]
    if formats:
        return formats
    raise FormatError(
        f"'{Path(name).suffix}' is not a suffix of a robot file",
        where=name,
        allowed=", ".join(f"{suffix} ({f.name})" for f in ROBOT_FORMATS for suffix in f.suffixes),
        fix="rename the file",
    )


def _selected_robot(robots: Mapping[str, Robot], where: str, name: str | None) -> Robot:
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
            fix="select one with name=…",
        )
    return next(iter(robots.values()))
