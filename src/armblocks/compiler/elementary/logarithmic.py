"""Logarithms and inverse hyperbolic functions, all from the logarithm of a pair.

A pair is the sum of two doubles that is not evaluated, so that it has more digits than one double.
``ln(2**k m) = k ln 2 + ln m`` with ``m`` between sqrt(1/2) and sqrt(2), and ``ln m = 2 atanh s``,
``s = (m - 1) / (m + 1)``. Every leading term is kept with its rounding error, so the relative error of the
result is about 2**-65, also near 1. The argument may be such a pair as well.
"""

from __future__ import annotations

from armblocks.compiler.elementary.coefficients import LN2, LOGARITHM, THIRD
from armblocks.compiler.ir_text import Body

_INFINITY = float("inf")
_SQRT_HALF_BITS = 0x3FE6A09E667F3BCD
_MIN_NORMAL = 2.0**-1022


def logarithm(body: Body, x: str) -> str:
    """``ln x``; -inf at zero, NaN below."""
    return _with_special_values(body, x, body.add(*logarithm_of_pair(body, x, None)))


def logarithm_of_one_plus(body: Body, x: str) -> str:
    """``ln(1 + x)``; -inf at -1, NaN below."""
    total, rest = body.two_sum(body.number(1.0), x)
    rest = _finite_or_zero(body, rest)
    result = _with_special_values(body, total, body.add(*logarithm_of_pair(body, total, rest)))
    tiny = body.compare("olt", body.absolute(x), body.number(2.0**-54))
    return body.select(tiny, x, result)


def inverse_hyperbolic_sine(body: Body, x: str) -> str:
    """``asinh x = ln(|x| + sqrt(x x + 1))`` with the sign of x; ``ln 2 |x|`` where squares overflow."""
    magnitude = body.absolute(x)
    square, square_rest = body.two_product(magnitude, magnitude)
    radicand, radicand_rest = body.two_sum(square, body.number(1.0))
    root, root_rest = _square_root(body, radicand, body.add(radicand_rest, square_rest))
    total, rest = body.two_sum(root, magnitude)
    rest = body.add(rest, root_rest)
    huge = body.compare("ogt", magnitude, body.number(2.0**500))
    total, rest = body.select(huge, magnitude, total), body.select(huge, body.number(0.0), rest)
    high, low = logarithm_of_pair(body, *body.fast_two_sum(total, rest), doubled=huge)
    result = _with_special_values(body, magnitude, body.add(high, low))
    # asinh x = x - x**3 / 6 + …
    cubed = body.multiply(body.multiply(magnitude, magnitude), magnitude)
    near = body.fma(cubed, body.number(-1.0 / 6.0), magnitude)
    small = body.compare("olt", magnitude, body.number(2.0**-18))
    return body.intrinsic("copysign", body.select(small, near, result), x)


def inverse_hyperbolic_cosine(body: Body, x: str) -> str:
    """``acosh x = ln(x + sqrt(x x - 1))``; NaN below 1."""
    square, square_rest = body.two_product(x, x)
    radicand, radicand_rest = body.two_sum(square, body.number(-1.0))
    radicand, radicand_rest = body.fast_two_sum(radicand, body.add(radicand_rest, square_rest))
    root, root_rest = _square_root(body, radicand, radicand_rest)
    total, rest = body.two_sum(x, root)
    rest = body.add(rest, root_rest)
    huge = body.compare("ogt", x, body.number(2.0**500))
    total, rest = body.select(huge, x, total), body.select(huge, body.number(0.0), rest)
    high, low = logarithm_of_pair(body, *body.fast_two_sum(total, rest), doubled=huge)
    result = _with_special_values(body, x, body.add(high, low))
    outside = body.compare("olt", x, body.number(1.0))
    return body.select(outside, body.number(float("nan")), result)


def inverse_hyperbolic_tangent(body: Body, x: str) -> str:
    """``atanh x = ln((1 + x) / (1 - x)) / 2``; infinite at -1 and 1, NaN beyond."""
    magnitude = body.absolute(x)
    numerator, numerator_rest = body.two_sum(body.number(1.0), magnitude)
    denominator, denominator_rest = body.two_sum(body.number(1.0), body.negate(magnitude))
    quotient = body.divide(numerator, denominator)
    minus = body.negate(quotient)
    residual = body.fma(minus, denominator, numerator)
    residual = body.add(residual, body.fma(minus, denominator_rest, numerator_rest))
    rest = _finite_or_zero(body, body.divide(residual, denominator))
    high, low = logarithm_of_pair(body, *body.fast_two_sum(quotient, rest))
    half = body.multiply(body.add(high, low), body.number(0.5))
    result = _with_special_values(body, quotient, half)
    cubed = body.multiply(body.multiply(magnitude, magnitude), magnitude)
    near = body.fma(cubed, body.number(1.0 / 3.0), magnitude)
    small = body.compare("olt", magnitude, body.number(2.0**-18))
    result = body.select(small, near, result)
    outside = body.compare("ogt", magnitude, body.number(1.0))
    result = body.select(outside, body.number(float("nan")), result)
    return body.intrinsic("copysign", result, x)


def logarithm_of_pair(
    body: Body, high: str, low: str | None, *, doubled: str | None = None
) -> tuple[str, str]:
    """``ln(high + low)`` of a positive finite sum as a pair; where ``doubled`` holds, of twice the sum.

    Without ``low`` the argument is ``high`` alone. A subnormal ``high`` must be alone.
    """
    subnormal = body.compare("olt", high, body.number(_MIN_NORMAL))
    normal = body.select(subnormal, body.multiply(high, body.number(2.0**54)), high)
    bits = body.bits(normal)
    # The exponent of the number divided by sqrt(1/2) leaves m between sqrt(1/2) and sqrt(2).
    offset = body.word_op("sub", bits, body.integer(_SQRT_HALF_BITS))
    exponent = body.word_op("ashr", offset, body.integer(52))
    exponent_bits = body.word_op("shl", exponent, body.integer(52))
    m = body.from_bits(body.word_op("sub", bits, exponent_bits))
    m_low = None if low is None else _scaled_low(body, high, low, exponent_bits)
    count = body.let(f"sitofp {body.word} {exponent} to {body.real}")
    count = body.select(subnormal, body.subtract(count, body.number(54.0)), count)
    if doubled is not None:
        count = body.select(doubled, body.add(count, body.number(1.0)), count)

    # s = (m - 1) / (m + 1), its rounding error, its square
    numerator = body.subtract(m, body.number(1.0))
    denominator, denominator_rest = body.two_sum(m, body.number(1.0))
    numerator_rest = body.number(0.0)
    if m_low is not None:
        numerator, numerator_rest = body.two_sum(numerator, m_low)
        denominator_rest = body.add(denominator_rest, m_low)
    s = body.divide(numerator, denominator)
    minus = body.negate(s)
    residual = body.add(
        body.fma(minus, denominator, numerator), body.fma(minus, denominator_rest, numerator_rest)
    )
    s_low = body.divide(residual, denominator)
    z, z_low = body.two_product(s, s)
    z_low = body.fma(body.add(s, s), s_low, z_low)

    # atanh(s) / s - 1 = z/3 + z z f(z)
    tail = body.multiply(body.multiply(z, z), body.polynomial(z, LOGARITHM))
    third, third_low = body.two_product(z, body.number(THIRD[0]))
    third_low = body.fma(z, body.number(THIRD[1]), body.fma(z_low, body.number(THIRD[0]), third_low))
    curve, curve_low = body.fast_two_sum(third, tail)
    curve_low = body.add(curve_low, third_low)

    # k ln 2 + 2 s + 2 s curve
    doubled_s, doubled_s_low = body.add(s, s), body.add(s_low, s_low)
    correction, correction_low = body.two_product(doubled_s, curve)
    correction_low = body.fma(doubled_s, curve_low, body.fma(doubled_s_low, curve, correction_low))
    exponent_term, exponent_term_low = body.two_product(count, body.number(LN2[0]))
    exponent_term_low = body.fma(count, body.number(LN2[1]), exponent_term_low)
    total, error = body.two_sum(exponent_term, doubled_s)
    total, correction_error = body.two_sum(total, correction)
    small = body.add(
        body.add(error, correction_error),
        body.add(body.add(exponent_term_low, doubled_s_low), correction_low),
    )
    return body.fast_two_sum(total, small)


def _scaled_low(body: Body, high: str, low: str, exponent_bits: str) -> str:
    """``low`` divided by the power of two by which ``high`` was divided."""
    inverse = body.from_bits(body.word_op("sub", body.integer(1023 << 52), exponent_bits))
    # Near the largest double the reciprocal of the power is not a normal number. The low part is negligible
    # there.
    large = body.compare("ogt", high, body.number(2.0**1000))
    return body.select(large, body.number(0.0), body.multiply(low, inverse))


def _square_root(body: Body, high: str, low: str) -> tuple[str, str]:
    """Square root of a pair, as a pair."""
    root = body.intrinsic("sqrt", high)
    residual = body.add(body.fma(body.negate(root), root, high), low)
    rest = body.divide(residual, body.add(root, root))
    return root, body.select(body.compare("oeq", high, body.number(0.0)), body.number(0.0), rest)


def _finite_or_zero(body: Body, x: str) -> str:
    """``x``, or zero where it is infinite or NaN."""
    finite = body.compare("olt", body.absolute(x), body.number(_INFINITY))
    return body.select(finite, x, body.number(0.0))


def _with_special_values(body: Body, argument: str, result: str) -> str:
    """Replace the result by the logarithm's values at zero, infinity, NaN and below zero."""
    zero = body.compare("oeq", argument, body.number(0.0))
    result = body.select(zero, body.number(-_INFINITY), result)
    infinite = body.compare("oeq", argument, body.number(_INFINITY))
    result = body.select(infinite, body.number(_INFINITY), result)
    valid = body.compare("oge", argument, body.number(0.0))
    return body.select(valid, result, body.number(float("nan")))
