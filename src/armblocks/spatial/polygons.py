"""Simple polygons in a plane: exact orientation, self-intersections, integrals, triangles.

A polygon is a sequence of corners (x, y); an edge connects the last corner with the first one. Sums are
correctly rounded and no function of the C library is called: results are bit-identical on all machines.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple, TypeAlias

import numpy as np

Point: TypeAlias = tuple[float, float]
Polygon: TypeAlias = tuple[Point, ...]

_RELATIVE_ERROR = (3.0 + 16.0 * 2.0**-53) * 2.0**-53
"""Bound of the rounding error of an orientation relative to its terms: J. R. Shewchuk, Adaptive precision
floating-point arithmetic, Discrete & Computational Geometry 18, 1997, section 4.2."""
_UNDERFLOW = 1e-300


class Integrals(NamedTuple):
    """The integrals of 1, x, y, x2, x y, y2, x3, x2 y and x y2 over a polygon."""

    area: float
    x: float
    y: float
    xx: float
    xy: float
    yy: float
    xxx: float
    xxy: float
    xyy: float


def orientation(a: Point, b: Point, c: Point) -> int:
    """1 if a, b, c are counter-clockwise, -1 if clockwise, 0 if collinear; exact for all finite points."""
    left = (b[0] - a[0]) * (c[1] - a[1])
    right = (b[1] - a[1]) * (c[0] - a[0])
    if abs(left - right) > _RELATIVE_ERROR * (abs(left) + abs(right)) + _UNDERFLOW:
        return 1 if left > right else -1
    ax, ay, bx, by, cx, cy = (Fraction(value) for value in (*a, *b, *c))
    exact = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    return (exact > 0) - (exact < 0)


def distinct_corners(points: Sequence[Sequence[float]]) -> Polygon:
    """The corners without those that repeat the corner before them; the last one may repeat the first one."""
    corners = [(float(x), float(y)) for x, y in points]
    return tuple(corner for before, corner in pairwise([corners[-1], *corners]) if corner != before)


def first_intersection(polygon: Polygon) -> tuple[int, int] | None:
    """The numbers of two edges that cross, touch or overlap, other than at the corner between them.

    Edge k is from corner k to the next one. ``None`` for a simple polygon. Two successive corners must
    differ.
    """
    n = len(polygon)
    ends = np.array([(polygon[k], polygon[(k + 1) % n]) for k in range(n)])
    low, high = ends.min(axis=1), ends.max(axis=1)
    for i in range(n):
        near = (low[i + 1 :] <= high[i]).all(axis=1) & (high[i + 1 :] >= low[i]).all(axis=1)
        for j in (np.flatnonzero(near) + i + 1).tolist():
            a, b, c, d = polygon[i], polygon[(i + 1) % n], polygon[j], polygon[(j + 1) % n]
            if j == i + 1:
                meet = _folds_back(a, b, d)
            elif (j + 1) % n == i:
                meet = _folds_back(c, a, b)
            else:
                meet = _meet(a, b, c, d)
            if meet:
                return i, j
    return None


def _folds_back(a: Point, b: Point, c: Point) -> bool:
    """Whether the edge from b to c begins along the edge from a to b, backwards."""
    if orientation(a, b, c) != 0:
        return False
    return (a[0] > b[0]) == (c[0] > b[0]) if a[0] != b[0] else (a[1] > b[1]) == (c[1] > b[1])


def _meet(a: Point, b: Point, c: Point, d: Point) -> bool:
    """Whether the segments a b and c d, whose bounding boxes overlap, have a common point."""
    return (
        orientation(a, b, c) * orientation(a, b, d) <= 0 and orientation(c, d, a) * orientation(c, d, b) <= 0
    )


def counter_clockwise(polygon: Polygon) -> Polygon:
    """The simple polygon, with its corners in counter-clockwise order."""
    k = min(range(len(polygon)), key=lambda i: polygon[i])  # a convex corner
    turn = orientation(polygon[k - 1], polygon[k], polygon[(k + 1) % len(polygon)])
    return polygon if turn > 0 else polygon[::-1]


def integrals(polygon: Polygon, about: Point = (0.0, 0.0)) -> Integrals:
    """The integrals over a counter-clockwise simple polygon, of coordinates relative to the point ``about``.

    Each edge and the origin span a triangle. The integral of a homogeneous polynomial of degree n over it is
    twice its area times the mean of the polynomial on the edge over n + 2; two Gauss points give the mean of
    a polynomial of degree 3 exactly.
    """
    corners = [(x - about[0], y - about[1]) for x, y in polygon]
    terms: list[tuple[float, ...]] = []
    for (ax, ay), (bx, by) in pairwise([*corners, corners[0]]):
        area = ax * (by - ay) - ay * (bx - ax)
        mean = [0.0] * 8
        for t in _GAUSS_POINTS:
            x, y = ax + t * (bx - ax), ay + t * (by - ay)
            values = (x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y)
            mean = [sum_ + 0.5 * value for sum_, value in zip(mean, values)]
        scales = (3.0, 3.0, 4.0, 4.0, 4.0, 5.0, 5.0, 5.0)
        terms.append((area / 2.0, *(area * value / scale for value, scale in zip(mean, scales))))
    return Integrals(*(math.fsum(column) for column in zip(*terms)))


_GAUSS_POINTS = (0.5 - math.sqrt(3.0) / 6.0, 0.5 + math.sqrt(3.0) / 6.0)


def centroid(polygon: Polygon) -> Point:
    """The centroid of a counter-clockwise simple polygon."""
    xs, ys = zip(*polygon)
    middle = (0.5 * min(xs) + 0.5 * max(xs), 0.5 * min(ys) + 0.5 * max(ys))
    found = integrals(polygon, middle)
    return middle[0] + found.x / found.area, middle[1] + found.y / found.area


@lru_cache(maxsize=64)
def triangulation(polygon: Polygon) -> tuple[tuple[int, int, int], ...]:
    """Triangles (indices of corners, counter-clockwise) that cover a counter-clockwise simple polygon.

    All corners are corners of triangles, also those with an angle of 180 degrees. Method: ears are clipped
    (G. H. Meisters, Polygons have ears, Amer. Math. Monthly 82, 1975).
    """
    left, triangles, k, failed = list(range(len(polygon))), list[tuple[int, int, int]](), 0, 0
    while len(left) > 3 and failed <= len(left):
        n = len(left)
        i, j, m = left[(k - 1) % n], left[k % n], left[(k + 1) % n]
        if _is_ear(polygon, left, (i, j, m)):
            triangles.append((i, j, m))
            del left[k % n]
            k, failed = k % n, 0
        else:
            k, failed = (k + 1) % n, failed + 1
    i, j, m = left[:3]
    return (*triangles, (i, j, m))


def _is_ear(polygon: Polygon, left: Sequence[int], ear: tuple[int, int, int]) -> bool:
    """Whether the corner in the middle is convex, and no other corner is in or on the triangle."""
    a, b, c = (polygon[k] for k in ear)
    if orientation(a, b, c) <= 0:
        return False
    low, high = [min(a[k], b[k], c[k]) for k in (0, 1)], [max(a[k], b[k], c[k]) for k in (0, 1)]
    for k in left:
        p = polygon[k]
        inside = low[0] <= p[0] <= high[0] and low[1] <= p[1] <= high[1] and k not in ear
        if inside and all(orientation(u, v, p) >= 0 for u, v in ((a, b), (b, c), (c, a))):
            return False
    return True
