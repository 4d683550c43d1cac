"""The bushing joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.blocks.mechanics.examples import joint_example
from armblocks.blocks.mechanics.joint_block import JointBlock
from armblocks.diagram import WorkedExample
from armblocks.diagram.signs import FaceSign, Words
from armblocks.robot.joints import AxisMotion, Motion


@dataclass(frozen=True, kw_only=True)
class BushingJoint(JointBlock):
    """An elastic mount: frame F translates along all axes of frame B and rotates in all directions.

    The coordinates are the translations px, py and pz (m) along the axes of B, then the rotations rx, ry and
    rz (rad) about the x, y and z axes of F, in this order. At ry = ±90 degrees the first and the last
    rotation axis coincide; the 6-DOF Joint has no such position.
    """

    title: ClassVar[str] = "Bushing Joint"
    sign: ClassVar[FaceSign] = Words("Bushing")
    motions: ClassVar[tuple[Motion, ...]] = (
        AxisMotion(axis=(1.0, 0.0, 0.0), linear=1.0, name="px"),
        AxisMotion(axis=(0.0, 1.0, 0.0), linear=1.0, name="py"),
        AxisMotion(axis=(0.0, 0.0, 1.0), linear=1.0, name="pz"),
        AxisMotion(axis=(1.0, 0.0, 0.0), angular=1.0, name="rx"),
        AxisMotion(axis=(0.0, 1.0, 0.0), angular=1.0, name="ry"),
        AxisMotion(axis=(0.0, 0.0, 1.0), angular=1.0, name="rz"),
    )
    example: ClassVar[WorkedExample] = joint_example(
        "A brick on a rubber mount.",
        spring_stiffness=(500.0, 500.0, 500.0, 5.0, 5.0, 5.0),
        position_target=(0.01, 0.0, 0.0, 0.1, 0.0, 0.0),
    )
