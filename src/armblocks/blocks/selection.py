"""Blocks that choose: elements of a signal, or one signal of several."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import reduce
from typing import Any, ClassVar, cast

import numpy as np
from casadi import SX, floor, fmax, fmin, if_else, vertcat
from numpy.typing import ArrayLike

from armblocks.blocks.elementwise import common_unit, numbered_ports
from armblocks.blocks.example_signals import THREE_PHASES
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
    made,
    parameter,
)
from armblocks.errors import InputError

_COUNTING = ("one-based", "zero-based")


def _places(indices: ArrayLike, counting: str) -> list[int]:
    """Indices as places from 0."""
    first = 1 if counting == "one-based" else 0
    return [int(index) - first for index in np.atleast_1d(cast("Any", indices))]


def _check_indices(where: str, indices: ArrayLike, counting: str) -> None:
    numbers = np.atleast_1d(np.asarray(indices))
    least = 1 if counting == "one-based" else 0
    if np.any(numbers != np.floor(numbers)) or np.any(numbers < least):
        raise InputError(
            f"the indices are {numbers.tolist()}",
            where=where,
            allowed=f"integers from {least} on",
            fix="correct the indices or the way of counting",
        )


def _check_inside(places: list[int], size: int, counting: str) -> None:
    if max(places) >= size:
        first = 1 if counting == "one-based" else 0
        raise InputError(
            f"the index {max(places) + first} is beyond the end",
            allowed=f"{first} to {size - 1 + first}, as the signal has {size} elements",
            fix="correct the indices or the width of the signal",
        )


def _check_vector(name: str, inputs: Shapes) -> None:
    if len(inputs[name]) > 1:
        raise InputError(
            f"'{name}' has shape {inputs[name]}",
            allowed="a vector or a scalar",
            fix="use SubMatrix for matrices, or a Reshape block before it",
        )


@dataclass(frozen=True, kw_only=True)
class Selector(Block):
    """Chosen elements of a vector, in the order of the indices: y(k) = u(indices(k)); one index: a scalar."""

    family: ClassVar[str] = "routing"
    title: ClassVar[str] = "Selector"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The third and the first element of three phases.",
        parameters={"indices": (3.0, 1.0)},
        inputs={"u": THREE_PHASES},
    )

    indices: ArrayLike = parameter(
        (1.0,), kind=ParameterKind.ARRAY, dimensions=(0, 1), tunable=False, doc="which elements"
    )
    counting: str = parameter("one-based", choices=_COUNTING, doc="whether the first index is 1 or 0")

    def check(self) -> None:
        _check_indices("Selector", self.indices, self.counting)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the vector"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the chosen elements"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        _check_vector("u", inputs)
        places = _places(self.indices, self.counting)
        _check_inside(places, math.prod(inputs["u"]), self.counting)
        return {"y": (len(places),) if len(places) > 1 else ()}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": vertcat(*[u["u"][k] for k in _places(self.indices, self.counting)])}


@dataclass(frozen=True, kw_only=True)
class SubMatrix(Block):
    """Chosen rows and columns of a matrix: y = u(first_row:last_row, first_column:last_column), from 1.

    A last row or column of 0 stands for the end of the matrix. A vector counts as a column.
    """

    family: ClassVar[str] = "routing"
    title: ClassVar[str] = "Submatrix"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The second row of a matrix.",
        parameters={"first_row": 2},
        inputs={"u": made("SineWave", amplitude=((1.0, 2.0), (3.0, 4.0)))},
    )

    first_row: int = parameter(1, minimum=1, doc="the first row")
    last_row: int = parameter(0, minimum=0, doc="the last row, 0 for the end")
    first_column: int = parameter(1, minimum=1, doc="the first column")
    last_column: int = parameter(0, minimum=0, doc="the last column, 0 for the end")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the matrix"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the chosen part, a matrix"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        rows, columns = (*inputs["u"], 1, 1)[:2]
        last_row, last_column = self.last_row or rows, self.last_column or columns
        if not (self.first_row <= last_row <= rows and self.first_column <= last_column <= columns):
            raise InputError(
                f"rows {self.first_row} to {last_row} and columns {self.first_column} to {last_column} "
                "are no part of the matrix",
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
    """A vector with some elements replaced: y = y0, but y(indices(k)) = u(k); a scalar u goes to all."""

    family: ClassVar[str] = "routing"
    title: ClassVar[str] = "Assignment"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The second element of a vector of zeros is replaced by a sine.",
        parameters={"indices": (2.0,)},
        inputs={"y0": made("Constant", value=(1.0, 0.0, -1.0)), "u": made("SineWave")},
    )

    indices: ArrayLike = parameter(
        (1.0,), kind=ParameterKind.ARRAY, dimensions=(0, 1), tunable=False, doc="which elements are replaced"
    )
    counting: str = parameter("one-based", choices=_COUNTING, doc="whether the first index is 1 or 0")

    def check(self) -> None:
        _check_indices("Assignment", self.indices, self.counting)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("y0", "the vector"), Port("u", "the new elements"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the vector with the new elements"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        for name in inputs:
            _check_vector(name, inputs)
        places = _places(self.indices, self.counting)
        _check_inside(places, math.prod(inputs["y0"]), self.counting)
        if math.prod(inputs["u"]) not in (1, len(places)):
            raise InputError(
                f"{math.prod(inputs['u'])} new elements come for {len(places)} places",
                allowed="one for each place, or one for all",
                fix="correct the indices or the width of 'u'",
            )
        return {"y": inputs["y0"]}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": common_unit(inputs)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        elements = [u["y0"][k] for k in range(u["y0"].numel())]
        for k, place in enumerate(_places(self.indices, self.counting)):
            elements[place] = u["u"][k if u["u"].numel() > 1 else 0]
        return {"y": vertcat(*elements)}


@dataclass(frozen=True, kw_only=True)
class IndexVector(Block):
    """The element of a vector that a signal points at: y = u(index).

    The index is cut down to an integer and held between the first and the last element.
    """

    family: ClassVar[str] = "routing"
    title: ClassVar[str] = "Index Vector"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A counter picks one of three numbers after the other.",
        inputs={"index": made("CounterLimited", upper=2), "u": made("Constant", value=(0.5, 2.0, 1.0))},
        shown=("index", "y"),
    )

    counting: str = parameter("zero-based", choices=_COUNTING[::-1], doc="whether the first index is 1 or 0")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("index", "which element", shape=()), Port("u", "the vector"))

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


@dataclass(frozen=True, kw_only=True)
class MultiportSwitch(Block):
    """The input that a signal points at: y = u1 for index 1, u2 for index 2, …

    The index is cut down to an integer and held between the first and the last input. All inputs have one
    shape, scalars spread.
    """

    family: ClassVar[str] = "routing"
    title: ClassVar[str] = "Multiport Switch"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A counter picks one input after the other.",
        parameters={"counting": "zero-based"},
        inputs={
            "index": made("CounterLimited", upper=2),
            "u1": made("SineWave"),
            "u2": made("Constant", value=2.0),
            "u3": made("Ramp", slope=-0.2),
        },
    )

    inputs: int = parameter(3, minimum=1, doc="how many inputs there are to choose from")
    counting: str = parameter("one-based", choices=_COUNTING, doc="whether the first index is 1 or 0")
    zero_crossing: bool = zero_crossing_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("index", "which input", shape=()), *numbered_ports("u", self.inputs, "candidate"))

    def bus_inputs(self) -> tuple[str, ...]:
        return tuple(f"u{k}" for k in range(1, self.inputs + 1))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the chosen input"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast({name: shape for name, shape in inputs.items() if name != "index"})}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": common_unit({name: unit for name, unit in inputs.items() if name != "index"})}

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        doc = "1 where the index points at input {} or beyond"
        return located(self, *(Condition(f"from{k}", (), doc.format(k)) for k in range(2, self.inputs + 1)))

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        shift = 1.0 if self.counting == "zero-based" else 0.0
        return {f"from{k}": u["index"] + shift - float(k) for k in range(2, self.inputs + 1)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        _, *candidates = u.values()
        largest = reduce(lambda left, right: left if left.numel() > 1 else right, candidates)
        full = [value * SX.ones(*largest.shape) for value in candidates]
        chosen = full[0]
        for k, value in enumerate(full[1:], 2):
            chosen = if_else(x[f"from{k}"], value, chosen)
        return {"y": chosen}


@dataclass(frozen=True, kw_only=True)
class ManualSwitch(Block):
    """One of two inputs, thrown by hand: y = u1 for position 1 and u2 for position 2.

    The position is tunable, so that it can be thrown without compiling again; from 1.5 on it is 2.
    """

    family: ClassVar[str] = "routing"
    title: ClassVar[str] = "Manual Switch"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=(
            "The first of two signals passes; the position is a parameter and can be changed during a "
            "session."
        ),
    )

    position: float = parameter(1.0, minimum=1.0, maximum=2.0, doc="1 or 2")

    def input_ports(self) -> tuple[Port, ...]:
        return numbered_ports("u", 2, "candidate")

    def bus_inputs(self) -> tuple[str, ...]:
        return ("u1", "u2")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the chosen input"),)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": common_unit(inputs)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        first, second = p["position"] < 1.5, p["position"] >= 1.5
        return {"y": if_else(first, u["u1"], 0.0) + if_else(second, u["u2"], 0.0)}


def choose(index: SX, candidates: list[SX], counting: str = "zero-based") -> SX:
    """The candidate at a symbolic index, which is cut down to an integer and held inside the list."""
    first = 1.0 if counting == "one-based" else 0.0
    place = fmin(fmax(floor(index) - first, 0.0), float(len(candidates) - 1))
    chosen = candidates[-1]
    for k, candidate in reversed(list(enumerate(candidates[:-1]))):
        chosen = if_else(place == float(k), candidate, chosen)
    return chosen
