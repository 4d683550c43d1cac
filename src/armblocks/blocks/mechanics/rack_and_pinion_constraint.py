"""A gear that rolls along a rack."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from armblocks.blocks.mechanics.examples import ALONG_Y
from armblocks.blocks.mechanics.mechanics_block import MechanicsBlock
from armblocks.diagram import FramePort, WorkedExample, driver, parameter
from armblocks.diagram.signs import FaceSign, Words
from armblocks.errors import InputError
from armblocks.multibody.parts import BASE, FOLLOWER, AxisOfCoupling, CouplingPart

PERPENDICULAR_TOLERANCE = 1e-9
"""Largest cosine of the angle between two perpendicular axes."""
DISTANCE_TOLERANCE = 1e-6
"""Largest difference of the distance of the rack from the radius, relative to the radius."""


@dataclass(frozen=True, kw_only=True)
class RackAndPinionConstraint(MechanicsBlock):
    """A pinion B and a rack F that mesh without backlash: the rack moves by the radius times the angle.

    A revolute joint connects the pinion with a body, such as a housing or the world. A prismatic joint
    connects the rack with the same body.

    - B: the pinion turns about the z axis of this frame.
    - F: the rack moves along the z axis of this frame. The origin of F is on the pitch line of the rack: the
      line through it along z has the distance ``radius`` from the axis of the pinion.
    - Direction: the rack has the velocity of the pinion's teeth on the pitch line.
    - ``offset``: the position of the rack where the angle of the pinion is 0. Both are relative to the body.
    """

    title: ClassVar[str] = "Rack and Pinion Constraint"
    sign: ClassVar[FaceSign] = Words("Rack")
    card_size: ClassVar[tuple[float, float]] = (104.0, 50.0)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A rack falls and turns its pinion.",
        parameters={"radius": 0.1},
        extra_blocks=(
            driver("WorldFrame").named("world"),
            driver("MechanismConfiguration", gravity=ALONG_Y).named("gravity"),
            driver("RevoluteJoint", sense_position=True, damping_coefficient=0.2).named("shaft"),
            driver("CylindricalSolid", radius=0.1, length=0.05).named("pinion"),
            driver(
                "RigidTransform",
                translation=(0.1, 0.0, 0.0),
                rotation="standard_axis",
                axis="x",
                angle=-np.pi / 2,
            ).named("guide"),
            driver("PrismaticJoint", sense_position=True).named("slider"),
            driver("BrickSolid", mass_from="mass", mass=2.0, dimensions=(0.05, 0.05, 1.0)).named("rack"),
        ),
        shown=("shaft/q", "slider/q"),
        lines=(
            ("world/W", "gravity/C"),
            ("world/W", "shaft/B"),
            ("shaft/F", "pinion/R"),
            ("world/W", "guide/B"),
            ("guide/F", "slider/B"),
            ("slider/F", "rack/R"),
            ("shaft/F", "B"),
            ("slider/F", "F"),
        ),
        stop_time=1.0,
    )

    radius: float = parameter(
        0.1, above=0.0, tunable=False, doc="radius of the pinion's pitch circle", unit="m"
    )
    offset: float = parameter(
        0.0, tunable=False, doc="position of the rack where the angle of the pinion is 0", unit="m"
    )

    def frame_ports(self) -> tuple[FramePort, ...]:
        return (FramePort(BASE, "pinion"), FramePort(FOLLOWER, "rack, on its pitch line", "right"))

    def part(self) -> CouplingPart:
        return CouplingPart(joints=("revolute", "prismatic"), offset=self.offset)

    def follower_per_base(self, base: AxisOfCoupling, follower: AxisOfCoupling) -> float:
        """The motion of the rack along z of F (m) per angle of the pinion about z of B (rad)."""
        axis, z = base.direction, follower.direction
        if abs(float(axis @ z)) > PERPENDICULAR_TOLERANCE:
            raise InputError(
                "the rack does not move at a right angle to the axis of the pinion",
                where="RackAndPinionConstraint",
                allowed="a prismatic joint across the axis of the revolute joint",
                fix="turn one of the joints by a Rigid Transform",
            )
        side = np.cross(axis, z)
        distance = float((follower.point - base.point) @ side)
        if not abs(abs(distance) - self.radius) <= DISTANCE_TOLERANCE * self.radius:
            raise InputError(
                f"the pitch line of the rack is {1000.0 * abs(distance):.6g} mm from the axis of the pinion, "
                f"whose radius is {1000.0 * self.radius:.6g} mm",
                where="RackAndPinionConstraint",
                allowed="a frame F at the distance of the radius from the axis of the pinion",
                fix="correct the radius, or the transform between the two joints",
            )
        # The velocity of the pinion's pitch point at r = distance side is axis x r = -distance z per rad/s.
        return float(np.copysign(self.radius, -distance))
