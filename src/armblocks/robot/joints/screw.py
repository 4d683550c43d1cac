"""The screw joint."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from armblocks.errors import RobotError
from armblocks.robot.fields import number
from armblocks.robot.joints.joint import Joint
from armblocks.robot.joints.motions import AxisMotion, Motion


@dataclass(frozen=True, kw_only=True)
class Screw(Joint):
    """Rotation by q rad about the axis and translation by ``pitch q / 2π`` m along it.

    ``pitch``: translation per turn, m; positive for a right-handed thread.
    """

    pitch: float = 0.0

    letter: ClassVar[str] = "H"
    parameters: ClassVar[tuple[str, ...]] = ("axis", "offset", "pitch")

    def __post_init__(self) -> None:
        object.__setattr__(self, "pitch", number(self.pitch, where="pitch of a joint"))
        if self.pitch == 0.0 or not math.isfinite(self.pitch):
            raise RobotError(
                f"the pitch of a screw joint is {self.pitch:g} m",
                where="joint",
                allowed="a translation per turn other than zero",
                fix="give the pitch, or use a revolute joint",
            )
        super().__post_init__()

    @property
    def motions(self) -> tuple[Motion, ...]:
        lead = self.pitch / (2.0 * math.pi)
        return (AxisMotion(axis=self.axis, angular=1.0, linear=lead, offset=self.offset),)
