"""The universal joint."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from armblocks.blocks.mechanics.examples import joint_example
from armblocks.blocks.mechanics.joint_block import JointBlock
from armblocks.diagram import WorkedExample
from armblocks.diagram.signs import FaceSign, Words
from armblocks.robot import Closure, UniversalClosure
from armblocks.robot.joints import AxisMotion, Motion
from armblocks.spatial import Transform, rotation_y


@dataclass(frozen=True, kw_only=True)
class UniversalJoint(JointBlock):
    """A Cardan joint: F rotates about the x axis of B, then about its own y axis."""

    title: ClassVar[str] = "Universal Joint"
    sign: ClassVar[FaceSign] = Words("Universal")
    motions: ClassVar[tuple[Motion, ...]] = (
        AxisMotion(axis=(1.0, 0.0, 0.0), angular=1.0, name="rx"),
        AxisMotion(axis=(0.0, 1.0, 0.0), angular=1.0, name="ry"),
    )
    closure: ClassVar[type[Closure] | None] = UniversalClosure
    closure_frames: ClassVar[tuple[Transform, Transform]] = (
        Transform(rotation=rotation_y(math.pi / 2)),  # the closure has the axes z and y
        Transform(),
    )
    example: ClassVar[WorkedExample] = joint_example(
        "A pendulum swings in two planes.", offset=(0.0, 0.0, -0.5), position_target=(0.5, 0.3)
    )
