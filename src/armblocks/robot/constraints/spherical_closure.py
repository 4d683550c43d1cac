"""A ball joint that closes a loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.constraints.constraint import Closure
from armblocks.robot.constraints.relations import ORIGINS_COINCIDE, Relation


@dataclass(frozen=True, kw_only=True)
class SphericalClosure(Closure):
    """A ball joint that closes a loop. The frames have the same origin."""

    title: ClassVar[str] = "spherical"

    @property
    def relations(self) -> tuple[Relation, ...]:
        return ORIGINS_COINCIDE
