"""Mathematical operations: the outputs are functions of the inputs at the same time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import reduce
from math import pi
from typing import ClassVar

import casadi
import numpy as np
from casadi import SX, atan2, if_else, mtimes
from numpy.typing import ArrayLike

from armblocks.blocks.elementwise import common_unit, numbered_ports, unit_of_terms
from armblocks.blocks.integer_steps import BlockWithSteps, IntegerSteps
from armblocks.blocks.switching import located, zero_crossing_parameter
from armblocks.diagram import (
    Block,
    Condition,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    WorkedExample,
    broadcast,
    driver,
    parameter,
    shape_of,
)
from armblocks.diagram.signs import FaceSign, Outline, Words, function_sign, value_text
from armblocks.errors import InputError
from armblocks.rounded_functions import log


@dataclass(frozen=True, kw_only=True)
class Gain(Block):
    """The input times a gain, element by element: y = gain * u."""

    title: ClassVar[str] = "Gain"
    outline: ClassVar[Outline] = Outline.TRIANGLE
    broadcast_parameters: ClassVar[tuple[str, ...]] = ("gain",)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The output is half of the sine.",
        parameters={"gain": 0.5},
        inputs={"u": driver("SineWave")},
    )

    gain: ArrayLike = parameter(
        1.0, kind=ParameterKind.ARRAY, doc="the gain, a scalar or one for each element"
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the input"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the product"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": p["gain"] * u["u"]}


@dataclass(frozen=True, kw_only=True)
class MatrixGain(Block):
    """The product of a matrix and a vector: y = gain u, with gain (m, n), u (n,), y (m,)."""

    title: ClassVar[str] = "Matrix Gain"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=("A rotation of the input vector by 90 degrees."),
        parameters={"gain": ((0.0, -1.0), (1.0, 0.0))},
        inputs={"u": driver("SineWave", amplitude=(1.0, 0.5))},
    )

    gain: ArrayLike = parameter(((1.0,),), kind=ParameterKind.ARRAY, dimensions=(2,), doc="the matrix (m, n)")

    def face_sign(self) -> FaceSign:
        return Words("K·u" if np.size(self.gain) > 4 else value_text(self.gain))

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the vector", shape=shape_of(self.gain)[1:]),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "matrix times vector", shape=shape_of(self.gain)[:1]),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": mtimes(p["gain"], u["u"])}


@dataclass(frozen=True, kw_only=True)
class Sum(Block):
    """The sum of all inputs, each with its sign: for signs "+-" y = u1 - u2."""

    title: ClassVar[str] = "Sum"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A step minus a sine.",
        parameters={"signs": "+-"},
        inputs={"u1": driver("Step"), "u2": driver("SineWave")},
    )

    signs: str = parameter("++", doc="one + or - for each input, such as +-")

    def face_outline(self) -> Outline:
        return Outline.CIRCLE if len(self.signs) <= 3 else Outline.CARD

    def check(self) -> None:
        if not self.signs or set(self.signs) - set("+-"):
            raise InputError(
                f"the value is '{self.signs}'",
                where="Sum.signs",
                allowed="+ and -, at least one",
                fix="write one sign for each input, such as '+-'",
            )

    def input_ports(self) -> tuple[Port, ...]:
        return numbered_ports("u", len(self.signs), "term")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the sum"),)

    def input_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return unit_of_terms(inputs)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": common_unit(inputs)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        terms = [value if sign == "+" else -value for sign, value in zip(self.signs, u.values())]
        return {"y": reduce(lambda left, right: left + right, terms)}


@dataclass(frozen=True, kw_only=True)
class Product(Block):
    """The product of all inputs, element by element: for operators "*/" y = u1 / u2."""

    title: ClassVar[str] = "Product"
    card_size: ClassVar[tuple[float, float]] = (46.0, 46.0)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A fast sine times a slow sine: the amplitude of the product rises and falls.",
        inputs={
            "u1": driver("SineWave", frequency=8.0).named("fast"),
            "u2": driver("SineWave", frequency=0.6).named("slow"),
        },
    )

    operators: str = parameter("**", doc="one * or / for each input, such as */")

    def check(self) -> None:
        if not self.operators or set(self.operators) - set("*/"):
            raise InputError(
                f"the value is '{self.operators}'",
                where="Product.operators",
                allowed="* and /, at least one",
                fix="write one operator for each input, such as '*/'",
            )

    def input_ports(self) -> tuple[Port, ...]:
        return numbered_ports("u", len(self.operators), "factor")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the product"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        first, *others = zip(self.operators, u.values())
        product = first[1] if first[0] == "*" else 1.0 / first[1]
        for operator, value in others:
            product = product * value if operator == "*" else product / value
        return {"y": product}


@dataclass(frozen=True, kw_only=True)
class MatrixProduct(Block):
    """The matrix product of two inputs: y = A B, where A (m, n) and B (n, k) or (n,)."""

    title: ClassVar[str] = "Matrix Multiply"
    sign: ClassVar[FaceSign] = Words("A·B")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A shear of the vector (1, sin t): the second element is added to the first.",
        inputs={
            "A": driver("Constant", value=((1.0, 1.0), (0.0, 1.0))),
            "B": driver("SineWave", amplitude=(0.0, 1.0), bias=(1.0, 0.0)),
        },
        shown=("B", "y"),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("A", "the left matrix"), Port("B", "the right matrix or vector"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the product"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        A, B = inputs["A"], inputs["B"]
        if len(A) != 2 or len(B) not in (1, 2) or A[1] != B[0]:
            raise InputError(
                f"'A' has shape {A} and 'B' has shape {B}",
                allowed="A (m, n) with B (n, k) or (n,)",
                fix="change the width of one of the signals",
            )
        return {"y": (A[0], *B[1:])}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": mtimes(u["A"], u["B"])}


_FUNCTIONS: Mapping[str, Callable[[SX], SX]] = {
    "10^u": lambda u: casadi.exp(u * log(10.0)),
    "abs": casadi.fabs,
    "cbrt": lambda u: casadi.sign(u) * casadi.fabs(u) ** (1.0 / 3.0),
    "ceil": casadi.ceil,
    "cube": lambda u: u * u * u,
    "exp": casadi.exp,
    "expm1": casadi.expm1,
    "floor": casadi.floor,
    "log": casadi.log,
    "log10": casadi.log10,
    "log1p": casadi.log1p,
    "log2": lambda u: casadi.log(u) / log(2.0),
    "negate": lambda u: -u,
    "reciprocal": lambda u: 1.0 / u,
    "sign": casadi.sign,
    "sqrt": casadi.sqrt,
    "square": lambda u: u * u,
}

_TRIGONOMETRY: Mapping[str, Callable[[SX], SX]] = {
    name: getattr(casadi, name)
    for name in (
        "sin",
        "cos",
        "tan",
        "asin",
        "acos",
        "atan",
        "sinh",
        "cosh",
        "tanh",
        "asinh",
        "acosh",
        "atanh",
    )
}


@dataclass(frozen=True, kw_only=True)
class MathFunction(BlockWithSteps):
    """An elementary function of every element: y = f(u), with f one of abs, exp, log, sqrt, square, …

    The jumps and corners of ``floor``, ``ceil``, ``sign`` and ``abs`` are events.
    """

    title: ClassVar[str] = "Math Function"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The exponential of a sine, between 1/e and e.",
    )

    function: str = parameter("exp", choices=tuple(_FUNCTIONS), doc="the function f")
    zero_crossing: bool = zero_crossing_parameter()

    def face_sign(self) -> FaceSign:
        return function_sign(self.function)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the argument"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the value of the function"),)

    def _steps(self) -> tuple[IntegerSteps, ...]:
        rounds = self.zero_crossing and self.function in ("floor", "ceil")
        return (IntegerSteps("u", self.function),) if rounds else ()

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        above = Condition("positive", inputs["u"], "1 where u > 0", closed=False)
        below = Condition("negative", inputs["u"], "1 where u < 0", closed=False)
        by_function = {"sign": (above, below), "abs": (below,)}
        return located(self, *by_function.get(self.function, ()))

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"positive": u["u"], "negative": -u["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        if self._steps():
            return {"y": x["integer"]}
        if self.function == "sign":
            return {"y": x["positive"] - x["negative"]}
        if self.function == "abs":
            return {"y": if_else(x["negative"], -u["u"], u["u"])}
        return {"y": _FUNCTIONS[self.function](u["u"])}


@dataclass(frozen=True, kw_only=True)
class Trigonometry(Block):
    """A trigonometric function of every element: y = f(u), angles in rad."""

    title: ClassVar[str] = "Trigonometric Function"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The sine of an angle that rises at a constant rate.",
        inputs={"u": driver("Ramp")},
    )

    function: str = parameter("sin", choices=tuple(_TRIGONOMETRY), doc="the function f")

    def face_sign(self) -> FaceSign:
        return function_sign(self.function)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the argument"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the value of the function"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": _TRIGONOMETRY[self.function](u["u"])}


@dataclass(frozen=True, kw_only=True)
class Atan2(Block):
    """The angle of the point (x, y) from the x axis, in all four quadrants: angle = atan2(y, x)."""

    title: ClassVar[str] = "Atan2"
    sign: ClassVar[FaceSign] = Words("atan2")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=(
            "The angle of a point that runs around a circle: it jumps from pi to -pi where it crosses "
            "the negative x axis."
        ),
        inputs={"y": driver("SineWave").named("sine"), "x": driver("SineWave", phase=pi / 2).named("cosine")},
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("y", "coordinate along y"), Port("x", "coordinate along x"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("angle", "angle, -pi to pi", "rad"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"angle": broadcast(inputs)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"angle": atan2(u["y"], u["x"])}


@dataclass(frozen=True, kw_only=True)
class Power(Block):
    """Base to the power of the exponent, element by element: y = base ^ exponent."""

    title: ClassVar[str] = "Power"
    sign: ClassVar[FaceSign] = Words("uᵛ")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A base between 1 and 3, and an exponent that rises from -1 to 1. At 5 s the output is 1.",
        inputs={"base": driver("SineWave", bias=2.0), "exponent": driver("Ramp", slope=0.2, initial=-1.0)},
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("base", "the base"), Port("exponent", "the exponent"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the power"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": u["base"] ** u["exponent"]}


@dataclass(frozen=True, kw_only=True)
class MinMax(Block):
    """The minimum or maximum of the inputs, element by element: y = min(u1, u2, …) or max(u1, u2, …)."""

    title: ClassVar[str] = "MinMax"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The smaller of two sines at each time.",
    )

    function: str = parameter("min", choices=("min", "max"), doc="minimum or maximum")
    inputs: int = parameter(2, minimum=1, doc="number of inputs")
    zero_crossing: bool = zero_crossing_parameter()

    def face_sign(self) -> FaceSign:
        return Words(self.function, italic=True)

    def input_ports(self) -> tuple[Port, ...]:
        return numbered_ports("u", self.inputs, "input")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the minimum or maximum"),)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": common_unit(inputs)}

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        shape = self.output_shapes(inputs)["y"]
        doc = "1 if input {} is beyond all previous inputs"
        return located(
            self,
            *(Condition(f"beyond{k}", shape, doc.format(k), closed=False) for k in self._further_inputs()),
        )

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        sign = -1.0 if self.function == "min" else 1.0
        values = list(u.values())
        return {
            f"beyond{k}": sign * (values[k - 1] - self._best(x, values, k - 1))
            for k in self._further_inputs()
        }

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": self._best(x, list(u.values()), self.inputs)}

    def _further_inputs(self) -> range:
        """The numbers of all inputs except the first."""
        return range(2, self.inputs + 1)

    def _best(self, x: Signals, values: list[SX], count: int) -> SX:
        """The minimum or maximum of the first ``count`` inputs, from the conditions."""
        best = values[0]
        for k in range(2, count + 1):
            best = if_else(x[f"beyond{k}"], values[k - 1], best)
        return best
