"""The prismatic joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.joints.joint import Joint
from armblocks.robot.joints.motions import AxisMotion, Motion


@dataclass(frozen=True, kw_only=True)
class Prismatic(Joint):
    """Translation by q m along the axis."""

    letter: ClassVar[str] = "P"

    @property
    def motions(self) -> tuple[Motion, ...]:
        return (AxisMotion(axis=self.axis, linear=1.0, offset=self.offset),)
