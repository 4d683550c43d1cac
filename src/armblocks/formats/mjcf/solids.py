"""Mass properties of solid shapes and of closed triangle meshes, for a density of 1 kg/m3.

Sources: the closed forms of solids; for meshes B. Mirtich, *Fast and accurate computation of polyhedral mass
properties*, Journal of Graphics Tools 1, 1996, in the form of signed tetrahedra.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_Array = NDArray[np.float64]


class Solid(NamedTuple):
    """``volume`` m3; ``centre`` m; ``inertia`` about the centre, (3, 3), m5."""

    volume: float
    centre: _Array
    inertia: _Array


def solid_of(kind: str, size: Sequence[float]) -> Solid:
    """The solid of a shape centred on the origin; ``size`` are the half lengths and radii of MJCF, m."""
    volume, moments = _MOMENTS[kind](*size)
    return Solid(volume, np.zeros(3), np.diag(moments) * volume)


def _sphere(r: float, *_: float) -> tuple[float, list[float]]:
    return 4.0 / 3.0 * math.pi * r**3, [0.4 * r * r] * 3


def _ellipsoid(a: float, b: float, c: float) -> tuple[float, list[float]]:
    a2, b2, c2 = a * a, b * b, c * c
    return 4.0 / 3.0 * math.pi * a * b * c, [(b2 + c2) / 5.0, (a2 + c2) / 5.0, (a2 + b2) / 5.0]


def _box(a: float, b: float, c: float) -> tuple[float, list[float]]:
    a2, b2, c2 = a * a, b * b, c * c
    return 8.0 * a * b * c, [(b2 + c2) / 3.0, (a2 + c2) / 3.0, (a2 + b2) / 3.0]


def _cylinder(r: float, half: float, *_: float) -> tuple[float, list[float]]:
    across = r * r / 4.0 + half * half / 3.0
    return 2.0 * math.pi * r * r * half, [across, across, r * r / 2.0]


def _capsule(r: float, half: float, *_: float) -> tuple[float, list[float]]:
    height = 2.0 * half
    volume = math.pi * r * r * (height + 4.0 / 3.0 * r)
    ball = 4.0 * r / (4.0 * r + 3.0 * height)  # fraction of the volume in the two half balls
    tube = 1.0 - ball
    across = tube * (3.0 * r * r + height * height) / 12.0
    across += ball * (0.4 * r * r + height * (3.0 * r + 2.0 * height) / 8.0)
    return volume, [across, across, tube * r * r / 2.0 + ball * 0.4 * r * r]


_MOMENTS = {
    "sphere": _sphere,
    "ellipsoid": _ellipsoid,
    "box": _box,
    "cylinder": _cylinder,
    "capsule": _capsule,
}
"""Volume, and principal moments about the centre per volume, by the type of the shape."""


def solid_of_mesh(corners: _Array, *, legacy: bool) -> Solid:
    """The solid inside a mesh, ``corners`` (F, 3, 3), m.

    ``legacy``: all tetrahedra between a centre and the triangles count as positive, the default of MuJoCo.
    This rule is exact for convex bodies, and accepts triangles of any orientation. At first the centre is the
    centroid of the surface, then the centre of mass.
    """
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1) / 2.0
    apex = np.average(corners.mean(axis=1), axis=0, weights=areas) if areas.sum() > 0 else np.zeros(3)
    volumes = _tetrahedra(corners - apex, legacy=legacy)
    volume = float(volumes.sum())
    if volume <= 0:
        return Solid(0.0, apex, np.zeros((3, 3)))
    centre = apex + 0.75 * (volumes @ (corners - apex).mean(axis=1)) / volume
    local = corners - centre
    volumes = _tetrahedra(local, legacy=legacy)
    # Integral of x x' over the tetrahedron with the corners 0, D, E, F: V (s s' + D D' + E E' + F F') / 20.
    total = local.sum(axis=1)
    products = np.einsum("f,fi,fj->ij", volumes, total, total)
    products += np.einsum("f,fki,fkj->ij", volumes, local, local)
    products /= 20.0
    return Solid(float(volumes.sum()), centre, np.trace(products) * np.eye(3) - products)


def _tetrahedra(corners: _Array, *, legacy: bool) -> _Array:
    """Volumes of the tetrahedra between the origin and the triangles, positive for outward normals."""
    volumes = np.einsum("fi,fi->f", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    return np.abs(volumes) if legacy else volumes
