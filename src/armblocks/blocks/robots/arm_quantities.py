"""Quantities of an arm for controllers: inverses of the Jacobian, manipulability, energy, loaded torques.

Source: Siciliano et al., Robotics, 2009, 3.5 (inverses of the Jacobian).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, mtimes

from armblocks import dynamics
from armblocks.blocks.elimination import solve
from armblocks.blocks.robots.ports import apply_traced, q_port, qd_port, qdd_port, tau_port
from armblocks.blocks.robots.robot_field import RobotField
from armblocks.diagram import (
    Block,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    WorkedExample,
    driver,
    parameter,
)
from armblocks.diagram.signs import FaceSign, Words
from armblocks.errors import InputError
from armblocks.robot import Robot


@dataclass(frozen=True, kw_only=True)
class JacobianInverse(Block):
    """An inverse of a Jacobian: J^-1, J', the pseudo-inverse, or J'(J J' + damping^2 I)^-1.

    For a Jacobian of m rows and n columns:

    - ``inverse`` needs m = n and is not finite at a singular configuration.
    - ``transpose`` is J', which converts a force at the tool to joint torques.
    - ``pseudo`` gives the joint speeds of least norm (n >= m), or those with the smallest squared error of
      the velocity (n < m). It needs full rank.
    - ``damped`` (damped least squares) is finite everywhere, with an error near singular configurations.
    """

    title: ClassVar[str] = "ijacob"
    sign: ClassVar[FaceSign] = Words("J⁻¹")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=("The pseudo-inverse of the Jacobian while an arm stretches: the required joint speeds grow."),
        parameters={"method": "pseudo"},
        inputs={
            "J": driver("SubMatrix", last_row=3)
            .named("linear rows")
            .by(
                u=driver("Jacob0").by(
                    q=driver("JTraj", q0=(0.0, 1.5), qf=(0.5, 0.4), tmax=8.0).named("motion")
                )
            )
        },
        shown=("Ji",),
    )

    method: str = parameter("inverse", choices=("inverse", "transpose", "pseudo", "damped"), doc="method")
    damping: float = parameter(0.1, above=0.0, doc="damping factor of 'damped'")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("J", "the Jacobian (m, n)"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("Ji", "the chosen inverse of J (n, m)"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        shape = inputs["J"]
        if len(shape) != 2 or (self.method == "inverse" and shape[0] != shape[1]):
            raise InputError(
                f"the Jacobian has shape {shape}",
                allowed="a matrix; square for 'inverse'",
                fix="choose 'pseudo' or 'damped'",
            )
        return {"Ji": shape[::-1]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        J = u["J"]
        m, n = J.shape
        if self.method == "inverse":
            return {"Ji": solve(J, SX.eye(n))}
        if self.method == "transpose":
            return {"Ji": J.T}
        if self.method == "pseudo" and m > n:
            return {"Ji": solve(mtimes(J.T, J), J.T)}
        square = mtimes(J, J.T)
        if self.method == "damped":
            square = square + p["damping"] * p["damping"] * SX.eye(m)
        return {"Ji": solve(square, J).T}


@dataclass(frozen=True, kw_only=True)
class Manipulability(Block):
    """Yoshikawa's manipulability measure, which is 0 at a singularity: w = sqrt(det(J J')).

    J has all six rows, in m and rad per unit of the joint coordinates. For fewer than six degrees of freedom
    det(J J') is always 0, and the measure is sqrt(det(J' J)). With angular rows, this value need not be 0
    where a planar arm is straight.
    """

    title: ClassVar[str] = "manipulability"
    sign: ClassVar[FaceSign] = Words("√|J Jᵀ|")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The measure of an arm with two links falls from 1.41 to 1 while the arm stretches.",
        inputs={"q": driver("JTraj", q0=(0.0, 1.5), qf=(0.5, 0.0), tmax=8.0).named("motion")},
    )

    robot: RobotField = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot")

    def input_ports(self) -> tuple[Port, ...]:
        return (q_port(self.robot),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("w", "Yoshikawa's measure", shape=()),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"w": apply_traced(dynamics.trace_manipulability(self.robot), u["q"])}


@dataclass(frozen=True, kw_only=True)
class RobotEnergy(Block):
    """Kinetic and potential energy of an arm: T = 1/2 qd' M(q) qd, V = -sum of m g . r.

    M contains the rotor inertias. The sum is over the links, with mass m and centre of mass r in the world
    frame; g is the acceleration of gravity. V includes the energy of the robot's springs.
    """

    title: ClassVar[str] = "Energy"
    sign: ClassVar[FaceSign] = Words("E(q, qd)")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=("A double pendulum without friction: the sum of kinetic and potential energy is constant."),
        inputs={
            "q": driver("ForwardDynamics")
            .named("arm")
            .by(tau=driver("Constant", value=(0.0, 0.0)).named("no torque"))
            .at("q"),
            "qd": driver("ForwardDynamics")
            .named("arm")
            .by(tau=driver("Constant", value=(0.0, 0.0)).named("no torque"))
            .at("qd"),
        },
        shown=("kinetic", "potential", driver("Sum").named("sum").by(u1="kinetic", u2="potential")),
        stop_time=5.0,
    )

    robot: RobotField = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot")

    def input_ports(self) -> tuple[Port, ...]:
        return q_port(self.robot), qd_port(self.robot)

    def output_ports(self) -> tuple[Port, ...]:
        return (
            Port("kinetic", "kinetic energy", "J", ()),
            Port("potential", "potential energy, 0 at the world's origin", "J", ()),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {
            "kinetic": apply_traced(dynamics.trace_kinetic_energy(self.robot), u["q"], u["qd"]),
            "potential": apply_traced(dynamics.trace_potential_energy(self.robot), u["q"]),
        }


@dataclass(frozen=True, kw_only=True)
class LoadedRne(Block):
    """Inverse dynamics with a force at the tip and a payload: tau = rne(q, qd, qdd) + load torque.

    ``wrench`` is the force (N) and the moment (N m) of the tip on the environment, in the axes of the last
    link. The payload is mass (kg), centre of mass x y z (m) and inertia xx yy zz xy yz xz (kg m^2) about this
    centre, in the tool frame.
    """

    title: ClassVar[str] = "rne with load"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The torques of a motion with 2 kg at the tool.",
        inputs={
            "wrench": driver("Constant", value=(0.0,) * 6).named("no force"),
            "payload": driver("Constant", value=(2.0,) + (0.0,) * 9).named("2 kg"),
        },
        shown=("q", "tau"),
    )

    robot: RobotField = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot")

    def input_ports(self) -> tuple[Port, ...]:
        motion = (q_port(self.robot), qd_port(self.robot), qdd_port(self.robot))
        wrench = Port("wrench", "force (N) and moment (N m) on the environment", shape=(6,))
        return *motion, wrench, Port("payload", "mass (kg), centre (m), inertia (kg m^2)", shape=(10,))

    def output_ports(self) -> tuple[Port, ...]:
        return (tau_port(self.robot, "torque or force at the joints"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"tau": apply_traced(dynamics.trace_rne_loaded(self.robot), *u.values())}
