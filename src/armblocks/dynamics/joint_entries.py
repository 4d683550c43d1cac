"""The entries of q and qd that belong to named joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from armblocks.robot.robot import Robot


class JointEntries(NamedTuple):
    """The indices of the coordinates in q and of the speeds in qd of some joints, each in ascending order."""

    positions: list[int]
    speeds: list[int]


def entries_of(robot: Robot, joints: Sequence[str], *, others: bool = False) -> JointEntries:
    """The entries of the named joints, or of all ``others``."""
    positions: list[int] = []
    speeds: list[int] = []
    position = speed = 0
    for link in robot.moving_links:
        nq, nv = link.joint.nq, link.joint.nv
        if (link.name in joints) is not others:
            positions += range(position, position + nq)
            speeds += range(speed, speed + nv)
        position, speed = position + nq, speed + nv
    return JointEntries(positions, speeds)
