"""Distances of convex bodies, many pairs at once: the algorithm of Gilbert, Johnson and Keerthi.

A body is the convex hull of points, enlarged by a radius: a sphere is one point, a capsule two, a box eight.
The distance of two hulls is the length of the shortest vector v in their difference. Each iteration adds the
point of the difference that is farthest in the direction -v to a simplex of at most four points, and v
becomes the shortest vector in the simplex. Source: Gilbert, Johnson, Keerthi, IEEE J. Robotics and Automation
4(2), 1988.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

MAX_ITERATIONS = 80
ACCURACY = 1e-10
"""Relative difference of upper and lower bound of the squared distance at which an iteration ends."""
TOUCHING = 1e-12
"""Distance relative to the size of the bodies below which hulls overlap."""
_SUBSETS = [subset for size in (1, 2, 3, 4) for subset in combinations(range(4), size)]


def hull_distances(first: Array, second: Array) -> tuple[Array, Array, Array]:
    """Distances (N,) of the hulls of points (N, k, 3) and (N, m, 3), and the nearest points (N, 3) of both.

    The distance is 0 where the hulls overlap; the nearest points are then some common point.
    """
    N = len(first)
    scale = np.maximum(np.abs(first).max(axis=(1, 2)), np.abs(second).max(axis=(1, 2))) + 1e-300
    sizes = np.linalg.norm(np.ptp(first, axis=1), axis=1) + np.linalg.norm(np.ptp(second, axis=1), axis=1)
    simplex, used = np.zeros((N, 4, 3)), np.zeros((N, 4), dtype=bool)
    on_first, on_second = np.zeros((N, 4, 3)), np.zeros((N, 4, 3))
    weights = np.zeros((N, 4))
    weights[:, 0], used[:, 0] = 1.0, True
    on_first[:, 0], on_second[:, 0] = first[:, 0], second[:, 0]
    simplex[:, 0] = first[:, 0] - second[:, 0]
    v = simplex[:, 0].copy()
    active = np.arange(N)
    limit = (TOUCHING * np.maximum(sizes, 1e-3 * scale)) ** 2
    for _ in range(MAX_ITERATIONS):
        direction = v[active]
        a = np.einsum("nki,ni->nk", first[active], direction).argmin(axis=1)
        b = np.einsum("nki,ni->nk", second[active], direction).argmax(axis=1)
        p, s = first[active, a], second[active, b]
        square = (direction * direction).sum(axis=1)
        gap = square - ((p - s) * direction).sum(axis=1)
        going = (gap > ACCURACY * square) & (square > limit[active])
        active, p, s, square = active[going], p[going], s[going], square[going]
        if not active.size:
            break
        slot = np.argmin(used[active], axis=1)
        simplex[active, slot], on_first[active, slot], on_second[active, slot] = p - s, p, s
        used[active, slot] = True
        found = _shortest(simplex[active], used[active])
        shortest = np.einsum("nk,nki->ni", found, simplex[active])
        # Rounding errors end the iteration where the vector does not become shorter.
        shorter = (shortest * shortest).sum(axis=1) < square
        active, found = active[shorter], found[shorter]
        weights[active], used[active], v[active] = found, found > 0.0, shortest[shorter]
        if not active.size:
            break
    distance = np.sqrt((v * v).sum(axis=1))
    distance[distance * distance <= limit] = 0.0
    return (
        distance,
        np.einsum("nk,nki->ni", weights, on_first),
        np.einsum("nk,nki->ni", weights, on_second),
    )


def _shortest(simplex: Array, used: Flags) -> Array:
    """The weights (N, 4) of the shortest vector in each simplex: the best of its faces.

    On the face of some points, the weights solve the normal equations; they are valid if none is negative.
    """
    N = len(simplex)
    best, weights = np.full(N, np.inf), np.zeros((N, 4))
    for subset in _SUBSETS:
        points = simplex[:, list(subset)]
        found, valid = _affine_weights(points)
        valid &= used[:, list(subset)].all(axis=1) & (found >= 0.0).all(axis=1)
        vector = np.einsum("nk,nki->ni", found, points)
        square = np.where(valid, (vector * vector).sum(axis=1), np.inf)
        better = square < best
        best[better] = square[better]
        weights[better] = 0.0
        for column, corner in enumerate(subset):
            weights[better, corner] = found[better, column]
    return weights


def _affine_weights(points: Array) -> tuple[Array, Flags]:
    """Weights (N, k) of the shortest vector of the affine hull of k points, and whether they are unique."""
    N, k, _ = points.shape
    if k == 1:
        ones = np.ones((N, 1))
        return ones, ones[:, 0] > 0.0
    edges = points[:, 1:] - points[:, :1]
    G: Array = np.einsum("nai,nbi->nab", edges, edges)
    right: Array = -np.einsum("nai,ni->na", edges, points[:, 0])
    lengths: Array = np.einsum("naa->na", G)
    unique: Flags = np.asarray(np.linalg.det(G) > 1e-14 * lengths.prod(axis=1))
    safe = np.where(unique[:, None, None], G, np.eye(k - 1))
    rest = np.asarray(np.linalg.solve(safe, right[..., None])[..., 0], dtype=np.float64)
    return np.column_stack([1.0 - rest.sum(axis=1), rest]), unique
