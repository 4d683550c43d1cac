"""The gimbal joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.blocks.mechanics.examples import joint_example
from armblocks.blocks.mechanics.joint_block import JointBlock
from armblocks.diagram import WorkedExample
from armblocks.diagram.signs import FaceSign, Words
from armblocks.robot import Closure, SphericalClosure
from armblocks.robot.joints import AxisMotion, Motion


@dataclass(frozen=True, kw_only=True)
class GimbalJoint(JointBlock):
    """Three gimbals: frame F rotates about its own x, then y, then z axis, relative to frame B.

    The coordinates are these angles rx, ry and rz (rad). At ry = ±90 degrees the first and the last axis
    coincide; the Spherical Joint has no such position.
    """

    title: ClassVar[str] = "Gimbal Joint"
    sign: ClassVar[FaceSign] = Words("Gimbal")
    motions: ClassVar[tuple[Motion, ...]] = (
        AxisMotion(axis=(1.0, 0.0, 0.0), angular=1.0, name="rx"),
        AxisMotion(axis=(0.0, 1.0, 0.0), angular=1.0, name="ry"),
        AxisMotion(axis=(0.0, 0.0, 1.0), angular=1.0, name="rz"),
    )
    closure: ClassVar[type[Closure] | None] = SphericalClosure
    example: ClassVar[WorkedExample] = joint_example(
        "A pendulum in three gimbals.", offset=(0.0, 0.0, -0.5), position_target=(0.4, 0.2, 0.0)
    )
