"""The free joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.joints.joint import Joint
from armblocks.robot.joints.motions import AxisMotion, BallMotion, Motion


@dataclass(frozen=True, kw_only=True)
class Free(Joint):
    """No connection: six degrees of freedom relative to the parent, or to the world for a floating base.

    The proximal frame is the joint frame that is fixed to the parent, the distal frame the joint frame that
    is fixed to the link. q (7,) = position x y z (m) of the distal frame in the proximal frame, then a
    quaternion w x y z of length 1. qd (6,) = rate of the position, m/s, in *proximal* axes, then angular
    velocity, rad/s, in *distal* axes. tau (6,): forces and moments in the same axes. These are the
    conventions of MuJoCo.
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
