"""The kinematics and the named configurations of a robot as tables of plain text."""

from __future__ import annotations

import math
from collections.abc import Sequence

from armblocks.robot.joints import Joint
from armblocks.robot.link import Link
from armblocks.robot.robot import Robot

_HEADING = ("theta", "d", "a", "alpha", "offset")
_WIDTH = 10


def dh_table(robot: Robot) -> list[str]:
    """The D-H table in the format of releases 9 and 10 of the toolbox, with the names of the joints.

    Empty if a link has no D-H row. The joint variable is printed as ``q``. theta, alpha and the offset of a
    revolute joint are in rad, the other numbers in m.
    """
    if any(link.dh is None for link in robot.links):
        return []
    first = max(len("joint"), *map(len, robot.joint_names)) + 2
    rule = "+" + "-" * first + "+" + ("-" * _WIDTH + "+") * len(_HEADING)
    heading = f"| {'joint':<{first - 1}}|" + "".join(f"{name:>{_WIDTH - 1}} |" for name in _HEADING)
    rows = [
        f"| {link.name:<{first - 1}}|" + "".join(f"{cell:>{_WIDTH}}|" for cell in _cells(link))
        for link in robot.moving_links
    ]
    return [rule, heading, rule, *rows, rule]


def _cells(link: Link) -> Sequence[str]:
    row = link.dh
    if row is None:
        return [""] * len(_HEADING)
    theta, d = (f"{row.theta:.4g}", "q") if row.sigma else ("q", f"{row.d:.4g}")
    return [theta, d, f"{row.a:.4g}", f"{row.alpha:.4g}", f"{row.offset:.4g}"]


def axis_text(joint: Joint) -> str:
    """The axis of a joint; empty for joints without one."""
    if not joint.moves or "axis" not in joint.parameters:
        return ""
    return " ".join(f"{part:.3g}" for part in joint.axis)


def kinematics_text(robot: Robot) -> str:
    """The D-H table; without D-H rows a line for each link with its parent, joint, axis and position."""
    table = dh_table(robot)
    if table:
        return "\n".join([*table, "theta and alpha in rad, d and a in m"])
    rows = [("link", "parent", "joint", "axis", "at q = 0: x, y, z m")]
    for link in robot.links:
        x, y, z = link.pose().translation
        axis = axis_text(link.joint)
        kind = type(link.joint).__name__.lower()
        rows.append((link.name, link.parent or "(base)", kind, axis, f"{x:.5g}, {y:.5g}, {z:.5g}"))
    widths = [max(map(len, column)) for column in zip(*rows)]
    return "\n".join("  ".join(c.ljust(w) for c, w in zip(row, widths)).rstrip() for row in rows)


def configuration_lines(robot: Robot) -> list[str]:
    """A line for each named configuration, with angles in degrees and lengths in m, in aligned columns."""
    units = [entry.unit for entry in robot.positions]
    rows = [
        [name, *(coordinate_text(value, unit) for value, unit in zip(q, units))]
        for name, q in robot.configurations.entries
    ]
    widths = [max(map(len, column)) for column in zip(*rows)]
    return [
        "  ".join([row[0].ljust(widths[0]), *(cell.rjust(w) for cell, w in zip(row[1:], widths[1:]))])
        for row in rows
    ]


def coordinate_text(value: float, unit: str) -> str:
    """A coordinate with five digits: in degrees if the unit is rad, else with its unit."""
    shown, mark = (math.degrees(value), "\N{DEGREE SIGN}") if unit == "rad" else (value, f" {unit}".rstrip())
    return f"{shown + 0.0:.5g}{mark}"
