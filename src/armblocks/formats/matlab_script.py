"""Robot scripts of the Robotics Toolbox for MATLAB, ``kr180.m``: all releases, straight-line code."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import ArmblocksWarning
from armblocks.robot import FrictionModel, Robot


@dataclass(frozen=True, kw_only=True, eq=False)
class Script:
    """What a script leaves behind, by the names of its variables.

    ``robots`` in the order in which the variables first appeared, without those that equal an earlier one
    (copies); ``variables`` its matrices, always (rows, columns), in the script's own units, and its texts.
    """

    robots: Mapping[str, Robot]
    variables: Mapping[str, NDArray[np.float64] | str]


def read_script(
    data: bytes, name: str, *, friction_model: FrictionModel = FrictionModel.SQUARED_GEAR
) -> Script:
    """Run a robot script and keep its robots and variables.

    ``name`` is what messages call the file. Both families of the toolbox are known: ``link``, ``robot`` of
    the releases up to 8 and ``Link``, ``SerialLink`` of 9 and later, with their own orders of the D-H
    numbers, copies and handles. Every robot gets ``friction_model``, by default that of releases 9.5 to 10
    whatever the script's release is: the formulas of older releases are errors in the signs or powers of the
    gear ratio, kept by name in :class:`armblocks.robot.FrictionModel`. Gravity changes its sign, as the
    toolbox's points up. Links are named ``link1``, ``link2`` …

    Raises ``FormatError`` with file, line and text at the first line that is not understood. Warns where
    lines were broken as on a printed page and were joined.
    """
    # Here and not above: half of what loading a shipped robot would cost, without a script anywhere.
    from armblocks.formats.matlab.interpreter import Interpreter
    from armblocks.formats.matlab.page_layout import without_page_breaks
    from armblocks.formats.matlab.records import RobotRecord
    from armblocks.formats.matlab.robot_records import finished_robot
    from armblocks.formats.matlab.script_text import decode
    from armblocks.matlab.statements import parse_script

    source, uncommented = without_page_breaks(decode(data, name))
    statements = parse_script(source)
    interpreter = Interpreter(source)
    interpreter.run(statements)
    if broken := sorted({*uncommented, *interpreter.joined_lines}):
        warnings.warn(
            f"{name}: lines {', '.join(map(str, broken))} are broken as on a printed page and were joined "
            "with what follows. MATLAB itself would not read them so. Fix: check the robot's numbers, and "
            "give every statement a line of its own.",
            ArmblocksWarning,
            stacklevel=2,
        )
    robots: dict[str, Robot] = {}
    variables: dict[str, NDArray[np.float64] | str] = {}
    for variable, value in interpreter.variables.items():
        if isinstance(value, RobotRecord):
            robot = finished_robot(value, friction_model)
            if robot not in robots.values():
                robots[variable] = robot
        elif isinstance(value, np.ndarray | str):
            variables[variable] = value
    return Script(robots=robots, variables=variables)
