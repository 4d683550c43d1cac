"""The tip of a robot: the link that carries the tool, which is the last link of the description."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armblocks.robot.link import Link
from armblocks.robot.robot import Robot


def with_tip(robot: Robot, tip: str) -> Robot:
    """The robot with the link named ``tip`` as its last link; the other links keep their order.

    If the joint of that link moves, its coordinate becomes the last entry of q, also in named configurations.
    Raises UnknownNameError.
    """
    last = robot.link(tip)
    return replace(robot, links=(*(link for link in robot.links if link is not last), last))


def deepest_tip(links: Sequence[Link]) -> str:
    """The end link of the chain with the most degrees of freedom; of several such links, the last.

    ``links``: parents before their children.
    """
    joints: dict[str | None, int] = {None: 0}
    for link in links:
        joints[link.name] = joints[link.parent] + link.joint.nv
    parents = {link.parent for link in links}
    ends = [link.name for link in links if link.name not in parents]
    return max(reversed(ends), key=lambda name: joints[name])
