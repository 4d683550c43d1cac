"""Inertias about another origin: the parallel-axis theorem, checked on clouds of points."""

import numpy as np
from numpy.testing import assert_allclose

from armblocks.spatial.inertia import RigidInertia
from robots_for_tests import random_transform


def cloud_inertia(points: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, first and second moment of unit masses, computed from their definitions."""
    second = sum((p @ p) * np.eye(3) - np.outer(p, p) for p in points)
    return float(len(points)), points.sum(axis=0), second


def assert_is(inertia: RigidInertia, points: np.ndarray) -> None:
    mass, first, second = cloud_inertia(points)
    S = inertia.second
    assert_allclose(inertia.mass, mass)
    assert_allclose(inertia.first, first, atol=1e-14)
    matrix = [[S.xx, S.xy, S.xz], [S.xy, S.yy, S.yz], [S.xz, S.yz, S.zz]]
    assert_allclose(matrix, second, atol=1e-13)


def test_transformed_inertia_equals_that_of_the_transformed_points():
    random = np.random.default_rng(1)
    points = random.normal(size=(5, 3))
    centre = points.mean(axis=0)
    _, _, about_centre = cloud_inertia(points - centre)
    body = RigidInertia.about_centre(5.0, tuple(centre), tuple(map(tuple, about_centre)))
    assert_is(body, points)
    T = random_transform(random)
    assert_is(body.moved(T), points @ T.R.T + T.p)
    shift = np.array((0.1, -0.2, 0.3))
    assert_is(body.shifted(tuple(shift)), points + shift)
    assert_is(body.plus(body.moved(T)), np.vstack((points, points @ T.R.T + T.p)))
