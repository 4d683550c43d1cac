"""First-order and second-order lags and the lead-lag compensator; all gains are tunable."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX
from numpy.typing import ArrayLike

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
from armblocks.diagram.signs import FaceSign, Fraction, value_text


def _lag(time: object) -> str:
    """The polynomial T s + 1 as text."""
    return f"{'' if value_text(time) == '1' else value_text(time)}s + 1"


@dataclass(frozen=True, kw_only=True)
class FirstOrderLag(Block):
    """A first-order lag (PT1): y = gain / (T s + 1) u, that is T y' = gain u - y."""

    title: ClassVar[str] = "First-Order Lag"
    broadcast_parameters: ClassVar[tuple[str, ...]] = ("gain", "time_constant", "initial")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The step response: 63 % after one time constant of 2 s.",
        parameters={"time_constant": 2.0},
        inputs={"u": driver("Step")},
    )

    gain: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="steady-state gain y / u")
    time_constant: ArrayLike = parameter(
        1.0, kind=ParameterKind.ARRAY, above=0.0, doc="time constant T", unit="s"
    )
    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the output at t = 0")

    def face_sign(self) -> FaceSign:
        return Fraction(value_text(self.gain), _lag(self.time_constant))

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the input"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the lagging output"),)

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("y", self.output_shapes(inputs)["y"], "the output"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["y"]}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": (p["gain"] * u["u"] - x["y"]) / p["time_constant"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"y": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class SecondOrderLag(Block):
    """A second-order lag (PT2): y = gain w^2 / (s^2 + 2 damping w s + w^2) u, initially at rest."""

    title: ClassVar[str] = "Second-Order Lag"
    sign: ClassVar[FaceSign] = Fraction("ω²", "s² + 2ζωs + ω²")
    broadcast_parameters: ClassVar[tuple[str, ...]] = ("gain", "natural_frequency", "damping")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The step response with a damping ratio of 0.3: it overshoots and settles.",
        parameters={"natural_frequency": 2.0, "damping": 0.3},
        inputs={"u": driver("Step")},
    )

    gain: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="steady-state gain y / u")
    natural_frequency: ArrayLike = parameter(
        1.0, kind=ParameterKind.ARRAY, above=0.0, doc="undamped natural frequency w", unit="rad/s"
    )
    damping: ArrayLike = parameter(
        0.7, kind=ParameterKind.ARRAY, minimum=0.0, doc="damping ratio; 1 is critical"
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the input"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the lagging output"), Port("rate", "its time derivative"))

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        shape = self.output_shapes(inputs)["y"]
        return (State("y", shape, "the output"), State("rate", shape, "its time derivative"))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["y"], "rate": x["rate"]}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        w = p["natural_frequency"]
        acceleration_by_w = w * (p["gain"] * u["u"] - x["y"]) - 2.0 * p["damping"] * x["rate"]
        return {"y": x["rate"], "rate": w * acceleration_by_w}

    def initial_states(self, p: Signals) -> Signals:
        return {"y": SX(0.0), "rate": SX(0.0)}


@dataclass(frozen=True, kw_only=True)
class LeadLag(Block):
    """A lead or lag compensator: y = gain (T1 s + 1) / (T2 s + 1) u, initially at rest.

    The block leads (positive phase) for T1 > T2 and lags (negative phase) for T1 < T2.
    """

    title: ClassVar[str] = "Lead-Lag"
    broadcast_parameters: ClassVar[tuple[str, ...]] = ("gain", "lead_time", "lag_time")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The step response of a lead starts above its final value and decays to it.",
        parameters={"lead_time": 2.0, "lag_time": 1.0},
        inputs={"u": driver("Step")},
    )

    gain: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="steady-state gain y / u")
    lead_time: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="lead time constant T1", unit="s")
    lag_time: ArrayLike = parameter(
        0.1, kind=ParameterKind.ARRAY, above=0.0, doc="lag time constant T2", unit="s"
    )

    def face_sign(self) -> FaceSign:
        return Fraction(_lag(self.lead_time), _lag(self.lag_time))

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the input"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the compensated signal"),)

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", self.output_shapes(inputs)["y"], "u after a lag with time constant T2"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        ratio = p["lead_time"] / p["lag_time"]
        return {"y": p["gain"] * (x["x"] + ratio * (u["u"] - x["x"]))}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": (u["u"] - x["x"]) / p["lag_time"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": SX(0.0)}
