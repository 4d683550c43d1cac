"""Values of expressions as numbers: arrays with two axes, and strings, as in MATLAB."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import reduce
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from armblocks import rounded_functions
from armblocks.errors import UnknownNameError
from armblocks.matlab.array_functions import range_of
from armblocks.matlab.arrays import (
    ROUNDED_FUNCTION_COST,
    Array,
    Budget,
    array_of,
    concatenated,
    is_array,
    is_logical,
    kind_of,
    number_of,
    operate,
    positions,
    scalar,
)
from armblocks.matlab.calls import call_function, selected_function
from armblocks.matlab.function_kinds import MismatchError
from armblocks.matlab.functions import TABLE
from armblocks.matlab.source import Location
from armblocks.matlab.syntax import Expression
from armblocks.spatial.rotation import cos_exact, sin_exact

NumberOrText = Array | str


class NumberArithmetic:
    """The operations of the function table on arrays of numbers (:class:`~.function_kinds.Arithmetic`)."""

    has_orientation = True

    def elementary(self, name: str, *values: Array) -> Array:
        """A correctly rounded function, element by element."""
        return np.vectorize(rounded_functions.FUNCTIONS[name], otypes=[np.float64])(*values)

    def sqrt(self, value: Array) -> Array:
        """Square root."""
        return np.sqrt(value)

    def floor(self, value: Array) -> Array:
        """Round down."""
        return np.floor(value)

    def ceil(self, value: Array) -> Array:
        """Round up."""
        return np.ceil(value)

    def sign(self, value: Array) -> Array:
        """The sign: -1, 0 or 1."""
        return np.sign(value)

    def absolute(self, value: Array) -> Array:
        """Absolute value."""
        return np.abs(value)

    def minimum(self, left: Array, right: Array) -> Array:
        """The smaller value; NaN only if both are NaN."""
        return np.fmin(left, right)

    def maximum(self, left: Array, right: Array) -> Array:
        """The larger value; NaN only if both are NaN."""
        return np.fmax(left, right)

    def quotient(self, left: Array, right: Array) -> Array:
        """The elementwise quotient ``left ./ right``."""
        return left / right

    def remainder(self, left: Array, right: Array) -> Array:
        """The exact remainder with the sign of the dividend."""
        return np.fmod(left, right)

    def where(self, condition: Array, yes: Array, no: Array) -> Array:
        """``yes`` where the condition is not 0, else ``no``."""
        return np.where(condition != 0.0, yes, no)

    def logical_and(self, left: Array, right: Array) -> Array:
        """1 where both are not 0, else 0."""
        return np.logical_and(left != 0.0, right != 0.0)

    def logical_or(self, left: Array, right: Array) -> Array:
        """1 where at least one is not 0, else 0."""
        return np.logical_or(left != 0.0, right != 0.0)

    def constant(self, array: NDArray[np.float64]) -> Array:
        """The value of an array of numbers."""
        return array

    def shape(self, value: Array) -> tuple[int, int]:
        """Rows and columns."""
        rows, columns = value.shape
        return rows, columns

    def fold(self, combine: Callable[[Any, Any], Any], value: Array) -> Array:
        """The elements of a vector, or of each column of a matrix, combined from first to last."""
        rows = value.reshape(-1, 1) if 1 in value.shape else value
        if not rows.size:
            raise MismatchError("the array is empty")
        return reduce(combine, [rows[k : k + 1] for k in range(rows.shape[0])])

    def total(self, value: Array) -> Array:
        """The sum of a vector, or the sums of the columns of a matrix."""
        if value.size:
            return self.fold(np.add, value)
        # A matrix without rows has a sum of 0 for each column.
        return np.zeros((1, value.shape[1])) if value.shape[0] == 0 and value.shape[1] > 1 else scalar(0.0)

    def norm(self, value: Array) -> Array:
        """The square root of the sum of the squares of all elements."""
        return np.sqrt(self.total((value * value).reshape(-1, 1, order="F")))

    def entries(self, value: Array) -> list[float]:
        """The elements, column by column."""
        return [float(entry) for entry in value.ravel(order="F")]

    def vector_like(self, entries: Sequence[Any], model: Array) -> Array:
        """A vector of these elements, with the orientation of ``model``."""
        return np.array(entries, dtype=np.float64).reshape((-1, 1) if model.shape[1] == 1 else (1, -1))

    def constant_number(self, value: Array) -> float:
        """The element of an array with one element, else NaN."""
        return float(value[0, 0]) if value.size == 1 else math.nan

    def from_rows(self, rows: Sequence[Sequence[Any]]) -> Array:
        """The matrix with these rows of elements."""
        return np.array(rows, dtype=np.float64)

    def transposed_matrix(self, value: Array) -> Array:
        """The transpose."""
        return value.T.copy()

    def diagonal(self, value: Array) -> Array:
        """The diagonal of a matrix, or the matrix with this diagonal."""
        if 1 in value.shape or value.size == 0:
            if value.size**2 > 100_000:
                raise MismatchError(f"a matrix would have {value.size}x{value.size} elements")
            return np.diag(value.ravel())
        return np.diag(value).reshape(-1, 1)

    def inverse(self, value: Array) -> Array:
        """The inverse of a square matrix."""
        rows, columns = value.shape
        if rows != columns:
            raise MismatchError(f"a {rows} x {columns} matrix has no inverse")
        try:
            return np.asarray(np.linalg.solve(value, np.eye(rows)), dtype=np.float64)
        except np.linalg.LinAlgError:
            raise MismatchError("a singular matrix has no inverse") from None

    def cosine_sine(self, angle: Array) -> tuple[float, float]:
        """Cosine and sine of a number, exact at multiples of pi/2."""
        number = float(angle[0, 0])
        return cos_exact(number), sin_exact(number)


class Numbers:
    """The operations of expressions on numbers (:class:`~.evaluation.Values`), within a budget."""

    def __init__(self, budget: Budget) -> None:
        self.budget = budget
        self._arithmetic = NumberArithmetic()

    def number(self, value: float) -> NumberOrText:
        """A number."""
        return scalar(value)

    def text(self, location: Location, value: str) -> NumberOrText:
        """A string in quotes."""
        return value

    def negative(self, location: Location, value: object) -> Array:
        """``-value``. The negative of the number 0 is 0, not -0."""
        array = array_of(location, value, "the operand of '-'")
        self.budget.spend(location, array.size)
        return 0.0 - array if array.size == 1 and array[0, 0] == 0 else -array

    def logical_not(self, location: Location, value: object) -> Array:
        """The logical negation ``~value``."""
        array = array_of(location, value, "the operand of '~'")
        self.budget.spend(location, array.size)
        return cast("Array", array == 0.0)

    def operate(self, location: Location, operator: str, left: object, right: object) -> Array:
        """``left operator right`` of arithmetic or a comparison."""
        return operate(location, self.budget, operator, left, right)

    def logic(self, location: Location, operator: str, values: Sequence[object]) -> Array:
        """All values joined by one of ``&& || & |``."""
        combine = np.logical_and if operator in ("&&", "&") else np.logical_or
        result = array_of(location, values[0], f"the left operand of '{operator}'") != 0.0
        for value in values[1:]:
            other = array_of(location, value, f"the right operand of '{operator}'") != 0.0
            if result.shape != other.shape and 1 not in (result.size, other.size):
                raise location.error(
                    f"'{operator}' of {kind_of(result)} and {kind_of(other)}",
                    allowed="equal sizes, or a number on one side",
                )
            self.budget.spend(location, max(result.size, other.size))
            result = combine(result, other)
        return cast("Array", result)

    def matrix(self, location: Location, rows: Sequence[Sequence[object]]) -> NumberOrText:
        """``[a b; c d]`` of arrays, or of strings in one row."""
        flat = [value for row in rows for value in row]
        texts = [value for value in flat if isinstance(value, str)]
        if texts and len(texts) == len(flat) and len(rows) == 1:
            return "".join(texts)
        return concatenated(location, self.budget, rows)

    def cell(self, location: Location, elements: Sequence[object]) -> NumberOrText:
        """Cell arrays exist in scripts only."""
        raise location.error("a cell array is not a number", allowed="[a b; c d]")

    def range(self, location: Location, parts: Sequence[object]) -> Array:
        """The range ``first:last`` or ``first:step:last``."""
        ends = [number_of(location, part, "an end of a range") for part in parts]
        first, step, last = (ends[0], 1.0, ends[1]) if len(ends) == 2 else ends
        try:
            elements = range_of(first, step, last)
        except MismatchError as mismatch:
            raise location.error(f"a range: {mismatch}", allowed="first:last or first:step:last") from None
        self.budget.spend(location, elements.size)
        return elements

    def transposed(self, location: Location, value: object) -> Array:
        """The transpose ``value'``."""
        array = array_of(location, value, "the operand of the transpose")
        self.budget.spend(location, array.size)
        return cast("Array", (array != 0.0).T) if is_logical(value) else array.T.copy()

    def index(self, location: Location, value: NumberOrText, expression: Expression) -> NumberOrText:
        """The value of an index: positions, or a logical array that selects elements."""
        return value

    def element(self, location: Location, value: object, indices: Sequence[object], label: str) -> Array:
        """``value(indices)``, where ``None`` is ``:``."""
        if not is_array(value):
            raise location.error(f"() is used on {kind_of(value)}", allowed="matrices and arrays of links")
        self.budget.spend(location, value.size)
        rows, columns = value.shape
        return value.ravel(order="F")[positions(location, (rows, columns), indices, label)]

    def last_index(self, location: Location, value: object, position: int, count: int) -> Array:
        """``end`` as index ``position`` of ``count`` indices."""
        array = array_of(location, value, "the value with the index 'end'")
        return scalar(float(array.size if count == 1 else array.shape[min(position, 1)]))

    def cell_element(self, location: Location, value: object, indices: Sequence[object]) -> NumberOrText:
        """Cell arrays exist in scripts only."""
        raise location.error(f"{{}} is used on {kind_of(value)}", allowed="cell arrays")

    def field(self, location: Location, value: object, name: str) -> NumberOrText:
        """``A.T`` is the transpose; numbers have no other fields."""
        if is_array(value) and name == "T":
            return self.transposed(location, value)
        raise location.error(f"{kind_of(value)} has no field '{name}'", allowed="fields of links and robots")

    def check_function(self, location: Location, name: str, called: bool) -> None:
        """Raise ``UnknownNameError`` unless the table has a function of this name."""
        if name not in TABLE:
            raise UnknownNameError("function" if called else "name", name, TABLE, where=location.source.name)

    def call(
        self, location: Location, name: str, arguments: Sequence[object], expressions: Sequence[Expression]
    ) -> NumberOrText:
        """``name(arguments)`` of a function in the table. Complex results are errors."""
        function = TABLE[name]
        if name in ("power", "pow") and len(arguments) == 2:
            return self.operate(location, ".^", *arguments)
        values: list[Any] = [
            value if isinstance(value, str) and function.may_be_text(k) else _argument(location, value, name)
            for k, value in enumerate(arguments)
        ]
        function, selected = selected_function(name, values)
        arrays = [value for value in selected if is_array(value)]
        if function.elementwise:
            _check_sizes(location, name, arrays)
        for array in arrays if function.elementwise else ():
            if np.any((array < function.real_from) | (array > function.real_to)):
                raise location.error(
                    f"{name} has a complex value here",
                    allowed=f"arguments from {function.real_from:g} to {function.real_to:g}",
                )
        size = max((array.size for array in arrays), default=1)
        self.budget.spend(location, size * (ROUNDED_FUNCTION_COST if function.elementary else 1))
        with np.errstate(all="ignore"):
            result = call_function(self._arithmetic, location, name, function, selected, np.asarray)
        array = cast("Array", result if is_logical(result) else np.asarray(result, dtype=np.float64))
        self.budget.spend(location, array.size)
        return array


def _argument(location: Location, value: object, name: str) -> Array:
    return array_of(location, value, f"the argument of {name}")


def _check_sizes(location: Location, name: str, arrays: Sequence[Array]) -> None:
    shapes = {array.shape for array in arrays if array.size != 1}
    if len(shapes) > 1:
        raise location.error(
            f"the arguments of {name} are {' and '.join(kind_of(array) for array in arrays)}",
            allowed="equal sizes, or numbers",
        )
