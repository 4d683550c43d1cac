"""The weld joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.blocks.mechanics.examples import gravity_block, pendulum_example
from armblocks.blocks.mechanics.mechanics_block import MechanicsBlock
from armblocks.diagram import FramePort, WorkedExample, driver
from armblocks.diagram.signs import FaceSign, Words
from armblocks.multibody.parts import BASE, FOLLOWER, RigidPart
from armblocks.spatial import Transform


@dataclass(frozen=True, kw_only=True)
class WeldJoint(MechanicsBlock):
    """A rigid connection: B and F are the same frame, and the bodies at both move as one."""

    title: ClassVar[str] = "Weld Joint"
    sign: ClassVar[FaceSign] = Words("Weld")
    example: ClassVar[WorkedExample] = pendulum_example(
        "A pendulum of two bricks that are welded to the same rod.",
        (("gravity/C", "world/W"), ("B", "rod/F"), ("F", "second/R")),
        more=(gravity_block(), driver("BrickSolid", dimensions=(0.3, 0.1, 0.1)).named("second")),
    )

    def frame_ports(self) -> tuple[FramePort, ...]:
        return (FramePort(BASE, "base frame"), FramePort(FOLLOWER, "follower frame", "right"))

    def part(self) -> RigidPart:
        return RigidPart(pose=Transform())
