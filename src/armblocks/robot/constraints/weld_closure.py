"""A rigid connection that closes a loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.constraints.constraint import Closure
from armblocks.robot.constraints.relations import ORIGINS_COINCIDE, SAME_AXES, Relation


@dataclass(frozen=True, kw_only=True)
class WeldClosure(Closure):
    """A rigid connection that closes a loop. The two frames coincide."""

    title: ClassVar[str] = "weld"

    @property
    def relations(self) -> tuple[Relation, ...]:
        return (*ORIGINS_COINCIDE, *SAME_AXES)
