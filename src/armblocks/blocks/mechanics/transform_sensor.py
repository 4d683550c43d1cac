"""The sensor of the motion of one frame relative to another."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, horzcat, sqrt, vertcat

from armblocks.blocks.mechanics.examples import gravity_block
from armblocks.blocks.mechanics.mechanics_block import MechanicsBlock
from armblocks.diagram import FramePort, Port, Signals, WorkedExample, driver, parameter
from armblocks.diagram.signs import FaceSign, Words
from armblocks.errors import InputError
from armblocks.multibody.parts import BASE, FOLLOWER, ForcePart, FrameMotion
from armblocks.spatial.vectors import Vector, cross, dot, scale, subtract

_OUTPUTS = {
    "sense_position": ("p", "position of the origin of F relative to that of B", "m", (3,)),
    "sense_velocity": ("v", "velocity of the origin of F relative to B", "m/s", (3,)),
    "sense_acceleration": ("a", "acceleration of the origin of F relative to B", "m/s2", (3,)),
    "sense_rotation": ("R", "rotation of F in B", "", (3, 3)),
    "sense_angular_velocity": ("w", "angular velocity of F relative to B", "rad/s", (3,)),
    "sense_angular_acceleration": ("alpha", "angular acceleration of F relative to B", "rad/s2", (3,)),
    "sense_distance": ("d", "distance of the origins", "m", ()),
}


@dataclass(frozen=True, kw_only=True)
class TransformSensor(MechanicsBlock):
    """The motion of frame F relative to frame B: position, rotation, velocities, accelerations.

    ``measurement_frame`` selects the observer and the axes of the vectors:

    - ``world``: the observer moves with the origin of B and does not rotate. The axes are those of the World
      Frame. The velocity is the velocity of F minus the velocity of B.
    - ``nonrotating_base``: the same observer; the axes are the present axes of B.
    - ``base``: the observer moves and rotates with B; the axes are those of B.

    The rotation matrix ``R`` is the rotation of F in B for every measurement frame.
    """

    title: ClassVar[str] = "Transform Sensor"
    sign: ClassVar[FaceSign] = Words("Sensor")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The position of the end of a pendulum in the World Frame.",
        parameters={"sense_position": True},
        extra_blocks=(
            driver("WorldFrame").named("world"),
            gravity_block(),
            driver("RevoluteJoint", position_target=1.0).named("hinge"),
            driver("RigidTransform", translation=(0.0, -0.5, 0.0)).named("rod"),
            driver("BrickSolid", mass_from="mass", dimensions=(0.1, 0.1, 0.1)).named("brick"),
        ),
        lines=(
            ("world/W", "gravity/C"),
            ("world/W", "hinge/B"),
            ("hinge/F", "rod/B"),
            ("rod/F", "brick/R"),
            ("world/W", "B"),
            ("rod/F", "F"),
        ),
        stop_time=5.0,
    )

    measurement_frame: str = parameter(
        "world", choices=("world", "base", "nonrotating_base"), doc="observer and axes of the vectors"
    )
    sense_position: bool = parameter(True, doc="output p of the position")
    sense_velocity: bool = parameter(False, doc="output v of the velocity")
    sense_acceleration: bool = parameter(False, doc="output a of the acceleration")
    sense_rotation: bool = parameter(False, doc="output R of the rotation matrix")
    sense_angular_velocity: bool = parameter(False, doc="output w of the angular velocity")
    sense_angular_acceleration: bool = parameter(False, doc="output alpha of the angular acceleration")
    sense_distance: bool = parameter(False, doc="output d of the distance of the origins")

    def check(self) -> None:
        if not any(getattr(self, name) for name in _OUTPUTS):
            raise InputError(
                "the sensor has no output",
                where="TransformSensor",
                allowed=", ".join(_OUTPUTS),
                fix="set one of them",
            )

    def frame_ports(self) -> tuple[FramePort, ...]:
        return (FramePort(BASE, "base frame"), FramePort(FOLLOWER, "follower frame"))

    def output_ports(self) -> tuple[Port, ...]:
        return tuple(Port(*port) for name, port in _OUTPUTS.items() if getattr(self, name))

    def part(self) -> ForcePart:
        accelerations = self.sense_acceleration or self.sense_angular_acceleration
        return ForcePart(frames=(BASE, FOLLOWER), exerts=False, accelerations=accelerations)

    def loads(
        self, frames: Mapping[str, FrameMotion], u: Signals, p: Signals
    ) -> Mapping[str, tuple[Vector, Vector]]:
        """A sensor exerts no force."""
        return {}

    def measured(self, frames: Mapping[str, FrameMotion], u: Signals, p: Signals) -> Mapping[str, SX]:
        """The values of the chosen outputs."""
        base, follower = frames[BASE], frames[FOLLOWER]
        d = subtract(follower.position, base.position)
        v = subtract(follower.velocity, base.velocity)
        a = subtract(follower.acceleration, base.acceleration)
        w = subtract(follower.angular_velocity, base.angular_velocity)
        alpha = subtract(follower.angular_acceleration, base.angular_acceleration)
        if self.measurement_frame == "base":
            W = base.angular_velocity
            # d/dt in axes that rotate with B: x' = dx/dt - W x x.
            v = subtract(v, cross(W, d))
            a = subtract(a, cross(base.angular_acceleration, d))
            a = subtract(subtract(a, cross(W, cross(W, d))), scale(2.0, cross(W, v)))
            alpha = subtract(alpha, cross(W, w))
        vectors = {"p": d, "v": v, "a": a, "w": w, "alpha": alpha}
        axes = None if self.measurement_frame == "world" else base.rotation
        values = {name: _column(value, axes) for name, value in vectors.items()}
        values["R"] = SX(horzcat(*(_column(column, base.rotation) for column in follower.rotation)))
        values["d"] = sqrt(SX(dot(d, d)))
        return {port.name: values[port.name] for port in self.output_ports()}


def _column(a: Vector, axes: tuple[Vector, Vector, Vector] | None) -> SX:
    """A vector in world axes as a column, in the given axes."""
    return SX(vertcat(*a)) if axes is None else SX(vertcat(*(dot(axis, a) for axis in axes)))
