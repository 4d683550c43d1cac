"""Blocks that hold or delay the input: its value at this or an earlier tick.

In their equations k counts the ticks and T is the period of the clock.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, if_else, logic_or, repmat, vertcat
from numpy.typing import ArrayLike

from armblocks.blocks.external_resets import (
    PREVIOUS_TRIGGER,
    external_reset_parameter,
    fires_at_tick,
    initial_source_parameter,
    reset_ports,
    trigger_state,
)
from armblocks.diagram import (
    Block,
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
from armblocks.diagram.signs import FaceSign, Words, stairs, superscript
from armblocks.equations import Shape
from armblocks.errors import InputError

INPUT = Port("u", "sampled signal")
OUTPUT = Port("y", "the delayed or held signal")


@dataclass(frozen=True, kw_only=True)
class OneTickDelay(Block):
    """Base class of Unit Delay and Memory."""

    broadcast_parameters: ClassVar[tuple[str, ...]] = ("initial",)
    sampled: ClassVar[bool] = True

    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the output at the first tick")
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (INPUT,)

    def bus_inputs(self) -> tuple[str, ...]:
        return ("u",)

    def output_ports(self) -> tuple[Port, ...]:
        return (OUTPUT,)

    def assumed_output_shapes(self) -> Shapes:
        return {"y": shape_of(self.initial)}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", self.output_shapes(inputs)["y"], "the input at the previous tick"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["x"]}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": u["u"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}

    def initial_outputs(self, p: Signals) -> Signals:
        return {"y": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class UnitDelay(OneTickDelay):
    """A delay of one tick: y(k) = u(k-1), y(0) = initial."""

    title: ClassVar[str] = "Unit Delay"
    sign: ClassVar[FaceSign] = Words("z⁻¹")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The sine, delayed by one tick and held until the next tick.",
    )


@dataclass(frozen=True, kw_only=True)
class Memory(OneTickDelay):
    """A delay of one tick, like Simulink's Memory with a sample time: y(k) = u(k-1), y(0) = initial.

    With a continuous input, Simulink's Memory outputs the input at the previous solver step, which depends on
    the solver. This block does not support that: the sample time -1 with a continuous input is an error. Use
    a Transport Delay instead, or set a sample time for this block.
    """

    title: ClassVar[str] = "Memory"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The sampled sine, delayed by one tick; the sample time is inherited from the input.",
        parameters={"sample_time": -1.0},
        inputs={"u": driver("ZeroOrderHold", sample_time=0.5).by(u=driver("SineWave"))},
    )


@dataclass(frozen=True, kw_only=True)
class Delay(Block):
    """A delay of a fixed number of ticks: y(k) = u(k - length), y = initial for k < length."""

    title: ClassVar[str] = "Delay"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The sine, delayed by two ticks.",
    )
    sampled: ClassVar[bool] = True

    length: int = parameter(2, minimum=1, doc="delay in ticks")
    initial: float = parameter(0.0, doc="initial output, for each element")
    sample_time: ArrayLike = sample_time_parameter()

    def face_sign(self) -> FaceSign:
        return Words(f"z{superscript(-self.length)}")

    def input_ports(self) -> tuple[Port, ...]:
        return (INPUT,)

    def bus_inputs(self) -> tuple[str, ...]:
        return ("u",)

    def output_ports(self) -> tuple[Port, ...]:
        return (OUTPUT,)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": _vector_shape(inputs["u"])}

    def assumed_output_shapes(self) -> Shapes:
        return {"y": ()}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (self.length, math.prod(inputs["u"])), "the last inputs, oldest first"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["x"][0, :].T}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": vertcat(x["x"][1:, :], u["u"].T)}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}

    def initial_outputs(self, p: Signals) -> Signals:
        return {"y": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class ResettableDelay(Block):
    """A delay with reset: y(k) = u(k - length), or initial for length ticks after the start or a reset.

    The block corresponds to Simulink's Delay with its optional ports. At the tick of a reset y and all values
    in the delay buffer become the initial value. With ``enable_port`` the block holds its state and output at
    every tick at which the input enable is 0.
    """

    title: ClassVar[str] = "Resettable Delay"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A sine delayed by three ticks and reset to -1 at each rising edge of the pulses.",
        parameters={"length": 3, "external_reset": "rising", "sample_time": 0.1},
        inputs={
            "u": driver("SineWave"),
            "reset": driver("PulseGenerator", period=4.0, delay=2.0),
            "initial": driver("Constant", value=-1.0),
        },
    )
    sampled: ClassVar[bool] = True

    length: int = parameter(2, minimum=1, doc="delay in ticks")
    external_reset: str = external_reset_parameter("level")
    initial_condition_source: str = initial_source_parameter("external")
    initial: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, doc="the initial output, also after a reset, if no port gives it"
    )
    enable_port: bool = parameter(
        False, doc="whether the block has an input enable, which stops it while it is 0"
    )
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        enable = Port("enable", "not 0 while the block is enabled", shape=())
        further = reset_ports(self.external_reset, self.initial_condition_source)
        return (INPUT, *((enable,) if self.enable_port else ()), *further)

    def bus_inputs(self) -> tuple[str, ...]:
        return ("u",)

    def output_ports(self) -> tuple[Port, ...]:
        return (OUTPUT,)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        signal_shapes = {name: shape for name, shape in inputs.items() if name in ("u", "initial")}
        return {"y": _vector_shape(broadcast({**signal_shapes, "initial value": shape_of(self.initial)}))}

    def assumed_output_shapes(self) -> Shapes:
        return {"y": shape_of(self.initial)}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        shape = self.output_shapes(inputs)["y"]
        history = State("x", (self.length, math.prod(shape)), "the last inputs, oldest first")
        held = (State("held", shape, "the output at the previous tick"),)
        return (history, PREVIOUS_TRIGGER, *(held if self.enable_port else ()))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        oldest = x["x"][0, :].T
        output = if_else(self._resets(x, u), self._start(u, p) + SX.zeros(*oldest.shape), oldest)
        return {"y": if_else(u["enable"] != 0.0, output, x["held"]) if self.enable_port else output}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        history = x["x"]
        row = SX.zeros(1, history.shape[1])
        start = repmat(self._start(u, p).T + row, self.length, 1)
        buffer = if_else(self._resets(x, u), start, history)
        after = {"x": vertcat(buffer[1:, :], u["u"].T + row), "previous": self._side(u)}
        if not self.enable_port:
            return after
        enabled = u["enable"] != 0.0
        held = {"held": self.outputs(t, x, u, p)["y"]}
        return {name: if_else(enabled, value, x[name]) for name, value in after.items()} | held

    def initial_states(self, p: Signals) -> Signals:
        many = p["initial"].numel() > 1
        history = repmat(p["initial"].T, self.length, 1) if many else p["initial"]
        return {"x": history, "previous": SX(-1.0), **({"held": p["initial"]} if self.enable_port else {})}

    def initial_outputs(self, p: Signals) -> Signals:
        return {"y": p["initial"]}

    def _side(self, u: Signals) -> SX:
        return SX(0.0) if self.external_reset == "none" else trigger_state(self.external_reset, u["reset"])

    def _start(self, u: Signals, p: Signals) -> SX:
        return u.get("initial", p["initial"])

    def _resets(self, x: Signals, u: Signals) -> SX:
        """1 at a reset by the trigger, and at the first tick if a port gives the initial value; else 0."""
        first = x["previous"] < 0.0 if self.initial_condition_source == "external" else SX(0.0)
        if self.external_reset == "none":
            return first
        return logic_or(first, fires_at_tick(self.external_reset, u["reset"], x["previous"]))


def _vector_shape(shape: Shape) -> Shape:
    """The shape; raises ``InputError`` for a matrix, because the delay buffer holds vectors."""
    if len(shape) > 1:
        raise InputError(
            f"'u' has shape {shape}",
            allowed="a scalar or a vector",
            fix="put a Reshape before the block",
        )
    return shape


@dataclass(frozen=True, kw_only=True)
class TappedDelay(Block):
    """A tapped delay; the output vector holds the last inputs: y(k) = [u(k - length), …, u(k - 1)]."""

    title: ClassVar[str] = "Tapped Delay"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The last four samples of the sine in one vector.",
    )
    sampled: ClassVar[bool] = True

    length: int = parameter(4, minimum=1, doc="number of inputs in the buffer")
    initial: float = parameter(0.0, doc="initial value of every element")
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "sampled signal", shape=()),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the last inputs, oldest first", shape=(self.length,)),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (self.length,), "the last inputs, oldest first"),)

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
    """A zero-order hold: y(t) = u(k T) from tick k until the next tick."""

    title: ClassVar[str] = "Zero-Order Hold"
    sign: ClassVar[FaceSign] = stairs((0.2, 0.7, 1.0, 0.6))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The sine at the last tick.",
    )
    sampled: ClassVar[bool] = True

    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (INPUT,)

    def bus_inputs(self) -> tuple[str, ...]:
        return ("u",)

    def output_ports(self) -> tuple[Port, ...]:
        return (OUTPUT,)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": u["u"]}


@dataclass(frozen=True, kw_only=True)
class RateTransition(Block):
    """Transfers a signal from one sample time to another: y(t) = u(k T) at the ticks of the receiving clock.

    If both clocks tick at the same time, the output is the input at that tick.
    """

    title: ClassVar[str] = "Rate Transition"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A signal with a sample time of 0.2 s, transferred to a part with a sample time of 1 s.",
        inputs={"u": driver("ZeroOrderHold", sample_time=0.2).by(u=driver("SineWave"))},
    )
    sampled: ClassVar[bool] = True

    sample_time: ArrayLike = sample_time_parameter(1.0)

    def input_ports(self) -> tuple[Port, ...]:
        return (INPUT,)

    def bus_inputs(self) -> tuple[str, ...]:
        return ("u",)

    def output_ports(self) -> tuple[Port, ...]:
        return (OUTPUT,)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": u["u"]}
