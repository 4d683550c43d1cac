"""A slider that closes a loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.constraints.constraint import Closure
from armblocks.robot.constraints.relations import SAME_AXES, NoDisplacement, Relation


@dataclass(frozen=True, kw_only=True)
class PrismaticClosure(Closure):
    """A slider that closes a loop. The frames have the same axes; the second frame slides along z."""

    title: ClassVar[str] = "prismatic"

    @property
    def relations(self) -> tuple[Relation, ...]:
        return (NoDisplacement(0), NoDisplacement(1), *SAME_AXES)
