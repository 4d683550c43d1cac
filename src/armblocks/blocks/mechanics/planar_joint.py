"""The planar joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.blocks.mechanics.examples import ALONG_Y, joint_example
from armblocks.blocks.mechanics.joint_block import JointBlock
from armblocks.diagram import WorkedExample
from armblocks.diagram.signs import FaceSign, Words
from armblocks.robot import Closure, PlanarClosure
from armblocks.robot.joints import AxisMotion, Motion


@dataclass(frozen=True, kw_only=True)
class PlanarJoint(JointBlock):
    """A motion in a plane: frame F translates along the x and y axes of frame B and rotates about z."""

    title: ClassVar[str] = "Planar Joint"
    sign: ClassVar[FaceSign] = Words("Planar")
    motions: ClassVar[tuple[Motion, ...]] = (
        AxisMotion(axis=(1.0, 0.0, 0.0), linear=1.0, name="px"),
        AxisMotion(axis=(0.0, 1.0, 0.0), linear=1.0, name="py"),
        AxisMotion(axis=(0.0, 0.0, 1.0), angular=1.0, name="rz"),
    )
    closure: ClassVar[type[Closure] | None] = PlanarClosure
    example: ClassVar[WorkedExample] = joint_example(
        "A brick between springs in a plane.",
        gravity=ALONG_Y,
        position_target=(0.1, 0.0, 0.5),
        spring_stiffness=(200.0, 200.0, 1.0),
    )
