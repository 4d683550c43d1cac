"""A point that stays in a plane."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.constraints.constraint import Closure
from armblocks.robot.constraints.relations import NoDisplacement, Relation


@dataclass(frozen=True, kw_only=True)
class PointOnPlane(Closure):
    """A point that stays in a plane. The origin of the second frame is in the xy plane of the first frame."""

    title: ClassVar[str] = "point on plane"

    @property
    def relations(self) -> tuple[Relation, ...]:
        return (NoDisplacement(2),)
