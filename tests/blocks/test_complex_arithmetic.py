"""Complex arithmetic compared with Python's, whose last bits depend on the C compiler of Python."""

import cmath
from itertools import pairwise

import numpy as np
import pytest

from armblocks.blocks.complex_arithmetic import magnitude, product, quotient, square_root

RNG = np.random.default_rng(2)
NUMBERS = [complex(*pair) for pair in RNG.uniform(-3.0, 3.0, (40, 2)).tolist()]


def test_complex_arithmetic_agrees_with_python() -> None:
    for a, b in pairwise(NUMBERS):
        assert product([a, b, a]) == pytest.approx(a * b * a, rel=1e-14)
        assert quotient(a, b) == pytest.approx(a / b, rel=1e-14)
        assert square_root(a) == pytest.approx(cmath.sqrt(a), rel=1e-14)
        assert magnitude(a) == pytest.approx(abs(a), rel=1e-15)
    assert product([]) == 1.0


@pytest.mark.parametrize("z", [4 + 0j, -4 + 0j, complex(-4.0, -0.0), 9j, 0j, complex(0.0, -0.0)])
def test_roots_on_the_axes_are_exact(z: complex) -> None:
    root, expected = square_root(z), cmath.sqrt(z)
    assert (root.real, root.imag) == (expected.real, expected.imag)
    assert np.signbit(root.imag) == np.signbit(expected.imag)
