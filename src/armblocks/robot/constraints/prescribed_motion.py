"""A joint whose motion is given."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

from armblocks.robot.constraints.constraint import Constraint


@dataclass(frozen=True, kw_only=True)
class PrescribedMotion(Constraint):
    """A joint that moves in a given way: its motion is an input, and the torque that it needs is a result.

    ``joint``: a joint of any type that moves and that no coupling determines. All its degrees of freedom are
    prescribed. The time functions are not part of the robot: :meth:`armblocks.Arm.hybrid_dynamics` and the
    blocks PositionDrivenArm and AccelerationDrivenArm have them as inputs.
    """

    joint: str

    title: ClassVar[str] = "prescribed motion"

    def with_renamed_link(self, old: str, new: str) -> Self:
        return replace(self, joint=new) if self.joint == old else self

    @property
    def joints(self) -> tuple[str, ...]:
        return (self.joint,)
