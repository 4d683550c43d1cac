"""Typed values of a routine: numbers with operators, arrays in memory, variables.

Each operation appends a statement to the routine that the value belongs to, at the place where Python
evaluates it. Python numbers stand for constants. The types are those of the routine: a type checker tells a
double from an integer and both from an array, and Python's ``if`` refuses a :class:`Boolean`, whose value is
not known yet.
"""

from __future__ import annotations

from typing import Any, ClassVar, Generic, NoReturn, Self, TypeVar, cast

from armblocks.routines.tree import (
    Compute,
    Constant,
    FetchAdd,
    Kind,
    Load,
    Local,
    Locate,
    Operand,
    Operation,
    Statement,
    Store,
    Temporary,
)


class Writer:
    """Where statements are appended; ``statements`` is the part of the tree that is being written."""

    def __init__(self) -> None:
        self.statements: list[Statement] = []

    def compute(self, kind: Kind, operation: Operation, *operands: Operand) -> Temporary:
        """Append an operation; gives its result."""
        result = Temporary(kind)
        self.statements.append(Compute(result, operation, operands))
        return result

    def load(self, address: Operand, kind: Kind, *, acquiring: bool = False) -> Temporary:
        """Append the reading of a number."""
        result = Temporary(kind)
        self.statements.append(Load(result, address, acquiring))
        return result

    def fetch_add(self, value: Operand, address: Operand) -> Temporary:
        """Append an addition that other threads see in one step; gives what was there before."""
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
    """A value of a routine, at the place where it was computed."""

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
    """A condition: it decides what a routine does."""

    __slots__ = ()
    kind = Kind.BOOLEAN

    def count(self) -> Integer:
        """1 where it holds, else 0."""
        return Integer(self.writer, self.writer.compute(Kind.INTEGER, Operation.TO_INTEGER, self.operand))


ConditionT = TypeVar("ConditionT", bound=Condition)


class Number(Value, Generic[ConditionT]):
    """A double, or one in each lane. Each operation is rounded once; comparisons with NaN fail, except
    ``!=``."""

    __slots__ = ()
    condition: ClassVar[type[Condition]]
    """What comparisons give."""

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
        """Whether it is not NaN."""
        return self._compare(Operation.ORDERED, self)

    @property
    def finite(self) -> ConditionT:
        """Whether it is neither infinite nor NaN: ``0 a`` is zero."""
        return self * 0.0 == 0.0

    def compute(self, operation: Operation, *operands: Self | float) -> Self:
        """An operation on numbers of this kind."""
        return type(self)(self.writer, self.writer.compute(self.kind, operation, *map(self.place, operands)))

    @classmethod
    def constant(cls, writer: Writer, value: float) -> Self:
        """A constant, for where a Python number does not do."""
        return cls(writer, Constant(cls.kind, float(value)))

    @classmethod
    def place(cls, value: Self | float) -> Operand:
        """The operand of a number; a Python number is a constant."""
        return value.operand if isinstance(value, cls) else Constant(cls.kind, float(cast("float", value)))

    def _compare(self, operation: Operation, other: Self | float) -> ConditionT:
        found = self.writer.compute(self.condition.kind, operation, self.operand, self.place(other))
        return cast("ConditionT", self.condition(self.writer, found))


NumberT = TypeVar("NumberT", bound=Number[Any])


class Real(Number[Boolean]):
    """A double."""

    __slots__ = ()
    kind, condition = Kind.REAL, Boolean

    def to_integer(self) -> Integer:
        """Cut to an integer, which must be within 64 bits."""
        return Integer(self.writer, self.writer.compute(Kind.INTEGER, Operation.TO_INTEGER, self.operand))

    def bits(self) -> Integer:
        """The bits as an integer: one more is the next double, away from zero."""
        return Integer(self.writer, self.writer.compute(Kind.INTEGER, Operation.BITS, self.operand))


class Integer(Value):
    """A 64-bit signed integer. Sums and products wrap around; ``//`` cuts toward zero, and ``>>`` keeps the
    sign."""

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

    def __lshift__(self, places: Integer | int) -> Integer:
        return self._integer(Operation.SHIFT_LEFT, self, places)

    def __rshift__(self, places: Integer | int) -> Integer:
        return self._integer(Operation.SHIFT_RIGHT, self, places)

    def unsigned_quotient(self, divisor: Integer | int) -> Integer:
        """The quotient where both are read as numbers without a sign."""
        return self._integer(Operation.DIVIDE_UNSIGNED, self, divisor)

    def unsigned_remainder(self, divisor: Integer | int) -> Integer:
        """What is left over by :meth:`unsigned_quotient`."""
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
        """As a double, to nearest."""
        return Real(self.writer, self.writer.compute(Kind.REAL, Operation.TO_REAL, self.operand))

    def to_int32(self) -> Int32:
        """The lower half."""
        return Int32(self.writer, self.writer.compute(Kind.INT32, Operation.TO_INT32, self.operand))

    def from_bits(self) -> Real:
        """The double that has these bits."""
        return Real(self.writer, self.writer.compute(Kind.REAL, Operation.FROM_BITS, self.operand))

    def _integer(self, operation: Operation, *operands: Integer | int) -> Integer:
        places = [integer_operand(operand) for operand in operands]
        return Integer(self.writer, self.writer.compute(Kind.INTEGER, operation, *places))

    def _compare(self, operation: Operation, other: Integer | int) -> Boolean:
        found = self.writer.compute(Kind.BOOLEAN, operation, self.operand, integer_operand(other))
        return Boolean(self.writer, found)


class Int32(Value):
    """A 32-bit signed integer, as functions written in C take and give it."""

    __slots__ = ()
    kind = Kind.INT32

    def to_integer(self) -> Integer:
        """As 64 bits."""
        return Integer(self.writer, self.writer.compute(Kind.INTEGER, Operation.TO_INTEGER, self.operand))


class Address(Value):
    """An address, such as that of a structure, whose fields are read by their offsets in bytes."""

    __slots__ = ()
    kind = Kind.ADDRESS

    def __eq__(self, other: Address) -> Boolean:  # type: ignore[override]
        return self._compare(Operation.EQUAL, other)

    def __ne__(self, other: Address) -> Boolean:  # type: ignore[override]
        return self._compare(Operation.NOT_EQUAL, other)

    def __le__(self, other: Address) -> Boolean:
        return self._compare(Operation.LESS_EQUAL, other)

    __hash__ = object.__hash__

    @property
    def is_null(self) -> Boolean:
        """Whether it points nowhere."""
        return self == Address(self.writer, Constant(Kind.ADDRESS, None))

    def after(self, offset: int) -> Address:
        """The address so many bytes further."""
        place = self.writer.locate(self.operand, Constant(Kind.INTEGER, offset), Kind.BYTE)
        return Address(self.writer, place)

    def address(self, offset: int) -> Address:
        """The address in a field."""
        return Address(self.writer, self._field(offset, Kind.ADDRESS))

    def int32(self, offset: int) -> Integer:
        """The 32-bit integer in a field."""
        return Int32(self.writer, self._field(offset, Kind.INT32)).to_integer()

    @property
    def reals(self) -> Reals:
        """Doubles from here on."""
        return Reals(self.writer, self.operand)

    @property
    def integers(self) -> Integers:
        """Integers from here on."""
        return Integers(self.writer, self.operand)

    def _field(self, offset: int, kind: Kind) -> Temporary:
        return self.writer.load(self.after(offset).operand, kind)

    def _compare(self, operation: Operation, other: Address) -> Boolean:
        return Boolean(self.writer, self.writer.compute(Kind.BOOLEAN, operation, self.operand, other.operand))


class Array(Value):
    """Numbers of one kind that follow one another in memory, from an address on.

    The view begins ``first`` elements after its operand, so that a vector of a workspace costs no address of
    its own until one of its elements is used.
    """

    __slots__ = ("first",)
    kind = Kind.ADDRESS
    element: ClassVar[Kind]

    def __init__(self, writer: Writer, operand: Operand, first: int = 0) -> None:
        super().__init__(writer, operand)
        self.first = first

    def address(self, index: Integer | int) -> Operand:
        """Address of an element."""
        place: Operand
        if isinstance(index, int):
            if not self.first + index:
                return self.operand
            place = Constant(Kind.INTEGER, self.first + index)
        else:
            place = integer_operand(index + self.first if self.first else index)
        return self.writer.locate(self.operand, place, self.element)

    @property
    def start(self) -> Address:
        """Address of the first element."""
        return Address(self.writer, self.address(0))


class NumberArray(Array, Generic[NumberT]):
    """Numbers in memory; ``v[i]`` reads one, ``v[i] = x`` writes one. No bounds are checked."""

    __slots__ = ()
    number: ClassVar[type[Number[Any]]]

    def __getitem__(self, index: Integer | int) -> NumberT:
        found = self.writer.load(self.address(index), self.element)
        return cast("NumberT", self.number(self.writer, found))

    def __setitem__(self, index: Integer | int, value: NumberT | float) -> None:
        self.writer.store(self.number.place(value), self.address(index))

    def after(self, index: Integer | int) -> Self:
        """The numbers from an element on."""
        if isinstance(index, int):
            return type(self)(self.writer, self.operand, self.first + index)
        return type(self)(self.writer, self.address(index))


class Reals(NumberArray[Real]):
    """Doubles in memory."""

    __slots__ = ()
    element, number = Kind.REAL, Real

    @property
    def integers(self) -> Integers:
        """The same memory, read and written as integers."""
        return Integers(self.writer, self.operand, self.first)


class Integers(Array):
    """Integers in memory; ``v[i]`` reads one, ``v[i] = x`` writes one. No bounds are checked."""

    __slots__ = ()
    element = Kind.INTEGER

    def __getitem__(self, index: Integer | int) -> Integer:
        return Integer(self.writer, self.writer.load(self.address(index), Kind.INTEGER))

    def __setitem__(self, index: Integer | int, value: Integer | int) -> None:
        self.writer.store(integer_operand(value), self.address(index))

    def after(self, index: Integer | int) -> Integers:
        """The integers from an element on."""
        if isinstance(index, int):
            return Integers(self.writer, self.operand, self.first + index)
        return Integers(self.writer, self.address(index))

    def fetch_add(self, index: Integer | int, value: Integer | int) -> Integer:
        """Add to an element that other threads write too, in one step; gives what it was before."""
        before = self.writer.fetch_add(integer_operand(value), self.address(index))
        return Integer(self.writer, before)

    def acquire(self, index: Integer | int) -> Integer:
        """Read an element that other threads write; all that they wrote before it is seen from here on."""
        return Integer(self.writer, self.writer.load(self.address(index), Kind.INTEGER, acquiring=True))


class Addresses(Array):
    """Addresses in memory; ``v[i]`` reads one. No bounds are checked."""

    __slots__ = ()
    element = Kind.ADDRESS

    def __getitem__(self, index: Integer | int) -> Address:
        return Address(self.writer, self.writer.load(self.address(index), Kind.ADDRESS))

    def after(self, index: int) -> Addresses:
        """The addresses from an element on."""
        return Addresses(self.writer, self.operand, self.first + index)


class Variable:
    """A variable of a routine, read and written as ``value``. A back end keeps it in a register if it can."""

    __slots__ = ("local", "writer")

    def __init__(self, writer: Writer, local: Local) -> None:
        self.writer = writer
        self.local = local


class NumberVariable(Variable, Generic[NumberT]):
    """A variable double, or one in each lane."""

    __slots__ = ("number",)

    def __init__(self, initial: NumberT) -> None:
        super().__init__(initial.writer, Local(initial.kind))
        self.number = type(initial)
        self.value = initial

    @property
    def value(self) -> NumberT:
        """The value that was written last."""
        return self.number(self.writer, self.writer.load(self.local, self.number.kind))

    @value.setter
    def value(self, value: NumberT | float) -> None:
        self.writer.store(self.number.place(value), self.local)


class RealVariable(NumberVariable[Real]):
    """A variable double."""

    __slots__ = ()

    @property
    def memory(self) -> Reals:
        """The variable as an array of one element, for functions that take one."""
        return Reals(self.writer, self.local)


class IntegerVariable(Variable):
    """A variable integer."""

    __slots__ = ()

    @property
    def value(self) -> Integer:
        """The value that was written last."""
        return Integer(self.writer, self.writer.load(self.local, Kind.INTEGER))

    @value.setter
    def value(self, value: Integer | int) -> None:
        self.writer.store(integer_operand(value), self.local)


class BooleanVariable(Variable):
    """A variable condition."""

    __slots__ = ()

    @property
    def value(self) -> Boolean:
        """The value that was written last."""
        return Boolean(self.writer, self.writer.load(self.local, Kind.BOOLEAN))

    @value.setter
    def value(self, value: Boolean | bool) -> None:
        self.writer.store(boolean_operand(value), self.local)


class AddressVariable(Variable):
    """A variable address."""

    __slots__ = ()

    @property
    def value(self) -> Address:
        """The value that was written last."""
        return Address(self.writer, self.writer.load(self.local, Kind.ADDRESS))

    @value.setter
    def value(self, value: Address) -> None:
        self.writer.store(value.operand, self.local)


def real_operand(value: Real | float) -> Operand:
    """The operand of a double; a Python number is a constant."""
    return Real.place(value)


def integer_operand(value: Integer | int) -> Operand:
    """The operand of an integer; a Python number is a constant."""
    return value.operand if isinstance(value, Integer) else Constant(Kind.INTEGER, int(value))


def boolean_operand(value: Boolean | bool) -> Operand:
    """The operand of a condition; ``True`` and ``False`` are constants."""
    return value.operand if isinstance(value, Boolean) else Constant(Kind.BOOLEAN, value)
