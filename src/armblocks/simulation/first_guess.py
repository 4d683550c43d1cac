"""Start values of Newton's method: another guess where the Jacobian at the given guess is singular."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from armblocks.integration.run_point import RunPoint
from armblocks.integration.system import CompiledSystem

Array = NDArray[np.float64]

SHIFTS = (0.1, -0.1, 1.0, -1.0, 10.0, -10.0, 100.0, -100.0)
"""Numbers that are added to the guess, one after the other, until a solution is found."""
MAX_ITERATIONS = 50
"""Maximum number of Newton iterations for each start value."""
MAX_CONDITION, MAX_STEP = 1e12, 1e6
"""The Jacobian counts as singular above this condition number, and if a Newton step exceeds this multiple of
``1 + |w|``."""
MAX_UNKNOWNS = 50
"""Maximum number of unknowns; difference quotients for more unknowns would take longer than a run."""


def first_guess(compiled: CompiledSystem, start: RunPoint, p: Array) -> Array:
    """The guess ``start.w`` if its Jacobian is regular, else a solution near the guess, if there is one.

    Example: for ``w^2 = 1`` the derivative at the guess 0 is 0; from 0.1 the iteration finds the solution 1.
    If no solution is found, the guess is unchanged and the run reports the singular loop.
    """
    guess = start.w
    if not 0 < guess.size <= MAX_UNKNOWNS or _step(compiled, start, guess, p) is not None:
        return guess
    for shift in SHIFTS:
        solution = _solution(compiled, start, guess + shift, p)
        if solution is not None:
            return solution
    return guess


def _solution(compiled: CompiledSystem, start: RunPoint, w: Array, p: Array) -> Array | None:
    for _ in range(MAX_ITERATIONS):
        step = _step(compiled, start, w, p)
        if step is None:
            return None
        w = w - step
        if (np.abs(step) <= 1e-12 * (1.0 + np.abs(w))).all():
            return w
    return None


def _step(compiled: CompiledSystem, start: RunPoint, w: Array, p: Array) -> Array | None:
    """The Newton step with difference quotients as derivatives; ``None`` if the Jacobian is singular."""

    def residual(at: Array) -> Array:
        return compiled.residual(start.time, start.x, start.z, at, p)

    value = residual(w)
    size = 1e-7 * (1.0 + np.abs(w))
    columns = [(residual(w + d) - residual(w - d)) / (2.0 * d.sum()) for d in np.diag(size)]
    jacobian = np.array(columns).T
    if not (np.isfinite(jacobian).all() and np.isfinite(value).all()):
        return None
    if np.linalg.cond(jacobian) > MAX_CONDITION:
        return None
    step = _solve(jacobian, value)
    return step if (np.abs(step) < MAX_STEP * (1.0 + np.abs(w))).all() else None


def _solve(matrix: Array, right: Array) -> Array:
    """The solution of linear equations by elimination with row pivoting.

    The last bits of LAPACK's results depend on the processor, and the last bits of a guess affect the run.
    """
    rows = np.column_stack([matrix, right])
    n = len(right)
    for k in range(n):
        pivot = k + int(np.argmax(np.abs(rows[k:, k])))
        rows[[k, pivot]] = rows[[pivot, k]]
        factors = rows[k + 1 :, k] / rows[k, k]
        rows[k + 1 :] -= factors[:, np.newaxis] * rows[k]
    solution = np.zeros(n)
    for k in reversed(range(n)):
        rest = rows[k, n]
        for j in range(k + 1, n):
            rest = rest - rows[k, j] * solution[j]
        solution[k] = rest / rows[k, k]
    return solution
