"""A point that stays on a line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.constraints.constraint import Closure
from armblocks.robot.constraints.relations import NoDisplacement, Relation


@dataclass(frozen=True, kw_only=True)
class PointOnLine(Closure):
    """A point that stays on a line. The origin of the second frame is on the z axis of the first frame."""

    title: ClassVar[str] = "point on line"

    @property
    def relations(self) -> tuple[Relation, ...]:
        return (NoDisplacement(0), NoDisplacement(1))
