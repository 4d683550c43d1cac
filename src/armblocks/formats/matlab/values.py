"""Values of scripts: matrices, text, cell arrays, links, robots; and arithmetic with limits."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from armblocks.formats.matlab.records import LinkRecord, RobotRecord
from armblocks.formats.matlab.source import Place
from armblocks.rounded_functions import power

Array = NDArray[np.float64]
"""MATLAB's only number: a matrix, always with two axes. A scalar is (1, 1), nothing is (0, 0)."""

MOST_ELEMENTS = 100_000
"""Elements of one matrix."""
MOST_LINKS = 1000
"""Elements of one cell array or array of links."""
MOST_WORK = 20_000_000
"""Maximum number of elements that one script may compute, which limits time and memory."""
ROUNDED_WORK = 1000
"""What a sine or a power costs beside a sum."""


@dataclass
class Cell:
    """``{a, b}``: a row of values, of which some may not be set (``None``). Cells do not nest."""

    elements: list[Value | None] = field(default_factory=lambda: list[Value | None]())


@dataclass
class LinkArray:
    """``[L1 L2]``: a row of links; an element may not be set yet."""

    links: list[LinkRecord | None] = field(default_factory=lambda: list[LinkRecord | None]())


Value = Array | str | Cell | LinkRecord | LinkArray | RobotRecord


@dataclass
class Budget:
    """Counts what a script computes."""

    left: int = MOST_WORK

    def spend(self, place: Place, count: int) -> None:
        """Take ``count`` elements off; raises ``FormatError`` when the script asks for too much."""
        self.left -= count
        if self.left < 0:
            raise place.error(
                "the script computes more than a robot script may", allowed=f"{MOST_WORK} elements in all"
            )


def scalar(value: float) -> Array:
    """A number as a (1, 1) matrix."""
    return np.array([[value]])


def empty() -> Array:
    """``[]``"""
    return np.zeros((0, 0))


def kind_of(value: Value | None) -> str:
    """What a value is, in words for messages."""
    match value:
        case None:
            return "an element that is not set"
        case str():
            return "text"
        case Cell():
            return "a cell array"
        case LinkRecord():
            return "a link"
        case LinkArray():
            return "an array of links"
        case RobotRecord():
            return "a robot"
        case _:
            rows, columns = value.shape
            return "a number" if value.size == 1 else f"a {rows}x{columns} matrix"


def copied(value: Value) -> Value:
    """What an assignment keeps: releases up to 8 copy links and robots, later ones share them."""
    match value:
        case Cell():
            return Cell([None if element is None else copied(element) for element in value.elements])
        case LinkArray():
            return LinkArray([None if link is None else link.assigned() for link in value.links])
        case LinkRecord() | RobotRecord():
            return value.assigned()
        case str():
            return value
        case _:
            return value.copy()


def number_of(place: Place, value: Value | None, what: str) -> float:
    """A value that must be one number; raises ``FormatError`` naming ``what``."""
    if isinstance(value, np.ndarray) and value.size == 1:
        return float(value[0, 0])
    raise place.error(f"{what} is {kind_of(value)}", allowed="one number")


def count_of(place: Place, value: Value | None, what: str, most: int = MOST_ELEMENTS) -> int:
    """A value that must be a whole number from 0 to ``most``."""
    number = number_of(place, value, what)
    if not (0 <= number <= most) or number != int(number):
        raise place.error(f"{what} is {number:g}", allowed=f"a whole number from 0 to {most}")
    return int(number)


def text_of(place: Place, value: Value | None, what: str) -> str:
    """A value that must be text."""
    if isinstance(value, str):
        return value
    raise place.error(f"{what} is {kind_of(value)}", allowed="text in quotes")


def array_of(place: Place, value: Value | None, what: str) -> Array:
    """A value that must be a matrix."""
    if isinstance(value, np.ndarray):
        return value
    raise place.error(f"{what} is {kind_of(value)}", allowed="numbers")


def check_size(place: Place, rows: int, columns: int) -> None:
    """Raise ``FormatError`` for a matrix larger than any in a robot script."""
    if rows * columns > MOST_ELEMENTS:
        raise place.error(
            f"a matrix would have {rows}x{columns} elements", allowed=f"at most {MOST_ELEMENTS} elements"
        )


def operate(place: Place, budget: Budget, operator: str, left: Value, right: Value) -> Array:
    """``left operator right`` for one of ``+ - * / \\ ^ .* ./ .\\ .^``."""
    a = array_of(place, left, f"what stands left of '{operator}'")
    b = array_of(place, right, f"what stands right of '{operator}'")
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


_ELEMENTWISE = frozenset(("+", "-", ".*", "./", ".\\", ".^"))
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
    if a.shape[0] != a.shape[1] or exponent not in range(65):
        raise place.error(
            f"'^' of {kind_of(a)} and {kind_of(b)}",
            allowed="numbers, or a square matrix with a whole exponent from 0 to 64",
            fix="write .^ for powers element by element",
        )
    budget.spend(place, a.size * (a.shape[0] + 8))
    return reduce(_product, [a] * int(exponent), np.eye(len(a)))


def _product(a: Array, b: Array) -> Array:
    """``a b``, product by product from left to right: the bits of a library differ by processor."""
    total = np.zeros((a.shape[0], b.shape[1]))
    for k in range(a.shape[1]):
        total += a[:, k : k + 1] * b[k]
    return total


def concatenate(place: Place, budget: Budget, rows: list[list[Value]]) -> Value:
    """``[a b; c d]`` of matrices, of texts in one row, or of links."""
    flat = [value for row in rows for value in row]
    if any(isinstance(value, LinkRecord | LinkArray) for value in flat):
        return _join_links(place, flat)
    if flat and all(isinstance(value, str) for value in flat) and len(rows) == 1:
        return "".join(text_of(place, value, "an element") for value in flat)
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
            fix="complete the short row, or put '...' at the end of a line that goes on",
        )
    check_size(place, sum(band.shape[0] for band in bands), widths[0])
    budget.spend(place, sum(band.size for band in bands))
    return np.vstack(bands)


def _join_links(place: Place, values: list[Value]) -> LinkArray:
    links: list[LinkRecord | None] = []
    for value in values:
        match value:
            case LinkRecord():
                links.append(value)
            case LinkArray():
                links += value.links
            case _ if isinstance(value, np.ndarray) and value.size == 0:
                pass  # [[] L1] is how loops without loops start
            case _:
                raise place.error(f"{kind_of(value)} stands among links", allowed="links only")
    if len(links) > MOST_LINKS:
        raise place.error(f"{len(links)} links in one array", allowed=f"at most {MOST_LINKS}")
    return LinkArray(links)


def index_of(place: Place, value: Value, most: int) -> int:
    """A 1-based index as a 0-based one."""
    number = number_of(place, value, "an index")
    if not (1 <= number <= most) or number != int(number):
        raise place.error(
            f"the index {number:g} is not possible here", allowed=f"a whole number from 1 to {most}"
        )
    return int(number) - 1


def part_of(place: Place, array: Array, indices: list[Value]) -> Array:
    """``array(i)`` (columns first, as MATLAB counts) or ``array(i, j)``; an index may be a vector."""
    if len(indices) == 1:
        places = array_of(place, indices[0], "an index")
        flat = array.ravel(order="F")
        chosen = [
            index_of(place, scalar(float(number)), max(flat.size, 1)) for number in places.ravel(order="F")
        ]
        if chosen and flat.size == 0:
            raise place.error("an element of an empty matrix is asked for", allowed="elements that exist")
        picked = flat[chosen] if chosen else np.zeros(0)
        column = array.shape[1] == 1 and array.shape[0] > 1
        return picked.reshape(-1, 1) if column else picked.reshape(1, -1)
    if len(indices) == 2:
        chosen_rows, chosen_columns = (
            [
                index_of(place, scalar(float(number)), max(extent, 1))
                for number in array_of(place, index, "an index").ravel(order="F")
            ]
            for index, extent in zip(indices, array.shape)
        )
        if array.size == 0:
            raise place.error("an element of an empty matrix is asked for", allowed="elements that exist")
        check_size(place, len(chosen_rows), len(chosen_columns))
        return array[np.ix_(chosen_rows, chosen_columns)]
    raise place.error(f"{len(indices)} indices are given", allowed="1 or 2")


def with_element(place: Place, array: Array, indices: list[Value], number: float) -> Array:
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
