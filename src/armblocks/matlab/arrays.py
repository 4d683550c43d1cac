"""Arrays of numbers: arithmetic, indexing and concatenation as in MATLAB, with limits of size and work."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Protocol, TypeGuard, cast, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from armblocks.matlab.array_functions import MOST_ELEMENTS
from armblocks.matlab.source import Place
from armblocks.rounded_functions import power

Array = NDArray[np.float64]
"""MATLAB's only number: a matrix, always with two axes. A scalar is (1, 1), the empty matrix is (0, 0).

The results of comparisons and logical operators are arrays of Booleans, as they select elements when they are
indices. :func:`array_of` makes numbers of them.
"""

MOST_WORK = 20_000_000
"""Maximum number of elements that one script may compute, which limits time and memory."""
ROUNDED_WORK = 1000
"""Cost of a sine or a power relative to a sum."""


EXPONENTS = range(-64, 65)
"""Exponents of matrices."""
POWERS_OF_MATRICES = "numbers, or a square matrix with a whole exponent from -64 to 64"


@dataclass
class Budget:
    """Limits the number of elements that a script computes."""

    left: int = MOST_WORK

    def spend(self, place: Place, count: int) -> None:
        """Subtract ``count`` elements; raises an error if the limit is exceeded."""
        self.left -= count
        if self.left < 0:
            raise place.error(
                "the script exceeds the computation limit of robot scripts",
                allowed=f"{MOST_WORK} elements in all",
            )


def scalar(value: float) -> Array:
    """A number as a (1, 1) matrix."""
    return np.array([[value]])


def empty() -> Array:
    """``[]``"""
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


def number_of(place: Place, value: object, what: str) -> float:
    """A value that must be one number; ``what`` is its name in the error."""
    if is_array(value) and value.size == 1:
        return float(value[0, 0])
    raise place.error(f"{what} is {kind_of(value)}", allowed="one number")


def count_of(place: Place, value: object, what: str, most: int = MOST_ELEMENTS) -> int:
    """A value that must be a whole number from 0 to ``most``."""
    number = number_of(place, value, what)
    if not (0 <= number <= most) or number != int(number):
        raise place.error(f"{what} is {number:g}", allowed=f"a whole number from 0 to {most}")
    return int(number)


def text_of(place: Place, value: object, what: str) -> str:
    """A value that must be text."""
    if isinstance(value, str):
        return value
    raise place.error(f"{what} is {kind_of(value)}", allowed="text in quotes")


def array_of(place: Place, value: object, what: str) -> Array:
    """A value that must be a matrix; logical values become numbers."""
    if is_array(value):
        return np.asarray(value, dtype=np.float64)
    raise place.error(f"{what} is {kind_of(value)}", allowed="numbers")


def check_size(place: Place, rows: int, columns: int) -> None:
    """Raise an error for a matrix with too many elements."""
    if rows * columns > MOST_ELEMENTS:
        raise place.error(
            f"a matrix would have {rows}x{columns} elements", allowed=f"at most {MOST_ELEMENTS} elements"
        )


def operate(place: Place, budget: Budget, operator: str, left: object, right: object) -> Array:
    """``left operator right`` of arithmetic or a comparison."""
    a = array_of(place, left, f"the left operand of '{operator}'")
    b = array_of(place, right, f"the right operand of '{operator}'")
    with np.errstate(all="ignore"):
        if operator in _ELEMENTWISE or a.size == 1 == b.size:
            return _elementwise(place, budget, operator.lstrip("."), a, b)
        if operator == "*":
            return (
                _elementwise(place, budget, "*", a, b)
                if 1 in (a.size, b.size)
                else _matmul(place, budget, a, b)
            )
        if operator == "/":
            return (
                _elementwise(place, budget, "/", a, b) if b.size == 1 else _solve(place, budget, b.T, a.T).T
            )
        if operator == "\\":
            return _elementwise(place, budget, "\\", a, b) if a.size == 1 else _solve(place, budget, a, b)
        return _matrix_power(place, budget, a, b)


_COMPARED: dict[str, Callable[[Array, Array], NDArray[np.bool_]]] = {
    "==": np.equal,
    "~=": np.not_equal,
    "<": np.less,
    "<=": np.less_equal,
    ">": np.greater,
    ">=": np.greater_equal,
}
_ELEMENTWISE = frozenset(("+", "-", ".*", "./", ".\\", ".^", *_COMPARED))
_SCALAR_OPERATIONS: dict[str, Callable[[Array, Array], Array]] = {
    "+": np.add,
    "-": np.subtract,
    "*": np.multiply,
    "/": np.divide,
    "\\": lambda a, b: np.divide(b, a),
    "^": np.vectorize(power, otypes=[np.float64]),
}


def _elementwise(place: Place, budget: Budget, operator: str, a: Array, b: Array) -> Array:
    if a.shape != b.shape and 1 not in (a.size, b.size):
        raise place.error(
            f"'{operator}' of {kind_of(a)} and {kind_of(b)}", allowed="equal sizes, or a number on one side"
        )
    budget.spend(place, max(a.size, b.size) * (ROUNDED_WORK if operator == "^" else 1))
    if operator == "^" and np.any((a < 0) & (b != np.floor(b))):
        raise place.error("a root of a negative number is complex", allowed="real numbers")
    if operator in _COMPARED:
        return cast("Array", _COMPARED[operator](a, b))
    return _SCALAR_OPERATIONS[operator](a, b)


def _matmul(place: Place, budget: Budget, a: Array, b: Array) -> Array:
    if a.shape[1] != b.shape[0]:
        raise place.error(
            f"'*' of {kind_of(a)} and {kind_of(b)}",
            allowed="as many columns on the left as rows on the right",
        )
    check_size(place, a.shape[0], b.shape[1])
    budget.spend(place, a.size * b.shape[1] // 8 + a.shape[0] * b.shape[1])
    return _product(a, b)


def _solve(place: Place, budget: Budget, a: Array, b: Array) -> Array:
    n = a.shape[0]
    if a.shape != (n, n) or b.shape[0] != n:
        raise place.error(f"division by {kind_of(a)}", allowed="a number, or a square matrix that fits")
    budget.spend(place, n * n * (n + b.shape[1]) // 8 + b.size)
    try:
        return np.asarray(np.linalg.solve(a, b), dtype=np.float64)
    except np.linalg.LinAlgError:
        raise place.error("division by a singular matrix", allowed="a matrix with an inverse") from None


def _matrix_power(place: Place, budget: Budget, a: Array, b: Array) -> Array:
    exponent = float(b[0, 0]) if b.size == 1 else math.nan
    if a.shape[0] != a.shape[1] or exponent not in EXPONENTS:
        raise place.error(
            f"'^' of {kind_of(a)} and {kind_of(b)}",
            allowed=POWERS_OF_MATRICES,
            fix="write .^ for powers element by element",
        )
    budget.spend(place, a.size * (a.shape[0] + 8))
    factor = _solve(place, budget, a, np.eye(len(a))) if exponent < 0 else a
    return reduce(_product, [factor] * abs(int(exponent)), np.eye(len(a)))


def _product(a: Array, b: Array) -> Array:
    """``a b``, added from left to right, because the rounding of a numerical library depends on the
    processor."""
    total = np.zeros((a.shape[0], b.shape[1]))
    for k in range(a.shape[1]):
        total += a[:, k : k + 1] * b[k]
    return total


def stacked(place: Place, budget: Budget, rows: Sequence[Sequence[object]]) -> Array:
    """``[a b; c d]`` of arrays."""
    bands: list[Array] = []
    for row in rows:
        parts = [array_of(place, value, "an element of a matrix") for value in row]
        parts = [part for part in parts if part.size] or parts[:1]
        if len({part.shape[0] for part in parts}) > 1:
            raise place.error("the elements of a row differ in height", allowed="equal heights in a row")
        bands.append(np.hstack(parts))
    bands = [band for band in bands if band.size]
    if not bands:
        return empty()
    widths = [band.shape[1] for band in bands]
    if len(set(widths)) > 1:
        raise place.error(
            f"the rows of the matrix have {', '.join(map(str, widths[:8]))} elements",
            allowed="as many elements in every row",
            fix="complete the short row, or put '...' at the end of a continued line",
        )
    check_size(place, sum(band.shape[0] for band in bands), widths[0])
    budget.spend(place, sum(band.size for band in bands))
    found = np.vstack(bands)
    logical = all(is_logical(value) for row in rows for value in row)
    return cast("Array", found != 0.0) if logical else found


def index_of(place: Place, value: object, most: int, shown: str = "") -> int:
    """A 1-based index as a 0-based one; ``shown`` is the name of the indexed value in messages."""
    number = number_of(place, value, "an index")
    if not (1 <= number <= most) or number != int(number):
        raise place.error(
            f"the index {number:g} is not possible here",
            allowed=f"{shown}(1) to {shown}({most})"
            if shown and most
            else f"a whole number from 1 to {most}",
        )
    return int(number) - 1


def positions(
    place: Place, shape: tuple[int, int], indices: Sequence[object], shown: str
) -> NDArray[np.intp]:
    """The positions that ``array(i)`` or ``array(i, j)`` selects, counted column by column from 0.

    An index is an array of numbers, or ``None`` for ``:``. The result has the shape of the selected part.
    """
    rows, columns = shape
    extents = {1: (rows * columns,), 2: shape}.get(len(indices))
    if extents is None:
        raise place.error(f"{len(indices)} indices are given", allowed="1 or 2")
    chosen = [_chosen(place, index, extent, shown) for index, extent in zip(indices, extents)]
    if rows * columns == 0 and any(part.size for part in chosen):
        raise place.error("an element of an empty matrix is read", allowed="elements that exist")
    if len(chosen) == 2:
        check_size(place, chosen[0].size, chosen[1].size)
        return chosen[0].reshape(-1, 1) + rows * chosen[1].reshape(1, -1)
    index = indices[0]
    if index is None:
        return chosen[0].reshape(-1, 1)
    given = index.shape if is_array(index) else (0, 0)
    if is_logical(index):
        given = (1, chosen[0].size) if given[0] == 1 else (chosen[0].size, 1)
    if 1 in shape and rows * columns != 1 and (1 in given or 0 in given):
        return chosen[0].reshape((-1, 1) if columns == 1 else (1, -1))
    return chosen[0].reshape(given, order="F")


def _chosen(place: Place, index: object, extent: int, shown: str) -> NDArray[np.intp]:
    if index is None:
        return np.arange(extent)
    if is_logical(index):
        chosen = np.flatnonzero(index.ravel(order="F"))
        if chosen.size and chosen[-1] >= extent:
            index_of(place, scalar(float(chosen[-1] + 1)), extent, shown)
        return chosen
    numbers = array_of(place, index, "an index").ravel(order="F")
    found = [index_of(place, scalar(float(number)), max(extent, 1), shown) for number in numbers]
    return np.array(found, dtype=np.intp)


def with_element(place: Place, array: Array, indices: Sequence[object], number: float) -> Array:
    """A copy of ``array`` with one element set; it grows with zeros where needed."""
    if len(indices) == 1:
        column = array.shape[1] == 1 and array.shape[0] > 1
        flat = index_of(place, indices[0], MOST_ELEMENTS)
        if min(array.shape, default=0) > 1:
            if flat >= array.size:
                raise place.error(f"the matrix has no element {flat + 1}", allowed=f"1 to {array.size}")
            i, j = flat % array.shape[0], flat // array.shape[0]
        else:
            i, j = (flat, 0) if column else (0, flat)
    elif len(indices) == 2:
        i, j = (index_of(place, index, MOST_ELEMENTS) for index in indices)
    else:
        raise place.error(f"{len(indices)} indices are given", allowed="1 or 2")
    rows, columns = max(array.shape[0], i + 1), max(array.shape[1], j + 1)
    check_size(place, rows, columns)
    grown = np.zeros((rows, columns))
    grown[: array.shape[0], : array.shape[1]] = array
    grown[i, j] = number
    return grown
