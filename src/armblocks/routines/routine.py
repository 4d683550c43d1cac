"""The routine language: functions with variables, memory and structured control flow, written in Python.

A function of a program is a Python function whose first parameter is the :class:`Routine` that it writes
into; the annotations of all other parameters are its signature::

    def norm(r: Routine, x: Reals, n: Integer) -> Real:
        total = r.real(0.0)
        for i in r.range(0, n):
            total.value = fma(x[i], x[i], total.value)
        return square_root(total.value)

    program = Program()
    length = program.define(norm)          # elsewhere: r.call(length, x, n)

Python runs the function once, and its operations on values are recorded: a Python ``if`` selects the recorded
code, ``with r.when(condition):`` is a branch of the routine. A value is valid where the statement that
computes it has run on every path. A value that differs between paths must be kept in a variable.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Concatenate, Generic, ParamSpec, TypeVar, cast, get_args

from armblocks.routines import tree
from armblocks.routines.lanes import LaneArray, Lanes, Mask
from armblocks.routines.memory import (
    Address,
    Addresses,
    AddressVariable,
    Array,
    BooleanVariable,
    Integers,
    IntegerVariable,
    NumberVariable,
    Reals,
    RealVariable,
)
from armblocks.routines.tree import Constant, Jump, Kind, Local, Mark, Operand, Statement, Table, Temporary
from armblocks.routines.values import (
    Boolean,
    Int32,
    Integer,
    NumberT,
    Real,
    Value,
    Writer,
    boolean_operand,
    integer_operand,
    real_operand,
)

UNROLL = 8
"""Loops with at most this number of iterations are unrolled, which keeps the vectors of small systems in
registers."""

P = ParamSpec("P")
R = TypeVar("R")

_TYPES: tuple[type[Value], ...] = (
    *(Real, Integer, Boolean, Reals, Integers),
    *(Lanes, Mask, LaneArray),
    *(Int32, Address, Addresses),
)
_BY_NAME: dict[str, type[Value]] = {kind.__name__: kind for kind in _TYPES}


@dataclass(frozen=True, slots=True)
class Function(Generic[P, R]):
    """A function that routines call, with the type parameters of the Python function that records it."""

    symbol: str
    write: Callable[Concatenate[Routine, P], R]
    results: tuple[type[Value], ...]
    address: Operand | None = None

    def at(self, address: Address) -> Function[P, R]:
        """The function at an address, with the parameters and results of this function."""
        return replace(self, address=address.operand)


def external(write: Callable[Concatenate[Routine, P], R], symbol: str = "") -> Function[P, R]:
    """An external function, declared by its name (or ``symbol``) and annotations; its body is never run."""
    return Function(symbol or write.__name__, write, _results(write))


class Program:
    """Functions and tables in the order of their first use. ``lanes`` is a power of two."""

    def __init__(self, lanes: int = 1) -> None:
        self.lanes = lanes
        self.parts: dict[str, tree.Function | Table] = {}

    def define(
        self,
        write: Callable[Concatenate[Routine, P], R],
        symbol: str = "",
        *,
        public: bool = False,
        inlined: bool | None = None,
        distinct: bool = False,
        rest: Sequence[str] = (),
    ) -> Function[P, R]:
        """The function that ``write`` records, with its name unless a ``symbol`` is given.

        ``public``: the function is called from outside the program. ``inlined``: whether it is inlined into
        its callers; ``None`` leaves the decision to the back end. ``distinct``: the arrays that are passed to
        the function do not overlap. ``rest`` names the parameters that Python's ``*`` collects; all have one
        type. If the symbol is already defined, the existing definition stays.
        """
        symbol = symbol or write.__name__
        if symbol not in self.parts:
            types = _parameters(write)
            if write.__code__.co_flags & inspect.CO_VARARGS:
                _, kind = types.popitem()
                types |= dict.fromkeys(rest, kind)
            parameters = {name: Temporary(kind.kind, name) for name, kind in types.items()}
            function = tree.Function(
                symbol,
                tuple(parameters.values()),
                tuple(kind.kind for kind in _results(write)),
                public=public,
                inlined=inlined,
                distinct=distinct,
            )
            self.parts[symbol] = function
            routine = Routine(self, function.body)
            arguments = [types[name](routine, operand) for name, operand in parameters.items()]
            returned = cast("Callable[..., Value | tuple[Value, ...] | None]", write)(routine, *arguments)
            assert routine.statements is function.body, "Python's break has left a loop of the routine"
            routine.return_(
                *(returned if isinstance(returned, tuple) else () if returned is None else (returned,))
            )
        return Function(symbol, write, _results(write))

    def integers(self, symbol: str, numbers: Sequence[int]) -> Table:
        """A table of integer constants."""
        return self._table(Table(symbol, tuple(numbers), Kind.INTEGER))

    def reals(self, symbol: str, numbers: Sequence[float]) -> Table:
        """A table of constant doubles."""
        return self._table(Table(symbol, tuple(numbers), Kind.REAL))

    def filled_in(self, symbol: str, count: int) -> Table:
        """A table of addresses. They are null until the code that loads the program sets them."""
        return self._table(Table(symbol, (None,) * count, Kind.ADDRESS, filled_in=True))

    def _table(self, table: Table) -> Table:
        self.parts.setdefault(table.symbol, table)
        return table


class Part:
    """A part of a routine that can be left early, and repeated from its start."""

    def __init__(self, routine: Routine, start: Mark, end: Mark) -> None:
        self._routine = routine
        self._start = start
        self._end = end

    def leave(self) -> None:
        """Leave this part."""
        self._routine.jump(self._end)

    def leave_when(self, condition: Boolean) -> None:
        """Leave this part if the condition holds."""
        with self._routine.when(condition):
            self.leave()

    def leave_unless(self, condition: Boolean) -> None:
        """Leave this part if the condition fails."""
        with self._routine.unless(condition):
            self.leave()

    def again(self) -> None:
        """Go back to the start of this part."""
        self._routine.jump(self._start)

    def again_when(self, condition: Boolean) -> None:
        """Go back to the start of this part where the condition holds."""
        with self._routine.when(condition):
            self.again()

    def again_unless(self, condition: Boolean) -> None:
        """Go back to the start of this part where the condition fails."""
        with self._routine.unless(condition):
            self.again()


class Routine(Writer):
    """Writes the body of one function: variables, control flow, calls."""

    def __init__(self, program: Program, statements: list[Statement]) -> None:
        super().__init__()
        self.program = program
        self.statements = statements

    # Variables and constants.

    def real(self, initial: Real | float) -> RealVariable:
        """A double variable. Its initial value is assigned each time this position is reached."""
        return RealVariable(Real(self, real_operand(initial)))

    def variable(self, initial: NumberT) -> NumberVariable[NumberT]:
        """A variable of the type of ``initial``, which is assigned each time this position is reached."""
        return NumberVariable(initial)

    def integer(self, initial: Integer | int) -> IntegerVariable:
        """An integer variable. Its initial value is assigned each time this position is reached."""
        variable = IntegerVariable(self, Local(Kind.INTEGER))
        variable.value = initial
        return variable

    def boolean(self, initial: Boolean | bool) -> BooleanVariable:
        """A Boolean variable. Its initial value is assigned each time this position is reached."""
        variable = BooleanVariable(self, Local(Kind.BOOLEAN))
        variable.value = initial
        return variable

    def address(self, initial: Address) -> AddressVariable:
        """An address variable. Its initial value is assigned each time this position is reached."""
        variable = AddressVariable(self, Local(Kind.ADDRESS))
        variable.value = initial
        return variable

    def local_integers(self, count: int) -> Integers:
        """Memory for contiguous integers during the function call."""
        return Integers(self, Local(Kind.INTEGER, count))

    def local_lanes(self, count: int) -> LaneArray:
        """Memory for rows of lanes during the function call."""
        return LaneArray(self, Local(Kind.LANES, count))

    def local_reals(self, count: int) -> Reals:
        """Memory for contiguous doubles during the function call."""
        return Reals(self, Local(Kind.REAL, count))

    def constant(self, value: float) -> Real:
        """A constant double, for functions that do not accept a Python number."""
        return Real(self, real_operand(value))

    def constant_integer(self, value: int) -> Integer:
        """A constant integer, for functions that do not accept a Python number."""
        return Integer(self, integer_operand(value))

    def constant_boolean(self, value: bool) -> Boolean:
        """A constant condition."""
        return Boolean(self, boolean_operand(value))

    def reals(self, symbol: str, numbers: Sequence[float]) -> Reals:
        """A table of constant doubles of the program."""
        return Reals(self, self.program.reals(symbol, numbers))

    def integers(self, symbol: str, numbers: Sequence[int]) -> Integers:
        """A table of integer constants of the program."""
        return Integers(self, self.program.integers(symbol, numbers))

    def filled_in(self, symbol: str, count: int) -> Addresses:
        """A table of addresses of the program: see :meth:`Program.filled_in`."""
        return Addresses(self, self.program.filled_in(symbol, count))

    @property
    def null(self) -> Address:
        """The null address."""
        return Address(self, Constant(Kind.ADDRESS, None))

    @property
    def null_array(self) -> Reals:
        """An array without an address, for functions that do not read it."""
        return Reals(self, Constant(Kind.ADDRESS, None))

    # Control flow.

    @contextmanager
    def when(self, condition: Boolean, *, rarely: bool = False) -> Generator[None]:
        """Run the block if the condition holds; ``rarely``: a hint that the condition seldom holds."""
        statement = tree.When(condition.operand, [], [], rarely)
        self.statements.append(statement)
        with self._inside(statement.yes):
            yield

    @contextmanager
    def unless(self, condition: Boolean) -> Generator[None]:
        """Run the block if the condition fails, also for comparisons with NaN."""
        statement = tree.When(condition.operand, [], [])
        self.statements.append(statement)
        with self._inside(statement.no):
            yield

    @contextmanager
    def otherwise(self) -> Generator[None]:
        """The block that runs if the condition of the :meth:`when` directly before it fails."""
        statement = self.statements[-1] if self.statements else None
        if not isinstance(statement, tree.When) or statement.no:
            raise SyntaxError(
                "'otherwise' has no 'when' directly before it. Fix: put it directly after a 'when'."
            )
        with self._inside(statement.no):
            yield

    @contextmanager
    def part(self) -> Generator[Part]:
        """A block that can be left early or repeated."""
        region = tree.Region([], Mark("again"), Mark("behind"))
        self.statements.append(region)
        region.start.open = region.end.open = True
        with self._inside(region.body):
            yield Part(self, region.start, region.end)
        region.start.open = region.end.open = False

    @contextmanager
    def loop(self) -> Generator[Part]:
        """A part that is repeated until it is left."""
        with self.part() as part:
            yield part
            part.again()

    def each(self, count: int) -> Generator[Integer | int]:
        """``for i in r.each(n)``: run the block for ``i = 0 … n-1``; short loops are unrolled.

        In an unrolled loop ``i`` is a Python number.
        """
        if count <= UNROLL:
            yield from range(count)
            return
        index = self.integer(0)
        with self.part() as iteration:
            i = index.value
            yield i
            next_index = i + 1
            index.value = next_index
            iteration.again_when(next_index < count)

    def range(self, start: Integer | int, stop: Integer | int, step: int = 1) -> Generator[Integer]:
        """``for i in r.range(a, b)``: run the block for ``i = a … b-1``, as a loop.

        With a ``step`` above 1, ``i = a, a + step …`` below ``b``.
        """
        index = self.integer(start)
        with self.loop() as iteration:
            i = index.value
            iteration.leave_unless(i < stop)
            yield i
            index.value = i + step

    def stages(self, *names: str) -> Stages:
        """A block of consecutive stages with jumps between them."""
        return Stages(self, names)

    def return_(self, *values: Value) -> None:
        """Return results before the end of the function. At the end, use Python's ``return``."""
        self.statements.append(tree.Return(tuple(value.operand for value in values)))

    # Calls.

    def call(self, function: Function[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        """Call a function; return its result, or a tuple of its results."""
        values = args
        if kwargs:
            bound = inspect.signature(function.write).bind(self, *args, **kwargs)
            values = tuple(bound.arguments.values())[1:]
        operands = tuple(self._argument(value) for value in values)
        temporaries = tuple(Temporary(kind.kind) for kind in function.results)
        called = function.symbol if function.address is None else function.address
        self.statements.append(tree.Call(temporaries, called, operands))
        results = tuple(kind(self, operand) for kind, operand in zip(function.results, temporaries))
        return cast("R", results if len(results) > 1 else results[0] if results else None)

    def copy(self, source: Reals | Integers, target: Reals | Integers, count: Integer | int) -> None:
        """Copy numbers between two arrays that do not overlap."""
        size = integer_operand(8 * count if isinstance(count, int) else count * 8)
        self.statements.append(tree.Copy(source.address(0), target.address(0), size))

    def jump(self, mark: Mark) -> None:
        """Jump to a mark of an enclosing part."""
        assert mark.open, "a part is left or repeated from inside"
        mark.used = True
        self.statements.append(Jump(mark))

    def _argument(self, value: object) -> Operand:
        if isinstance(value, Array):
            return value.address(0)
        if isinstance(value, Value):
            return value.operand
        assert isinstance(value, bool), value
        return boolean_operand(value)

    @contextmanager
    def _inside(self, statements: list[Statement]) -> Generator[None]:
        enclosing = self.statements
        self.statements = statements
        yield
        self.statements = enclosing


class Stages:
    """Stages of a routine, such as those of a run: ``with stages:`` around all of them.

    Code before the first stage selects one by :meth:`go`. A stage continues with the next stage, or ends with
    :meth:`go`.
    """

    def __init__(self, routine: Routine, names: Sequence[str]) -> None:
        self._routine = routine
        self._marks = {name: Mark(name) for name in names}
        self._region = tree.Region([], Mark("again"), Mark("behind"))
        self._enclosing: list[Statement] = []

    def __enter__(self) -> Stages:
        self._routine.statements.append(self._region)
        self._enclosing = self._routine.statements
        self._routine.statements = self._region.body
        for mark in self._marks.values():
            mark.open = True
        return self

    def __exit__(self, *_: object) -> None:
        for mark in self._marks.values():
            mark.open = False
        self._routine.statements = self._enclosing

    def begin(self, name: str) -> None:
        """Begin this stage."""
        assert self._routine.statements is self._region.body, "a stage is not inside a loop or a condition"
        self._routine.statements.append(tree.Stage(self._marks[name]))

    def go(self, name: str) -> None:
        """Jump to a stage."""
        self._routine.jump(self._marks[name])


def _parameters(write: Callable[..., object]) -> dict[str, type[Value]]:
    # The first annotation is the routine, the last annotation the result.
    hints = list(write.__annotations__.items())[1:-1]
    return {name: _value_type(hint) for name, hint in hints}


def _results(write: Callable[..., object]) -> tuple[type[Value], ...]:
    annotation = write.__annotations__["return"]
    if annotation in (None, "None"):
        return ()
    if isinstance(annotation, str):
        annotation = annotation.removeprefix("tuple[").removesuffix("]").split(", ")
    else:
        annotation = get_args(annotation) or (annotation,)
    return tuple(map(_value_type, annotation))


def _value_type(annotation: type[Value] | str) -> type[Value]:
    """The type that an annotation names. ``typing.get_type_hints`` would take longer than recording."""
    return _BY_NAME[annotation] if isinstance(annotation, str) else annotation
