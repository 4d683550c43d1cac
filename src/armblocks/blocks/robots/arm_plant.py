"""The arm with stick-slip friction, end stops, a variable payload and a force at the tip.

The equations are in :mod:`armblocks.dynamics.lockable_joints`, which names the sources. The file is long,
because the guards, modes and resets of friction and stops depend on each other.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from casadi import SX, dot, fmax, fmin, if_else, logic_and, logic_not, logic_or, vertcat
from numpy.typing import ArrayLike, NDArray

from armblocks.blocks.robots.ports import (
    check_consistent_start,
    check_joint_values,
    check_start,
    coordinate_rates,
    normalised_coordinates,
    q_port,
    qd_port,
    qdd_port,
    start_coordinates,
    start_numbers,
    tau_port,
)
from armblocks.blocks.robots.robot_field import RobotField
from armblocks.blocks.switching import THRESHOLD_OFFSET
from armblocks.diagram import (
    Block,
    Guard,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    driver,
    parameter,
)
from armblocks.dynamics.constrained import ConstrainedMotion, restoring_rates
from armblocks.dynamics.lockable_joints import (
    DryFriction,
    JointEquations,
    JointModes,
    equations_at,
    locked_joints,
    viscous_torque,
)
from armblocks.dynamics.lockable_mechanism import MechanismEquations, check_lockable, consistent_state
from armblocks.errors import InputError
from armblocks.robot import Robot


@dataclass(frozen=True, kw_only=True)
class ArmPlant(Block):
    """The robot with stick-slip friction: M(q) q'' + C q' + g + friction = tau + stops - J' wrench.

    The robot's friction model determines the friction of the motors. A joint at rest sticks, with zero
    acceleration, while the torque that holds it is within ``breakaway`` times its Coulomb friction. Beyond
    this torque it slides. The holding torque includes the coupling with the other joints. The block Robot
    (ForwardDynamics) has no sticking, and its joints creep instead.

    ``stops`` selects the end stops at the robot's joint limits:

    - ``none``: the joints have no end stops.
    - ``elastic``: beyond a limit the stop exerts the torque stiffness (limit - q) - damping qd, but only in
      the direction away from the stop.
    - ``hard``: the joint stops at once in a plastic impact, whose impulse also acts on the other joints. It
      stays exactly at the limit until a torque moves it away. Joints that rest at their stops before the
      impact stay there.

    The robot may have coupled joints and closed loops; the start must satisfy them (``arm.assemble``). In a
    mechanism with loops, only joints that determine the others can have Coulomb friction or hard stops.

    Optional inputs:

    - ``payload``: mass (kg), centre x y z (m) and inertia xx yy zz xy yz xz (kg m^2) about this centre, in
      the tool frame. If the payload jumps, the joint speeds do not change: a payload is picked up and
      released at the speed of the tool.
    - ``wrench``: force (N), then moment (N m), of the tip on the environment, in the axes of the last link.
    """

    title: ClassVar[str] = "Arm Plant"
    card_size: ClassVar[tuple[float, float]] = (84.0, 64.0)
    output_rates: ClassVar[Mapping[str, str]] = {"q": "qd", "qd": "qdd"}
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The Puma falls onto the end stop of its shoulder and comes to rest by motor friction.",
        parameters={"robot": "puma560", "q0": (0.0, 0.5, 0.0, 0.0, 0.0, 0.0), "stops": "hard"},
        inputs={"tau": driver("Constant", value=(0.0,) * 6)},
        shown=("q", "qd", "friction"),
    )

    robot: RobotField = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot")
    q0: ArrayLike = parameter(
        0.0,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        doc="joint coordinates at t = 0 (nq,), or one number for all",
        unit="rad",
    )
    qd0: ArrayLike = parameter(
        0.0,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        doc="joint speeds at t = 0 (n,), or one number for all",
        unit="rad/s",
    )
    breakaway: ArrayLike = parameter(
        1.0,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        doc="ratio of static to sliding friction (n,), or one number for all",
        minimum=1.0,
    )
    stops: str = parameter("none", choices=("none", "elastic", "hard"), doc="end stops at the joint limits")
    stiffness: ArrayLike = parameter(
        1e5,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        doc="stiffness of elastic stops (n,), or one number for all",
        unit="N m/rad",
        minimum=0.0,
    )
    damping: ArrayLike = parameter(
        1e3,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        doc="damping of elastic stops (n,), or one number for all",
        unit="N m s/rad",
        minimum=0.0,
    )
    payload_input: bool = parameter(False, doc="whether the block has an input for the payload")
    wrench_input: bool = parameter(False, doc="whether the block has an input for a force at the tip")

    def check(self) -> None:
        check_start(self, self.robot, "q0")
        for name in ("qd0", "breakaway", "stiffness", "damping"):
            check_joint_values(self, self.robot, name)
        check_consistent_start(self, self.robot, "q0", "qd0")
        check_lockable(self.robot, self._lockable_joints(), self._near(), "ArmPlant")
        friction = DryFriction.of(self.robot)
        starts = self.robot.neutral + np.asarray(self.q0) if np.ndim(self.q0) == 0 else np.asarray(self.q0)
        for k, (name, _) in enumerate(self.robot.speeds):
            if friction.forward[k] < 0.0 or friction.backward[k] > 0.0:
                raise InputError(
                    f"the Coulomb friction of joint '{name}' has the direction of the motion",
                    where="ArmPlant",
                    allowed="friction opposite to the motion: forwards >= 0 >= backwards",
                    fix="correct the robot's Coulomb friction, or choose the friction model squared-gear",
                )
            (low, high), index = self._ranges()[k], self.robot.position_of_speed[k]
            q0 = 0.0 if index is None else starts[index]
            if self.stops == "hard" and not low <= q0 <= high:
                raise InputError(
                    f"joint '{name}' starts at {q0:g}, beyond its stop",
                    where="ArmPlant.q0",
                    allowed=f"{low:g} … {high:g}",
                    fix="start within the limits, or choose elastic stops",
                )

    def output_rate(self, port: str) -> str | None:
        return None if port == "q" and self.robot.nq != self.robot.nv else super().output_rate(port)

    # -- ports, states, modes and guards

    def input_ports(self) -> tuple[Port, ...]:
        ports = [tau_port(self.robot, "torque or force at the joints")]
        if self.wrench_input:
            ports.append(Port("wrench", "force (N) and moment (N m) on the environment", shape=(6,)))
        if self.payload_input:
            ports.append(Port("payload", "mass (kg), centre (m), inertia (kg m^2)", shape=(10,)))
        return tuple(ports)

    def output_ports(self) -> tuple[Port, ...]:
        unit = tau_port(self.robot, "").unit
        return (
            q_port(self.robot),
            qd_port(self.robot),
            qdd_port(self.robot),
            Port("friction", "friction torque or force opposite to the motion", unit, (self.robot.n,)),
            Port("stop", "torque or force of the end stops", unit, (self.robot.n,)),
        )

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        q, qd = q_port(self.robot), qd_port(self.robot)
        return tuple(State(port.name, (len(port.names),), port.doc, port.unit) for port in (q, qd))

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        shape = (self.robot.n,)
        states: list[State] = []
        if self._lockable_joints():
            states.append(
                State("mode", shape, "1 sliding forwards or free, -1 sliding backwards, 0 sticking")
            )
        if self._lower_stop_joints() or self._upper_stop_joints():
            states.append(State("contact", shape, "1 at the upper stop, -1 at the lower stop, else 0"))
        return tuple(states)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        elastic = self.stops == "elastic"
        declared = (
            ("rest", self._friction_joints(), "a sliding joint comes to rest", -1),
            ("forwards", self._lockable_joints(), "a sticking joint breaks away forwards", 1),
            ("backwards", self._lockable_joints(), "a sticking joint breaks away backwards", -1),
            ("upper", self._upper_stop_joints(), "a joint reaches its upper stop", 0 if elastic else 1),
            ("lower", self._lower_stop_joints(), "a joint reaches its lower stop", 0 if elastic else -1),
        )
        return tuple(
            Guard(name, (len(joints),), doc, direction) for name, joints, doc, direction in declared if joints
        )

    # -- equations

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        x = self._consistent(x)
        qdd, holding_torque = self._motion(x, u, p)
        mode, contact = self._mode(x), self._rigid(self._contact(x))
        dry = DryFriction.of(self.robot)
        forward, backward = (p["breakaway"] * SX(side) for side in (dry.forward, dry.backward))
        holding = fmin(fmax(holding_torque, backward), forward)
        friction = if_else(mode == 0.0, holding, dry.sliding(mode))
        rigid = if_else(logic_and(mode == 0.0, contact != 0.0), holding - holding_torque, 0.0)
        return {
            "q": normalised_coordinates(self.robot, x["q"]),
            "qd": x["qd"],
            "qdd": qdd,
            "friction": friction + viscous_torque(self.robot, x["qd"]),
            "stop": rigid + self._elastic_stops(x, p),
        }

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        near = self._consistent(x)
        qdd, _ = self._motion(near, u, p)
        if self.robot.closures:
            motion = ConstrainedMotion(near["q"], near["qd"], qdd, SX(0, 1))
            q_rates, qd_rates = restoring_rates(self.robot, x["q"], x["qd"], motion)
            return {"q": q_rates, "qd": qd_rates}
        return {"q": coordinate_rates(self.robot, x["q"], x["qd"]), "qd": qdd}

    def initial_states(self, p: Signals) -> Signals:
        return {"q": start_coordinates(self.robot, p["q0"]), "qd": p["qd0"]}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        x = self._consistent(x)
        mode, contact, q, qd = self._mode(x), self._contact(x), self._axis_positions(x), x["qd"]
        values: dict[str, SX] = {"rest": if_else(mode == 0.0, 1.0, mode * qd)}
        if self._lockable_joints():
            _, holding_torque = self._motion(x, u, p)
            dry = DryFriction.of(self.robot)
            forward, backward = (p["breakaway"] * SX(side) for side in (dry.forward, dry.backward))
            locked, rigid = mode == 0.0, self._rigid(contact)
            free_forwards, free_backwards = logic_and(locked, rigid <= 0.0), logic_and(locked, rigid >= 0.0)
            values["forwards"] = if_else(free_forwards, holding_torque - forward - THRESHOLD_OFFSET, -1.0)
            values["backwards"] = if_else(free_backwards, holding_torque - backward + THRESHOLD_OFFSET, 1.0)
        beyond_upper, beyond_lower = q - self._limits(1), q - self._limits(0)
        if self.stops == "elastic":
            damping_torque = p["damping"] * qd
            values["upper"] = (
                fmin(beyond_upper, p["stiffness"] * beyond_upper + damping_torque) - THRESHOLD_OFFSET
            )
            values["lower"] = (
                fmax(beyond_lower, p["stiffness"] * beyond_lower + damping_torque) + THRESHOLD_OFFSET
            )
        else:
            values["upper"] = if_else(contact > 0.0, -1.0, beyond_upper - THRESHOLD_OFFSET)
            values["lower"] = if_else(contact < 0.0, 1.0, beyond_lower + THRESHOLD_OFFSET)
        names = [guard.name for guard in self.guards({})]
        return {name: values[name][list(self._joints_of(name))] for name in names}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        x = self._consistent(x)
        q, qd = self._axis_positions(x), x["qd"]
        if self.stops == "hard":
            resting = qd == 0.0
            upper, lower = self._joint_mask("upper"), self._joint_mask("lower")
            at_upper = logic_and(logic_and(upper, q >= self._limits(1)), resting)
            at_lower = logic_and(logic_and(lower, q <= self._limits(0)), resting)
            contact = at_upper - at_lower
            guess = JointModes(if_else(contact != 0.0, 0.0, self._mode(x)), contact)
        else:
            contact = self._elastic_contact(q, qd, p)
            guess = JointModes(self._mode(x), self._rigid(contact))
        rest = (
            self._consistent_rest({**x, "contact": contact}, u, p, guess)
            if self._lockable_joints()
            else guess
        )
        values = {"mode": rest.mode, "contact": rest.contact if self.stops == "hard" else contact}
        return {state.name: values[state.name] for state in self.modes({})}

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        # Modes change by the guards; the consistent modes are the solution of a complementarity problem.
        inconsistent = dict[str, SX]()
        x = self._consistent(x)
        guards = self.guard_values(t, x, u, p)
        if self._lockable_joints():
            reversed_joints = (
                self._on_all_joints("rest", guards) < 0.0 if "rest" in guards else SX.zeros(self.robot.n)
            )
            started = logic_or(
                self._on_all_joints("forwards", guards) > 0.0, self._on_all_joints("backwards", guards) < 0.0
            )
            inconsistent["mode"] = logic_or(reversed_joints, started)
        if self._lower_stop_joints() or self._upper_stop_joints():
            contact = (
                self._elastic_contact(self._axis_positions(x), x["qd"], p)
                if self.stops == "elastic"
                else x["contact"]
            )
            inconsistent["contact"] = contact != x["contact"]
        return inconsistent

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        if not e:
            return {}
        before, x = x, self._consistent(x)
        fired = {
            name: self._on_all_joints(name, e) for name in ("rest", "forwards", "backwards", "upper", "lower")
        }
        contact, mode, q, qd = self._contact(x), self._mode(x), x["q"], x["qd"]
        hits_upper, hits_lower = fired["upper"] > 0.0, fired["lower"] < 0.0
        contact = if_else(hits_upper, 1.0, if_else(hits_lower, -1.0, contact))
        if self.stops == "elastic":
            released = logic_or(fired["upper"] < 0.0, fired["lower"] > 0.0)
            contact = if_else(released, 0.0, contact)
        if not self._lockable_joints():
            return {"contact": contact}
        stopping = fired["rest"] < 0.0
        qd = if_else(stopping, 0.0, qd)
        if self.stops == "hard":
            impact = logic_or(hits_upper, hits_lower)
            resting = logic_or(impact, contact != 0.0)
            after = self._equations({"q": q, "qd": qd}, u).speeds_after_impact(qd, resting)
            qd = if_else(dot(impact, impact) > 0.0, after, qd)
            at_stop = if_else(hits_upper, self._limits(1), self._limits(0))
            q = self._with_axis_positions(q, impact, at_stop)
            stopping = logic_or(stopping, impact)
        start_direction = (fired["forwards"] > 0.0) - (fired["backwards"] < 0.0)
        guess = if_else(stopping, 0.0, if_else(start_direction != 0.0, start_direction, mode))
        after_impact = {**x, "q": q, "qd": qd, "contact": contact}
        rest = self._consistent_rest(
            after_impact, u, p, JointModes(guess, if_else(guess == 0.0, self._rigid(contact), 0.0))
        )
        values = {"q": q, "qd": qd, "mode": rest.mode}
        if self._lower_stop_joints() or self._upper_stop_joints():
            values["contact"] = rest.contact if self.stops == "hard" else contact
        any_event = dot(vertcat(*e.values()), vertcat(*e.values())) > 0.0
        after = {name: if_else(any_event, value, before[name]) for name, value in values.items()}
        # At rest the speed is 0 for all parameter values, so its derivatives with respect to parameters are 0
        # too.
        rests = logic_and(rest.mode == 0.0, x["qd"] == 0.0)
        return {**after, "qd": if_else(logic_and(rests, logic_not(any_event)), 0.0, after["qd"])}

    # -- joints with friction or stops, and the parts of the equations

    def _friction_joints(self) -> tuple[int, ...]:
        return DryFriction.of(self.robot).joints

    def _upper_stop_joints(self) -> tuple[int, ...]:
        return tuple(np.flatnonzero(np.isfinite(self._ranges()[:, 1])).tolist()) if self._has_stops() else ()

    def _lower_stop_joints(self) -> tuple[int, ...]:
        return tuple(np.flatnonzero(np.isfinite(self._ranges()[:, 0])).tolist()) if self._has_stops() else ()

    def _ranges(self) -> NDArray[np.float64]:
        """The position limits that belong to each entry of qd (n, 2); infinite without a limit."""
        ranges = [limits.position or (-np.inf, np.inf) for limits in self.robot.limits]
        return np.array(ranges).reshape(-1, 2)

    def _axis_positions(self, x: Signals) -> SX:
        """The coordinates whose rates are the entries of qd (n,); 0 for ball joints, which have no stops."""
        q, indices = x["q"], self.robot.position_of_speed
        if self.robot.nq == self.robot.nv:
            return q
        return SX(vertcat(*(SX(0.0) if index is None else q[index] for index in indices)))

    def _with_axis_positions(self, q: SX, changed: SX, values: SX) -> SX:
        """The coordinates with some of :meth:`_axis_positions` replaced by ``values``."""
        if self.robot.nq == self.robot.nv:
            return if_else(changed, values, q)
        result = SX(q)
        for k, index in enumerate(self.robot.position_of_speed):
            if index is not None:
                result[index] = if_else(changed[k], values[k], q[index])
        return result

    def _has_stops(self) -> bool:
        return self.stops != "none"

    def _lockable_joints(self) -> tuple[int, ...]:
        """The joints that can be locked by friction or by a rigid stop."""
        stops = (*self._upper_stop_joints(), *self._lower_stop_joints()) if self.stops == "hard" else ()
        return tuple(sorted({*self._friction_joints(), *stops}))

    def _joints_of(self, guard: str) -> tuple[int, ...]:
        sets = {
            "rest": self._friction_joints,
            "upper": self._upper_stop_joints,
            "lower": self._lower_stop_joints,
        }
        return sets.get(guard, self._lockable_joints)()

    def _joint_mask(self, guard: str) -> SX:
        """The mask (n,): 1 for joints that have the guard, else 0."""
        marks = np.zeros(self.robot.n)
        marks[list(self._joints_of(guard))] = 1.0
        return SX(marks)

    def _on_all_joints(self, guard: str, e: Signals) -> SX:
        """The fired directions of a guard as (n,); 0 for joints without the guard."""
        marks = SX.zeros(self.robot.n)
        if guard in e:
            marks[list(self._joints_of(guard))] = e[guard]
        return marks

    def _limits(self, side: int) -> SX:
        """Lower (0) or upper (1) limits (n,); 0 for joints without a limit."""
        limits = self._ranges()[:, side]
        return SX(np.where(np.isfinite(limits), limits, 0.0))

    def _mode(self, x: Signals) -> SX:
        """The friction modes (n,); 1 if no joint can be locked.

        In closed loops the other joints are free from the start on: with all joints locked the equations of
        the loops have no solution.
        """
        lockable = self._lockable_joints()
        if not lockable:
            return SX.ones(self.robot.n)
        if self.robot.closures:
            mode = SX.ones(self.robot.n)
            mode[list(lockable)] = x["mode"][list(lockable)]
            return mode
        return x["mode"]

    def _contact(self, x: Signals) -> SX:
        """The contacts with the end stops (n,); 0 if there are no stops."""
        return (
            x["contact"] if self._lower_stop_joints() or self._upper_stop_joints() else SX.zeros(self.robot.n)
        )

    def _rigid(self, contact: SX) -> SX:
        """The contacts with hard stops (n,); 0 for elastic stops."""
        return contact if self.stops == "hard" else SX.zeros(self.robot.n)

    def _elastic_stops(self, x: Signals, p: Signals) -> SX:
        if self.stops != "elastic":
            return SX.zeros(self.robot.n)
        contact = self._contact(x)
        limit = if_else(contact > 0.0, self._limits(1), self._limits(0))
        push = p["stiffness"] * (limit - self._axis_positions(x)) - p["damping"] * x["qd"]
        return if_else(contact != 0.0, push, 0.0)

    def _elastic_contact(self, q: SX, qd: SX, p: Signals) -> SX:
        beyond_upper, beyond_lower, damping_torque = (
            q - self._limits(1),
            q - self._limits(0),
            p["damping"] * qd,
        )
        above = logic_and(
            self._joint_mask("upper"),
            fmin(beyond_upper, p["stiffness"] * beyond_upper + damping_torque) > 0.0,
        )
        below = logic_and(
            self._joint_mask("lower"),
            fmax(beyond_lower, p["stiffness"] * beyond_lower + damping_torque) < 0.0,
        )
        return above - below

    def _driving_torque(self, x: Signals, u: Signals, p: Signals) -> SX:
        """The joint torque without Coulomb friction and hard stops."""
        return u["tau"] - viscous_torque(self.robot, x["qd"]) + self._elastic_stops(x, p)

    def _near(self) -> NDArray[np.float64] | None:
        return start_numbers(self, self.robot, "q0") if self.robot.closures else None

    def _consistent(self, x: Signals) -> Signals:
        """The state that satisfies the closures of the robot; locked joints keep their values."""
        if not self.robot.closures:
            return x
        q, qd = consistent_state(self.robot, x["q"], x["qd"], self._free(self._mode(x)), self._near())
        return {**x, "q": q, "qd": qd}

    def _equations(self, x: Signals, u: Signals) -> JointEquations | MechanismEquations:
        wrench, payload = u.get("wrench"), u.get("payload")
        return equations_at(self.robot, x["q"], x["qd"], wrench, payload, self._near())

    def _free(self, mode: SX) -> SX:
        """The mask (n,) of joints that are not locked."""
        return mode != 0.0 if self._lockable_joints() else SX.ones(self.robot.n)

    def _motion(self, x: Signals, u: Signals, p: Signals) -> tuple[SX, SX]:
        """The accelerations, and the torques that hold the locked joints."""
        mode = self._mode(x)
        torque = self._driving_torque(x, u, p) - DryFriction.of(self.robot).sliding(mode)
        return self._equations(x, u).motion(torque, self._free(mode))

    def _consistent_rest(self, x: Signals, u: Signals, p: Signals, guess: JointModes) -> JointModes:
        """The consistent modes and contacts of the joints at rest; the search begins at ``guess``."""
        equations = self._equations(x, u)
        breakaway = p["breakaway"] * SX.ones(self.robot.n)
        driving = self._driving_torque(x, u, p)
        return locked_joints(equations, x["qd"], driving, guess, DryFriction.of(self.robot), breakaway)
