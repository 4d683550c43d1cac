"""Second-order integrators: position and speed, optionally with limits and bounces."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from casadi import SX, fmax, fmin, if_else, logic_and, logic_not, logic_or
from numpy.typing import ArrayLike

from armblocks.blocks.elementwise import parameters_shape
from armblocks.blocks.switching import THRESHOLD_OFFSET, limits_in_order
from armblocks.diagram import (
    Block,
    Guard,
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
from armblocks.diagram.signs import FaceSign, Fraction
from armblocks.equations import Shape
from armblocks.errors import InputError


@dataclass(frozen=True, kw_only=True)
class SecondOrderIntegrator(Block):
    """Position and speed from an acceleration: x'' = u, dx = x'."""

    title: ClassVar[str] = "Integrator, Second-Order"
    sign: ClassVar[FaceSign] = Fraction("1", "s²")
    output_rates: ClassVar[Mapping[str, str]] = {"x": "dx"}
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A mass on a spring: the acceleration is -4 x, so the mass oscillates at 2 rad/s.",
        parameters={"initial": 1.0},
        inputs={"u": driver("Gain", gain=-4.0).by(u="x")},
        shown=("x", "dx"),
    )

    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="position x at t = 0")
    initial_speed: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="speed dx at t = 0")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the acceleration"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("x", "the position"), Port("dx", "the speed"))

    def output_shapes(self, inputs: Shapes) -> Shapes:
        shape = broadcast({**inputs, "initial values": self._parameter_shape()})
        return {"x": shape, "dx": shape}

    def assumed_output_shapes(self) -> Shapes:
        return {"x": self._parameter_shape(), "dx": self._parameter_shape()}

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        shape = self.output_shapes(inputs)["x"]
        return (State("x", shape, "the position"), State("dx", shape, "the speed"))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": x["x"], "dx": x["dx"]}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": x["dx"], "dx": u["u"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"], "dx": p["initial_speed"]}

    def _parameter_shape(self) -> Shape:
        return parameters_shape(self, "initial", "initial_speed")


@dataclass(frozen=True, kw_only=True)
class SecondOrderIntegratorLimited(Block):
    """Position and speed between limits: x'' = u; at a limit of x the speed becomes 0 or the input ``dx0``.

    - As in Simulink, dx jumps to 0 when x reaches a limit, and x stays there while u points outwards.
    - With ``reinitialize`` dx jumps to the input ``dx0`` instead, which may depend on dx (a bounce). If the
      speed after a bounce is at most ``rest_speed``, the block stops: x stays exactly at the limit until u
      points inwards. A bouncing ball therefore comes to rest after a finite number of bounces (no Zeno
      behaviour).
    - The speed may have limits too; they must include 0 where x has a limit in the direction of motion.
    """

    title: ClassVar[str] = "Integrator, Second-Order Limited"
    sign: ClassVar[FaceSign] = Fraction("1", "s²", limited=True)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A ball that keeps 0.7 of its speed at each bounce and finally rests.",
        parameters={"initial": 1.0, "lower": 0.0, "reinitialize": True},
        inputs={
            "u": driver("Constant", value=-9.81).named("gravity"),
            "dx0": driver("Gain", gain=-0.7).by(u="dx"),
        },
        shown=("x", "dx"),
        stop_time=3.0,
    )

    initial: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, doc="position x at t = 0, within the limits"
    )
    initial_speed: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="speed dx at t = 0")
    lower: ArrayLike = parameter(-math.inf, kind=ParameterKind.ARRAY, finite=False, doc="lower limit of x")
    upper: ArrayLike = parameter(math.inf, kind=ParameterKind.ARRAY, finite=False, doc="upper limit of x")
    lower_speed: ArrayLike = parameter(
        -math.inf, kind=ParameterKind.ARRAY, finite=False, doc="lower limit of dx"
    )
    upper_speed: ArrayLike = parameter(
        math.inf, kind=ParameterKind.ARRAY, finite=False, doc="upper limit of dx"
    )
    reinitialize: bool = parameter(False, doc="whether the input dx0 gives the speed after x reaches a limit")
    rest_speed: float = parameter(
        1e-6, minimum=0.0, doc="largest speed after a bounce at which the block stops"
    )

    def check(self) -> None:
        limits_in_order(self, "lower", "upper")
        limits_in_order(self, "lower_speed", "upper_speed")
        names = ("lower", "upper", "lower_speed", "upper_speed")
        values = {name: self.parameter_value(name) for name in names}
        broadcast({name: shape_of(value) for name, value in values.items()})
        limits = [np.asarray(values[name], dtype=np.float64) for name in names]
        lower, upper, slowest, fastest = np.broadcast_arrays(*limits)
        moving = (slowest > 0.0) & np.isfinite(upper) | (fastest < 0.0) & np.isfinite(lower)
        if moving.any():
            raise InputError(
                f"x has a limit, and dx is held between {values['lower_speed']} and {values['upper_speed']}",
                where=self.type_name(),
                allowed="lower_speed <= 0 <= upper_speed where x has a limit, because the speed is 0 there",
                fix="widen the limits of dx, or remove the limit of x",
            )

    def input_ports(self) -> tuple[Port, ...]:
        ports = (Port("u", "the acceleration"),)
        return (*ports, Port("dx0", "speed after x reaches a limit")) if self.reinitialize else ports

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("x", "the position"), Port("dx", "the speed"))

    def output_shapes(self, inputs: Shapes) -> Shapes:
        shape = broadcast({**inputs, "parameters": self._parameter_shape()})
        return {"x": shape, "dx": shape}

    def assumed_output_shapes(self) -> Shapes:
        return {"x": self._parameter_shape(), "dx": self._parameter_shape()}

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        shape = self.output_shapes(inputs)["x"]
        return (State("x", shape, "the position"), State("dx", shape, "the speed"))

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        shape = self.output_shapes(inputs)["x"]
        return (
            State("rests", shape, "1 at the upper limit, -1 at the lower limit, else 0"),
            State("fastest", shape, "1 at the upper limit of the speed, -1 at the lower limit, else 0"),
        )

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        shape = self.output_shapes(inputs)["x"]
        return (
            Guard("upper", shape, "x reaches the upper limit", 1),
            Guard("lower", shape, "x reaches the lower limit", -1),
            Guard("upper_speed", shape, "dx reaches its upper limit", 1),
            Guard("lower_speed", shape, "dx reaches its lower limit", -1),
            Guard("rises", shape, "u becomes positive", 1),
            Guard("falls", shape, "u becomes negative", -1),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": x["x"], "dx": x["dx"]}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        at_limit = logic_or(x["rests"] != 0.0, x["fastest"] != 0.0)
        return {"x": if_else(x["rests"] == 0.0, x["dx"], 0.0), "dx": if_else(at_limit, 0.0, u["u"])}

    def initial_states(self, p: Signals) -> Signals:
        return {
            "x": fmin(fmax(p["initial"], p["lower"]), p["upper"]),
            "dx": fmin(fmax(p["initial_speed"], p["lower_speed"]), p["upper_speed"]),
        }

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {
            "upper": x["x"] - p["upper"],
            "lower": x["x"] - p["lower"],
            "upper_speed": x["dx"] - p["upper_speed"],
            "lower_speed": x["dx"] - p["lower_speed"],
            "rises": u["u"] - THRESHOLD_OFFSET,
            "falls": u["u"] + THRESHOLD_OFFSET,
        }

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        unaccelerated = u["u"] == 0.0

        def driven(mode: SX) -> tuple[SX, SX]:
            """Whether u points towards the upper and the lower limit; a limit mode ends when u turns back."""
            upwards = logic_or(u["u"] > 0.0, logic_and(mode > 0.0, unaccelerated))
            return upwards, logic_or(u["u"] < 0.0, logic_and(mode < 0.0, unaccelerated))

        up, down = driven(x["rests"])
        at_upper = logic_and(x["x"] >= p["upper"], logic_and(x["dx"] >= 0.0, up))
        at_lower = logic_and(x["x"] <= p["lower"], logic_and(x["dx"] <= 0.0, down))
        up, down = driven(x["fastest"])
        fast = logic_and(x["dx"] >= p["upper_speed"], up)
        fast_back = logic_and(x["dx"] <= p["lower_speed"], down)
        return {
            "rests": if_else(at_upper, 1.0, if_else(at_lower, -1.0, 0.0)),
            "fastest": if_else(fast, 1.0, if_else(fast_back, -1.0, 0.0)),
        }

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        inconsistent = dict(super().contradictions(t, x, u, p))
        inconsistent["rests"] = logic_or(inconsistent["rests"], logic_or(*self._impacts(x, p)))
        return inconsistent

    def _impacts(self, x: Signals, p: Signals) -> tuple[SX, SX]:
        """Whether the state is at the upper (lower) limit and its speed points beyond it."""
        upper = logic_and(x["x"] >= p["upper"], x["dx"] > 0.0)
        return upper, logic_and(x["x"] <= p["lower"], x["dx"] < 0.0)

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        at_upper, at_lower = self._impacts(x, p)
        hits = logic_or(at_upper, at_lower)
        bounced = fmin(fmax(u["dx0"] if self.reinitialize else SX(0.0), p["lower_speed"]), p["upper_speed"])
        # The speed points away from the limit, or the bounce is below the rest speed.
        speed_inwards = if_else(at_upper, -bounced, bounced)
        stops = logic_and(hits, speed_inwards <= p["rest_speed"])
        presses = if_else(at_upper, u["u"] >= 0.0, u["u"] <= 0.0)
        position = if_else(at_upper, p["upper"], if_else(at_lower, p["lower"], x["x"]))
        speed = if_else(hits, if_else(stops, 0.0, bounced), x["dx"])
        # The state is at a limit without speed away from it, and u turns towards the limit.
        pushed_up = logic_and(e["rises"] > 0.0, logic_and(x["x"] >= p["upper"], x["dx"] >= 0.0))
        pushed_down = logic_and(e["falls"] < 0.0, logic_and(x["x"] <= p["lower"], x["dx"] <= 0.0))
        leaves = logic_or(
            logic_and(x["rests"] > 0.0, e["falls"] < 0.0), logic_and(x["rests"] < 0.0, e["rises"] > 0.0)
        )
        side = if_else(leaves, 0.0, x["rests"])
        side = if_else(hits, if_else(logic_and(stops, presses), if_else(at_upper, 1.0, -1.0), 0.0), side)
        rests = if_else(pushed_up, 1.0, if_else(pushed_down, -1.0, side))
        speed = if_else(logic_or(pushed_up, pushed_down), 0.0, speed)
        position = if_else(pushed_up, p["upper"], if_else(pushed_down, p["lower"], position))
        fast, fast_back = e["upper_speed"] > 0.0, e["lower_speed"] < 0.0
        pushed = logic_and(e["rises"] > 0.0, x["dx"] >= p["upper_speed"])
        pushed_back = logic_and(e["falls"] < 0.0, x["dx"] <= p["lower_speed"])
        slower = logic_or(
            logic_and(x["fastest"] > 0.0, e["falls"] < 0.0), logic_and(x["fastest"] < 0.0, e["rises"] > 0.0)
        )
        fastest = if_else(logic_or(slower, hits), 0.0, x["fastest"])
        fastest = if_else(
            logic_or(fast, pushed), 1.0, if_else(logic_or(fast_back, pushed_back), -1.0, fastest)
        )
        no_hit = logic_not(hits)
        speed = if_else(logic_and(no_hit, fast), p["upper_speed"], speed)
        speed = if_else(logic_and(no_hit, fast_back), p["lower_speed"], speed)
        return {"x": position, "dx": speed, "rests": rests, "fastest": if_else(hits, 0.0, fastest)}

    def _parameter_shape(self) -> Shape:
        names = ("initial", "initial_speed", "lower", "upper", "lower_speed", "upper_speed")
        return parameters_shape(self, *names)
