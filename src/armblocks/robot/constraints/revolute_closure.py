"""A hinge that closes a loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.constraints.constraint import Closure
from armblocks.robot.constraints.relations import ORIGINS_COINCIDE, Z_AXES_PARALLEL, Relation


@dataclass(frozen=True, kw_only=True)
class RevoluteClosure(Closure):
    """A hinge that closes a loop.

    The frames have the same origin and the same z axis, about which they rotate.
    """

    title: ClassVar[str] = "revolute"

    @property
    def relations(self) -> tuple[Relation, ...]:
        return (*ORIGINS_COINCIDE, *Z_AXES_PARALLEL)
