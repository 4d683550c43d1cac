"""Values in lanes: the same operation on several doubles at a time, in one vector register.

The program determines the number of lanes; with one lane, the values are single doubles. Integers, conditions
and therefore the control flow are common to all lanes. A :class:`Mask` selects values per lane.
"""

from __future__ import annotations

from armblocks.routines.memory import NumberArray, Reals
from armblocks.routines.tree import Kind, Operation
from armblocks.routines.values import Boolean, Condition, Number


class Mask(Condition):
    """A condition in each lane."""

    __slots__ = ()
    kind = Kind.MASK

    @property
    def any(self) -> Boolean:
        """Whether the condition holds in any lane."""
        return Boolean(self.writer, self.writer.compute(Kind.BOOLEAN, Operation.ANY, self.operand))


class Lanes(Number[Mask]):
    """A double in each lane. A Python number is the same in all lanes."""

    __slots__ = ()
    kind, condition = Kind.LANES, Mask


class LaneArray(NumberArray[Lanes]):
    """Rows of one double for each lane, aligned to the size of a row; ``v[i]`` is a row."""

    __slots__ = ()
    element, number = Kind.LANES, Lanes

    @property
    def reals(self) -> Reals:
        """The same memory as single doubles: the number of lane ``k`` of row ``i`` is ``i lanes + k``."""
        return self.start.reals
