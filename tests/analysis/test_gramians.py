"""Gramians do not depend on units, and are positive semidefinite."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from numpy.typing import NDArray

from armblocks.analysis.linear_system import LinearSystem
from armblocks.errors import InputError

Array = NDArray[np.float64]

POWERS = 10.0 ** np.arange(-9, 10)


def exact_gramian(A: Array, B: Array, *, discrete: bool) -> Array:
    """The solution of the Lyapunov equation, by elimination with rational numbers."""
    n = len(A)
    a = [[Fraction(x) for x in row] for row in A.tolist()]
    b = [[Fraction(x) for x in row] for row in B.tolist()]
    entry = {(i, j): i * n + j for i in range(n) for j in range(n)}
    rows: list[list[Fraction]] = []
    for i, j in entry:
        row = [Fraction(0)] * (n * n + 1)
        if discrete:
            row[entry[i, j]] -= 1
            for k, m in entry:
                row[entry[k, m]] += a[i][k] * a[j][m]
        else:
            for k in range(n):
                row[entry[k, j]] += a[i][k]
                row[entry[i, k]] += a[j][k]
        row[-1] = -sum((x * y for x, y in zip(b[i], b[j])), Fraction(0))
        rows.append(row)
    for c in range(n * n):
        pivot = next(r for r in range(c, n * n) if rows[r][c])
        rows[c], rows[pivot] = rows[pivot], rows[c]
        rows[c] = [x / rows[c][c] for x in rows[c]]
        for r in range(n * n):
            if r != c and rows[r][c]:
                factor = rows[r][c]
                rows[r] = [x - factor * y for x, y in zip(rows[r], rows[c])]
    return np.array([[float(rows[i * n + j][-1]) for j in range(n)] for i in range(n)])


def random_system(rng: np.random.Generator, n: int, *, discrete: bool) -> LinearSystem:
    """A stable system with decoupled and coupled states, in units that differ by up to 18 decades."""
    draw = rng.integers(-4, 5, size=(n, n)) * (rng.random((n, n)) < 0.7) * 1.0
    eigenvalues = np.linalg.eigvals(draw)
    growth, radius = max(0.0, float(eigenvalues.real.max())), max(1.0, float(np.abs(eigenvalues).max()))
    A = draw / (1.3 * radius) if discrete else draw - (growth + 0.3) * np.eye(n)
    units = rng.choice(POWERS, size=n)
    rate = 1.0 if discrete else float(rng.choice(POWERS))
    B = rng.integers(-3, 4, size=(n, int(rng.integers(1, 3)))) * rng.choice(POWERS)
    C = rng.integers(-3, 4, size=(int(rng.integers(1, 3)), n)) * rng.choice(POWERS)
    return LinearSystem(
        rate * A * units[:, None] / units,
        B * units[:, None],
        C / units,
        np.zeros((len(C), B.shape[1])),
        dt=0.1 if discrete else 0.0,
    )


@pytest.mark.parametrize("seed", range(40))
def test_gramians_are_exact_in_all_units(seed: int) -> None:
    rng = np.random.default_rng(seed)
    discrete = seed % 2 == 1
    system = random_system(rng, 1 + seed % 3, discrete=discrete)
    for gramian, A, B in zip(system.gramians(), (system.A, system.A.T), (system.B, system.C.T), strict=True):
        exact = exact_gramian(A, B, discrete=discrete)
        sizes = np.sqrt(np.diag(exact))
        # The condition of these systems is below 1e4, in units in which all states have similar sizes.
        assert (np.abs(gramian - exact) <= 1e-11 * np.outer(sizes, sizes)).all()
        scales = np.where(sizes > 0.0, sizes, 1.0)
        assert np.linalg.eigvalsh(gramian / np.outer(scales, scales)).min() >= -1e-14


@pytest.mark.parametrize("L, C", [(1e-3, 1e-6), (1e-4, 1e-7), (1e-6, 1e-9), (1e-9, 1e-12)])
def test_gramian_of_a_resonant_circuit(L: float, C: float) -> None:
    # Current i and charge q: L i' = u - R i - q / C, q' = i. The gramian is diag(1 / (2 R L), C / (2 R)).
    R = 50.0
    A = np.array([[-R / L, -1.0 / (L * C)], [1.0, 0.0]])
    B, output = np.array([[1.0 / L], [0.0]]), np.array([[0.0, 1.0 / C]])
    system = LinearSystem(A, B, output, np.zeros((1, 1)))
    gramian = system.gramians()[0]
    assert np.diag(gramian) == pytest.approx([1.0 / (2.0 * R * L), C / (2.0 * R)], rel=1e-12, abs=0.0)
    assert abs(gramian[0, 1]) <= 1e-14 * np.sqrt(gramian[0, 0] * gramian[1, 1])


def test_gramian_of_weakly_coupled_states_is_accurate_for_each_state() -> None:
    A = np.array([[-1.0, 1e-9], [1e-9, -1.0]])
    B = np.array([[1.0], [0.0]])
    gramian = LinearSystem(A, B, B.T, np.zeros((1, 1))).gramians()[0]
    np.testing.assert_allclose(gramian, exact_gramian(A, B, discrete=False), rtol=1e-14, atol=0.0)


def test_gramians_of_slow_and_fast_states() -> None:
    A = np.array([[-1e-9, 0.0, 1.0], [0.0, -1e9, 1.0], [0.0, 0.0, -1.0]])
    B = np.ones((3, 1))
    gramian = LinearSystem(A, B, B.T, np.zeros((1, 1))).gramians()[0]
    np.testing.assert_allclose(gramian, exact_gramian(A, B, discrete=False), rtol=1e-14, atol=0.0)


def test_state_that_no_input_affects_has_the_gramian_zero() -> None:
    # The difference of two equal lags is 0.
    A = np.array([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [1.0, -1.0, -3.0]])
    system = LinearSystem(A, np.array([[1.0], [1.0], [0.0]]), np.eye(3), np.zeros((3, 1)))
    assert system.gramians()[0][2, 2] <= 1e-30


def test_gramian_that_no_number_can_represent_is_refused() -> None:
    with pytest.raises(InputError, match="the controllability Gramian has a relative residual of inf"):
        LinearSystem(-np.eye(1), 1e200 * np.eye(1), np.eye(1), np.zeros((1, 1))).gramians()
