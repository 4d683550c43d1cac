"""The telescoping joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.blocks.mechanics.examples import joint_example
from armblocks.blocks.mechanics.joint_block import JointBlock
from armblocks.diagram import WorkedExample
from armblocks.diagram.signs import FaceSign, Words
from armblocks.robot.joints import AxisMotion, BallMotion, Motion


@dataclass(frozen=True, kw_only=True)
class TelescopingJoint(JointBlock):
    """A ball joint with a telescopic rod: frame F rotates about the origin of frame B and slides along z.

    The coordinates are the quaternion w x y z of F in B, then the translation pz (m) along the z axis of F.
    """

    title: ClassVar[str] = "Telescoping Joint"
    sign: ClassVar[FaceSign] = Words("Telescoping")
    motions: ClassVar[tuple[Motion, ...]] = (
        BallMotion(),
        AxisMotion(axis=(0.0, 0.0, 1.0), linear=1.0, name="pz"),
    )
    example: ClassVar[WorkedExample] = joint_example(
        "A mass swings on a telescopic rod with a spring.",
        position_target=(1.0, 0.2, 0.0, 0.0, -0.5),
        equilibrium_position=(0.0, 0.0, 0.0, -0.5),
        spring_stiffness=(0.0, 0.0, 0.0, 200.0),
    )
