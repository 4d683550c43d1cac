"""Power, hypotenuse, error function."""

from __future__ import annotations

from armblocks.compiler.elementary.coefficients import COMPLEMENTARY_ERROR_FUNCTION, ERROR_FUNCTION
from armblocks.compiler.elementary.exponential import exponential_of_sum
from armblocks.compiler.elementary.logarithmic import logarithm_of_pair
from armblocks.compiler.ir_text import Body

_INFINITY = float("inf")


def power(body: Body, x: str, y: str) -> str:
    """``x**y = exp(y ln |x|)``; the logarithm and the product have an error of about 2**-65; signs as in
    C99."""
    zero, one, infinity = body.number(0.0), body.number(1.0), body.number(_INFINITY)
    magnitude = body.absolute(x)
    high, low = logarithm_of_pair(body, magnitude, None)
    high = body.select(body.compare("oeq", magnitude, zero), body.number(-_INFINITY), high)
    high = body.select(body.compare("oeq", magnitude, infinity), infinity, high)
    product, error = body.two_product(y, high)
    error = body.fma(y, low, error)
    # Beyond 800 the result is zero or infinite, whatever the low part is.
    far = body.compare("ogt", body.absolute(product), body.number(800.0))
    capped = body.intrinsic("copysign", body.number(800.0), product)
    product = body.select(far, capped, product)
    result = exponential_of_sum(body, product, body.select(far, zero, error))

    whole = body.compare("oeq", body.intrinsic("floor", y), y)
    half = body.multiply(y, body.number(0.5))
    uneven = body.compare("une", body.intrinsic("floor", half), half)
    odd = body.both(whole, uneven)
    signed = body.select(odd, body.intrinsic("copysign", result, x), result)
    # A non-integer power of a finite negative base is NaN.
    inside = body.both(body.compare("olt", x, zero), body.compare("ogt", x, body.number(-_INFINITY)))
    fraction = body.compare("une", body.intrinsic("floor", y), y)
    signed = body.select(body.both(inside, fraction), body.number(float("nan")), signed)
    signed = body.select(body.compare("uno", x, y), body.add(x, y), signed)
    # |x| = 1 with an infinite exponent: y ln 1 would be NaN.
    unit = body.both(body.compare("oeq", magnitude, one), body.compare("oeq", body.absolute(y), infinity))
    certain = body.either(body.compare("oeq", y, zero), body.compare("oeq", x, one))
    return body.select(body.either(unit, certain), one, signed)


def hypotenuse(body: Body, x: str, y: str) -> str:
    """``sqrt(x x + y y)``, corrected by the residual of the square root (Borges 2019, "fused" form)."""
    one, infinity = body.number(1.0), body.number(_INFINITY)
    a, b = body.absolute(x), body.absolute(y)
    larger = body.compare("ogt", a, b)
    major, minor = body.select(larger, a, b), body.select(larger, b, a)
    huge = body.compare("ogt", major, body.number(2.0**500))
    small = body.compare("olt", major, body.number(2.0**-400))
    scale = body.select(huge, body.number(2.0**-600), body.select(small, body.number(2.0**600), one))
    back = body.select(huge, body.number(2.0**600), body.select(small, body.number(2.0**-600), one))
    major, minor = body.multiply(major, scale), body.multiply(minor, scale)
    square, square_rest = body.two_product(major, major)
    other, other_rest = body.two_product(minor, minor)
    total, rest = body.fast_two_sum(square, other)
    root = body.intrinsic("sqrt", total)
    left = body.fma(body.negate(root), root, total)
    left = body.add(left, body.add(rest, body.add(square_rest, other_rest)))
    corrected = body.add(root, body.divide(left, body.add(root, root)))
    result = body.select(body.compare("oeq", total, body.number(0.0)), total, corrected)
    result = body.multiply(result, back)
    result = body.select(body.compare("uno", x, y), body.add(x, y), result)
    endless = body.either(body.compare("oeq", a, infinity), body.compare("oeq", b, infinity))
    return body.select(endless, infinity, result)


def error_function(body: Body, x: str) -> str:
    """``erf x``: a polynomial below 1, ``1 - exp(-x x) f`` up to 6, then 1."""
    magnitude = body.absolute(x)
    square = body.multiply(x, x)
    near = body.fma(magnitude, body.polynomial(square, ERROR_FUNCTION), magnitude)
    six = body.number(6.0)
    limited = body.select(body.compare("ogt", magnitude, six), six, magnitude)
    three = body.number(3.0)
    t = body.divide(body.subtract(limited, three), body.add(limited, three))
    square, square_rest = body.two_product(limited, limited)
    bell = exponential_of_sum(body, body.negate(square), body.negate(square_rest))
    far = body.fma(body.negate(bell), body.polynomial(t, COMPLEMENTARY_ERROR_FUNCTION), body.number(1.0))
    close = body.compare("olt", magnitude, body.number(1.0))
    return body.intrinsic("copysign", body.select(close, near, far), x)
