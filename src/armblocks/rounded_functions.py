"""Elementary functions of numbers, rounded to the nearest double, with bit-identical results on all machines.

Numbers that are computed before compilation (constants in formulas, angles between the axes of a robot, the
poles of a filter) become constants of the code. The C library's functions, which :mod:`math`, NumPy and
CasADi call, differ in the last place from one library or processor to the next. The functions of this module
use integer arithmetic, so that their results are bit-identical on all machines. A real number ``x`` is the
integer ``round(x 2**bits)``, with 192 bits more than the magnitude of the argument needs. Results are
therefore correctly rounded, except for arguments whose result is within about 2**-192 of the middle between
two doubles. A call takes 10 to 200 microseconds.

Signed zeros, infinities and NaN follow C99 (Annex F): an argument outside the domain gives NaN, a pole gives
an infinity, and no function raises. Sources: the series from Abramowitz and Stegun, Handbook of Mathematical
Functions, 4.2 to 4.6 and 7.1; the argument reduction from R. P. Brent, Fast multiple-precision evaluation of
elementary functions, J. ACM 23(2), 1976.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from functools import lru_cache

INFINITY, NAN = math.inf, math.nan
_EXTRA_BITS = 192
"""Number of bits in addition to the bits for the magnitude of an argument."""


def _working_bits(x: float) -> int:
    """Number of fraction bits for which ``x`` and ``x**2`` keep :data:`_EXTRA_BITS` extra bits."""
    return _EXTRA_BITS + 2 * abs(math.frexp(x)[1])


def _fixed_point(x: float | Fraction, bits: int) -> int:
    numerator, denominator = x.as_integer_ratio()
    return (numerator << bits) // denominator


def _rounded_double(value: int, bits: int, sign_of: float = 0.0) -> float:
    """``value 2**-bits`` rounded to nearest; a zero result takes the sign of ``sign_of``."""
    try:
        result = value / (1 << bits) if bits >= 0 else float(value << -bits)
    except OverflowError:
        return INFINITY if value > 0 else -INFINITY
    return result or math.copysign(0.0, sign_of)


def _quotient(numerator: int, denominator: int, bits: int) -> int:
    return (numerator << bits) // denominator


# Constants and series, as fixed-point numbers.


@lru_cache(maxsize=64)
def _pi(bits: int) -> int:
    """Machin: pi = 16 atan(1/5) - 4 atan(1/239)."""
    wide_bits = bits + 16
    return (16 * _arc_tangent_of_inverse(5, wide_bits) - 4 * _arc_tangent_of_inverse(239, wide_bits)) >> 16


def _arc_tangent_of_inverse(n: int, bits: int) -> int:
    power = total = (1 << bits) // n
    k = 1
    while power:
        power //= -n * n
        k += 2
        total += power // k
    return total


@lru_cache(maxsize=64)
def _ln2(bits: int) -> int:
    """ln 2 = 2 atanh(1/3)."""
    wide_bits = bits + 16
    return (2 * _odd_series(_quotient(1, 3, wide_bits), wide_bits, 1)) >> 16


def _odd_series(x: int, bits: int, sign: int) -> int:
    """``x + sign x**3 / 3 + x**5 / 5 + …``: atanh x for sign 1, atan x for -1."""
    square, power, total, k = (x * x) >> bits, x, x, 1
    while power:
        power = sign * (power * square) >> bits
        k += 2
        if power == -1:  # a right shift rounds down, so that a negative power never becomes 0
            break
        total += power // k
    return total


def _exponential(x: int, bits: int) -> tuple[int, int]:
    """``exp x = m 2**k`` with ``m`` about 1: returns m and k, by halving the argument and squaring."""
    k = x // _ln2(bits)
    halvings, wide_bits = 12, bits + 32
    r = ((x - k * _ln2(bits)) << 32) >> halvings
    term = total = 1 << wide_bits
    n = 1
    while term:
        term = (term * r >> wide_bits) // n
        total += term
        n += 1
    for _ in range(halvings):
        total = (total * total) >> wide_bits
    return total >> 32, k


def _logarithm(x: int, bits: int) -> int:
    """``ln x`` of a positive fixed-point number: ``x = m 2**k``, ``2/3 < m <= 4/3``, ``ln m = 2 atanh s``."""
    k = (3 * x).bit_length() - bits - 2
    m = _shifted(x, -k)
    one = 1 << bits
    return 2 * _odd_series(_quotient(m - one, m + one, bits), bits, 1) + k * _ln2(bits)


def _logarithm_of(x: float, bits: int) -> int:
    """``ln x`` of a positive number of any size."""
    _, exponent = math.frexp(x)
    return _logarithm(_fixed_point(math.ldexp(x, -exponent), bits), bits) + exponent * _ln2(bits)


def _shifted(value: int, k: int) -> int:
    return value << k if k >= 0 else value >> -k


def _arc_tangent(x: int, bits: int) -> int:
    """``atan x``, after three reductions ``atan x = 2 atan(x / (1 + sqrt(1 + x**2)))``."""
    one = 1 << bits
    for _ in range(3):
        x = _quotient(x, one + math.isqrt((one << bits) + x * x), bits)
    return 8 * _odd_series(x, bits, -1)


def _sine_cosine(x: float) -> tuple[int, int, int]:
    """``sin x`` and ``cos x`` of a finite number as fixed-point numbers, and their fraction bits."""
    bits = _working_bits(x)
    pi = _pi(bits)
    quadrant = (2 * _fixed_point(x, bits) + pi // 2) // pi
    r = _fixed_point(x, bits) - quadrant * pi // 2
    parts: list[int] = []
    for term, n in ((r, 1), (1 << bits, 0)):
        total = term
        while term not in (0, -1):
            term = -((term * r >> bits) * r >> bits) // ((n + 1) * (n + 2))
            total += term
            n += 2
        parts.append(total)
    sine, cosine = parts
    rotated = ((sine, cosine), (cosine, -sine), (-sine, -cosine), (-cosine, sine))[quadrant % 4]
    return (*rotated, bits)


# Trigonometric functions.


def sin(x: float) -> float:
    """Sine of ``x`` rad."""
    if not math.isfinite(x) or x == 0.0:
        return x if x == 0.0 else NAN
    sine, _, bits = _sine_cosine(x)
    return _rounded_double(sine, bits, x)


def cos(x: float) -> float:
    """Cosine of ``x`` rad."""
    if not math.isfinite(x):
        return NAN
    _, cosine, bits = _sine_cosine(x)
    return _rounded_double(cosine, bits)


def tan(x: float) -> float:
    """Tangent of ``x`` rad."""
    if not math.isfinite(x) or x == 0.0:
        return x if x == 0.0 else NAN
    sine, cosine, bits = _sine_cosine(x)
    return _rounded_double(_quotient(sine, cosine, bits), bits, x)


def atan(x: float) -> float:
    """Angle in rad, -pi/2 … pi/2, whose tangent is ``x``."""
    return atan2(x, 1.0)


def atan2(y: float, x: float) -> float:
    """Angle of the point (x, y) in rad, -pi … pi."""
    if math.isnan(x) or math.isnan(y):
        return NAN
    if math.isinf(x) or math.isinf(y):
        x, y = (math.copysign(1.0 if math.isinf(part) else 0.0, part) for part in (x, y))
    abs_y, abs_x = abs(y), abs(x)
    if abs_y == 0.0 and math.copysign(1.0, x) > 0.0:
        return y
    small, large = sorted((abs_y, abs_x))
    bits = _EXTRA_BITS + 2 * max(0, math.frexp(large)[1] - math.frexp(small or large)[1])
    # Below 2**-1100 the quotient underflows, or is negligible when added to pi.
    bits = min(bits, _EXTRA_BITS + 2 * 1100)
    (small_numerator, small_denominator), (large_numerator, large_denominator) = (
        small.as_integer_ratio(),
        (large or 1.0).as_integer_ratio(),
    )
    angle = _arc_tangent(
        ((small_numerator * large_denominator) << bits) // (small_denominator * large_numerator), bits
    )
    if abs_y > abs_x:
        angle = _pi(bits) // 2 - angle
    if math.copysign(1.0, x) < 0.0:
        angle = _pi(bits) - angle
    return math.copysign(_rounded_double(angle, bits), y)


def asin(x: float) -> float:
    """Angle in rad, -pi/2 … pi/2, whose sine is ``x``."""
    if not abs(x) <= 1.0 or x == 0.0:
        return x if x == 0.0 else NAN
    if abs(x) == 1.0:
        return atan2(x, 0.0)
    bits = _working_bits(x)
    value = _fixed_point(x, bits)
    cosine = math.isqrt((1 << 2 * bits) - value * value)
    return _rounded_double(_arc_tangent(_quotient(value, cosine, bits), bits), bits, x)


def acos(x: float) -> float:
    """Angle in rad, 0 … pi, whose cosine is ``x``: ``2 atan sqrt((1 - x) / (1 + x))``."""
    if not abs(x) <= 1.0:
        return NAN
    bits = _EXTRA_BITS + 128
    if x == -1.0:
        return _rounded_double(_pi(bits), bits)
    one, value = 1 << bits, _fixed_point(x, bits)
    return _rounded_double(
        2 * _arc_tangent(math.isqrt(_quotient(one - value, one + value, 2 * bits)), bits), bits
    )


# Exponentials and logarithms.

_MAX_EXPONENT = 800.0  # exp overflows above 710 and underflows to 0 below -746


def exp(x: float) -> float:
    """``e**x``."""
    if math.isnan(x) or abs(x) > _MAX_EXPONENT:
        return NAN if math.isnan(x) else INFINITY if x > 0.0 else 0.0
    bits = _EXTRA_BITS
    value, k = _exponential(_fixed_point(x, bits), bits)
    return _rounded_double(value, bits - k)


def expm1(x: float) -> float:
    """``e**x - 1``."""
    if math.isnan(x) or x == 0.0 or x > _MAX_EXPONENT:
        return x if x == 0.0 else NAN if math.isnan(x) else INFINITY
    bits = _working_bits(x)
    value, k = _exponential(_fixed_point(max(x, -_MAX_EXPONENT), bits), bits)
    return _rounded_double(_shifted(value, k) - (1 << bits), bits, x)


def _both_exponentials(x: float) -> tuple[int, int, int]:
    """``e**x`` and ``e**-x`` for ``|x| <= 800`` as fixed-point numbers, and their fraction bits."""
    bits = _working_bits(x) + int(3.0 * abs(x))  # enough bits for the smaller result, too
    value = _shifted(*_exponential(_fixed_point(x, bits), bits))
    return value, _quotient(1, value, 2 * bits), bits


def sinh(x: float) -> float:
    """Hyperbolic sine."""
    if math.isnan(x) or x == 0.0 or abs(x) > _MAX_EXPONENT:
        return x if x == 0.0 else NAN if math.isnan(x) else math.copysign(INFINITY, x)
    above, below, bits = _both_exponentials(x)
    return _rounded_double(above - below, bits + 1, x)


def cosh(x: float) -> float:
    """Hyperbolic cosine."""
    if math.isnan(x) or abs(x) > _MAX_EXPONENT:
        return NAN if math.isnan(x) else INFINITY
    above, below, bits = _both_exponentials(x)
    return _rounded_double(above + below, bits + 1)


def tanh(x: float) -> float:
    """Hyperbolic tangent."""
    if math.isnan(x) or x == 0.0 or abs(x) > 40.0:
        return x if x == 0.0 else NAN if math.isnan(x) else math.copysign(1.0, x)
    above, below, bits = _both_exponentials(x)
    return _rounded_double(_quotient(above - below, above + below, bits), bits, x)


def log(x: float) -> float:
    """Natural logarithm; -inf at zero."""
    if not 0.0 < x < INFINITY:
        return -INFINITY if x == 0.0 else INFINITY if x == INFINITY else NAN
    return _rounded_double(_logarithm_of(x, _EXTRA_BITS), _EXTRA_BITS)


def log1p(x: float) -> float:
    """``ln(1 + x)``; -inf at -1."""
    if not -1.0 < x < INFINITY or x == 0.0:
        return x if x == 0.0 or x == INFINITY else -INFINITY if x == -1.0 else NAN
    bits = _working_bits(x)
    return _rounded_double(_logarithm((1 << bits) + _fixed_point(x, bits), bits), bits, x)


def log10(x: float) -> float:
    """Logarithm to the base of 10."""
    if not 0.0 < x < INFINITY:
        return log(x)
    return _rounded_double(
        _quotient(_logarithm_of(x, _EXTRA_BITS), _logarithm_of(10.0, _EXTRA_BITS), _EXTRA_BITS), _EXTRA_BITS
    )


def asinh(x: float) -> float:
    """Inverse hyperbolic sine."""
    if not math.isfinite(x) or x == 0.0:
        return NAN if math.isnan(x) else x
    bits = _working_bits(x)
    value = _fixed_point(abs(x), bits)
    root = math.isqrt((1 << 2 * bits) + value * value)
    return math.copysign(_rounded_double(_logarithm(value + root, bits), bits), x)


def acosh(x: float) -> float:
    """Inverse hyperbolic cosine."""
    if not 1.0 <= x < INFINITY:
        return INFINITY if x == INFINITY else NAN
    bits = _working_bits(x)
    value = _fixed_point(x, bits)
    return _rounded_double(_logarithm(value + math.isqrt(value * value - (1 << 2 * bits)), bits), bits)


def atanh(x: float) -> float:
    """Inverse hyperbolic tangent; infinite at -1 and 1."""
    if not abs(x) < 1.0 or x == 0.0:
        return x if x == 0.0 else math.copysign(INFINITY, x) if abs(x) == 1.0 else NAN
    bits = _working_bits(x)
    value, one = _fixed_point(x, bits), 1 << bits
    return _rounded_double(_logarithm(_quotient(one + value, one - value, bits), bits), bits + 1, x)


# Powers, hypotenuse, error function.


def power(x: float, y: float) -> float:
    """``x**y``; NaN for a negative base with a fractional exponent."""
    if y == 0.0 or x == 1.0:
        return 1.0
    if not (math.isfinite(x) and math.isfinite(y)) or x == 0.0:
        # Only special cases, where math.pow is exact on every platform.
        try:
            return math.pow(x, y)
        except ValueError:  # a negative power of zero
            return math.copysign(INFINITY, x) if y == int(y) and int(y) % 2 else INFINITY
    if x < 0.0 and y != math.floor(y):
        return NAN
    sign = -1.0 if x < 0.0 and int(y) % 2 else 1.0
    if y == int(y) and abs(y) <= 64.0:
        return sign * _nearest_double(Fraction(abs(x)) ** int(y))
    bits = _EXTRA_BITS + 64
    value = Fraction(y) * _logarithm_of(abs(x), bits)
    if abs(value) > int(_MAX_EXPONENT) << bits:
        return sign * (INFINITY if value > 0 else 0.0)
    result, k = _exponential(math.floor(value), bits)
    return sign * _rounded_double(result, bits - k)


def _nearest_double(value: Fraction) -> float:
    try:
        return float(value)
    except OverflowError:
        return INFINITY


def hypot(x: float, *others: float) -> float:
    """Length of a vector: the square root of the sum of the squares."""
    sizes = [abs(part) for part in (x, *others)]
    if any(math.isinf(size) for size in sizes):
        return INFINITY
    if any(math.isnan(size) for size in sizes):
        return NAN
    total = sum((Fraction(size) ** 2 for size in sizes), Fraction(0))
    if not total:
        return 0.0
    bits = _EXTRA_BITS + max(0, total.denominator.bit_length() - total.numerator.bit_length())
    return _rounded_double(math.isqrt(_fixed_point(total, 2 * bits)), bits)


def erf(x: float) -> float:
    """Error function, by its series about 0. From ``x = 6`` on, the nearest double is 1."""
    if math.isnan(x) or x == 0.0 or abs(x) >= 6.0:
        return x if x == 0.0 or math.isnan(x) else math.copysign(1.0, x)
    bits = _working_bits(x)
    value = _fixed_point(x, bits)
    square, term, total, n = (value * value) >> bits, value, value, 0
    while term not in (0, -1):
        n += 1
        term = -(term * square >> bits) // n
        total += term // (2 * n + 1)
    return _rounded_double(_quotient(2 * total, math.isqrt(_pi(bits) << bits), bits), bits, x)


FUNCTIONS: dict[str, Callable[..., float]] = {
    function.__name__: function
    for function in (
        *(sin, cos, tan, asin, acos, atan, atan2, sinh, cosh, tanh, asinh, acosh, atanh),
        *(exp, expm1, log, log10, log1p, power, hypot, erf),
    )
}
"""All functions by name."""
