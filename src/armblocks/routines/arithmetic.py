"""Functions of the values of a routine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast, overload

from armblocks.routines.lanes import IntegerLanes, Lanes, Mask
from armblocks.routines.memory import Address
from armblocks.routines.tree import Constant, Operation
from armblocks.routines.values import Boolean, Condition, Integer, NumberT, Real, Value


def square_root(a: NumberT) -> NumberT:
    """The square root, exactly rounded."""
    return a.compute(Operation.SQUARE_ROOT, a)


def fma(a: NumberT | float, b: NumberT | float, c: NumberT | float) -> NumberT:
    """``a b + c``, rounded once; at least one argument is a value of a routine."""
    number = next(value for value in (a, b, c) if not isinstance(value, float | int))
    return number.compute(Operation.FMA, a, b, c)


def in_all_lanes(a: Real) -> Lanes:
    """The same double in every lane."""
    return Lanes(a.writer, a.writer.compute(Lanes.kind, Operation.SPREAD, a.operand))


@overload
def select(condition: Boolean, yes: Integer, no: Integer | int) -> Integer: ...
@overload
def select(condition: Boolean, yes: int, no: Integer) -> Integer: ...
@overload
def select(condition: Boolean, yes: Real | float, no: Real | float) -> Real: ...
@overload
def select(condition: Boolean, yes: Address, no: Address) -> Address: ...
@overload
def select(condition: Mask, yes: IntegerLanes, no: IntegerLanes | int) -> IntegerLanes: ...
@overload
def select(condition: Mask, yes: Lanes | float, no: Lanes | float) -> Lanes: ...
def select(
    condition: Boolean | Mask,
    yes: Real | Integer | Address | Lanes | IntegerLanes | float,
    no: Real | Integer | Address | Lanes | IntegerLanes | float,
) -> Real | Integer | Address | Lanes | IntegerLanes:
    """``yes`` where the condition holds, else ``no``; both are evaluated. Two Python numbers are reals."""
    known = next((x for x in (yes, no) if isinstance(x, Value)), None)
    number_kind = Lanes if isinstance(condition, Mask) else Real
    kind = number_kind if known is None else type(known)
    number = int if kind in (Integer, IntegerLanes) else float
    operands = (x.operand if isinstance(x, Value) else Constant(kind.kind, number(x)) for x in (yes, no))
    writer = condition.writer
    return kind(writer, writer.compute(kind.kind, Operation.SELECT, condition.operand, *operands))


def minimum(a: NumberT, b: NumberT | float) -> NumberT:
    """The smaller value; ``b`` if either is NaN."""
    return select_number(a < b, a, b)


def maximum(a: NumberT, b: NumberT | float) -> NumberT:
    """The larger value; ``b`` if either is NaN."""
    return select_number(a > b, a, b)


def select_number(condition: Condition, yes: NumberT | float, no: NumberT | float) -> NumberT:
    """:func:`select` for functions of doubles or lanes; at least one value is not a Python number."""
    return cast("Any", select)(condition, yes, no)


def sign(a: Real) -> Real:
    """-1, 0 or 1; 0 for NaN."""
    return select(a > 0.0, 1.0, select(a < 0.0, -1.0, 0.0))


def polynomial(x: NumberT, coefficients: Sequence[float]) -> NumberT | float:
    """Horner's rule; coefficients from the constant term upwards. A single coefficient is the result."""
    result: NumberT | float = coefficients[-1]
    for coefficient in reversed(coefficients[:-1]):
        result = fma(result, x, coefficient)
    return result


def inverse_root(a: NumberT, k: int) -> NumberT:
    """``a^(-1/k)`` for ``a`` in 1e-300 … 1e300, with an error of about one unit in the last place.

    The first guess divides the bits of ``a`` by k; the offset 0.064 balances its error. Two corrections ``y
    (1 - r)^(-1/k)`` follow, as Taylor polynomials of degree 4 in ``r = 1 - a y^k`` (below 0.25, then 1e-3).
    All operations are exactly rounded, so step lengths do not depend on the ``pow`` of a C library.
    """
    one = 1023 << 52
    offset = one + one // k - int(0.064 * (1 << 52))
    y = (offset - a.bits().unsigned_quotient(k)).from_bits()
    coefficients = [1.0]
    for m in range(4):
        coefficients.append(coefficients[-1] * (1 / k + m) / (m + 1))
    for _ in range(2):
        power = y
        for _ in range(k - 1):
            power = power * y
        r = 1.0 - a * power
        y = y * polynomial(r, coefficients)
    return y
