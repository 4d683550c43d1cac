"""A linear relation between joint coordinates."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar, Self

from armblocks.errors import RobotError
from armblocks.robot.constraints.constraint import Constraint
from armblocks.robot.fields import number


@dataclass(frozen=True, kw_only=True)
class Coupling(Constraint):
    """A gear, rack, belt or mimic joint: the sum of ``coefficient q`` over ``terms`` is ``constant``.

    ``terms``: pairs of a joint with one coordinate and its coefficient. The first joint depends on the
    others: it is not an entry of the robot's q. The joint b that mimics a, ``q_b = multiplier q_a +
    offset``, has the terms ``(("b", 1.0), ("a", -multiplier))`` and the constant ``offset``.
    """

    terms: tuple[tuple[str, float], ...]
    constant: float = 0.0

    title: ClassVar[str] = "coupling"

    def __post_init__(self) -> None:
        super().__post_init__()
        where = f"constraint '{self.name}'"
        terms = tuple((str(joint), number(factor, where=where)) for joint, factor in self.terms)
        object.__setattr__(self, "terms", terms)
        object.__setattr__(self, "constant", number(self.constant, where=where))
        names = [joint for joint, _ in terms]
        if not terms or len(set(names)) != len(names):
            raise RobotError(
                "a joint occurs twice" if terms else "no joint is coupled",
                where=where,
                allowed="pairs of joint and coefficient, each joint once",
                fix="add the coefficients of equal joints" if terms else "name the coupled joints",
            )
        if not all(math.isfinite(value) for value in (self.constant, *(value for _, value in terms))):
            raise RobotError(
                "a number is not finite", where=where, allowed="finite numbers", fix="correct the number"
            )
        if any(value == 0.0 for _, value in terms):
            raise RobotError("a coefficient is 0", where=where, allowed="other numbers", fix="omit the joint")

    def with_renamed_link(self, old: str, new: str) -> Self:
        terms = tuple((new if joint == old else joint, factor) for joint, factor in self.terms)
        return replace(self, terms=terms)

    @property
    def joints(self) -> tuple[str, ...]:
        return tuple(joint for joint, _ in self.terms)
