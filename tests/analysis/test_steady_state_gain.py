"""The steady-state gain is that of exact arithmetic, in all units."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from numpy.typing import NDArray

from armblocks.analysis.linear_system import LinearSystem

Array = NDArray[np.float64]

POWERS = 10.0 ** np.arange(-9, 10)


def exact_gain(system: LinearSystem) -> tuple[Fraction, Fraction] | None:
    """The gain and the sum of the magnitudes of its terms, exactly; ``None`` with an integrator."""
    n = system.order
    identity = 1 if system.is_discrete else 0
    rows = [
        [Fraction(identity * (i == j)) - Fraction(x) for j, x in enumerate(row)] + [Fraction(b)]
        for i, (row, b) in enumerate(zip(system.A.tolist(), system.B[:, 0].tolist(), strict=True))
    ]
    for k in range(n):
        pivot = next((r for r in range(k, n) if rows[r][k]), None)
        if pivot is None:
            return None
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [x / rows[k][k] for x in rows[k]]
        for r in range(n):
            if r != k and rows[r][k]:
                factor = rows[r][k]
                rows[r] = [x - factor * y for x, y in zip(rows[r], rows[k], strict=True)]
    terms = [Fraction(c) * row[-1] for c, row in zip(system.C[0].tolist(), rows, strict=True)]
    direct = Fraction(float(system.D[0, 0]))
    return sum(terms, direct), sum((abs(term) for term in terms), abs(direct))


def random_pair(rng: np.random.Generator, *, discrete: bool) -> tuple[LinearSystem, LinearSystem, float]:
    """A system with small integers, the same system in other units, and the ratio of their gains."""
    n = int(rng.integers(2, 6))
    A = rng.integers(-4, 5, size=(n, n)) * (rng.random((n, n)) < rng.choice([0.5, 1.0])) * 1.0
    A = A / 4.0 if discrete else A - 3.0 * np.eye(n) * rng.integers(0, 2)
    B, C = rng.integers(-3, 4, size=(n, 1)) * 1.0, rng.integers(-3, 4, size=(1, n)) * 1.0
    D = rng.integers(0, 2, size=(1, 1)) * 1.0
    dt = 0.1 if discrete else 0.0
    units, gain = rng.choice(POWERS, size=n), float(rng.choice(POWERS))
    rate = 1.0 if discrete else float(rng.choice(POWERS))
    plain = LinearSystem(A, B, C, D, dt=dt)
    scaled = LinearSystem(
        rate * A * units[:, None] / units, rate * gain * B * units[:, None], C / units, gain * D, dt=dt
    )
    return plain, scaled, gain


def test_gain_is_exact_in_all_units() -> None:
    rng = np.random.default_rng(11)
    integrators = 0
    for k in range(400):
        plain, scaled, gain = random_pair(rng, discrete=k % 3 == 0)
        exact = exact_gain(plain)
        computed, unscaled = scaled.dcgain()[0, 0] / gain, plain.dcgain()[0, 0]
        if exact is None:
            # An integrator on the path makes the gain infinite in all units; others have no effect.
            integrators += 1
            assert math.isinf(computed) == math.isinf(unscaled)
            assert math.isinf(computed) or computed == pytest.approx(unscaled, rel=1e-9, abs=1e-9)
        else:
            # The entries of the plain system are about 1, so that a gain of 0 has rounding errors of 1e-16.
            assert abs(computed - float(exact[0])) <= 1e-11 * (1.0 + float(exact[1]))
    assert integrators > 20


@pytest.mark.parametrize("L, C", [(1e-3, 1e-6), (1e-6, 1e-9), (1e-6, 1e-12), (1e-9, 1e-15)])
def test_gain_of_a_resonant_circuit_is_one(L: float, C: float) -> None:
    A = np.array([[-50.0 / L, -1.0 / (L * C)], [1.0, 0.0]])
    system = LinearSystem(A, np.array([[1.0 / L], [0.0]]), np.array([[0.0, 1.0 / C]]), np.zeros((1, 1)))
    assert system.dcgain()[0, 0] == pytest.approx(1.0, rel=1e-14)


def test_gain_of_slow_and_fast_states_is_finite() -> None:
    A = np.array([[-1e-9, 0.0], [1.0, -1e9]])
    system = LinearSystem(A, np.array([[1.0], [1.0]]), np.eye(2), np.zeros((2, 1)))
    np.testing.assert_allclose(system.dcgain(), [[1e9], [1.000000001]], rtol=1e-14)


def test_gain_of_a_companion_matrix_with_large_coefficients() -> None:
    coefficients = np.poly(-np.arange(1.0, 21.0))  # poles -1, ..., -20
    A = np.eye(20, k=1)
    A[-1] = -coefficients[:0:-1]
    B, C = np.eye(20)[:, -1:], np.eye(20)[:1]
    gain = LinearSystem(A, B, C, np.zeros((1, 1))).dcgain()[0, 0]
    assert gain == pytest.approx(1.0 / coefficients[-1], rel=1e-12)


def test_zeros_have_no_sign() -> None:
    system = -LinearSystem(-np.eye(1), np.eye(1), np.zeros((1, 1)), np.zeros((1, 1)))
    for value in (system.dcgain(), system.C, system.D):
        assert math.copysign(1.0, value[0, 0]) == 1.0
