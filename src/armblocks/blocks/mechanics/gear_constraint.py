"""A pair of gears with parallel axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from armblocks.blocks.mechanics.examples import gravity_block
from armblocks.blocks.mechanics.mechanics_block import MechanicsBlock
from armblocks.diagram import FramePort, WorkedExample, driver, parameter
from armblocks.diagram.signs import FaceSign, Words
from armblocks.errors import InputError
from armblocks.multibody.parts import BASE, FOLLOWER, AxisOfCoupling, CouplingPart

PARALLEL_TOLERANCE = 1e-9
"""Largest sine of the angle between two parallel axes."""


@dataclass(frozen=True, kw_only=True)
class GearConstraint(MechanicsBlock):
    """Two gears that mesh without backlash: gear B and gear F turn at speeds of a constant ratio.

    Revolute joints connect both gears with one body, such as a housing, a planet carrier or the world. The
    z axes of B and F are the axes of these joints. The angles of the gears about these axes are relative to
    the body. If both z axes have the same direction:

    - ``external``: ratio (angle_F - offset) = -angle_B.
    - ``internal``: ratio (angle_F - offset) = angle_B.

    If the z axes have opposite directions, the sign of angle_B is the opposite one. The distance of the axes
    is not checked: the block also describes a belt or a train of gears. Solids give the masses and inertias
    of the gears.
    """

    title: ClassVar[str] = "Gear Constraint"
    sign: ClassVar[FaceSign] = Words("Gears")
    card_size: ClassVar[tuple[float, float]] = (84.0, 50.0)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A weight on the large gear F turns the small gear B twice as fast, in the other direction.",
        parameters={"ratio": 2.0},
        extra_blocks=(
            driver("WorldFrame").named("world"),
            gravity_block(),
            driver("RevoluteJoint", sense_position=True).named("small shaft"),
            driver("CylindricalSolid", radius=0.1, length=0.05).named("small gear"),
            driver("RigidTransform", translation=(0.3, 0.0, 0.0)).named("distance"),
            driver("RevoluteJoint", sense_position=True, position_target=0.5, position_priority="high").named(
                "large shaft"
            ),
            driver("CylindricalSolid", radius=0.2, length=0.05).named("large gear"),
            driver("RigidTransform", translation=(0.0, -0.15, 0.0)).named("arm"),
            driver("BrickSolid", mass_from="mass", mass=20.0, dimensions=(0.1, 0.1, 0.1)).named("weight"),
        ),
        shown=("small shaft/q", "large shaft/q"),
        lines=(
            ("world/W", "gravity/C"),
            ("world/W", "small shaft/B"),
            ("small shaft/F", "small gear/R"),
            ("world/W", "distance/B"),
            ("distance/F", "large shaft/B"),
            ("large shaft/F", "large gear/R"),
            ("large shaft/F", "arm/B"),
            ("arm/F", "weight/R"),
            ("small shaft/F", "B"),
            ("large shaft/F", "F"),
        ),
        stop_time=5.0,
    )

    gear_type: str = parameter(
        "external",
        choices=("external", "internal"),
        doc="external: the gears turn in opposite directions; internal: in the same direction",
    )
    ratio: float = parameter(
        1.0, above=0.0, tunable=False, doc="teeth of gear F per teeth of gear B, or the ratio of radii"
    )
    offset: float = parameter(0.0, tunable=False, doc="angle of gear F where gear B is at 0", unit="rad")

    def frame_ports(self) -> tuple[FramePort, ...]:
        return (FramePort(BASE, "gear B"), FramePort(FOLLOWER, "gear F", "right"))

    def part(self) -> CouplingPart:
        return CouplingPart(joints=("revolute", "revolute"), offset=self.offset)

    def follower_per_base(self, base: AxisOfCoupling, follower: AxisOfCoupling) -> float:
        """The angle of F about its z axis per angle of B."""
        if float(np.linalg.norm(np.cross(base.direction, follower.direction))) > PARALLEL_TOLERANCE:
            raise InputError(
                "the axes of the two gears are not parallel",
                where="GearConstraint",
                allowed="revolute joints with parallel axes",
                fix="turn the joint of one of the gears",
            )
        sign = 1.0 if self.gear_type == "internal" else -1.0
        return float(np.copysign(sign / self.ratio, sign * float(base.direction @ follower.direction)))
