"""Shapes as triangles with normals, for renderers in Python and in the browser."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from armblocks.robot.shapes import Box, Cylinder, Housing, Material, Mesh, Shape, Sphere

SIDES = 28
"""Number of facets around a round body. With interpolated normals the outline looks round at usual sizes."""


@dataclass(frozen=True, eq=False, kw_only=True)
class TriangleMesh:
    """``corners`` and unit ``normals`` (F, 3 corners, 3 coordinates), counter-clockwise from outside; m.

    Corners are not shared: an edge is sharp where the normals of its two triangles differ.
    """

    corners: NDArray[np.float64]
    normals: NDArray[np.float64]
    material: Material

    def moved(self, pose: NDArray[np.float64]) -> TriangleMesh:
        """The same body with ``pose`` (4, 4) applied."""
        R, p = pose[:3, :3], pose[:3, 3]
        return TriangleMesh(
            corners=self.corners @ R.T + p, normals=self.normals @ R.T, material=self.material
        )


def triangles(shape: Shape) -> TriangleMesh:
    """The surface of a shape, in its link's frame."""
    match shape:
        case Cylinder():
            corners, normals = _lathe(_cylinder_profile(shape))
        case Housing():
            corners, normals = _housing(shape)
        case Box():
            corners, normals = _box(shape)
        case Sphere():
            corners, normals = _sphere(shape)
        case Mesh():
            corners, normals = _mesh(shape)
    mesh = TriangleMesh(corners=corners, normals=normals, material=shape.material)
    return mesh.moved(np.array(shape.pose))


_Surface = tuple[NDArray[np.float64], NDArray[np.float64]]


def _quads(
    a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64], d: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Two triangles (2 K, 3 corners, 3 coordinates) for each quadrilateral; a b c d: the corners (K, 3)."""
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def _ring_surface(
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    lower_normals: NDArray[np.float64],
    upper_normals: NDArray[np.float64],
) -> _Surface:
    """The strip between two closed rings (S, 3), both anticlockwise seen from the upper ring."""
    next_index = np.roll(np.arange(len(lower)), -1)
    corners = _quads(lower, lower[next_index], upper[next_index], upper)
    normals = _quads(lower_normals, lower_normals[next_index], upper_normals[next_index], upper_normals)
    (ax, ay, az), (bx, by, bz) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    area = np.sqrt((ay * bz - az * by) ** 2 + (az * bx - ax * bz) ** 2 + (ax * by - ay * bx) ** 2)
    solid = area > 1e-12 * max(float(np.abs(corners).max()), 1e-9) ** 2
    return corners[solid], normals[solid]


def _circle(radius: float, z: float) -> NDArray[np.float64]:
    angle = np.arange(SIDES) * (2 * math.pi / SIDES)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(SIDES, z)])


def _lathe(profile: list[tuple[float, float]]) -> _Surface:
    """The surface of revolution about z of a profile of points (radius, z).

    The points are in upward order on the outside. Every segment of the profile is one face.
    """
    parts: list[_Surface] = []
    for (r0, z0), (r1, z1) in pairwise(profile):
        length = math.hypot(r1 - r0, z1 - z0)
        if length == 0:
            continue
        outward, upward = (z1 - z0) / length, -(r1 - r0) / length
        normal = _circle(outward, upward)
        parts.append(_ring_surface(_circle(r0, z0), _circle(r1, z1), normal, normal))
    return _joined(parts)


def _joined(parts: list[_Surface]) -> _Surface:
    return np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])


def _cylinder_profile(shape: Cylinder) -> list[tuple[float, float]]:
    half, bevel = shape.length / 2, min(shape.bevel, shape.radius / 2, shape.length / 2)
    inner = shape.radius - bevel
    return [
        (0.0, -half),
        (inner, -half),
        (shape.radius, bevel - half),
        (shape.radius, half - bevel),
        (inner, half),
        (0.0, half),
    ]


def _housing(shape: Housing) -> _Surface:
    # The superellipse |x/a|^p + |y/b|^p = 1 has p = 2 / roundness. For a roundness near 0 all points would be
    # near the corners.
    power = max(shape.roundness, 0.08)
    angle = (np.arange(SIDES) + 0.5) * (2 * math.pi / SIDES)
    cosine, sine = np.cos(angle), np.sin(angle)
    unit = np.column_stack([np.sign(cosine) * np.abs(cosine) ** power, np.sign(sine) * np.abs(sine) ** power])
    lower = np.column_stack([unit * shape.start, np.zeros(SIDES)])
    upper = np.column_stack([unit * shape.end, np.full(SIDES, shape.length)])
    sides = _ring_surface(lower, upper, _ring_normals(lower, upper), _ring_normals(lower, upper))
    down = np.tile([0.0, 0.0, -1.0], (SIDES, 1))
    floor = _ring_surface(np.zeros((SIDES, 3)), lower, down, down)
    top = np.tile([0.0, 0.0, shape.length], (SIDES, 1))
    ceiling = _ring_surface(upper, top, -down, -down)
    return _joined([sides, floor, ceiling])


def _ring_normals(lower: NDArray[np.float64], upper: NDArray[np.float64]) -> NDArray[np.float64]:
    tangent = (np.roll(lower, -1, axis=0) - np.roll(lower, 1, axis=0)) + (
        np.roll(upper, -1, axis=0) - np.roll(upper, 1, axis=0)
    )
    normal = np.cross(tangent, upper - lower)
    return normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)


def _box(shape: Box) -> _Surface:
    half = np.array(shape.size) / 2
    parts: list[_Surface] = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (-1.0, 1.0):
            corner = np.zeros((4, 3))
            corner[:, axis] = side
            square = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
            corner[:, [u, v]] = square if side > 0 else square[::-1]
            normal = np.zeros((1, 3))
            normal[0, axis] = side
            a, b, c, d = (corner[k : k + 1] * half for k in range(4))
            parts.append((_quads(a, b, c, d), _quads(normal, normal, normal, normal)))
    return _joined(parts)


def _sphere(shape: Sphere) -> _Surface:
    latitude = np.linspace(-math.pi / 2, math.pi / 2, SIDES // 2 + 1)
    parts: list[_Surface] = []
    for low, high in pairwise(latitude):
        lower = _circle(math.cos(low), math.sin(low))
        upper = _circle(math.cos(high), math.sin(high))
        parts.append(_ring_surface(lower * shape.radius, upper * shape.radius, lower, upper))
    return _joined(parts)


def _mesh(shape: Mesh) -> _Surface:
    corners = np.array(shape.vertices, dtype=np.float64)[np.array(shape.faces, dtype=np.intp)]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    return corners, np.repeat(normal[:, None, :], 3, axis=1)
