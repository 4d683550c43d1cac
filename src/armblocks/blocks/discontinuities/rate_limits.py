"""Rate limiters.

In continuous time the start and the end of a rate limitation are events. While no limit is active, the output
is u. While a limit is active, the output is a state y with y' equal to that limit, until y and u are equal
again. The output is continuous: ``left_limit`` is its left limit at the latest tick, event or breakpoint,
so that ``u - left_limit`` is the jump of u at that time.
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
    driver,
    parameter,
    sample_time_parameter,
)
from armblocks.diagram.signs import RATE_LIMIT, FaceSign

ENABLE_TOLERANCE = 1e-3
"""Relative tolerance: a limiter that is enabled this close to the input follows it at once."""


@dataclass(frozen=True, kw_only=True)
class RateLimiting(Block):
    """Base class of the continuous rate limiters; subclasses give the limits."""

    differentiated_inputs: ClassVar[tuple[str, ...]] = ("u",)

    @abstractmethod
    def limits(self, u: Signals, p: Signals) -> Signals:
        """The rate limits, under the names ``rising`` and ``falling``."""

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the limited signal"),)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("y", self.output_shapes(inputs)["y"], "the output while a rate limit is active"),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        left_limit = State(
            "left_limit",
            self.output_shapes(inputs)["y"],
            "left limit of the output at the latest tick, event or breakpoint",
        )
        doc = "time of the latest tick, event or breakpoint"
        return (left_limit, State("left_limit_time", (), doc, "s", captured_when_enabled=True))

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        doc = "1 at the rising limit, -1 at the falling limit, 0 following u"
        return (State("mode", self.output_shapes(inputs)["y"], doc),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        shape = self.output_shapes(inputs)["y"]
        return (
            Guard("gap", shape, "y becomes equal to u"),
            Guard("fast", shape, "u' - rising"),
            Guard("fast_down", shape, "u' - falling"),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        jumps = fabs(self._jump(t, x, u)) > self._band(u)
        follows = if_else(jumps, x["left_limit"], u["u"])
        return {"y": if_else(x["mode"] == 0.0, follows, x["y"])}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        limits = self.limits(u, p)
        limit = if_else(x["mode"] > 0.0, limits["rising"], limits["falling"])
        return {"y": if_else(x["mode"] == 0.0, u["u'"], limit)}

    def initial_states(self, p: Signals) -> Signals:
        return {"y": p["initial"], "left_limit": p["initial"], "left_limit_time": SX(0.0)}

    def captures(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"left_limit": self.outputs(t, x, u, p)["y"], "left_limit_time": t}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        limits = self.limits(u, p)
        return {
            "gap": if_else(x["mode"] == 0.0, 0.0, u["u"] - x["y"]),
            "fast": u["u'"] - limits["rising"],
            "fast_down": u["u'"] - limits["falling"],
        }

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        # When the block is enabled, y is its last output, and u need not jump at this time.
        gap = u["u"] - x["y"]
        distant = logic_and(x["mode"] == 0.0, fabs(gap) > ENABLE_TOLERANCE * fmax(1.0, fabs(u["u"])))
        return {"mode": if_else(distant, sign(gap), self._next_mode(t, x, u, p))}

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"mode": self._next_mode(t, x, u, p) != x["mode"]}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        next_mode = self._next_mode(t, x, u, p)
        fired = logic_or(e["gap"] != 0.0, logic_or(e["fast"] != 0.0, e["fast_down"] != 0.0))
        leaves = logic_and(x["mode"] == 0.0, next_mode != 0.0)
        return {
            "mode": if_else(fired, next_mode, x["mode"]),
            "y": if_else(logic_and(leaves, same_instant(t, x["left_limit_time"])), x["left_limit"], x["y"]),
        }

    def _jump(self, t: SX, x: Signals, u: Signals) -> SX:
        """The jump of u at this time."""
        return if_else(same_instant(t, x["left_limit_time"]), u["u"] - x["left_limit"], 0.0)

    def _band(self, u: Signals) -> SX:
        """The largest jump that the output follows."""
        return SMALLEST_JUMP * fmax(1.0, fabs(u["u"]))

    def _next_mode(self, t: SX, x: Signals, u: Signals, p: Signals) -> SX:
        """The mode after this event, as a function of the mode before it."""
        limits, guards = self.limits(u, p), self.guard_values(t, x, u, p)
        band, jump = self._band(u), self._jump(t, x, u)
        too_fast, too_fast_down = guards["fast"] > 0.0, guards["fast_down"] < 0.0
        by_rate = if_else(too_fast, 1.0, if_else(too_fast_down, -1.0, 0.0))
        follows = if_else(jump > band, 1.0, if_else(jump < -band, -1.0, by_rate))
        gap = guards["gap"]
        caught_up = logic_and(gap <= 0.0, u["u'"] <= limits["rising"])
        caught_down = logic_and(gap >= 0.0, u["u'"] >= limits["falling"])
        rises = if_else(gap < -band, -1.0, if_else(caught_up, by_rate, 1.0))
        falls = if_else(gap > band, 1.0, if_else(caught_down, by_rate, -1.0))
        return if_else(x["mode"] == 0.0, follows, if_else(x["mode"] > 0.0, rises, falls))


@dataclass(frozen=True, kw_only=True)
class RateLimiterContinuous(RateLimiting):
    """A rate limiter in continuous time: y = u while falling <= u' <= rising, else y' equals the limit.

    While a limit is active, y' stays at the limit until y equals u again. The output does not jump where u
    jumps. (The Rate Limiter is the sampled block. Simulink has one block for both, and uses the difference
    between two solver steps instead of the derivative.)
    """

    title: ClassVar[str] = "Rate Limiter (continuous)"
    sign: ClassVar[FaceSign] = RATE_LIMIT
    broadcast_parameters: ClassVar[tuple[str, ...]] = ("rising", "falling", "initial")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A sine whose rate is limited to 0.5 per second upwards and 0.8 per second downwards.",
        parameters={"rising": 0.5, "falling": -0.8},
        inputs={"u": driver("SineWave")},
    )

    rising: ArrayLike = parameter(
        1.0, kind=ParameterKind.ARRAY, minimum=0.0, doc="upper limit of the rate", unit="1/s"
    )
    falling: ArrayLike = parameter(
        -1.0, kind=ParameterKind.ARRAY, maximum=0.0, doc="lower limit of the rate, not positive", unit="1/s"
    )
    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the output at t = 0")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the signal"),)

    def limits(self, u: Signals, p: Signals) -> Signals:
        return p


@dataclass(frozen=True, kw_only=True)
class RateLimiterDynamic(RateLimiting):
    """A rate limiter whose limits are signals: y = u while falling <= u' <= rising, else y' equals the limit.

    The block behaves like the Rate Limiter (continuous). If ``falling`` exceeds ``rising``, no rate satisfies
    both limits, and y moves towards u at the active limit.
    """

    title: ClassVar[str] = "Rate Limiter Dynamic"
    broadcast_parameters: ClassVar[tuple[str, ...]] = ("initial",)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A sine whose upper rate limit grows and whose lower rate limit is -0.8 per second.",
        inputs={
            "rising": driver("Ramp", slope=0.1),
            "u": driver("SineWave"),
            "falling": driver("Constant", value=-0.8),
        },
        shown=("u", "y"),
    )

    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the output at t = 0")

    def input_ports(self) -> tuple[Port, ...]:
        return (
            Port("rising", "upper limit of the rate"),
            Port("u", "the signal"),
            Port("falling", "lower limit of the rate, not positive"),
        )

    def limits(self, u: Signals, p: Signals) -> Signals:
        return u


@dataclass(frozen=True, kw_only=True)
class RateLimiter(Block):
    """A sampled rate limiter: y(k) is u(k) limited to y(k-1) + falling T … y(k-1) + rising T."""

    title: ClassVar[str] = "Rate Limiter"
    sign: ClassVar[FaceSign] = RATE_LIMIT
    broadcast_parameters: ClassVar[tuple[str, ...]] = ("rising", "falling", "initial")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Pulses whose edges are limited to 1 per second upwards and 2 per second downwards.",
        parameters={"falling": -2.0, "sample_time": 0.05},
        inputs={"u": driver("PulseGenerator", period=5.0, delay=0.5)},
    )
    sampled: ClassVar[bool] = True

    rising: ArrayLike = parameter(
        1.0, kind=ParameterKind.ARRAY, minimum=0.0, doc="upper limit of the rate", unit="1/s"
    )
    falling: ArrayLike = parameter(
        -1.0, kind=ParameterKind.ARRAY, maximum=0.0, doc="lower limit of the rate, not positive", unit="1/s"
    )
    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the output before the first tick")
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "sampled signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the limited signal"),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", self.output_shapes(inputs)["y"], "the output at the previous tick"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        lower, upper = x["x"] + p["falling"] * p["T"], x["x"] + p["rising"] * p["T"]
        return {"y": fmin(fmax(u["u"], lower), upper)}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": self.outputs(t, x, u, p)["y"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}

    def initial_outputs(self, p: Signals) -> Signals:
        return {"y": p["initial"]}
