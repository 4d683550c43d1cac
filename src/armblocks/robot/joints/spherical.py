"""The spherical joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.joints.joint import Joint
from armblocks.robot.joints.motions import BallMotion, Motion


@dataclass(frozen=True, kw_only=True)
class Spherical(Joint):
    """Any rotation about the origin of the joint frame (ball joint).

    The proximal frame is the joint frame that is fixed to the parent, the distal frame the joint frame that
    is fixed to the link. q is a quaternion w x y z of length 1, the rotation of the distal in the proximal
    frame: ``p_proximal = R(q) p_distal``. qd is the angular velocity relative to the parent in distal axes,
    rad/s; tau are the moments about these axes, N m. See :class:`BallMotion`.
    """

    letter: ClassVar[str] = "S"
    parameters: ClassVar[tuple[str, ...]] = ()

    @property
    def motions(self) -> tuple[Motion, ...]:
        return (BallMotion(),)
