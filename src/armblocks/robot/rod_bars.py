"""The bars of the massless rods of a robot, which are drawn between two points of its links."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armblocks.robot.constraints import Rod
from armblocks.robot.robot import Robot

Array = NDArray[np.float64]


class RodBar(NamedTuple):
    """The bar of a rod: from a point of one row of ``link_poses`` to a point of another row.

    ``rows``: 0 the base, then the links; ``points``: (3,) each, m, in the frames of the rows. ``length``: m.
    """

    rows: tuple[int, int]
    points: tuple[tuple[float, float, float], tuple[float, float, float]]
    length: float


def rod_bars(robot: Robot) -> tuple[RodBar, ...]:
    """The bars of the rods, in the order of the constraints."""
    rows: dict[str | None, int] = {link.name: row for row, link in enumerate(robot.links, start=1)}
    rows[None] = 0
    return tuple(
        RodBar(
            (rows[rod.first.link], rows[rod.second.link]),
            (rod.first.pose.translation, rod.second.pose.translation),
            rod.length,
        )
        for rod in robot.closures
        if isinstance(rod, Rod)
    )


def with_bars(bars: Sequence[RodBar], poses: Array) -> Array:
    """The poses (L+2, 4, 4) of base, links and tool, and then the pose of each bar.

    The z axis of a bar points from its first to its second end; its origin is the first end.
    """
    return np.concatenate([poses, *(_pose(bar, poses)[None] for bar in bars)]) if bars else poses


def _pose(bar: RodBar, poses: Array) -> Array:
    first, second = (
        poses[row, :3, :3] @ np.array(point) + poses[row, :3, 3] for row, point in zip(bar.rows, bar.points)
    )
    between = second - first
    distance = float(np.linalg.norm(between))
    z = between / distance if distance > 0.0 else poses[bar.rows[0], :3, 2]
    # The bar is round, so that its rotation about z is not visible.
    x = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = x, np.cross(z, x), z, first
    return pose
