"""The revolved solid."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, NamedTuple

from numpy.typing import ArrayLike

from armblocks.blocks.mechanics.cross_sections import SECTION_FRAME, check_cross_section, ordered_corners
from armblocks.blocks.mechanics.examples import gravity_block, pendulum_example
from armblocks.blocks.mechanics.solid_block import SolidBlock
from armblocks.blocks.mechanics.swept_meshes import revolved_mesh
from armblocks.diagram import FramePort, WorkedExample, parameter
from armblocks.diagram.signs import FaceSign, Words
from armblocks.errors import InputError
from armblocks.robot.shapes import Mesh
from armblocks.spatial import Vector3
from armblocks.spatial.polygons import Polygon, centroid, integrals


@dataclass(frozen=True, kw_only=True)
class RevolvedSolid(SolidBlock):
    """A homogeneous solid of revolution: a polygon of corners (x, z) with x >= 0, revolved about the z axis.

    With ``extent_of_revolution="custom"`` the polygon sweeps the ``revolution_angle``, half of it to each
    side of the xz plane of frame R. The corners are in either order, and the last one may repeat the first
    one. The polygon may touch the z axis, but its edges must not intersect. Mass and inertia are exact.
    """

    title: ClassVar[str] = "Revolved Solid"
    sign: ClassVar[FaceSign] = Words("Revolve")
    example: ClassVar[WorkedExample] = pendulum_example(
        "A quarter of a ring swings about a hinge.",
        (("gravity/C", "world/W"), ("R", "rod/F")),
        more=(gravity_block(),),
        body=False,
        cross_section=((0.2, -0.05), (0.3, -0.05), (0.3, 0.05), (0.2, 0.05)),
        extent_of_revolution="custom",
        revolution_angle=math.pi / 2,
    )

    cross_section: ArrayLike = parameter(
        ((1.0, 1.0), (1.0, -1.0), (2.0, -1.0), (2.0, 1.0)),
        dimensions=(2,),
        tunable=False,
        doc="corners (N, 2) of the cross-section in the xz plane, in order",
        unit="m",
    )
    extent_of_revolution: str = parameter(
        "full", choices=("full", "custom"), doc="full: 360 degrees; custom: by the revolution angle"
    )
    revolution_angle: float = parameter(
        math.pi, above=0.0, maximum=math.tau, tunable=False, doc="angle of a custom revolution", unit="rad"
    )

    def check(self) -> None:
        check_cross_section(self.cross_section, self.type_name())
        corner = min(self._polygon())
        if corner[0] < 0.0:
            raise InputError(
                f"the corner {corner} of the cross-section is beyond the z axis, about which it revolves",
                where="RevolvedSolid.cross_section",
                allowed="corners (x, z) with x of 0 or more",
                fix="move the cross-section to the side of positive x",
            )

    def frame_ports(self) -> tuple[FramePort, ...]:
        return (SECTION_FRAME,)

    def _polygon(self) -> Polygon:
        return ordered_corners(self.cross_section)

    @property
    def angle(self) -> float:
        """The angle of the revolution, rad."""
        return math.tau if self.extent_of_revolution == "full" else self.revolution_angle

    def volume(self) -> float:
        return _weighted(self._polygon()).weight * self.angle

    def centre(self) -> Vector3:
        section = _weighted(self._polygon())
        return section.x * _sector(self.angle).cosine, 0.0, section.z

    def unit_inertia(self) -> Vector3:
        section, sector = _weighted(self._polygon()), _sector(self.angle)
        x = section.xx * (1.0 - sector.sine_squared) + section.x**2 * sector.cosine_variance
        y = (section.xx + section.x**2) * sector.sine_squared
        return y + section.zz, x + section.zz, x + y

    def unit_products(self) -> Vector3:
        return 0.0, -_weighted(self._polygon()).xz * _sector(self.angle).cosine, 0.0

    def shape(self) -> Mesh:
        return revolved_mesh(self._polygon(), self.angle, self.material)


class _Weighted(NamedTuple):
    """A cross-section with the weight x: integral of x, weighted means of x and z, covariances about them."""

    weight: float
    x: float
    z: float
    xx: float
    xz: float
    zz: float


@lru_cache(maxsize=256)
def _weighted(polygon: Polygon) -> _Weighted:
    radius, height = centroid(polygon)
    about = integrals(polygon, (radius, height))
    weight = radius * about.area
    x, z = radius + about.xx / weight, height + about.xy / weight
    about = integrals(polygon, (x, z))
    return _Weighted(
        weight=weight,
        x=x,
        z=z,
        xx=(x * about.xx + about.xxx) / weight,
        xz=(x * about.xy + about.xxy) / weight,
        zz=(x * about.yy + about.xyy) / weight,
    )


class _Sector(NamedTuple):
    """Means over the angles of a sector: of the cosine, of the squared sine, the variance of the cosine."""

    cosine: float
    sine_squared: float
    cosine_variance: float


@lru_cache(maxsize=256)
def _sector(angle: float) -> _Sector:
    """The means over the angles from ``-angle / 2`` to ``angle / 2``.

    They are ``sin(h) / h`` with ``h = angle / 2``, ``(1 - sin(angle) / angle) / 2``, and the mean of the
    squared cosine minus the square of the mean. Their power series do not cancel for small angles.
    """
    if angle == math.tau:
        return _Sector(0.0, 0.5, 0.5)
    square = angle * angle
    cosine, sine_squared, variance = [1.0], list[float](), list[float]()
    for k in range(1, 31):
        power = (-1.0) ** k * square**k
        cosine.append(power / 4.0**k / math.factorial(2 * k + 1))
        sine_squared.append(-0.5 * power / math.factorial(2 * k + 1))
        variance.append((k - 1) * power / math.factorial(2 * k + 2))
    return _Sector(math.fsum(cosine), math.fsum(sine_squared), math.fsum(variance))
