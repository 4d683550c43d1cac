"""Simple obstacles: boxes, spheres, cylinders, and half-spaces such as the floor."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import InputError
from armblocks.robot.fields import numbers, pose
from armblocks.spatial import Transform, Vector3, vector3

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Box(metaclass=ArgumentErrors):
    """A box with its centre at ``pose`` in the world; ``size``: full lengths along its x, y, z axes, m."""

    size: Vector3
    pose: Transform = field(default_factory=Transform)
    name: str = "box"

    def __post_init__(self) -> None:
        _set_pose(self, self.pose, self.name)
        object.__setattr__(self, "size", _lengths(self.name, "size", self.size))


@dataclass(frozen=True, kw_only=True)
class Sphere(metaclass=ArgumentErrors):
    """A sphere of this ``radius`` (m) about ``centre`` (3,), m in the world."""

    radius: float
    centre: Vector3 = (0.0, 0.0, 0.0)
    name: str = "sphere"

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", _lengths(self.name, "radius", (self.radius,))[0])
        object.__setattr__(self, "centre", _vector(self.name, "centre", self.centre))


@dataclass(frozen=True, kw_only=True)
class Cylinder(metaclass=ArgumentErrors):
    """A cylinder about the z axis of ``pose``, which is at its centre; ``radius`` and ``length``, m."""

    radius: float
    length: float
    pose: Transform = field(default_factory=Transform)
    name: str = "cylinder"

    def __post_init__(self) -> None:
        _set_pose(self, self.pose, self.name)
        for key in ("radius", "length"):
            object.__setattr__(self, key, _lengths(self.name, key, (getattr(self, key),))[0])


@dataclass(frozen=True, kw_only=True)
class Plane(metaclass=ArgumentErrors):
    """The half-space behind a plane through ``point`` (3,) m with the outward ``normal`` (3,), in the world.

    ``Plane()`` is the floor z = 0.
    """

    normal: Vector3 = (0.0, 0.0, 1.0)
    point: Vector3 = (0.0, 0.0, 0.0)
    name: str = "plane"

    def __post_init__(self) -> None:
        normal = _vector(self.name, "normal", self.normal)
        length = math.hypot(*normal)
        if not length:
            raise InputError(
                "the normal of the plane is zero",
                where=f"obstacle '{self.name}'",
                allowed="a vector that points away from the solid side",
                fix="give normal=(0, 0, 1) for a floor",
            )
        object.__setattr__(self, "normal", tuple(value / length for value in normal))
        object.__setattr__(self, "point", _vector(self.name, "point", self.point))


Obstacle: TypeAlias = Box | Sphere | Cylinder | Plane


def _set_pose(obstacle: Box | Cylinder, value: object, name: str) -> None:
    object.__setattr__(obstacle, "pose", pose(value, where=f"pose of obstacle '{name}'"))


def _vector(name: str, key: str, value: object) -> Vector3:
    return vector3(value, where=f"{key} of obstacle '{name}'")  # pyright: ignore[reportArgumentType]


def _lengths(name: str, key: str, value: tuple[float, ...]) -> tuple[float, ...]:
    lengths = np.atleast_1d(numbers(value, where=f"{key} of obstacle '{name}'"))
    expected = 3 if key == "size" else 1
    if lengths.shape != (expected,) or not np.isfinite(lengths).all() or not (lengths > 0.0).all():
        raise InputError(
            f"{key} is {value!r}",
            where=f"obstacle '{name}'",
            allowed="finite lengths above 0, in m",
            fix=f"give {key} in m",
        )
    return tuple(lengths.tolist())
