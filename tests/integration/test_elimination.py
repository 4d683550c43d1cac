"""The plan of a sparse elimination: solutions compared with NumPy, and the fill-in of known patterns."""

from __future__ import annotations

import numpy as np
import pytest

from armblocks.integration.elimination_plan import Elimination, JacobianPattern, plan_elimination


def pattern_of(matrix: np.ndarray, states: int) -> JacobianPattern:
    rows, columns = np.nonzero(matrix)
    return JacobianPattern(
        states=states, size=len(matrix), rows=tuple(rows.tolist()), columns=tuple(columns.tolist())
    )


def solve(plan: Elimination, values: np.ndarray, right: np.ndarray, diagonal: np.ndarray) -> np.ndarray:
    """Execute the elimination of the plan in Python; only planned entries are read or written."""
    n = len(plan.columns)
    L: list[dict[int, float]] = []
    U: list[dict[int, float]] = []
    pivots = np.zeros(n)
    y = np.zeros(n)
    for i in range(n):
        row = dict.fromkeys((*plan.lower[i], i, *plan.upper[i]), 0.0)
        row[i] = diagonal[plan.columns[i]]
        for entry, place in plan.entries[i]:
            row[place] += values[entry]
        for k in plan.lower[i]:
            row[k] /= pivots[k]
            for place in plan.upper[k]:
                row[place] -= row[k] * U[k][place]
        pivots[i] = row[i]
        L.append({k: row[k] for k in plan.lower[i]})
        U.append({k: row[k] for k in plan.upper[i]})
        y[i] = right[plan.equations[i]] - sum(L[i][k] * y[k] for k in plan.lower[i])
    solution = np.zeros(n)
    for i in reversed(range(n)):
        y[i] = (y[i] - sum(U[i][k] * y[k] for k in plan.upper[i])) / pivots[i]
        solution[plan.columns[i]] = y[i]
    return solution


@pytest.mark.parametrize("seed", range(5))
def test_the_plan_solves_random_sparse_equations(seed: int) -> None:
    """Forty states and six implicit equations with zeros on their diagonal, which need a matching."""
    random = np.random.default_rng(seed)
    n, m = 40, 6
    J = np.where(random.random((n + m, n + m)) < 0.06, random.normal(size=(n + m, n + m)), 0.0)
    J[n:, n:] = np.roll(np.diag(random.uniform(1.0, 2.0, m)), 2, axis=1)
    diagonal = np.concatenate([np.full(n, 5.0), np.zeros(m)])
    pattern = pattern_of(J, n)
    right = random.normal(size=n + m)
    actual = solve(plan_elimination(pattern), J[pattern.rows, pattern.columns], right, diagonal)
    np.testing.assert_allclose(actual, np.linalg.solve(np.diag(diagonal) + J, right), rtol=1e-9, atol=1e-11)


def test_the_elimination_of_a_chain_has_no_fill_in() -> None:
    """A tridiagonal matrix has an elimination order without fill-in, and the minimum-degree rule finds it."""
    chain = np.eye(200) + np.eye(200, k=1) + np.eye(200, k=-1)
    assert plan_elimination(pattern_of(chain, 200)).filled == np.count_nonzero(chain)


def test_the_elimination_of_a_star_has_no_fill_in() -> None:
    """The first state is coupled with all others: in the given order the matrix would fill completely."""
    star = np.eye(100)
    star[0, :] = star[:, 0] = 1.0
    plan = plan_elimination(pattern_of(star, 100))
    assert plan.filled == np.count_nonzero(star)


def test_equations_without_a_matching_have_a_plan() -> None:
    """An implicit equation without unknowns is singular in every order, which the factorisation detects."""
    J = np.zeros((4, 4))
    J[2, 0] = J[3, 2] = 1.0
    assert sorted(plan_elimination(pattern_of(J, 2)).equations) == [0, 1, 2, 3]
