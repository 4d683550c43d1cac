"""The 6-DOF joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.blocks.mechanics.examples import joint_example
from armblocks.blocks.mechanics.joint_block import JointBlock
from armblocks.diagram import WorkedExample
from armblocks.diagram.signs import FaceSign, Words
from armblocks.robot.joints import AxisMotion, BallMotion, Motion


@dataclass(frozen=True, kw_only=True)
class SixDofJoint(JointBlock):
    """A free motion: frame F translates and rotates relative to frame B without any constraint.

    The coordinates are the translations px, py and pz (m) along the axes of B, then the quaternion w x y z of
    F in B.
    """

    title: ClassVar[str] = "6-DOF Joint"
    sign: ClassVar[FaceSign] = Words("6-DOF")
    motions: ClassVar[tuple[Motion, ...]] = (
        AxisMotion(axis=(1.0, 0.0, 0.0), linear=1.0, name="px"),
        AxisMotion(axis=(0.0, 1.0, 0.0), linear=1.0, name="py"),
        AxisMotion(axis=(0.0, 0.0, 1.0), linear=1.0, name="pz"),
        BallMotion(),
    )
    example: ClassVar[WorkedExample] = joint_example(
        "A brick is thrown upwards and spins.",
        velocity_target=(1.0, 0.0, 5.0, 0.1, 4.0, 0.1),
        stop_time=1.0,
    )
