"""A block that evaluates a user-written formula."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX
from numpy.typing import ArrayLike

from armblocks.blocks.elementwise import numbered_ports
from armblocks.diagram import (
    Block,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    WorkedExample,
    driver,
    parameter,
    shape_of,
)
from armblocks.diagram.signs import FaceSign, Words
from armblocks.errors import InputError, UnknownNameError, counted
from armblocks.matlab.formula import Formula
from armblocks.matlab.functions import RESERVED, TABLE

_RESERVED = frozenset(name for name in RESERVED if TABLE[name].max_arguments == 0 or TABLE[name].elementwise)
"""Names that no constant may have; a constant may hide a function of whole arrays, such as ``sum``."""


@dataclass(frozen=True, kw_only=True)
class Expression(Block):
    """The value of a formula such as sin(u[1]) * k: y = formula(u, t, constants), compiled like any block.

    A formula may contain:

    - the input ``u`` (or ``u1``, ``u2``, … for several inputs), and its elements ``u[1]``, ``u[2]``, … with
      indices from 1,
    - the time ``t``, ``pi`` and ``e``,
    - tunable constants: their names are in ``names``, their values in ``values``,
    - the operators and functions of all formulas, such as ``+ - * / ^``, comparisons, ``&& || ~``, ``atan2``,
      ``min``, ``mod`` and ``if(condition, yes, no)``.

    Vectors are evaluated element by element.
    """

    title: ClassVar[str] = "Fcn"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A decaying oscillation as a formula of the input, plotted over a ramp.",
        parameters={"formula": "sin(3 * u) * exp(-k * u)", "names": "k", "values": (0.3,)},
        inputs={"u": driver("Ramp")},
        shown=("y",),
    )

    formula: str = parameter("u", doc="the formula")
    inputs: int = parameter(1, minimum=0, maximum=100, doc="number of inputs")
    names: str = parameter("", doc="names of constants, such as k, offset")
    values: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, dimensions=(0, 1), doc="values of the constants, in the same order"
    )

    def face_sign(self) -> FaceSign:
        return Words(self.formula, italic=True)

    def check(self) -> None:
        Formula(self.formula, "Expression.formula")
        names = self._names()
        reserved = {*_RESERVED, "t", *(port.name for port in self.input_ports())}
        invalid = [
            name for name in names if not name.isidentifier() or name in reserved or names.count(name) > 1
        ]
        if invalid:
            raise InputError(
                f"'{invalid[0]}' cannot be the name of a constant",
                where="Expression.names",
                allowed="unique names of letters, digits and _ that have no other meaning in formulas",
                fix="choose another name",
            )
        if names and math.prod(shape_of(self.values)) != len(names):
            raise InputError(
                f"{counted(len(names), 'name')} and {counted(math.prod(shape_of(self.values)), 'value')} "
                "are given",
                where="Expression",
                allowed="one value for each name",
                fix="correct the names or the values",
            )

    def input_ports(self) -> tuple[Port, ...]:
        return numbered_ports("u", self.inputs, "input") if self.inputs else ()

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the value of the formula"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        for name, shape in inputs.items():
            if len(shape) > 1:
                raise InputError(
                    f"'{name}' has shape {shape}",
                    allowed="scalars and vectors in a formula",
                    fix="use the blocks for matrices",
                )
        u = {name: SX.sym(name, math.prod(shape)) for name, shape in inputs.items()}
        values = SX.sym("p", max(1, len(self._names())))
        try:
            size, columns = self._value(SX.sym("t"), u, values).shape
        except UnknownNameError as error:
            raise InputError(error.what, allowed=error.allowed, fix=error.fix) from None
        if size * columns == 0:
            raise InputError(
                "the formula gives an empty array",
                allowed="scalars and vectors",
                fix="check ranges and indices",
            )
        if columns > 1:
            raise InputError(
                f"the formula gives a matrix of {size} x {columns}",
                allowed="scalars and vectors",
                fix="use the blocks for matrices",
            )
        return {"y": (size,) if size > 1 else ()}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": self._value(t, u, p["values"])}

    def _names(self) -> list[str]:
        return self.names.replace(",", " ").split()

    def _value(self, t: SX, u: Signals, values: SX) -> SX:
        constants = {name: values[k] for k, name in enumerate(self._names())}
        return Formula(self.formula, "Expression.formula").trace({**u, "t": t, **constants})
