"""Blocks for angles: conversion of units, polar coordinates, wrapped differences."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from typing import ClassVar

from casadi import SX, atan2, cos, hypot, sin

from armblocks.blocks.elementwise import common_unit
from armblocks.blocks.integer_steps import step_after
from armblocks.blocks.maths.rounding import quotient_guard_values, quotient_guards, quotient_modes
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
)
from armblocks.diagram.signs import FaceSign, Words
from armblocks.equations.remainders import quotient_of, remainder, remainder_for_quotient


@dataclass(frozen=True, kw_only=True)
class DegreesToRadians(Block):
    """Converts an angle from degrees to radians: y = u pi / 180."""

    title: ClassVar[str] = "Degrees to Radians"
    sign: ClassVar[FaceSign] = Words("° → rad")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="An angle from 0 to 2 pi rad. Charts show angles in degrees.",
        inputs={"u": driver("Ramp", slope=36.0)},
        shown=("y",),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "angle in degrees", "deg"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the same angle in radians", "rad"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": u["u"] * (pi / 180.0)}


@dataclass(frozen=True, kw_only=True)
class RadiansToDegrees(Block):
    """Converts an angle from radians to degrees: y = u 180 / pi."""

    title: ClassVar[str] = "Radians to Degrees"
    sign: ClassVar[FaceSign] = Words("rad → °")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="An angle from 0 to 10 radians, in degrees.",
        inputs={"u": driver("Ramp")},
        shown=("y",),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "angle in radians", "rad"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the same angle in degrees", "deg"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": u["u"] * (180.0 / pi)}


@dataclass(frozen=True, kw_only=True)
class CartesianToPolar(Block):
    """Magnitude and angle of the point (x, y): r = sqrt(x^2 + y^2), angle = atan2(y, x)."""

    title: ClassVar[str] = "Cartesian to Polar"
    sign: ClassVar[FaceSign] = Words("xy→rθ")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=(
            "Distance and angle of a point on an ellipse with the half axes 2 and 1. The angle wraps at pi."
        ),
        inputs={"x": driver("SineWave", amplitude=2.0, phase=pi / 2), "y": driver("SineWave")},
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("x", "coordinate along x"), Port("y", "coordinate along y"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("r", "distance from the origin"), Port("angle", "angle, -pi to pi", "rad"))

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"r": broadcast(inputs), "angle": broadcast(inputs)}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"r": common_unit(inputs)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"r": hypot(u["x"], u["y"]), "angle": atan2(u["y"], u["x"])}


@dataclass(frozen=True, kw_only=True)
class PolarToCartesian(Block):
    """The point at a magnitude and an angle: x = r cos(angle), y = r sin(angle)."""

    title: ClassVar[str] = "Polar to Cartesian"
    sign: ClassVar[FaceSign] = Words("rθ→xy")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Distance and angle grow linearly: the point moves along an Archimedean spiral.",
        inputs={
            "r": driver("Ramp", slope=0.1).named("distance"),
            "angle": driver("Ramp", slope=2.0).named("angle"),
        },
        x_axis="x",
        y_axis="y",
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("r", "distance from the origin"), Port("angle", "angle from the x axis", "rad"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("x", "coordinate along x"), Port("y", "coordinate along y"))

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"x": broadcast(inputs), "y": broadcast(inputs)}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"x": inputs["r"], "y": inputs["r"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": u["r"] * cos(u["angle"]), "y": u["r"] * sin(u["angle"])}


@dataclass(frozen=True, kw_only=True)
class AngleDifference(Block):
    """The wrapped difference of two angles: y = mod(a - b + pi, 2 pi) - pi, with -pi <= y < pi."""

    following_modes: ClassVar[bool] = True
    title: ClassVar[str] = "angdiff"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The wrapped difference between a linearly growing angle and 1 rad.",
        inputs={"a": driver("Ramp"), "b": driver("Constant")},
    )

    zero_crossing: bool = zero_crossing_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("a", "the first angle", "rad"), Port("b", "the angle to subtract", "rad"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "a - b, at least -pi and below pi", "rad"),)

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        if not self.zero_crossing:
            return ()
        return quotient_modes(broadcast(inputs), "the integer n in y = a - b - 2 pi n")

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return quotient_guards(broadcast(inputs)) if self.zero_crossing else ()

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        if not self.zero_crossing:
            return {"y": remainder("mod", _shifted_difference(u), _TURN) - pi}
        return {"y": remainder_for_quotient("mod", _shifted_difference(u), _TURN, x["turns"]) - pi}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return (
            quotient_guard_values("mod", _shifted_difference(u), _TURN, x["turns"])
            if self.zero_crossing
            else {}
        )

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        if not self.zero_crossing:
            return {}
        quotient = quotient_of("mod", _shifted_difference(u), _TURN)
        return {"turns": cell_of(quotient, x["turns"], self.guard_values(t, x, u, p))}

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"turns": beyond(self.guard_values(t, x, u, p))} if self.zero_crossing else {}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return (
            {"turns": step_after(quotient_of("mod", _shifted_difference(u), _TURN), x["turns"], e)}
            if self.zero_crossing
            else {}
        )


_TURN = SX(2.0 * pi)


def _shifted_difference(u: Signals) -> SX:
    """The difference plus pi: its remainder modulo 2 pi minus pi is the wrapped difference."""
    return u["a"] - u["b"] + pi
