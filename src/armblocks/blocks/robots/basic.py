"""The blocks of the toolbox's roblocks library: trajectory, kinematics, dynamics and animation.

The equations are in :mod:`armblocks.dynamics`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX
from numpy.typing import ArrayLike

from armblocks import dynamics
from armblocks.blocks.example_signals import position_of
from armblocks.blocks.robots.ports import (
    apply_all,
    apply_traced,
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
    View,
    ViewKind,
    WorkedExample,
    driver,
    parameter,
    shape_of,
)
from armblocks.diagram.signs import FaceSign, Words, graph
from armblocks.dynamics.constrained import check_no_prescribed_motion
from armblocks.errors import InputError, counted
from armblocks.robot import Robot
from armblocks.trajectories import Quintic


@dataclass(frozen=True, kw_only=True)
class JTraj(Block):
    """A quintic from q0 to qf in tmax, at rest at both ends: q = q0 + (qf - q0)(10 s^3 - 15 s^4 + 6 s^5).

    s = t / tmax; qd and qdd are its exact derivatives. After tmax the joints stay at qf, as in release 10 of
    the toolbox; the block of releases up to 9.10 gives NaN. The toolbox interpolates a table of 101 points
    linearly; this block evaluates the polynomial (they differ by up to 7.2e-5 (qf - q0)).
    """

    title: ClassVar[str] = "jtraj"
    card_size: ClassVar[tuple[float, float]] = (84.0, 64.0)
    sign: ClassVar[FaceSign] = graph(
        *((k / 20, 10 * (k / 20) ** 3 - 15 * (k / 20) ** 4 + 6 * (k / 20) ** 5) for k in range(21))
    )
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Two joints start and end at rest; position, speed and acceleration are continuous.",
        parameters={"tmax": 8.0, "q0": (0.0, 0.0), "qf": (1.0, -1.5)},
    )
    output_rates: ClassVar[Mapping[str, str]] = {"q": "qd", "qd": "qdd"}

    q0: ArrayLike = parameter((0.0,) * 6, dimensions=(1,), doc="joint coordinates at t = 0", unit="rad")
    qf: ArrayLike = parameter(
        (0.7853981633974483, 1.5707963267948966, -1.5707963267948966, 0.0, 0.0, 0.0),
        dimensions=(1,),
        doc="joint coordinates at t = tmax",
        unit="rad",
    )
    tmax: float = parameter(10.0, above=0.0, doc="duration of the motion", unit="s")

    def check(self) -> None:
        n, m = shape_of(self.q0)[0], shape_of(self.qf)[0]
        if n != m:
            raise InputError(
                f"q0 has {counted(n, 'joint')} and qf has {m}",
                where="JTraj",
                allowed="equal numbers of joints",
                fix="correct q0 or qf",
            )

    def output_ports(self) -> tuple[Port, ...]:
        shape = shape_of(self.q0)
        return (
            Port("q", "joint coordinates", "rad", shape),
            Port("qd", "joint speeds", "rad/s", shape),
            Port("qdd", "joint accelerations", "rad/s2", shape),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return Quintic(q0=p["q0"], qf=p["qf"], tmax=p["tmax"]).at(t)._asdict()

    def breakpoints(self, p: Signals) -> tuple[SX, ...]:
        return (p["tmax"],)


@dataclass(frozen=True, kw_only=True)
class Fkine(Block):
    """Forward kinematics: T = fkine(q), the pose of the tool in the world frame.

    ``frame``: the name of a named frame or a link of the robot; its pose is computed instead of the tool
    pose.
    """

    title: ClassVar[str] = "fkine"
    card_size: ClassVar[tuple[float, float]] = (84.0, 64.0)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The path of the tool of an arm with two links, in its vertical plane.",
        x_axis=position_of("T")[0],
        y_axis=position_of("T")[2],
    )

    robot: RobotField = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot")
    frame: str = parameter("", doc="named frame or link of the robot in the place of the tool")

    def check(self) -> None:
        self.robot.frame(self.frame or self.robot.links[-1].name)

    def input_ports(self) -> tuple[Port, ...]:
        return (q_port(self.robot),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("T", "pose of the tool in the world frame", shape=(4, 4)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"T": apply_traced(dynamics.trace_fkine(self.robot, self.frame or None), u["q"])}


@dataclass(frozen=True, kw_only=True)
class Jacob0(Block):
    """The Jacobian in the world frame: (v; w) = J qd, rows linear then angular, point = tool origin.

    ``frame``: the name of a named frame or a link of the robot that takes the place of the tool.
    """

    title: ClassVar[str] = "jacob0"
    sign: ClassVar[FaceSign] = Words("J(q)")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The linear rows of the Jacobian: velocity of the tool along x, y, z per unit joint speed.",
        shown=(driver("SubMatrix", last_row=3).named("linear rows").by(u="J"),),
    )

    robot: RobotField = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot")
    frame: str = parameter("", doc="named frame or link of the robot in the place of the tool")

    def check(self) -> None:
        self.robot.frame(self.frame or self.robot.links[-1].name)

    def input_ports(self) -> tuple[Port, ...]:
        return (q_port(self.robot),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("J", "Jacobian in the world frame", shape=(6, self.robot.n)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"J": apply_traced(dynamics.trace_jacob0(self.robot, self.frame or None), u["q"])}


@dataclass(frozen=True, kw_only=True)
class Jacobe(Block):
    """The Jacobian in the tool frame: (v; w) = J qd, rows linear then angular (jacobn in the toolbox).

    ``frame``: the name of a named frame or a link of the robot that takes the place of the tool.
    """

    title: ClassVar[str] = "jacobn"
    sign: ClassVar[FaceSign] = Words("Jₑ(q)")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The linear rows of the Jacobian in the axes of the tool.",
        shown=(driver("SubMatrix", last_row=3).named("linear rows").by(u="J"),),
    )

    robot: RobotField = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot")
    frame: str = parameter("", doc="named frame or link of the robot in the place of the tool")

    def check(self) -> None:
        self.robot.frame(self.frame or self.robot.links[-1].name)

    def input_ports(self) -> tuple[Port, ...]:
        return (q_port(self.robot),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("J", "Jacobian in the tool frame", shape=(6, self.robot.n)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"J": apply_traced(dynamics.trace_jacobe(self.robot, self.frame or None), u["q"])}


@dataclass(frozen=True, kw_only=True)
class Rne(Block):
    """Inverse dynamics: tau = rne(q, qd, qdd), with friction and motor inertia, and the robot's gravity.

    (The mask of the toolbox's block has a gravity parameter, which no release uses.)
    """

    title: ClassVar[str] = "rne"
    sign: ClassVar[FaceSign] = Words("rne")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=("The torques of a motion of two joints; at the end they only hold the arm against gravity."),
        shown=("q", "tau"),
    )

    robot: RobotField = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot")

    def input_ports(self) -> tuple[Port, ...]:
        return (q_port(self.robot), qd_port(self.robot), qdd_port(self.robot))

    def output_ports(self) -> tuple[Port, ...]:
        return (tau_port(self.robot, "torque or force of the motion"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"tau": apply_traced(dynamics.trace_rne(self.robot), u["q"], u["qd"], u["qdd"])}


@dataclass(frozen=True, kw_only=True)
class Gravload(Block):
    """The torques that hold the robot still against gravity: tau = gravload(q)."""

    title: ClassVar[str] = "gravload"
    sign: ClassVar[FaceSign] = Words("g(q)")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The gravity torques while the arm moves upwards.",
    )

    robot: RobotField = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot")

    def input_ports(self) -> tuple[Port, ...]:
        return (q_port(self.robot),)

    def output_ports(self) -> tuple[Port, ...]:
        return (tau_port(self.robot, "torque or force against gravity"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"tau": apply_traced(dynamics.trace_gravload(self.robot), u["q"])}


@dataclass(frozen=True, kw_only=True)
class Inertia(Block):
    """The joint-space inertia matrix: M = inertia(q), motors included."""

    title: ClassVar[str] = "inertia"
    sign: ClassVar[FaceSign] = Words("M(q)")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=(
            "The entries of the inertia matrix: the inertia at the first joint falls as the arm is folded."
        ),
        inputs={"q": driver("JTraj", q0=(0.0, 0.0), qf=(0.0, 2.5), tmax=8.0).named("motion")},
    )

    robot: RobotField = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot")

    def input_ports(self) -> tuple[Port, ...]:
        return (q_port(self.robot),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("M", "joint-space inertia matrix", shape=(self.robot.n, self.robot.n)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"M": apply_traced(dynamics.trace_inertia(self.robot), u["q"])}


@dataclass(frozen=True, kw_only=True)
class Coriolis(Block):
    """The matrix of Coriolis and centrifugal terms: C = coriolis(q, qd), with torque C qd."""

    title: ClassVar[str] = "coriolis"
    sign: ClassVar[FaceSign] = Words("C(q, qd)")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The entries of the Coriolis matrix; they are 0 at zero speed.",
        shown=("qd", "C"),
    )

    robot: RobotField = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot")

    def input_ports(self) -> tuple[Port, ...]:
        return (q_port(self.robot), qd_port(self.robot))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("C", "Coriolis matrix", shape=(self.robot.n, self.robot.n)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"C": apply_traced(dynamics.trace_coriolis(self.robot), u["q"], u["qd"])}


@dataclass(frozen=True, kw_only=True)
class ForwardDynamics(Block):
    """Forward dynamics of the robot: q'' = accel(q, q', tau), with q(0) = q0 and q'(0) = qd0.

    With Coulomb friction the equations are discontinuous at zero speed, and the steps become very small where
    a joint comes to rest. For such robots use ArmPlant, which models sticking joints, or set
    Coulomb friction to zero.

    This is the toolbox's block Robot. In the toolbox, q0 is the initial position since tag 9.7 of its
    repository (2013). In earlier versions the parameter is not connected, and the robot starts at q = 0.
    The initial speed is always zero in the toolbox.
    """

    title: ClassVar[str] = "Robot"
    card_size: ClassVar[tuple[float, float]] = (84.0, 64.0)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A double pendulum, released from the horizontal without torque.",
        inputs={"tau": driver("Constant", value=(0.0, 0.0)).named("no torque")},
        shown=("q",),
        stop_time=5.0,
    )
    output_rates: ClassVar[Mapping[str, str]] = {"q": "qd", "qd": "qdd"}

    robot: RobotField = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot")
    q0: ArrayLike = parameter(
        0.0,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        doc="joint coordinates (n,) at t = 0, or one number for all",
        unit="rad",
    )
    qd0: ArrayLike = parameter(
        0.0,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        doc="joint speeds (n,) at t = 0, or one number for all",
        unit="rad/s",
    )

    def check(self) -> None:
        check_start(self, self.robot, "q0")
        check_joint_values(self, self.robot, "qd0")
        check_no_prescribed_motion(self.robot)
        check_consistent_start(self, self.robot, "q0", "qd0")

    def output_rate(self, port: str) -> str | None:
        return None if port == "q" and self.robot.nq != self.robot.nv else super().output_rate(port)

    def input_ports(self) -> tuple[Port, ...]:
        return (tau_port(self.robot, "torque or force at the joints"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (q_port(self.robot), qd_port(self.robot), qdd_port(self.robot))

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        q, qd = q_port(self.robot), qd_port(self.robot)
        return tuple(State(port.name, (len(port.names),), port.doc, port.unit) for port in (q, qd))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        if self.robot.constraints:
            q, qd, qdd, _, _ = self._constrained_motion(x, u)
            return {"q": q, "qd": qd, "qdd": qdd}
        qdd = apply_traced(dynamics.trace_accel(self.robot), x["q"], x["qd"], u["tau"])
        return {"q": normalised_coordinates(self.robot, x["q"]), "qd": x["qd"], "qdd": qdd}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        if self.robot.constraints:
            _, _, _, q_rates, qd_rates = self._constrained_motion(x, u)
            return {"q": q_rates, "qd": qd_rates}
        qdd = apply_traced(dynamics.trace_accel(self.robot), x["q"], x["qd"], u["tau"])
        return {"q": coordinate_rates(self.robot, x["q"], x["qd"]), "qd": qdd}

    def _constrained_motion(self, x: Signals, u: Signals) -> tuple[SX, ...]:
        near = start_numbers(self, self.robot, "q0")
        return apply_all(dynamics.trace_constrained_motion(self.robot, near), x["q"], x["qd"], u["tau"])

    def initial_states(self, p: Signals) -> Signals:
        return {"q": start_coordinates(self.robot, p["q0"]), "qd": p["qd0"]}


@dataclass(frozen=True, kw_only=True)
class RobotPlot(Block):
    """Animation of the robot: records the poses of all links, from which a view draws the robot."""

    title: ClassVar[str] = "plot"
    card_size: ClassVar[tuple[float, float]] = (84.0, 64.0)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The arm at six times of its motion, with the path of the tool.",
    )

    robot: RobotField = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot")

    def input_ports(self) -> tuple[Port, ...]:
        return (q_port(self.robot),)

    def record_ports(self) -> tuple[Port, ...]:
        doc = "world poses of the base, every link in order, and the tool"
        return (Port("poses", doc, shape=(len(self.robot.links) + 2, 4, 4)),)

    def records(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"poses": apply_traced(dynamics.trace_link_poses(self.robot), u["q"])}

    def views(self) -> tuple[View, ...]:
        return (View(kind=ViewKind.ROBOT, signals=("poses",), title=self.robot.name, subject=self.robot),)
