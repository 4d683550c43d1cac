"""Executes the structured form of a routine in Python, as a reference for the back ends.

Memory consists of lists of numbers. An address is a list and a position in it (between two numbers if the
position counts half words), or a Python function. A value with lanes is a tuple. A jump is an exception that
the enclosing region catches.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from armblocks.routines import tree
from armblocks.routines.routine import Program
from armblocks.routines.tree import Kind, Operation

Address = tuple[list[Any], int]
LANES = (Kind.LANES, Kind.MASK, Kind.INTEGER_LANES)


@dataclass
class JumpException(Exception):  # noqa: N818
    mark: tree.Mark


@dataclass
class ReturnException(Exception):  # noqa: N818
    value: Any


def _wrap_int64(value: int) -> int:
    return (value + (1 << 63)) % (1 << 64) - (1 << 63)


def _divide(a: Any, b: Any) -> Any:
    if isinstance(a, float):
        if b == 0.0:
            nan = math.isnan(a) or a == 0.0
            return math.nan if nan else math.copysign(math.inf, a) * math.copysign(1.0, b)
        return a / b
    return abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)


OPERATIONS: dict[Operation, Callable[..., Any]] = {
    Operation.ADD: lambda a, b: a + b,
    Operation.SUBTRACT: lambda a, b: a - b,
    Operation.MULTIPLY: lambda a, b: a * b,
    Operation.DIVIDE: _divide,
    Operation.DIVIDE_UNSIGNED: lambda a, b: (a % (1 << 64)) // (b % (1 << 64)),
    Operation.REMAINDER_UNSIGNED: lambda a, b: (a % (1 << 64)) % (b % (1 << 64)),
    Operation.SHIFT_LEFT: lambda a, b: a << b,
    Operation.SHIFT_RIGHT: lambda a, b: a >> b,
    Operation.NEGATE: lambda a: -a,
    Operation.ABSOLUTE: abs,
    Operation.SQUARE_ROOT: lambda a: math.sqrt(a) if a >= 0.0 else math.nan,
    Operation.FMA: lambda a, b, c: math.fma(a, b, c) if hasattr(math, "fma") else _fma(a, b, c),
    Operation.LESS: lambda a, b: a < b,
    Operation.LESS_EQUAL: lambda a, b: a[1] <= b[1] if isinstance(a, tuple) else a <= b,
    Operation.EQUAL: lambda a, b: _same_address(a, b) if _is_address(a) or _is_address(b) else a == b,
    Operation.NOT_EQUAL: lambda a, b: not _same_address(a, b) if _is_address(a) or _is_address(b) else a != b,
    Operation.GREATER: lambda a, b: a > b,
    Operation.GREATER_EQUAL: lambda a, b: a >= b,
    Operation.ORDERED: lambda a, b: a == a and b == b,
    Operation.AND: lambda a, b: a & b,
    Operation.OR: lambda a, b: a | b,
    Operation.NOT: lambda a: not a,
    Operation.ANY: any,
    Operation.LANE_BITS: lambda mask: sum(bool(condition) << lane for lane, condition in enumerate(mask)),
    Operation.SELECT: lambda condition, a, b: a if condition else b,
    Operation.TO_REAL: float,
    Operation.TO_INTEGER: int,
    Operation.TO_INT32: lambda a: (a + (1 << 31)) % (1 << 32) - (1 << 31),
    Operation.BITS: lambda a: struct.unpack("<q", struct.pack("<d", a))[0],
    Operation.FROM_BITS: lambda a: struct.unpack("<d", struct.pack("<q", a))[0],
}


def _is_address(value: Any) -> bool:
    return value is None or isinstance(value, tuple) or callable(value)


def _same_address(a: Any, b: Any) -> bool:
    if isinstance(a, tuple) and isinstance(b, tuple):
        return a[0] is b[0] and a[1] == b[1]
    return a is b


def _fma(a: float, b: float, c: float) -> float:
    from fractions import Fraction

    if not all(map(math.isfinite, (a, b, c))):
        return a * b + c
    exact = Fraction(a) * Fraction(b) + Fraction(c)
    return float(exact) if exact else a * b + c


class Interpreter:
    """Calls functions of a program. ``functions`` are its external functions, called with argument lists."""

    def __init__(self, program: Program, **functions: Callable[..., Any]) -> None:
        self.program = program
        self.functions = functions

    def call(self, symbol: str, *arguments: Any) -> Any:
        function = self.program.parts.get(symbol)
        if not isinstance(function, tree.Function):
            return self.functions[symbol](*arguments)
        return _Call(self, function, arguments).run()


class _Call:
    def __init__(self, interpreter: Interpreter, function: tree.Function, arguments: Sequence[Any]) -> None:
        self.interpreter = interpreter
        self.function = function
        self.values: dict[tree.Operand, Any] = dict(zip(function.parameters, arguments))

    def run(self) -> Any:
        try:
            self.part(self.function.body)
        except ReturnException as returned:
            return returned.value
        raise AssertionError("a function ends with a return")

    def value(self, operand: tree.Operand) -> Any:
        match operand:
            case tree.Constant(kind, value):
                return (value,) * self.interpreter.program.lanes if kind in LANES else value
            case tree.Local():
                return self.values.setdefault(operand, ([None] * operand.count, 0))
            case tree.Table(_, numbers):
                return (list(numbers), 0)
            case _:
                return self.values[operand]

    def part(self, statements: Sequence[tree.Statement], start: int = 0) -> None:
        for statement in statements[start:]:
            self.statement(statement)

    def statement(self, statement: tree.Statement) -> None:
        match statement:
            case tree.Compute(result, operation, operands):
                values = list(map(self.value, operands))
                if operation is Operation.SPREAD:
                    outcome = (values[0],) * self.interpreter.program.lanes
                elif result.kind in LANES:
                    outcome = tuple(OPERATIONS[operation](*lane) for lane in zip(*values, strict=True))
                    if result.kind is Kind.INTEGER_LANES:
                        outcome = tuple(map(_wrap_int64, outcome))
                else:
                    outcome = OPERATIONS[operation](*values)
                self.values[result] = _wrap_int64(outcome) if result.kind is Kind.INTEGER else outcome
            case tree.Locate(result, base, index, element):
                memory, offset = self.value(base)
                step = self.value(index) / 8 if element is Kind.BYTE else self.value(index)
                self.values[result] = (memory, offset + step)
            case tree.Load(result, address):
                memory, offset = self.value(address)
                outcome = memory[int(offset)]
                if result.kind is Kind.INT32:
                    outcome = OPERATIONS[Operation.TO_INT32](outcome >> 32 * (offset != int(offset)))
                self.values[result] = outcome
            case tree.FetchAdd(result, address, value):
                memory, offset = self.value(address)
                self.values[result] = memory[offset]
                memory[offset] = _wrap_int64(memory[offset] + self.value(value))
            case tree.Store(value, address):
                memory, offset = self.value(address)
                memory[int(offset)] = self.value(value)
            case tree.Copy(source, target, size):
                (source_memory, first), (target_memory, offset) = self.value(source), self.value(target)
                count = self.value(size) // 8
                target_memory[offset : offset + count] = source_memory[first : first + count]
            case tree.Call(results, called, arguments):
                values = list(map(self.value, arguments))
                if isinstance(called, str):
                    outcome = self.interpreter.call(called, *values)
                else:
                    outcome = self.value(called)(*values)
                self.values.update(zip(results, outcome if len(results) > 1 else (outcome,)))
            case tree.Return(values):
                outcome = tuple(map(self.value, values))
                raise ReturnException(outcome if len(outcome) > 1 else outcome[0] if outcome else None)
            case tree.Jump(mark):
                raise JumpException(mark)
            case tree.When(condition, yes, no, _):
                self.part(yes if self.value(condition) else no)
            case tree.Region():
                self.region(statement)
            case tree.Stage():
                pass

    def region(self, region: tree.Region) -> None:
        stages = {part.mark: k for k, part in enumerate(region.body) if isinstance(part, tree.Stage)}
        start = 0
        while True:
            try:
                self.part(region.body, start)
                return
            except JumpException as jumped:
                if jumped.mark is region.end:
                    return
                if jumped.mark is not region.start and jumped.mark not in stages:
                    raise
                start = stages.get(jumped.mark, 0)
