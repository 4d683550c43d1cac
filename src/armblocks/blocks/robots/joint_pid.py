"""PID controllers of joints with limited torque, in continuous time and sampled.

Source: Siciliano et al., Robotics, 2009, 8.3; Åström, Hägglund, Advanced PID Control, 2006, 3.5 (windup).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, fmax, fmin, if_else, logic_and
from numpy.typing import ArrayLike

from armblocks.blocks.pid_parameters import lower_limit_parameter, upper_limit_parameter
from armblocks.blocks.switching import limits_in_order, zone, zone_after
from armblocks.diagram import (
    Block,
    Guard,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    broadcast,
    driver,
    parameter,
    sample_time_parameter,
    shape_of,
)
from armblocks.equations import Shape

_PORTS = (
    Port("qr", "desired coordinates"),
    Port("qdr", "desired speeds"),
    Port("q", "coordinates"),
    Port("qd", "speeds"),
)
_EXAMPLE_LOOP = {
    "qr": driver("Constant", value=1.0),
    "qdr": driver("Constant", value=0.0),
    "q": driver("Integrator").named("angle").by(u=driver("Integrator").named("speed").by(u="tau")),
    "qd": "speed/y",
}


@dataclass(frozen=True, kw_only=True)
class JointPidBlock(Block):
    """Base class of the PID controllers of joints; subclasses have ``lower``, ``upper`` and ``initial``."""

    Kp: ArrayLike = parameter(
        100.0,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        doc="position gains, N m/rad (N/m for a prismatic joint)",
    )
    Ki: ArrayLike = parameter(
        50.0,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        doc="integral gains, N m/(rad s) (N/(m s) for a prismatic joint)",
    )
    Kd: ArrayLike = parameter(
        20.0,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        doc="speed gains, N m s/rad (N s/m for a prismatic joint)",
    )

    def check(self) -> None:
        limits_in_order(self, "lower", "upper")
        self._shape({})

    def input_ports(self) -> tuple[Port, ...]:
        return _PORTS

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("tau", "torque or force at the joints"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"tau": self._shape(inputs)}

    def initial_states(self, p: Signals) -> Signals:
        return {"integral": p["initial"]}

    def _shape(self, inputs: Shapes) -> Shape:
        names = [rule.name for rule in self.parameters() if rule.name != "sample_time"]
        return broadcast({**inputs, **{name: shape_of(self.parameter_value(name)) for name in names}})


@dataclass(frozen=True, kw_only=True)
class JointPID(JointPidBlock):
    """PID of joints: tau = limit(Kp (qr - q) + Kd (qdr - qd) + i), i' = Ki (qr - q) + Kb (tau - unlimited).

    Each joint has its own controller. The last term, back-calculation, prevents windup of the integral at the
    torque limits; Kb = 0 disables it. The speeds are inputs; the block does not differentiate q.
    """

    following_modes: ClassVar[bool] = True
    title: ClassVar[str] = "PID Joint Controller"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="An inertia of 1 kg m^2 moves to 1 rad with a torque of at most 0.5 N m.",
        parameters={"Kp": 10.0, "Ki": 5.0, "Kd": 5.0, "lower": -0.5, "upper": 0.5},
        inputs=_EXAMPLE_LOOP,
        shown=("q", "tau"),
    )

    Kb: ArrayLike = parameter(
        1.0, kind=ParameterKind.ARRAY, minimum=0.0, doc="back-calculation gain", unit="1/s"
    )
    lower: ArrayLike = lower_limit_parameter("lower limit of the torque")
    upper: ArrayLike = upper_limit_parameter("upper limit of the torque")
    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the integral action at t = 0")

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("integral", self._shape(inputs), "the integral action"),)

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("mode", self._shape(inputs), "-1 at the lower limit, 1 at the upper limit, else 0"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        shape = self._shape(inputs)
        return (
            Guard("upper", shape, "the torque reaches its upper limit"),
            Guard("lower", shape, "the torque reaches its lower limit"),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"tau": self._limited(x, u, p)}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        excess = _unlimited_torque(x, u, p) - self._limited(x, u, p)
        return {"integral": p["Ki"] * (u["qr"] - u["q"]) - p["Kb"] * excess}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        unlimited = _unlimited_torque(x, u, p)
        return {"upper": unlimited - p["upper"], "lower": unlimited - p["lower"]}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"mode": zone(_unlimited_torque(x, u, p), p["lower"], p["upper"])}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return {"mode": zone_after(x["mode"], e)}

    def _limited(self, x: Signals, u: Signals, p: Signals) -> SX:
        below = if_else(x["mode"] < 0.0, p["lower"], _unlimited_torque(x, u, p))
        return if_else(x["mode"] > 0.0, p["upper"], below)


@dataclass(frozen=True, kw_only=True)
class SampledJointPID(JointPidBlock):
    """PID of joints at ticks: tau(k) = limit(Kp e + Kd (qdr - qd) + i(k)), i(k+1) = i(k) + T Ki e.

    e = qr - q. Each joint has its own controller. Clamping: the integral stops while the torque is at a limit
    and e drives it further beyond the limit. In a triggered subsystem, T is t(k+1) - t(k).
    """

    title: ClassVar[str] = "Sampled PID Joint Controller"
    sampled: ClassVar[bool] = True
    reads_next_period: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="An inertia of 1 kg m^2 moves to 1 rad with a torque of at most 0.5 N m, sampled every 0.1 s.",
        parameters={
            "Kp": 10.0,
            "Ki": 5.0,
            "Kd": 5.0,
            "lower": -0.5,
            "upper": 0.5,
            "sample_time": 0.1,
        },
        inputs=_EXAMPLE_LOOP,
        shown=("q", "tau"),
    )

    lower: ArrayLike = lower_limit_parameter("lower limit of the torque")
    upper: ArrayLike = upper_limit_parameter("upper limit of the torque")
    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="initial integral action")
    sample_time: ArrayLike = sample_time_parameter(1e-3)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("integral", self._shape(inputs), "the integral action"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"tau": fmin(fmax(_unlimited_torque(x, u, p), p["lower"]), p["upper"])}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        unlimited = _unlimited_torque(x, u, p)
        excess = unlimited - fmin(fmax(unlimited, p["lower"]), p["upper"])
        rate = p["Ki"] * (u["qr"] - u["q"])
        outwards = logic_and(excess != 0.0, excess * rate > 0.0)
        return {"integral": x["integral"] + p["T_next"] * if_else(outwards, 0.0, rate)}


def _unlimited_torque(x: Signals, u: Signals, p: Signals) -> SX:
    """The torque without limits."""
    return p["Kp"] * (u["qr"] - u["q"]) + p["Kd"] * (u["qdr"] - u["qd"]) + x["integral"]
