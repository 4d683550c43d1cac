"""The planar joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.joints.joint import Joint
from armblocks.robot.joints.motions import AxisMotion, Motion


@dataclass(frozen=True, kw_only=True)
class Planar(Joint):
    """Motion in the x-y plane of the joint frame: translation along x and y, then rotation about z.

    q is (x, y, angle) in m and rad. qd are the rates of q: the linear velocity is in the axes of the joint
    frame that is fixed to the parent.
    """

    letter: ClassVar[str] = "E"
    parameters: ClassVar[tuple[str, ...]] = ()

    @property
    def motions(self) -> tuple[Motion, ...]:
        return (
            AxisMotion(axis=(1.0, 0.0, 0.0), linear=1.0, name="x"),
            AxisMotion(axis=(0.0, 1.0, 0.0), linear=1.0, name="y"),
            AxisMotion(axis=(0.0, 0.0, 1.0), angular=1.0, name="angle"),
        )
