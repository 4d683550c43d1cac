"""Attachments of closed loops and parallel rods on links: drawings extend the links to these points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from armblocks.robot.link import Link
from armblocks.robot.robot import Robot
from armblocks.robot.shapes import Cylinder

_Array = NDArray[np.float64]
LinkPoints = dict[str | None, list[tuple[_Array, _Array]]]
"""By link, or None for the base: points (3,) and unit joint axes (3,) in the frame of the link."""

_SAMPLES = 4
_SAME = 1e-6
"""Distance, relative to the size of the robot, below which two points are the same."""


def closure_points(robot: Robot) -> LinkPoints:
    """The attachments of the closures of loops that join two points of links."""
    points: LinkPoints = {}
    for closure in robot.closures:
        for attachment in (closure.first, closure.second):
            pose = attachment.pose
            points.setdefault(attachment.link, []).append((np.array(pose.translation), pose.R[:, 2]))
    return points


def rod_points(robot: Robot, frames: Sequence[_Array], size: float) -> LinkPoints:
    """The points of links at which the free ends of drawn rods are in all configurations.

    ``frames``: the poses (L + 2, 4, 4) of base, links and tool in several configurations. The rods of
    parallelograms, which couplings move, are drawn by cylinders and have no joint at their second end.
    """
    parents = {link.parent for link in robot.links}
    poses = np.stack(frames)
    points: LinkPoints = {}
    for row, link in enumerate(robot.links, start=1):
        if link.name in parents or link is robot.links[-1] or (end := _rod_end(link)) is None:
            continue
        world = poses[:, row] @ np.append(end, 1.0)
        for other, carrier in _others(robot, link):
            local = np.linalg.inv(poses[:, other]) @ world[:, :, None]
            if np.ptp(local[:, :3, 0], axis=0).max() < _SAME * size:
                inverse = np.array(np.linalg.inv(poses[0, other]), dtype=np.float64)
                axis = inverse[:3, :3] @ poses[0, row, :3, :3] @ _axis(link)
                points.setdefault(carrier, []).append((local[0, :3, 0], axis))
                break
    return points


def configurations(robot: Robot) -> _Array:
    """Random configurations (N, nq) near the neutral one, where points of different links do not coincide."""
    rng = np.random.default_rng(0)
    return robot.neutral + 0.3 * rng.standard_normal((_SAMPLES, robot.nq))


def _axis(link: Link) -> _Array:
    return np.array(link.joint.axis)


def _others(robot: Robot, link: Link) -> list[tuple[int, str | None]]:
    """Rows and names of the links to which the end of a rod can be joined."""
    rows: list[tuple[int, str | None]] = [(0, None)]
    rows += [(row, one.name) for row, one in enumerate(robot.links, start=1)]
    return [(row, name) for row, name in rows if name not in (link.name, link.parent)]


def _rod_end(link: Link) -> _Array | None:
    """The end of a rod that is drawn as one cylinder from the joint of the link."""
    if link.geometry is None or len(link.geometry) != 1 or not isinstance(link.geometry[0], Cylinder):
        return None
    shape = link.geometry[0]
    T = np.array(shape.pose)
    ends = [T[:3, 3] + side * shape.length / 2 * T[:3, 2] for side in (-1.0, 1.0)]
    ends.sort(key=lambda end: float(np.linalg.norm(end)))
    return ends[1] if np.linalg.norm(ends[0]) < 0.2 * shape.length else None
