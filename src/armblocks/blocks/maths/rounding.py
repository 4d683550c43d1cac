"""Rounding and remainders, and the events at which the integer part changes."""

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
from armblocks.blocks.switching import THRESHOLD_OFFSET, beyond, cell_of, zero_crossing_parameter
from armblocks.diagram import (
    Block,
    Guard,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    broadcast,
    driver,
    parameter,
)
from armblocks.diagram.signs import FaceSign, Words, function_sign
from armblocks.equations import Shape


@dataclass(frozen=True, kw_only=True)
class Rounding(BlockWithSteps):
    """Rounds every element: down, up, to the nearest integer (halves away from zero) or towards zero."""

    title: ClassVar[str] = "Rounding Function"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The greatest integer that is not above the signal.",
        inputs={"u": driver("SineWave", amplitude=3.0)},
    )

    function: str = parameter("floor", choices=tuple(ROUNDINGS), doc="the rounding rule")
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
    """The remainder: mod(u, v) has the sign of v, and mod(u, 0) = u; rem(u, v) has the sign of u.

    Both are exact. ``rem(u, 0)`` is NaN. In Simulink they are options of the Math Function block.
    """

    following_modes: ClassVar[bool] = True
    title: ClassVar[str] = "Modulo"
    sign: ClassVar[FaceSign] = Words("mod")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A ramp modulo 3: it restarts from 0 each time it reaches 3.",
        inputs={"u": driver("Ramp"), "v": driver("Constant", value=3.0)},
    )

    function: str = parameter(
        "mod", choices=("mod", "rem"), doc="mod or rem, which determines the sign of the result"
    )
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
        turns = turns_of(self.function, u["u"], u["v"])
        return {"turns": cell_of(turns, x["turns"], self.guard_values(t, x, u, p))}

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"turns": beyond(self.guard_values(t, x, u, p))} if self.zero_crossing else {}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        if not self.zero_crossing:
            return {}
        return {"turns": step_after(turns_of(self.function, u["u"], u["v"]), x["turns"], e)}


# The remainder is u - n v; the integer n is a mode, so that the remainder is smooth between two events.

_QUOTIENTS = {"mod": "floor", "rem": "fix"}
"""The rounding that gives the integer n from u / v."""


def remainder(function: str, u: SX, v: SX) -> SX:
    """The exact ``mod`` (sign of the divisor; u if the divisor is zero) or ``rem``."""
    rest = fmod(u, v)
    if function == "rem":
        return rest
    other_sign = logic_and(rest != 0.0, (rest < 0.0) != (v < 0.0))
    return if_else(v == 0.0, u, if_else(other_sign, rest + v, rest))


def turns_of(function: str, u: SX, v: SX) -> SX:
    """The integer n in u - n v, consistent with :func:`remainder`."""
    return if_else(v == 0.0, 0.0, nearest((u - remainder(function, u, v)) / v))


def remainder_of_turn(function: str, u: SX, v: SX, turns: SX) -> SX:
    """The remainder for a given n, valid also slightly beyond the end of its interval."""
    return if_else(turns_of(function, u, v) == turns, remainder(function, u, v), u - turns * v)


def turn_modes(shape: Shape) -> tuple[State, ...]:
    """The integer n of the remainder u - n v."""
    return (State("turns", shape, "the integer n in u - n v"),)


def turn_guards(shape: Shape) -> tuple[Guard, ...]:
    """The events at both ends of an interval with constant n."""
    up = Guard("up", shape, "n increases", 1)
    return (up, Guard("down", shape, "n decreases", -1))


def turn_guard_values(function: str, u: SX, v: SX, turns: SX) -> Signals:
    """The distance of u beyond both ends of the interval, in the direction of v."""
    rule = _QUOTIENTS[function]
    edge, owned = rounding_edges(rule, turns)
    below, below_owned = rounding_edges(rule, -turns, mirrored=True)
    values = {
        "up": (u - edge * v) * sign(v) + if_else(owned, THRESHOLD_OFFSET, -THRESHOLD_OFFSET),
        "down": (u + below * v) * sign(v) - if_else(below_owned, THRESHOLD_OFFSET, -THRESHOLD_OFFSET),
    }
    # With a divisor of zero, n is 0 and no event occurs.
    return {name: if_else(v == 0.0, 0.0, value) for name, value in values.items()}
