"""Complex arithmetic with one rounding for each real operation: the same bits on every machine.

Complex products and quotients in Python and NumPy depend on the C compiler, which may fuse a product and a
sum into one rounding. Magnitudes and square roots depend on the C library.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from armblocks.rounded_functions import hypot


def magnitude(z: complex) -> float:
    """The magnitude ``|z|``."""
    return hypot(z.real, z.imag)


def product(factors: Iterable[complex]) -> complex:
    """The product of all factors, from left to right; 1 if there are none."""
    re, im = 1.0, 0.0
    for factor in factors:
        re, im = re * factor.real - im * factor.imag, re * factor.imag + im * factor.real
    return complex(re, im)


def quotient(dividend: complex, divisor: complex) -> complex:
    """``dividend / divisor`` by R. L. Smith's algorithm (Algorithm 116, Comm. ACM 5(8), 1962)."""
    if abs(divisor.real) >= abs(divisor.imag):
        ratio = divisor.imag / divisor.real
        scale = divisor.real + divisor.imag * ratio
        re, im = dividend.real + dividend.imag * ratio, dividend.imag - dividend.real * ratio
    else:
        ratio = divisor.real / divisor.imag
        scale = divisor.real * ratio + divisor.imag
        re, im = dividend.real * ratio + dividend.imag, dividend.imag * ratio - dividend.real
    return complex(re / scale, im / scale)


def square_root(z: complex) -> complex:
    """The square root with a non-negative real part; its imaginary part has the sign of ``z.imag``."""
    if z == 0.0:
        return complex(0.0, z.imag)
    large = math.sqrt((abs(z.real) + magnitude(z)) / 2.0)
    small = abs(z.imag) / (2.0 * large)
    re, im = (large, small) if z.real >= 0.0 else (small, large)
    return complex(re, math.copysign(im, z.imag))
