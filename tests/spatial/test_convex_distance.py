"""Distances of convex hulls, compared with closed forms and with Coal."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from armblocks.spatial import q2r
from armblocks.spatial.convex_distance import hull_distances

CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))


def random_rotation(random: np.random.Generator) -> np.ndarray:
    q = random.normal(size=4)
    return q2r(q / np.linalg.norm(q))


def test_points_segments_and_boxes_have_the_distances_of_closed_forms() -> None:
    point, far = np.zeros((1, 1, 3)), np.array([[[0.0, 3.0, 4.0]]])
    assert hull_distances(point, far)[0] == pytest.approx([5.0])
    first = np.array([[[-1.0, 0, 0], [1.0, 0, 0]]])  # crossing segments at the distance 2
    second = np.array([[[0, -1.0, 2.0], [0, 1.0, 2.0]]])
    distance, p, s = hull_distances(first, second)
    assert distance == pytest.approx([2.0]) and p[0] == pytest.approx([0, 0, 0])
    assert s[0] == pytest.approx([0, 0, 2])
    box = CORNERS[None]
    for shift, expected in (
        ((3, 0, 0), 1.0),
        ((3, 3, 0), np.sqrt(2)),
        ((3, 3, 3), np.sqrt(3)),
        ((1.5, 0, 0), 0),
    ):
        assert hull_distances(box, box + np.array(shift, float))[0] == pytest.approx([expected], abs=1e-9)
    assert hull_distances(box, box)[0] == pytest.approx([0.0])
    repeated = np.repeat(point, 5, axis=1)
    assert hull_distances(repeated, box + np.array([0, 0, 4.0]))[0] == pytest.approx([3.0])


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e4])
def test_the_nearest_points_separate_the_hulls(scale: float) -> None:
    random = np.random.default_rng(1)
    first = scale * random.normal(size=(400, 12, 3))
    second = scale * (random.normal(size=(400, 7, 3)) + random.normal(size=(400, 1, 3)) * 4)
    distance, p, s = hull_distances(first, second)
    apart = distance > 0
    assert 0.3 < apart.mean() < 1.0
    np.testing.assert_allclose(np.linalg.norm(p - s, axis=1)[apart], distance[apart], rtol=1e-12)
    # Certificate: both hulls are on their sides of the planes through the nearest points.
    normal = (s - p) / np.where(apart, distance, 1.0)[:, None]
    gap = np.einsum("nki,ni->nk", second, normal).min(axis=1) - np.einsum("nki,ni->nk", first, normal).max(
        axis=1
    )
    np.testing.assert_allclose(gap[apart], distance[apart], rtol=1e-8, atol=1e-9 * scale)


def test_boxes_have_the_distances_of_coal() -> None:
    coal = pytest.importorskip("coal")
    random = np.random.default_rng(5)
    pairs = []
    for _ in range(200):
        half, turn = random.uniform(0.1, 1, (2, 3)), [random_rotation(random) for _ in range(2)]
        place = random.uniform(-2, 2, (2, 3))
        hulls = [CORNERS * h @ R.T + p for h, R, p in zip(half, turn, place)]
        shapes = [coal.Box(*(2 * h)) for h in half]
        poses = [coal.Transform3s(R, p) for R, p in zip(turn, place)]
        request, result = coal.DistanceRequest(), coal.DistanceResult()
        found = coal.distance(shapes[0], poses[0], shapes[1], poses[1], request, result)
        pairs.append((*hulls, max(found, 0.0)))
    first, second, expected = (np.array(part) for part in zip(*pairs))
    np.testing.assert_allclose(hull_distances(first, second)[0], expected, atol=1e-5)
