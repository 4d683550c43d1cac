"""The surfaces of extruded and revolved solids and of ellipsoids, as triangles for drawings."""

from __future__ import annotations

import math
from functools import lru_cache

from armblocks.robot.shapes import Material, Mesh
from armblocks.rounded_functions import cos, sin
from armblocks.spatial import Vector3
from armblocks.spatial.polygons import Polygon, triangulation

SEGMENTS = 48
"""Facets of a full revolution."""


@lru_cache(maxsize=256)
def extruded_mesh(polygon: Polygon, length: float, material: Material) -> Mesh:
    """A counter-clockwise polygon in the xy plane, swept along z from ``-length / 2`` to ``length / 2``."""
    n, half = len(polygon), 0.5 * length
    faces: list[tuple[int, int, int]] = []
    for i, j, k in triangulation(polygon):
        faces += [(i + n, j + n, k + n), (k, j, i)]
    for k in range(n):
        after = (k + 1) % n
        faces += [(k, after, after + n), (k, after + n, k + n)]
    vertices = tuple((x, y, z) for z in (-half, half) for x, y in polygon)
    return Mesh(vertices=vertices, faces=tuple(faces), material=material)


@lru_cache(maxsize=256)
def revolved_mesh(polygon: Polygon, angle: float, material: Material) -> Mesh:
    """A counter-clockwise polygon of points (x, z) with x >= 0, revolved about z by ``angle``.

    The sweep is symmetric to the xz plane: from ``-angle / 2`` to ``angle / 2``. 2 pi is a full revolution.
    """
    n, full = len(polygon), angle == math.tau
    segments = SEGMENTS if full else max(2, math.ceil(SEGMENTS * angle / math.tau))
    vertices: list[Vector3] = []
    of_ring: list[list[int]] = []
    on_axis: dict[int, int] = {}
    for ring in range(segments if full else segments + 1):
        phi = angle * (ring / segments - 0.5)
        c, s = cos(phi), sin(phi)
        indices: list[int] = []
        for k, (x, z) in enumerate(polygon):
            index = on_axis.get(k, len(vertices))
            if index == len(vertices):
                vertices.append((x * c, x * s, z))
            if x == 0.0:
                on_axis[k] = index
            indices.append(index)
        of_ring.append(indices)
    faces: list[tuple[int, int, int]] = []
    for ring in range(segments):
        here, there = of_ring[ring], of_ring[(ring + 1) % len(of_ring)]
        for k in range(n):
            after = (k + 1) % n
            if there[after] != here[after]:
                faces.append((here[k], there[after], here[after]))
            if there[k] != here[k]:
                faces.append((here[k], there[k], there[after]))
    if not full:
        for i, j, k in triangulation(polygon):
            faces.append((of_ring[0][i], of_ring[0][j], of_ring[0][k]))
            faces.append((of_ring[-1][k], of_ring[-1][j], of_ring[-1][i]))
    return Mesh(vertices=tuple(vertices), faces=tuple(faces), material=material)


@lru_cache(maxsize=256)
def ellipsoid_mesh(radii: Vector3, material: Material) -> Mesh:
    """An ellipsoid with its centre at the origin and its principal axes along x, y and z."""
    half = SEGMENTS // 2
    angles = [math.pi * (k / half - 0.5) for k in range(1, half)]
    arc = ((0.0, -1.0), *((cos(angle), sin(angle)) for angle in angles), (0.0, 1.0))
    ball = revolved_mesh(arc, math.tau, material)
    a, b, c = radii
    vertices = tuple((a * x, b * y, c * z) for x, y, z in ball.vertices)
    return Mesh(vertices=vertices, faces=ball.faces, material=material)
