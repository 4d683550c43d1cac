"""The prismatic joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.joints.joint import Joint


@dataclass(frozen=True, kw_only=True)
class Prismatic(Joint):
    """Translation by q m along the axis."""

    letter: ClassVar[str] = "P"
    unit: ClassVar[str] = "m"

    @property
    def angular(self) -> float:
        return 0.0

    @property
    def linear(self) -> float:
        return 1.0
