"""Blocks whose output has kinks and jumps: each switch is an event, located exactly."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, floor, fmax, fmin, if_else
from numpy.typing import ArrayLike

from armblocks.blocks.switching import (
    JUST,
    beyond,
    cell_of,
    counted,
    limits_in_order,
    since,
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
    made,
    parameter,
    shape_of,
)


@dataclass(frozen=True, kw_only=True)
class Saturation(Block):
    """The input held between two limits: y = min(max(u, lower), upper)."""

    family: ClassVar[str] = "discontinuities"
    memoryless: ClassVar[bool] = True
    title: ClassVar[str] = "Saturation"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The crests of the sine are cut off at 1.5, its troughs at -0.5.",
        parameters={"lower": -0.5, "upper": 1.5},
        inputs={"u": made("SineWave", amplitude=2.0)},
    )

    lower: ArrayLike = parameter(-0.5, kind=ParameterKind.ARRAY, finite=False, doc="the least output")
    upper: ArrayLike = parameter(0.5, kind=ParameterKind.ARRAY, finite=False, doc="the greatest output")

    def check(self) -> None:
        limits_in_order(self, "lower", "upper")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "what is limited"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the limited signal"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast({**inputs, "lower": shape_of(self.lower), "upper": shape_of(self.upper)})}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("mode", self.output_shapes(inputs)["y"], "-1 at the lower limit, 1 at the upper, 0"),)

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
    """Nothing within the zone, what exceeds it outside: y = u - end above, u - start below, 0 between."""

    family: ClassVar[str] = "discontinuities"
    memoryless: ClassVar[bool] = True
    title: ClassVar[str] = "Dead Zone"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Between -0.5 and 0.5 nothing comes through, outside what exceeds the zone.",
    )

    start: ArrayLike = parameter(-0.5, kind=ParameterKind.ARRAY, doc="where the zone begins")
    end: ArrayLike = parameter(0.5, kind=ParameterKind.ARRAY, doc="where the zone ends")

    def check(self) -> None:
        limits_in_order(self, "start", "end")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "what exceeds the zone"),)

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
    """A switch with hysteresis: y = on_value once u reaches on_point, off_value once u falls to off_point.

    It starts off, unless u begins at or above on_point.
    """

    family: ClassVar[str] = "discontinuities"
    title: ClassVar[str] = "Relay"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="It switches on as the sine rises through 0.5 and off as it falls through -0.5, not before.",
    )

    on_point: float = parameter(0.5, doc="where it switches on")
    off_point: float = parameter(-0.5, doc="where it switches off, at most on_point")
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
        return (State("mode", inputs["u"], "1 on, 0 off", follows=True, remembers=True),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return (
            Guard("on", inputs["u"], "u - on_point", 1, locates=True),
            Guard("off", inputs["u"], "u - off_point", -1, locates=True),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": if_else(x["mode"] > 0.0, p["on_value"], p["off_value"])}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"on": u["u"] - p["on_point"] + JUST, "off": u["u"] - p["off_point"] - JUST}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        sides = self.guard_values(t, x, u, p)
        stays = if_else(sides["off"] < 0.0, 0.0, x["mode"])
        return {"mode": if_else(sides["on"] > 0.0, 1.0, stays)}


@dataclass(frozen=True, kw_only=True)
class Quantizer(Block):
    """The input in steps: y = interval round(u / interval), halves upwards.

    A step down happens 1e-9 of the interval later than the step up, so that rounding makes none chatter.
    """

    family: ClassVar[str] = "discontinuities"
    memoryless: ClassVar[bool] = True
    title: ClassVar[str] = "Quantizer"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The sine in steps of 0.5.",
        inputs={"u": made("SineWave", amplitude=2.0)},
    )

    interval: float = parameter(0.5, above=0.0, doc="the height of a step")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the nearest step"),)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("step", inputs["u"], "the number of the step, 0 at u = 0"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        shape = inputs["u"]
        return (Guard("up", shape, "the edge above", 1), Guard("down", shape, "the edge below", -1))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": p["interval"] * x["step"]}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        within = u["u"] / p["interval"] - x["step"]
        return {"up": within - 0.5 + JUST, "down": within + 0.5 + 1e-9}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        now = floor(u["u"] / p["interval"] + 0.5)
        return {"step": cell_of(now, x["step"], self.guard_values(t, x, u, p))}

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"step": beyond(self.guard_values(t, x, u, p))}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        # A jump may pass several edges at once; at an edge, rounding must not undo the step.
        nearest = floor(u["u"] / p["interval"] + 0.5)
        down = if_else(e["down"] < 0.0, fmin(nearest, x["step"] - 1.0), x["step"])
        return {"step": if_else(e["up"] > 0.0, fmax(nearest, x["step"] + 1.0), down)}


@dataclass(frozen=True, kw_only=True)
class Switch(Block):
    """One of two signals: y = u1 where the control meets the criterion, u3 elsewhere."""

    family: ClassVar[str] = "routing"
    memoryless: ClassVar[bool] = True
    title: ClassVar[str] = "Switch"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A fast sine while the control is at least 0.5, a constant else.",
        parameters={"threshold": 0.5},
        inputs={
            "u1": made("SineWave", frequency=5.0),
            "u2": made("PulseGenerator", period=5.0),
            "u3": made("Constant", value=-0.5),
        },
    )

    criterion: str = parameter(">=", choices=(">=", ">"), doc="how the control compares with the threshold")
    threshold: float = parameter(0.0, doc="what the control is compared with")

    def input_ports(self) -> tuple[Port, ...]:
        return (
            Port("u1", "given where the criterion is met"),
            Port("u2", "the control"),
            Port("u3", "given elsewhere"),
        )

    def bus_inputs(self) -> tuple[str, ...]:
        return ("u1", "u3")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "one of the two"),)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u1"] if inputs["u1"] == inputs["u3"] else ""}

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("mode", inputs["u2"], "1 where the criterion is met, else 0"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return (Guard("control", inputs["u2"], "u2 - threshold"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": if_else(x["mode"] > 0.0, u["u1"], u["u3"])}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"control": u["u2"] - p["threshold"] + (JUST if self.criterion == ">=" else -JUST)}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"mode": self.guard_values(t, x, u, p)["control"] > 0.0}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return {"mode": if_else(e["control"] == 0.0, x["mode"], e["control"] > 0.0)}


@dataclass(frozen=True, kw_only=True)
class PulseGenerator(Block):
    """Square pulses: y = amplitude during the first width % of each period after the delay, 0 elsewhere."""

    family: ClassVar[str] = "sources"
    memoryless: ClassVar[bool] = True
    title: ClassVar[str] = "Pulse Generator"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="High for the first 30 % of every two seconds.",
        parameters={"width": 30.0},
    )

    amplitude: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="the height of the pulses")
    period: float = parameter(2.0, above=0.0, doc="from one pulse to the next", unit="s")
    width: float = parameter(50.0, above=0.0, maximum=99.999, doc="the length of a pulse in % of the period")
    delay: float = parameter(0.0, minimum=0.0, doc="when the first pulse begins", unit="s")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the pulses"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": shape_of(self.amplitude)}

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("edges", (), "how many edges have passed"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return (Guard("edge", (), "t - the next edge", 1),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": p["amplitude"] * (x["edges"] - 2.0 * floor(x["edges"] / 2.0))}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        pulses = floor(x["edges"] / 2.0)
        high = x["edges"] - 2.0 * pulses
        return {"edge": since(t, p["delay"] + (pulses + high * p["width"] / 100.0) * p["period"])}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        # k * period / period may come out a little below k.
        periods = (t - p["delay"]) / p["period"] * (1.0 + 1e-14)
        pulses = floor(periods)
        over = (periods - pulses) * 100.0 >= p["width"] * (1.0 - 1e-12)
        passed = if_else(t < p["delay"], 0.0, 2.0 * pulses + 1.0 + over)
        return {"edges": counted(passed, x["edges"], self.contradictions(t, x, u, p)["edges"])}

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"edges": self.guard_values(t, x, u, p)["edge"] > 0.0}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return {"edges": x["edges"] + (e["edge"] > 0.0)}
