"""Arrays of numbers: arithmetic, indexing and concatenation as in MATLAB, with limits of size and work."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Protocol, TypeGuard, cast, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from armblocks.matlab.array_functions import MAX_ELEMENTS
from armblocks.matlab.source import Location
from armblocks.rounded_functions import power

Array = NDArray[np.float64]
"""MATLAB's numeric type: a matrix, always with two axes. A scalar is (1, 1), the empty matrix is (0, 0).

The results of comparisons and logical operators are arrays of Booleans, as they select elements when they are
indices. :func:`array_of` converts them to numbers.
"""

MAX_COMPUTED_ELEMENTS = 20_000_000
"""Maximum number of elements that one script may compute, which limits time and memory."""
ROUNDED_FUNCTION_COST = 1000
"""Cost of a correctly rounded function, such as a sine or a power, relative to a sum."""


EXPONENTS = range(-64, 65)
"""Allowed exponents of matrix powers."""
ALLOWED_MATRIX_POWERS = "numbers, or a square matrix with a whole exponent from -64 to 64"


@dataclass
class Budget:
    """Limits the number of elements that a script computes."""

    left: int = MAX_COMPUTED_ELEMENTS

    def spend(self, location: Location, count: int) -> None:
        """Subtract ``count`` elements; raises an error if the limit is exceeded."""
        self.left -= count
        if self.left < 0:
            raise location.error(
                "the script exceeds the computation limit of robot scripts",
                allowed=f"{MAX_COMPUTED_ELEMENTS} elements in all",
            )


def scalar(value: float) -> Array:
    """A number as a (1, 1) matrix."""
    return np.array([[value]])


def empty() -> Array:
    """The empty matrix ``[]``."""
    return np.zeros((0, 0))


def is_array(value: object) -> TypeGuard[Array]:
    """Whether a value is an array of numbers."""
    return isinstance(value, np.ndarray)


def is_logical(value: object) -> TypeGuard[NDArray[np.bool_]]:
    """Whether a value is the result of a comparison or of a logical operator."""
    return is_array(value) and value.dtype.kind == "b"


@runtime_checkable
class Described(Protocol):
    """A value that is neither an array nor text, such as a robot of a script."""

    @property
    def kind(self) -> str:
        """The name of this kind of value in messages."""
        ...


def kind_of(value: object) -> str:
    """The name of a kind of value in messages, such as ``a 2x3 matrix``."""
    if is_array(value):
        return "a number" if value.size == 1 else f"a {value.shape[0]}x{value.shape[1]} matrix"
    if isinstance(value, Described):
        return value.kind
    return "text" if isinstance(value, str) else "an element that is not set"


def number_of(location: Location, value: object, what: str) -> float:
    """A value that must be one number; ``what`` is its name in the error."""
    if is_array(value) and value.size == 1:
        return float(value[0, 0])
    raise location.error(f"{what} is {kind_of(value)}", allowed="one number")


def count_of(location: Location, value: object, what: str, maximum: int = MAX_ELEMENTS) -> int:
    """A value that must be a whole number from 0 to ``maximum``."""
    number = number_of(location, value, what)
    if not (0 <= number <= maximum) or number != int(number):
        raise location.error(f"{what} is {number:g}", allowed=f"a whole number from 0 to {maximum}")
    return int(number)


def text_of(location: Location, value: object, what: str) -> str:
    """A value that must be text."""
    if isinstance(value, str):
        return value
    raise location.error(f"{what} is {kind_of(value)}", allowed="text in quotes")


def array_of(location: Location, value: object, what: str) -> Array:
    """A value that must be a matrix; logical values become numbers."""
    if is_array(value):
        return np.asarray(value, dtype=np.float64)
    raise location.error(f"{what} is {kind_of(value)}", allowed="numbers")


def check_size(location: Location, rows: int, columns: int) -> None:
    """Raise an error for a matrix with too many elements."""
    if rows * columns > MAX_ELEMENTS:
        raise location.error(
            f"a matrix would have {rows}x{columns} elements", allowed=f"at most {MAX_ELEMENTS} elements"
        )


def operate(location: Location, budget: Budget, operator: str, left: object, right: object) -> Array:
    """``left operator right`` of arithmetic or a comparison."""
    a = array_of(location, left, f"the left operand of '{operator}'")
    b = array_of(location, right, f"the right operand of '{operator}'")
    with np.errstate(all="ignore"):
        if operator in _ELEMENTWISE or a.size == 1 == b.size:
            return _elementwise(location, budget, operator.lstrip("."), a, b)
        if operator == "*":
            return (
                _elementwise(location, budget, "*", a, b)
                if 1 in (a.size, b.size)
                else _matmul(location, budget, a, b)
            )
        if operator == "/":
            return (
                _elementwise(location, budget, "/", a, b)
                if b.size == 1
                else _solve(location, budget, b.T, a.T).T
            )
        if operator == "\\":
            return (
                _elementwise(location, budget, "\\", a, b) if a.size == 1 else _solve(location, budget, a, b)
            )
        return _matrix_power(location, budget, a, b)


_COMPARISONS: dict[str, Callable[[Array, Array], NDArray[np.bool_]]] = {
    "==": np.equal,
    "~=": np.not_equal,
    "<": np.less,
    "<=": np.less_equal,
    ">": np.greater,
    ">=": np.greater_equal,
}
_ELEMENTWISE = frozenset(("+", "-", ".*", "./", ".\\", ".^", *_COMPARISONS))
_SCALAR_OPERATIONS: dict[str, Callable[[Array, Array], Array]] = {
    "+": np.add,
    "-": np.subtract,
    "*": np.multiply,
    "/": np.divide,
    "\\": lambda a, b: np.divide(b, a),
    "^": np.vectorize(power, otypes=[np.float64]),
}


def _elementwise(location: Location, budget: Budget, operator: str, a: Array, b: Array) -> Array:
    if a.shape != b.shape and 1 not in (a.size, b.size):
        raise location.error(
            f"'{operator}' of {kind_of(a)} and {kind_of(b)}", allowed="equal sizes, or a number on one side"
        )
    budget.spend(location, max(a.size, b.size) * (ROUNDED_FUNCTION_COST if operator == "^" else 1))
    if operator == "^" and np.any((a < 0) & (b != np.floor(b))):
        raise location.error("a root of a negative number is complex", allowed="real numbers")
    if operator in _COMPARISONS:
        return cast("Array", _COMPARISONS[operator](a, b))
    return _SCALAR_OPERATIONS[operator](a, b)


def _matmul(location: Location, budget: Budget, a: Array, b: Array) -> Array:
    if a.shape[1] != b.shape[0]:
        raise location.error(
            f"'*' of {kind_of(a)} and {kind_of(b)}",
            allowed="as many columns on the left as rows on the right",
        )
    check_size(location, a.shape[0], b.shape[1])
    budget.spend(location, a.size * b.shape[1] // 8 + a.shape[0] * b.shape[1])
    return _product(a, b)


def _solve(location: Location, budget: Budget, a: Array, b: Array) -> Array:
    n = a.shape[0]
    if a.shape != (n, n) or b.shape[0] != n:
        raise location.error(f"division by {kind_of(a)}", allowed="a number, or a square matrix that fits")
    budget.spend(location, n * n * (n + b.shape[1]) // 8 + b.size)
    try:
        return np.asarray(np.linalg.solve(a, b), dtype=np.float64)
    except np.linalg.LinAlgError:
        raise location.error("division by a singular matrix", allowed="a matrix with an inverse") from None


def _matrix_power(location: Location, budget: Budget, a: Array, b: Array) -> Array:
    exponent = float(b[0, 0]) if b.size == 1 else math.nan
    if a.shape[0] != a.shape[1] or exponent not in EXPONENTS:
        raise location.error(
            f"'^' of {kind_of(a)} and {kind_of(b)}",
            allowed=ALLOWED_MATRIX_POWERS,
            fix="write .^ for powers element by element",
        )
    budget.spend(location, a.size * (a.shape[0] + 8))
    factor = _solve(location, budget, a, np.eye(len(a))) if exponent < 0 else a
    return reduce(_product, [factor] * abs(int(exponent)), np.eye(len(a)))


def _product(a: Array, b: Array) -> Array:
    """``a b``, added from left to right, because the rounding of a numerical library depends on the
    processor."""
    total = np.zeros((a.shape[0], b.shape[1]))
    for k in range(a.shape[1]):
        total += a[:, k : k + 1] * b[k]
    return total


def concatenated(location: Location, budget: Budget, rows: Sequence[Sequence[object]]) -> Array:
    """``[a b; c d]`` of arrays."""
    row_blocks: list[Array] = []
    for row in rows:
        parts = [array_of(location, value, "an element of a matrix") for value in row]
        parts = [part for part in parts if part.size] or parts[:1]
        if len({part.shape[0] for part in parts}) > 1:
            raise location.error("the elements of a row differ in height", allowed="equal heights in a row")
        row_blocks.append(np.hstack(parts))
    row_blocks = [row_block for row_block in row_blocks if row_block.size]
    if not row_blocks:
        return empty()
    widths = [row_block.shape[1] for row_block in row_blocks]
    if len(set(widths)) > 1:
        raise location.error(
            f"the rows of the matrix have {', '.join(map(str, widths[:8]))} elements",
            allowed="as many elements in every row",
            fix="complete the short row, or put '...' at the end of a continued line",
        )
    check_size(location, sum(row_block.shape[0] for row_block in row_blocks), widths[0])
    budget.spend(location, sum(row_block.size for row_block in row_blocks))
    matrix = np.vstack(row_blocks)
    logical = all(is_logical(value) for row in rows for value in row)
    return cast("Array", matrix != 0.0) if logical else matrix


def index_of(location: Location, value: object, maximum: int, label: str = "") -> int:
    """A 1-based index as a 0-based one; ``label`` is the name of the indexed value in messages."""
    number = number_of(location, value, "an index")
    if not (1 <= number <= maximum) or number != int(number):
        raise location.error(
            f"the index {number:g} is not possible here",
            allowed=f"{label}(1) to {label}({maximum})"
            if label and maximum
            else f"a whole number from 1 to {maximum}",
        )
    return int(number) - 1


def positions(
    location: Location, shape: tuple[int, int], indices: Sequence[object], label: str
) -> NDArray[np.intp]:
    """The positions that ``array(i)`` or ``array(i, j)`` selects, counted column by column from 0.

    An index is an array of numbers, or ``None`` for ``:``. The result has the shape of the selected part.
    """
    rows, columns = shape
    extents = {1: (rows * columns,), 2: shape}.get(len(indices))
    if extents is None:
        raise location.error(f"{len(indices)} indices are given", allowed="1 or 2")
    index_positions = [
        _index_positions(location, index, extent, label) for index, extent in zip(indices, extents)
    ]
    if rows * columns == 0 and any(part.size for part in index_positions):
        raise location.error("an element of an empty matrix is read", allowed="elements that exist")
    if len(index_positions) == 2:
        check_size(location, index_positions[0].size, index_positions[1].size)
        return index_positions[0].reshape(-1, 1) + rows * index_positions[1].reshape(1, -1)
    index = indices[0]
    if index is None:
        return index_positions[0].reshape(-1, 1)
    selected_shape = index.shape if is_array(index) else (0, 0)
    if is_logical(index):
        selected_shape = (
            (1, index_positions[0].size) if selected_shape[0] == 1 else (index_positions[0].size, 1)
        )
    if 1 in shape and rows * columns != 1 and (1 in selected_shape or 0 in selected_shape):
        return index_positions[0].reshape((-1, 1) if columns == 1 else (1, -1))
    return index_positions[0].reshape(selected_shape, order="F")


def _index_positions(location: Location, index: object, extent: int, label: str) -> NDArray[np.intp]:
    if index is None:
        return np.arange(extent)
    if is_logical(index):
        index_positions = np.flatnonzero(index.ravel(order="F"))
        if index_positions.size and index_positions[-1] >= extent:
            index_of(location, scalar(float(index_positions[-1] + 1)), extent, label)
        return index_positions
    numbers = array_of(location, index, "an index").ravel(order="F")
    indices = [index_of(location, scalar(float(number)), max(extent, 1), label) for number in numbers]
    return np.array(indices, dtype=np.intp)


def with_element(location: Location, array: Array, indices: Sequence[object], number: float) -> Array:
    """A copy of ``array`` with one element set; it grows with zeros where needed."""
    if len(indices) == 1:
        column = array.shape[1] == 1 and array.shape[0] > 1
        flat = index_of(location, indices[0], MAX_ELEMENTS)
        if min(array.shape, default=0) > 1:
            if flat >= array.size:
                raise location.error(f"the matrix has no element {flat + 1}", allowed=f"1 to {array.size}")
            i, j = flat % array.shape[0], flat // array.shape[0]
        else:
            i, j = (flat, 0) if column else (0, flat)
    elif len(indices) == 2:
        i, j = (index_of(location, index, MAX_ELEMENTS) for index in indices)
    else:
        raise location.error(f"{len(indices)} indices are given", allowed="1 or 2")
    rows, columns = max(array.shape[0], i + 1), max(array.shape[1], j + 1)
    check_size(location, rows, columns)
    grown = np.zeros((rows, columns))
    grown[: array.shape[0], : array.shape[1]] = array
    grown[i, j] = number
    return grown
