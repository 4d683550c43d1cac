"""Mates of parts as equations of their relative motion, and the joint that these equations leave.

The relative velocity of two bodies is a twist ``(v, w)``: the velocity of the point of the second body at the
origin, and the angular velocity. Every mate gives rows ``a`` with ``a (v, w) = 0`` at the assembled position.
The twists that satisfy all rows of two bodies are the motions of the joint between them.

Source: Hunt, *Kinematic Geometry of Mechanisms*, 1978, sections 2 and 12 (screw systems).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armblocks.formats.simscape.assembly import Kind
from armblocks.spatial import Vector3

_Array = NDArray[np.float64]
_TOLERANCE = 1e-6


class Geometry(NamedTuple):
    """A point, line or plane: ``position`` on it, m, and unit ``axis`` along the line or normal to the plane.

    In world axes. The axis of a point is zero.
    """

    kind: str
    position: _Array
    axis: _Array


POINT, LINE, PLANE = "point", "line", "plane"
GEOMETRIES = {
    "point": POINT,
    "sphere": POINT,
    "line": LINE,
    "axis": LINE,
    "cylinder": LINE,
    "circle": LINE,
    "cone": LINE,
    "plane": PLANE,
}
"""The types of geometry in files."""

_TOUCHING = ("coincident", "align", "mate", "concentric", "insert")
_RIGID = ("fixed", "lock", "weld", "rigid")


def rows_of(kind: str, a: Geometry, b: Geometry) -> _Array | None:
    """The equations (n, 6) of a mate; ``None`` if it is not known."""
    word = kind.lower()
    if word in _RIGID:
        return np.eye(6)
    first, second = sorted((a, b), key=lambda geometry: (POINT, LINE, PLANE).index(geometry.kind))
    kinds = (first.kind, second.kind)
    if word in ("parallel", "perpendicular", "angle"):
        if POINT in kinds:
            return None
        # A line is parallel to a plane if it is perpendicular to its normal.
        crossed = kinds == (LINE, PLANE)
        aligned = (word == "parallel") != crossed if word != "angle" else False
        return _aligned(first, second) if aligned else _angle(first, second)
    if word == "distance" and kinds in ((POINT, POINT), (POINT, LINE), (LINE, LINE)):
        return None  # a sphere or a cylinder of positions
    if word != "distance" and word not in _TOUCHING:
        return None
    if kinds == (POINT, POINT):
        return _translations(first.position, np.eye(3))
    if kinds == (POINT, LINE):
        return _translations(first.position, _across(second.axis))
    if kinds == (LINE, LINE):
        return np.vstack((_aligned(first, second), _translations(first.position, _across(first.axis))))
    away = _translations(first.position, second.axis[None])
    if kinds == (POINT, PLANE):
        return away
    turns = _aligned(first, second) if kinds == (PLANE, PLANE) else _angle(first, second)
    return np.vstack((turns, away))


def _across(axis: _Array) -> _Array:
    """Two unit vectors (2, 3) perpendicular to an axis."""
    return np.linalg.svd(axis[None])[2][1:]


def _aligned(a: Geometry, b: Geometry) -> _Array:
    """The axes stay parallel: no rotation about directions perpendicular to them."""
    return np.hstack((np.zeros((2, 3)), _across(a.axis)))


def _angle(a: Geometry, b: Geometry) -> _Array:
    """The angle between two axes is constant: no rotation about their common normal."""
    normal = np.cross(a.axis, b.axis)
    if np.linalg.norm(normal) < _TOLERANCE:  # at the angle 0 both axes stay parallel
        return _aligned(a, b)
    return np.hstack((np.zeros(3), normal / np.linalg.norm(normal)))[None]


def _translations(point: _Array, directions: _Array) -> _Array:
    """No velocity of a point in these directions (n, 3): ``d (v + w x p) = 0``."""
    return np.hstack((directions, np.cross(point, directions)))


class Motion(NamedTuple):
    """The motion that remains under mates: the number ``freedoms`` of its degrees of freedom.

    ``kind``, a ``position`` on the axis, and ``axis`` describe a motion with one degree of freedom. ``kind``
    is ``None`` for a screw and for other degrees of freedom than 0 and 1.
    """

    freedoms: int
    kind: Kind | None = None
    position: Vector3 = (0.0, 0.0, 0.0)
    axis: Vector3 = (0.0, 0.0, 1.0)


def motion_of(rows: Sequence[_Array]) -> Motion:
    """The motion between two bodies that satisfies all equations."""
    all_rows = np.vstack(rows)
    # Six rows with the same solutions, if there are more.
    A: _Array = all_rows if len(all_rows) <= 6 else np.asarray(np.linalg.qr(all_rows, mode="r"))
    # Moments are divided by a length, so that all entries of the equations have about the same size.
    length = max(float(np.abs(A[:, 3:]).max()), 1e-3)
    scaled = A / np.array([1.0] * 3 + [length] * 3)
    _, values, vectors = np.linalg.svd(scaled)
    rank = int((values > _TOLERANCE * max(1.0, values[0])).sum())
    if rank != 5:
        return Motion(6 - rank, Kind.WELD if rank == 6 else None)
    twist = vectors[5] / np.array([1.0] * 3 + [length] * 3)
    v, w = twist[:3], twist[3:]
    if np.linalg.norm(w) * length < _TOLERANCE * np.linalg.norm(v):
        return Motion(1, Kind.PRISMATIC, (0.0, 0.0, 0.0), _direction(v))
    pitch = float(v @ w) / float(w @ w)
    if abs(pitch) > _TOLERANCE * length:
        return Motion(1)
    x, y, z = (np.cross(w, v) / float(w @ w)).tolist()
    return Motion(1, Kind.REVOLUTE, (x, y, z), _direction(w))


def _direction(vector: _Array) -> Vector3:
    """The unit vector whose largest component is positive; tiny components are zero."""
    unit = vector / np.linalg.norm(vector)
    unit = np.where(np.abs(unit) < 1e-12, 0.0, unit)
    sign = np.sign(unit[int(np.argmax(np.abs(unit)))])
    x, y, z = (sign * unit / np.linalg.norm(unit)).tolist()
    return x, y, z
