"""The rectangular joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.blocks.mechanics.examples import ALONG_Y, joint_example
from armblocks.blocks.mechanics.joint_block import JointBlock
from armblocks.diagram import WorkedExample
from armblocks.diagram.signs import FaceSign, Words
from armblocks.robot.joints import AxisMotion, Motion


@dataclass(frozen=True, kw_only=True)
class RectangularJoint(JointBlock):
    """Two slides: frame F translates along the x and y axes of frame B, without rotation."""

    title: ClassVar[str] = "Rectangular Joint"
    sign: ClassVar[FaceSign] = Words("Rectangular")
    motions: ClassVar[tuple[Motion, ...]] = (
        AxisMotion(axis=(1.0, 0.0, 0.0), linear=1.0, name="px"),
        AxisMotion(axis=(0.0, 1.0, 0.0), linear=1.0, name="py"),
    )
    example: ClassVar[WorkedExample] = joint_example(
        "A stage between springs along two axes.",
        gravity=ALONG_Y,
        position_target=(0.1, 0.0),
        spring_stiffness=(100.0, 200.0),
    )
