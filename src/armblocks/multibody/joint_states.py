"""A joint of a mechanism in a flat diagram: its states, and the forces of spring, damper, limits, actuator.

The block has the path and the parameters of the drawn joint. It exchanges its state, its generalised force
and its acceleration with the block :mod:`~armblocks.multibody.mechanism`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from casadi import SX, fmax, fmin, vertcat
from numpy.typing import NDArray

from armblocks.diagram import (
    Block,
    Parameter,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    parameter,
    rate_unit,
)
from armblocks.diagram.parameter import Value
from armblocks.dynamics.ball_joints import rotation_vector
from armblocks.equations import Shape
from armblocks.multibody.parts import JointPart
from armblocks.robot.joints import AxisMotion
from armblocks.spatial.vectors import Scalar

LIMITS = ("limit_stiffness", "limit_damping", "transition_width")
TARGETS = ("position_target", "velocity_target")


def force_unit(unit: str) -> str:
    """The unit of the generalised force of a coordinate: N m for rad, N for m."""
    return {"rad": "N m", "m": "N"}.get(unit, "")


def common_unit(part: JointPart) -> str:
    """The unit of the integral of all speeds of a joint; empty if they differ."""
    units = {entry.unit for motion in part.motions for entry in motion.speeds}
    return units.pop() if len(units) == 1 else ""


def shape_of_speeds(part: JointPart) -> Shape:
    """The shape of the speeds: a scalar for a joint with one axis."""
    return () if part.nv == 1 else (part.nv,)


def shape_of_coordinates(part: JointPart) -> Shape:
    """The shape of the coordinates: a scalar for a joint with one axis."""
    return () if part.nq == 1 else (part.nq,)


def motion_ports(part: JointPart, *, internal: bool = False, prefix: str = "") -> tuple[Port, Port, Port]:
    """The ports of coordinates, speeds and accelerations of a joint."""
    unit = common_unit(part)
    position_unit = unit if part.nq == part.nv else ""
    positions = tuple(entry.name for motion in part.motions for entry in motion.positions)
    speeds = tuple(entry.name for motion in part.motions for entry in motion.speeds)
    q, qd = shape_of_coordinates(part), shape_of_speeds(part)
    return (
        Port(
            f"{prefix}q",
            "coordinates: follower relative to base",
            position_unit,
            q,
            positions if q else (),
            internal=internal,
        ),
        Port(f"{prefix}qd", "speeds", rate_unit(unit), qd, speeds if qd else (), internal=internal),
        Port(
            f"{prefix}qdd",
            "accelerations",
            rate_unit(rate_unit(unit)),
            qd,
            speeds if qd else (),
            internal=internal,
        ),
    )


@dataclass(frozen=True, kw_only=True)
class JointStates(Block):
    """The states of a joint of a mechanism: q' = qd, qd' = the acceleration from the mechanism."""

    title: ClassVar[str] = "Joint"
    output_rates: ClassVar[Mapping[str, str]] = {"q": "qd", "qd": "qdd"}

    joint: Block = parameter(kind=ParameterKind.DIAGRAM, of_type=Block, doc="the drawn joint")
    place: JointPart = parameter(kind=ParameterKind.DIAGRAM, of_type=JointPart, doc="its part")
    start_q: tuple[float, ...] = parameter(
        (), kind=ParameterKind.DIAGRAM, doc="assembled start, if in a loop"
    )
    start_qd: tuple[float, ...] = parameter((), kind=ParameterKind.DIAGRAM, doc="assembled speeds")
    closed: bool = parameter(False, doc="whether the mechanism has closed loops")
    unreachable: str = parameter("", kind=ParameterKind.DIAGRAM, doc="reason of values that are not finite")

    # -- the parameters of the drawn joint

    def inputs_of_the_run(self) -> tuple[Parameter, ...]:
        """The tunable parameters of the joint.

        In closed loops the targets are constants: the start is assembled before the run.
        """
        without = TARGETS if self.closed else ()
        return tuple(rule for rule in self.joint.inputs_of_the_run() if rule.name not in without)

    def parameter_value(self, name: str) -> Value:
        if name == "joint":  # tunable parameters do not change the equations
            return structure_of(self.joint)
        own = {rule.name for rule in self.parameters()}
        return getattr(self, name) if name in own else self.joint.parameter_value(name)

    def _bounds(self) -> tuple[SX, SX] | None:
        """The limits (nv, 1) of all coordinates; ``None`` if all are infinite."""
        lower, upper = (self._numbers(name) for name in ("lower_limit", "upper_limit"))
        return (SX(lower), SX(upper)) if np.isfinite([*lower, *upper]).any() else None

    def _numbers(self, name: str) -> NDArray[np.float64]:
        """The values (nv,) of a parameter that is not tunable."""
        value = np.asarray(self.joint.parameter_value(name), dtype=float)
        return np.broadcast_to(value, (self.place.nv,))

    def _has_springs(self) -> bool:
        """Whether the spring is in the equations; the spring of a ball joint is not tunable."""
        tunable = any(rule.name == "spring_stiffness" for rule in self.joint.inputs_of_the_run())
        return tunable or bool(np.any(self._numbers("spring_stiffness")))

    def reason_of_invalid_values(self) -> str:
        return self.unreachable

    # -- ports and states

    def output_rate(self, port: str) -> str | None:
        return None if port == "q" and self.place.nq != self.place.nv else super().output_rate(port)

    def input_ports(self) -> tuple[Port, ...]:
        return self._inputs

    @cached_property
    def _inputs(self) -> tuple[Port, ...]:
        q, qd, qdd = motion_ports(self.place, internal=True, prefix="mechanism ")
        ports = [*self.joint.input_ports(), qdd]
        if self._reads_coordinates():
            ports += [q, Port("q rates", "dq/dt", "", q.shape, internal=True)]
        if self.closed:
            ports += [qd, Port("qd rates", "rates of the speed states", "", qd.shape, internal=True)]
        return tuple(ports)

    def output_ports(self) -> tuple[Port, ...]:
        return self._outputs

    @cached_property
    def _outputs(self) -> tuple[Port, ...]:
        own = motion_ports(self.place)
        names = [port.name for port in own]
        others = [port for port in self.joint.output_ports() if port.name not in names]
        q, qd, _ = motion_ports(self.place, internal=True, prefix="state ")
        force = Port("generalised force", "on the follower", "", shape_of_speeds(self.place), internal=True)
        return (*own, *others, q, qd, force)

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        q, qd, _ = motion_ports(self.place)
        return tuple(State(port.name, port.shape or (), port.doc, port.unit) for port in (q, qd))

    def initial_states(self, p: Signals) -> Signals:
        if self.closed:
            return {"q": SX(list(self.start_q)), "qd": SX(list(self.start_qd))}
        nv, targets = self.place.nv, self.place.targets
        q, qd = SX(list(targets.q)), SX(list(targets.qd))
        if targets.position_priority != "none" and "position_target" in p:
            q = _wide(p["position_target"], self.place.nq)
        if targets.velocity_priority != "none":
            qd = _wide(p["velocity_target"], nv)
        return {"q": q, "qd": qd}

    def _reads_coordinates(self) -> bool:
        return self.closed or self.place.nq != self.place.nv

    # -- equations

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        state_q, state_qd = self.state_of(x, u)
        q = u["mechanism q"] if self._reads_coordinates() else state_q
        qd = u["mechanism qd"] if self.closed else state_qd
        actuator = self._actuator(u)
        force = actuator + self._internal_force(q, qd, p)
        values = {
            "q": q,
            "qd": qd,
            "qdd": u["mechanism qdd"],
            "actuator": actuator,
            "state q": state_q,
            "state qd": state_qd,
            "generalised force": force,
        }
        return {port.name: values[port.name] for port in self.output_ports() if port.name in values}

    def state_of(self, x: Signals, u: Signals) -> tuple[SX, SX]:
        """The coordinates (nq, 1) and speeds (nv, 1) that the mechanism reads."""
        return x["q"], x["qd"]

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        q_rates = u["q rates"] if self._reads_coordinates() else x["qd"]
        return {"q": q_rates, "qd": u["qd rates"] if self.closed else u["mechanism qdd"]}

    def _actuator(self, u: Signals) -> SX:
        """The generalised force of the actuator (nv, 1)."""
        force, given = SX.zeros(self.place.nv), u.get("tau")
        if given is not None:
            driven = [k for k, kind in enumerate(self.place.actuation) if kind == "torque"]
            for k, entry in zip(driven, [given[i] for i in range(given.numel())]):
                force[k] = entry
        return force

    def _internal_force(self, q: SX, qd: SX, p: Signals) -> SX:
        """The forces of spring, damper and limits on the coordinates (nv, 1)."""
        nv = self.place.nv
        force = -_wide(p["damping_coefficient"], nv) * qd
        displacement = self._displacements(q) if self._has_springs() or self._bounds() else qd
        if self._has_springs():
            stiffness, rest = (
                _wide(p[name], nv) if name in p else SX(self._numbers(name))
                for name in ("spring_stiffness", "equilibrium_position")
            )
            force = force - stiffness * (displacement - rest)
        bounds = self._bounds()
        if bounds is not None:
            force = force + _limit_force(
                displacement, qd, bounds, {name: _wide(p[name], nv) for name in LIMITS}
            )
        return force

    def _displacements(self, q: SX) -> SX:
        """The displacement of each speed: its coordinate, or for a ball joint the rotation vector."""
        parts: list[Scalar] = []
        first = 0
        for motion in self.place.motions:
            count = len(motion.positions)
            entries: list[Scalar] = [q[first + k] for k in range(count)]
            parts += entries if isinstance(motion, AxisMotion) else list(rotation_vector(entries))
            first += count
        return SX(vertcat(*parts))


def structure_of(block: Block) -> Value:
    """The type of a drawn block, and the values of its parameters that are not tunable."""
    rules = block.structure_of_the_run()
    return (block.type_name(), *(block.parameter_value(rule.name) for rule in rules))


def _wide(value: SX, size: int) -> SX:
    return SX(value) * SX.ones(size) if value.numel() == 1 else SX(value)


def _limit_force(q: SX, qd: SX, bounds: tuple[SX, SX], p: Mapping[str, SX]) -> SX:
    """The force of the limits: spring and damper beyond a limit, which only push back.

    Within the transition width, the force grows smoothly from 0 (cubic step of the penetration). Coordinates
    without a limit have no force.
    """
    force = SX.zeros(q.numel())
    for sign, bound in ((1.0, bounds[0]), (-1.0, bounds[1])):
        for k in range(q.numel()):
            if np.isfinite(float(bound[k])):
                depth, rate = fmax(sign * (bound[k] - q[k]), 0.0), -sign * qd[k]
                s = fmin(depth / p["transition_width"][k], 1.0)
                push = fmax(p["limit_stiffness"][k] * depth + p["limit_damping"][k] * rate, 0.0)
                force[k] = force[k] + sign * (s * s * (3.0 - 2.0 * s)) * push
    return force
