"""The spherical joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.joints.joint import Joint
from armblocks.robot.joints.motions import BallMotion, Motion


@dataclass(frozen=True, kw_only=True)
class Spherical(Joint):
    """Any rotation about the origin of the joint frame (ball joint).

    q is a quaternion w x y z of length 1, the rotation from the link's side to the joint frame on the parent.
    qd is the angular velocity relative to the parent in the axes of the joint frame on the link's side,
    rad/s; tau are the moments about these axes, N m. See :class:`BallMotion`.
    """

    letter: ClassVar[str] = "S"
    parameters: ClassVar[tuple[str, ...]] = ()

    @property
    def motions(self) -> tuple[Motion, ...]:
        return (BallMotion(),)
