"""Forces between the origins of two frames along the line through them: a given force, a spring."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from casadi import SX, sqrt

from armblocks.blocks.mechanics.examples import DOWN
from armblocks.blocks.mechanics.mechanics_block import MechanicsBlock
from armblocks.diagram import ExampleBlock, FramePort, Port, Signals, WorkedExample, driver, parameter
from armblocks.diagram.signs import FaceSign, Words
from armblocks.multibody.parts import BASE, FOLLOWER, ForcePart, FrameMotion
from armblocks.spatial.vectors import ZERO, Scalar, Vector, dot, scale, subtract


def _slider_example(
    shows: str, inputs: Mapping[str, ExampleBlock], **parameters: float | bool
) -> WorkedExample:
    """A brick on a vertical slider, 1 m below the World Frame at the start, and the force between both."""
    return WorkedExample(
        shows=shows,
        parameters=parameters,
        inputs=inputs,
        extra_blocks=(
            driver("WorldFrame").named("world"),
            driver("MechanismConfiguration", gravity=DOWN).named("gravity"),
            driver("PrismaticJoint", sense_position=True, position_target=-1.0).named("slider"),
            driver("BrickSolid", mass_from="mass", dimensions=(0.2, 0.2, 0.2)).named("brick"),
        ),
        shown=("slider/q",),
        lines=(
            ("world/W", "gravity/C"),
            ("world/W", "slider/B"),
            ("slider/F", "brick/R"),
            ("world/W", "B"),
            ("slider/F", "F"),
        ),
        stop_time=5.0,
    )


class _Line(NamedTuple):
    """The direction from B to F, a unit vector, the distance (m) and its rate (m/s)."""

    direction: Vector
    distance: SX
    rate: Scalar


def _line(frames: Mapping[str, FrameMotion]) -> _Line:
    base, follower = frames[BASE], frames[FOLLOWER]
    displacement = subtract(follower.position, base.position)
    distance = sqrt(SX(dot(displacement, displacement)))
    direction = scale(1.0 / distance, displacement)
    return _Line(direction, distance, dot(direction, subtract(follower.velocity, base.velocity)))


def _pushing(line: _Line, force: Scalar) -> Mapping[str, tuple[Vector, Vector]]:
    """The loads of a force that pushes the frames apart."""
    return {
        FOLLOWER: (scale(force, line.direction), ZERO),
        BASE: (scale(-force, line.direction), ZERO),
    }


_FRAMES = (FramePort(BASE, "base frame"), FramePort(FOLLOWER, "follower frame", "right"))


@dataclass(frozen=True, kw_only=True)
class InternalForce(MechanicsBlock):
    """A force f (N) between two bodies along the line from B to F; f > 0 pushes them apart.

    The origins of the frames must not coincide: the force would have no direction, and results are NaN.
    """

    title: ClassVar[str] = "Internal Force"
    sign: ClassVar[FaceSign] = Words("← f →")
    example: ClassVar[WorkedExample] = _slider_example(
        "A force of 9.75 N carries most of the weight of a brick of 1 kg, which sinks slowly.",
        {"f": driver("Constant", value=-9.75).named("pull")},
    )

    def frame_ports(self) -> tuple[FramePort, ...]:
        return _FRAMES

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("f", "force that pushes the frames apart", "N", ()),)

    def part(self) -> ForcePart:
        return ForcePart(frames=(BASE, FOLLOWER))

    def loads(
        self, frames: Mapping[str, FrameMotion], u: Signals, p: Signals
    ) -> Mapping[str, tuple[Vector, Vector]]:
        """Opposite forces at B and F."""
        return _pushing(_line(frames), u["f"])

    def measured(self, frames: Mapping[str, FrameMotion], u: Signals, p: Signals) -> Mapping[str, SX]:
        """No outputs."""
        return {}


@dataclass(frozen=True, kw_only=True)
class SpringAndDamperForce(MechanicsBlock):
    """A spring and a damper between two bodies: f = -k (L - natural length) - d dL/dt pushes B and F apart.

    L is the distance of the origins of B and F. The origins must not coincide: the force would have no
    direction, and results are NaN.
    """

    title: ClassVar[str] = "Spring and Damper Force"
    sign: ClassVar[FaceSign] = Words("Spring")
    example: ClassVar[WorkedExample] = _slider_example(
        "A brick hangs at a spring with a damper.",
        {},
        natural_length=1.0,
        spring_stiffness=50.0,
        damping_coefficient=1.0,
        sense_force=True,
    )

    natural_length: float = parameter(0.0, minimum=0.0, doc="distance without force", unit="m")
    spring_stiffness: float = parameter(0.0, minimum=0.0, doc="stiffness", unit="N/m")
    damping_coefficient: float = parameter(0.0, minimum=0.0, doc="coefficient of damping", unit="N s/m")
    sense_force: bool = parameter(False, doc="output of the force")

    def frame_ports(self) -> tuple[FramePort, ...]:
        return _FRAMES

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("f", "force that pushes the frames apart", "N", ()),) * self.sense_force

    def part(self) -> ForcePart:
        return ForcePart(frames=(BASE, FOLLOWER))

    def loads(
        self, frames: Mapping[str, FrameMotion], u: Signals, p: Signals
    ) -> Mapping[str, tuple[Vector, Vector]]:
        """Opposite forces at B and F."""
        line = _line(frames)
        return _pushing(line, _force(line, p))

    def measured(self, frames: Mapping[str, FrameMotion], u: Signals, p: Signals) -> Mapping[str, SX]:
        """The force."""
        return {"f": _force(_line(frames), p)} if self.sense_force else {}


def _force(line: _Line, p: Signals) -> SX:
    spring = -p["spring_stiffness"] * (line.distance - p["natural_length"])
    return SX(spring - p["damping_coefficient"] * line.rate)
