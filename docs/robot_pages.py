"""The page of the shipped robots: each with its picture, its D-H table and the limits of its joints."""

from __future__ import annotations

import warnings
from collections.abc import Iterator

import numpy as np
from block_pages import prose, table

import armblocks as ab
from armblocks.pictures.svg import svg_inline
from armblocks.rendering import arm_picture
from armblocks.robot import Robot

POSES = {
    "kr180": (0.5, 0.2, 0.3, 0.0),
    "kr180_cell": (0.5, 0.2, 0.3, 0.0),
    "planar3r": (0.4, 0.7, 0.6),
    "puma560": (0.5, 0.9, -2.6, 0.0, 0.6, 0.0),
    "twolink": (0.6, 0.7),
}
"""Joint positions of the pictures, rad; 0 for robots that are not listed."""
SIZE = (420.0, 340.0)
"""Width and height of a picture, px."""


def robots_page() -> str:
    """The page of all shipped robots."""
    lines = [
        "# Shipped robots",
        "",
        '`ab.load_robot("kr180")` loads a robot by its name. In a terminal, `armblocks show kr180` prints',
        "all parameters of this robot. The robot editor of `armblocks studio` shows robots and edits copies.",
        "",
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ab.errors.InertiaWarning)
        for name in ab.list_robots():
            lines += _robot(name)
    return "\n".join(lines)


def _dh_table(robot: Robot) -> Iterator[str]:
    """The D-H table with its convention; nothing for a robot with a link that has no D-H row."""
    rows = [(link.name, link.dh) for link in robot.moving_links if link.dh is not None]
    if len(rows) < len(robot.links):
        return
    conventions = " and ".join(dict.fromkeys(row.convention.value for _, row in rows))
    yield from (f"D-H table ({conventions}); `q` is the joint coordinate:", "")
    cells = [
        (
            f"`{name}`",
            f"{row.theta:.4g}" if row.sigma else "`q`",
            "`q`" if row.sigma else f"{row.d:.4g}",
            f"{row.a:.4g}",
            f"{row.alpha * 180 / np.pi:g}°",
            f"{row.offset:.4g}",
        )
        for name, row in rows
    ]
    yield from table(("joint", "theta, rad", "d, m", "a, m", "alpha", "offset"), cells)


def _robot(name: str) -> Iterator[str]:
    arm = ab.load_robot(name)
    robot = arm.robot
    q = POSES.get(name, (0.0,) * robot.n)
    maker = f" ({robot.manufacturer})" if robot.manufacturer else ""
    title = prose(f"{robot.name}{maker}: {robot.comment}" if robot.comment else f"{robot.name}{maker}")
    picture = svg_inline(arm_picture(robot, q, width=SIZE[0], height=SIZE[1]), f"robot-{name}")
    yield from (f"## {name}", "", f'<figure class="narrow">{picture}</figure>', "")
    joints = f"{robot.n} joints: {robot.joint_letters} (R revolute, P prismatic)"
    yield from (f"{title}. {joints}.", "")
    yield from _dh_table(robot)
    unit_symbols = {"rad": "°", "m": " m"}
    rows: list[tuple[str, ...]] = []
    for k, (joint, unit) in enumerate(zip(robot.joint_names, robot.joint_units)):
        scale = 180 / np.pi if unit == "rad" else 1.0
        low, high = robot.qlim[k] * scale
        speed, torque = robot.speed_limits[k] * scale, robot.torque_limits[k]
        rows.append(
            (
                f"`{joint}`",
                f"{low:g} … {high:g}{unit_symbols[unit]}" if np.isfinite([low, high]).all() else "",
                f"{speed:g}{unit_symbols[unit]}/s" if np.isfinite(speed) else "",
                f"{torque:g} {'N m' if unit == 'rad' else 'N'}" if np.isfinite(torque) else "",
            )
        )
    if any(any(row[1:]) for row in rows):
        yield from table(("joint", "range", "maximum speed", "maximum torque"), rows)
