"""The extruded solid."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

from numpy.typing import ArrayLike

from armblocks.blocks.mechanics.cross_sections import SECTION_FRAME, check_cross_section, ordered_corners
from armblocks.blocks.mechanics.examples import gravity_block, pendulum_example
from armblocks.blocks.mechanics.solid_block import SolidBlock
from armblocks.blocks.mechanics.swept_meshes import extruded_mesh
from armblocks.diagram import FramePort, WorkedExample, parameter
from armblocks.diagram.signs import FaceSign, Words
from armblocks.robot.shapes import Mesh
from armblocks.spatial import Vector3
from armblocks.spatial.polygons import Integrals, Point, Polygon, centroid, integrals


@dataclass(frozen=True, kw_only=True)
class ExtrudedSolid(SolidBlock):
    """A homogeneous prism: a polygon of corners (x, y) is swept along z, and frame R is in the middle.

    The corners are in either order, and the last one may repeat the first one. The edges of the polygon must
    not intersect; holes are not possible. The centre of mass is the centroid of the polygon, which need not
    be the origin of frame R. Mass and inertia are exact.
    """

    title: ClassVar[str] = "Extruded Solid"
    sign: ClassVar[FaceSign] = Words("Extrude")
    example: ClassVar[WorkedExample] = pendulum_example(
        "A plate with an L-shaped cross-section swings about a hinge.",
        (("gravity/C", "world/W"), ("R", "rod/F")),
        more=(gravity_block(),),
        body=False,
        cross_section=((0.0, 0.0), (0.4, 0.0), (0.4, 0.1), (0.1, 0.1), (0.1, 0.3), (0.0, 0.3)),
        length=0.05,
    )

    cross_section: ArrayLike = parameter(
        ((1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)),
        dimensions=(2,),
        tunable=False,
        doc="corners (N, 2) of the cross-section in the xy plane, in order",
        unit="m",
    )
    length: float = parameter(1.0, above=0.0, tunable=False, doc="length along z", unit="m")

    def check(self) -> None:
        check_cross_section(self.cross_section, self.type_name())

    def frame_ports(self) -> tuple[FramePort, ...]:
        return (SECTION_FRAME,)

    def _polygon(self) -> Polygon:
        return ordered_corners(self.cross_section)

    def volume(self) -> float:
        return _centred(self._polygon())[1].area * self.length

    def centre(self) -> Vector3:
        x, y = _centred(self._polygon())[0]
        return x, y, 0.0

    def unit_inertia(self) -> Vector3:
        section = _centred(self._polygon())[1]
        xx, yy, zz = section.xx / section.area, section.yy / section.area, self.length**2 / 12.0
        return yy + zz, xx + zz, xx + yy

    def unit_products(self) -> Vector3:
        section = _centred(self._polygon())[1]
        return 0.0, 0.0, -section.xy / section.area

    def shape(self) -> Mesh:
        return extruded_mesh(self._polygon(), self.length, self.material)


@lru_cache(maxsize=256)
def _centred(polygon: Polygon) -> tuple[Point, Integrals]:
    """The centroid, and the integrals about it."""
    centre = centroid(polygon)
    return centre, integrals(polygon, centre)
