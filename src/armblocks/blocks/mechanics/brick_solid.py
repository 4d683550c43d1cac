"""The brick."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, cast

import numpy as np
from numpy.typing import ArrayLike

from armblocks.blocks.mechanics.examples import gravity_block, pendulum_example
from armblocks.blocks.mechanics.solid_block import SolidBlock
from armblocks.diagram import WorkedExample, parameter, shape_of
from armblocks.diagram.signs import FaceSign, Words
from armblocks.errors import InputError
from armblocks.robot.shapes import Box
from armblocks.spatial import Vector3


@dataclass(frozen=True, kw_only=True)
class BrickSolid(SolidBlock):
    """A homogeneous brick with full lengths along x, y and z of its frame R."""

    title: ClassVar[str] = "Brick Solid"
    sign: ClassVar[FaceSign] = Words("Brick")
    example: ClassVar[WorkedExample] = pendulum_example(
        "A brick swings about a hinge.",
        (("gravity/C", "world/W"), ("R", "rod/F")),
        more=(gravity_block(),),
        body=False,
        dimensions=(0.1, 1.0, 0.1),
    )

    dimensions: ArrayLike = parameter(
        (1.0, 1.0, 1.0), dimensions=(1,), above=0.0, tunable=False, doc="lengths along x, y, z", unit="m"
    )

    def check(self) -> None:
        if shape_of(self.dimensions) != (3,):
            raise InputError(
                f"the dimensions have shape {shape_of(self.dimensions)}",
                where="BrickSolid.dimensions",
                allowed="3 numbers",
                fix="give the lengths along x, y and z",
            )

    def _lengths(self) -> Vector3:
        return cast("Vector3", tuple(np.asarray(self.dimensions, dtype=float).tolist()))

    def volume(self) -> float:
        return math.prod(self._lengths())

    def unit_inertia(self) -> Vector3:
        x, y, z = self._lengths()
        return (y * y + z * z) / 12.0, (x * x + z * z) / 12.0, (x * x + y * y) / 12.0

    def shape(self) -> Box:
        return Box(size=self._lengths(), material=self.material)
