"""Typed values of a routine: numbers and conditions with operators.

Each operation appends a statement to the routine that the value belongs to, at the position where Python
evaluates it. Python numbers are constants. Values have the types of the routine: a type checker distinguishes
doubles, integers and arrays (:mod:`armblocks.routines.memory`). Python's ``if`` raises an error for a
:class:`Boolean`, because its value is not known yet.
"""

from __future__ import annotations

from typing import Any, ClassVar, Generic, NoReturn, Self, TypeVar, cast

from armblocks.routines.tree import (
    Compute,
    Constant,
    FetchAdd,
    Kind,
    Load,
    Locate,
    Operand,
    Operation,
    Statement,
    Store,
    Temporary,
)


class Writer:
    """The present position for new statements; ``statements`` is the present part of the tree."""

    def __init__(self) -> None:
        self.statements: list[Statement] = []

    def compute(self, kind: Kind, operation: Operation, *operands: Operand) -> Temporary:
        """Append an operation; return its result."""
        result = Temporary(kind)
        self.statements.append(Compute(result, operation, operands))
        return result

    def load(self, address: Operand, kind: Kind, *, acquiring: bool = False) -> Temporary:
        """Append the reading of a number."""
        result = Temporary(kind)
        self.statements.append(Load(result, address, acquiring))
        return result

    def fetch_add(self, value: Operand, address: Operand) -> Temporary:
        """Append an atomic addition; returns the previous value."""
        result = Temporary(Kind.INTEGER)
        self.statements.append(FetchAdd(result, address, value))
        return result

    def store(self, value: Operand, address: Operand) -> None:
        """Append the writing of a number."""
        self.statements.append(Store(value, address))

    def locate(self, base: Operand, index: Operand, element: Kind) -> Temporary:
        """Append the address of an element."""
        result = Temporary(Kind.ADDRESS)
        self.statements.append(Locate(result, base, index, element))
        return result


class Value:
    """A value of a routine."""

    __slots__ = ("operand", "writer")
    kind: ClassVar[Kind]

    def __init__(self, writer: Writer, operand: Operand) -> None:
        self.writer = writer
        self.operand = operand

    __hash__ = object.__hash__

    def __bool__(self) -> NoReturn:
        raise TypeError(
            "A value of a routine is not known while the routine is written. "
            "Fix: use 'with r.when(condition):' or 'select' in place of Python's if, and, or, not."
        )


class Condition(Value):
    """A condition of a routine, or one in each lane."""

    __slots__ = ()

    def __and__(self, other: Self) -> Self:
        return self._with(Operation.AND, other)

    def __or__(self, other: Self) -> Self:
        return self._with(Operation.OR, other)

    def __invert__(self) -> Self:
        return self._with(Operation.NOT)

    def _with(self, operation: Operation, *others: Self) -> Self:
        operands = (value.operand for value in (self, *others))
        return type(self)(self.writer, self.writer.compute(self.kind, operation, *operands))


class Boolean(Condition):
    """A condition of a routine, for branches."""

    __slots__ = ()
    kind = Kind.BOOLEAN

    def count(self) -> Integer:
        """1 where the condition holds, else 0."""
        return Integer(self.writer, self.writer.compute(Kind.INTEGER, Operation.TO_INTEGER, self.operand))


ConditionT = TypeVar("ConditionT", bound=Condition)


class Number(Value, Generic[ConditionT]):
    """A double, or one in each lane. Each operation is rounded once; comparisons with NaN are false, except
    ``!=``."""

    __slots__ = ()
    condition: ClassVar[type[Condition]]
    """The type of comparisons."""

    def __add__(self, other: Self | float) -> Self:
        return self.compute(Operation.ADD, self, other)

    def __radd__(self, other: float) -> Self:
        return self.compute(Operation.ADD, other, self)

    def __sub__(self, other: Self | float) -> Self:
        return self.compute(Operation.SUBTRACT, self, other)

    def __rsub__(self, other: float) -> Self:
        return self.compute(Operation.SUBTRACT, other, self)

    def __mul__(self, other: Self | float) -> Self:
        return self.compute(Operation.MULTIPLY, self, other)

    def __rmul__(self, other: float) -> Self:
        return self.compute(Operation.MULTIPLY, other, self)

    def __truediv__(self, other: Self | float) -> Self:
        return self.compute(Operation.DIVIDE, self, other)

    def __rtruediv__(self, other: float) -> Self:
        return self.compute(Operation.DIVIDE, other, self)

    def __neg__(self) -> Self:
        return self.compute(Operation.NEGATE, self)

    def __abs__(self) -> Self:
        return self.compute(Operation.ABSOLUTE, self)

    def __lt__(self, other: Self | float) -> ConditionT:
        return self._compare(Operation.LESS, other)

    def __le__(self, other: Self | float) -> ConditionT:
        return self._compare(Operation.LESS_EQUAL, other)

    def __gt__(self, other: Self | float) -> ConditionT:
        return self._compare(Operation.GREATER, other)

    def __ge__(self, other: Self | float) -> ConditionT:
        return self._compare(Operation.GREATER_EQUAL, other)

    def __eq__(self, other: Self | float) -> ConditionT:  # type: ignore[override]  # as in NumPy: element by element
        return self._compare(Operation.EQUAL, other)

    def __ne__(self, other: Self | float) -> ConditionT:  # type: ignore[override]
        return self._compare(Operation.NOT_EQUAL, other)

    __hash__ = object.__hash__

    @property
    def ordered(self) -> ConditionT:
        """Whether the number is not NaN."""
        return self._compare(Operation.ORDERED, self)

    @property
    def finite(self) -> ConditionT:
        """Whether the number is neither infinite nor NaN: ``0 a`` is zero."""
        return self * 0.0 == 0.0

    def bits(self) -> Any:
        """The bits as an integer, or as one in each lane."""
        raise NotImplementedError

    def compute(self, operation: Operation, *operands: Self | float) -> Self:
        """An operation on numbers of this kind."""
        return type(self)(
            self.writer, self.writer.compute(self.kind, operation, *map(self.operand_of, operands))
        )

    @classmethod
    def constant(cls, writer: Writer, value: float) -> Self:
        """A constant, for functions that do not accept a Python number."""
        return cls(writer, Constant(cls.kind, float(value)))

    @classmethod
    def operand_of(cls, value: Self | float) -> Operand:
        """The operand of a number; a Python number is a constant."""
        return value.operand if isinstance(value, cls) else Constant(cls.kind, float(cast("float", value)))

    def _compare(self, operation: Operation, other: Self | float) -> ConditionT:
        result = self.writer.compute(self.condition.kind, operation, self.operand, self.operand_of(other))
        return cast("ConditionT", self.condition(self.writer, result))


NumberT = TypeVar("NumberT", bound=Number[Any])


class Real(Number[Boolean]):
    """A double."""

    __slots__ = ()
    kind, condition = Kind.REAL, Boolean

    def to_integer(self) -> Integer:
        """Truncate to an integer, which must fit into 64 bits."""
        return Integer(self.writer, self.writer.compute(Kind.INTEGER, Operation.TO_INTEGER, self.operand))

    def bits(self) -> Integer:
        """The bits as an integer. Adding 1 gives the bits of the next double, away from zero."""
        return Integer(self.writer, self.writer.compute(Kind.INTEGER, Operation.BITS, self.operand))


class Integer(Value):
    """A 64-bit signed integer. Sums and products wrap around; ``//`` truncates toward zero, and ``>>`` keeps
    the sign."""

    __slots__ = ()
    kind = Kind.INTEGER

    def __add__(self, other: Integer | int) -> Integer:
        return self._integer(Operation.ADD, self, other)

    def __radd__(self, other: int) -> Integer:
        return self._integer(Operation.ADD, other, self)

    def __sub__(self, other: Integer | int) -> Integer:
        return self._integer(Operation.SUBTRACT, self, other)

    def __rsub__(self, other: int) -> Integer:
        return self._integer(Operation.SUBTRACT, other, self)

    def __mul__(self, other: Integer | int) -> Integer:
        return self._integer(Operation.MULTIPLY, self, other)

    def __rmul__(self, other: int) -> Integer:
        return self._integer(Operation.MULTIPLY, other, self)

    def __floordiv__(self, other: Integer | int) -> Integer:
        return self._integer(Operation.DIVIDE, self, other)

    def __and__(self, other: Integer | int) -> Integer:
        return self._integer(Operation.AND, self, other)

    def __or__(self, other: Integer | int) -> Integer:
        return self._integer(Operation.OR, self, other)

    def __lshift__(self, bits: Integer | int) -> Integer:
        return self._integer(Operation.SHIFT_LEFT, self, bits)

    def __rshift__(self, bits: Integer | int) -> Integer:
        return self._integer(Operation.SHIFT_RIGHT, self, bits)

    def unsigned_quotient(self, divisor: Integer | int) -> Integer:
        """The quotient, rounded down, of the 64 bits as an unsigned integer and ``divisor``."""
        return self._integer(Operation.DIVIDE_UNSIGNED, self, divisor)

    def unsigned_remainder(self, divisor: Integer | int) -> Integer:
        """The remainder of :meth:`unsigned_quotient`."""
        return self._integer(Operation.REMAINDER_UNSIGNED, self, divisor)

    def __lt__(self, other: Integer | int) -> Boolean:
        return self._compare(Operation.LESS, other)

    def __le__(self, other: Integer | int) -> Boolean:
        return self._compare(Operation.LESS_EQUAL, other)

    def __gt__(self, other: Integer | int) -> Boolean:
        return self._compare(Operation.GREATER, other)

    def __ge__(self, other: Integer | int) -> Boolean:
        return self._compare(Operation.GREATER_EQUAL, other)

    def __eq__(self, other: Integer | int) -> Boolean:  # type: ignore[override]
        return self._compare(Operation.EQUAL, other)

    def __ne__(self, other: Integer | int) -> Boolean:  # type: ignore[override]
        return self._compare(Operation.NOT_EQUAL, other)

    __hash__ = object.__hash__

    def to_real(self) -> Real:
        """The integer as a double, rounded to nearest."""
        return Real(self.writer, self.writer.compute(Kind.REAL, Operation.TO_REAL, self.operand))

    def to_int32(self) -> Int32:
        """The lower half."""
        return Int32(self.writer, self.writer.compute(Kind.INT32, Operation.TO_INT32, self.operand))

    def from_bits(self) -> Real:
        """The double that has these bits."""
        return Real(self.writer, self.writer.compute(Kind.REAL, Operation.FROM_BITS, self.operand))

    def _integer(self, operation: Operation, *operands: Integer | int) -> Integer:
        integers = [integer_operand(operand) for operand in operands]
        return Integer(self.writer, self.writer.compute(Kind.INTEGER, operation, *integers))

    def _compare(self, operation: Operation, other: Integer | int) -> Boolean:
        result = self.writer.compute(Kind.BOOLEAN, operation, self.operand, integer_operand(other))
        return Boolean(self.writer, result)


class Int32(Value):
    """A 32-bit signed integer, the ``int`` of C functions."""

    __slots__ = ()
    kind = Kind.INT32

    def to_integer(self) -> Integer:
        """The integer with 64 bits."""
        return Integer(self.writer, self.writer.compute(Kind.INTEGER, Operation.TO_INTEGER, self.operand))


def real_operand(value: Real | float) -> Operand:
    """The operand of a double; a Python number is a constant."""
    return Real.operand_of(value)


def integer_operand(value: Integer | int) -> Operand:
    """The operand of an integer; a Python number is a constant."""
    return value.operand if isinstance(value, Integer) else Constant(Kind.INTEGER, int(value))


def boolean_operand(value: Boolean | bool) -> Operand:
    """The operand of a condition; ``True`` and ``False`` are constants."""
    return value.operand if isinstance(value, Boolean) else Constant(Kind.BOOLEAN, value)
