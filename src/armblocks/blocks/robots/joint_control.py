"""Joint controllers.

Sources: Siciliano et al., Robotics, 2009, 8.3 (feed-forward), 8.5.1 (PD with gravity compensation), 8.5.2
(inverse dynamics).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX
from numpy.typing import ArrayLike

from armblocks import dynamics
from armblocks.blocks.robots.loop_control import (
    REFERENCE_STEPS,
    at_motors,
    check_controlled,
    motor_torques,
    position_errors,
)
from armblocks.blocks.robots.ports import (
    apply_traced,
    check_speeds_are_rates,
    q_port,
    qd_port,
    reference_ports,
    tau_port,
)
from armblocks.blocks.robots.robot_field import RobotField
from armblocks.diagram import (
    Block,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    WorkedExample,
    broadcast,
    driver,
    parameter,
    shape_of,
)
from armblocks.errors import InputError
from armblocks.robot import Robot


def _check_gains(block: Block, robot: Robot) -> None:
    if robot.closures:
        check_controlled(robot, block.type_name())
    else:
        check_speeds_are_rates(block, robot)
    for name in ("Kp", "Kd"):
        shape = shape_of(block.parameter_value(name))
        if shape not in ((), (robot.n,)):
            raise InputError(
                f"{name} has {shape[0]} gains",
                where=block.type_name(),
                allowed=f"{robot.n}, one for each joint of '{robot.name}', or one number for all",
                fix=f"correct {name}",
            )


@dataclass(frozen=True, kw_only=True)
class JointPD(Block):
    """A PD controller of joints: tau = Kp (qr - q) + Kd (qdr - qd), independently for each joint."""

    title: ClassVar[str] = "PD Joint Controller"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A PD controller alone: the arm follows with a constant error due to gravity.",
        parameters={"Kp": 200.0, "Kd": 40.0},
        inputs={
            "qr": driver("JTraj", q0=(0.0, 0.0), qf=(1.0, -1.5), tmax=3.0).named("motion").at("q"),
            "qdr": driver("JTraj", q0=(0.0, 0.0), qf=(1.0, -1.5), tmax=3.0).named("motion").at("qd"),
            "q": driver("ForwardDynamics").named("arm").by(tau="tau").at("q"),
            "qd": driver("ForwardDynamics").named("arm").by(tau="tau").at("qd"),
        },
        shown=("q", driver("Sum", signs="+-").named("error").by(u1="qr", u2="q")),
        stop_time=5.0,
    )

    Kp: ArrayLike = parameter(
        100.0,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        doc="position gains, N m/rad (N/m for a prismatic joint)",
    )
    Kd: ArrayLike = parameter(
        20.0,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        doc="speed gains, N m s/rad (N s/m for a prismatic joint)",
    )

    def check(self) -> None:
        broadcast({"Kp": shape_of(self.Kp), "Kd": shape_of(self.Kd)})

    def input_ports(self) -> tuple[Port, ...]:
        return (
            Port("qr", "desired coordinates"),
            Port("qdr", "desired speeds"),
            Port("q", "coordinates"),
            Port("qd", "speeds"),
        )

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("tau", "torque or force at the joints"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"tau": broadcast({**inputs, "Kp": shape_of(self.Kp), "Kd": shape_of(self.Kd)})}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"tau": p["Kp"] * (u["qr"] - u["q"]) + p["Kd"] * (u["qdr"] - u["qd"])}


@dataclass(frozen=True, kw_only=True)
class GravityCompensation(Block):
    """PD with gravity compensation: tau = g(q) + Kp (qr - q) - Kd qd, whose only equilibrium is qr.

    This holds for a model equal to the robot and without Coulomb friction, which can stop a joint before qr.
    In robots with closed loops only the joints with a motor are controlled, and only they have torques.
    """

    title: ClassVar[str] = "PD with Gravity Compensation"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="From rest to a desired posture: gravity is compensated, so that no error remains.",
        inputs={
            "qr": driver("Constant", value=(1.0, -0.5)).named("desired"),
            "q": driver("ForwardDynamics").named("arm").by(tau="tau").at("q"),
            "qd": driver("ForwardDynamics").named("arm").by(tau="tau").at("qd"),
        },
        shown=("q", driver("Sum", signs="+-").named("error").by(u1="qr", u2="q")),
        stop_time=5.0,
    )

    robot: RobotField = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot")
    Kp: ArrayLike = parameter(
        100.0,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        doc="position gains, N m/rad (N/m for a prismatic joint)",
    )
    Kd: ArrayLike = parameter(
        20.0,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        doc="speed gains, N m s/rad (N s/m for a prismatic joint)",
    )

    def check(self) -> None:
        _check_gains(self, self.robot)

    def input_ports(self) -> tuple[Port, ...]:
        return reference_ports(self.robot)[0], q_port(self.robot), qd_port(self.robot)

    def output_ports(self) -> tuple[Port, ...]:
        return (tau_port(self.robot, "torque or force at the joints"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        robot, q = self.robot, u["q"]
        if robot.closures:
            gravity = motor_torques(robot, q, SX.zeros(robot.n), SX.zeros(robot.n))
            control = p["Kp"] * position_errors(robot, u["qr"], q) - p["Kd"] * u["qd"]
            return {"tau": gravity + at_motors(robot, control)}
        gravity = apply_traced(dynamics.trace_gravload(robot), q)
        return {"tau": gravity + p["Kp"] * (u["qr"] - q) - p["Kd"] * u["qd"]}


@dataclass(frozen=True, kw_only=True)
class ComputedTorque(Block):
    """Inverse dynamics control: tau = M(q) (qddr + Kd e' + Kp e) + C qd + g + friction, e = qr - q.

    If the model equals the robot, the errors of all joints obey e'' + Kd e' + Kp e = 0 independently:
    critically damped for Kd = 2 sqrt(Kp). The model may have couplings, such as those of palletising arms,
    and closed loops. In robots with closed loops only the joints with a motor are controlled, and only they
    have torques; the motion of the other joints follows from the constraints.
    """

    title: ClassVar[str] = "Computed Torque Controller"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=("The arm starts with errors of 0.2 rad, which decay with critical damping."),
        inputs={
            "qr": driver("JTraj", q0=(0.0, 0.0), qf=(1.0, -1.5), tmax=3.0).named("motion").at("q"),
            "qdr": driver("JTraj", q0=(0.0, 0.0), qf=(1.0, -1.5), tmax=3.0).named("motion").at("qd"),
            "qddr": driver("JTraj", q0=(0.0, 0.0), qf=(1.0, -1.5), tmax=3.0).named("motion").at("qdd"),
            "q": driver("ForwardDynamics", q0=(0.2, -0.2)).named("arm").by(tau="tau").at("q"),
            "qd": driver("ForwardDynamics", q0=(0.2, -0.2)).named("arm").by(tau="tau").at("qd"),
        },
        shown=("q", driver("Sum", signs="+-").named("error").by(u1="qr", u2="q")),
        stop_time=5.0,
    )

    robot: RobotField = parameter(
        kind=ParameterKind.ROBOT, of_type=Robot, doc="model of the robot in the controller"
    )
    Kp: ArrayLike = parameter(
        100.0, kind=ParameterKind.ARRAY, dimensions=(0, 1), doc="position gains", unit="1/s2"
    )
    Kd: ArrayLike = parameter(
        20.0, kind=ParameterKind.ARRAY, dimensions=(0, 1), doc="speed gains", unit="1/s"
    )

    def check(self) -> None:
        _check_gains(self, self.robot)

    def input_ports(self) -> tuple[Port, ...]:
        return *reference_ports(self.robot), q_port(self.robot), qd_port(self.robot)

    def output_ports(self) -> tuple[Port, ...]:
        return (tau_port(self.robot, "torque or force at the joints"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        error = position_errors(self.robot, u["qr"], u["q"])
        acceleration = u["qddr"] + p["Kd"] * (u["qdr"] - u["qd"]) + p["Kp"] * error
        if self.robot.closures:
            return {"tau": motor_torques(self.robot, u["q"], u["qd"], acceleration)}
        return {"tau": apply_traced(dynamics.trace_rne(self.robot), u["q"], u["qd"], acceleration)}


@dataclass(frozen=True, kw_only=True)
class FeedForward(Block):
    """Feedforward and PD: tau = rne(qr, qdr, qddr) + Kp (qr - q) + Kd (qdr - qd).

    In robots with closed loops only the joints with a motor are controlled, and only they have torques. The
    desired motion of the other joints follows from the constraints; the inputs of these joints are the
    initial guess.
    """

    title: ClassVar[str] = "Feed-Forward Controller"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=("The torques of the desired motion are fed forward; PD corrects the initial error."),
        inputs={
            "qr": driver("JTraj", q0=(0.0, 0.0), qf=(1.0, -1.5), tmax=3.0).named("motion").at("q"),
            "qdr": driver("JTraj", q0=(0.0, 0.0), qf=(1.0, -1.5), tmax=3.0).named("motion").at("qd"),
            "qddr": driver("JTraj", q0=(0.0, 0.0), qf=(1.0, -1.5), tmax=3.0).named("motion").at("qdd"),
            "q": driver("ForwardDynamics", q0=(0.2, -0.2)).named("arm").by(tau="tau").at("q"),
            "qd": driver("ForwardDynamics", q0=(0.2, -0.2)).named("arm").by(tau="tau").at("qd"),
        },
        shown=("q", driver("Sum", signs="+-").named("error").by(u1="qr", u2="q")),
        stop_time=5.0,
    )

    robot: RobotField = parameter(
        kind=ParameterKind.ROBOT, of_type=Robot, doc="model of the robot in the controller"
    )
    Kp: ArrayLike = parameter(
        100.0,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        doc="position gains, N m/rad (N/m for a prismatic joint)",
    )
    Kd: ArrayLike = parameter(
        20.0,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        doc="speed gains, N m s/rad (N s/m for a prismatic joint)",
    )

    def check(self) -> None:
        _check_gains(self, self.robot)

    def input_ports(self) -> tuple[Port, ...]:
        return *reference_ports(self.robot), q_port(self.robot), qd_port(self.robot)

    def output_ports(self) -> tuple[Port, ...]:
        return (tau_port(self.robot, "torque or force at the joints"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        robot, reference = self.robot, (u["qr"], u["qdr"], u["qddr"])
        if robot.closures:
            feedforward = motor_torques(robot, *reference, newton_steps=REFERENCE_STEPS)
            control = p["Kp"] * position_errors(robot, u["qr"], u["q"]) + p["Kd"] * (u["qdr"] - u["qd"])
            return {"tau": feedforward + at_motors(robot, control)}
        feedforward = apply_traced(dynamics.trace_rne(robot), *reference)
        return {"tau": feedforward + p["Kp"] * (u["qr"] - u["q"]) + p["Kd"] * (u["qdr"] - u["qd"])}
