"""Geometric paths through points: joint positions over a path parameter, without times.

The path parameter ``s`` is the length of the polygon through the points, each joint divided by its ``scale``,
so that joints in rad and m can be combined.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from armblocks.trajectories.piecewise import PiecewisePolynomial
from armblocks.trajectories.splines import cubic_spline

Array = NDArray[np.float64]


def turning_points(path: PiecewisePolynomial, joints: NDArray[np.bool_]) -> Array:
    """The path parameters at which one of the ``joints`` (n,), a mask, changes its direction within a piece.

    ``path``: pieces of at most the third degree.
    """
    c = np.zeros((len(path.coefficients), 4, np.count_nonzero(joints)))
    c[:, : path.coefficients.shape[1]] = path.coefficients[:, :, joints]
    linear, half, three = c[:, 1], c[:, 2], 3.0 * c[:, 3]
    root = np.sqrt(np.maximum(half * half - three * linear, 0.0))
    # The two zeros of three u² + 2 half u + linear, without cancellation; NaN and infinity are omitted.
    larger = -(half + np.where(half >= 0.0, root, -root))
    with np.errstate(divide="ignore", invalid="ignore"):
        u = np.stack([larger / three, linear / larger])
    length = np.diff(path.times)[:, None]
    # At a double zero the direction does not change.
    inside = (root > 0.0) & (u > 1e-9 * length) & (u < (1.0 - 1e-9) * length)
    return np.unique((path.times[:-1, None] + u)[inside])


def chord_lengths(points: Array, scale: Array) -> Array:
    """The path parameter (K,) at each of the ``points`` (K, n)."""
    lengths = np.sqrt(np.sum((np.diff(points, axis=0) / scale) ** 2, axis=1))
    return np.append(0.0, np.cumsum(lengths))


def spline_path(points: Array, scale: Array) -> PiecewisePolynomial:
    """The natural cubic spline through the points: continuous curvature, no curvature at both ends."""
    path = cubic_spline(chord_lengths(points, scale), points)
    return PiecewisePolynomial(times=path.times, coefficients=path.coefficients)


def blended_path(points: Array, scale: Array, blend: float) -> PiecewisePolynomial:
    """Straight lines between the points with parabolas near the inner points, which the path does not pass.

    ``blend``: the fraction of the shorter adjacent line that a parabola replaces, above 0, up to 0.5. The
    direction of the path is continuous, its curvature jumps.
    """
    s = chord_lengths(points, scale)
    lengths = np.diff(s)
    direction = np.diff(points, axis=0) / lengths[:, None]
    before, rows = 0.0, list[Array]()
    knots = [0.0]
    zero = np.zeros_like(points[0])
    for k, length in enumerate(lengths):
        last = k + 1 == len(lengths)
        after = 0.0 if last else blend * min(length, lengths[k + 1])
        straight = length - before - after
        if straight > 1e-12 * length:
            rows.append(np.array([points[k] + before * direction[k], direction[k], zero]))
            knots.append(s[k] + before + straight)
        if not last:
            bend = (direction[k + 1] - direction[k]) / (4.0 * after)
            rows.append(np.array([points[k + 1] - after * direction[k], direction[k], bend]))
            knots.append(s[k + 1] + after)
        before = after
    knots[-1] = s[-1]
    return PiecewisePolynomial(times=np.array(knots), coefficients=np.array(rows))
