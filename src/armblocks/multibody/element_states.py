"""A force element or sensor of a mechanism in a flat diagram: its loads and its outputs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, cast

from casadi import SX, vertcat

from armblocks.diagram import Block, Parameter, ParameterKind, Port, Signals, parameter
from armblocks.diagram.parameter import Value
from armblocks.multibody.joint_states import structure_of
from armblocks.multibody.mechanism import ACCELERATION_SIZE, KINEMATICS_SIZE
from armblocks.multibody.parts import ForceLaw, ForcePart, FrameMotion
from armblocks.spatial.vectors import ZERO, Vector


@dataclass(frozen=True, kw_only=True)
class ElementLoads(Block):
    """The loads and outputs of a drawn force element or sensor, from the motion of its frames."""

    title: ClassVar[str] = "Force element"

    element: Block = parameter(kind=ParameterKind.DIAGRAM, of_type=Block, doc="the drawn block")
    place: ForcePart = parameter(kind=ParameterKind.DIAGRAM, of_type=ForcePart, doc="its part")

    @property
    def law(self) -> ForceLaw:
        """The drawn block with its equations."""
        return cast("ForceLaw", cast("Any", self.element))

    def inputs_of_the_run(self) -> tuple[Parameter, ...]:
        """The tunable parameters of the drawn block."""
        return self.element.inputs_of_the_run()

    def parameter_value(self, name: str) -> Value:
        if name == "element":  # tunable parameters do not change the equations
            return structure_of(self.element)
        own = {rule.name for rule in self.parameters()}
        return getattr(self, name) if name in own else self.element.parameter_value(name)

    def input_ports(self) -> tuple[Port, ...]:
        count = len(self.place.frames)
        ports = [
            *self.element.input_ports(),
            Port("frame motion", "poses and velocities", "", (KINEMATICS_SIZE * count,), internal=True),
        ]
        if self.place.accelerations:
            shape = (ACCELERATION_SIZE * count,)
            ports.append(Port("frame acceleration", "accelerations", "", shape, internal=True))
        return tuple(ports)

    def output_ports(self) -> tuple[Port, ...]:
        own = self.element.output_ports()
        if not self.place.exerts:
            return own
        shape = (6 * len(self.place.frames),)
        return (*own, Port("loads", "forces and moments on the frames", "", shape, internal=True))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        frames = {name: self._motion(k, u) for k, name in enumerate(self.place.frames)}
        values = dict(self.law.measured(frames, u, p))
        if self.place.exerts:
            loads = self.law.loads(frames, u, p)
            columns = (loads.get(name, (ZERO, ZERO)) for name in self.place.frames)
            values["loads"] = SX(vertcat(*(vertcat(*force, *moment) for force, moment in columns)))
        return values

    def _motion(self, k: int, u: Signals) -> FrameMotion:
        motion = u["frame motion"]

        def three(column: SX, first: int) -> Vector:
            return column[first], column[first + 1], column[first + 2]

        first = KINEMATICS_SIZE * k
        acceleration, angular = ZERO, ZERO
        if self.place.accelerations:
            column = u["frame acceleration"]
            acceleration = three(column, ACCELERATION_SIZE * k)
            angular = three(column, ACCELERATION_SIZE * k + 3)
        return FrameMotion(
            rotation=(three(motion, first), three(motion, first + 3), three(motion, first + 6)),
            position=three(motion, first + 9),
            velocity=three(motion, first + 12),
            angular_velocity=three(motion, first + 15),
            acceleration=acceleration,
            angular_acceleration=angular,
        )
