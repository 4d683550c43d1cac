"""A planar joint that closes a loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.constraints.constraint import Closure
from armblocks.robot.constraints.relations import Z_AXES_PARALLEL, NoDisplacement, Relation


@dataclass(frozen=True, kw_only=True)
class PlanarClosure(Closure):
    """A planar joint that closes a loop.

    The frames have the same xy plane, in which they slide and rotate.
    """

    title: ClassVar[str] = "planar"

    @property
    def relations(self) -> tuple[Relation, ...]:
        return (NoDisplacement(2), *Z_AXES_PARALLEL)
