"""Splines through via points: cubic with continuous acceleration, quintic with continuous snap.

Source: C. de Boor, A Practical Guide to Splines, 2001, chapters IV and XV.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from armblocks.trajectories.piecewise import PiecewisePolynomial, hermite

Array = NDArray[np.float64]


def cubic_spline(
    times: Array, points: Array, qd0: Array | None = None, qd1: Array | None = None
) -> PiecewisePolynomial:
    """Cubic pieces through ``points`` (K + 1, n) with continuous acceleration.

    ``qd0``, ``qd1`` (n,): speeds at the ends. ``None``: the acceleration at this end is 0 (natural spline).
    """
    count, n = points.shape
    h = np.diff(times)
    rate = np.diff(points, axis=0) / h[:, None]
    lower, diagonal, upper = np.zeros(count), np.zeros(count), np.zeros(count)
    right = np.zeros((count, n))
    lower[1:-1], upper[1:-1] = h[1:], h[:-1]
    diagonal[1:-1] = 2.0 * (h[:-1] + h[1:])
    right[1:-1] = 3.0 * (h[1:, None] * rate[:-1] + h[:-1, None] * rate[1:])
    for index, neighbour, speed, mean in ((0, upper, qd0, rate[0]), (-1, lower, qd1, rate[-1])):
        if speed is None:
            diagonal[index], neighbour[index], right[index] = 2.0, 1.0, 3.0 * mean
        else:
            diagonal[index], right[index] = 1.0, speed
    for k in range(1, count):
        factor = lower[k] / diagonal[k - 1]
        diagonal[k] -= factor * upper[k - 1]
        right[k] -= factor * right[k - 1]
    right[-1] /= diagonal[-1]
    for k in range(count - 2, -1, -1):
        right[k] = (right[k] - upper[k] * right[k + 1]) / diagonal[k]
    curve = hermite(times, (points[:-1], right[:-1]), (points[1:], right[1:]))
    last = curve.at(times[-1])
    end = np.array([points[-1], right[-1], last.qdd])
    return PiecewisePolynomial(times=times, coefficients=curve.coefficients, end=end)


def quintic_spline(times: Array, points: Array, qd0: Array, qd1: Array) -> PiecewisePolynomial:
    """Quintic pieces through ``points`` (K + 1, n) with four continuous derivatives.

    The ends have the speeds ``qd0``, ``qd1`` (n,) and no acceleration. The unknowns are the speeds and
    accelerations at the inner points; the third and fourth derivatives are continuous there. The system has
    2 × 2 blocks on three diagonals and is solved by block elimination.
    """
    count, n = points.shape
    states = np.zeros((count, 2, n))
    states[0, 0], states[-1, 0] = qd0, qd1
    if count > 2:
        states[1:-1] = _inner_states(np.diff(times), np.diff(points, axis=0), states[0], states[-1])
    qd, qdd = states[:, 0], states[:, 1]
    end = np.array([points[-1], qd1, np.zeros(n)])
    return hermite(times, (points[:-1], qd[:-1], qdd[:-1]), (points[1:], qd[1:], qdd[1:]), end=end)


def _inner_states(h: Array, change: Array, first: Array, last: Array) -> Array:
    """Speeds and accelerations (K - 1, 2, n) at the inner points."""
    count, n = len(h) - 1, change.shape[1]
    diagonal, right = np.zeros((count, 2, 2)), np.zeros((count, 2, n))
    lower, upper = np.zeros((count, 2, 2)), np.zeros((count, 2, 2))
    for k in range(count):
        a, b = h[k], h[k + 1]
        # Rows: third and fourth derivative at the end of the piece before, minus the derivatives at the start
        # of the piece after. Columns: speed and acceleration at one point.
        lower[k] = [[-24 / a**2, -3 / a], [-168 / a**3, -24 / a**2]]
        upper[k] = [[24 / b**2, -3 / b], [-168 / b**3, 24 / b**2]]
        diagonal[k] = [
            [36 / b**2 - 36 / a**2, 9 / a + 9 / b],
            [-192 / a**3 - 192 / b**3, 36 / a**2 - 36 / b**2],
        ]
        before, after = change[k], change[k + 1]
        right[k, 0] = 60 / b**3 * after - 60 / a**3 * before
        right[k, 1] = -360 / b**4 * after - 360 / a**4 * before
    right[0] -= lower[0] @ first
    right[-1] -= upper[-1] @ last
    for k in range(1, count):
        factor: Array = np.linalg.solve(np.transpose(diagonal[k - 1]), np.transpose(lower[k])).T
        diagonal[k] -= factor @ upper[k - 1]
        right[k] -= factor @ right[k - 1]
    for k in range(count - 1, -1, -1):
        if k + 1 < count:
            right[k] -= upper[k] @ right[k + 1]
        right[k] = np.linalg.solve(diagonal[k], right[k])
    return right
