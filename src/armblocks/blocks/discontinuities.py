"""Blocks that switch between equations: each switch is an event, located exactly."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from casadi import SX, fabs, floor, fmax, fmin, if_else, logic_and, logic_or, sign
from numpy.typing import ArrayLike

from armblocks.diagram import (
    Block,
    Guard,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    broadcast,
    parameter,
    shape_of,
)
from armblocks.equations import Shape
from armblocks.errors import InputError

JUST = 1e-300
"""Beside a threshold by less than any signal can tell: it gives the threshold itself a side."""


def _limits_in_order(block: Block, lower: str, upper: str) -> None:
    low, high = block.parameter_value(lower), block.parameter_value(upper)
    broadcast({lower: shape_of(low), upper: shape_of(high)})
    if np.any(np.greater(np.asarray(low), np.asarray(high))):
        raise InputError(
            f"{lower} is {low} and {upper} is {high}",
            where=block.type_name(),
            allowed=f"{lower} <= {upper}",
            fix="exchange them",
        )


def _zone(u: SX, lower: SX, upper: SX) -> SX:
    """-1 below both limits, 1 above, 0 between."""
    return if_else(u > upper, 1.0, if_else(u < lower, -1.0, 0.0))


def _zone_after(mode: SX, e: Signals) -> SX:
    """The zone after an event of the guards ``upper`` and ``lower``, which fire in both directions."""
    inner = if_else(logic_or(e["upper"] < 0.0, e["lower"] > 0.0), 0.0, mode)
    return if_else(e["upper"] > 0.0, 1.0, if_else(e["lower"] < 0.0, -1.0, inner))


@dataclass(frozen=True, kw_only=True)
class Saturation(Block):
    """The input held between two limits: y = min(max(u, lower), upper)."""

    family: ClassVar[str] = "discontinuities"
    title: ClassVar[str] = "Saturation"

    lower: ArrayLike = parameter(-0.5, kind=ParameterKind.ARRAY, finite=False, doc="the least output")
    upper: ArrayLike = parameter(0.5, kind=ParameterKind.ARRAY, finite=False, doc="the greatest output")

    def check(self) -> None:
        _limits_in_order(self, "lower", "upper")

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
        return {"mode": _zone(u["u"], p["lower"], p["upper"])}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return {"mode": _zone_after(x["mode"], e)}


@dataclass(frozen=True, kw_only=True)
class DeadZone(Block):
    """Nothing within the zone, what exceeds it outside: y = u - end above, u - start below, 0 between."""

    family: ClassVar[str] = "discontinuities"
    title: ClassVar[str] = "Dead Zone"

    start: ArrayLike = parameter(-0.5, kind=ParameterKind.ARRAY, doc="where the zone begins")
    end: ArrayLike = parameter(0.5, kind=ParameterKind.ARRAY, doc="where the zone ends")

    def check(self) -> None:
        _limits_in_order(self, "start", "end")

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
        return {"mode": _zone(u["u"], p["start"], p["end"])}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return {"mode": _zone_after(x["mode"], e)}


@dataclass(frozen=True, kw_only=True)
class Relay(Block):
    """A switch with hysteresis: y = on_value once u reaches on_point, off_value once u falls to off_point.

    It starts off, unless u begins at or above on_point.
    """

    family: ClassVar[str] = "discontinuities"
    title: ClassVar[str] = "Relay"

    on_point: float = parameter(0.5, doc="where it switches on")
    off_point: float = parameter(-0.5, doc="where it switches off, at most on_point")
    on_value: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, doc="the output while on")
    off_value: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the output while off")

    def check(self) -> None:
        _limits_in_order(self, "off_point", "on_point")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "on_value or off_value"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        own = {"on_value": shape_of(self.on_value), "off_value": shape_of(self.off_value)}
        return {"y": broadcast({**inputs, **own})}

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("mode", inputs["u"], "1 on, 0 off"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return (
            Guard("on", inputs["u"], "u - on_point", 1),
            Guard("off", inputs["u"], "u - off_point", -1),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": if_else(x["mode"] > 0.0, p["on_value"], p["off_value"])}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"on": u["u"] - p["on_point"] + JUST, "off": u["u"] - p["off_point"] - JUST}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        stays = if_else(u["u"] <= p["off_point"], 0.0, x["mode"])
        return {"mode": if_else(u["u"] >= p["on_point"], 1.0, stays)}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return {"mode": if_else(e["on"] > 0.0, 1.0, if_else(e["off"] < 0.0, 0.0, x["mode"]))}


@dataclass(frozen=True, kw_only=True)
class Quantizer(Block):
    """The input in steps: y = interval round(u / interval), halves upwards.

    A step down happens 1e-9 of the interval later than the step up, so that rounding makes none chatter.
    """

    family: ClassVar[str] = "discontinuities"
    title: ClassVar[str] = "Quantizer"

    interval: float = parameter(0.5, above=0.0, doc="the height of a step")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the nearest step"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": inputs["u"]}

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
        return {"step": floor(u["u"] / p["interval"] + 0.5)}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        # A jump may pass several edges at once; at an edge, rounding must not undo the step.
        nearest = floor(u["u"] / p["interval"] + 0.5)
        down = if_else(e["down"] < 0.0, fmin(nearest, x["step"] - 1.0), x["step"])
        return {"step": if_else(e["up"] > 0.0, fmax(nearest, x["step"] + 1.0), down)}


@dataclass(frozen=True, kw_only=True)
class CoulombFriction(Block):
    """Coulomb and viscous friction: y = sign(u) (offset + gain |u|), and 0 at rest."""

    family: ClassVar[str] = "discontinuities"
    title: ClassVar[str] = "Coulomb and Viscous Friction"

    offset: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, minimum=0.0, doc="Coulomb friction")
    gain: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, minimum=0.0, doc="viscous friction")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the speed"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the force against the motion"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast({**inputs, "offset": shape_of(self.offset), "gain": shape_of(self.gain)})}

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("mode", inputs["u"], "the sign of the speed"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        shape = inputs["u"]
        return (Guard("forward", shape, "u > 0"), Guard("backward", shape, "u < 0"))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["mode"] * p["offset"] + p["gain"] * u["u"]}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"forward": u["u"] - JUST, "backward": u["u"] + JUST}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"mode": sign(u["u"])}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        forward = if_else(e["forward"] == 0.0, x["mode"] > 0.0, e["forward"] > 0.0)
        backward = if_else(e["backward"] == 0.0, x["mode"] < 0.0, e["backward"] < 0.0)
        return {"mode": forward - backward}


@dataclass(frozen=True, kw_only=True)
class Backlash(Block):
    """Play between two parts: y rests while u moves within the play, and follows at its ends.

    y' = u' while y = u - width/2 and u' > 0, or y = u + width/2 and u' < 0; else y' = 0. The input must be
    continuous.
    """

    family: ClassVar[str] = "discontinuities"
    title: ClassVar[str] = "Backlash"
    rated_inputs: ClassVar[tuple[str, ...]] = ("u",)

    width: float = parameter(1.0, minimum=0.0, doc="the width of the play")
    initial: float = parameter(0.0, doc="the output at t = 0, if that is within the play")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the driving part"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the driven part"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": inputs["u"]}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("rest", inputs["u"], "where the driven part rests"),)

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("mode", inputs["u"], "1 driven upwards, -1 downwards, 0 at rest"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        shape = inputs["u"]
        return (
            Guard("upper", shape, "u reaches the upper end of the play", 1),
            Guard("lower", shape, "u reaches the lower end of the play", -1),
            Guard("turn", shape, "u turns back"),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        driven = u["u"] - x["mode"] * p["width"] / 2.0
        return {"y": if_else(x["mode"] == 0.0, x["rest"], driven)}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        ahead = u["u"] - x["rest"]
        # At rest the turning of u is nothing, and while driven the ends of the play are.
        free = x["mode"] == 0.0
        return {
            "upper": if_else(free, ahead - p["width"] / 2.0 - JUST, -1.0),
            "lower": if_else(free, ahead + p["width"] / 2.0 + JUST, 1.0),
            "turn": if_else(free, 0.0, u["u'"]),
        }

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"mode": _zone(u["u"], x["rest"] - p["width"] / 2.0, x["rest"] + p["width"] / 2.0)}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        turned = logic_or(
            logic_and(x["mode"] > 0.0, e["turn"] < 0.0), logic_and(x["mode"] < 0.0, e["turn"] > 0.0)
        )
        driven = if_else(e["upper"] > 0.0, 1.0, if_else(e["lower"] < 0.0, -1.0, x["mode"]))
        rest = if_else(turned, u["u"] - x["mode"] * p["width"] / 2.0, x["rest"])
        return {"mode": if_else(turned, 0.0, driven), "rest": rest}

    def initial_states(self, p: Signals) -> Signals:
        return {"rest": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class StickSlipFriction(Block):
    """A mass with dry friction: mass v' = F - sign(v) coulomb - viscous v, and v = 0 while |F| <= static.

    It rests truly: once it stops under a force that static friction holds, its speed is exactly 0, until the
    force exceeds static friction.
    """

    family: ClassVar[str] = "discontinuities"
    title: ClassVar[str] = "Stick-Slip Friction"

    mass: float = parameter(1.0, above=0.0, doc="the mass", unit="kg")
    coulomb: float = parameter(1.0, minimum=0.0, doc="friction in motion", unit="N")
    static: float = parameter(1.2, minimum=0.0, doc="friction at rest, at least coulomb", unit="N")
    viscous: float = parameter(0.0, minimum=0.0, doc="friction that grows with the speed", unit="N s/m")
    initial_position: float = parameter(0.0, doc="the position at t = 0", unit="m")
    initial_speed: float = parameter(0.0, doc="the speed at t = 0", unit="m/s")

    def check(self) -> None:
        _limits_in_order(self, "coulomb", "static")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("F", "the driving force", "N", shape=()),)

    def output_ports(self) -> tuple[Port, ...]:
        return (
            Port("x", "the position", "m", shape=()),
            Port("v", "the speed", "m/s", shape=()),
            Port("friction", "the force against the motion", "N", shape=()),
        )

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (), "the position", "m"), State("v", (), "the speed", "m/s"))

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("mode", (), "0 at rest, 1 sliding forwards, -1 backwards"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return (
            Guard("stop", (), "the speed"),
            Guard("forwards", (), "F exceeds static friction", 1),
            Guard("backwards", (), "-F exceeds static friction", -1),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        sliding = x["mode"] * p["coulomb"] + p["viscous"] * x["v"]
        return {"x": x["x"], "v": x["v"], "friction": if_else(x["mode"] == 0.0, u["F"], sliding)}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        sliding = (u["F"] - x["mode"] * p["coulomb"] - p["viscous"] * x["v"]) / p["mass"]
        return {"x": x["v"], "v": if_else(x["mode"] == 0.0, 0.0, sliding)}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial_position"], "v": p["initial_speed"]}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {
            "stop": x["v"],
            "forwards": u["F"] - p["static"] - JUST,
            "backwards": u["F"] + p["static"] + JUST,
        }

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"mode": if_else(x["v"] == 0.0, self._breaking(u, p), sign(x["v"]))}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        stops = logic_and(x["mode"] != 0.0, e["stop"] * x["mode"] < 0.0)
        broken = if_else(e["forwards"] > 0.0, 1.0, if_else(e["backwards"] < 0.0, -1.0, 0.0))
        moving = if_else(x["mode"] == 0.0, broken, x["mode"])
        return {
            "mode": if_else(stops, self._breaking(u, p), moving),
            "v": if_else(stops, 0.0, x["v"]),
        }

    def _breaking(self, u: Signals, p: Signals) -> SX:
        """Whither the force moves a mass at rest."""
        return if_else(fabs(u["F"]) > p["static"], sign(u["F"]), 0.0)


@dataclass(frozen=True, kw_only=True)
class Switch(Block):
    """One of two signals: y = u1 where the control meets the criterion, u3 elsewhere."""

    family: ClassVar[str] = "routing"
    title: ClassVar[str] = "Switch"

    criterion: str = parameter(">=", choices=(">=", ">"), doc="how the control compares with the threshold")
    threshold: float = parameter(0.0, doc="what the control is compared with")

    def input_ports(self) -> tuple[Port, ...]:
        return (
            Port("u1", "given where the criterion is met"),
            Port("u2", "the control"),
            Port("u3", "given elsewhere"),
        )

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "one of the two"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast(inputs)}

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
        if self.criterion == ">=":
            return {"mode": u["u2"] >= p["threshold"]}
        return {"mode": u["u2"] > p["threshold"]}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return {"mode": if_else(e["control"] == 0.0, x["mode"], e["control"] > 0.0)}


_TRIGGERS: Mapping[str, int] = {"rising": 1, "falling": -1, "either": 0}


@dataclass(frozen=True, kw_only=True)
class ResettableIntegrator(Block):
    """The integral over time, set anew by a trigger: y' = u, y = initial at t = 0 and whenever it fires.

    With an external initial value the input ``initial`` says what y becomes; it may come from y itself. The
    trigger fires where it becomes positive (rising), stops being positive (falling), or either.
    """

    family: ClassVar[str] = "continuous"
    title: ClassVar[str] = "Integrator with Reset"

    external_reset: str = parameter("rising", choices=tuple(_TRIGGERS), doc="when the trigger fires")
    initial_condition_source: str = parameter(
        "internal", choices=("internal", "external"), doc="whether a port says what y becomes at a reset"
    )
    initial: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, doc="the output at t = 0, and at a reset without port"
    )

    def input_ports(self) -> tuple[Port, ...]:
        ports = (Port("u", "the rate"), Port("reset", "the trigger", shape=()))
        if self.initial_condition_source == "external":
            return (*ports, Port("initial", "what the output becomes at a reset"))
        return ports

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the integral"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        wide = {name: shape for name, shape in inputs.items() if name != "reset"}
        return {"y": broadcast({**wide, "initial value": shape_of(self.initial)})}

    def assumed_output_shapes(self) -> Shapes:
        return {"y": shape_of(self.initial)}

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", self.output_shapes(inputs)["y"], "the integral"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return (Guard("reset", (), "the trigger", _TRIGGERS[self.external_reset]),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["x"]}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": u["u"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"reset": u["reset"] - JUST}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return {"x": if_else(e["reset"] == 0.0, x["x"], u.get("initial", p["initial"]))}


@dataclass(frozen=True, kw_only=True)
class IntegratorLimited(Block):
    """The integral over time, held between two limits: y' = u, but 0 at a limit while u drives beyond it."""

    family: ClassVar[str] = "continuous"
    title: ClassVar[str] = "Integrator Limited"

    initial: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, doc="the output at t = 0, within the limits"
    )
    lower: ArrayLike = parameter(-1.0, kind=ParameterKind.ARRAY, finite=False, doc="the least output")
    upper: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, finite=False, doc="the greatest output")

    def check(self) -> None:
        _limits_in_order(self, "lower", "upper")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the rate"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the integral"), Port("saturated", "1 at the upper limit, -1 at the lower, else 0"))

    def output_shapes(self, inputs: Shapes) -> Shapes:
        shape = self._shape(inputs)
        return {"y": shape, "saturated": shape}

    def assumed_output_shapes(self) -> Shapes:
        shape = self._shape({})
        return {"y": shape, "saturated": shape}

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", self._shape(inputs), "the integral"),)

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("mode", self._shape(inputs), "1 at the upper limit, -1 at the lower, else 0"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        shape = self._shape(inputs)
        return (
            Guard("upper", shape, "y reaches the upper limit", 1),
            Guard("lower", shape, "y reaches the lower limit", -1),
            Guard("rises", shape, "u becomes positive", 1),
            Guard("falls", shape, "u becomes negative", -1),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["x"], "saturated": x["mode"]}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": if_else(x["mode"] == 0.0, u["u"], 0.0)}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": fmin(fmax(p["initial"], p["lower"]), p["upper"])}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {
            "upper": x["x"] - p["upper"],
            "lower": x["x"] - p["lower"],
            "rises": u["u"] - JUST,
            "falls": u["u"] + JUST,
        }

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        at_lower = logic_and(x["x"] <= p["lower"], u["u"] < 0.0)
        at_upper = logic_and(x["x"] >= p["upper"], u["u"] > 0.0)
        return {"mode": if_else(at_upper, 1.0, if_else(at_lower, -1.0, 0.0))}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        stands = logic_and(x["x"] >= p["upper"], e["rises"] > 0.0)
        stands_low = logic_and(x["x"] <= p["lower"], e["falls"] < 0.0)
        upper, lower = logic_or(e["upper"] > 0.0, stands), logic_or(e["lower"] < 0.0, stands_low)
        freed = logic_or(
            logic_and(x["mode"] > 0.0, e["falls"] < 0.0), logic_and(x["mode"] < 0.0, e["rises"] > 0.0)
        )
        inner = if_else(freed, 0.0, x["mode"])
        return {
            "mode": if_else(upper, 1.0, if_else(lower, -1.0, inner)),
            "x": if_else(upper, p["upper"], if_else(lower, p["lower"], x["x"])),
        }

    def _shape(self, inputs: Shapes) -> Shape:
        names = ("initial", "lower", "upper")
        return broadcast({**inputs, **{name: shape_of(self.parameter_value(name)) for name in names}})


@dataclass(frozen=True, kw_only=True)
class PulseGenerator(Block):
    """Square pulses: y = amplitude during the first width % of each period after the delay, 0 elsewhere."""

    family: ClassVar[str] = "sources"
    title: ClassVar[str] = "Pulse Generator"

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
        return {"edge": t - (p["delay"] + (pulses + high * p["width"] / 100.0) * p["period"]) + JUST}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        # k * period / period may come out a little below k.
        periods = (t - p["delay"]) / p["period"] * (1.0 + 1e-14)
        pulses = floor(periods)
        over = (periods - pulses) * 100.0 >= p["width"] * (1.0 - 1e-12)
        return {"edges": if_else(t < p["delay"], 0.0, 2.0 * pulses + 1.0 + over)}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return {"edges": x["edges"] + (e["edge"] > 0.0)}
