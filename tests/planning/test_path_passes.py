"""The native passes of time-optimal motions, compared with linear programs."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import linprog

from armblocks.planning.passes import Rows, fastest_profile

RANDOM = np.random.default_rng(8)


def by_linear_program(rows: Rows, limit: np.ndarray, start: float, end: float) -> np.ndarray | None:
    """The squared speeds with the largest sum, by a linear program; ``None`` if it is infeasible."""
    R, N = rows.alpha.shape
    A, b = [], []
    for i in range(N):
        for j in range(R):
            row = np.zeros(N + 1)
            row[i], row[i + 1] = rows.alpha[j, i], rows.beta[j, i]
            A += [row, -row]
            b += [rows.upper[j, i], -rows.lower[j, i]]
    bounds = [(0.0, v) for v in limit]
    bounds[0], bounds[-1] = (start, start), (end, end)
    found = linprog(-np.ones(N + 1), A_ub=np.array(A), b_ub=b, bounds=bounds, method="highs")
    return found.x if found.status == 0 else None


def random_problem(N: int, R: int, turning: bool) -> tuple[Rows, np.ndarray]:
    """Smooth random coefficients; ``turning``: the inertia of each quantity changes its sign on the path."""
    s = np.linspace(0.0, 1.0, N + 1)
    phase, frequency = RANDOM.uniform(0, 6, (2, R, 1)), RANDOM.uniform(2, 9, (2, R, 1))
    a, b = (np.sin(f * s + p) for f, p in zip(frequency, phase))
    if not turning:
        a = 1.5 + a
    bound = RANDOM.uniform(0.5, 2.0, (R, 1))
    c = 0.4 * bound * np.sin(3.0 * s + phase[0])
    half = N / 2.0
    starts = (-half * a[:, :-1] + b[:, :-1], half * a[:, :-1], -bound - c[:, :-1], bound - c[:, :-1])
    ends = (-half * a[:, 1:], half * a[:, 1:] + b[:, 1:], -bound - c[:, 1:], bound - c[:, 1:])
    rows = Rows(*(np.concatenate(pair) for pair in zip(starts, ends)))
    return rows, RANDOM.uniform(0.5, 3.0, N + 1)


@pytest.mark.parametrize("turning", [False, True])
@pytest.mark.parametrize("seed", range(12))
def test_the_passes_find_the_largest_speeds_of_a_linear_program(seed: int, turning: bool) -> None:
    rows, limit = random_problem(int(RANDOM.integers(5, 40)), int(RANDOM.integers(1, 6)), turning)
    expected = by_linear_program(rows, limit, 0.0, 0.0)
    profile = fastest_profile(rows, limit, 0.0, 0.0)
    assert expected is not None and profile.failed is None
    values = rows.alpha * profile.x[:-1] + rows.beta * profile.x[1:]
    scale = np.abs(rows.alpha).max() * limit.max()
    assert (values <= rows.upper + 1e-9 * scale).all() and (values >= rows.lower - 1e-9 * scale).all()
    assert (profile.x <= limit + 1e-12).all() and profile.x[0] == profile.x[-1] == 0.0
    if not turning:
        assert_allclose(profile.x, expected, rtol=0, atol=1e-7 * limit.max())
        return
    # Near points without inertia no solution is the fastest at all points: a larger speed at one point
    # reduces the speed at others.
    durations = [
        2.0 / N / (np.sqrt(x[:-1]) + np.sqrt(x[1:])) for x in (profile.x, expected) for N in [len(x) - 1]
    ]
    assert durations[0].sum() <= 1.01 * durations[1].sum()


def test_a_mass_on_a_line_accelerates_and_brakes() -> None:
    N = 64
    half = np.full((1, N), N / 2.0)
    rows = Rows(-half, half, np.full((1, N), -1.0), np.full((1, N), 2.0))  # -1 <= u <= 2
    s = np.linspace(0.0, 1.0, N + 1)
    profile = fastest_profile(rows, np.full(N + 1, 9.0), 0.0, 0.0)
    assert_allclose(profile.x, np.minimum(4.0 * s, 2.0 * (1.0 - s)), atol=1e-12)
    slow = fastest_profile(rows, np.full(N + 1, 0.5), 0.0, 0.0)
    assert_allclose(slow.x, np.minimum(np.minimum(4.0 * s, 2.0 * (1.0 - s)), 0.5), atol=1e-12)


def test_an_infeasible_point_is_named() -> None:
    N = 10
    half = np.full((1, N), N / 2.0)
    low, high = np.full((1, N), -1.0), np.full((1, N), 1.0)
    zero = np.zeros((1, N))
    blocked_low, blocked_high = np.full((1, N), -1.0), np.full((1, N), 1.0)
    blocked_low[0, 6] = 0.5  # 5 x[7] >= 0.5, but x[7] <= 0.05
    blocked_high[0, 6] = 0.6
    rows = Rows(
        *(np.concatenate(p) for p in ((-half, zero), (half, half), (low, blocked_low), (high, blocked_high)))
    )
    profile = fastest_profile(rows, np.full(N + 1, 0.05), 0.0, 0.0)
    assert profile.failed == 6
    assert by_linear_program(rows, np.full(N + 1, 0.05), 0.0, 0.0) is None
    fast_start = fastest_profile(Rows(-half, half, low, high), np.full(N + 1, 9.0), 5.0, 0.0)
    assert fast_start.failed == 0
