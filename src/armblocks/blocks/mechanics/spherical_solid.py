"""The spherical solid."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from armblocks.blocks.mechanics.examples import gravity_block, pendulum_example
from armblocks.blocks.mechanics.solid_block import SolidBlock
from armblocks.diagram import WorkedExample, parameter
from armblocks.diagram.signs import FaceSign, Words
from armblocks.robot.shapes import Sphere
from armblocks.spatial import Vector3


@dataclass(frozen=True, kw_only=True)
class SphericalSolid(SolidBlock):
    """A homogeneous ball with its centre at its frame R."""

    title: ClassVar[str] = "Spherical Solid"
    sign: ClassVar[FaceSign] = Words("Sphere")
    example: ClassVar[WorkedExample] = pendulum_example(
        "A ball swings about a hinge.",
        (("gravity/C", "world/W"), ("R", "rod/F")),
        more=(gravity_block(),),
        body=False,
        radius=0.1,
    )

    radius: float = parameter(1.0, above=0.0, tunable=False, doc="radius", unit="m")

    def volume(self) -> float:
        return 4.0 / 3.0 * math.pi * self.radius**3

    def unit_inertia(self) -> Vector3:
        moment = 0.4 * self.radius**2
        return moment, moment, moment

    def shape(self) -> Sphere:
        return Sphere(radius=self.radius, material=self.material)
