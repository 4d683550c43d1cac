"""The cylindrical solid."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from armblocks.blocks.mechanics.examples import gravity_block, pendulum_example
from armblocks.blocks.mechanics.solid_block import SolidBlock
from armblocks.diagram import WorkedExample, parameter
from armblocks.diagram.signs import FaceSign, Words
from armblocks.robot.shapes import Cylinder
from armblocks.spatial import Vector3


@dataclass(frozen=True, kw_only=True)
class CylindricalSolid(SolidBlock):
    """A homogeneous cylinder about the z axis of its frame R, which is at its centre."""

    title: ClassVar[str] = "Cylindrical Solid"
    sign: ClassVar[FaceSign] = Words("Cylinder")
    example: ClassVar[WorkedExample] = pendulum_example(
        "A cylinder swings about a hinge.",
        (("gravity/C", "world/W"), ("R", "rod/F")),
        more=(gravity_block(),),
        body=False,
        radius=0.1,
        length=0.2,
    )

    radius: float = parameter(1.0, above=0.0, tunable=False, doc="radius", unit="m")
    length: float = parameter(1.0, above=0.0, tunable=False, doc="length along z", unit="m")

    def volume(self) -> float:
        return math.pi * self.radius**2 * self.length

    def unit_inertia(self) -> Vector3:
        r, h = self.radius, self.length
        across = (3.0 * r * r + h * h) / 12.0
        return across, across, r * r / 2.0

    def shape(self) -> Cylinder:
        return Cylinder(radius=self.radius, length=self.length, material=self.material)
