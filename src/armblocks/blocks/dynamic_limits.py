"""Limits that move, limits on the rate of change, and signals that start again: each switch is an event."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, fabs, fmax, if_else, logic_and, logic_or
from numpy.typing import ArrayLike

from armblocks.blocks.switching import JUST, located, zero_crossing_parameter
from armblocks.diagram import (
    Block,
    Condition,
    Guard,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    broadcast,
    made,
    parameter,
    shape_of,
)

SMALLEST_JUMP = 1e-6
"""Of a rate limiter's input, beside its size: a smaller one is passed on."""


def _moving_ports() -> tuple[Port, ...]:
    return (Port("upper", "the upper limit"), Port("u", "the signal"), Port("lower", "the lower limit"))


def _beyond(block: Block, inputs: Shapes) -> tuple[Condition, ...]:
    shape = broadcast(inputs)
    above = Condition("above", shape, "1 above the upper limit", closed=False)
    return located(block, above, Condition("below", shape, "1 below the lower limit", closed=False))


@dataclass(frozen=True, kw_only=True)
class SaturationDynamic(Block):
    """The input held between two signals: y = min(max(u, lower), upper)."""

    family: ClassVar[str] = "discontinuities"
    title: ClassVar[str] = "Saturation Dynamic"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A sine between -0.2 and a limit that rises.",
        inputs={
            "upper": made("Ramp", slope=0.1).named("upper"),
            "u": made("SineWave"),
            "lower": made("Constant", value=-0.2).named("lower"),
        },
    )

    zero_crossing: bool = zero_crossing_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return _moving_ports()

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the limited signal"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast(inputs)}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        return _beyond(self, inputs)

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"above": u["u"] - u["upper"], "below": u["lower"] - u["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": if_else(x["above"], u["upper"], if_else(x["below"], u["lower"], u["u"]))}


@dataclass(frozen=True, kw_only=True)
class DeadZoneDynamic(Block):
    """Nothing between two signals, what exceeds them outside: y = u - upper, 0 or u - lower."""

    family: ClassVar[str] = "discontinuities"
    title: ClassVar[str] = "Dead Zone Dynamic"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="What of a sine exceeds a zone that grows upwards.",
        inputs={
            "upper": made("Ramp", slope=0.1).named("upper"),
            "u": made("SineWave"),
            "lower": made("Constant", value=-0.2).named("lower"),
        },
    )

    zero_crossing: bool = zero_crossing_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return _moving_ports()

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "what exceeds the zone"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast(inputs)}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        return _beyond(self, inputs)

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"above": u["u"] - u["upper"], "below": u["lower"] - u["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": if_else(x["above"], u["u"] - u["upper"], if_else(x["below"], u["u"] - u["lower"], 0.0))}


@dataclass(frozen=True, kw_only=True)
class WrapToZero(Block):
    """Zero where the input exceeds a threshold: y = u, but 0 where u > threshold."""

    family: ClassVar[str] = "discontinuities"
    title: ClassVar[str] = "Wrap To Zero"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A ramp that falls to 0 once it exceeds 5.",
        parameters={"threshold": 5.0},
        inputs={"u": made("Ramp")},
    )

    threshold: ArrayLike = parameter(255.0, kind=ParameterKind.ARRAY, doc="the greatest output")
    zero_crossing: bool = zero_crossing_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the signal, or 0"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast({**inputs, "threshold": shape_of(self.threshold)})}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        shape = self.output_shapes(inputs)["y"]
        return located(self, Condition("above", shape, "1 above the threshold", closed=False))

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"above": u["u"] - p["threshold"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": if_else(x["above"], 0.0, u["u"])}


@dataclass(frozen=True, kw_only=True)
class HitCrossing(Block):
    """How often a signal has crossed an offset, and when it did last: located exactly.

    Simulink's block is 1 for the step that ends at the crossing; a count can be looked at afterwards, and
    what it triggers sees it change.
    """

    family: ClassVar[str] = "discontinuities"
    title: ClassVar[str] = "Hit Crossing"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A sine crosses 0.5 upwards and downwards: the count steps at each crossing.",
        parameters={"offset": 0.5},
    )

    offset: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="what is crossed")
    direction: str = parameter("either", choices=("rising", "falling", "either"), doc="which crossings count")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("count", "crossings so far"), Port("last", "time of the last one; 0 before any", "s"))

    def output_shapes(self, inputs: Shapes) -> Shapes:
        shape = broadcast({**inputs, "offset": shape_of(self.offset)})
        return {"count": shape, "last": shape}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        shape = self.output_shapes(inputs)["count"]
        return (State("count", shape, "crossings so far"), State("last", shape, "time of the last", "s"))

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        way = {"rising": 1, "falling": -1, "either": 0}[self.direction]
        return (Guard("crosses", self.output_shapes(inputs)["count"], "u - offset", way),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"count": x["count"], "last": x["last"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"count": SX(0.0), "last": SX(0.0)}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"crosses": u["u"] - p["offset"]}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return {"count": x["count"] + fabs(e["crosses"]), "last": if_else(e["crosses"] == 0.0, x["last"], t)}


@dataclass(frozen=True, kw_only=True)
class RateLimiterContinuous(Block):
    """The input, no faster than allowed: y = u while falling <= u' <= rising, else y' is that limit.

    Then y goes on at the limit until it meets u again. Where u jumps, y does not. (The Rate Limiter is the
    sampled one; Simulink has both in one block, and takes the rate between two steps, not the exact one.)
    """

    family: ClassVar[str] = "discontinuities"
    title: ClassVar[str] = "Rate Limiter (continuous)"
    rated_inputs: ClassVar[tuple[str, ...]] = ("u",)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A sine of which the rise is limited to 0.5 a second and the fall to 0.8.",
        parameters={"rising": 0.5, "falling": -0.8},
        inputs={"u": made("SineWave")},
    )

    rising: ArrayLike = parameter(
        1.0, kind=ParameterKind.ARRAY, minimum=0.0, doc="the fastest rise", unit="1/s"
    )
    falling: ArrayLike = parameter(
        -1.0, kind=ParameterKind.ARRAY, maximum=0.0, doc="the fastest fall, not positive", unit="1/s"
    )
    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the output at t = 0")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the limited signal"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        own = {name: shape_of(self.parameter_value(name)) for name in ("rising", "falling", "initial")}
        return {"y": broadcast({**inputs, **own})}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("y", self.output_shapes(inputs)["y"], "the output"),)

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        doc = "1 rising at the limit, -1 falling at the limit, 0 following u"
        return (State("mode", self.output_shapes(inputs)["y"], doc),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        shape = self.output_shapes(inputs)["y"]
        return (
            Guard("ahead", shape, "u leaves y upwards, or y has met it", 0),
            Guard("behind", shape, "u leaves y downwards, or y has met it", 0),
            Guard("fast", shape, "u' - rising", 1),
            Guard("fast_down", shape, "u' - falling", -1),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": if_else(x["mode"] == 0.0, u["u"], x["y"])}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        limit = if_else(x["mode"] > 0.0, p["rising"], p["falling"])
        return {"y": if_else(x["mode"] == 0.0, u["u'"], limit)}

    def initial_states(self, p: Signals) -> Signals:
        return {"y": p["initial"]}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        gap = u["u"] - x["y"]
        # While it follows, y is u but for rounding: what is wider is a jump.
        band = if_else(x["mode"] == 0.0, SMALLEST_JUMP * fmax(1.0, fabs(u["u"])), 0.0)
        return {
            "ahead": gap - band - JUST,
            "behind": gap + band + JUST,
            "fast": u["u'"] - p["rising"] - JUST,
            "fast_down": u["u'"] - p["falling"] + JUST,
        }

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        gap = u["u"] - x["y"]
        band = SMALLEST_JUMP * fmax(1.0, fabs(u["u"]))
        up = logic_or(gap > band, logic_and(gap >= -band, u["u'"] > p["rising"]))
        down = logic_or(gap < -band, logic_and(gap <= band, u["u'"] < p["falling"]))
        return {"mode": if_else(up, 1.0, if_else(down, -1.0, 0.0))}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        follows = x["mode"] == 0.0
        up = logic_and(follows, logic_or(e["ahead"] > 0.0, e["fast"] > 0.0))
        down = logic_and(follows, logic_or(e["behind"] < 0.0, e["fast_down"] < 0.0))
        met = logic_or(
            logic_and(x["mode"] > 0.0, logic_or(e["ahead"] < 0.0, e["behind"] < 0.0)),
            logic_and(x["mode"] < 0.0, logic_or(e["ahead"] > 0.0, e["behind"] > 0.0)),
        )
        # Where it meets u on its way, u may be too fast the other way.
        after = if_else(u["u'"] > p["rising"], 1.0, if_else(u["u'"] < p["falling"], -1.0, 0.0))
        mode = if_else(up, 1.0, if_else(down, -1.0, if_else(met, after, x["mode"])))
        return {"mode": mode, "y": if_else(logic_and(met, mode == 0.0), u["u"], x["y"])}
