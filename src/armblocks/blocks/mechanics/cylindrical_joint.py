"""The cylindrical joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.blocks.mechanics.examples import joint_example
from armblocks.blocks.mechanics.joint_block import JointBlock
from armblocks.diagram import WorkedExample
from armblocks.diagram.signs import FaceSign, Words
from armblocks.robot import Closure, CylindricalClosure
from armblocks.robot.joints import AxisMotion, Motion


@dataclass(frozen=True, kw_only=True)
class CylindricalJoint(JointBlock):
    """A shaft in a sleeve: frame F rotates about the common z axis of B and F and slides along it."""

    title: ClassVar[str] = "Cylindrical Joint"
    sign: ClassVar[FaceSign] = Words("Cylindrical")
    motions: ClassVar[tuple[Motion, ...]] = (
        AxisMotion(axis=(0.0, 0.0, 1.0), angular=1.0, name="rz"),
        AxisMotion(axis=(0.0, 0.0, 1.0), linear=1.0, name="pz"),
    )
    closure: ClassVar[type[Closure] | None] = CylindricalClosure
    example: ClassVar[WorkedExample] = joint_example(
        "A brick turns and slides on a shaft with springs.",
        position_target=(1.0, 0.0),
        spring_stiffness=(1.0, 200.0),
    )
