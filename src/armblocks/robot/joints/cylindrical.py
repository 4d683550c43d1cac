"""The cylindrical joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.joints.joint import Joint
from armblocks.robot.joints.motions import AxisMotion, Motion


@dataclass(frozen=True, kw_only=True)
class Cylindrical(Joint):
    """Rotation by q[0] rad about the axis and translation by q[1] m along it, independently."""

    letter: ClassVar[str] = "C"
    parameters: ClassVar[tuple[str, ...]] = ("axis",)

    @property
    def motions(self) -> tuple[Motion, ...]:
        return (
            AxisMotion(axis=self.axis, angular=1.0, name="angle"),
            AxisMotion(axis=self.axis, linear=1.0, name="travel"),
        )
