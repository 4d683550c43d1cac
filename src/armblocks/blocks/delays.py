"""Blocks that hold and delay: the input as it was at this or an earlier tick.

In their equations k counts the ticks and T is the period of the clock.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, vertcat
from numpy.typing import ArrayLike

from armblocks.diagram import (
    Block,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    broadcast,
    made,
    parameter,
    sample_time_parameter,
    shape_of,
)
from armblocks.errors import InputError

INPUT = Port("u", "what is sampled")
OUTPUT = Port("y", "what is held")


@dataclass(frozen=True, kw_only=True)
class UnitDelay(Block):
    """The input one tick before: y(k) = u(k-1), y(0) = initial."""

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Unit Delay"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The sine as it was one tick ago, held until the next.",
    )
    sampled: ClassVar[bool] = True

    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the output at the first tick")
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (INPUT,)

    def output_ports(self) -> tuple[Port, ...]:
        return (OUTPUT,)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast({**inputs, "initial": shape_of(self.initial)})}

    def assumed_output_shapes(self) -> Shapes:
        return {"y": shape_of(self.initial)}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", self.output_shapes(inputs)["y"], "the input at the tick before"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["x"]}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": u["u"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}

    def initial_outputs(self, p: Signals) -> Signals:
        return {"y": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class Memory(Block):
    """The input at the tick before, as Simulink's Memory with a sample time: y(k) = u(k-1), y(0) = initial.

    Simulink's Memory in a continuous part gives the input one solver step before. What that is depends on
    the solver, so it has no place here: with the sample time -1 behind continuous signals it is refused.
    There a Transport Delay says how long ago; a Unit Delay or this block, with a period, says when to look.
    """

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Memory"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The sampled sine one tick late: the sample time is that of what feeds it.",
        parameters={"sample_time": -1.0},
        inputs={"u": made("ZeroOrderHold", sample_time=0.5).by(u=made("SineWave"))},
    )
    sampled: ClassVar[bool] = True

    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the output at the first tick")
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (INPUT,)

    def output_ports(self) -> tuple[Port, ...]:
        return (OUTPUT,)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast({**inputs, "initial": shape_of(self.initial)})}

    def assumed_output_shapes(self) -> Shapes:
        return {"y": shape_of(self.initial)}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", self.output_shapes(inputs)["y"], "the input at the tick before"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["x"]}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": u["u"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}

    def initial_outputs(self, p: Signals) -> Signals:
        return {"y": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class Delay(Block):
    """The input some ticks before: y(k) = u(k - length), y = initial for k < length."""

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Delay"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The sine as it was two ticks ago.",
    )
    sampled: ClassVar[bool] = True

    length: int = parameter(2, minimum=1, doc="by how many ticks")
    initial: float = parameter(0.0, doc="every element of the first outputs")
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (INPUT,)

    def output_ports(self) -> tuple[Port, ...]:
        return (OUTPUT,)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        if len(inputs["u"]) > 1:
            raise InputError(f"'u' has shape {inputs['u']}", allowed="a scalar or a vector")
        return {"y": inputs["u"]}

    def assumed_output_shapes(self) -> Shapes:
        return {"y": ()}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (self.length, math.prod(inputs["u"])), "the last inputs, the oldest first"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["x"][0, :].T}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": vertcat(x["x"][1:, :], u["u"].T)}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}

    def initial_outputs(self, p: Signals) -> Signals:
        return {"y": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class TappedDelay(Block):
    """The last inputs in one vector: y(k) = [u(k - length), …, u(k - 1)]."""

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Tapped Delay"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The last four samples of the sine, side by side.",
    )
    sampled: ClassVar[bool] = True

    length: int = parameter(4, minimum=1, doc="how many inputs are kept")
    initial: float = parameter(0.0, doc="every element at the first tick")
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "what is sampled", shape=()),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the last inputs, the oldest first", shape=(self.length,)),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (self.length,), "the last inputs, the oldest first"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["x"]}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": vertcat(x["x"][1:], u["u"])}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}

    def initial_outputs(self, p: Signals) -> Signals:
        return {"y": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class ZeroOrderHold(Block):
    """The input as it was at the last tick: y(t) = u(k T) until the next one."""

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Zero-Order Hold"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The sine as it was at the last tick.",
    )
    sampled: ClassVar[bool] = True

    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (INPUT,)

    def output_ports(self) -> tuple[Port, ...]:
        return (OUTPUT,)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": u["u"]}


@dataclass(frozen=True, kw_only=True)
class RateTransition(Block):
    """Hands a signal from one sample time to another: y(t) = u(k T) at the ticks of the receiving clock.

    Where both clocks tick at the same instant, the value of that instant is handed over.
    """

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Rate Transition"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A signal of ticks every 0.2 s, handed to a part that ticks every second.",
        inputs={"u": made("ZeroOrderHold", sample_time=0.2).by(u=made("SineWave"))},
    )
    sampled: ClassVar[bool] = True

    sample_time: ArrayLike = sample_time_parameter(1.0)

    def input_ports(self) -> tuple[Port, ...]:
        return (INPUT,)

    def output_ports(self) -> tuple[Port, ...]:
        return (OUTPUT,)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": u["u"]}
