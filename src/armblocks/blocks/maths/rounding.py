"""Rounding and remainders, and the events at which the integer part changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX

from armblocks.blocks.elementwise import common_unit
from armblocks.blocks.integer_steps import ROUNDINGS, BlockWithSteps, IntegerSteps, step_after
from armblocks.blocks.switching import beyond, cell_of, zero_crossing_parameter
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
from armblocks.equations.remainders import beyond_ends, quotient_of, remainder, remainder_for_quotient


@dataclass(frozen=True, kw_only=True)
class Rounding(BlockWithSteps):
    """Rounds every element: ``floor``, ``ceil``, ``round`` (halves away from zero) or ``fix`` (to zero)."""

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
    """The remainder of u / v: y = u - v floor(u / v) for ``mod``, y = u - v fix(u / v) for ``rem``.

    fix rounds towards zero. mod(u, v) has the sign of v, and mod(u, 0) = u. rem(u, v) has the sign of u, and
    rem(u, 0) is NaN. The remainder is computed without rounding u / v. Where u / v exceeds 2^44, its jumps
    are not events. In Simulink, mod and rem are options of the Math Function block.
    """

    following_modes: ClassVar[bool] = True
    title: ClassVar[str] = "Modulo"
    sign: ClassVar[FaceSign] = Words("mod")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A ramp modulo 3: it restarts from 0 each time it reaches 3.",
        inputs={"u": driver("Ramp"), "v": driver("Constant", value=3.0)},
    )

    function: str = parameter(
        "mod", choices=("mod", "rem"), doc="mod or rem; they differ in the sign of the result"
    )
    zero_crossing: bool = zero_crossing_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the dividend"), Port("v", "the divisor"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the remainder"),)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": common_unit(inputs)}

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        if not self.zero_crossing:
            return ()
        return quotient_modes(broadcast(inputs), "the integer n in u - n v")

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return quotient_guards(broadcast(inputs)) if self.zero_crossing else ()

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        if not self.zero_crossing:
            return {"y": remainder(self.function, u["u"], u["v"])}
        return {"y": remainder_for_quotient(self.function, u["u"], u["v"], x["turns"])}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return quotient_guard_values(self.function, u["u"], u["v"], x["turns"]) if self.zero_crossing else {}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        if not self.zero_crossing:
            return {}
        quotient = quotient_of(self.function, u["u"], u["v"])
        return {"turns": cell_of(quotient, x["turns"], self.guard_values(t, x, u, p))}

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"turns": beyond(self.guard_values(t, x, u, p))} if self.zero_crossing else {}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        if not self.zero_crossing:
            return {}
        return {"turns": step_after(quotient_of(self.function, u["u"], u["v"]), x["turns"], e)}


def quotient_modes(shape: Shape, doc: str) -> tuple[State, ...]:
    """The mode of the integer n in a remainder u - n v; ``doc`` describes it."""
    return (State("turns", shape, doc),)


def quotient_guards(shape: Shape) -> tuple[Guard, ...]:
    """The events at both ends of an interval with constant n."""
    up = Guard("up", shape, "n increases", 1)
    return (up, Guard("down", shape, "n decreases", -1))


def quotient_guard_values(function: str, u: SX, v: SX, quotient: SX) -> Signals:
    """The distance of u beyond both ends of the interval, in the direction of v."""
    return dict(zip(("up", "down"), beyond_ends(function, u, v, quotient)))
