"""The arm with joints whose motion is given.

The equations are in :mod:`armblocks.dynamics.prescribed_motion`, which names the sources.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import ClassVar

from casadi import SX, vertcat
from numpy.typing import ArrayLike

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
from armblocks.diagram import (
    Block,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    driver,
    parameter,
)
from armblocks.dynamics.ball_joints import motion_of_rates
from armblocks.dynamics.constrained import ConstrainedMotion, restoring_rates
from armblocks.dynamics.joint_entries import JointEntries, entries_of
from armblocks.dynamics.joint_motion import entries
from armblocks.dynamics.prescribed_motion import (
    DrivenMotion,
    check_drives,
    driven_motion,
    with_prescribed_joints,
)
from armblocks.errors import UnknownNameError
from armblocks.robot import Robot


@dataclass(frozen=True, kw_only=True)
class DrivenArm(Block):
    """Base class of the arms with prescribed motions; subclasses define the state."""

    output_rates: ClassVar[Mapping[str, str]] = {"q": "qd", "qd": "qdd"}
    card_size: ClassVar[tuple[float, float]] = (84.0, 64.0)

    robot: RobotField = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot")
    joints: str = parameter(
        "",
        doc="joints whose motions are prescribed, separated by commas; empty: joints of the robot's "
        "description, or all joints",
    )
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
    payload_input: bool = parameter(False, doc="whether the block has an input for the payload")
    wrench_input: bool = parameter(False, doc="whether the block has an input for a force at the tip")

    def check(self) -> None:
        check_start(self, self.robot, "q0")
        check_joint_values(self, self.robot, "qd0")
        check_consistent_start(self, self.robot, "q0", "qd0")
        near = start_numbers(self, self.robot, "q0")
        check_drives(self._driven(), near, with_payload=self.payload_input)

    def output_rate(self, port: str) -> str | None:
        return None if port == "q" and self.robot.nq != self.robot.nv else super().output_rate(port)

    @abstractmethod
    def motion_port(self, robot: Robot) -> Port:
        """The input for the motion of the prescribed joints of a robot."""

    def input_ports(self) -> tuple[Port, ...]:
        ports = [self.motion_port(self._driven())]
        free = self._free().speeds
        if free:
            ports.append(_part(tau_port(self.robot, "torque or force at the other joints"), free))
        if self.wrench_input:
            ports.append(Port("wrench", "force (N) and moment (N m) on the environment", shape=(6,)))
        if self.payload_input:
            ports.append(Port("payload", "mass (kg), centre (m), inertia (kg m^2)", shape=(10,)))
        return tuple(ports)

    def output_ports(self) -> tuple[Port, ...]:
        torque = tau_port(self.robot, "torque or force of the drives of the prescribed joints")
        return (
            q_port(self.robot),
            qd_port(self.robot),
            qdd_port(self.robot),
            replace(_part(torque, self._prescribed().speeds), name="drive"),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        motion = self._motion(x, u)
        return {
            "q": normalised_coordinates(self.robot, motion.q),
            "qd": motion.qd,
            "qdd": motion.qdd,
            "drive": motion.tau[self._prescribed().speeds],
        }

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        motion, (q, qd, _) = self._motion(x, u), self.state_of(x, u)
        if self.robot.closures:
            constrained = ConstrainedMotion(motion.q, motion.qd, motion.qdd, SX(0, 1))
            rates, accelerations = restoring_rates(self.robot, q, qd, constrained)
        else:
            rates, accelerations = coordinate_rates(self.robot, q, qd), motion.qdd
        integrated = self._integrated()
        values = {"q": rates[integrated.positions], "qd": accelerations[integrated.speeds]}
        return {state.name: values[state.name] for state in self.states({})}

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        integrated = self._integrated()
        q, qd = q_port(self.robot), qd_port(self.robot)
        states = (
            State("q", (len(integrated.positions),), q.doc, q.unit),
            State("qd", (len(integrated.speeds),), qd.doc, qd.unit),
        )
        return states if integrated.speeds else ()

    def initial_states(self, p: Signals) -> Signals:
        integrated = self._integrated()
        speeds = SX(p["qd0"]) * SX.ones(self.robot.n)
        values = {
            "q": (start_coordinates(self.robot, p["q0"]) * SX.ones(self.robot.nq))[integrated.positions],
            "qd": speeds[integrated.speeds],
        }
        return {state.name: values[state.name] for state in self.states({})}

    @abstractmethod
    def state_of(self, x: Signals, u: Signals) -> tuple[SX, SX, SX]:
        """``q`` (nq,), ``qd`` (n,) of all joints, and ``qdd`` (n,) of the prescribed joints."""

    @abstractmethod
    def _integrated(self) -> JointEntries:
        """The entries of q and qd that are states."""

    def _motion(self, x: Signals, u: Signals) -> DrivenMotion:
        q, qd, qdd = self.state_of(x, u)
        tau = SX.zeros(self.robot.n)
        if "tau" in u:
            tau[self._free().speeds] = u["tau"]
        near = start_numbers(self, self.robot, "q0") if self.robot.closures else None
        wrench, payload = u.get("wrench"), u.get("payload")
        return driven_motion(self._driven(), q, qd, tau, qdd, near=near, wrench=wrench, payload=payload)

    def _driven(self) -> Robot:
        """The robot with the prescribed motions of this block."""
        return _with_prescribed(self.robot, self.joints, self.type_name())

    def _prescribed(self) -> JointEntries:
        return entries_of(self.robot, self._driven().prescribed_joints)

    def _free(self) -> JointEntries:
        return entries_of(self.robot, self._driven().prescribed_joints, others=True)


@dataclass(frozen=True, kw_only=True)
class AccelerationDrivenArm(DrivenArm):
    """The robot with joints whose accelerations are given: motion of all joints, torques of the drives.

    - The prescribed joints have exactly the accelerations of the input ``motion``.
    - The other joints move under the torques ``tau``.
    - The output ``drive`` has the torques (N m or N) at the prescribed joints that cause this motion, with
      rotor inertia and friction. They are not limited.

    The prescribed joints are those named in ``joints``. If ``joints`` is empty, they are the joints of the
    constraints ``PrescribedMotion`` of the robot, or all joints if it has none. Joints of all types can be
    prescribed, such as the six degrees of freedom of a moving base.

    The robot may have couplings and closed loops; the start must satisfy them (``arm.assemble``). Use
    PositionDrivenArm for given positions.
    """

    title: ClassVar[str] = "Acceleration-Driven Arm"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The first joint of a double pendulum is shaken; the second joint swings freely.",
        parameters={"joints": "link1", "q0": (0.0, 0.0)},
        inputs={
            "motion": driver("SineWave", amplitude=(4.0,), frequency=3.0),
            "tau": driver("Constant", value=(0.0,)).named("no torque"),
        },
        shown=("q", "drive"),
    )

    def motion_port(self, robot: Robot) -> Port:
        port = _part(qdd_port(robot), entries_of(robot, robot.prescribed_joints).speeds)
        return replace(port, name="motion", doc="accelerations of the prescribed joints")

    def state_of(self, x: Signals, u: Signals) -> tuple[SX, SX, SX]:
        qdd = SX.zeros(self.robot.n)
        qdd[self._prescribed().speeds] = u["motion"]
        return x["q"], x["qd"], qdd

    def _integrated(self) -> JointEntries:
        return entries_of(self.robot, self.robot.joint_names)


@dataclass(frozen=True, kw_only=True)
class PositionDrivenArm(DrivenArm):
    """The robot with joints whose positions are given: motion of all joints, torques of the drives.

    - The prescribed joints have exactly the coordinates of the input ``motion``. Their speeds and
      accelerations are the exact first and second derivatives of this input.
    - The other joints move under the torques ``tau``, from ``q0`` and ``qd0``.
    - The output ``drive`` has the torques (N m or N) at the prescribed joints that cause this motion, with
      rotor inertia and friction. They are not limited.

    The input must be smooth. If its value or its rate jumps, the impulse of the drive is not modelled. An
    input that is held between samples has the rate 0. A quaternion in the input may have any length.

    In closed loops ``q0`` must satisfy the constraints, and the input must start at the values of ``q0`` of
    the prescribed joints. Where the loops cannot reach a position, the coordinates are NaN and the run ends
    with an error. ``arm.assemble(q, locked=joints)`` names the constraint and the gap.

    AccelerationDrivenArm describes which joints are prescribed.
    """

    title: ClassVar[str] = "Position-Driven Arm"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The first joint of a double pendulum follows a sine; the second joint swings freely.",
        parameters={"joints": "link1"},
        inputs={
            "motion": driver("SineWave", amplitude=(0.5,), frequency=3.0),
            "tau": driver("Constant", value=(0.0,)).named("no torque"),
        },
        shown=("q", "drive"),
    )
    differentiated_inputs: ClassVar[tuple[str, ...]] = ("motion", "motion'")

    def motion_port(self, robot: Robot) -> Port:
        port = _part(q_port(robot), entries_of(robot, robot.prescribed_joints).positions)
        return replace(port, name="motion", doc="coordinates of the prescribed joints")

    def state_of(self, x: Signals, u: Signals) -> tuple[SX, SX, SX]:
        robot, prescribed, free = self.robot, self._prescribed(), self._free()
        q, rates, second_rates = SX(robot.neutral), SX.zeros(robot.nq), SX.zeros(robot.nq)
        q[prescribed.positions] = u["motion"]
        rates[prescribed.positions] = u["motion'"]
        second_rates[prescribed.positions] = u["motion''"]
        speeds, accelerations = motion_of_rates(robot, entries(q), entries(rates), entries(second_rates))
        qd, qdd = SX(vertcat(*speeds)), SX(vertcat(*accelerations))
        if free.speeds:
            q[free.positions], qd[free.speeds] = x["q"], x["qd"]
        return q, qd, qdd

    def _integrated(self) -> JointEntries:
        return self._free()


@lru_cache(maxsize=64)
def _with_prescribed(robot: Robot, joints: str, block: str) -> Robot:
    """The robot with prescribed motions of the joints named in a text, or else of its description."""
    names = [name.strip() for name in joints.split(",") if name.strip()]
    if not names:
        names = list(robot.prescribed_joints or robot.joint_names)
    links = [link.name for link in robot.links]
    for name in names:
        if name not in links:
            raise UnknownNameError("joint", name, robot.joint_names, where=f"{block}.joints")
    return with_prescribed_joints(robot, names)


def _part(port: Port, indices: list[int]) -> Port:
    """A port of some entries of a vector."""
    return replace(port, shape=(len(indices),), names=tuple(port.names[k] for k in indices))
