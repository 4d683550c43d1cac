"""Matrix algebra: products, linear equations, shapes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from typing import ClassVar

from casadi import SX, cross, diag, horzcat, mtimes, reshape, trace, vertcat

from armblocks.blocks.elementwise import common_unit, numbered_ports
from armblocks.blocks.elimination import determinant, solve
from armblocks.diagram import Block, Port, Shapes, Signals, WorkedExample, driver, parameter
from armblocks.diagram.signs import FaceSign, Words
from armblocks.equations import Shape
from armblocks.errors import InputError, counted


def _square(shape: Shape) -> Shape:
    """The shape of a square matrix; a scalar has (1, 1). Raises ``InputError`` for other shapes."""
    if math.prod(shape) == 1:
        return (1, 1)
    if len(shape) != 2 or shape[0] != shape[1]:
        raise InputError(f"the matrix has shape {shape}", allowed="a square matrix", fix="make it square")
    return shape


@dataclass(frozen=True, kw_only=True)
class CrossProduct(Block):
    """The vector product of two vectors (3,): y = u x v."""

    title: ClassVar[str] = "Cross Product"
    sign: ClassVar[FaceSign] = Words("u × v")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A vector rotates in the xy plane. Its product with the z axis lags by 90 degrees.",
        inputs={
            "u": driver("SineWave", amplitude=(1.0, 1.0, 0.0), phase=(pi / 2, 0.0, 0.0)).named("turning"),
            "v": driver("Constant", value=(0.0, 0.0, 1.0)),
        },
        shown=("y",),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the left vector", shape=(3,)), Port("v", "the right vector", shape=(3,)))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the vector product", shape=(3,)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": cross(u["u"], u["v"])}


@dataclass(frozen=True, kw_only=True)
class Transpose(Block):
    """The transpose: y = u'; a vector counts as a column and becomes a matrix of one row."""

    title: ClassVar[str] = "Transpose"
    sign: ClassVar[FaceSign] = Words("Aᵀ")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The two off-diagonal entries change places.",
        inputs={"u": driver("SineWave", amplitude=((1.0, 2.0), (3.0, 4.0)))},
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the matrix"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "its transpose"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        shape = inputs["u"]
        return {"y": (1, *shape) if len(shape) == 1 else shape[::-1]}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": u["u"].T}


@dataclass(frozen=True, kw_only=True)
class MatrixInverse(Block):
    """The inverse of a square matrix: u y = I, by Gaussian elimination.

    The result is not finite if u is singular.
    """

    title: ClassVar[str] = "Matrix Inverse"
    sign: ClassVar[FaceSign] = Words("A⁻¹")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The entries of the inverse of [1 a; 0 2] while a rises: only the off-diagonal entry changes.",
        inputs={"u": driver("Ramp", slope=((0.0, 0.2), (0.0, 0.0)), initial=((1.0, 0.0), (0.0, 2.0)))},
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the matrix (n, n)"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "its inverse (n, n)"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        _square(inputs["u"])
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": solve(u["u"], SX.eye(u["u"].shape[0]))}


@dataclass(frozen=True, kw_only=True)
class LinearSolve(Block):
    """The solution of linear equations: A y = B, by Gaussian elimination.

    The result is not finite if A is singular.
    """

    title: ClassVar[str] = "Matrix Solve"
    sign: ClassVar[FaceSign] = Words("A⁻¹ B")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The solution of [2 1; 1 3] y = (sin t, cos t).",
        inputs={
            "A": driver("Constant", value=((2.0, 1.0), (1.0, 3.0))),
            "B": driver("SineWave", phase=(0.0, 1.5707963267948966)),
        },
        shown=("B", "y"),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("A", "the matrix (n, n)"), Port("B", "the right-hand side (n,) or (n, k)"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the solution, of the shape of B"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        rows = (*inputs["B"], 1)[0]
        if _square(inputs["A"])[0] != rows:
            raise InputError(
                f"the matrix has shape {inputs['A']} and the right-hand side {inputs['B']}",
                allowed="A (n, n) with B (n,) or (n, k)",
                fix="change the width of one of the signals",
            )
        return {"y": inputs["B"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": solve(u["A"], u["B"])}


@dataclass(frozen=True, kw_only=True)
class Determinant(Block):
    """The determinant of a square matrix: y = det(u), by Gaussian elimination with pivoting."""

    title: ClassVar[str] = "Determinant"
    sign: ClassVar[FaceSign] = Words("det")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The determinant of [1 a; a 1] while a oscillates: 1 - a^2.",
        inputs={"u": driver("SineWave", amplitude=((0.0, 1.0), (1.0, 0.0)), bias=((1.0, 0.0), (0.0, 1.0)))},
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the matrix (n, n)"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "its determinant"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        _square(inputs["u"])
        return {"y": ()}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": determinant(u["u"])}


@dataclass(frozen=True, kw_only=True)
class Trace(Block):
    """The trace of a square matrix: y = u11 + u22 + …"""

    title: ClassVar[str] = "Trace"
    sign: ClassVar[FaceSign] = Words("tr")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The trace of a matrix; one diagonal entry oscillates about 1, the other about 2.",
        inputs={
            "u": driver(
                "SineWave",
                amplitude=((1.0, 0.0), (0.0, 0.5)),
                bias=((1.0, 0.0), (0.0, 2.0)),
                frequency=((1.0, 1.0), (1.0, 3.0)),
            )
        },
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the matrix (n, n)"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "its trace"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        _square(inputs["u"])
        return {"y": ()}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": trace(u["u"])}


@dataclass(frozen=True, kw_only=True)
class MatrixPower(Block):
    """An integer power of a square matrix: y = u^exponent; negative powers use the inverse."""

    title: ClassVar[str] = "Matrix Power"
    sign: ClassVar[FaceSign] = Words("Aⁿ")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The square of [1 a; 0 1] is [1 2a; 0 1].",
        inputs={"u": driver("SineWave", amplitude=((0.0, 1.0), (0.0, 0.0)), bias=((1.0, 0.0), (0.0, 1.0)))},
    )

    exponent: int = parameter(2, minimum=-100, maximum=100, doc="the exponent")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the matrix (n, n)"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the power of the matrix (n, n)"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        _square(inputs["u"])
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        identity = SX.eye(u["u"].shape[0])
        factor = u["u"] if self.exponent >= 0 else solve(u["u"], identity)
        power = identity
        for digit in f"{abs(self.exponent):b}":  # square and multiply, the highest digit first
            power = mtimes(power, power)
            power = mtimes(power, factor) if digit == "1" else power
        return {"y": power}


@dataclass(frozen=True, kw_only=True)
class Reshape(Block):
    """The same elements in another shape, in column-major order as in MATLAB.

    The new shape is ``vector`` (n,), ``column`` (n, 1), ``row`` (1, n), or ``matrix`` (rows, n / rows).
    """

    title: ClassVar[str] = "Reshape"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A matrix as a vector, column by column.",
        inputs={"u": driver("SineWave", amplitude=((1.0, 2.0), (3.0, 4.0)))},
    )

    output: str = parameter("vector", choices=("vector", "column", "row", "matrix"), doc="the new shape")
    rows: int = parameter(1, minimum=1, doc="number of rows, for the shape matrix")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "any signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the same elements"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        n = math.prod(inputs["u"])
        if self.output == "matrix" and n % self.rows:
            raise InputError(
                f"{counted(n, 'element')} cannot form a matrix with {counted(self.rows, 'row')}",
                allowed=f"a number of rows that divides {n}",
                fix="change rows",
            )
        shapes = {"vector": (n,), "column": (n, 1), "row": (1, n), "matrix": (self.rows, n // self.rows)}
        return {"y": shapes[self.output]}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        n = u["u"].numel()
        rows = {"vector": n, "column": n, "row": 1, "matrix": self.rows}[self.output]
        return {"y": reshape(u["u"], rows, n // rows)}


@dataclass(frozen=True, kw_only=True)
class MatrixConcatenate(Block):
    """Horizontal or vertical concatenation of matrices: y = [u1 u2 …] or [u1; u2; …].

    Vectors count as columns. Vertical concatenation of scalars and vectors gives a vector.
    """

    title: ClassVar[str] = "Matrix Concatenate"
    sign: ClassVar[FaceSign] = Words("[A B]")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Two vectors side by side are the columns of a matrix.",
        inputs={"u1": driver("SineWave", amplitude=(1.0, 2.0)), "u2": driver("Constant", value=(-1.0, 1.0))},
    )

    inputs: int = parameter(2, minimum=1, doc="number of inputs")
    direction: str = parameter(
        "horizontal",
        choices=("horizontal", "vertical"),
        doc="side by side (horizontal) or one below the other (vertical)",
    )

    def input_ports(self) -> tuple[Port, ...]:
        return numbered_ports("u", self.inputs, "part")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "all parts in one matrix"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        axis = 1 if self.direction == "horizontal" else 0
        matrix_shapes = [(*shape, 1, 1)[:2] for shape in inputs.values()]
        if len({shape[1 - axis] for shape in matrix_shapes}) > 1:
            raise InputError(
                f"the parts have shapes {', '.join(map(str, inputs.values()))}",
                allowed="equal numbers of rows side by side, equal numbers of columns one under another",
                fix="change the direction or one of the inputs",
            )
        length = sum(shape[axis] for shape in matrix_shapes)
        if axis == 0 and all(len(shape) < 2 for shape in inputs.values()):
            return {"y": (length,)}
        return {"y": (matrix_shapes[0][0], length) if axis else (length, matrix_shapes[0][1])}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": common_unit(inputs)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": (horzcat if self.direction == "horizontal" else vertcat)(*u.values())}


@dataclass(frozen=True, kw_only=True)
class DiagonalMatrix(Block):
    """The square matrix with a vector on its diagonal and zeros elsewhere: y = diag(u)."""

    title: ClassVar[str] = "Create Diagonal Matrix"
    sign: ClassVar[FaceSign] = Words("diag")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Two numbers on the diagonal, zeros elsewhere.",
        inputs={"u": driver("SineWave", amplitude=(1.0, 2.0))},
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the diagonal (n,)"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the matrix (n, n)"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        if len(inputs["u"]) > 1:
            raise InputError(
                f"the diagonal 'u' has shape {inputs['u']}",
                allowed="a scalar or a vector",
                fix="put an ExtractDiagonal before the block",
            )
        return {"y": (math.prod(inputs["u"]),) * 2}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": diag(u["u"])}


@dataclass(frozen=True, kw_only=True)
class ExtractDiagonal(Block):
    """The diagonal of a square matrix as a vector: y = (u11, u22, …)."""

    title: ClassVar[str] = "Extract Diagonal"
    sign: ClassVar[FaceSign] = Words("diag(A)")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The diagonal of a matrix.",
        inputs={"u": driver("SineWave", amplitude=((1.0, 2.0), (3.0, 4.0)))},
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the matrix (n, n)"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "its diagonal (n,)"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": _square(inputs["u"])[:1]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": diag(u["u"])}
