"""The spherical joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.blocks.mechanics.examples import joint_example
from armblocks.blocks.mechanics.joint_block import JointBlock
from armblocks.diagram import WorkedExample
from armblocks.diagram.signs import FaceSign, Words
from armblocks.robot import Closure, SphericalClosure
from armblocks.robot.joints import BallMotion, Motion


@dataclass(frozen=True, kw_only=True)
class SphericalJoint(JointBlock):
    """A ball joint: F rotates about the common origin of B and F; q is the quaternion w x y z of F in B."""

    title: ClassVar[str] = "Spherical Joint"
    sign: ClassVar[FaceSign] = Words("Spherical")
    motions: ClassVar[tuple[Motion, ...]] = (BallMotion(),)
    closure: ClassVar[type[Closure] | None] = SphericalClosure
    example: ClassVar[WorkedExample] = joint_example(
        "A pendulum swings and spins about a point: the entries of the quaternion.",
        offset=(0.0, 0.0, -0.5),
        velocity_target=(1.0, 0.5, 3.0),
    )
