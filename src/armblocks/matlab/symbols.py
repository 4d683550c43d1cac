"""Values of expressions as CasADi symbols, for equations that are traced.

A vector is neither row nor column: ``[1 2]`` and ``[1; 2]`` are the same, and ``[v; w]`` has the rows v and
w. Two vectors are multiplied element by element, as in Simulink's Fcn block (an error in MATLAB for two
rows); with a matrix ``*`` is the matrix product, as in MATLAB, and ``.*`` is elementwise.

In some formulas the result in MATLAB depends on the orientation of a vector, and the text of the formula
shows the orientation: ``u'*A*u``, ``A(1, :)*A(:, 2)``. Such formulas are errors, see :class:`OrientedVector`.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import casadi
import numpy as np
from casadi import SX, evalf, horzcat, if_else, logic_and, logic_not, logic_or, mtimes, reshape, vertcat
from numpy.typing import NDArray

from armblocks.equations import elementary
from armblocks.errors import ArmblocksError, UnknownNameError
from armblocks.matlab.array_functions import range_of
from armblocks.matlab.arrays import ALLOWED_MATRIX_POWERS, EXPONENTS, positions
from armblocks.matlab.calls import call_function, selected_function
from armblocks.matlab.function_kinds import MismatchError
from armblocks.matlab.functions import TABLE
from armblocks.matlab.source import Location
from armblocks.matlab.syntax import Expression, is_logical
from armblocks.spatial.rotation import cos_exact, sin_exact


@dataclass(frozen=True)
class OrientedVector:
    """A vector that is a ``row`` or ``column`` of a matrix, a product with a matrix, or ``transposed``."""

    value: SX
    kind: str


Symbol = SX | str | OrientedVector
"""Texts are arguments of functions only."""


def _ieee_operation(operation: Callable[[Any, Any], Any]) -> Callable[[SX, SX], SX]:
    """The operation, with IEEE arithmetic for constants: CasADi gives 0 for inf - inf, 1 for nan == nan."""

    def apply(left: SX, right: SX) -> SX:
        if not (left.is_constant() and right.is_constant()):
            return operation(left, right)
        with np.errstate(all="ignore"):
            return SX(np.asarray(operation(evalf(left).full(), evalf(right).full()), dtype=np.float64))

    return apply


_OPERATIONS: Mapping[str, Callable[[SX, SX], SX]] = {
    "+": _ieee_operation(operator.add),
    "-": _ieee_operation(operator.sub),
    "*": _ieee_operation(operator.mul),
    "/": _ieee_operation(lambda left, right: left / right),
    "\\": _ieee_operation(lambda left, right: right / left),
    "^": lambda left, right: elementary("power", left, right),
    "<": _ieee_operation(operator.lt),
    "<=": _ieee_operation(operator.le),
    ">": _ieee_operation(lambda left, right: right < left),
    ">=": _ieee_operation(lambda left, right: right <= left),
    "==": _ieee_operation(operator.eq),
    "~=": _ieee_operation(operator.ne),
}


class SymbolArithmetic:
    """The operations of the function table on symbols (:class:`~.function_kinds.Arithmetic`)."""

    has_orientation = False

    def elementary(self, name: str, *values: SX) -> SX:
        """An elementary function, correctly rounded for constants."""
        return elementary(name, *values)

    def sqrt(self, value: SX) -> SX:
        """Square root."""
        return casadi.sqrt(value)

    def floor(self, value: SX) -> SX:
        """Round down."""
        return casadi.floor(value)

    def ceil(self, value: SX) -> SX:
        """Round up."""
        return casadi.ceil(value)

    def sign(self, value: SX) -> SX:
        """The sign: -1, 0 or 1."""
        return casadi.sign(value)

    def absolute(self, value: SX) -> SX:
        """Absolute value."""
        return casadi.fabs(value)

    def minimum(self, left: SX, right: SX) -> SX:
        """The smaller value; NaN only if both are NaN."""
        return casadi.fmin(left, right)

    def maximum(self, left: SX, right: SX) -> SX:
        """The larger value; NaN only if both are NaN."""
        return casadi.fmax(left, right)

    def quotient(self, left: SX, right: SX) -> SX:
        """The elementwise quotient ``left ./ right``."""
        return _OPERATIONS["/"](left, right)

    def remainder(self, left: SX, right: SX) -> SX:
        """The exact remainder with the sign of the dividend."""
        return casadi.fmod(left, right)

    def where(self, condition: SX, yes: SX, no: SX) -> SX:
        """``yes`` where the condition is not 0, else ``no``."""
        return if_else(condition, yes, no)

    def logical_and(self, left: SX, right: SX) -> SX:
        """1 where both are not 0, else 0."""
        return logic_and(left != 0.0, right != 0.0)

    def logical_or(self, left: SX, right: SX) -> SX:
        """1 where one is not 0, else 0."""
        return logic_or(left != 0.0, right != 0.0)

    def constant(self, array: NDArray[np.float64]) -> SX:
        """The value of an array of numbers."""
        return _as_column(SX(np.asarray(array, dtype=np.float64))) if array.size else SX(0, 1)

    def shape(self, value: SX) -> tuple[int, int]:
        """Rows and columns; a vector is a column."""
        rows, columns = value.shape
        return rows, columns

    def fold(self, combine: Callable[[Any, Any], Any], value: SX) -> SX:
        """The elements of a vector, or of each column of a matrix, combined from first to last."""
        if not value.numel():
            raise MismatchError("the array is empty")
        return reduce(combine, [value[k, :] for k in range(value.shape[0])])

    def total(self, value: SX) -> SX:
        """The sum of a vector, or the sums of the columns of a matrix."""
        return casadi.sum1(value)

    def norm(self, value: SX) -> SX:
        """The square root of the sum of the squares of all elements."""
        return casadi.norm_fro(value)

    def entries(self, value: SX) -> list[SX]:
        """The elements, column by column."""
        return [value[k] for k in range(value.numel())]

    def vector_like(self, entries: Sequence[Any], model: SX) -> SX:
        """A vector of these elements."""
        return vertcat(*entries)

    def constant_number(self, value: SX) -> float:
        """A constant number; NaN for anything else."""
        return float(value) if value.numel() == 1 and value.is_constant() else math.nan

    def from_rows(self, rows: Sequence[Sequence[Any]]) -> SX:
        """The matrix with these rows of elements."""
        return vertcat(*(horzcat(*row) for row in rows))

    def transposed_matrix(self, value: SX) -> SX:
        """The transpose."""
        return casadi.transpose(value)

    def diagonal(self, value: SX) -> SX:
        """The diagonal of a matrix, or the matrix with this diagonal."""
        return casadi.diag(value)

    def inverse(self, value: SX) -> SX:
        """The inverse of a square matrix."""
        if value.shape[0] != value.shape[1]:
            raise MismatchError(f"a {value.shape[0]} x {value.shape[1]} matrix has no inverse")
        return casadi.inv(value)

    def cosine_sine(self, angle: SX) -> tuple[Any, Any]:
        """Cosine and sine of a number, exact at multiples of pi/2 if it is constant."""
        if angle.is_constant():
            return cos_exact(float(angle)), sin_exact(float(angle))
        return elementary("cos", angle), elementary("sin", angle)


class Symbols:
    """The operations of expressions on symbols (:class:`~.evaluation.Values`)."""

    def __init__(self, names: Mapping[str, SX]) -> None:
        self._names = names
        self._arithmetic = SymbolArithmetic()

    def number(self, value: float) -> Symbol:
        """A number."""
        return SX(value)

    def text(self, location: Location, value: str) -> Symbol:
        """A string in quotes."""
        return value

    def negative(self, location: Location, value: Symbol) -> Symbol:
        """The negative ``-value``."""
        return _oriented_like(-_symbol(location, value), value)

    def logical_not(self, location: Location, value: Symbol) -> Symbol:
        """The logical negation ``~value``."""
        return logic_not(_symbol(location, value) != 0.0)

    def operate(self, location: Location, operator: str, left: Symbol, right: Symbol) -> Symbol:
        """``left operator right`` of arithmetic or a comparison."""
        a, b = _symbol(location, left), _symbol(location, right)
        if operator == "*" and _is_matrix(a, b):
            return _product(location, a, b)
        if operator in ("*", "/", "\\") and 1 not in (a.numel(), b.numel()):
            _check_products(location, operator, left, right)
        if operator == "^" and (a.shape[1] > 1 or b.shape[1] > 1):
            return _matrix_power(location, a, b)
        divisor = b if operator == "/" else a
        if operator in ("/", "\\") and divisor.numel() != 1 and _is_matrix(a, b):
            raise location.error(
                "the divisor is a matrix", allowed="inv(A) * b, or ./ for elementwise division"
            )
        return _oriented_like(
            _elementwise(location, _OPERATIONS[operator.removeprefix(".")], a, b), left, right
        )

    def logic(self, location: Location, operator: str, values: Sequence[Symbol]) -> Symbol:
        """All values joined by one of ``&& || & |``."""
        combine_pair = logic_and if operator in ("&&", "&") else logic_or
        first, *others = (_symbol(location, value) != 0.0 for value in values)
        for other in others:
            first = _elementwise(location, combine_pair, first, other)
        return first

    def matrix(self, location: Location, rows: Sequence[Sequence[Symbol]]) -> Symbol:
        """``[1 2; 3 4]``: every row concatenates its numbers and vectors."""
        values = [] if rows else [SX(0, 1)]
        for row in rows:
            entries = [_symbol(location, entry) for entry in row]
            columns = [entry for entry in row if isinstance(entry, OrientedVector) and entry.kind == "column"]
            if columns and (len(rows) > 1 or len(row) > 1):
                raise location.error(
                    "a column of a matrix, or a matrix times a vector, is combined with other entries "
                    "in brackets",
                    allowed="numbers, vectors, and rows of matrices inside brackets",
                    fix="write A(:, [2 1]) for columns of one matrix",
                )
            if any(entry.shape[1] > 1 for entry in entries):
                raise location.error(
                    "a matrix is inside brackets", allowed="numbers and vectors inside brackets"
                )
            values.append(vertcat(*entries))
        if len(values) == 1 or all(value.numel() == 1 for value in values):
            return vertcat(*values)
        if len({value.numel() for value in values}) > 1:
            lengths = ", ".join(str(value.numel()) for value in values)
            raise location.error(f"the rows of an array have {lengths} numbers", allowed="rows of one length")
        return _as_column(horzcat(*values).T)

    def cell(self, location: Location, elements: Sequence[Symbol]) -> Symbol:
        """Cell arrays exist in scripts only."""
        raise location.error("a cell array is not a number", allowed="[a b; c d]")

    def range(self, location: Location, parts: Sequence[Symbol]) -> Symbol:
        """``first:last`` or ``first:step:last`` of constant numbers."""
        ends = [_constant(_symbol(location, part)) for part in parts]
        numbers = [float(end[0, 0]) for end in ends if end is not None and end.size == 1]
        if len(numbers) < len(parts):
            raise location.error("the size of a range is not constant", allowed="constant numbers")
        first, step, last = (numbers[0], 1.0, numbers[1]) if len(numbers) == 2 else numbers
        try:
            return self._arithmetic.constant(range_of(first, step, last))
        except MismatchError as mismatch:
            raise location.error(f"a range: {mismatch}", allowed="first:last or first:step:last") from None

    def transposed(self, location: Location, value: Symbol) -> Symbol:
        """The transpose ``value'``."""
        array = _symbol(location, value)
        if array.shape[1] > 1 or array.numel() < 2:
            return _as_column(array.T)
        kind = value.kind if isinstance(value, OrientedVector) else ""
        return OrientedVector(array, {"row": "column", "column": "row"}.get(kind, "transposed"))

    def index(self, location: Location, value: Symbol, expression: Expression) -> Symbol:
        """The value of an index. Raises an error for a logical index."""
        if is_logical(expression):
            raise location.error(
                "an index is a comparison or a logical value", allowed="positions counted from 1"
            )
        return value

    def element(
        self, location: Location, value: Symbol, indices: Sequence[Symbol | None], label: str
    ) -> Symbol:
        """``value(indices)`` with constant indices, where ``None`` is ``:``."""
        array = _symbol(location, value)
        index_arrays: list[NDArray[np.float64] | None] = []
        for index in indices:
            numbers = None if index is None else _constant(_symbol(location, index))
            if index is not None and numbers is None:
                raise location.error(
                    f"'{label or 'the array'}' has no constant index", allowed=f"{label or 'u'}(1) and so on"
                )
            index_arrays.append(numbers)
        rows, columns = array.shape
        if isinstance(value, OrientedVector) and value.kind == "row":
            rows, columns = columns, rows
        elif len(indices) == 2 and columns == 1 and not isinstance(value, OrientedVector):
            index_arrays = _single_index(location, rows, index_arrays)
        selected = positions(location, (rows, columns), index_arrays, label)
        if selected.size == 1:
            return array[int(selected.flat[0])]
        entries = vertcat(*(array[int(k)] for k in selected.ravel(order="F")), SX(0, 1))
        if not selected.size:
            return SX(0, 1)
        shaped = reshape(entries, *selected.shape)
        return _oriented_part(shaped) if array.shape[1] > 1 else _as_column(shaped)

    def last_index(self, location: Location, value: Symbol, position: int, count: int) -> Symbol:
        """``end`` as index ``position`` of ``count`` indices."""
        array = _symbol(location, value)
        if count > 1 and array.shape[1] == 1 and array.numel() > 1 and not isinstance(value, OrientedVector):
            raise _orientation_error(location)
        extents = (
            array.shape[::-1] if isinstance(value, OrientedVector) and value.kind == "row" else array.shape
        )
        return SX(float(array.numel() if count == 1 else extents[min(position, 1)]))

    def cell_element(self, location: Location, value: Symbol, indices: Sequence[Symbol | None]) -> Symbol:
        """Cell arrays exist in scripts only."""
        raise location.error("cell arrays are not supported in formulas", allowed="v(1), A(1, 2)")

    def field(self, location: Location, value: Symbol, name: str) -> Symbol:
        """``A.T`` is the transpose, as in NumPy; numbers have no other fields."""
        if name == "T":
            return self.transposed(location, value)
        raise location.error(f"a number has no field '{name}'", allowed="A' or A.T, the transpose")

    def check_function(self, location: Location, name: str, called: bool) -> None:
        """Raise ``UnknownNameError`` unless the table has a function of this name."""
        if name not in TABLE:
            kind, known = ("function", TABLE) if called else ("name", self._known())
            raise UnknownNameError(kind, name, known, where=location.source.name)

    def call(
        self, location: Location, name: str, arguments: Sequence[Symbol], expressions: Sequence[Expression]
    ) -> Symbol:
        """``name(arguments)`` of a function in the table."""
        function = TABLE[name]
        values = [
            value if isinstance(value, str) and function.may_be_text(k) else _symbol(location, value)
            for k, value in enumerate(arguments)
        ]
        function, selected = selected_function(name, values)
        if function.elementwise and len(values) > 1:
            _check_shapes(location, [value for value in values if isinstance(value, SX)])
        result = call_function(self._arithmetic, location, name, function, selected, _constant)
        if any(isinstance(value, SX) and value.shape[1] > 1 for value in values):
            return _oriented_part(result)
        return _oriented_like(_as_column(result), *arguments) if function.elementwise else _as_column(result)

    def _known(self) -> set[str]:
        return {*self._names, *(name for name, function in TABLE.items() if function.max_arguments == 0)}


def _symbol(location: Location, value: Symbol) -> SX:
    if isinstance(value, str):
        raise location.error(
            f"the text '{value[:40]}' is not a number", allowed="numbers and names without quotes"
        )
    return value.value if isinstance(value, OrientedVector) else value


def _oriented_part(value: SX) -> Symbol:
    """A part or a reduction of a matrix; a vector gets the orientation of its row or column."""
    if value.numel() < 2 or 1 not in value.shape:
        return value
    return OrientedVector(_as_column(value), "row" if value.shape[0] == 1 else "column")


def _oriented_like(result: SX, *operands: Symbol) -> Symbol:
    """The result of an operation element by element: a vector with the orientation of its operands."""
    kinds = [operand.kind for operand in operands if isinstance(operand, OrientedVector)]
    return (
        OrientedVector(result, kinds[0]) if kinds and result.shape[1] == 1 and result.numel() > 1 else result
    )


def _orientation_error(location: Location) -> ArmblocksError:
    return location.error(
        "a vector has two indices, but is neither row nor column in a formula", allowed="v(2), v(2:3), v(end)"
    )


def _single_index(
    location: Location, count: int, index_arrays: Sequence[NDArray[np.float64] | None]
) -> list[NDArray[np.float64] | None]:
    """The indices (k, 1) of ``v(k, 1)`` or ``v(1, k)``. Raises an error for other indices, unless v is a
    number."""
    numbers = [float(index[0, 0]) for index in index_arrays if index is not None and index.size == 1]
    if count == 1:
        return list(index_arrays)
    if len(numbers) < 2 or 1.0 not in numbers:
        raise _orientation_error(location)
    return [np.array([[max(numbers)]]), np.ones((1, 1))]


def _constant(value: object) -> NDArray[np.float64] | None:
    """The numbers of a constant; ``None`` for symbols."""
    return evalf(value).full() if isinstance(value, SX) and value.is_constant() else None


def _as_column(value: SX) -> SX:
    """The value, with a row vector converted to a column."""
    return value.T if value.shape[0] == 1 and value.shape[1] > 1 else value


def _is_matrix(left: SX, right: SX) -> bool:
    """Whether a matrix is an operand together with another array."""
    return not (left.numel() == 1 or right.numel() == 1) and (left.shape[1] > 1 or right.shape[1] > 1)


def _check_products(location: Location, operator: str, left: Symbol, right: Symbol) -> None:
    """Raise an error for a product of two vectors if one of them is a row, a column or a transpose."""
    kinds = [value.kind for value in (left, right) if isinstance(value, OrientedVector)]
    if kinds:
        operand = {"transposed": "a transposed vector"}.get(kinds[0], f"a {kinds[0]} of a matrix or product")
        raise location.error(
            f"{operand} and a vector are combined by '{operator}'",
            allowed="vectors without orientation, which are combined element by element",
            fix="write dot(v, w) for the scalar product v'*w, dot(v, A*w) for v'*A*w, "
            ".* and ./ for the operation element by element",
        )


def _matrix_power(location: Location, base: SX, exponent: SX) -> SX:
    number = _constant(exponent)
    rows, columns = base.shape
    if rows != columns or number is None or number.size != 1 or number[0, 0] not in EXPONENTS:
        raise location.error(
            "the power of a matrix is not supported for this exponent"
            if rows == columns
            else "a power of a matrix that is not square",
            allowed=ALLOWED_MATRIX_POWERS,
            fix="write .^ for powers element by element",
        )
    count = int(number[0, 0])
    factor = casadi.inv(base) if count < 0 else base
    return reduce(mtimes, [factor] * abs(count), SX(np.eye(rows)))


def _product(location: Location, left: SX, right: SX) -> Symbol:
    """The matrix product; a vector on the left is a row."""
    if left.shape[1] == 1:
        left = left.T
    if left.shape[1] != right.shape[0]:
        raise location.error(
            f"a matrix of {_size(left)} is multiplied by a matrix of {_size(right)}",
            allowed="as many columns on the left as rows on the right; .* multiplies elementwise",
        )
    return _oriented_part(mtimes(left, right))


def _size(value: SX) -> str:
    return f"{value.shape[0]} x {value.shape[1]}"


def _elementwise(location: Location, function: Callable[..., SX], *values: SX) -> SX:
    _check_shapes(location, values)
    return function(*values)


def _check_shapes(location: Location, values: Sequence[SX]) -> None:
    """Raise an error unless all arrays have one shape; scalars are broadcast."""
    shapes = {value.shape for value in values if value.numel() != 1}
    if len(shapes) < 2:
        return
    if any(columns > 1 for _, columns in shapes):
        raise location.error(
            f"arrays of {' and '.join(sorted(f'{m} x {n}' for m, n in shapes))} numbers are combined",
            allowed="arrays of equal size, and scalars with any array",
        )
    sizes = sorted(value.numel() for value in values if value.numel() != 1)
    raise location.error(
        f"vectors of {' and '.join(dict.fromkeys(map(str, sizes)))} elements are combined",
        allowed="vectors of equal length, and scalars with any vector",
    )
