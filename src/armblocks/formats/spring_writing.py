"""Springs of a robot for the writers of URDF, SDF and MJCF."""

from __future__ import annotations

from typing import NamedTuple

from armblocks.formats.robot_writing import warn_of_loss
from armblocks.robot import JointSpring, LineSpring, Robot


class WrittenSpring(NamedTuple):
    """The sum of all springs at one joint: the torque on the joint is ``-stiffness (q - rest)``."""

    stiffness: float
    rest: float


def joint_springs(robot: Robot) -> dict[str, WrittenSpring]:
    """The springs at joints, by the name of the joint. Springs without stiffness have no effect."""
    found: dict[str, WrittenSpring] = {}
    for spring in robot.springs:
        if isinstance(spring, JointSpring) and spring.stiffness:
            other = found.get(spring.joint, WrittenSpring(0.0, spring.rest))
            stiffness = other.stiffness + spring.stiffness
            share = spring.stiffness / stiffness
            rest = other.rest + share * (spring.rest - other.rest)
            found[spring.joint] = WrittenSpring(stiffness, rest)
    return found


def line_springs(robot: Robot) -> list[LineSpring]:
    """The springs between two points that exert a force."""
    return [
        spring
        for spring in robot.springs
        if isinstance(spring, LineSpring) and (spring.stiffness or spring.preload)
    ]


def warn_of_springs(robot: Robot, names: list[str], format: str) -> None:
    """Warn of springs that the file does not contain."""
    if names:
        what = f"springs that are not part of the {format} file, so that its dynamics differ: "
        warn_of_loss(f"robot '{robot.name}'", what + ", ".join(f"'{name}'" for name in names))
