"""The fixed joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.joints.joint import Joint
from armblocks.robot.joints.motions import Motion


@dataclass(frozen=True, kw_only=True)
class Fixed(Joint):
    """A rigid connection to the parent (a weld), without a joint coordinate."""

    letter: ClassVar[str] = "F"

    @property
    def motions(self) -> tuple[Motion, ...]:
        return ()
