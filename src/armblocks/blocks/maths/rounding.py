"""Integers and what they leave: rounding, remainders, and the events at which the integer changes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, ceil, fabs, floor, fmax, fmin, fmod, if_else, logic_and, sign

from armblocks.blocks.elementwise import common_unit
from armblocks.blocks.switching import JUST, beyond, cell_of, zero_crossing_parameter
from armblocks.diagram import (
    Block,
    Guard,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    broadcast,
    made,
    parameter,
)
from armblocks.diagram.signs import FaceSign, Words, function_sign
from armblocks.equations import Shape


def _round(u: SX) -> SX:
    """To the nearest integer, halves away from zero, exact for every double."""
    whole = floor(fabs(u))
    return sign(u) * (whole + (fabs(u) - whole >= 0.5))


_ROUNDINGS: Mapping[str, Callable[[SX], SX]] = {
    "floor": floor,
    "ceil": ceil,
    "round": _round,
    "fix": lambda u: sign(u) * floor(fabs(u)),
}


def _rounding_edges(function: str, n: SX, mirrored: bool = False) -> tuple[SX, SX]:
    """Above which u the result exceeds n, and whether that border itself does; ``mirrored``: of -f(-u)."""
    if function == "round":
        return n + 0.5, n >= 0.0
    if function == "fix":
        return if_else(n >= 0.0, n + 1.0, n), n >= 0.0
    if (function == "floor") is not mirrored:
        return n + 1.0, SX(1.0)
    return n, SX(0.0)


def step_after(now: SX, before: SX, e: Signals) -> SX:
    """An integer after the events ``up`` and ``down``; ``now``: by the values of the moment.

    A jump may pass several integers at once; at a border, rounding must not undo the step.
    """
    down = if_else(e["down"] < 0.0, fmin(now, before - 1.0), before)
    return if_else(e["up"] > 0.0, fmax(now, before + 1.0), down)


@dataclass(frozen=True, kw_only=True)
class Rounding(Block):
    """Every element to an integer: down, up, to the nearest (halves away from zero) or towards zero."""

    memoryless: ClassVar[bool] = True
    title: ClassVar[str] = "Rounding Function"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The greatest integer that is not above the signal.",
        inputs={"u": made("SineWave", amplitude=3.0)},
    )

    function: str = parameter("floor", choices=tuple(_ROUNDINGS), doc="which way")
    zero_crossing: bool = zero_crossing_parameter()

    def face_sign(self) -> FaceSign:
        return function_sign(self.function)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "any signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "integers"),)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("integer", inputs["u"], "the output"),) if self.zero_crossing else ()

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        if not self.zero_crossing:
            return ()
        up = Guard("up", inputs["u"], "u reaches where the output is greater", 1)
        return (up, Guard("down", inputs["u"], "u reaches where the output is less", -1))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["integer"] if self.zero_crossing else _ROUNDINGS[self.function](u["u"])}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        if not self.zero_crossing:
            return {}
        # Where the next integers begin, and whether their border belongs to them.
        edge, owned = _rounding_edges(self.function, x["integer"])
        below, below_owned = _rounding_edges(self.function, -x["integer"], mirrored=True)
        return {
            "up": u["u"] - edge + if_else(owned, JUST, -JUST),
            "down": u["u"] + below - if_else(below_owned, JUST, -JUST),
        }

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        if not self.zero_crossing:
            return {}
        now = _ROUNDINGS[self.function](u["u"])
        return {"integer": cell_of(now, x["integer"], self.guard_values(t, x, u, p))}

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"integer": beyond(self.guard_values(t, x, u, p))} if self.zero_crossing else {}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        if not self.zero_crossing:
            return {}
        return {"integer": step_after(_ROUNDINGS[self.function](u["u"]), x["integer"], e)}


@dataclass(frozen=True, kw_only=True)
class Modulo(Block):
    """What a division leaves: mod(u, v) has the sign of v and mod(u, 0) = u; rem(u, v) has the sign of u.

    Both are exact. ``rem(u, 0)`` is not a number. In Simulink these are choices of the Math Function block.
    """

    memoryless: ClassVar[bool] = True
    title: ClassVar[str] = "Modulo"
    sign: ClassVar[FaceSign] = Words("mod")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A straight rise modulo 3: it starts again from 0 each time it reaches 3.",
        inputs={"u": made("Ramp"), "v": made("Constant", value=3.0)},
    )

    function: str = parameter("mod", choices=("mod", "rem"), doc="whose sign the result has")
    zero_crossing: bool = zero_crossing_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the dividend"), Port("v", "the divisor"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the remainder"),)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": common_unit(inputs)}

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return turn_modes(broadcast(inputs)) if self.zero_crossing else ()

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return turn_guards(broadcast(inputs)) if self.zero_crossing else ()

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        if not self.zero_crossing:
            return {"y": remainder(self.function, u["u"], u["v"])}
        return {"y": remainder_of_turn(self.function, u["u"], u["v"], x["turns"])}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return turn_guard_values(self.function, u["u"], u["v"], x["turns"]) if self.zero_crossing else {}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        if not self.zero_crossing:
            return {}
        now = turns_of(self.function, u["u"], u["v"])
        return {"turns": cell_of(now, x["turns"], self.guard_values(t, x, u, p))}

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"turns": beyond(self.guard_values(t, x, u, p))} if self.zero_crossing else {}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        if not self.zero_crossing:
            return {}
        return {"turns": step_after(turns_of(self.function, u["u"], u["v"]), x["turns"], e)}


# A remainder u - n v, with the count n of turns as a mode: the flow between two jumps is one straight line.

_QUOTIENTS = {"mod": "floor", "rem": "fix"}
"""How u / v becomes the count of turns."""


def remainder(function: str, u: SX, v: SX) -> SX:
    """Exactly ``mod``, with the sign of the divisor and u itself where that is zero, or ``rem``."""
    rest = fmod(u, v)
    if function == "rem":
        return rest
    other_sign = logic_and(rest != 0.0, (rest < 0.0) != (v < 0.0))
    return if_else(v == 0.0, u, if_else(other_sign, rest + v, rest))


def turns_of(function: str, u: SX, v: SX) -> SX:
    """How often v is taken from u, in agreement with :func:`remainder`."""
    return if_else(v == 0.0, 0.0, _round((u - remainder(function, u, v)) / v))


def remainder_of_turn(function: str, u: SX, v: SX, turns: SX) -> SX:
    """The remainder while so many turns are taken, also a little beyond where that ends."""
    return if_else(turns_of(function, u, v) == turns, remainder(function, u, v), u - turns * v)


def turn_modes(shape: Shape) -> tuple[State, ...]:
    """The count of turns."""
    return (State("turns", shape, "how often the divisor is taken away"),)


def turn_guards(shape: Shape) -> tuple[Guard, ...]:
    """Both ends of a turn."""
    up = Guard("up", shape, "one turn more is taken away", 1)
    return (up, Guard("down", shape, "one turn less is taken away", -1))


def turn_guard_values(function: str, u: SX, v: SX, turns: SX) -> Signals:
    """How far u is beyond both ends, in the direction of v."""
    rule = _QUOTIENTS[function]
    edge, owned = _rounding_edges(rule, turns)
    below, below_owned = _rounding_edges(rule, -turns, mirrored=True)
    found = {
        "up": (u - edge * v) * sign(v) + if_else(owned, JUST, -JUST),
        "down": (u + below * v) * sign(v) - if_else(below_owned, JUST, -JUST),
    }
    # Nothing is taken away by a divisor of zero, and no turn ends.
    return {name: if_else(v == 0.0, 0.0, value) for name, value in found.items()}
