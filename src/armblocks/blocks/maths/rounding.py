"""Integers and what they leave: rounding, remainders, and the events at which the integer changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, fmod, if_else, logic_and, sign

from armblocks.blocks.elementwise import common_unit
from armblocks.blocks.integer_steps import (
    ROUNDINGS,
    BlockWithSteps,
    IntegerSteps,
    nearest,
    rounding_edges,
    step_after,
)
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


@dataclass(frozen=True, kw_only=True)
class Rounding(BlockWithSteps):
    """Every element to an integer: down, up, to the nearest (halves away from zero) or towards zero."""

    title: ClassVar[str] = "Rounding Function"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The greatest integer that is not above the signal.",
        inputs={"u": made("SineWave", amplitude=3.0)},
    )

    function: str = parameter("floor", choices=tuple(ROUNDINGS), doc="which way")
    zero_crossing: bool = zero_crossing_parameter()

    def face_sign(self) -> FaceSign:
        return function_sign(self.function)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "any signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "integers"),)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def _steps(self) -> tuple[IntegerSteps, ...]:
        return (IntegerSteps("u", self.function),) if self.zero_crossing else ()

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["integer"] if self.zero_crossing else ROUNDINGS[self.function](u["u"])}


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
    return if_else(v == 0.0, 0.0, nearest((u - remainder(function, u, v)) / v))


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
    edge, owned = rounding_edges(rule, turns)
    below, below_owned = rounding_edges(rule, -turns, mirrored=True)
    found = {
        "up": (u - edge * v) * sign(v) + if_else(owned, JUST, -JUST),
        "down": (u + below * v) * sign(v) - if_else(below_owned, JUST, -JUST),
    }
    # Nothing is taken away by a divisor of zero, and no turn ends.
    return {name: if_else(v == 0.0, 0.0, value) for name, value in found.items()}
