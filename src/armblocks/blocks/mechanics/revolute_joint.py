"""The revolute joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.blocks.mechanics.examples import ALONG_Y, joint_example
from armblocks.blocks.mechanics.joint_block import JointBlock
from armblocks.diagram import WorkedExample
from armblocks.diagram.signs import FaceSign, Words
from armblocks.robot import Closure, RevoluteClosure
from armblocks.robot.joints import AxisMotion, Motion


@dataclass(frozen=True, kw_only=True)
class RevoluteJoint(JointBlock):
    """A hinge: F rotates by q rad about the common z axis of B and F."""

    title: ClassVar[str] = "Revolute Joint"
    sign: ClassVar[FaceSign] = Words("Revolute")
    motions: ClassVar[tuple[Motion, ...]] = (AxisMotion(axis=(0.0, 0.0, 1.0), angular=1.0),)
    closure: ClassVar[type[Closure] | None] = RevoluteClosure
    example: ClassVar[WorkedExample] = joint_example(
        "A brick swings about a hinge with friction.",
        gravity=ALONG_Y,
        offset=(0.0, -0.5, 0.0),
        position_target=1.0,
        damping_coefficient=0.2,
    )
