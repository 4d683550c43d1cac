"""The frame port of a subsystem."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.diagram.block import Block
from armblocks.diagram.frames import FramePort
from armblocks.diagram.parameter import parameter
from armblocks.diagram.signs import FaceSign, Outline, Words
from armblocks.diagram.worked_example import WorkedExample, driver


@dataclass(frozen=True, kw_only=True)
class ConnectionPort(Block):
    """A frame port of a subsystem: the frame at this block is the frame at the subsystem's port of this name.

    ``side`` is the side of the subsystem on which drawings put the port.
    """

    title: ClassVar[str] = "Connection Port"
    outline: ClassVar[Outline] = Outline.OVAL
    sign: ClassVar[FaceSign] = Words("port")
    virtual: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="At the top level the block has no effect; in a subsystem it connects a frame to the outside.",
        extra_blocks=(
            driver("WorldFrame").named("world"),
            driver("MechanismConfiguration", gravity=(0.0, -9.80665, 0.0)).named("gravity"),
            driver("RevoluteJoint", sense_position=True, position_target=1.0).named("hinge"),
            driver("RigidTransform", translation=(0.0, -0.5, 0.0)).named("rod"),
            driver("BrickSolid", mass_from="mass", dimensions=(0.1, 0.1, 0.1)).named("brick"),
        ),
        shown=("hinge/q",),
        lines=(
            ("world/W", "gravity/C"),
            ("world/W", "hinge/B"),
            ("hinge/F", "rod/B"),
            ("rod/F", "brick/R"),
            ("rod/F", "C"),
        ),
        stop_time=5.0,
    )

    side: str = parameter("left", choices=("left", "right"), doc="side of the subsystem with the port")

    def frame_ports(self) -> tuple[FramePort, ...]:
        return (FramePort("C", "the frame of the port", "right" if self.side == "left" else "left"),)


FRAME = "C"
"""The name of the frame port of a Connection Port."""
