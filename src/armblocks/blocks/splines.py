"""Cubic splines through given points: computes the derivatives at the points from the values.

The end conditions are not-a-knot, as in MATLAB's ``spline``. With three points the curve is the parabola,
with two the straight line. C. de Boor, A Practical Guide to Splines, 2001, chapter IV.

A long spline is read by index from a table in which values and derivatives alternate along each axis: for a
table ``(n, m)`` its shape is ``(2 n, 2 m)``. This table is computed numerically from positions and values
before a run.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from casadi import SX, fmax, fmin, if_else
from numpy.typing import NDArray

from armblocks.blocks.long_tables import interval_of
from armblocks.equations import read_entry

Array = NDArray[np.float64]


def spline_derivatives(points: Sequence[float], values: Array) -> Array:
    """The derivatives at n >= 2 points, from values ``(n, …)``; same shape."""
    x, y = np.asarray(points, dtype=np.float64), np.asarray(values, dtype=np.float64)
    h = np.diff(x)
    quotients = np.diff(y, axis=0) / h.reshape(-1, *[1] * (y.ndim - 1))
    if len(x) == 2:
        return np.concatenate([quotients, quotients])
    lower, diagonal, upper = _diagonals(h)
    derivatives = _right_side(h, quotients)
    for k in range(1, len(x)):
        factor = lower[k - 1] / diagonal[k - 1]
        diagonal[k] -= factor * upper[k - 1]
        derivatives[k] -= factor * derivatives[k - 1]
    derivatives[-1] /= diagonal[-1]
    for k in range(len(x) - 2, -1, -1):
        derivatives[k] = (derivatives[k] - upper[k] * derivatives[k + 1]) / diagonal[k]
    return derivatives


@lru_cache(maxsize=16)
def with_derivatives(axes: tuple[tuple[float, ...], ...], table: object) -> Array:
    """The table of a long spline: values and derivatives alternate along each of the given axes."""
    entries = np.asarray(table, dtype=np.float64)
    for k, points in enumerate(axes):
        values = np.moveaxis(entries, k, 0)
        pairs = np.stack([values, spline_derivatives(points, values)], axis=1)
        entries = np.moveaxis(pairs.reshape(2 * len(points), *values.shape[1:]), 0, k)
    return np.ascontiguousarray(entries)


def spline_corners(u: SX, points: SX, cell: SX | None, *, straight: bool) -> list[tuple[SX, SX]]:
    """Indices and weights of the entries of :func:`with_derivatives` for the curve at position u.

    The curve is the cubic Hermite interpolant. ``cell`` is 0 below the first point, 2 from the last point on,
    else 1. Outside the points the curve is constant, or extrapolated linearly (``straight``).
    """
    n = points.numel()
    first, last = points[0], points[n - 1]
    if straight or cell is None:
        clipped = fmin(fmax(u, first), last)
    else:
        clipped = if_else(cell == 0.0, first, if_else(cell == 2.0, last, u))
    k = interval_of(clipped, points)
    begin, end = read_entry(points, k), read_entry(points, k + 1.0)
    h = end - begin
    s = (clipped - begin) / h
    r = 1.0 - s
    left, right = h * s * r * r, -h * s * s * r
    if straight:
        beyond = u - clipped
        left, right = left + if_else(u < first, beyond, 0.0), right + if_else(u > last, beyond, 0.0)
    offset = 2.0 * k
    return [
        (offset, r * r * (1.0 + 2.0 * s)),
        (offset + 1.0, left),
        (offset + 2.0, s * s * (1.0 + 2.0 * r)),
        (offset + 3.0, right),
    ]


def _diagonals(h: Array) -> tuple[Array, Array, Array]:
    """Lower, main and upper diagonal of the linear system for the derivatives."""
    n = len(h) + 1
    lower, diagonal, upper = np.zeros(n - 1), np.zeros(n), np.zeros(n - 1)
    before, after = h[:-1], h[1:]
    lower[:-1], diagonal[1:-1], upper[1:] = after, 2.0 * (before + after), before
    if n == 3:
        diagonal[0] = upper[0] = lower[1] = diagonal[2] = 1.0
    else:
        diagonal[0], upper[0] = h[1], h[0] + h[1]
        diagonal[-1], lower[-1] = h[-2], h[-1] + h[-2]
    return lower, diagonal, upper


def _right_side(h: Array, quotients: Array) -> Array:
    """The right-hand side ``(n, …)`` of the system, from the difference quotients ``(n - 1, …)``."""
    n = len(h) + 1
    right = np.empty((n, *quotients.shape[1:]))
    before, after = (part.reshape(-1, *[1] * (quotients.ndim - 1)) for part in (h[:-1], h[1:]))
    right[1:-1] = 3.0 * (after * quotients[:-1] + before * quotients[1:])
    if n == 3:
        right[0], right[2] = 2.0 * quotients[0], 2.0 * quotients[1]
        return right
    first, last = h[0] + h[1], h[-1] + h[-2]
    right[0] = ((h[0] + 2.0 * first) * h[1] * quotients[0] + h[0] * h[0] * quotients[1]) / first
    right[-1] = ((h[-1] + 2.0 * last) * h[-2] * quotients[-1] + h[-1] * h[-1] * quotients[-2]) / last
    return right
