"""Extruded, revolved and ellipsoidal solids: mass properties, surfaces, errors."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np
import pytest
from drawings import started
from numpy.typing import NDArray

from armblocks.blocks import (
    BrickSolid,
    CylindricalSolid,
    EllipsoidalSolid,
    ExtrudedSolid,
    MechanismConfiguration,
    RevoluteJoint,
    RevolvedSolid,
    WorldFrame,
)
from armblocks.blocks.mechanics.solid_block import SolidBlock
from armblocks.diagram import DiagramBuilder
from armblocks.errors import InputError
from armblocks.robot.shapes import Mesh

Array = NDArray[np.float64]
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)


def star(random: np.random.Generator, middle: Array, size: float) -> Array:
    """Corners (N, 2) of a polygon that is seen completely from its middle, counter-clockwise."""
    n = int(random.integers(3, 9))
    angle = 2 * math.pi * (np.arange(n) + random.uniform(0.1, 0.9, n)) / n
    radius = size * random.uniform(0.2, 1.0, n)
    return middle + np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def fan_cubature(corners: Array, middle: Array) -> tuple[Array, Array]:
    """Points (K, 2) and weights (K,) of Gauss cubatures of the triangles between the middle and each edge."""
    points, weights = list[Array](), list[float]()
    for a, b in zip(corners - middle, np.roll(corners, -1, axis=0) - middle):
        double_area = a[0] * b[1] - a[1] * b[0]
        for r, wr in zip((NODES + 1) / 2, WEIGHTS / 2):
            for s, ws in zip((NODES + 1) / 2, WEIGHTS / 2):
                points.append(middle + r * (a + s * (b - a)))
                weights.append(double_area * r * wr * ws)
    return np.array(points), np.array(weights)


def moments(points: Array, weights: Array) -> tuple[float, Array, Array]:
    """Volume, centre, and inertia about the centre for a density of 1, of weighted points (K, 3)."""
    volume = float(weights.sum())
    centre = weights @ points / volume
    d = points - centre
    second = np.einsum("k,ki,kj", weights, d, d)
    return volume, centre, np.trace(second) * np.eye(3) - second


def check(solid: SolidBlock, expected: tuple[float, Array, Array], tolerance: float = 1e-11) -> None:
    volume, centre, inertia = expected
    part, scale = solid.part(), solid.density
    size = float(np.sqrt(np.trace(inertia) / volume))
    assert part.mass == pytest.approx(scale * volume, rel=tolerance)
    np.testing.assert_allclose(part.centre, centre, rtol=0, atol=tolerance * (size + np.abs(centre).max()))
    found = np.array(part.inertia) / scale
    np.testing.assert_allclose(found, inertia, rtol=0, atol=tolerance * inertia.max())


@pytest.mark.parametrize("seed", range(4))
def test_extruded_solids_agree_with_numerical_integration(seed: int) -> None:
    random = np.random.default_rng(seed)
    middle, length = random.normal(size=2), random.uniform(0.1, 2.0)
    corners = star(random, middle, 0.7)
    flat, weights = fan_cubature(corners, middle)
    points = np.array([(*p, 0.5 * length * node) for p in flat for node in NODES])
    expected = moments(points, np.outer(weights, 0.5 * length * WEIGHTS).ravel())
    for order in (corners, corners[::-1], np.array([*corners, corners[0]])):
        check(ExtrudedSolid(cross_section=order, length=length, density=7.0), expected)


@pytest.mark.parametrize("angle", [2 * math.pi, 6.0, math.pi, 0.3, 1e-3])
def test_revolved_solids_agree_with_numerical_integration(angle: float) -> None:
    random = np.random.default_rng(int(1e4 * angle))
    middle = np.array([0.8, random.normal()])
    corners = star(random, middle, 0.7)
    flat, weights = fan_cubature(corners, middle)
    phi, share = list[float](), list[float]()
    for piece in range(4):
        phi += list(angle * ((piece + (NODES + 1) / 2) / 4 - 0.5))
        share += list(angle * WEIGHTS / 8)
    (x, z), (cos, sin) = flat.T, (np.cos(phi), np.sin(phi))
    points = np.stack([np.outer(x, cos), np.outer(x, sin), np.outer(z, np.ones(len(phi)))], axis=-1)
    expected = moments(points.reshape(-1, 3), np.outer(weights * x, share).ravel())
    extent: dict[str, Any] = {"extent_of_revolution": "custom", "revolution_angle": angle}
    if angle == 2 * math.pi:
        check(RevolvedSolid(cross_section=corners), expected)
    for order in (corners, corners[::-1]):
        check(RevolvedSolid(cross_section=order, **extent), expected)


def test_simple_solids_are_special_cases() -> None:
    pairs: tuple[tuple[SolidBlock, SolidBlock], ...] = (
        (
            ExtrudedSolid(cross_section=[(-1, -2), (1, -2), (1, 0), (1, 2), (-1, 2)], length=0.5),
            BrickSolid(dimensions=(2.0, 4.0, 0.5)),
        ),
        (
            RevolvedSolid(cross_section=[(0, -1), (0.5, -1), (0.5, 1), (0, 1), (0, 0.3)]),
            CylindricalSolid(radius=0.5, length=2.0),
        ),
    )
    for swept, simple in pairs:
        part = simple.part()
        check(swept, (part.mass / 1000.0, np.zeros(3), np.array(part.inertia) / 1000.0), 1e-14)
    ball = EllipsoidalSolid(radii=(0.3, 0.3, 0.3)).part()
    assert np.diag(ball.inertia) == pytest.approx(0.4 * ball.mass * 0.09)


@pytest.mark.parametrize(
    "solid",
    [
        ExtrudedSolid(cross_section=[(0, 0), (3, 0), (3, 1), (1, 1), (1, 2), (0, 2), (0, 1)]),
        RevolvedSolid(cross_section=[(1, 0), (2, 0), (2, 1), (1.5, 0.3), (1, 1)]),
        RevolvedSolid(cross_section=[(0, 0), (1, 0.5), (0, 1)]),
        RevolvedSolid(
            cross_section=[(0, 0), (1, 0.5), (1, 1), (0, 1)],
            extent_of_revolution="custom",
            revolution_angle=5.0,
        ),
        EllipsoidalSolid(radii=(1.0, 2.0, 3.0)),
    ],
)
def test_surfaces_are_closed_and_have_the_mass_properties_of_the_solid(solid: SolidBlock) -> None:
    (mesh,) = solid.part().shapes
    assert isinstance(mesh, Mesh)
    edges = Counter((face[k - 1], face[k]) for face in mesh.faces for k in range(3))
    assert set(edges.values()) == {1}
    assert all((b, a) in edges for a, b in edges)
    tetrahedra = np.array(mesh.vertices)[np.array(mesh.faces)]
    volumes = np.linalg.det(tetrahedra) / 6
    low, high = (5 - math.sqrt(5)) / 20, (5 + 3 * math.sqrt(5)) / 20  # degree 2, with the origin as corner
    cubature = low + (high - low) * np.eye(4, 3)
    points = np.einsum("pc,tcd->tpd", cubature, tetrahedra).reshape(-1, 3)
    tolerance = 1e-12 if isinstance(solid, ExtrudedSolid) else 0.02
    check(solid, moments(points, np.repeat(volumes / 4, 4)), tolerance)


def test_a_swept_solid_moves_about_the_origin_of_its_section() -> None:
    builder = DiagramBuilder("swing")
    world = builder.add("world", WorldFrame())
    builder.add("gravity", MechanismConfiguration(gravity=(0.0, -9.81, 0.0)), C=world)
    hinge = builder.add("hinge", RevoluteJoint(), B=world)
    plate = ExtrudedSolid(cross_section=[(0, 0), (3, 0), (0, 3)], length=0.1)
    builder.add("plate", plate, R=hinge["F"])
    _, rates = started(builder.build())
    # A right triangle with legs a: centroid a / 3; the moment about the right angle is m a2 / 3.
    assert rates["hinge/qd"] == pytest.approx([-9.81 * 1.0 / (9.0 / 3.0)])
    _, rates = started(builder.build(), {"plate.density": np.array(5.0)})
    assert rates["hinge/qd"] == pytest.approx([-9.81 / 3.0])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: ExtrudedSolid(cross_section=[[0, 0, 0], [1, 0, 0]]),
            r"cross-section has shape \(2, 3\)",
        ),
        (lambda: ExtrudedSolid(cross_section=[(0, 0), (1, 0), (0, 0)]), "has 2 different corners"),
        (
            lambda: ExtrudedSolid(cross_section=[(0, 0), (1, 1), (1, 0), (0, 1)]),
            r"the edges \(0.0, 0.0\) to \(1.0, 1.0\) and \(1.0, 0.0\) to \(0.0, 1.0\) meet",
        ),
        (
            lambda: ExtrudedSolid(cross_section=[(0, 0), (1, 1), (2, 2)]),
            "cross-section intersects itself",
        ),
        (
            lambda: RevolvedSolid(cross_section=[(2, 0), (-1e-9, 1), (0, 0)]),
            r"\(-1e-09, 1.0\) .* the z axis",
        ),
        (lambda: ExtrudedSolid(cross_section=[(0, 0), (1, 1), (0.5, 0.5000000001)]), "almost no area: 5e-11"),
        (lambda: ExtrudedSolid(cross_section=[(0, 0), (1e200, 0), (0, 1e200)]), "almost no area: inf"),
        (lambda: EllipsoidalSolid(radii=(1.0, 2.0)), r"the radii have shape \(2,\)"),
    ],
)
def test_errors_of_swept_solids(make: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        make()
