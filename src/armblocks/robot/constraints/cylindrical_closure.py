"""A cylindrical joint that closes a loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.constraints.constraint import Closure
from armblocks.robot.constraints.relations import Z_AXES_PARALLEL, NoDisplacement, Relation


@dataclass(frozen=True, kw_only=True)
class CylindricalClosure(Closure):
    """A cylindrical joint that closes a loop.

    The z axes of the frames are on one line. The frames rotate about this line and slide along it.
    """

    title: ClassVar[str] = "cylindrical"

    @property
    def relations(self) -> tuple[Relation, ...]:
        return (NoDisplacement(0), NoDisplacement(1), *Z_AXES_PARALLEL)
