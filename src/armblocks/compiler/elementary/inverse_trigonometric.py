"""Inverse sine, cosine and tangent: a polynomial on a small interval, exact identities elsewhere.

The parts (a multiple of pi/4 in two doubles, the reduced argument with its rounding error, the value
of the polynomial) are added smallest first.
"""

from __future__ import annotations

from armblocks.compiler.elementary.coefficients import ARC_SINE, ARC_TANGENT, HALF_PI, QUARTER_PI, TAN_PI_8
from armblocks.compiler.ir_text import Body


def arc_sine(body: Body, x: str) -> str:
    """``asin x``: ``pi/2 - 2 asin sqrt((1 - |x|) / 2)`` above one half. NaN beyond 1."""
    magnitude, small, s, curve = _arc_sine_parts(body, x)
    zero = body.number(0.0)
    base = body.select(small, zero, body.number(HALF_PI[0]))
    base_rest = body.select(small, zero, body.number(HALF_PI[1]))
    factor = body.select(small, body.number(1.0), body.number(-2.0))
    total, error = body.fast_two_sum(base, body.multiply(factor, s))
    rest = body.add(error, body.fma(factor, curve, base_rest))
    tiny = body.compare("olt", magnitude, body.number(2.0**-28))
    return body.intrinsic("copysign", body.select(tiny, magnitude, body.add(total, rest)), x)


def arc_cosine(body: Body, x: str) -> str:
    """``acos x``: ``pi/2 - asin x`` for ``|x| <= 1/2``. NaN beyond 1.

    Above one half it is ``2 asin sqrt((1 - |x|) / 2)``, for negative x pi minus this value.
    """
    _, small, s, curve = _arc_sine_parts(body, x)
    negative = body.compare("olt", x, body.number(0.0))

    def choose(middle: float, right: float, left: float) -> str:
        outer = body.select(negative, body.number(left), body.number(right))
        return body.select(small, body.number(middle), outer)

    base = choose(HALF_PI[0], 0.0, 2.0 * HALF_PI[0])
    base_rest = choose(HALF_PI[1], 0.0, 2.0 * HALF_PI[1])
    inner = body.select(negative, body.number(1.0), body.number(-1.0))
    outer = body.select(negative, body.number(-2.0), body.number(2.0))
    factor = body.select(small, inner, outer)
    total, error = body.fast_two_sum(base, body.multiply(factor, s))
    return body.add(total, body.add(error, body.fma(factor, curve, base_rest)))


def _arc_sine_parts(body: Body, x: str) -> tuple[str, str, str, str]:
    """``|x|``, whether it is at most one half, and two parts s and c of an arc sine.

    ``s + c`` is ``asin |x|``, or above one half ``asin sqrt((1 - |x|) / 2)``.
    """
    magnitude = body.absolute(x)
    small = body.compare("ole", magnitude, body.number(0.5))
    outer = body.multiply(body.subtract(body.number(1.0), magnitude), body.number(0.5))
    root = body.intrinsic("sqrt", outer)
    residual = body.fma(body.negate(root), root, outer)
    root_rest = body.divide(residual, body.add(root, root))
    at_end = body.compare("oeq", outer, body.number(0.0))
    unneeded = body.either(small, at_end)
    rest = body.select(unneeded, body.number(0.0), root_rest)
    s = body.select(small, magnitude, root)
    z = body.select(small, body.multiply(magnitude, magnitude), outer)
    curve = body.fma(body.multiply(s, z), body.polynomial(z, ARC_SINE), rest)
    return magnitude, small, s, curve


def arc_tangent(body: Body, x: str) -> str:
    """``atan x``."""
    return arc_tangent_of_quotient(body, x, body.number(1.0))


def arc_tangent_of_quotient(body: Body, y: str, x: str) -> str:
    """``atan2(y, x)``: the angle of the point (x, y), by octants; zeros and infinities as in C99."""
    abs_y, abs_x = body.absolute(y), body.absolute(x)
    steep = body.compare("ogt", abs_y, abs_x)
    numerator, denominator = body.select(steep, abs_x, abs_y), body.select(steep, abs_y, abs_x)
    numerator, denominator = _safe_quotient(body, numerator, denominator)

    # In the upper half of the octant, rotate by pi/4: t = (numerator - denominator) / (numerator +
    # denominator).
    upper = body.compare("ogt", numerator, body.multiply(body.number(TAN_PI_8), denominator))
    difference, difference_rest = body.two_sum(numerator, body.negate(denominator))
    total, total_rest = body.two_sum(numerator, denominator)
    zero = body.number(0.0)
    top, top_rest = body.select(upper, difference, numerator), body.select(upper, difference_rest, zero)
    bottom, bottom_rest = body.select(upper, total, denominator), body.select(upper, total_rest, zero)
    t = body.divide(top, bottom)
    minus = body.negate(t)
    residual = body.add(body.fma(minus, bottom, top), body.fma(minus, bottom_rest, top_rest))
    t_rest = body.divide(residual, bottom)
    z = body.multiply(t, t)
    curve = body.fma(body.multiply(t, z), body.polynomial(z, ARC_TANGENT), t_rest)

    # angle = eighths pi/4 + sign (t + curve)
    negative_x = body.word_test("slt", body.bits(x), body.integer(0))
    eighths = body.select(upper, body.number(1.0), zero)
    eighths = body.select(steep, body.subtract(body.number(2.0), eighths), eighths)
    eighths = body.select(negative_x, body.subtract(body.number(4.0), eighths), eighths)
    negated = body.let(f"xor {body.bit} {steep}, {negative_x}")
    t = body.select(negated, body.negate(t), t)
    curve = body.select(negated, body.negate(curve), curve)
    base, base_rest = body.two_product(eighths, body.number(QUARTER_PI[0]))
    base_rest = body.fma(eighths, body.number(QUARTER_PI[1]), base_rest)
    total, error = body.fast_two_sum(base, t)
    angle = body.add(total, body.add(error, body.add(curve, base_rest)))
    angle = body.intrinsic("copysign", angle, y)
    nan = body.compare("uno", y, x)
    return body.select(nan, body.add(y, x), angle)


def _safe_quotient(body: Body, numerator: str, denominator: str) -> tuple[str, str]:
    """An equal quotient (0 <= numerator <= denominator) that is safe to compute.

    It has no 0/0, no infinities, no overflow and no loss of digits.
    """
    infinity = body.number(float("inf"))
    one, zero = body.number(1.0), body.number(0.0)
    infinite = body.compare("oeq", denominator, infinity)
    both = body.compare("oeq", numerator, infinity)
    numerator = body.select(infinite, body.select(both, one, zero), numerator)
    zero_denominator = body.compare("oeq", denominator, zero)
    denominator = body.select(body.either(infinite, zero_denominator), one, denominator)
    large = body.compare("ogt", denominator, body.number(2.0**1000))
    small = body.compare("olt", denominator, body.number(2.0**-800))
    scale = body.select(large, body.number(2.0**-100), body.select(small, body.number(2.0**200), one))
    return body.multiply(numerator, scale), body.multiply(denominator, scale)
