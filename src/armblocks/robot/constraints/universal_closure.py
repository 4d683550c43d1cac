"""A Cardan joint that closes a loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.constraints.constraint import Closure
from armblocks.robot.constraints.relations import ORIGINS_COINCIDE, Perpendicular, Relation


@dataclass(frozen=True, kw_only=True)
class UniversalClosure(Closure):
    """A Cardan joint that closes a loop.

    The frames have the same origin. The z axis of the first frame, fixed to the first link, is perpendicular
    to the y axis of the second frame, fixed to the second link.
    """

    title: ClassVar[str] = "universal"

    @property
    def relations(self) -> tuple[Relation, ...]:
        return (*ORIGINS_COINCIDE, Perpendicular(2, 1))
