"""Transport delays: the input delayed by a constant or variable time, including jumps and kinks.

Sources: Bellen and Zennaro, Numerical Methods for Delay Differential Equations, 2003, chapters 2 and 4 (steps
that end at propagated discontinuities, dense output as history).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, fmax, fmin, if_else
from numpy.typing import ArrayLike

from armblocks.blocks.switching import limits_in_order
from armblocks.diagram import (
    Block,
    DelayLine,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    broadcast,
    driver,
    parameter,
    shape_of,
)
from armblocks.diagram.signs import FaceSign, Words


@dataclass(frozen=True, kw_only=True)
class TransportDelay(Block):
    """A constant transport delay: y(t) = u(t - delay), and ``initial`` for t < delay.

    The delay buffer has the accuracy of the solver. A jump of the input appears at the output exactly one
    delay later. No step is longer than the delay.
    """

    title: ClassVar[str] = "Transport Delay"
    sign: ClassVar[FaceSign] = Words("u(t − T)")
    broadcast_parameters: ClassVar[tuple[str, ...]] = ("initial",)
    differentiated_inputs: ClassVar[tuple[str, ...]] = ("u",)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A step and a sine, both delayed by one second.",
        inputs={"u": driver("Sum").by(u1=driver("Step", time=2.0), u2=driver("SineWave"))},
    )

    delay: float = parameter(1.0, above=0.0, doc="the delay", unit="s")
    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the output for t < delay")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "signal to delay"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the delayed signal"),)

    def assumed_output_shapes(self) -> Shapes:
        return {"y": shape_of(self.initial)}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def delay_lines(self, inputs: Shapes) -> tuple[DelayLine, ...]:
        return (DelayLine("past", self.output_shapes(inputs)["y"], "the delayed signal", "u"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["past"]}

    def delay_times(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"past": p["delay"]}

    def delay_bounds(self, p: Signals) -> Mapping[str, tuple[SX, SX]]:
        return {"past": (p["delay"], p["delay"])}

    def initial_history(self, p: Signals) -> Signals:
        return {"past": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class VariableTimeDelay(Block):
    """A variable time delay: y(t) = u(t - d(t)), with d limited to ``shortest`` … ``longest``.

    No step is longer than ``shortest``. A jump of the input causes a jump of the output, and the
    time of the output jump is not located as an event.
    """

    title: ClassVar[str] = "Variable Time Delay"
    sign: ClassVar[FaceSign] = Words("u(t − d)")
    differentiated_inputs: ClassVar[tuple[str, ...]] = ("u",)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A sine whose delay grows from 0.1 s to 2 s: the output has a lower frequency.",
        inputs={"u": driver("SineWave", frequency=3.0), "d": driver("Ramp", slope=0.3)},
    )

    shortest: float = parameter(0.1, above=0.0, doc="the shortest delay", unit="s")
    longest: float = parameter(2.0, above=0.0, doc="the longest delay", unit="s")
    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the input for t < 0")

    def check(self) -> None:
        limits_in_order(self, "shortest", "longest")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "signal to delay"), Port("d", "the delay", "s", shape=()))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the delayed signal"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast({"u": inputs["u"], "initial": shape_of(self.initial)})}

    def assumed_output_shapes(self) -> Shapes:
        return {"y": shape_of(self.initial)}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def delay_lines(self, inputs: Shapes) -> tuple[DelayLine, ...]:
        return (DelayLine("past", self.output_shapes(inputs)["y"], "the delayed signal", "u"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["past"]}

    def delay_times(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"past": fmin(fmax(u["d"], p["shortest"]), p["longest"])}

    def delay_bounds(self, p: Signals) -> Mapping[str, tuple[SX, SX]]:
        return {"past": (p["shortest"], p["longest"])}

    def initial_history(self, p: Signals) -> Signals:
        return {"past": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class VariableTransportDelay(Block):
    """A transport delay in a pipe: y(t) = u(t - d). The input T is the transit time at the inlet.

    The flow between t - d and t fills the pipe, so the integral of 1/T over that time is 1. Therefore
    d' = 1 - T(t - d) / T(t). This is Simulink's Variable Transport Delay. (For a Variable Time
    Delay, the input is d itself.) A transit time of 0 or below ends the run with an error.
    """

    title: ClassVar[str] = "Variable Transport Delay"
    sign: ClassVar[FaceSign] = Words("u(t − τ)")
    differentiated_inputs: ClassVar[tuple[str, ...]] = ("u", "T")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The flow in a pipe slows down and its transit time grows from 1 s: the sine is delayed more "
        "and more.",
        inputs={"u": driver("SineWave", frequency=2.0), "T": driver("Ramp", slope=0.2, initial=1.0)},
    )

    initial_delay: float = parameter(1.0, above=0.0, doc="the transit time for t <= 0", unit="s")
    shortest: float = parameter(0.1, above=0.0, doc="lower limit of the delay", unit="s")
    longest: float = parameter(10.0, above=0.0, doc="upper limit of the delay", unit="s")
    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the input for t < 0")

    def check(self) -> None:
        limits_in_order(self, "shortest", "longest")

    def input_ports(self) -> tuple[Port, ...]:
        return (
            Port("u", "the signal at the inlet"),
            Port("T", "the transit time at the inlet, above 0", "s", shape=()),
        )

    def output_ports(self) -> tuple[Port, ...]:
        return (
            Port("y", "signal at the outlet"),
            Port("delay", "the delay of the signal at the outlet", "s", shape=()),
        )

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast({"u": inputs["u"], "initial": shape_of(self.initial)})}

    def assumed_output_shapes(self) -> Shapes:
        return {"y": shape_of(self.initial)}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("delay", (), "the delay of the signal at the outlet", "s"),)

    def delay_lines(self, inputs: Shapes) -> tuple[DelayLine, ...]:
        return (
            DelayLine("past", self.output_shapes(inputs)["y"], "the delayed inlet signal", "u"),
            DelayLine("transit", (), "the delayed transit time", "T"),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["past"], "delay": x["delay"]}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"delay": 1.0 - x["transit"] / if_else(u["T"] > 0.0, u["T"], math.nan)}

    def initial_states(self, p: Signals) -> Signals:
        return {"delay": p["initial_delay"]}

    def delay_times(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        limited_delay = fmin(fmax(x["delay"], p["shortest"]), p["longest"])
        return {"past": limited_delay, "transit": limited_delay}

    def delay_bounds(self, p: Signals) -> Mapping[str, tuple[SX, SX]]:
        return dict.fromkeys(("past", "transit"), (p["shortest"], p["longest"]))

    def initial_history(self, p: Signals) -> Signals:
        return {"past": p["initial"], "transit": p["initial_delay"]}
