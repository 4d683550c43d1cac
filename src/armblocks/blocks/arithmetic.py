"""Elementwise arithmetic: every element of the output follows from the elements of the inputs beside it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import pi
from typing import ClassVar

from casadi import (
    SX,
    atan2,
    ceil,
    cos,
    fabs,
    floor,
    fmax,
    fmin,
    fmod,
    hypot,
    if_else,
    logic_and,
    sign,
    sin,
    sqrt,
)
from numpy.typing import ArrayLike

from armblocks.blocks.elementwise import common_unit
from armblocks.blocks.switching import JUST, located, zero_crossing_parameter
from armblocks.diagram import (
    Block,
    Condition,
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


def _round(u: SX) -> SX:
    """To the nearest integer, halves away from zero, exact for every double."""
    whole = floor(fabs(u))
    return sign(u) * (whole + (fabs(u) - whole >= 0.5))


def _modulo(u: SX, v: SX) -> SX:
    """The remainder with the sign of the divisor; u itself where the divisor is zero."""
    rest = fmod(u, v)
    other_sign = logic_and(rest != 0.0, (rest < 0.0) != (v < 0.0))
    return if_else(v == 0.0, u, if_else(other_sign, rest + v, rest))


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


_ROOTS: Mapping[str, Callable[[SX], SX]] = {
    "sqrt": sqrt,
    "signedSqrt": lambda u: sign(u) * sqrt(fabs(u)),
    "rSqrt": lambda u: 1.0 / sqrt(u),
}


@dataclass(frozen=True, kw_only=True)
class Abs(Block):
    """The absolute value of every element: y = abs(u)."""

    family: ClassVar[str] = "maths"
    title: ClassVar[str] = "Abs"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The lower half of the sine, turned up.",
    )

    zero_crossing: bool = zero_crossing_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "any signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "its absolute value"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": inputs["u"]}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        return located(self, Condition("negative", inputs["u"], "1 where u < 0", closed=False))

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"negative": -u["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": if_else(x["negative"], -u["u"], u["u"])}


@dataclass(frozen=True, kw_only=True)
class Bias(Block):
    """A constant added to every element: y = u + bias."""

    family: ClassVar[str] = "maths"
    title: ClassVar[str] = "Bias"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The sine, 1 higher.",
        parameters={"bias": 1.0},
    )

    bias: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="what is added")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "any signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the shifted signal"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast({**inputs, "bias": shape_of(self.bias)})}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": u["u"] + p["bias"]}


@dataclass(frozen=True, kw_only=True)
class UnaryMinus(Block):
    """The negative of every element: y = -u."""

    family: ClassVar[str] = "maths"
    title: ClassVar[str] = "Unary Minus"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The sine, upside down.",
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "any signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "its negative"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": inputs["u"]}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": -u["u"]}


@dataclass(frozen=True, kw_only=True)
class Sign(Block):
    """The sign of every element: y = 1 where u > 0, -1 where u < 0, 0 where u = 0."""

    family: ClassVar[str] = "maths"
    title: ClassVar[str] = "Sign"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="1 while the sine is positive, -1 while it is negative.",
    )

    zero_crossing: bool = zero_crossing_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "any signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "its sign"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": inputs["u"]}

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        above = Condition("positive", inputs["u"], "1 where u > 0", closed=False)
        return located(self, above, Condition("negative", inputs["u"], "1 where u < 0", closed=False))

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"positive": u["u"], "negative": -u["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["positive"] - x["negative"]}


@dataclass(frozen=True, kw_only=True)
class Sqrt(Block):
    """A square root of every element: y = sqrt(u), sign(u) sqrt(abs(u)) or 1 / sqrt(u).

    Of a negative number ``sqrt`` and ``rSqrt`` are not a number.
    """

    family: ClassVar[str] = "maths"
    title: ClassVar[str] = "Sqrt"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The root of a straight rise.", inputs={"u": made("Ramp")}
    )

    function: str = parameter("sqrt", choices=tuple(_ROOTS), doc="root, signed root or reciprocal root")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the square"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the root"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": _ROOTS[self.function](u["u"])}


@dataclass(frozen=True, kw_only=True)
class Rounding(Block):
    """Every element to an integer: down, up, to the nearest (halves away from zero) or towards zero."""

    family: ClassVar[str] = "maths"
    title: ClassVar[str] = "Rounding Function"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The greatest integer that is not above the signal.",
        inputs={"u": made("SineWave", amplitude=3.0)},
    )

    function: str = parameter("floor", choices=tuple(_ROUNDINGS), doc="which way")
    zero_crossing: bool = zero_crossing_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "any signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "integers"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": inputs["u"]}

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
        return {"integer": _ROUNDINGS[self.function](u["u"])} if self.zero_crossing else {}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        # A jump may pass several integers at once; at a border, rounding must not undo the step.
        rounded = _ROUNDINGS[self.function](u["u"])
        down = if_else(e["down"] < 0.0, fmin(rounded, x["integer"] - 1.0), x["integer"])
        return {"integer": if_else(e["up"] > 0.0, fmax(rounded, x["integer"] + 1.0), down)}


@dataclass(frozen=True, kw_only=True)
class Modulo(Block):
    """What a division leaves: mod(u, v) has the sign of v and mod(u, 0) = u; rem(u, v) has the sign of u.

    Both are exact. ``rem(u, 0)`` is not a number. In Simulink these are choices of the Math Function block.
    """

    family: ClassVar[str] = "maths"
    title: ClassVar[str] = "Modulo"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A straight rise modulo 3: it starts again from 0 each time it reaches 3.",
        inputs={"u": made("Ramp"), "v": made("Constant", value=3.0)},
    )

    function: str = parameter("mod", choices=("mod", "rem"), doc="whose sign the result has")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the dividend"), Port("v", "the divisor"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the remainder"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast(inputs)}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": common_unit(inputs)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": (_modulo if self.function == "mod" else fmod)(u["u"], u["v"])}


@dataclass(frozen=True, kw_only=True)
class Hypot(Block):
    """The hypotenuse, element by element: y = sqrt(u^2 + v^2), without overflow on the way."""

    family: ClassVar[str] = "maths"
    title: ClassVar[str] = "Hypot"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=(
            "The longest side of a right triangle with one side of 3 and one that grows: it meets 5 at 4 s."
        ),
        inputs={"u": made("Ramp"), "v": made("Constant", value=3.0)},
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "one leg"), Port("v", "the other leg"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the hypotenuse"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast(inputs)}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": common_unit(inputs)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": hypot(u["u"], u["v"])}


@dataclass(frozen=True, kw_only=True)
class Divide(Block):
    """One input by the other, element by element: y = dividend / divisor."""

    family: ClassVar[str] = "maths"
    title: ClassVar[str] = "Divide"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A sine divided by a divisor that rises from 1 to 3.",
        inputs={"dividend": made("SineWave"), "divisor": made("Ramp", slope=0.2, initial=1.0)},
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("dividend", "what is divided"), Port("divisor", "by what"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the quotient"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast(inputs)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": u["dividend"] / u["divisor"]}


@dataclass(frozen=True, kw_only=True)
class Polynomial(Block):
    """A polynomial of every element, the highest power first: y = c1 u^n + … + cn u + c(n+1).

    Worked out by Horner's rule.
    """

    family: ClassVar[str] = "maths"
    title: ClassVar[str] = "Polynomial"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The parabola u^2 - 1, over u.",
        parameters={"coefficients": (1.0, 0.0, -1.0)},
        inputs={"u": made("Ramp", slope=0.4, initial=-2.0)},
        across="u",
        up="y",
    )

    coefficients: ArrayLike = parameter((1.0, 0.0), dimensions=(1,), doc="c1 … c(n+1), highest power first")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the argument"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the value of the polynomial"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        c = p["coefficients"]
        value = c[0] * SX.ones(*u["u"].shape)
        for k in range(1, c.numel()):
            value = value * u["u"] + c[k]
        return {"y": value}


@dataclass(frozen=True, kw_only=True)
class DegreesToRadians(Block):
    """An angle in degrees told in radians: y = u pi / 180."""

    family: ClassVar[str] = "maths"
    title: ClassVar[str] = "Degrees to Radians"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="An angle from 0 to 360 degrees, in radians from 0 to 2 pi.",
        inputs={"u": made("Ramp", slope=36.0)},
        shown=("y",),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "angle in degrees", "deg"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the same angle in radians", "rad"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": u["u"] * (math.pi / 180.0)}


@dataclass(frozen=True, kw_only=True)
class RadiansToDegrees(Block):
    """An angle in radians told in degrees: y = u 180 / pi."""

    family: ClassVar[str] = "maths"
    title: ClassVar[str] = "Radians to Degrees"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="An angle from 0 to 10 radians, in degrees.",
        inputs={"u": made("Ramp")},
        shown=("y",),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "angle in radians", "rad"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the same angle in degrees", "deg"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": u["u"] * (180.0 / math.pi)}


@dataclass(frozen=True, kw_only=True)
class CartesianToPolar(Block):
    """Magnitude and angle of the point (x, y): r = sqrt(x^2 + y^2), angle = atan2(y, x)."""

    family: ClassVar[str] = "maths"
    title: ClassVar[str] = "Cartesian to Polar"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=(
            "A point on an ellipse with the half axes 2 and 1: its distance, and its angle, which "
            "wraps at pi."
        ),
        inputs={"x": made("SineWave", amplitude=2.0, phase=pi / 2), "y": made("SineWave")},
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

    family: ClassVar[str] = "maths"
    title: ClassVar[str] = "Polar to Cartesian"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Distance and angle grow evenly: the point runs along a spiral of Archimedes.",
        inputs={
            "r": made("Ramp", slope=0.1).named("distance"),
            "angle": made("Ramp", slope=2.0).named("angle"),
        },
        across="x",
        up="y",
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
    """The difference of two angles the short way round: y = mod(a - b + pi, 2 pi) - pi, from -pi up to pi."""

    family: ClassVar[str] = "maths"
    title: ClassVar[str] = "angdiff"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="How far an angle that grows evenly is from 1 rad, the shorter way around.",
        inputs={"a": made("Ramp"), "b": made("Constant")},
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("a", "one angle", "rad"), Port("b", "the angle that is taken away", "rad"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "a - b, at least -pi and below pi", "rad"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast(inputs)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": _modulo(u["a"] - u["b"] + math.pi, SX(2.0 * math.pi)) - math.pi}
