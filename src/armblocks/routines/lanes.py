"""Values in lanes: the same operation on several doubles at a time, in one vector register.

The program determines the number of lanes; with one lane, the values are single doubles. Control flow is
common to all lanes. A :class:`Mask` is a condition in each lane and selects values.
"""

from __future__ import annotations

from armblocks.routines.memory import NumberArray, Reals
from armblocks.routines.tree import Constant, Kind, Operand, Operation
from armblocks.routines.values import Boolean, Condition, Integer, Number, Value


class Mask(Condition):
    """A condition in each lane."""

    __slots__ = ()
    kind = Kind.MASK

    @property
    def any(self) -> Boolean:
        """Whether the condition holds in any lane."""
        return Boolean(self.writer, self.writer.compute(Kind.BOOLEAN, Operation.ANY, self.operand))

    def bits(self) -> Integer:
        """An integer whose bit ``k`` is the condition of lane ``k``."""
        return Integer(self.writer, self.writer.compute(Kind.INTEGER, Operation.LANE_BITS, self.operand))


class Lanes(Number[Mask]):
    """A double in each lane. A Python number is the same in all lanes."""

    __slots__ = ()
    kind, condition = Kind.LANES, Mask

    def bits(self) -> IntegerLanes:
        """The bits as integers, see :meth:`armblocks.routines.values.Real.bits`."""
        return IntegerLanes(
            self.writer, self.writer.compute(Kind.INTEGER_LANES, Operation.BITS, self.operand)
        )


class IntegerLanes(Value):
    """A 64-bit signed integer in each lane. A Python number is the same in all lanes."""

    __slots__ = ()
    kind = Kind.INTEGER_LANES

    def __add__(self, other: IntegerLanes | int) -> IntegerLanes:
        return self._integer(Operation.ADD, self, other)

    def __sub__(self, other: IntegerLanes | int) -> IntegerLanes:
        return self._integer(Operation.SUBTRACT, self, other)

    def __rsub__(self, other: int) -> IntegerLanes:
        return self._integer(Operation.SUBTRACT, other, self)

    def __and__(self, other: IntegerLanes | int) -> IntegerLanes:
        return self._integer(Operation.AND, self, other)

    def __lt__(self, other: IntegerLanes | int) -> Mask:
        return self._compare(Operation.LESS, other)

    def __ge__(self, other: IntegerLanes | int) -> Mask:
        return self._compare(Operation.GREATER_EQUAL, other)

    def __eq__(self, other: IntegerLanes | int) -> Mask:  # type: ignore[override]
        return self._compare(Operation.EQUAL, other)

    __hash__ = object.__hash__

    def unsigned_quotient(self, divisor: int) -> IntegerLanes:
        """The quotient, rounded down, of the 64 bits as an unsigned integer and ``divisor``."""
        return self._integer(Operation.DIVIDE_UNSIGNED, self, divisor)

    def from_bits(self) -> Lanes:
        """The doubles that have these bits."""
        return Lanes(self.writer, self.writer.compute(Kind.LANES, Operation.FROM_BITS, self.operand))

    def _integer(self, operation: Operation, *operands: IntegerLanes | int) -> IntegerLanes:
        integers = map(_integer_operand, operands)
        return IntegerLanes(self.writer, self.writer.compute(Kind.INTEGER_LANES, operation, *integers))

    def _compare(self, operation: Operation, other: IntegerLanes | int) -> Mask:
        result = self.writer.compute(Kind.MASK, operation, self.operand, _integer_operand(other))
        return Mask(self.writer, result)


def _integer_operand(value: IntegerLanes | int) -> Operand:
    return value.operand if isinstance(value, IntegerLanes) else Constant(Kind.INTEGER_LANES, value)


class LaneArray(NumberArray[Lanes]):
    """Rows of one double for each lane, aligned to the size of a row; ``v[i]`` is a row."""

    __slots__ = ()
    element, number = Kind.LANES, Lanes

    @property
    def reals(self) -> Reals:
        """The same memory as single doubles: lane ``k`` of row ``i`` has the index ``i * lanes + k``."""
        return self.start.reals
