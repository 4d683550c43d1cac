"""Solid shapes of links for drawings: values only, no meshes (see :mod:`armblocks.robot.geometry`).

Every shape has a pose in its link's frame (p_link = pose p_shape), which may be given as a Transform or a
(4, 4) matrix. Lengths are in m. Shapes are hashable: lists are stored as tuples.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import Enum
from typing import TypeAlias, cast

import numpy as np

from armblocks.robot.fields import pose as checked_pose

Row: TypeAlias = tuple[float, float, float, float]
Pose: TypeAlias = tuple[Row, Row, Row, Row]
"""A homogeneous 4x4 transform, row by row."""

Vector3: TypeAlias = tuple[float, float, float]

IDENTITY: Pose = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))


class Material(Enum):
    """The appearance of a body's surface."""

    PAINT = "paint"
    """Painted casting, in the colour of the arm."""
    JOINT = "joint"
    """Graphite: motor drums, gear covers, rails."""
    FLANGE = "flange"
    """Bare machined steel: flanges, shafts, bolts."""
    BASE = "base"
    """Pedestal and base plate."""


def _store_tuples(shape: Shape) -> None:
    """Store the pose and all lists of a new shape as tuples, so that robots are hashable."""
    where = f"pose of a {type(shape).__name__}"
    if not _is_rows(shape.pose):
        a, b, c, d = (tuple(row) for row in checked_pose(shape.pose, where=where).matrix.tolist())
        object.__setattr__(shape, "pose", (a, b, c, d))
    for field in fields(shape):
        value = cast("object", getattr(shape, field.name))
        if _has_lists(value):
            object.__setattr__(shape, field.name, _tuples(value))


def _has_lists(value: object) -> bool:
    if isinstance(value, tuple):
        return any(isinstance(entry, list | np.ndarray) for entry in cast("tuple[object, ...]", value))
    return isinstance(value, list | np.ndarray)


def _is_rows(value: object) -> bool:
    return isinstance(value, tuple) and all(
        isinstance(row, tuple) for row in cast("tuple[object, ...]", value)
    )


def _tuples(value: object) -> object:
    """The value with tuples instead of lists and arrays, at all depths."""
    if isinstance(value, np.ndarray):
        value = cast("list[object]", value.tolist())
    if isinstance(value, list | tuple):
        return tuple(_tuples(entry) for entry in cast("list[object]", value))
    return value


@dataclass(frozen=True, kw_only=True)
class Cylinder:
    """A cylinder about the shape's z axis, centred on the origin; ``bevel`` rounds both rims (m)."""

    radius: float
    length: float
    bevel: float = 0.0
    material: Material = Material.PAINT
    pose: Pose = IDENTITY

    def __post_init__(self) -> None:
        _store_tuples(self)


@dataclass(frozen=True, kw_only=True)
class Housing:
    """A tapered casting along z, from ``z = 0`` to ``z = length``.

    ``start`` and ``end`` are the half widths (x, y) of its two faces. ``roundness`` 1 gives elliptic sections
    (a cone, if the half widths are equal), 0 gives rectangles, and values between 0 and 1 give superellipses.
    """

    start: tuple[float, float]
    end: tuple[float, float]
    length: float
    roundness: float = 0.5
    material: Material = Material.PAINT
    pose: Pose = IDENTITY

    def __post_init__(self) -> None:
        _store_tuples(self)


@dataclass(frozen=True, kw_only=True)
class Box:
    """A box centred on the origin; ``size`` holds its full lengths along x, y, z."""

    size: Vector3
    material: Material = Material.PAINT
    pose: Pose = IDENTITY

    def __post_init__(self) -> None:
        _store_tuples(self)


@dataclass(frozen=True, kw_only=True)
class Sphere:
    """A ball centred on the origin."""

    radius: float
    material: Material = Material.PAINT
    pose: Pose = IDENTITY

    def __post_init__(self) -> None:
        _store_tuples(self)


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """Triangles. Each row of ``faces`` has the indices of three ``vertices``, in counter-clockwise order seen
    from outside."""

    vertices: tuple[Vector3, ...]
    faces: tuple[tuple[int, int, int], ...]
    material: Material = Material.PAINT
    pose: Pose = IDENTITY

    def __post_init__(self) -> None:
        _store_tuples(self)


Shape: TypeAlias = Cylinder | Housing | Box | Sphere | Mesh
"""Any shape type."""
