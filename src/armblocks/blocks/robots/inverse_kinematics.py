"""Blocks of inverse kinematics: coordinates of a pose, and joint speeds of a motion of the tool."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, atan2, cos, sin, vertcat
from numpy.typing import ArrayLike

from armblocks import dynamics
from armblocks.blocks.robots.ports import (
    apply_all,
    apply_traced,
    check_no_closures,
    check_start,
    coordinate_rates,
    normalised_coordinates,
    q_port,
    qd_port,
    start_coordinates,
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
from armblocks.diagram.signs import FaceSign, Words
from armblocks.dynamics.closed_form.trace import closed_solver, trace_branches
from armblocks.dynamics.pose_error import trace_pose_error
from armblocks.dynamics.resolved_rate import bounded_speeds, limit_avoidance
from armblocks.errors import InputError
from armblocks.robot import Robot

TWIST = Port("v", "velocity of the tool in the world, m/s, then its angular velocity, rad/s", shape=(6,))
MOTION = driver("JTraj", q0=(0.3, 0.6), qf=(0.9, 1.2), tmax=8.0).named("motion")
"""A motion of two joints."""
MOVING_POSE = driver("Fkine").named("target").by(q=MOTION)
"""The pose of an arm with two links in motion."""


@dataclass(frozen=True, kw_only=True)
class Ikine(Block):
    """Inverse kinematics in closed form: q = ikine(T), the joint coordinates of one branch.

    - The block supports arms with a closed form (``arm.ikine_all``): with a spherical wrist or three parallel
      axes, SCARA and planar arms, palletisers. Use DifferentialIkine for other arms, and for motions through
      singular configurations.
    - ``branch`` is the number of a branch in the order of ``arm.ikine_all(T).q``, from 1.
    - Angles are within half a turn of ``q0``.
    - q is NaN where the branch does not exist, so the run ends there.
    """

    title: ClassVar[str] = "ikine"
    sign: ClassVar[FaceSign] = Words("T → q")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The two configurations of an arm with two links, elbow up and down, for a moving pose.",
        inputs={"T": MOVING_POSE},
        parameters={"branch": 1},
        shown=("motion/q", "q"),
    )

    robot: RobotField = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot")
    branch: int = parameter(1, minimum=1, doc="number of the branch, from 1")
    q0: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, dimensions=(0, 1), doc="coordinates near which angles are chosen"
    )

    def check(self) -> None:
        check_start(self, self.robot, "q0")
        _, solver = closed_solver(self.robot)
        if self.branch > solver.branch_count:
            raise InputError(
                f"branch is {self.branch}",
                where="Ikine.branch",
                allowed=f"1 to {solver.branch_count}, the branches of '{self.robot.name}'",
                fix="choose a branch from arm.ikine_all(T).q",
            )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("T", "pose of the tool in the world frame", shape=(4, 4)),)

    def output_ports(self) -> tuple[Port, ...]:
        return (q_port(self.robot),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        q = apply_all(trace_branches(self.robot), u["T"])[0][self.branch - 1, :].T
        start = p["q0"] + SX.zeros(self.robot.nq)
        rows: list[SX] = []
        for k, entry in enumerate(self.robot.positions):
            apart = SX(q[k] - start[k])
            near = SX(start[k] + atan2(sin(apart), cos(apart)))
            rows.append(near if entry.unit == "rad" else SX(q[k]))
        return {"q": SX(vertcat(*rows))}


@dataclass(frozen=True, kw_only=True)
class ResolvedRate(Block):
    """Joint speeds for a velocity of the tool, bounded near singular configurations: (v; w) = J(q) qd.

    Resolved-rate motion control (Whitney, 1969) with damped least squares:

    - Near a singular configuration, where the manipulability falls below ``region``, damping up to
      ``damping`` bounds the speeds, and the tool velocity deviates from the commanded velocity. The
      manipulability is computed from the Jacobian whose linear rows are divided by the size of the arm.
    - All speeds are reduced in proportion, so that none exceeds ``max_speed``.
    - ``avoidance`` moves joints towards the middle of their ranges without moving the tool. This requires
      more joints than degrees of freedom of the tool.
    """

    title: ClassVar[str] = "Resolved Rate"
    sign: ClassVar[FaceSign] = Words("J⁻¹ v")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Joint speeds that move the tool at 0.1 m/s while the arm stretches and bends again.",
        inputs={
            "q": driver("JTraj", q0=(0.2, 1.2), qf=(0.6, -1.2), tmax=8.0).named("motion"),
            "v": driver("Constant", value=(0.1, 0.0, 0.0, 0.0, 0.0, 0.0)).named("velocity"),
        },
        shown=("motion/q", "qd"),
    )

    robot: RobotField = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot")
    damping: float = parameter(0.1, above=0.0, doc="damping factor at a singular configuration")
    region: float = parameter(0.02, above=0.0, doc="manipulability below which the speeds are damped")
    max_speed: float = parameter(3.0, above=0.0, doc="largest speed of a joint", unit="rad/s")
    avoidance: float = parameter(0.0, minimum=0.0, doc="rate of the motion away from limits", unit="1/s")

    def check(self) -> None:
        check_no_closures(self, self.robot)

    def input_ports(self) -> tuple[Port, ...]:
        return (q_port(self.robot), TWIST)

    def output_ports(self) -> tuple[Port, ...]:
        return (qd_port(self.robot),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        J = apply_traced(dynamics.trace_jacob0(self.robot), u["q"])
        return {"qd": speeds_of(self.robot, u["q"], J, u["v"], p)}


@dataclass(frozen=True, kw_only=True)
class DifferentialIkine(Block):
    """Inverse kinematics by integration: the joints follow a moving pose T, also through singularities.

    Closed-loop inverse kinematics (Siciliano et al., Robotics, 2009, 3.7):

    - The pose error e is the displacement and the rotation vector from the tool to T.
    - The joint speeds are those of ResolvedRate for the tool velocity v + gain e, with its damping and its
      limit of the speeds. ``v`` is the velocity of the pose T; connect 0 if it is unknown.
    - The joint coordinates are the integral of the speeds from ``q0``.

    Away from singular configurations, and below the limit of the speeds, the error decays with the time
    constant 1 / gain if ``v`` is the velocity of T. If the pose is out of reach, the tool approaches the
    nearest pose that it can reach.
    """

    title: ClassVar[str] = "Differential Ikine"
    sign: ClassVar[FaceSign] = Words("T → q, q̇")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The joints follow a moving pose from another start, within some time constants of 0.1 s.",
        parameters={"q0": (0.5, 1.0)},
        inputs={
            "T": MOVING_POSE,
            "v": driver("Constant", value=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)).named("velocity"),
        },
        shown=("motion/q", "q"),
    )

    robot: RobotField = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot")
    q0: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, dimensions=(0, 1), doc="joint coordinates at t = 0"
    )
    gain: float = parameter(10.0, above=0.0, doc="rate at which the error of the pose decays", unit="1/s")
    damping: float = parameter(0.1, above=0.0, doc="damping factor at a singular configuration")
    region: float = parameter(0.02, above=0.0, doc="manipulability below which the speeds are damped")
    max_speed: float = parameter(3.0, above=0.0, doc="largest speed of a joint", unit="rad/s")
    avoidance: float = parameter(0.0, minimum=0.0, doc="rate of the motion away from limits", unit="1/s")

    def check(self) -> None:
        check_no_closures(self, self.robot)
        check_start(self, self.robot, "q0")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("T", "pose of the tool in the world frame", shape=(4, 4)), TWIST)

    def output_ports(self) -> tuple[Port, ...]:
        return (q_port(self.robot), qd_port(self.robot))

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        port = q_port(self.robot)
        return (State("q", (self.robot.nq,), port.doc, port.unit),)

    def initial_states(self, p: Signals) -> Signals:
        return {"q": start_coordinates(self.robot, p["q0"]) + SX.zeros(self.robot.nq)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"q": normalised_coordinates(self.robot, x["q"]), "qd": self._speeds(x, u, p)}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"q": coordinate_rates(self.robot, x["q"], self._speeds(x, u, p))}

    def _speeds(self, x: Signals, u: Signals, p: Signals) -> SX:
        error, J = apply_all(trace_pose_error(self.robot), x["q"], u["T"])
        return speeds_of(self.robot, x["q"], J, SX(u["v"] + p["gain"] * error), p)


def speeds_of(robot: Robot, q: SX, J: SX, twist: SX, p: Signals) -> SX:
    """The joint speeds of the blocks above for their parameters ``p``."""
    return bounded_speeds(
        robot,
        J,
        twist,
        limit_avoidance(robot, q, p["avoidance"]),
        damping=p["damping"],
        region=p["region"],
        max_speed=p["max_speed"],
    )
