"""Blocks that reduce or accumulate the elements of a signal."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import reduce
from math import pi
from typing import ClassVar

from casadi import SX, dot, fabs, fmax, if_else, sqrt, vertcat

from armblocks.blocks.example_signals import CIRCLING, THREE_PHASES
from armblocks.blocks.switching import located, zero_crossing_parameter
from armblocks.diagram import Block, Condition, Port, Shapes, Signals, WorkedExample, driver, parameter
from armblocks.diagram.signs import FaceSign, Words
from armblocks.errors import InputError


def _elements(value: SX) -> list[SX]:
    """The elements in column-major order, as in MATLAB."""
    return [value[k] for k in range(value.numel())]


@dataclass(frozen=True, kw_only=True)
class SumOfElements(Block):
    """The sum of all elements: y = u1 + u2 + …"""

    title: ClassVar[str] = "Sum of Elements"
    sign: ClassVar[FaceSign] = Words("Σ")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The first three terms of the Fourier series of a square wave, and their sum.",
        inputs={"u": driver("SineWave", amplitude=(1.0, 0.3333, 0.2), frequency=(1.0, 3.0, 5.0))},
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "any signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the sum", shape=()),)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": reduce(lambda left, right: left + right, _elements(u["u"]))}


@dataclass(frozen=True, kw_only=True)
class ProductOfElements(Block):
    """The product of all elements: y = u1 u2 …"""

    title: ClassVar[str] = "Product of Elements"
    sign: ClassVar[FaceSign] = Words("Π")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The product of three sines, 120 degrees apart, is a sine of three times their frequency.",
        inputs={"u": THREE_PHASES},
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "any signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the product", shape=()),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": reduce(lambda left, right: left * right, _elements(u["u"]))}


@dataclass(frozen=True, kw_only=True)
class Extremum(Block):
    """The minimum or maximum of all elements, and its index: y = u(index). Indices start at 1.

    If several elements are equal, the index of the first is returned. Indices of a matrix are in column-major
    order.
    """

    title: ClassVar[str] = "MinMax of Elements"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The greatest of three phases, and its index.",
        parameters={"function": "max"},
        inputs={"u": THREE_PHASES},
    )

    function: str = parameter("min", choices=("min", "max"), doc="minimum or maximum")
    zero_crossing: bool = zero_crossing_parameter()

    def face_sign(self) -> FaceSign:
        return Words(self.function, italic=True)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "any signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (
            Port("y", "the minimum or maximum", shape=()),
            Port("index", "its index, from 1", shape=()),
        )

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        count = math.prod(inputs["u"])
        doc = "1 where element {} exceeds all previous elements"
        return located(
            self, *(Condition(f"beyond{k}", (), doc.format(k), closed=False) for k in range(2, count + 1))
        )

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        sign, values = -1.0 if self.function == "min" else 1.0, _elements(u["u"])
        return {
            f"beyond{k}": sign * (values[k - 1] - self._best(x, values[: k - 1])[0])
            for k in range(2, len(values) + 1)
        }

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        best, index = self._best(x, _elements(u["u"]))
        return {"y": best, "index": index}

    def _best(self, x: Signals, values: list[SX]) -> tuple[SX, SX]:
        """The least or greatest element and its index, selected by the conditions."""
        best, index = values[0], SX(1.0)
        for k in range(2, len(values) + 1):
            beyond = x[f"beyond{k}"]
            best, index = if_else(beyond, values[k - 1], best), if_else(beyond, float(k), index)
        return best, index


@dataclass(frozen=True, kw_only=True)
class CumulativeSum(Block):
    """Cumulative sums of a vector: y(k) = u1 + … + uk; of a matrix, along every column."""

    title: ClassVar[str] = "Cumulative Sum"
    sign: ClassVar[FaceSign] = Words("Σ↓")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Each output adds one more element of the vector: the partial sums of a square wave.",
        inputs={"u": driver("SineWave", amplitude=(1.0, 0.3333, 0.2), frequency=(1.0, 3.0, 5.0))},
        shown=("y",),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "vector or matrix"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the cumulative sums"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": inputs["u"]}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        rows = [u["u"][0, :]]
        for k in range(1, u["u"].shape[0]):
            rows.append(rows[-1] + u["u"][k, :])
        return {"y": vertcat(*rows)}


@dataclass(frozen=True, kw_only=True)
class DotProduct(Block):
    """The sum of the products of the elements: y = u1 v1 + u2 v2 + …"""

    title: ClassVar[str] = "Dot Product"
    sign: ClassVar[FaceSign] = Words("u · v")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The dot product of a rotating vector and the vector (1, 1).",
        inputs={"u": CIRCLING, "v": driver("Constant", value=(1.0, 1.0))},
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "first vector"), Port("v", "second vector"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the dot product"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        if inputs["u"] != inputs["v"]:
            raise InputError(
                f"the factors have shapes {inputs['u']} and {inputs['v']}",
                allowed="two signals of the same shape",
                fix="change the width of one of the signals",
            )
        return {"y": ()}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": dot(u["u"], u["v"])}


@dataclass(frozen=True, kw_only=True)
class Norm(Block):
    """The norm of a vector or matrix, by default the length of a vector: y = sqrt(u1^2 + u2^2 + …).

    - ``2``: the length of a vector. The 2-norm of a matrix (its greatest singular value) is not supported.
    - ``1``: the sum of abs(u) of a vector; for a matrix, the greatest of these sums over the columns.
    - ``inf``: the greatest abs(u) of a vector; for a matrix, the greatest sum of abs(u) over the rows.
    - ``fro``: the square root of the sum of the squares of all elements.

    The derivative of the norms 2 and fro at zero is NaN.
    """

    title: ClassVar[str] = "Norm"
    sign: ClassVar[FaceSign] = Words("‖u‖")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The length of a vector that moves along an ellipse.",
        inputs={"u": driver("SineWave", amplitude=(2.0, 1.0), phase=(pi / 2, 0.0))},
    )

    norm: str = parameter("2", choices=("2", "1", "inf", "fro"), doc="the norm")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "vector or matrix"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "its norm"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        if self.norm == "2" and len(inputs["u"]) > 1:
            raise InputError(
                f"the 2-norm of a matrix of shape {inputs['u']} is not supported",
                allowed="1, inf and fro of a matrix",
                fix="choose another norm",
            )
        return {"y": ()}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        value = u["u"]
        if self.norm in ("2", "fro"):
            return {"y": sqrt(dot(value, value))}
        sizes = fabs(value if self.norm == "1" else value.T)
        sums = [sum(_elements(sizes[:, k]), SX(0.0)) for k in range(sizes.shape[1])]
        return {"y": reduce(fmax, sums)}
