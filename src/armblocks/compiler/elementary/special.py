"""Power, hypotenuse, error function."""

from __future__ import annotations

from armblocks.compiler.elementary.coefficients import COMPLEMENTARY_ERROR_FUNCTION, ERROR_FUNCTION
from armblocks.compiler.elementary.exponential import exponential_of_sum
from armblocks.compiler.elementary.logarithmic import logarithm_of_pair
from armblocks.compiler.ir_text import Body

_INFINITY = float("inf")


def power(body: Body, x: str, y: str) -> str:
    """``x**y = exp(y ln |x|)``, with signs and special values as in C99.

    The logarithm and the product have an error of about 2**-65.
    """
    zero, one, infinity = body.number(0.0), body.number(1.0), body.number(_INFINITY)
    magnitude = body.absolute(x)
    high, low = logarithm_of_pair(body, magnitude, None)
    high = body.select(body.compare("oeq", magnitude, zero), body.number(-_INFINITY), high)
    high = body.select(body.compare("oeq", magnitude, infinity), infinity, high)
    product, error = body.two_product(y, high)
    error = body.fma(y, low, error)
    # Beyond 800 the result is zero or infinite for every low part.
    far = body.compare("ogt", body.absolute(product), body.number(800.0))
    capped = body.intrinsic("copysign", body.number(800.0), product)
    product = body.select(far, capped, product)
    result = exponential_of_sum(body, product, body.select(far, zero, error))

    is_integer = body.compare("oeq", body.intrinsic("floor", y), y)
    half = body.multiply(y, body.number(0.5))
    half_is_fractional = body.compare("une", body.intrinsic("floor", half), half)
    odd = body.both(is_integer, half_is_fractional)
    signed = body.select(odd, body.intrinsic("copysign", result, x), result)
    # A non-integer power of a finite negative base is NaN.
    finite_negative = body.both(body.compare("olt", x, zero), body.compare("ogt", x, body.number(-_INFINITY)))
    fraction = body.compare("une", body.intrinsic("floor", y), y)
    signed = body.select(body.both(finite_negative, fraction), body.number(float("nan")), signed)
    signed = body.select(body.compare("uno", x, y), body.add(x, y), signed)
    # |x| = 1 with an infinite exponent: y ln 1 would be NaN.
    unit_base = body.both(
        body.compare("oeq", magnitude, one), body.compare("oeq", body.absolute(y), infinity)
    )
    always_one = body.either(body.compare("oeq", y, zero), body.compare("oeq", x, one))
    return body.select(body.either(unit_base, always_one), one, signed)


def hypotenuse(body: Body, x: str, y: str) -> str:
    """``sqrt(x x + y y)``, corrected by the residual of the square root (Borges 2019, "fused" form)."""
    one, infinity = body.number(1.0), body.number(_INFINITY)
    a, b = body.absolute(x), body.absolute(y)
    larger = body.compare("ogt", a, b)
    major, minor = body.select(larger, a, b), body.select(larger, b, a)
    huge = body.compare("ogt", major, body.number(2.0**500))
    small = body.compare("olt", major, body.number(2.0**-400))
    scale = body.select(huge, body.number(2.0**-600), body.select(small, body.number(2.0**600), one))
    inverse_scale = body.select(huge, body.number(2.0**600), body.select(small, body.number(2.0**-600), one))
    major, minor = body.multiply(major, scale), body.multiply(minor, scale)
    square, square_rest = body.two_product(major, major)
    other, other_rest = body.two_product(minor, minor)
    total, rest = body.fast_two_sum(square, other)
    root = body.intrinsic("sqrt", total)
    residual = body.fma(body.negate(root), root, total)
    residual = body.add(residual, body.add(rest, body.add(square_rest, other_rest)))
    corrected = body.add(root, body.divide(residual, body.add(root, root)))
    result = body.select(body.compare("oeq", total, body.number(0.0)), total, corrected)
    result = body.multiply(result, inverse_scale)
    result = body.select(body.compare("uno", x, y), body.add(x, y), result)
    infinite = body.either(body.compare("oeq", a, infinity), body.compare("oeq", b, infinity))
    return body.select(infinite, infinity, result)


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
    gaussian = exponential_of_sum(body, body.negate(square), body.negate(square_rest))
    far = body.fma(body.negate(gaussian), body.polynomial(t, COMPLEMENTARY_ERROR_FUNCTION), body.number(1.0))
    close = body.compare("olt", magnitude, body.number(1.0))
    return body.intrinsic("copysign", body.select(close, near, far), x)
