"""Simple polygons: intersections and orientation in exact arithmetic, integrals, triangulations."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from armblocks.spatial.polygons import (
    Point,
    Polygon,
    counter_clockwise,
    distinct_corners,
    first_intersection,
    integrals,
    orientation,
    triangulation,
)

SPIRAL: Polygon = (
    *((r * math.cos(a), r * math.sin(a)) for a, r in zip(np.linspace(0, 12, 60), np.linspace(1, 3, 60))),
    *(
        ((r - 0.2) * math.cos(a), (r - 0.2) * math.sin(a))
        for a, r in zip(np.linspace(12, 0, 60), np.linspace(3, 1, 60))
    ),
)
COMB: Polygon = (
    *((0.5 * k, 3.0 if k % 4 in (1, 2) else 1.0) for k in range(20, -1, -1)),
    (0.0, 0.0),
    (10.0, 0.0),
)
SHAPES = (SPIRAL, COMB, ((0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1)))


def common_point(a: Point, b: Point, c: Point, d: Point) -> list[tuple[Fraction, ...]]:
    """Points that two closed segments have in common, by Cramer's rule and by projection on a common line."""
    p, q, r, s = ([Fraction(x) for x in point] for point in (a, b, c, d))
    u, v, w = ([e - f for e, f in zip(*pair)] for pair in ((q, p), (s, r), (r, p)))
    det = u[0] * v[1] - u[1] * v[0]
    if det:
        t, o = ((w[0] * e[1] - w[1] * e[0]) / det for e in (v, u))
        return [(p[0] + t * u[0], p[1] + t * u[1])] if 0 <= t <= 1 and 0 <= o <= 1 else []
    if u[0] * w[1] - u[1] * w[0]:
        return []
    ends = sorted([sorted([tuple(p), tuple(q)]), sorted([tuple(r), tuple(s)])])
    low, high = ends[1][0], min(ends[0][1], ends[1][1])
    return [low, high] if low <= high else []


def is_simple(polygon: Polygon) -> bool:
    """Whether two edges have at most the corner between them in common."""
    edges = list(pairwise([*polygon, polygon[0]]))
    for i, first in enumerate(edges):
        for j in range(i):
            allowed = {first[0]} if j == i - 1 else set[Point]()
            allowed |= {first[1]} if (i + 1) % len(edges) == j else set()
            if not set(common_point(*first, *edges[j])) <= allowed:
                return False
    return True


def test_intersections_on_a_grid_agree_with_rational_arithmetic() -> None:
    random, simple = np.random.default_rng(3), 0
    for _ in range(800):
        grid = random.integers(0, 4, size=(random.integers(3, 8), 2))
        polygon = distinct_corners(grid.tolist())
        if len(polygon) < 3:
            continue
        assert (first_intersection(polygon) is None) == is_simple(polygon), polygon
        if is_simple(polygon):
            simple += 1
            _check_triangulation(counter_clockwise(polygon))
    assert simple > 50


@pytest.mark.parametrize("polygon", SHAPES)
def test_long_and_hollow_polygons(polygon: Polygon) -> None:
    assert first_intersection(polygon) is None
    assert counter_clockwise(polygon) == polygon
    assert counter_clockwise(polygon[::-1]) == polygon
    _check_triangulation(polygon)


def _check_triangulation(polygon: Polygon) -> None:
    """The triangles are not degenerate, and their integrals are those of the polygon."""
    triangles = triangulation(polygon)
    assert len(triangles) == len(polygon) - 2
    sums = np.zeros(9)
    for triangle in triangles:
        a, b, c = (polygon[k] for k in triangle)
        assert orientation(a, b, c) == 1
        corners = np.array([a, b, c], dtype=float)
        area = np.linalg.det(np.column_stack([corners, np.ones(3)])) / 2
        for weight, shares in DUNAVANT:
            x, y = shares @ corners
            sums += weight * area * np.array([1, x, y, x * x, x * y, y * y, x**3, x * x * y, x * y * y])
    np.testing.assert_allclose(integrals(polygon), sums, rtol=1e-12, atol=1e-12 * np.abs(sums).max())


DUNAVANT = [
    (-27 / 48, np.full(3, 1 / 3)),
    *((25 / 48, np.roll([0.6, 0.2, 0.2], k)) for k in range(3)),
]
"""A cubature of degree 3 of a triangle: D. A. Dunavant, Int. J. Numer. Methods Eng. 21, 1985."""


def test_orientation_is_exact_where_differences_round() -> None:
    a, b = (0.5, 0.5), (12.0, 12.0)
    for k in range(-3, 4):
        c = (24.0 + k * 2.0**-48, 24.0)
        assert orientation(a, b, c) == -np.sign(k)
    assert orientation((0.0, 0.0), (1e-200, 0.0), (0.0, 1e-200)) == 1
    assert orientation((0.0, 0.0), (1e200, 0.0), (1e200, 1e200)) == 1
