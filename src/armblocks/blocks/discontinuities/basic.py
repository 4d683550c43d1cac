"""Blocks whose output has kinks and jumps. Each switching time is located as an event."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, floor, fmax, fmin, if_else
from numpy.typing import ArrayLike

from armblocks.blocks.switching import (
    THRESHOLD_OFFSET,
    beyond,
    cell_of,
    limits_in_order,
    zone,
    zone_after,
)
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
from armblocks.diagram.signs import DEAD_ZONE, SATURATION, FaceSign, graph, stairs


@dataclass(frozen=True, kw_only=True)
class Saturation(Block):
    """The input limited to a range: y = min(max(u, lower), upper)."""

    following_modes: ClassVar[bool] = True
    title: ClassVar[str] = "Saturation"
    sign: ClassVar[FaceSign] = SATURATION
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The crests of the sine are cut off at 1.5, its troughs at -0.5.",
        parameters={"lower": -0.5, "upper": 1.5},
        inputs={"u": driver("SineWave", amplitude=2.0)},
    )

    lower: ArrayLike = parameter(
        -0.5, kind=ParameterKind.ARRAY, finite=False, doc="lower limit of the output"
    )
    upper: ArrayLike = parameter(0.5, kind=ParameterKind.ARRAY, finite=False, doc="upper limit of the output")

    def check(self) -> None:
        limits_in_order(self, "lower", "upper")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "signal to limit"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the limited signal"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast({**inputs, "lower": shape_of(self.lower), "upper": shape_of(self.upper)})}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (
            State(
                "mode", self.output_shapes(inputs)["y"], "-1 at the lower limit, 1 at the upper limit, else 0"
            ),
        )

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        shape = self.output_shapes(inputs)["y"]
        return (Guard("upper", shape, "u - upper"), Guard("lower", shape, "u - lower"))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        below = if_else(x["mode"] < 0.0, p["lower"], u["u"])
        return {"y": if_else(x["mode"] > 0.0, p["upper"], below)}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"upper": u["u"] - p["upper"], "lower": u["u"] - p["lower"]}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"mode": zone(u["u"], p["lower"], p["upper"])}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return {"mode": zone_after(x["mode"], e)}


@dataclass(frozen=True, kw_only=True)
class DeadZone(Block):
    """A dead zone: y = u - end above the zone, u - start below the zone, 0 within the zone."""

    following_modes: ClassVar[bool] = True
    title: ClassVar[str] = "Dead Zone"
    sign: ClassVar[FaceSign] = DEAD_ZONE
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Between -0.5 and 0.5 the output is 0; outside, the output is the distance to this zone.",
    )

    start: ArrayLike = parameter(-0.5, kind=ParameterKind.ARRAY, doc="lower end of the zone")
    end: ArrayLike = parameter(0.5, kind=ParameterKind.ARRAY, doc="upper end of the zone")

    def check(self) -> None:
        limits_in_order(self, "start", "end")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "signed distance of the input from the zone"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast({**inputs, "start": shape_of(self.start), "end": shape_of(self.end)})}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("mode", self.output_shapes(inputs)["y"], "-1 below the zone, 1 above, 0 within"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        shape = self.output_shapes(inputs)["y"]
        return (Guard("upper", shape, "u - end"), Guard("lower", shape, "u - start"))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        below = if_else(x["mode"] < 0.0, u["u"] - p["start"], 0.0)
        return {"y": if_else(x["mode"] > 0.0, u["u"] - p["end"], below)}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"upper": u["u"] - p["end"], "lower": u["u"] - p["start"]}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"mode": zone(u["u"], p["start"], p["end"])}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return {"mode": zone_after(x["mode"], e)}


@dataclass(frozen=True, kw_only=True)
class Relay(Block):
    """A relay with hysteresis: on_value once u rises to on_point, off_value once u falls to off_point.

    At t = 0 the relay is off, unless u is at or above on_point.
    """

    title: ClassVar[str] = "Relay"
    sign: ClassVar[FaceSign] = graph((0, 0), (0.7, 0), (0.7, 1), (1, 1), (0.3, 1), (0.3, 0))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The relay switches on when the sine rises through 0.5, and off when it falls through -0.5.",
    )

    on_point: float = parameter(0.5, doc="input value at which the relay switches on")
    off_point: float = parameter(-0.5, doc="input value at which the relay switches off, at most on_point")
    on_value: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="the output while on")
    off_value: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the output while off")

    def check(self) -> None:
        limits_in_order(self, "off_point", "on_point")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "on_value or off_value"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        own = {"on_value": shape_of(self.on_value), "off_value": shape_of(self.off_value)}
        return {"y": broadcast({**inputs, **own})}

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("mode", inputs["u"], "1 on, 0 off", follows=True, hysteresis=True),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return (
            Guard("on", inputs["u"], "u - on_point", 1, locates=True),
            Guard("off", inputs["u"], "u - off_point", -1, locates=True),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": if_else(x["mode"] > 0.0, p["on_value"], p["off_value"])}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {
            "on": u["u"] - p["on_point"] + THRESHOLD_OFFSET,
            "off": u["u"] - p["off_point"] - THRESHOLD_OFFSET,
        }

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        sides = self.guard_values(t, x, u, p)
        unless_on = if_else(sides["off"] < 0.0, 0.0, x["mode"])
        return {"mode": if_else(sides["on"] > 0.0, 1.0, unless_on)}


@dataclass(frozen=True, kw_only=True)
class Quantizer(Block):
    """The input rounded to multiples of an interval: y = interval floor(u / interval + 1/2).

    The threshold for a step down lies 1e-9 times the interval below the threshold for a step up. This
    hysteresis prevents chattering by rounding errors.
    """

    following_modes: ClassVar[bool] = True
    title: ClassVar[str] = "Quantizer"
    sign: ClassVar[FaceSign] = stairs((0.0, 0.33, 0.67, 1.0))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The sine rounded to multiples of 0.5.",
        inputs={"u": driver("SineWave", amplitude=2.0)},
    )

    interval: float = parameter(0.5, above=0.0, doc="height of a step, in the unit of u")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the nearest multiple of the interval"),)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("step", inputs["u"], "number of the step, 0 at u = 0"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        shape = inputs["u"]
        return (
            Guard("up", shape, "threshold of the next step up", 1),
            Guard("down", shape, "threshold of the next step down", -1),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": p["interval"] * x["step"]}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        within = u["u"] / p["interval"] - x["step"]
        return {"up": within - 0.5 + THRESHOLD_OFFSET, "down": within + 0.5 + 1e-9}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        step = floor(u["u"] / p["interval"] + 0.5)
        return {"step": cell_of(step, x["step"], self.guard_values(t, x, u, p))}

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"step": beyond(self.guard_values(t, x, u, p))}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        # A jump may cross several thresholds. The minimum and maximum ensure at least one step in the
        # direction of the event, despite rounding errors at the threshold.
        nearest = floor(u["u"] / p["interval"] + 0.5)
        down = if_else(e["down"] < 0.0, fmin(nearest, x["step"] - 1.0), x["step"])
        return {"step": if_else(e["up"] > 0.0, fmax(nearest, x["step"] + 1.0), down)}
