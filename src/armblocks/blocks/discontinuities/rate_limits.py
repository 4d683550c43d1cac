"""Limits on how fast a signal changes.

In continuous time each beginning and end of a limit is an event. While the output follows, it is u; else it
is a state y with y' at one of the two limits, until y and u meet again. The output is continuous: ``kept`` is
its left limit at the latest tick, event or breakpoint, so that a jump of u is seen as ``u - kept`` at that
instant.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, fabs, fmax, fmin, if_else, logic_and, logic_or, sign
from numpy.typing import ArrayLike

from armblocks.blocks.switching import SMALLEST_JUMP, same_instant
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
    sample_time_parameter,
)
from armblocks.diagram.signs import RATE_LIMIT, FaceSign

APART = 1e-3
"""A limiter that is switched on, in an enabled subsystem, follows an input that is nearer to its last output
than this, beside its size."""


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
        return (State("y", self.output_shapes(inputs)["y"], "the output while it is at a limit"),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        kept = State("kept", self.output_shapes(inputs)["y"], "the output just before the latest instant")
        return (kept, State("kept_at", (), "that instant", "s"))

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        doc = "1 rising at the limit, -1 falling at the limit, 0 following u"
        return (State("mode", self.output_shapes(inputs)["y"], doc),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        shape = self.output_shapes(inputs)["y"]
        return (
            Guard("gap", shape, "y meets u"),
            Guard("fast", shape, "u' - rising"),
            Guard("fast_down", shape, "u' - falling"),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        jumps = fabs(self._jump(t, x, u)) > self._band(u)
        follows = if_else(jumps, x["kept"], u["u"])
        return {"y": if_else(x["mode"] == 0.0, follows, x["y"])}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        limits = self.limits(u, p)
        limit = if_else(x["mode"] > 0.0, limits["rising"], limits["falling"])
        return {"y": if_else(x["mode"] == 0.0, u["u'"], limit)}

    def initial_states(self, p: Signals) -> Signals:
        return {"y": p["initial"], "kept": p["initial"], "kept_at": SX(0.0)}

    def captures(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"kept": self.outputs(t, x, u, p)["y"], "kept_at": t}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        limits = self.limits(u, p)
        return {
            "gap": if_else(x["mode"] == 0.0, 0.0, u["u"] - x["y"]),
            "fast": u["u'"] - limits["rising"],
            "fast_down": u["u'"] - limits["falling"],
        }

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        # Where the block is switched on, y is what it gave last, and there may be no jump at this instant.
        gap = u["u"] - x["y"]
        apart = logic_and(x["mode"] == 0.0, fabs(gap) > APART * fmax(1.0, fabs(u["u"])))
        return {"mode": if_else(apart, sign(gap), self._law(t, x, u, p))}

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"mode": self._law(t, x, u, p) != x["mode"]}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        law = self._law(t, x, u, p)
        fired = logic_or(e["gap"] != 0.0, logic_or(e["fast"] != 0.0, e["fast_down"] != 0.0))
        leaves = logic_and(x["mode"] == 0.0, law != 0.0)
        return {
            "mode": if_else(fired, law, x["mode"]),
            "y": if_else(logic_and(leaves, same_instant(t, x["kept_at"])), x["kept"], x["y"]),
        }

    def _jump(self, t: SX, x: Signals, u: Signals) -> SX:
        """How far u has jumped at this instant."""
        return if_else(same_instant(t, x["kept_at"]), u["u"] - x["kept"], 0.0)

    def _band(self, u: Signals) -> SX:
        """The largest jump that is passed on."""
        return SMALLEST_JUMP * fmax(1.0, fabs(u["u"]))

    def _law(self, t: SX, x: Signals, u: Signals, p: Signals) -> SX:
        """The mode after this instant, from the one before it."""
        limits, guards = self.limits(u, p), self.guard_values(t, x, u, p)
        band, jump = self._band(u), self._jump(t, x, u)
        too_fast, too_fast_down = guards["fast"] > 0.0, guards["fast_down"] < 0.0
        by_rate = if_else(too_fast, 1.0, if_else(too_fast_down, -1.0, 0.0))
        follows = if_else(jump > band, 1.0, if_else(jump < -band, -1.0, by_rate))
        gap = guards["gap"]
        met = logic_and(gap <= 0.0, u["u'"] <= limits["rising"])
        met_down = logic_and(gap >= 0.0, u["u'"] >= limits["falling"])
        rises = if_else(gap < -band, -1.0, if_else(met, by_rate, 1.0))
        falls = if_else(gap > band, 1.0, if_else(met_down, by_rate, -1.0))
        return if_else(x["mode"] == 0.0, follows, if_else(x["mode"] > 0.0, rises, falls))


@dataclass(frozen=True, kw_only=True)
class RateLimiterContinuous(RateLimiting):
    """The input, no faster than allowed: y = u while falling <= u' <= rising, else y' is that limit.

    Then y goes on at the limit until it meets u again. Where u jumps, y does not. (The Rate Limiter is the
    sampled one; Simulink has both in one block, and takes the rate between two steps, not the exact one.)
    """

    title: ClassVar[str] = "Rate Limiter (continuous)"
    sign: ClassVar[FaceSign] = RATE_LIMIT
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


@dataclass(frozen=True, kw_only=True)
class RateLimiter(Block):
    """The input, no faster than allowed: y(k) is u(k) held to y(k-1) + falling T … y(k-1) + rising T."""

    title: ClassVar[str] = "Rate Limiter"
    sign: ClassVar[FaceSign] = RATE_LIMIT
    spreads: ClassVar[tuple[str, ...]] = ("rising", "falling", "initial")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Pulses whose edges may not be steeper than 1 a second upwards and 2 downwards.",
        parameters={"falling": -2.0, "sample_time": 0.05},
        inputs={"u": made("PulseGenerator", period=5.0, delay=0.5)},
    )
    sampled: ClassVar[bool] = True

    rising: ArrayLike = parameter(
        1.0, kind=ParameterKind.ARRAY, minimum=0.0, doc="the fastest rise", unit="1/s"
    )
    falling: ArrayLike = parameter(
        -1.0, kind=ParameterKind.ARRAY, maximum=0.0, doc="the fastest fall, not positive", unit="1/s"
    )
    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the output before the first tick")
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "what is sampled"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the limited signal"),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", self.output_shapes(inputs)["y"], "the output at the tick before"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        least, most = x["x"] + p["falling"] * p["T"], x["x"] + p["rising"] * p["T"]
        return {"y": fmin(fmax(u["u"], least), most)}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": self.outputs(t, x, u, p)["y"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}

    def initial_outputs(self, p: Signals) -> Signals:
        return {"y": p["initial"]}
