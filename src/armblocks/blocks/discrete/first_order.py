"""Sampled first-order transfer functions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
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
    sample_time_parameter,
)
from armblocks.diagram.signs import FaceSign, Fraction, minus, value_text


@dataclass(frozen=True, kw_only=True)
class TransferFunctionFirstOrder(Block):
    """A sampled first-order lag with unit steady-state gain: y(k) = pole y(k-1) + (1 - pole) u(k)."""

    title: ClassVar[str] = "Transfer Fcn First Order"
    broadcast_parameters: ClassVar[tuple[str, ...]] = ("pole", "initial")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The step response: at each tick the output moves by a fifth of the remaining distance.",
        parameters={"pole": 0.8},
        inputs={"u": driver("Step")},
    )
    sampled: ClassVar[bool] = True

    pole: ArrayLike = parameter(0.95, kind=ParameterKind.ARRAY, doc="the pole in the z plane")
    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the output before the first tick")
    sample_time: ArrayLike = sample_time_parameter()

    def face_sign(self) -> FaceSign:
        return Fraction(
            f"{value_text(1.0 - np.asarray(self.pole, dtype=np.float64))} z", f"z {minus(self.pole)}"
        )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the input"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the lagging output"),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", self.output_shapes(inputs)["y"], "the output at the previous tick"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": p["pole"] * x["x"] + (1.0 - p["pole"]) * u["u"]}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": self.outputs(t, x, u, p)["y"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}

    def initial_outputs(self, p: Signals) -> Signals:
        return {"y": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class TransferFunctionLeadOrLag(Block):
    """A sampled compensator: y(k) = pole y(k-1) + u(k) - zero u(k-1), which is (z - zero) / (z - pole).

    It is a lead compensator if zero > pole, else a lag compensator. Its gain is 1 at high frequency and (1 -
    zero) / (1 - pole) in steady state.
    """

    title: ClassVar[str] = "Transfer Fcn Lead or Lag"
    broadcast_parameters: ClassVar[tuple[str, ...]] = ("pole", "zero", "initial", "initial_input")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The step response goes from 1 to (1 - zero) / (1 - pole) = 2.5.",
        parameters={"pole": 0.8, "zero": 0.5},
        inputs={"u": driver("Step")},
    )
    sampled: ClassVar[bool] = True

    pole: ArrayLike = parameter(0.95, kind=ParameterKind.ARRAY, doc="the pole in the z plane")
    zero: ArrayLike = parameter(0.75, kind=ParameterKind.ARRAY, doc="the zero in the z plane")
    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the output before the first tick")
    initial_input: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the input before the first tick")
    sample_time: ArrayLike = sample_time_parameter()

    def face_sign(self) -> FaceSign:
        return Fraction(f"z {minus(self.zero)}", f"z {minus(self.pole)}")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the input"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the compensated signal"),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", self.output_shapes(inputs)["y"], "pole y - zero u of the previous tick"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["x"] + u["u"]}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": p["pole"] * (x["x"] + u["u"]) - p["zero"] * u["u"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["pole"] * p["initial"] - p["zero"] * p["initial_input"]}

    def initial_outputs(self, p: Signals) -> Signals:
        return {"y": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class TransferFunctionRealZero(Block):
    """A sampled zero: y(k) = u(k) - zero u(k-1), which is (z - zero) / z."""

    title: ClassVar[str] = "Transfer Fcn Real Zero"
    broadcast_parameters: ClassVar[tuple[str, ...]] = ("zero", "initial_input")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The step response: 1 for one tick, then 1 - zero = 0.25.",
        inputs={"u": driver("Step")},
    )
    sampled: ClassVar[bool] = True

    zero: ArrayLike = parameter(0.75, kind=ParameterKind.ARRAY, doc="the zero in the z plane")
    initial_input: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the input before the first tick")
    sample_time: ArrayLike = sample_time_parameter()

    def face_sign(self) -> FaceSign:
        return Fraction(f"z {minus(self.zero)}", "z")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the input"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the input minus zero times the previous input"),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", self.output_shapes(inputs)["y"], "the input at the previous tick"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": u["u"] - p["zero"] * x["x"]}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": u["u"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial_input"]}
