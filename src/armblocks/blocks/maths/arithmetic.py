"""Elementwise arithmetic: each output element depends on the input elements with the same index."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import (
    SX,
    fabs,
    hypot,
    if_else,
    sign,
    sqrt,
)
from numpy.typing import ArrayLike

from armblocks.blocks.elementwise import common_unit
from armblocks.blocks.switching import located, zero_crossing_parameter
from armblocks.diagram import (
    Block,
    Condition,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    WorkedExample,
    driver,
    parameter,
)
from armblocks.diagram.signs import FaceSign, Words, function_sign, graph, plus

_ROOTS: Mapping[str, Callable[[SX], SX]] = {
    "sqrt": sqrt,
    "signedSqrt": lambda u: sign(u) * sqrt(fabs(u)),
    "rSqrt": lambda u: 1.0 / sqrt(u),
}


@dataclass(frozen=True, kw_only=True)
class Abs(Block):
    """The absolute value of every element: y = abs(u)."""

    title: ClassVar[str] = "Abs"
    sign: ClassVar[FaceSign] = Words("|u|")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The absolute value of a sine.",
    )

    zero_crossing: bool = zero_crossing_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "any signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "its absolute value"),)

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

    title: ClassVar[str] = "Bias"
    broadcast_parameters: ClassVar[tuple[str, ...]] = ("bias",)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A sine plus 1.",
        parameters={"bias": 1.0},
    )

    bias: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="constant to add")

    def face_sign(self) -> FaceSign:
        return Words(f"u {plus(self.bias)}")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "any signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the shifted signal"),)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": u["u"] + p["bias"]}


@dataclass(frozen=True, kw_only=True)
class UnaryMinus(Block):
    """The negative of every element: y = -u."""

    title: ClassVar[str] = "Unary Minus"
    sign: ClassVar[FaceSign] = Words("−u")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The negated sine.",
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "any signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "its negative"),)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": -u["u"]}


@dataclass(frozen=True, kw_only=True)
class Sign(Block):
    """The sign of every element: y = 1 where u > 0, -1 where u < 0, 0 where u = 0."""

    title: ClassVar[str] = "Sign"
    sign: ClassVar[FaceSign] = graph((0, 0), (0.5, 0), (0.5, 1), (1, 1))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The output is 1 while the sine is positive, -1 while it is negative.",
    )

    zero_crossing: bool = zero_crossing_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "any signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "its sign"),)

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

    ``sqrt`` and ``rSqrt`` of a negative number are NaN.
    """

    title: ClassVar[str] = "Sqrt"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The square root of a ramp.", inputs={"u": driver("Ramp")}
    )

    function: str = parameter("sqrt", choices=tuple(_ROOTS), doc="root, signed root or reciprocal root")

    def face_sign(self) -> FaceSign:
        return function_sign(self.function)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the radicand"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the root"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": _ROOTS[self.function](u["u"])}


@dataclass(frozen=True, kw_only=True)
class Hypot(Block):
    """The hypotenuse, element by element: y = sqrt(u^2 + v^2), without intermediate overflow."""

    title: ClassVar[str] = "Hypot"
    sign: ClassVar[FaceSign] = Words("√(u²+v²)")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=("The hypotenuse of a right triangle with legs 3 and t: it is 5 at 4 s."),
        inputs={"u": driver("Ramp"), "v": driver("Constant", value=3.0)},
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "first leg"), Port("v", "second leg"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the hypotenuse"),)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": common_unit(inputs)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": hypot(u["u"], u["v"])}


@dataclass(frozen=True, kw_only=True)
class Divide(Block):
    """The quotient of two inputs, element by element: y = dividend / divisor."""

    title: ClassVar[str] = "Divide"
    sign: ClassVar[FaceSign] = Words("÷")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A sine divided by a divisor that rises from 1 to 3.",
        inputs={"dividend": driver("SineWave"), "divisor": driver("Ramp", slope=0.2, initial=1.0)},
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("dividend", "dividend"), Port("divisor", "divisor"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the quotient"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": u["dividend"] / u["divisor"]}


@dataclass(frozen=True, kw_only=True)
class Polynomial(Block):
    """A polynomial of every element, highest power first: y = c1 u^n + … + cn u + c(n+1).

    The block uses Horner's scheme.
    """

    title: ClassVar[str] = "Polynomial"
    sign: ClassVar[FaceSign] = Words("P(u)")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The parabola u^2 - 1, over u.",
        parameters={"coefficients": (1.0, 0.0, -1.0)},
        inputs={"u": driver("Ramp", slope=0.4, initial=-2.0)},
        x_axis="u",
        y_axis="y",
    )

    coefficients: ArrayLike = parameter((1.0, 0.0), dimensions=(1,), doc="c1 … c(n+1), highest power first")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the argument"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the value of the polynomial"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        c = p["coefficients"]
        value = c[0] * SX.ones(*u["u"].shape)
        for k in range(1, c.numel()):
            value = value * u["u"] + c[k]
        return {"y": value}
