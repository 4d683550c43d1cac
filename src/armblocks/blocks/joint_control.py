"""Joint controllers, drives and quantities of an arm that go with them.

Sources: Siciliano et al., Robotics, 2009, 3.5 (inverses of the Jacobian), 5.2 (drives), 8.3 (feed-forward),
8.5.1 (PD with gravity compensation), 8.5.2 (inverse dynamics).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, if_else, logic_and, mtimes
from numpy.typing import ArrayLike

from armblocks import dynamics
from armblocks.blocks.elimination import solve
from armblocks.blocks.robot_ports import apply_traced, q_port, qd_port, qdd_port, tau_port
from armblocks.blocks.switching import located, zero_crossing_parameter
from armblocks.diagram import (
    Block,
    Condition,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    WorkedExample,
    broadcast,
    made,
    parameter,
    shape_of,
)
from armblocks.errors import InputError
from armblocks.robot import Robot


def _check_gains(block: Block, robot: Robot) -> None:
    for name in ("Kp", "Kd"):
        shape = shape_of(block.parameter_value(name))
        if shape not in ((), (robot.n,)):
            raise InputError(
                f"{name} has {shape[0]} gains",
                where=block.type_name(),
                allowed=f"{robot.n}, as '{robot.name}' has joints, or one number for all",
                fix=f"correct {name}",
            )


@dataclass(frozen=True, kw_only=True)
class JacobianInverse(Block):
    """What undoes a Jacobian (m, n): Ji (n, m) = J^-1, J', the pseudo-inverse, or J'(J J' + damping^2 I)^-1.

    ``inverse`` wants a square one and is not finite where the arm is singular. ``pseudo`` gives the least
    joint speeds (n >= m) or the least error (n < m), of an arm that is not singular. ``damped`` (damped
    least squares) stays finite everywhere, at the price of an error where the arm is nearly singular.
    """

    family: ClassVar[str] = "robots"
    title: ClassVar[str] = "ijacob"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=(
            "The pseudo-inverse of the Jacobian while an arm unfolds: the speeds that a motion asks for grow."
        ),
        parameters={"method": "pseudo"},
        inputs={
            "J": made("SubMatrix", last_row=3)
            .named("linear rows")
            .by(u=made("Jacob0").by(q=made("JTraj", q0=(0.0, 1.5), qf=(0.5, 0.4), tmax=8.0).named("motion")))
        },
        shown=("Ji",),
    )

    method: str = parameter("inverse", choices=("inverse", "transpose", "pseudo", "damped"), doc="which one")
    damping: float = parameter(0.1, above=0.0, doc="damping, for 'damped' only")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("J", "the Jacobian (m, n)"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("Ji", "its inverse of the chosen kind (n, m)"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        shape = inputs["J"]
        if len(shape) != 2 or (self.method == "inverse" and shape[0] != shape[1]):
            raise InputError(
                f"the Jacobian has shape {shape}",
                allowed="a matrix, which is square for 'inverse'",
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
    """How far an arm is from a singularity: w = sqrt(det(J J')), Yoshikawa's measure."""

    family: ClassVar[str] = "robots"
    title: ClassVar[str] = "manipulability"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="An arm with two links unfolds: the nearer it is to being stretched, the smaller the measure.",
        inputs={"q": made("JTraj", q0=(0.0, 1.5), qf=(0.5, 0.0), tmax=8.0).named("motion")},
    )

    robot: Robot = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot")

    def input_ports(self) -> tuple[Port, ...]:
        return (q_port(self.robot),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("w", "Yoshikawa's measure", shape=()),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"w": apply_traced(dynamics.trace_manipulability(self.robot), u["q"])}


@dataclass(frozen=True, kw_only=True)
class RobotEnergy(Block):
    """Kinetic and potential energy of an arm: T = 1/2 qd' M(q) qd, V = -sum of m g . r."""

    family: ClassVar[str] = "robots"
    title: ClassVar[str] = "Energy"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=(
            "A double pendulum without friction: kinetic and potential energy change places, their sum stays."
        ),
        inputs={
            "q": made("ForwardDynamics")
            .named("arm")
            .by(tau=made("Constant", value=(0.0, 0.0)).named("no torque"))
            .at("q"),
            "qd": made("ForwardDynamics")
            .named("arm")
            .by(tau=made("Constant", value=(0.0, 0.0)).named("no torque"))
            .at("qd"),
        },
        shown=("kinetic", "potential", made("Sum").named("sum").by(u1="kinetic", u2="potential")),
        stop_time=5.0,
    )

    robot: Robot = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot")

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
    """Inverse dynamics with a force at the tip and a payload: tau = rne(q, qd, qdd) + their part.

    ``wrench`` (force, moment) is what the tip exerts on its surroundings, in the last link's axes; the
    payload is mass, centre of mass (3) and inertia xx yy zz xy yz xz about it, in the tool frame.
    """

    family: ClassVar[str] = "robots"
    title: ClassVar[str] = "rne with load"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The torques that hold the arm on its way with 2 kg at the tool.",
        inputs={
            "wrench": made("Constant", value=(0.0,) * 6).named("no force"),
            "payload": made("Constant", value=(2.0,) + (0.0,) * 9).named("2 kg"),
        },
        shown=("q", "tau"),
    )

    robot: Robot = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot")

    def input_ports(self) -> tuple[Port, ...]:
        motion = (q_port(self.robot), qd_port(self.robot), qdd_port(self.robot))
        wrench = Port("wrench", "force (N) and moment (N m) on the surroundings", shape=(6,))
        return *motion, wrench, Port("payload", "mass, centre, inertia", shape=(10,))

    def output_ports(self) -> tuple[Port, ...]:
        return (tau_port(self.robot, "torque or force at the joints"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"tau": apply_traced(dynamics.trace_rne_loaded(self.robot), *u.values())}


@dataclass(frozen=True, kw_only=True)
class JointPD(Block):
    """A PD controller of joints: tau = Kp (qr - q) + Kd (qdr - qd), each joint by itself."""

    family: ClassVar[str] = "robots"
    title: ClassVar[str] = "PD Joint Controller"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A PD controller alone: the arm follows, and sags under gravity by a constant error.",
        parameters={"Kp": 200.0, "Kd": 40.0},
        inputs={
            "qr": made("JTraj", q0=(0.0, 0.0), qf=(1.0, -1.5), tmax=3.0).named("motion").at("q"),
            "qdr": made("JTraj", q0=(0.0, 0.0), qf=(1.0, -1.5), tmax=3.0).named("motion").at("qd"),
            "q": made("ForwardDynamics").named("arm").by(tau="tau").at("q"),
            "qd": made("ForwardDynamics").named("arm").by(tau="tau").at("qd"),
        },
        shown=("q", made("Sum", signs="+-").named("error").by(u1="qr", u2="q")),
        stop_time=5.0,
    )

    Kp: ArrayLike = parameter(100.0, kind=ParameterKind.ARRAY, dimensions=(0, 1), doc="gains of the position")
    Kd: ArrayLike = parameter(20.0, kind=ParameterKind.ARRAY, dimensions=(0, 1), doc="gains of the speed")

    def check(self) -> None:
        broadcast({"Kp": shape_of(self.Kp), "Kd": shape_of(self.Kd)})

    def input_ports(self) -> tuple[Port, ...]:
        return (
            Port("qr", "wanted coordinates"),
            Port("qdr", "wanted speeds"),
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
    """PD with gravity compensation: tau = g(q) + Kp (qr - q) - Kd qd, which rests at qr and nowhere else."""

    family: ClassVar[str] = "robots"
    title: ClassVar[str] = "PD with Gravity Compensation"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="From rest to a wanted posture: gravity is compensated, so that no error remains.",
        inputs={
            "qr": made("Constant", value=(1.0, -0.5)).named("wanted"),
            "q": made("ForwardDynamics").named("arm").by(tau="tau").at("q"),
            "qd": made("ForwardDynamics").named("arm").by(tau="tau").at("qd"),
        },
        shown=("q", made("Sum", signs="+-").named("error").by(u1="qr", u2="q")),
        stop_time=5.0,
    )

    robot: Robot = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot")
    Kp: ArrayLike = parameter(100.0, kind=ParameterKind.ARRAY, dimensions=(0, 1), doc="gains of the position")
    Kd: ArrayLike = parameter(20.0, kind=ParameterKind.ARRAY, dimensions=(0, 1), doc="gains of the speed")

    def check(self) -> None:
        _check_gains(self, self.robot)

    def input_ports(self) -> tuple[Port, ...]:
        return q_port(self.robot, "qr"), q_port(self.robot), qd_port(self.robot)

    def output_ports(self) -> tuple[Port, ...]:
        return (tau_port(self.robot, "torque or force at the joints"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        gravity = apply_traced(dynamics.trace_gravload(self.robot), u["q"])
        return {"tau": gravity + p["Kp"] * (u["qr"] - u["q"]) - p["Kd"] * u["qd"]}


@dataclass(frozen=True, kw_only=True)
class ComputedTorque(Block):
    """Inverse dynamics control: tau = M(q) (qddr + Kd e' + Kp e) + C qd + g + friction, e = qr - q.

    With the true robot the errors obey e'' + Kd e' + Kp e = 0, each joint by itself: critically damped for
    Kd = 2 sqrt(Kp).
    """

    family: ClassVar[str] = "robots"
    title: ClassVar[str] = "Computed Torque Controller"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=(
            "The arm starts 0.2 rad beside the wanted motion; the errors vanish as those of a "
            "critically damped oscillator."
        ),
        inputs={
            "qr": made("JTraj", q0=(0.0, 0.0), qf=(1.0, -1.5), tmax=3.0).named("motion").at("q"),
            "qdr": made("JTraj", q0=(0.0, 0.0), qf=(1.0, -1.5), tmax=3.0).named("motion").at("qd"),
            "qddr": made("JTraj", q0=(0.0, 0.0), qf=(1.0, -1.5), tmax=3.0).named("motion").at("qdd"),
            "q": made("ForwardDynamics", q0=(0.2, -0.2)).named("arm").by(tau="tau").at("q"),
            "qd": made("ForwardDynamics", q0=(0.2, -0.2)).named("arm").by(tau="tau").at("qd"),
        },
        shown=("q", made("Sum", signs="+-").named("error").by(u1="qr", u2="q")),
        stop_time=5.0,
    )

    robot: Robot = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot as it is known")
    Kp: ArrayLike = parameter(
        100.0, kind=ParameterKind.ARRAY, dimensions=(0, 1), doc="gains of the position", unit="1/s2"
    )
    Kd: ArrayLike = parameter(
        20.0, kind=ParameterKind.ARRAY, dimensions=(0, 1), doc="gains of the speed", unit="1/s"
    )

    def check(self) -> None:
        _check_gains(self, self.robot)

    def input_ports(self) -> tuple[Port, ...]:
        robot = self.robot
        wanted = (q_port(robot, "qr"), qd_port(robot, "qdr"), qdd_port(robot, "qddr"))
        return *wanted, q_port(robot), qd_port(robot)

    def output_ports(self) -> tuple[Port, ...]:
        return (tau_port(self.robot, "torque or force at the joints"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        wanted = u["qddr"] + p["Kd"] * (u["qdr"] - u["qd"]) + p["Kp"] * (u["qr"] - u["q"])
        return {"tau": apply_traced(dynamics.trace_rne(self.robot), u["q"], u["qd"], wanted)}


@dataclass(frozen=True, kw_only=True)
class FeedForward(Block):
    """The torque of the wanted motion plus PD: tau = rne(qr, qdr, qddr) + Kp (qr - q) + Kd (qdr - qd)."""

    family: ClassVar[str] = "robots"
    title: ClassVar[str] = "Feed-Forward Controller"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=(
            "The torques of the wanted motion are given beforehand; PD corrects what is left of the "
            "start beside it."
        ),
        inputs={
            "qr": made("JTraj", q0=(0.0, 0.0), qf=(1.0, -1.5), tmax=3.0).named("motion").at("q"),
            "qdr": made("JTraj", q0=(0.0, 0.0), qf=(1.0, -1.5), tmax=3.0).named("motion").at("qd"),
            "qddr": made("JTraj", q0=(0.0, 0.0), qf=(1.0, -1.5), tmax=3.0).named("motion").at("qdd"),
            "q": made("ForwardDynamics", q0=(0.2, -0.2)).named("arm").by(tau="tau").at("q"),
            "qd": made("ForwardDynamics", q0=(0.2, -0.2)).named("arm").by(tau="tau").at("qd"),
        },
        shown=("q", made("Sum", signs="+-").named("error").by(u1="qr", u2="q")),
        stop_time=5.0,
    )

    robot: Robot = parameter(kind=ParameterKind.ROBOT, of_type=Robot, doc="the robot as it is known")
    Kp: ArrayLike = parameter(100.0, kind=ParameterKind.ARRAY, dimensions=(0, 1), doc="gains of the position")
    Kd: ArrayLike = parameter(20.0, kind=ParameterKind.ARRAY, dimensions=(0, 1), doc="gains of the speed")

    def check(self) -> None:
        _check_gains(self, self.robot)

    def input_ports(self) -> tuple[Port, ...]:
        robot = self.robot
        wanted = (q_port(robot, "qr"), qd_port(robot, "qdr"), qdd_port(robot, "qddr"))
        return *wanted, q_port(robot), qd_port(robot)

    def output_ports(self) -> tuple[Port, ...]:
        return (tau_port(self.robot, "torque or force at the joints"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        known = apply_traced(dynamics.trace_rne(self.robot), u["qr"], u["qdr"], u["qddr"])
        return {"tau": known + p["Kp"] * (u["qr"] - u["q"]) + p["Kd"] * (u["qdr"] - u["qd"])}


@dataclass(frozen=True, kw_only=True)
class MotorDrive(Block):
    """A drive's limits: y = u held within its current limit, peak, and voltage limit, stall (1 -+ w / w0).

    The voltage limit is the torque-speed line of a DC motor: ``stall`` at rest and 0 at ``no_load_speed`` w0,
    for torques that drive; beyond w0 the drive can only brake.
    """

    family: ClassVar[str] = "robots"
    title: ClassVar[str] = "Motor Drive"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=(
            "A wanted torque of 15 N m: the current limit holds it at 10, and with rising speed the "
            "voltage limit takes it to 0."
        ),
        inputs={
            "u": made("Constant", value=15.0).named("wanted"),
            "w": made("Ramp", slope=12.0).named("speed"),
        },
        shown=("u", "y"),
    )

    peak: ArrayLike = parameter(10.0, kind=ParameterKind.ARRAY, above=0.0, doc="torque at most", unit="N m")
    stall: ArrayLike = parameter(20.0, kind=ParameterKind.ARRAY, above=0.0, doc="torque at rest", unit="N m")
    no_load_speed: ArrayLike = parameter(
        100.0, kind=ParameterKind.ARRAY, above=0.0, doc="speed w0 at which no torque is left", unit="rad/s"
    )
    zero_crossing: bool = zero_crossing_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "wanted torque", "N m"), Port("w", "speed", "rad/s"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "torque", "N m"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        names = ("peak", "stall", "no_load_speed")
        return {"y": broadcast({**inputs, **{name: shape_of(self.parameter_value(name)) for name in names}})}

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        shape = self.output_shapes(inputs)["y"]
        docs = {
            "fast": "1 where the speed lowers the upper limit",
            "overrun": "1 where it makes it brake",
            "fast_back": "1 where the speed backwards raises the lower limit",
            "overrun_back": "1 where it makes it brake",
            "above": "1 above the upper limit",
            "below": "1 below the lower limit",
        }
        return located(self, *(Condition(name, shape, doc, closed=False) for name, doc in docs.items()))

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        forwards, backwards = self._lines(u, p)
        upper, lower = self._limits(x, u, p)
        return {
            "fast": p["peak"] - forwards,
            "overrun": -p["peak"] - forwards,
            "fast_back": p["peak"] + backwards,
            "overrun_back": backwards - p["peak"],
            "above": u["u"] - upper,
            "below": lower - u["u"],
        }

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        upper, lower = self._limits(x, u, p)
        return {"y": if_else(x["above"], upper, if_else(x["below"], lower, u["u"]))}

    @staticmethod
    def _lines(u: Signals, p: Signals) -> tuple[SX, SX]:
        """The voltage limits of both directions."""
        ratio = u["w"] / p["no_load_speed"]
        return p["stall"] * (1.0 - ratio), -p["stall"] * (1.0 + ratio)

    def _limits(self, x: Signals, u: Signals, p: Signals) -> tuple[SX, SX]:
        forwards, backwards = self._lines(u, p)
        upper = if_else(x["overrun"], -p["peak"], if_else(x["fast"], forwards, p["peak"]))
        return upper, if_else(x["overrun_back"], p["peak"], if_else(x["fast_back"], backwards, -p["peak"]))


@dataclass(frozen=True, kw_only=True)
class JointStops(Block):
    """End stops that push back: tau = stiffness (lower - q) - damping qd below lower, likewise above upper.

    A stop never pulls: while a joint leaves it quickly the torque is 0.
    """

    family: ClassVar[str] = "robots"
    title: ClassVar[str] = "Joint Stops"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A joint runs 0.05 rad into its stops at -1 and 1 rad, which push back.",
        inputs={
            "q": made("SineWave", amplitude=1.05).named("q"),
            "qd": made("Derivative").by(u=made("SineWave", amplitude=1.05).named("q")),
        },
        shown=("q", "tau"),
    )

    lower: ArrayLike = parameter(-1.0, kind=ParameterKind.ARRAY, finite=False, doc="lower stop", unit="rad")
    upper: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, finite=False, doc="upper stop", unit="rad")
    stiffness: ArrayLike = parameter(
        1e4, kind=ParameterKind.ARRAY, minimum=0.0, doc="of the stops", unit="N m/rad"
    )
    damping: ArrayLike = parameter(
        100.0, kind=ParameterKind.ARRAY, minimum=0.0, doc="of the stops", unit="N m s/rad"
    )
    zero_crossing: bool = zero_crossing_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("q", "coordinates", "rad"), Port("qd", "speeds", "rad/s"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("tau", "torque of the stops on the joints", "N m"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        names = [rule.name for rule in self.parameters()]
        shapes = {name: shape_of(self.parameter_value(name)) for name in names}
        return {"tau": broadcast({**inputs, **shapes})}

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        shape = self.output_shapes(inputs)["tau"]
        docs = {
            "low": "1 below the lower stop",
            "pushed_up": "1 where spring and damper of the lower stop push",
            "high": "1 above the upper stop",
            "pushed_down": "1 where spring and damper of the upper stop push",
        }
        return located(self, *(Condition(name, shape, doc, closed=False) for name, doc in docs.items()))

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        up, down = self._pushes(u, p)
        return {
            "low": p["lower"] - u["q"],
            "pushed_up": up,
            "high": u["q"] - p["upper"],
            "pushed_down": -down,
        }

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        up, down = self._pushes(u, p)
        low = if_else(logic_and(x["low"], x["pushed_up"]), up, 0.0)
        return {"tau": low + if_else(logic_and(x["high"], x["pushed_down"]), down, 0.0)}

    @staticmethod
    def _pushes(u: Signals, p: Signals) -> tuple[SX, SX]:
        """What spring and damper of the lower and of the upper stop would give in contact."""
        drag = p["damping"] * u["qd"]
        return p["stiffness"] * (p["lower"] - u["q"]) - drag, p["stiffness"] * (p["upper"] - u["q"]) - drag
