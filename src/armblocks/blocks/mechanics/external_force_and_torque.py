"""A force and a torque of the surroundings on a frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX

from armblocks.blocks.mechanics.examples import gravity_block
from armblocks.blocks.mechanics.mechanics_block import MechanicsBlock
from armblocks.diagram import FramePort, Port, Signals, WorkedExample, driver, parameter
from armblocks.diagram.signs import FaceSign, Words
from armblocks.errors import InputError
from armblocks.multibody.parts import FOLLOWER, ForcePart, FrameMotion
from armblocks.spatial.vectors import ZERO, Vector, add, scale


@dataclass(frozen=True, kw_only=True)
class ExternalForceAndTorque(MechanicsBlock):
    """A force and a torque from input signals on the body at frame F; the force acts at the origin of F.

    ``resolution`` selects the axes of the signals:

    - ``world``: the axes of the World Frame.
    - ``attached``: the axes of F.
    """

    title: ClassVar[str] = "External Force and Torque"
    sign: ClassVar[FaceSign] = Words("f, τ")
    card_size: ClassVar[tuple[float, float]] = (104.0, 50.0)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A constant sideways force deflects a pendulum.",
        inputs={"force": driver("Constant", value=(3.0, 0.0, 0.0)).named("sideways")},
        extra_blocks=(
            driver("WorldFrame").named("world"),
            gravity_block(),
            driver("RevoluteJoint", sense_position=True, damping_coefficient=0.5).named("hinge"),
            driver("RigidTransform", translation=(0.0, -0.5, 0.0)).named("rod"),
            driver("BrickSolid", mass_from="mass", dimensions=(0.1, 0.1, 0.1)).named("brick"),
        ),
        shown=("hinge/q",),
        lines=(
            ("world/W", "gravity/C"),
            ("world/W", "hinge/B"),
            ("hinge/F", "rod/B"),
            ("rod/F", "brick/R"),
            ("rod/F", "F"),
        ),
        stop_time=5.0,
    )

    force: bool = parameter(True, doc="whether there is an input for a force")
    torque: bool = parameter(False, doc="whether there is an input for a torque")
    resolution: str = parameter(
        "world", choices=("world", "attached"), doc="axes of the World Frame, or of F"
    )

    def check(self) -> None:
        if not self.force and not self.torque:
            raise InputError(
                "there is neither a force nor a torque",
                where="ExternalForceAndTorque",
                allowed="force, torque or both",
                fix="set one of them",
            )

    def frame_ports(self) -> tuple[FramePort, ...]:
        return (FramePort(FOLLOWER, "frame at which force and torque act", "right"),)

    def input_ports(self) -> tuple[Port, ...]:
        ports = ((self.force, "force", "N"), (self.torque, "torque", "N m"))
        return tuple(Port(name, f"{name}, x y z", unit, (3,)) for chosen, name, unit in ports if chosen)

    def part(self) -> ForcePart:
        return ForcePart(frames=(FOLLOWER,))

    def loads(
        self, frames: Mapping[str, FrameMotion], u: Signals, p: Signals
    ) -> Mapping[str, tuple[Vector, Vector]]:
        """The force and torque at F, in world axes."""
        force, torque = (_vector(u[name]) if name in u else ZERO for name in ("force", "torque"))
        if self.resolution == "attached":
            force, torque = (_in_world(frames[FOLLOWER], value) for value in (force, torque))
        return {FOLLOWER: (force, torque)}

    def measured(self, frames: Mapping[str, FrameMotion], u: Signals, p: Signals) -> Mapping[str, SX]:
        """No outputs."""
        return {}


def _vector(column: SX) -> Vector:
    return column[0], column[1], column[2]


def _in_world(frame: FrameMotion, a: Vector) -> Vector:
    x, y, z = frame.rotation
    return add(add(scale(a[0], x), scale(a[1], y)), scale(a[2], z))
