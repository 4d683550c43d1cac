"""Traced interpolation in tables: every method computes weights of the table's entries.

At a position u between the points the value is the sum of ``weights[k] * table[k]``. The weights depend
on u and the points alone, so one tensor contraction handles tables with any number of axes and any
method, and the entries stay tunable. At a point one weight is exactly 1 and the others are exactly 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from casadi import SX, fmax, fmin, if_else, logic_and, logic_not

from armblocks.blocks.splines import spline_derivatives
from armblocks.equations import Shape, flatten

METHODS = ("linear", "nearest", "flat", "cubic")
"""Interpolation methods: piecewise linear; nearest entry (halfway: the upper one); entry at or below; cubic
spline."""
EXTRAPOLATIONS = ("clip", "linear")
"""Extrapolation methods: the value at the end, or the tangent at the end."""

Point = float | SX


def weights(
    u: SX,
    points: Sequence[Point],
    method: str = "linear",
    extrapolation: str = "clip",
    cell: SX | None = None,
) -> list[SX]:
    """The weight of each of n >= 2 ascending points at position ``u``, a scalar.

    The points may be symbols, except for the method ``cubic``. ``cell``, if given, is the number of
    :func:`boundaries` at or below u and selects the equations.
    """
    ends = boundaries(points, method, extrapolation)
    if method in ("flat", "nearest"):
        return cells(u, ends) if cell is None else [cell == float(k) for k in range(len(points))]
    if extrapolation == "linear" and method == "linear":
        interval = None if cell is None else [cell == float(k) for k in range(len(points) - 1)]
        return linear_weights(u, points, interval)
    if cell is None:
        clipped, interval = fmin(fmax(u, points[0]), points[-1]), None
    else:
        last = float(len(ends))
        clipped = if_else(cell == 0.0, points[0], if_else(cell == last, points[-1], u))
        inner_cell = fmin(fmax(cell, 1.0), last - 1.0)
        interval = [inner_cell == float(k) for k in range(1, len(points))]
    if method == "linear":
        return linear_weights(clipped, points, interval)
    fixed = [float(point) for point in points]  # splines need constant points
    weighted = _cubic_weights(clipped, fixed)
    if extrapolation == "linear":
        derivatives = spline_derivatives(fixed, np.eye(len(fixed)))
        for k in range(len(points)):
            rate = if_else(u < points[0], float(derivatives[0, k]), float(derivatives[-1, k]))
            weighted[k] = weighted[k] + rate * (u - clipped)
    return weighted


def boundaries(points: Sequence[Point], method: str, extrapolation: str) -> list[Point]:
    """The positions at which the curve or its derivative jumps.

    A clipped spline has two such positions, its ends. Other splines have none.
    """
    if method == "flat":
        return list(points[1:])
    if method == "nearest":
        return [(left + right) / 2.0 for left, right in pairwise(points)]
    if method == "linear":
        return list(points if extrapolation == "clip" else points[1:-1])
    return [points[0], points[-1]] if extrapolation == "clip" else []


def linear_weights(u: SX, points: Sequence[Point], interval: Sequence[SX] | None = None) -> list[SX]:
    """Weights of linear interpolation (hat functions); the end intervals extend beyond the ends.

    The points may be symbols. ``interval``, if given, is 1 for the interval of u and 0 for all others.
    """
    weights = [SX(0.0) for _ in points]
    for k, inside in enumerate(interval or cells(u, points[1:-1])):
        fraction = (u - points[k]) / (points[k + 1] - points[k])
        weights[k] = weights[k] + if_else(inside, 1.0 - fraction, 0.0)
        weights[k + 1] = weights[k + 1] + if_else(inside, fraction, 0.0)
    return weights


def cells(u: SX, boundaries: Sequence[Point]) -> list[SX]:
    """1 for the cell of u, else 0; one cell more than boundaries; a boundary belongs to the cell above."""
    below = [u < boundary for boundary in boundaries]
    inner = [logic_and(logic_not(left), right) for left, right in pairwise(below)]
    return [below[0], *inner, logic_not(below[-1])] if below else [SX(1.0)]


def contract(table: SX, shape: Shape, weights_by_axis: Sequence[Sequence[SX]]) -> SX:
    """The table's value for the weights along each of its axes."""
    flat = flatten(table, shape)
    entries = [flat[k] for k in range(flat.numel())]
    for axis in reversed(weights_by_axis):
        n = len(axis)
        entries = [
            sum((axis[k] * entries[start + k] for k in range(n)), SX(0.0))
            for start in range(0, len(entries), n)
        ]
    return entries[0]


def _cubic_weights(u: SX, points: Sequence[float]) -> list[SX]:
    """The weights of a cubic spline, from its Hermite form on each interval."""
    values = [SX(0.0) for _ in points]
    derivatives = [SX(0.0) for _ in points]
    for k, inside in enumerate(cells(u, points[1:-1])):
        h = points[k + 1] - points[k]
        s = (u - points[k]) / h
        r = 1.0 - s
        values[k] = values[k] + if_else(inside, r * r * (1.0 + 2.0 * s), 0.0)
        values[k + 1] = values[k + 1] + if_else(inside, s * s * (1.0 + 2.0 * r), 0.0)
        derivatives[k] = derivatives[k] + if_else(inside, h * s * r * r, 0.0)
        derivatives[k + 1] = derivatives[k + 1] - if_else(inside, h * s * s * r, 0.0)
    matrix = spline_derivatives(points, np.eye(len(points)))
    return [
        values[k] + sum((derivatives[i] * float(matrix[i, k]) for i in range(len(points))), SX(0.0))
        for k in range(len(points))
    ]
