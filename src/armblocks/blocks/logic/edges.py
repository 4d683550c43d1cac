"""Sampled logic blocks with memory: edge detection, flip-flops, counters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, if_else, logic_and, logic_not
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
    driver,
    parameter,
    sample_time_parameter,
    shape_of,
)
from armblocks.diagram.signs import FaceSign, Lines, Words

_EDGE_SIGNS = {
    "change": "≠",
    "increase": "↑",
    "decrease": "↓",
    "rise positive": "↑ > 0",
    "rise nonnegative": "↑ ≥ 0",
    "fall negative": "↓ < 0",
    "fall nonpositive": "↓ ≤ 0",
}
_EDGES: Mapping[str, Callable[[SX, SX], SX]] = {
    "change": lambda u, before: u != before,
    "increase": lambda u, before: u > before,
    "decrease": lambda u, before: u < before,
    "rise positive": lambda u, before: logic_and(u > 0.0, before <= 0.0),
    "rise nonnegative": lambda u, before: logic_and(u >= 0.0, before < 0.0),
    "fall negative": lambda u, before: logic_and(u < 0.0, before >= 0.0),
    "fall nonpositive": lambda u, before: logic_and(u <= 0.0, before > 0.0),
}
_SINE = driver("SineWave", frequency=2.0)


@dataclass(frozen=True, kw_only=True)
class EdgeDetection(Block):
    """Edge detection: y(k) = 1 if the chosen edge occurs between u(k-1) and u(k), else 0.

    Simulink has one block for each edge: Detect Change, Detect Increase, Detect Decrease, Detect Rise
    Positive, Detect Rise Nonnegative, Detect Fall Negative, Detect Fall Nonpositive.
    """

    title: ClassVar[str] = "Edge Detection"
    broadcast_parameters: ClassVar[tuple[str, ...]] = ("initial",)
    sampled: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The output is 1 at each tick at which the sine has become positive.",
        parameters={"sample_time": 0.1},
        inputs={"u": _SINE},
    )

    edge: str = parameter("rise positive", choices=tuple(_EDGES), doc="the change to detect")
    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the input before the first tick")
    sample_time: ArrayLike = sample_time_parameter()

    def face_sign(self) -> FaceSign:
        return Words(_EDGE_SIGNS[self.edge])

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "signal whose changes are detected"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "1 at the edge, else 0"),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("before", self.output_shapes(inputs)["y"], "the input at the previous tick"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": _EDGES[self.edge](u["u"], x["before"])}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"before": u["u"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"before": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class SRFlipFlop(Block):
    """A set-reset flip-flop: Q(k) = 1 if S, 0 if R, Q(k-1) if neither; if both, Q and not_Q are 0."""

    title: ClassVar[str] = "S-R Flip-Flop"
    sign: ClassVar[FaceSign] = Lines(("S-R", "Flip-Flop"))
    sampled: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Set by one pulse, reset by another.",
        parameters={"sample_time": 0.1},
        inputs={
            "S": driver("PulseGenerator", period=4.0, width=10.0, delay=1.0).named("set"),
            "R": driver("PulseGenerator", period=4.0, width=10.0, delay=3.0).named("reset"),
        },
    )

    initial: bool = parameter(False, doc="whether Q is 1 before the first tick")
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("S", "Q becomes 1 if this is not 0"), Port("R", "Q becomes 0 if this is not 0"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("Q", "the state"), Port("not_Q", "1 - Q; 0 while both inputs are true"))

    def output_shapes(self, inputs: Shapes) -> Shapes:
        shape = broadcast(inputs)
        return {"Q": shape, "not_Q": shape}

    def assumed_output_shapes(self) -> Shapes:
        return {"Q": (), "not_Q": ()}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("state", broadcast(inputs), "Q at the previous tick"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        set_, reset = u["S"] != 0.0, u["R"] != 0.0
        state = if_else(reset, 0.0, if_else(set_, 1.0, x["state"]))
        return {"Q": state, "not_Q": logic_and(logic_not(state), logic_not(logic_and(set_, reset)))}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"state": self.outputs(t, x, u, p)["Q"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"state": SX(float(self.initial))}


@dataclass(frozen=True, kw_only=True)
class DFlipFlop(Block):
    """A D flip-flop with a rising clock edge: Q(k) = D(k) if CLK(k-1) <= 0 < CLK(k), else Q(k-1).

    With the trigger ``level`` it is a D latch: Q follows D while CLK is positive.
    """

    title: ClassVar[str] = "D Flip-Flop"
    sign: ClassVar[FaceSign] = Lines(("D", "Flip-Flop"))
    sampled: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The sine, sampled at each rising edge of the pulses.",
        parameters={"sample_time": 0.1},
        inputs={
            "D": driver("SineWave"),
            "CLK": driver("PulseGenerator", period=1.0, delay=0.5).named("clock"),
        },
    )

    trigger: str = parameter("rising edge", choices=("rising edge", "level"), doc="when Q is set to D")
    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="Q before the first edge")
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("D", "value of Q after the edge"), Port("CLK", "the clock", shape=()))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("Q", "the state"), Port("not_Q", "1 where Q is 0, else 0"))

    def output_shapes(self, inputs: Shapes) -> Shapes:
        shape = broadcast({"D": inputs["D"], "initial": shape_of(self.initial)})
        return {"Q": shape, "not_Q": shape}

    def assumed_output_shapes(self) -> Shapes:
        return {"Q": shape_of(self.initial), "not_Q": shape_of(self.initial)}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        shape = self.output_shapes(inputs)["Q"]
        return (
            State("state", shape, "Q at the previous tick"),
            State("clock", (), "CLK at the previous tick"),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        high = u["CLK"] > 0.0
        is_set = high if self.trigger == "level" else logic_and(high, x["clock"] <= 0.0)
        state = if_else(is_set, u["D"], x["state"])
        return {"Q": state, "not_Q": state == 0.0}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"state": self.outputs(t, x, u, p)["Q"], "clock": u["CLK"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"state": p["initial"], "clock": SX(1.0)}


@dataclass(frozen=True, kw_only=True)
class JKFlipFlop(Block):
    """A JK flip-flop with a falling clock edge: J sets Q, K resets Q, both toggle Q, else Q is constant.

    A falling edge is CLK(k-1) > 0 >= CLK(k), as in Simulink.
    """

    title: ClassVar[str] = "J-K Flip-Flop"
    sign: ClassVar[FaceSign] = Lines(("J-K", "Flip-Flop"))
    sampled: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="With J = K = 1, Q has half the frequency of the pulses.",
        parameters={"sample_time": 0.1},
        inputs={
            "J": driver("Constant", value=1.0).named("one"),
            "CLK": driver("PulseGenerator", period=1.0, delay=0.25).named("clock"),
            "K": driver("Constant", value=1.0).named("one"),
        },
    )

    initial: bool = parameter(False, doc="whether Q is 1 before the first edge")
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("J", "sets Q"), Port("CLK", "the clock", shape=()), Port("K", "resets Q"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("Q", "the state"), Port("not_Q", "the negation of Q"))

    def output_shapes(self, inputs: Shapes) -> Shapes:
        shape = broadcast({"J": inputs["J"], "K": inputs["K"]})
        return {"Q": shape, "not_Q": shape}

    def assumed_output_shapes(self) -> Shapes:
        return {"Q": (), "not_Q": ()}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        shape = self.output_shapes(inputs)["Q"]
        return (
            State("state", shape, "Q at the previous tick"),
            State("clock", (), "CLK at the previous tick"),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        falls = logic_and(u["CLK"] <= 0.0, x["clock"] > 0.0)
        # The characteristic equation: the next Q is J if Q is 0, and not K if Q is 1.
        after = if_else(x["state"], u["K"] == 0.0, u["J"] != 0.0)
        state = if_else(falls, after, x["state"])
        return {"Q": state, "not_Q": logic_not(state)}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"state": self.outputs(t, x, u, p)["Q"], "clock": u["CLK"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"state": SX(float(self.initial)), "clock": SX(0.0)}


@dataclass(frozen=True, kw_only=True)
class Counter(Block):
    """A counter of rising edges: y(k) = y(k-1) + 1 if u(k-1) <= 0 < u(k); ``initial`` during a reset."""

    title: ClassVar[str] = "Counter"
    sampled: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The periods of a sine are counted until a step resets the count.",
        parameters={"sample_time": 0.1},
        inputs={"u": _SINE, "reset": driver("Step", time=8.0).named("reset")},
    )

    initial: float = parameter(0.0, doc="the count at the start and after a reset")
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (
            Port("u", "signal whose rising edges are counted"),
            Port("reset", "the count is initial while this is not 0", shape=()),
        )

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the count"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": inputs["u"]}

    def assumed_output_shapes(self) -> Shapes:
        return {"y": ()}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        before = State("before", inputs["u"], "the input at the previous tick")
        return (State("count", inputs["u"], "the count"), before)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        edge = logic_and(u["u"] > 0.0, x["before"] <= 0.0)
        return {"y": if_else(u["reset"] != 0.0, p["initial"], x["count"] + edge)}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"count": self.outputs(t, x, u, p)["y"], "before": u["u"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"count": p["initial"], "before": SX(1.0)}
