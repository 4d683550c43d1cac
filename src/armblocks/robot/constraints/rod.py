"""A massless rod between two points."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from armblocks.errors import RobotError
from armblocks.robot.constraints.constraint import Closure
from armblocks.robot.constraints.relations import Distance, Relation
from armblocks.robot.fields import number


@dataclass(frozen=True, kw_only=True)
class Rod(Closure):
    """A massless rod with ball joints at its ends.

    The origins of the frames have the distance ``length``, m.
    """

    length: float

    title: ClassVar[str] = "rod"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "length", number(self.length, where=f"length of rod '{self.name}'"))
        if not 0.0 < self.length < math.inf:
            raise RobotError(
                f"the length of the rod is {self.length:g} m",
                where=f"constraint '{self.name}'",
                allowed="a finite length above zero",
                fix="correct the length, or use a spherical closure for coincident points",
            )

    @property
    def relations(self) -> tuple[Relation, ...]:
        return (Distance(self.length),)
