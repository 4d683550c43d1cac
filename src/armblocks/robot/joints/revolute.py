"""The revolute joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.joints.joint import Joint
from armblocks.robot.joints.motions import AxisMotion, Motion


@dataclass(frozen=True, kw_only=True)
class Revolute(Joint):
    """Rotation by q rad about the axis."""

    letter: ClassVar[str] = "R"

    @property
    def motions(self) -> tuple[Motion, ...]:
        return (AxisMotion(axis=self.axis, angular=1.0, offset=self.offset),)
