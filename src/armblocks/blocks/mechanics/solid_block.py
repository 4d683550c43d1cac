"""The base class of solids: mass from density or given, inertia of the shape."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from armblocks.diagram import Block, FramePort, Parameter, Signals, parameter
from armblocks.multibody.gathering import gather_mechanisms
from armblocks.multibody.parts import REFERENCE, BodyPart
from armblocks.robot.shapes import Material, Shape
from armblocks.spatial import Vector3
from armblocks.spatial.inertia import RigidInertia
from armblocks.spatial.vectors import Symmetric

COLOURS = {
    "paint": Material.PAINT,
    "graphite": Material.JOINT,
    "steel": Material.FLANGE,
    "base": Material.BASE,
}


@dataclass(frozen=True, kw_only=True)
class SolidBlock(Block):
    """Base class of solids. Frame R has the axes of the shape.

    The origin of R is the centre of the shape, unless a subclass states another point.

    The mass is given, or the volume times the density. A subclass gives the volume, the moments of inertia
    for unit mass, and the shape for drawings; for a shape without symmetry also the centre of mass and the
    products of inertia.
    """

    virtual: ClassVar[bool] = True
    gathers: ClassVar[Callable[[Any], Any] | None] = gather_mechanisms
    card_size: ClassVar[tuple[float, float]] = (84.0, 50.0)

    mass_from: str = parameter(
        "density", choices=("density", "mass"), doc="whether density or mass determines the inertia"
    )
    density: float = parameter(1000.0, above=0.0, doc="density", unit="kg/m3")
    mass: float = parameter(1.0, above=0.0, doc="mass", unit="kg")
    appearance: str = parameter("paint", choices=tuple(COLOURS), doc="surface in drawings")

    def frame_ports(self) -> tuple[FramePort, ...]:
        return (FramePort(REFERENCE, "frame of the solid, at its centre"),)

    def inputs_of_the_run(self) -> tuple[Parameter, ...]:
        """Density or mass, whichever determines the inertia."""
        return tuple(rule for rule in super().inputs_of_the_run() if rule.name == self.mass_from)

    @property
    def material(self) -> Material:
        """The surface of the shape in drawings."""
        return COLOURS[self.appearance]

    @abstractmethod
    def volume(self) -> float:
        """The volume, m3."""

    @abstractmethod
    def unit_inertia(self) -> Vector3:
        """The moments of inertia xx, yy, zz about the centre of mass for a mass of 1 kg, m2."""

    def unit_products(self) -> Vector3:
        """The products of inertia yz, zx, xy about the centre of mass for a mass of 1 kg, m2."""
        return 0.0, 0.0, 0.0

    def centre(self) -> Vector3:
        """The centre of mass in frame R, m."""
        return 0.0, 0.0, 0.0

    @abstractmethod
    def shape(self) -> Shape:
        """The shape for drawings, in frame R."""

    def part(self) -> BodyPart:
        mass = self.density * self.volume() if self.mass_from == "density" else self.mass
        xx, yy, zz = (mass * moment for moment in self.unit_inertia())
        yz, zx, xy = (mass * product for product in self.unit_products())
        inertia = ((xx, xy, zx), (xy, yy, yz), (zx, yz, zz))
        return BodyPart(mass=mass, centre=self.centre(), inertia=inertia, shapes=(self.shape(),))

    def inertia(self, p: Signals) -> RigidInertia:
        """The inertia in frame R for the density or mass of the run."""
        part = self.part()
        mass = p["density"] * self.volume() if self.mass_from == "density" else p["mass"]
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = part.inertia
        second = Symmetric(*(mass * (entry / part.mass) for entry in (xx, yy, zz, xy, yz, xz)))
        return RigidInertia.at_centre(mass, second).shifted(part.centre)
