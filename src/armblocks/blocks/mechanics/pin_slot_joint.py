"""The pin slot joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.blocks.mechanics.examples import ALONG_Y, joint_example
from armblocks.blocks.mechanics.joint_block import JointBlock
from armblocks.diagram import WorkedExample
from armblocks.diagram.signs import FaceSign, Words
from armblocks.robot.joints import AxisMotion, Motion


@dataclass(frozen=True, kw_only=True)
class PinSlotJoint(JointBlock):
    """A pin in a slot: frame F translates along the x axis of frame B, then rotates about its own z axis."""

    title: ClassVar[str] = "Pin Slot Joint"
    sign: ClassVar[FaceSign] = Words("Pin Slot")
    motions: ClassVar[tuple[Motion, ...]] = (
        AxisMotion(axis=(1.0, 0.0, 0.0), linear=1.0, name="px"),
        AxisMotion(axis=(0.0, 0.0, 1.0), angular=1.0, name="rz"),
    )
    example: ClassVar[WorkedExample] = joint_example(
        "A pin slides in a slot between springs while its brick swings.",
        gravity=ALONG_Y,
        offset=(0.0, -0.3, 0.0),
        position_target=(0.0, 0.5),
        spring_stiffness=(100.0, 0.0),
    )
