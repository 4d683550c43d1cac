"""The prismatic joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.blocks.mechanics.examples import joint_example
from armblocks.blocks.mechanics.joint_block import JointBlock
from armblocks.diagram import WorkedExample
from armblocks.diagram.signs import FaceSign, Words
from armblocks.robot import Closure, PrismaticClosure
from armblocks.robot.joints import AxisMotion, Motion


@dataclass(frozen=True, kw_only=True)
class PrismaticJoint(JointBlock):
    """A slider: F translates by q m along the common z axis of B and F."""

    title: ClassVar[str] = "Prismatic Joint"
    sign: ClassVar[FaceSign] = Words("Prismatic")
    motions: ClassVar[tuple[Motion, ...]] = (AxisMotion(axis=(0.0, 0.0, 1.0), linear=1.0),)
    closure: ClassVar[type[Closure] | None] = PrismaticClosure
    example: ClassVar[WorkedExample] = joint_example(
        "A mass hangs on a spring with a damper.", spring_stiffness=200.0, damping_coefficient=2.0
    )
