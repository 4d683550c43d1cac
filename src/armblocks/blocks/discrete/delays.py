"""Blocks that hold and delay: the input as it was at this or an earlier tick.

In their equations k counts the ticks and T is the period of the clock.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, if_else, logic_or, repmat, vertcat
from numpy.typing import ArrayLike

from armblocks.blocks.external_resets import (
    SEEN,
    external_reset_parameter,
    fires_at_tick,
    initial_source_parameter,
    reset_ports,
    side_of,
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
    made,
    parameter,
    sample_time_parameter,
    shape_of,
)
from armblocks.diagram.signs import FaceSign, Words, raised, stairs
from armblocks.equations import Shape
from armblocks.errors import InputError

INPUT = Port("u", "what is sampled")
OUTPUT = Port("y", "what is held")


@dataclass(frozen=True, kw_only=True)
class OneTickDelay(Block):
    """What a Unit Delay and a Memory with a sample time are."""

    spreads: ClassVar[tuple[str, ...]] = ("initial",)
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
class UnitDelay(OneTickDelay):
    """The input one tick before: y(k) = u(k-1), y(0) = initial."""

    title: ClassVar[str] = "Unit Delay"
    sign: ClassVar[FaceSign] = Words("z⁻¹")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The sine as it was one tick ago, held until the next.",
    )


@dataclass(frozen=True, kw_only=True)
class Memory(OneTickDelay):
    """The input at the tick before, as Simulink's Memory with a sample time: y(k) = u(k-1), y(0) = initial.

    Simulink's Memory in a continuous part gives the input one solver step before. What that is depends on
    the solver, so it has no place here: with the sample time -1 behind continuous signals it is refused.
    There a Transport Delay says how long ago; a Unit Delay or this block, with a period, says when to look.
    """

    title: ClassVar[str] = "Memory"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The sampled sine one tick late: the sample time is that of what feeds it.",
        parameters={"sample_time": -1.0},
        inputs={"u": made("ZeroOrderHold", sample_time=0.5).by(u=made("SineWave"))},
    )


@dataclass(frozen=True, kw_only=True)
class Delay(Block):
    """The input some ticks before: y(k) = u(k - length), y = initial for k < length."""

    title: ClassVar[str] = "Delay"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The sine as it was two ticks ago.",
    )
    sampled: ClassVar[bool] = True

    length: int = parameter(2, minimum=1, doc="by how many ticks")
    initial: float = parameter(0.0, doc="every element of the first outputs")
    sample_time: ArrayLike = sample_time_parameter()

    def face_sign(self) -> FaceSign:
        return Words(f"z{raised(-self.length)}")

    def input_ports(self) -> tuple[Port, ...]:
        return (INPUT,)

    def bus_inputs(self) -> tuple[str, ...]:
        return ("u",)

    def output_ports(self) -> tuple[Port, ...]:
        return (OUTPUT,)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": _a_vector(inputs["u"])}

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
class ResettableDelay(Block):
    """A delay that starts anew at a trigger: y(k) = u(k - length), or initial where k - length is before it.

    It is Simulink's Delay with its ports. At the tick of a reset y is the initial value, and all that is on
    its way becomes that value. With ``enable_port`` the block stands still, y held, at ticks at which the
    input enable is 0.
    """

    title: ClassVar[str] = "Resettable Delay"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A sine three ticks late, begun anew from -1 at each rising edge of the pulses.",
        parameters={"length": 3, "external_reset": "rising", "sample_time": 0.1},
        inputs={
            "u": made("SineWave"),
            "reset": made("PulseGenerator", period=4.0, delay=2.0),
            "initial": made("Constant", value=-1.0),
        },
    )
    sampled: ClassVar[bool] = True

    length: int = parameter(2, minimum=1, doc="by how many ticks")
    external_reset: str = external_reset_parameter("level")
    initial_condition_source: str = initial_source_parameter("external")
    initial: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, doc="the first outputs, and those after a reset, where no port says it"
    )
    enable_port: bool = parameter(False, doc="whether the block works at ticks only at which enable is not 0")
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        enable = Port("enable", "not 0 where the block works", shape=())
        further = reset_ports(self.external_reset, self.initial_condition_source)
        return (INPUT, *((enable,) if self.enable_port else ()), *further)

    def bus_inputs(self) -> tuple[str, ...]:
        return ("u",)

    def output_ports(self) -> tuple[Port, ...]:
        return (OUTPUT,)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        wide = {name: shape for name, shape in inputs.items() if name in ("u", "initial")}
        return {"y": _a_vector(broadcast({**wide, "initial value": shape_of(self.initial)}))}

    def assumed_output_shapes(self) -> Shapes:
        return {"y": shape_of(self.initial)}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        shape = self.output_shapes(inputs)["y"]
        past = State("x", (self.length, math.prod(shape)), "the last inputs, the oldest first")
        held = (State("held", shape, "the output at the tick before"),)
        return (past, SEEN, *(held if self.enable_port else ()))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        oldest = x["x"][0, :].T
        fresh = if_else(self._anew(x, u), self._start(u, p) + SX.zeros(*oldest.shape), oldest)
        return {"y": if_else(u["enable"] != 0.0, fresh, x["held"]) if self.enable_port else fresh}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        past = x["x"]
        row = SX.zeros(1, past.shape[1])
        start = repmat(self._start(u, p).T + row, self.length, 1)
        now = if_else(self._anew(x, u), start, past)
        after = {"x": vertcat(now[1:, :], u["u"].T + row), "seen": self._side(u)}
        if not self.enable_port:
            return after
        works = u["enable"] != 0.0
        held = {"held": self.outputs(t, x, u, p)["y"]}
        return {name: if_else(works, value, x[name]) for name, value in after.items()} | held

    def initial_states(self, p: Signals) -> Signals:
        many = p["initial"].numel() > 1
        past = repmat(p["initial"].T, self.length, 1) if many else p["initial"]
        return {"x": past, "seen": SX(-1.0), **({"held": p["initial"]} if self.enable_port else {})}

    def initial_outputs(self, p: Signals) -> Signals:
        return {"y": p["initial"]}

    def _side(self, u: Signals) -> SX:
        return SX(0.0) if self.external_reset == "none" else side_of(self.external_reset, u["reset"])

    def _start(self, u: Signals, p: Signals) -> SX:
        return u.get("initial", p["initial"])

    def _anew(self, x: Signals, u: Signals) -> SX:
        """1 at the first tick where a port says the start value, and where the trigger fires."""
        first = x["seen"] < 0.0 if self.initial_condition_source == "external" else SX(0.0)
        if self.external_reset == "none":
            return first
        return logic_or(first, fires_at_tick(self.external_reset, u["reset"], x["seen"]))


def _a_vector(shape: Shape) -> Shape:
    """The shape; raises ``InputError`` for a matrix, which a row of the past does not hold."""
    if len(shape) > 1:
        raise InputError(
            f"'u' has shape {shape}",
            allowed="a scalar or a vector",
            fix="put a Reshape before the block",
        )
    return shape


@dataclass(frozen=True, kw_only=True)
class TappedDelay(Block):
    """The last inputs in one vector: y(k) = [u(k - length), …, u(k - 1)]."""

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

    title: ClassVar[str] = "Zero-Order Hold"
    sign: ClassVar[FaceSign] = stairs((0.2, 0.7, 1.0, 0.6))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The sine as it was at the last tick.",
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
    """Hands a signal from one sample time to another: y(t) = u(k T) at the ticks of the receiving clock.

    Where both clocks tick at the same instant, the value of that instant is handed over.
    """

    title: ClassVar[str] = "Rate Transition"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A signal of ticks every 0.2 s, handed to a part that ticks every second.",
        inputs={"u": made("ZeroOrderHold", sample_time=0.2).by(u=made("SineWave"))},
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
