"""The ellipsoidal solid."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, cast

import numpy as np
from numpy.typing import ArrayLike

from armblocks.blocks.mechanics.examples import gravity_block, pendulum_example
from armblocks.blocks.mechanics.solid_block import SolidBlock
from armblocks.blocks.mechanics.swept_meshes import ellipsoid_mesh
from armblocks.diagram import WorkedExample, parameter, shape_of
from armblocks.diagram.signs import FaceSign, Words
from armblocks.errors import InputError
from armblocks.robot.shapes import Mesh
from armblocks.spatial import Vector3


@dataclass(frozen=True, kw_only=True)
class EllipsoidalSolid(SolidBlock):
    """A homogeneous ellipsoid with its centre at its frame R and its principal axes along x, y and z."""

    title: ClassVar[str] = "Ellipsoidal Solid"
    sign: ClassVar[FaceSign] = Words("Ellipsoid")
    example: ClassVar[WorkedExample] = pendulum_example(
        "An ellipsoid swings about a hinge.",
        (("gravity/C", "world/W"), ("R", "rod/F")),
        more=(gravity_block(),),
        body=False,
        radii=(0.1, 0.3, 0.2),
    )

    radii: ArrayLike = parameter(
        (1.0, 1.0, 1.0), dimensions=(1,), above=0.0, tunable=False, doc="radii along x, y, z", unit="m"
    )

    def check(self) -> None:
        if shape_of(self.radii) != (3,):
            raise InputError(
                f"the radii have shape {shape_of(self.radii)}",
                where="EllipsoidalSolid.radii",
                allowed="3 numbers",
                fix="give the radii along x, y and z",
            )

    def _radii(self) -> Vector3:
        return cast("Vector3", tuple(np.asarray(self.radii, dtype=float).tolist()))

    def volume(self) -> float:
        return 4.0 / 3.0 * math.pi * math.prod(self._radii())

    def unit_inertia(self) -> Vector3:
        x, y, z = self._radii()
        return (y * y + z * z) / 5.0, (x * x + z * z) / 5.0, (x * x + y * y) / 5.0

    def shape(self) -> Mesh:
        return ellipsoid_mesh(self._radii(), self.material)
