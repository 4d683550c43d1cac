"""A joint that turns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.joints.joint import Joint


@dataclass(frozen=True, kw_only=True)
class Revolute(Joint):
    """Turns by q rad about its axis."""

    letter: ClassVar[str] = "R"
    unit: ClassVar[str] = "rad"

    @property
    def turn(self) -> float:
        return 1.0

    @property
    def slide(self) -> float:
        return 0.0
