"""Exponentials and hyperbolic functions.

The argument is reduced to ``x = k ln 2 + r`` with ``|r| <= ln(2)/2``, where r has two parts. ``exp r - 1`` is
computed as an unevaluated pair, so that small results are exact to their last place. The power of two is
applied in two halves, so overflow and subnormal results need no separate case.
"""

from __future__ import annotations

from typing import NamedTuple

from armblocks.compiler.elementary.coefficients import EXPONENTIAL, LN2, LOG2_E, ROUNDER
from armblocks.compiler.ir_text import Body

_MAX_ARGUMENT = 800.0  # exp overflows from 710 on and vanishes below -746


class _Power(NamedTuple):
    """``exp x = (1 + high + low) scale[0] scale[1]``."""

    high: str
    low: str
    scale: tuple[str, str]


def exponential(body: Body, x: str) -> str:
    """``exp x``."""
    return exponential_of_sum(body, _limited(body, x), body.number(0.0))


def exponential_of_sum(body: Body, high: str, low: str) -> str:
    """``exp(high + low)`` for ``|high| <= 800``, where ``low`` has the size of a rounding error."""
    power = _reduce(body, high, low)
    one, rest = body.fast_two_sum(body.number(1.0), power.high)
    return _scaled(body, power, body.add(one, body.add(rest, power.low)))


def exponential_minus_one(body: Body, x: str) -> str:
    """``exp x - 1``."""
    limited = _limited(body, x)
    high, low, power = _minus_one(body, limited)
    near = body.add(high, low)
    one, rest = body.fast_two_sum(body.number(1.0), power.high)
    far = _scaled(body, power, body.add(one, body.add(rest, power.low)))
    # Where exp x exceeds 2**60, subtracting 1 has no effect, and the pair may overflow before the result.
    result = body.select(body.compare("ogt", x, body.number(42.0)), far, near)
    # A tiny argument is the result, including signed zeros and subnormal numbers.
    tiny = body.compare("olt", body.absolute(x), body.number(2.0**-54))
    return body.select(tiny, x, result)


def hyperbolic_sine(body: Body, x: str) -> str:
    """``sinh x = (m + m / (m + 1)) / 2`` with ``m = exp |x| - 1``; from ``exp(x) / 2`` where m overflows."""
    magnitude = body.absolute(x)
    high, low, _ = _minus_one(body, _limited(body, magnitude))
    denominator, denominator_rest = body.two_sum(high, body.number(1.0))
    denominator_rest = body.add(denominator_rest, low)
    quotient = body.divide(high, denominator)
    residual = body.fma(body.negate(quotient), denominator, high)
    residual = body.add(residual, body.fma(body.negate(quotient), denominator_rest, low))
    quotient_rest = body.divide(residual, denominator)
    total, rest = body.fast_two_sum(high, quotient)
    total = body.add(total, body.add(rest, body.add(low, quotient_rest)))
    near = body.multiply(total, body.number(0.5))
    result = body.select(
        body.compare("ogt", magnitude, body.number(42.0)), _half_exponential(body, magnitude), near
    )
    tiny = body.compare("olt", magnitude, body.number(2.0**-28))
    return body.intrinsic("copysign", body.select(tiny, magnitude, result), x)


def hyperbolic_cosine(body: Body, x: str) -> str:
    """``cosh x = (exp |x| + exp -|x|) / 2``."""
    magnitude = body.absolute(x)
    high, low, _ = _minus_one(body, _limited(body, magnitude))
    base, base_rest = body.two_sum(high, body.number(1.0))
    base_rest = body.add(base_rest, low)
    inverse = body.divide(body.number(1.0), base)
    residual = body.fma(body.negate(inverse), base, body.number(1.0))
    inverse_rest = body.multiply(inverse, body.fma(body.negate(inverse), base_rest, residual))
    total, rest = body.fast_two_sum(base, inverse)
    total = body.add(total, body.add(rest, body.add(base_rest, inverse_rest)))
    near = body.multiply(total, body.number(0.5))
    far = body.compare("ogt", magnitude, body.number(42.0))
    return body.select(far, _half_exponential(body, magnitude), near)


def hyperbolic_tangent(body: Body, x: str) -> str:
    """``tanh x = m / (m + 2)`` with ``m = exp 2|x| - 1``."""
    magnitude = body.absolute(x)
    ceiling = body.number(40.0)  # for x above 19.1, tanh x rounds to 1
    limited = body.select(body.compare("ogt", magnitude, ceiling), ceiling, magnitude)
    high, low, _ = _minus_one(body, body.add(limited, limited))
    denominator, denominator_rest = body.two_sum(high, body.number(2.0))
    denominator_rest = body.add(denominator_rest, low)
    quotient = body.divide(high, denominator)
    residual = body.fma(body.negate(quotient), denominator, high)
    residual = body.add(residual, body.fma(body.negate(quotient), denominator_rest, low))
    result = body.add(quotient, body.divide(residual, denominator))
    tiny = body.compare("olt", magnitude, body.number(2.0**-28))
    return body.intrinsic("copysign", body.select(tiny, magnitude, result), x)


def _limited(body: Body, x: str) -> str:
    """``x`` limited to the range of the reduction; NaN stays NaN."""
    upper, lower = body.number(_MAX_ARGUMENT), body.number(-_MAX_ARGUMENT)
    x = body.select(body.compare("ogt", x, upper), upper, x)
    return body.select(body.compare("olt", x, lower), lower, x)


def _reduce(body: Body, high: str, low: str) -> _Power:
    """``exp(high + low)`` by argument reduction."""
    rounder = body.number(ROUNDER)
    count = body.subtract(body.fma(high, body.number(LOG2_E), rounder), rounder)
    first = body.fma(count, body.number(-LN2[0]), high)
    angle = body.fma(count, body.number(-LN2[1]), first)
    rest = body.fma(count, body.number(-LN2[1]), body.subtract(first, angle))
    rest = body.add(rest, low)
    square = body.multiply(angle, angle)
    tail = body.multiply(angle, body.polynomial(angle, EXPONENTIAL))
    curve = body.multiply(square, body.add(tail, body.number(0.5)))
    # exp(angle + rest) - 1 to first order in rest
    total, error = body.fast_two_sum(angle, curve)
    first_order = body.fma(rest, total, rest)
    rounded_half = body.fma(count, body.number(0.5), rounder)
    half = body.subtract(rounded_half, rounder)
    rounded_other = body.add(body.subtract(count, half), rounder)
    scale = (_power_of_two(body, rounded_half), _power_of_two(body, rounded_other))
    return _Power(total, body.add(error, first_order), scale)


def _power_of_two(body: Body, rounded: str) -> str:
    """``2**k``, where ``rounded`` is k plus the rounding constant and has k in its lowest bits."""
    biased = body.word_op("add", body.bits(rounded), body.integer(1023))
    return body.from_bits(body.word_op("shl", biased, body.integer(52)))


def _scaled(body: Body, power: _Power, value: str) -> str:
    return body.multiply(body.multiply(value, power.scale[0]), power.scale[1])


def _minus_one(body: Body, x: str) -> tuple[str, str, _Power]:
    """``exp x - 1`` as an unevaluated pair, valid up to 2**60, and the power that it is computed from."""
    power = _reduce(body, x, body.number(0.0))
    high, low = _scaled(body, power, power.high), _scaled(body, power, power.low)
    scale = body.multiply(power.scale[0], power.scale[1])
    base, base_rest = body.two_sum(scale, body.number(-1.0))
    total, rest = body.two_sum(base, high)
    return (*body.fast_two_sum(total, body.add(rest, body.add(base_rest, low))), power)


def _half_exponential(body: Body, x: str) -> str:
    """``exp(x) / 2``; intermediate results overflow only if the result does."""
    power = _reduce(body, _limited(body, x), body.number(0.0))
    one, rest = body.fast_two_sum(body.number(1.0), power.high)
    value = body.add(one, body.add(rest, power.low))
    halved = body.multiply(value, body.number(0.5))
    return body.multiply(body.multiply(halved, power.scale[0]), power.scale[1])
