"""The revolute joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.joints.joint import Joint


@dataclass(frozen=True, kw_only=True)
class Revolute(Joint):
    """Rotation by q rad about the axis."""

    letter: ClassVar[str] = "R"
    unit: ClassVar[str] = "rad"

    @property
    def angular(self) -> float:
        return 1.0

    @property
    def linear(self) -> float:
        return 0.0
