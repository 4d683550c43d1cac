"""The cartesian joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.blocks.mechanics.examples import joint_example
from armblocks.blocks.mechanics.joint_block import JointBlock
from armblocks.diagram import WorkedExample
from armblocks.diagram.signs import FaceSign, Words
from armblocks.robot.joints import AxisMotion, Motion


@dataclass(frozen=True, kw_only=True)
class CartesianJoint(JointBlock):
    """Three slides: frame F translates along the x, y and z axes of frame B, without rotation."""

    title: ClassVar[str] = "Cartesian Joint"
    sign: ClassVar[FaceSign] = Words("Cartesian")
    motions: ClassVar[tuple[Motion, ...]] = (
        AxisMotion(axis=(1.0, 0.0, 0.0), linear=1.0, name="px"),
        AxisMotion(axis=(0.0, 1.0, 0.0), linear=1.0, name="py"),
        AxisMotion(axis=(0.0, 0.0, 1.0), linear=1.0, name="pz"),
    )
    example: ClassVar[WorkedExample] = joint_example(
        "A mass between springs in three directions.",
        position_target=(0.1, 0.05, 0.0),
        spring_stiffness=(100.0, 150.0, 200.0),
    )
