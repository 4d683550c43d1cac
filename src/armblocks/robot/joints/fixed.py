"""The fixed joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.joints.joint import Joint


@dataclass(frozen=True, kw_only=True)
class Fixed(Joint):
    """A rigid connection to the parent, without a joint coordinate."""

    letter: ClassVar[str] = "F"
    unit: ClassVar[str] = ""

    @property
    def angular(self) -> float:
        return 0.0

    @property
    def linear(self) -> float:
        return 0.0
