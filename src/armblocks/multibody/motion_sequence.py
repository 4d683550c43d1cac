"""Joints of a drawn mechanism: the joint types of the robot model, or any sequence of elementary motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from armblocks.robot.joints import AxisMotion, BallMotion, Joint, Motion, Prismatic, Revolute


@dataclass(frozen=True, kw_only=True)
class MotionSequence(Joint):
    """A joint that is any sequence of elementary motions, such as a gimbal or a bushing."""

    sequence: tuple[Motion, ...] = ()

    letter: ClassVar[str] = "*"
    parameters: ClassVar[tuple[str, ...]] = ()

    @property
    def motions(self) -> tuple[Motion, ...]:
        return self.sequence


def robot_joint(motions: Sequence[Motion]) -> Joint:
    """The joint with these motions. Joints with one axis have the types that robots usually have."""
    if len(motions) == 1 and isinstance(motion := motions[0], AxisMotion) and motion.offset == 0.0:
        if (motion.angular, motion.linear) == (1.0, 0.0):
            return Revolute(axis=motion.axis)
        if (motion.angular, motion.linear) == (0.0, 1.0):
            return Prismatic(axis=motion.axis)
    return MotionSequence(sequence=tuple(motions))


def reversed_motions(motions: Sequence[Motion]) -> tuple[Motion, ...]:
    """The motions from the follower to the base, with the same coordinates.

    The inverse of a motion by q about and along an axis is the motion by q about and along the opposite axis.
    The inverse of a ball motion is a ball motion with the conjugate quaternion.
    """
    return tuple(
        motion if isinstance(motion, BallMotion) else replace(motion, axis=_opposite(motion.axis))
        for motion in reversed(motions)
    )


def _opposite(axis: tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, z = axis
    return (0.0 - x, 0.0 - y, 0.0 - z)
