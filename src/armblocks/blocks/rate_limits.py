"""Limits on how fast a signal changes, in continuous time: each beginning and end of a limit is an event.

The output y is a state. While it follows, y is u, and y' is u'; else y' is one of the two limits, until y and
u meet again.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, fabs, fmax, if_else, logic_and, logic_or
from numpy.typing import ArrayLike

from armblocks.blocks.switching import JUST
from armblocks.diagram import (
    Block,
    Guard,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    made,
    parameter,
)
from armblocks.equations import Shape

SMALLEST_JUMP = 1e-6
"""Of a rate limiter's input, beside its size: a smaller one is passed on."""


@dataclass(frozen=True, kw_only=True)
class RateLimiting(Block):
    """What the continuous rate limiters have in common: all but where their limits come from."""

    rated_inputs: ClassVar[tuple[str, ...]] = ("u",)

    @abstractmethod
    def limits(self, u: Signals, p: Signals) -> Signals:
        """What has the entries ``rising`` and ``falling``."""

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the limited signal"),)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("y", self.output_shapes(inputs)["y"], "the output"),)

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (_mode(self.output_shapes(inputs)["y"]),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return _guards(self.output_shapes(inputs)["y"])

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": if_else(x["mode"] == 0.0, u["u"], x["y"])}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": _rate(x, u, self.limits(u, p))}

    def initial_states(self, p: Signals) -> Signals:
        return {"y": p["initial"]}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return _guard_values(x, u, self.limits(u, p))

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"mode": _mode_value(x, u, self.limits(u, p))}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return _after(x, u, self.limits(u, p), e)


@dataclass(frozen=True, kw_only=True)
class RateLimiterContinuous(RateLimiting):
    """The input, no faster than allowed: y = u while falling <= u' <= rising, else y' is that limit.

    Then y goes on at the limit until it meets u again. Where u jumps, y does not. (The Rate Limiter is the
    sampled one; Simulink has both in one block, and takes the rate between two steps, not the exact one.)
    """

    family: ClassVar[str] = "discontinuities"
    title: ClassVar[str] = "Rate Limiter (continuous)"
    spreads: ClassVar[tuple[str, ...]] = ("rising", "falling", "initial")
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

    def limits(self, u: Signals, p: Signals) -> Signals:
        return p


@dataclass(frozen=True, kw_only=True)
class RateLimiterDynamic(RateLimiting):
    """The input, no faster than two signals allow: y = u while falling <= u' <= rising, else at that limit.

    As the Rate Limiter (continuous), with limits that may change at any time. Where ``falling`` exceeds
    ``rising`` no rate fits both, and y goes towards u at the limit that it is at.
    """

    family: ClassVar[str] = "discontinuities"
    title: ClassVar[str] = "Rate Limiter Dynamic"
    spreads: ClassVar[tuple[str, ...]] = ("initial",)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A sine that may rise faster and faster, and fall by 0.8 a second.",
        inputs={
            "rising": made("Ramp", slope=0.1),
            "u": made("SineWave"),
            "falling": made("Constant", value=-0.8),
        },
        shown=("u", "y"),
    )

    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the output at t = 0")

    def input_ports(self) -> tuple[Port, ...]:
        return (
            Port("rising", "the fastest rise"),
            Port("u", "the signal"),
            Port("falling", "the fastest fall, not positive"),
        )

    def limits(self, u: Signals, p: Signals) -> Signals:
        return u


def _mode(shape: Shape) -> State:
    return State("mode", shape, "1 rising at the limit, -1 falling at the limit, 0 following u")


def _guards(shape: Shape) -> tuple[Guard, ...]:
    return (
        Guard("ahead", shape, "u leaves y upwards, or y has met it", 0),
        Guard("behind", shape, "u leaves y downwards, or y has met it", 0),
        Guard("fast", shape, "u' - rising", 1),
        Guard("fast_down", shape, "u' - falling", -1),
    )


def _rate(x: Signals, u: Signals, limits: Signals) -> SX:
    limit = if_else(x["mode"] > 0.0, limits["rising"], limits["falling"])
    return if_else(x["mode"] == 0.0, u["u'"], limit)


def _guard_values(x: Signals, u: Signals, limits: Signals) -> Signals:
    gap = u["u"] - x["y"]
    # While it follows, y is u but for rounding: what is wider is a jump.
    band = if_else(x["mode"] == 0.0, SMALLEST_JUMP * fmax(1.0, fabs(u["u"])), 0.0)
    return {
        "ahead": gap - band - JUST,
        "behind": gap + band + JUST,
        "fast": u["u'"] - limits["rising"] - JUST,
        "fast_down": u["u'"] - limits["falling"] + JUST,
    }


def _mode_value(x: Signals, u: Signals, limits: Signals) -> SX:
    gap = u["u"] - x["y"]
    band = SMALLEST_JUMP * fmax(1.0, fabs(u["u"]))
    up = logic_or(gap > band, logic_and(gap >= -band, u["u'"] > limits["rising"]))
    down = logic_or(gap < -band, logic_and(gap <= band, u["u'"] < limits["falling"]))
    return if_else(up, 1.0, if_else(down, -1.0, 0.0))


def _after(x: Signals, u: Signals, limits: Signals, e: Signals) -> Signals:
    """Mode and output after events."""
    follows = x["mode"] == 0.0
    up = logic_and(follows, logic_or(e["ahead"] > 0.0, e["fast"] > 0.0))
    down = logic_and(follows, logic_or(e["behind"] < 0.0, e["fast_down"] < 0.0))
    met = logic_or(
        logic_and(x["mode"] > 0.0, logic_or(e["ahead"] < 0.0, e["behind"] < 0.0)),
        logic_and(x["mode"] < 0.0, logic_or(e["ahead"] > 0.0, e["behind"] > 0.0)),
    )
    # Where it meets u on its way, u may be too fast the other way.
    after = if_else(u["u'"] > limits["rising"], 1.0, if_else(u["u'"] < limits["falling"], -1.0, 0.0))
    mode = if_else(up, 1.0, if_else(down, -1.0, if_else(met, after, x["mode"])))
    return {"mode": mode, "y": if_else(logic_and(met, mode == 0.0), u["u"], x["y"])}
