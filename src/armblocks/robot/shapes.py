"""Solid shapes of links for drawings: values only, no meshes (see :mod:`armblocks.robot.geometry`).

Every shape has a pose in its link's frame (p_link = pose p_shape). Lengths are in m.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

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


@dataclass(frozen=True, kw_only=True)
class Cylinder:
    """A cylinder about the shape's z axis, centred on the origin; ``bevel`` rounds both rims (m)."""

    radius: float
    length: float
    bevel: float = 0.0
    material: Material = Material.PAINT
    pose: Pose = IDENTITY


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


@dataclass(frozen=True, kw_only=True)
class Box:
    """A box centred on the origin; ``size`` holds its full lengths along x, y, z."""

    size: Vector3
    material: Material = Material.PAINT
    pose: Pose = IDENTITY


@dataclass(frozen=True, kw_only=True)
class Sphere:
    """A ball centred on the origin."""

    radius: float
    material: Material = Material.PAINT
    pose: Pose = IDENTITY


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """Triangles: ``faces`` name three ``vertices`` each, counter-clockwise seen from outside."""

    vertices: tuple[Vector3, ...]
    faces: tuple[tuple[int, int, int], ...]
    material: Material = Material.PAINT
    pose: Pose = IDENTITY


Shape: TypeAlias = Cylinder | Housing | Box | Sphere | Mesh
"""Any shape type."""
