"""Memory of a routine: addresses, arrays of numbers, variables.

An array reads and writes its elements by an index, a variable by ``value``. No bounds are checked.
"""

from __future__ import annotations

from typing import Any, ClassVar, Generic, Self, cast

from armblocks.routines.tree import Constant, Kind, Local, Operand, Operation, Temporary
from armblocks.routines.values import (
    Boolean,
    Int32,
    Integer,
    Number,
    NumberT,
    Real,
    Value,
    Writer,
    boolean_operand,
    integer_operand,
)


class Address(Value):
    """An address, for example of a structure, whose fields are read by their offsets in bytes."""

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
        """Whether the address is null."""
        return self == Address(self.writer, Constant(Kind.ADDRESS, None))

    def after(self, offset: int) -> Address:
        """The address plus an offset in bytes."""
        target = self.writer.locate(self.operand, Constant(Kind.INTEGER, offset), Kind.BYTE)
        return Address(self.writer, target)

    def pointer(self, offset: int) -> Address:
        """The address in a field."""
        return Address(self.writer, self._field(offset, Kind.ADDRESS))

    def int32(self, offset: int) -> Integer:
        """The 32-bit integer in a field."""
        return Int32(self.writer, self._field(offset, Kind.INT32)).to_integer()

    @property
    def reals(self) -> Reals:
        """The doubles from this address on."""
        return Reals(self.writer, self.operand)

    @property
    def integers(self) -> Integers:
        """The integers from this address on."""
        return Integers(self.writer, self.operand)

    def _field(self, offset: int, kind: Kind) -> Temporary:
        return self.writer.load(self.after(offset).operand, kind)

    def _compare(self, operation: Operation, other: Address) -> Boolean:
        return Boolean(self.writer, self.writer.compute(Kind.BOOLEAN, operation, self.operand, other.operand))


class Array(Value):
    """A contiguous array of numbers of one type in memory.

    The view begins ``first`` elements after its operand, so that a vector of a workspace needs no separate
    address until one of its elements is used.
    """

    __slots__ = ("first",)
    kind = Kind.ADDRESS
    element: ClassVar[Kind]

    def __init__(self, writer: Writer, operand: Operand, first: int = 0) -> None:
        super().__init__(writer, operand)
        self.first = first

    def address(self, index: Integer | int) -> Operand:
        """Address of an element."""
        index_operand: Operand
        if isinstance(index, int):
            if not self.first + index:
                return self.operand
            index_operand = Constant(Kind.INTEGER, self.first + index)
        else:
            index_operand = integer_operand(index + self.first if self.first else index)
        return self.writer.locate(self.operand, index_operand, self.element)

    @property
    def start(self) -> Address:
        """Address of the first element."""
        return Address(self.writer, self.address(0))


class NumberArray(Array, Generic[NumberT]):
    """Numbers in memory; ``v[i]`` reads one, ``v[i] = x`` writes one. No bounds are checked."""

    __slots__ = ()
    number: ClassVar[type[Number[Any]]]

    def __getitem__(self, index: Integer | int) -> NumberT:
        value = self.writer.load(self.address(index), self.element)
        return cast("NumberT", self.number(self.writer, value))

    def __setitem__(self, index: Integer | int, value: NumberT | float) -> None:
        self.writer.store(self.number.operand_of(value), self.address(index))

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
        """Add atomically to an element; returns the previous value."""
        before = self.writer.fetch_add(integer_operand(value), self.address(index))
        return Integer(self.writer, before)

    def acquire(self, index: Integer | int) -> Integer:
        """Read an element that other threads write, with acquire ordering."""
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
    """A variable of a routine, read and written as ``value``. The back end keeps it in a register if
    possible."""

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
        """The present value."""
        return self.number(self.writer, self.writer.load(self.local, self.number.kind))

    @value.setter
    def value(self, value: NumberT | float) -> None:
        self.writer.store(self.number.operand_of(value), self.local)


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
        """The present value."""
        return Integer(self.writer, self.writer.load(self.local, Kind.INTEGER))

    @value.setter
    def value(self, value: Integer | int) -> None:
        self.writer.store(integer_operand(value), self.local)


class BooleanVariable(Variable):
    """A variable condition."""

    __slots__ = ()

    @property
    def value(self) -> Boolean:
        """The present value."""
        return Boolean(self.writer, self.writer.load(self.local, Kind.BOOLEAN))

    @value.setter
    def value(self, value: Boolean | bool) -> None:
        self.writer.store(boolean_operand(value), self.local)


class AddressVariable(Variable):
    """A variable address."""

    __slots__ = ()

    @property
    def value(self) -> Address:
        """The present value."""
        return Address(self.writer, self.writer.load(self.local, Kind.ADDRESS))

    @value.setter
    def value(self, value: Address) -> None:
        self.writer.store(value.operand, self.local)
