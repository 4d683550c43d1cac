"""The lead screw joint."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from armblocks.blocks.mechanics.examples import joint_example
from armblocks.blocks.mechanics.joint_block import JointBlock
from armblocks.diagram import WorkedExample, parameter
from armblocks.diagram.signs import FaceSign, Words
from armblocks.robot.joints import AxisMotion, Motion


@dataclass(frozen=True, kw_only=True)
class LeadScrewJoint(JointBlock):
    """A screw: F rotates by q rad about the common z axis and translates along it by lead q / (2 pi)."""

    title: ClassVar[str] = "Lead Screw Joint"
    sign: ClassVar[FaceSign] = Words("Screw")
    motions: ClassVar[tuple[Motion, ...]] = (AxisMotion(axis=(0.0, 0.0, 1.0), angular=1.0, linear=1.0),)
    example: ClassVar[WorkedExample] = joint_example(
        "A brick runs down a steep screw with friction.", lead=0.5, damping_coefficient=0.2, stop_time=2.0
    )

    lead: float = parameter(
        0.01, tunable=False, doc="translation of one turn; negative for a left-hand screw", unit="m"
    )

    def elementary_motions(self) -> tuple[Motion, ...]:
        return (AxisMotion(axis=(0.0, 0.0, 1.0), angular=1.0, linear=self.lead / (2.0 * math.pi)),)
