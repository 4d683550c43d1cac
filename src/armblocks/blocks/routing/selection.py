"""Blocks that select or assign elements of a signal."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, cast

import numpy as np
from casadi import SX, floor, fmax, fmin, if_else, vertcat
from numpy.typing import ArrayLike

from armblocks.blocks.elementwise import common_unit
from armblocks.blocks.example_signals import THREE_PHASES
from armblocks.diagram import (
    Block,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    WorkedExample,
    driver,
    parameter,
)
from armblocks.errors import InputError, counted

COUNTING = ("one-based", "zero-based")
"""Index bases: whether the first index is 1 or 0."""


def _positions(indices: ArrayLike, counting: str) -> list[int]:
    """The indices as zero-based integers."""
    first = 1 if counting == "one-based" else 0
    return [int(index) - first for index in np.atleast_1d(cast("Any", indices))]


def _check_indices(where: str, indices: ArrayLike, counting: str) -> None:
    numbers = np.atleast_1d(np.asarray(indices))
    first = 1 if counting == "one-based" else 0
    if np.any(numbers != np.floor(numbers)) or np.any(numbers < first):
        raise InputError(
            f"the indices are {numbers.tolist()}",
            where=where,
            allowed=f"integers, at least {first}",
            fix="correct the indices or the index base",
        )


def _check_inside(positions: list[int], size: int, counting: str) -> None:
    if max(positions) >= size:
        first = 1 if counting == "one-based" else 0
        raise InputError(
            f"the index {max(positions) + first} exceeds the size of the signal",
            allowed=f"{first} to {size - 1 + first}, as the signal has {size} elements",
            fix="correct the indices or the width of the signal",
        )


def _check_vector(name: str, inputs: Shapes) -> None:
    if len(inputs[name]) > 1:
        raise InputError(
            f"'{name}' has shape {inputs[name]}",
            allowed="a vector or a scalar",
            fix="use SubMatrix for matrices, or convert the signal to a vector with Reshape",
        )


@dataclass(frozen=True, kw_only=True)
class Selector(Block):
    """Selected elements of a vector, in the order of the indices: y(k) = u(indices(k)).

    One index gives a scalar.
    """

    title: ClassVar[str] = "Selector"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The third and the first element of three phases.",
        parameters={"indices": (3.0, 1.0)},
        inputs={"u": THREE_PHASES},
    )

    indices: ArrayLike = parameter(
        (1.0,), kind=ParameterKind.ARRAY, dimensions=(0, 1), tunable=False, doc="indices of the elements"
    )
    counting: str = parameter("one-based", choices=COUNTING, doc="whether the first index is 1 or 0")

    def check(self) -> None:
        _check_indices("Selector", self.indices, self.counting)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the vector"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the selected elements"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        _check_vector("u", inputs)
        positions = _positions(self.indices, self.counting)
        _check_inside(positions, math.prod(inputs["u"]), self.counting)
        return {"y": (len(positions),) if len(positions) > 1 else ()}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": vertcat(*[u["u"][k] for k in _positions(self.indices, self.counting)])}


@dataclass(frozen=True, kw_only=True)
class SubMatrix(Block):
    """A submatrix: y = u(first_row:last_row, first_column:last_column). Indices start at 1.

    A last row or column of 0 means the end of the matrix. A vector counts as a column.
    """

    title: ClassVar[str] = "Submatrix"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The second row of a matrix.",
        parameters={"first_row": 2},
        inputs={"u": driver("SineWave", amplitude=((1.0, 2.0), (3.0, 4.0)))},
    )

    first_row: int = parameter(1, minimum=1, doc="the first row")
    last_row: int = parameter(0, minimum=0, doc="the last row, 0 for the end")
    first_column: int = parameter(1, minimum=1, doc="the first column")
    last_column: int = parameter(0, minimum=0, doc="the last column, 0 for the end")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the matrix"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the submatrix"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        rows, columns = (*inputs["u"], 1, 1)[:2]
        last_row, last_column = self.last_row or rows, self.last_column or columns
        if not (self.first_row <= last_row <= rows and self.first_column <= last_column <= columns):
            raise InputError(
                f"rows {self.first_row} to {last_row} and columns {self.first_column} to {last_column} are "
                f"outside the matrix",
                allowed=f"rows 1 to {rows} and columns 1 to {columns}, the first not after the last",
                fix="correct the rows and columns",
            )
        return {"y": (last_row - self.first_row + 1, last_column - self.first_column + 1)}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        rows, columns = u["u"].shape
        part = slice(self.first_row - 1, self.last_row or rows)
        return {"y": u["u"][part, self.first_column - 1 : self.last_column or columns]}


@dataclass(frozen=True, kw_only=True)
class Assignment(Block):
    """A vector with some elements replaced: y = y0, but y(indices(k)) = u(k). A scalar u is broadcast."""

    title: ClassVar[str] = "Assignment"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The second element of a constant vector is replaced by a sine.",
        parameters={"indices": (2.0,)},
        inputs={"y0": driver("Constant", value=(1.0, 0.0, -1.0)), "u": driver("SineWave")},
    )

    indices: ArrayLike = parameter(
        (1.0,),
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        tunable=False,
        doc="indices of the replaced elements",
    )
    counting: str = parameter("one-based", choices=COUNTING, doc="whether the first index is 1 or 0")

    def check(self) -> None:
        _check_indices("Assignment", self.indices, self.counting)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("y0", "the vector"), Port("u", "the new elements"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the vector with the new elements"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        for name in inputs:
            _check_vector(name, inputs)
        positions = _positions(self.indices, self.counting)
        _check_inside(positions, math.prod(inputs["y0"]), self.counting)
        if math.prod(inputs["u"]) not in (1, len(positions)):
            raise InputError(
                f"{math.prod(inputs['u'])} new elements for {counted(len(positions), 'index', 'indices')}",
                allowed="one element for each index, or one element for all indices",
                fix="correct the indices or the width of 'u'",
            )
        return {"y": inputs["y0"]}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": common_unit(inputs)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        elements = [u["y0"][k] for k in range(u["y0"].numel())]
        for k, position in enumerate(_positions(self.indices, self.counting)):
            elements[position] = u["u"][k if u["u"].numel() > 1 else 0]
        return {"y": vertcat(*elements)}


@dataclass(frozen=True, kw_only=True)
class IndexVector(Block):
    """The element of a vector at a variable index: y = u(index).

    The index is rounded down to an integer and limited to the range of the elements.
    """

    title: ClassVar[str] = "Index Vector"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A counter selects three numbers, one after another.",
        inputs={"index": driver("CounterLimited", upper=2), "u": driver("Constant", value=(0.5, 2.0, 1.0))},
        shown=("index", "y"),
    )

    counting: str = parameter("zero-based", choices=COUNTING[::-1], doc="whether the first index is 1 or 0")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("index", "index of the element", shape=()), Port("u", "the vector"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the element", shape=()),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        _check_vector("u", inputs)
        return {}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        elements = [u["u"][k] for k in range(u["u"].numel())]
        return {"y": choose(u["index"], elements, self.counting)}


def choose(index: SX, candidates: list[SX], counting: str = "zero-based") -> SX:
    """The candidate at a symbolic index, which is rounded down to an integer and limited to the list."""
    first = 1.0 if counting == "one-based" else 0.0
    position = fmin(fmax(floor(index) - first, 0.0), float(len(candidates) - 1))
    chosen = candidates[-1]
    for k, candidate in reversed(list(enumerate(candidates[:-1]))):
        chosen = if_else(position == float(k), candidate, chosen)
    return chosen
