"""The inertia of a body without a shape."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from armblocks.blocks.mechanics.examples import gravity_block, pendulum_example
from armblocks.blocks.mechanics.mechanics_block import MechanicsBlock
from armblocks.diagram import FramePort, Signals, WorkedExample, parameter, shape_of
from armblocks.diagram.signs import FaceSign, Words
from armblocks.errors import InputError
from armblocks.multibody.parts import REFERENCE, BodyPart
from armblocks.spatial.inertia import RigidInertia
from armblocks.spatial.vectors import Symmetric


@dataclass(frozen=True, kw_only=True)
class BodyInertia(MechanicsBlock):
    """A rigid body without a shape: mass, centre of mass, and inertia about it, in the axes of frame R.

    ``products`` are the entries yz, zx, xy of the inertia matrix: yz is minus the integral of y z dm.
    """

    title: ClassVar[str] = "Inertia"
    sign: ClassVar[FaceSign] = Words("m, I")
    example: ClassVar[WorkedExample] = pendulum_example(
        "A pendulum with a given mass and inertia.",
        (("gravity/C", "world/W"), ("R", "rod/F")),
        more=(gravity_block(),),
        body=False,
        mass=2.0,
        moments=(0.1, 0.02, 0.1),
    )

    mass: float = parameter(1.0, above=0.0, doc="mass", unit="kg")
    centre_of_mass: ArrayLike = parameter(
        (0.0, 0.0, 0.0), dimensions=(1,), tunable=False, doc="centre of mass in R, x y z", unit="m"
    )
    moments: ArrayLike = parameter(
        (0.0, 0.0, 0.0),
        dimensions=(1,),
        minimum=0.0,
        doc="moments of inertia xx yy zz about the centre of mass; 0 0 0 is a point mass",
        unit="kg m2",
    )
    products: ArrayLike = parameter(
        (0.0, 0.0, 0.0), dimensions=(1,), tunable=False, doc="products of inertia yz zx xy", unit="kg m2"
    )

    def check(self) -> None:
        for name in ("centre_of_mass", "moments", "products"):
            shape = shape_of(self.parameter_value(name))
            if shape != (3,):
                raise InputError(
                    f"{name} has shape {shape}",
                    where=f"BodyInertia.{name}",
                    allowed="3 numbers",
                    fix="give one number for each axis",
                )
        low, middle, high = np.linalg.eigvalsh(np.array(self.part().inertia)).tolist()
        tolerance = 1e-9 * max(abs(low), abs(high))
        if low < -tolerance or high > low + middle + tolerance:
            raise InputError(
                f"the principal moments of inertia are {low:.4g}, {middle:.4g}, {high:.4g} kg m2",
                where="BodyInertia.moments",
                allowed="moments of zero or more, none of which exceeds the sum of the other two",
                fix="correct the moments and products; they are about the centre of mass",
            )

    def frame_ports(self) -> tuple[FramePort, ...]:
        return (FramePort(REFERENCE, "frame of the body"),)

    def part(self) -> BodyPart:
        xx, yy, zz = np.asarray(self.moments, dtype=float).tolist()
        yz, zx, xy = np.asarray(self.products, dtype=float).tolist()
        x, y, z = np.asarray(self.centre_of_mass, dtype=float).tolist()
        inertia = ((xx, xy, zx), (xy, yy, yz), (zx, yz, zz))
        return BodyPart(mass=self.mass, centre=(x, y, z), inertia=inertia)

    def inertia(self, p: Signals) -> RigidInertia:
        """The inertia in frame R for the mass and the moments of the run."""
        part, moments = self.part(), p["moments"]
        yz, zx, xy = np.asarray(self.products, dtype=float).tolist()
        second = Symmetric(moments[0], moments[1], moments[2], xy, yz, zx)
        return RigidInertia.at_centre(p["mass"], second).shifted(part.centre)
