"""Robot scripts of the Robotics Toolbox for MATLAB, ``kr180.m``: all releases, straight-line code."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import warn
from armblocks.robot import FrictionModel, Robot

_CONFIGURATION = re.compile(r"q(?!d{1,2}(?![A-Za-z])|dd?(?:ot|max|min)|uat|lim|\w*deg)\w+")
"""Names of configurations: not of speeds and accelerations such as ``qd0``, ``qdot`` and ``qdmax``, of
quaternions such as ``quat``, of limits or of angles in degrees."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Script:
    """The results of a script, by the names of its variables.

    ``robots``: in the order in which the variables first appeared, without copies of an earlier robot.
    ``variables``: strings, and matrices (rows, columns) in the units of the script.
    """

    robots: Mapping[str, Robot]
    variables: Mapping[str, NDArray[np.float64] | str]


def read_script(
    data: bytes, name: str, *, friction_model: FrictionModel = FrictionModel.SQUARED_GEAR
) -> Script:
    """Run a robot script and return its robots and variables.

    ``name`` is the file's name in messages. Both interfaces of the toolbox are supported: ``link`` and
    ``robot`` of releases up to 8 (value objects), ``Link`` and ``SerialLink`` of releases 9 and later (handle
    objects). They differ in the order of the D-H parameters. Every robot gets ``friction_model``, by default
    the model of releases 9.5 to 10 for scripts of all releases: the formulas of older releases have wrong
    signs or powers of the gear ratio; :class:`armblocks.robot.FrictionModel` lists them. The sign of gravity
    is reversed, because the toolbox's vector points up. Links are named ``link1``, ``link2`` …

    Vectors whose names begin with ``q``, such as ``qz`` and ``qn``, with one number for each joint of a robot
    are its named configurations. Exceptions are ``q``, names that begin with ``qlim`` or ``quat``, names with
    ``deg``, and usual names of speeds and accelerations such as ``qd``, ``qdd``, ``qd0`` and ``qdot``.

    Raises ``FormatError`` with file, line and text at the first invalid or unsupported line. Issues a
    warning for lines that a printed page splits, which are joined.
    """
    # Imported here: these modules would double the time to load a shipped robot, which needs no script.
    from armblocks.formats.matlab.interpreter import Interpreter
    from armblocks.formats.matlab.page_layout import without_page_breaks
    from armblocks.formats.matlab.records import RobotRecord
    from armblocks.formats.matlab.robot_records import robot_from_record
    from armblocks.formats.matlab.script_text import decode
    from armblocks.matlab.statements import parse_script

    source, restored_lines = without_page_breaks(decode(data, name))
    statements = parse_script(source)
    interpreter = Interpreter(source)
    interpreter.run(statements)
    if joined_lines := sorted({*restored_lines, *interpreter.joined_lines}):
        warn(
            f"{name}: lines {', '.join(map(str, joined_lines))} are split as on a printed page and were "
            "joined with the next line. MATLAB does not join them. Fix: check the robot's numbers, and write "
            "every statement on one line."
        )
    robots: dict[str, Robot] = {}
    variables: dict[str, NDArray[np.float64] | str] = {}
    for variable, value in interpreter.variables.items():
        if isinstance(value, RobotRecord):
            robot = robot_from_record(value, friction_model)
            robot = _with_configurations(robot, interpreter.variables)
            if robot not in robots.values():
                robots[variable] = robot
        elif isinstance(value, np.ndarray | str):
            variables[variable] = value
    return Script(robots=robots, variables=variables)


def _with_configurations(robot: Robot, variables: Mapping[str, object]) -> Robot:
    """The robot with the configurations that a script defines as vectors such as ``qz``."""
    matrices = {
        name: cast("NDArray[np.float64]", value)
        for name, value in variables.items()
        if _CONFIGURATION.fullmatch(name) and isinstance(value, np.ndarray)
    }
    found = {
        name: value.ravel()
        for name, value in matrices.items()
        if value.shape in ((1, robot.nq), (robot.nq, 1)) and np.isfinite(value).all()
    }
    return replace(robot, configurations=found) if found else robot
