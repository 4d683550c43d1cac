"""The free joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.joints.joint import Joint
from armblocks.robot.joints.motions import AxisMotion, BallMotion, Motion


@dataclass(frozen=True, kw_only=True)
class Free(Joint):
    """No connection: six degrees of freedom relative to the parent, or to the world for a floating base.

    q (7,) = position x y z (m) of the link's side in the joint frame on the parent, then a quaternion w x y z
    of length 1. qd (6,) = linear velocity of the origin in the axes of the joint frame on the *parent* (the
    rate of the position, m/s), then angular velocity in the axes of the joint frame on the *link's* side,
    rad/s. tau (6,): forces and moments in the same axes. These are the conventions of MuJoCo.
    """

    letter: ClassVar[str] = "6"
    parameters: ClassVar[tuple[str, ...]] = ()

    @property
    def motions(self) -> tuple[Motion, ...]:
        return (
            AxisMotion(axis=(1.0, 0.0, 0.0), linear=1.0, name="x"),
            AxisMotion(axis=(0.0, 1.0, 0.0), linear=1.0, name="y"),
            AxisMotion(axis=(0.0, 0.0, 1.0), linear=1.0, name="z"),
            BallMotion(),
        )
