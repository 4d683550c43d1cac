"""Kinds of functions of the language, and the arithmetic in which they are written."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

CONSTANTS, TRIGONOMETRY, POWERS = "Constants", "Angles and hyperbolic functions", "Powers and logarithms"
ROUNDING, CHOICE, ARRAYS, GEOMETRY = "Rounding and signs", "Comparison and logic", "Arrays", "Rigid motions"


class MismatchError(Exception):
    """Arguments that a function does not accept. The caller adds the location."""


class Arithmetic(Protocol):
    """The operations that implement the functions of the table, in addition to ``+ - * < == …`` of arrays.

    ``Any`` is an array of numbers or of symbols. All operations act element by element, except the operations
    on whole arrays, which are listed last.
    """

    @property
    def has_orientation(self) -> bool:
        """Whether a row differs from a column, as in MATLAB."""
        ...

    def elementary(self, name: str, *values: Any) -> Any:
        """A function of :mod:`armblocks.rounded_functions`."""
        ...

    def sqrt(self, value: Any) -> Any:
        """Square root."""
        ...

    def floor(self, value: Any) -> Any:
        """Round down."""
        ...

    def ceil(self, value: Any) -> Any:
        """Round up."""
        ...

    def sign(self, value: Any) -> Any:
        """The sign: -1, 0 or 1."""
        ...

    def absolute(self, value: Any) -> Any:
        """Absolute value."""
        ...

    def minimum(self, left: Any, right: Any) -> Any:
        """The smaller value; NaN only if both are NaN."""
        ...

    def maximum(self, left: Any, right: Any) -> Any:
        """The larger value; NaN only if both are NaN."""
        ...

    def quotient(self, left: Any, right: Any) -> Any:
        """The elementwise quotient ``left ./ right``."""
        ...

    def remainder(self, left: Any, right: Any) -> Any:
        """The exact remainder with the sign of the dividend."""
        ...

    def where(self, condition: Any, yes: Any, no: Any) -> Any:
        """``yes`` where the condition is not 0, else ``no``."""
        ...

    def logical_and(self, left: Any, right: Any) -> Any:
        """1 where both are not 0, else 0."""
        ...

    def logical_or(self, left: Any, right: Any) -> Any:
        """1 where one is not 0, else 0."""
        ...

    def constant(self, array: NDArray[np.float64]) -> Any:
        """The value of an array of numbers."""
        ...

    def shape(self, value: Any) -> tuple[int, int]:
        """Rows and columns."""
        ...

    def fold(self, combine: Callable[[Any, Any], Any], value: Any) -> Any:
        """The elements of a vector, or of each column of a matrix, combined from first to last."""
        ...

    def total(self, value: Any) -> Any:
        """The sum of a vector, or the sums of the columns of a matrix."""
        ...

    def norm(self, value: Any) -> Any:
        """The square root of the sum of the squares of all elements."""
        ...

    def entries(self, value: Any) -> list[Any]:
        """The elements, column by column."""
        ...

    def vector_like(self, entries: Sequence[Any], model: Any) -> Any:
        """A vector of these elements, with the orientation of ``model``."""
        ...

    def constant_number(self, value: Any) -> float:
        """A constant number; NaN for anything else."""
        ...

    def from_rows(self, rows: Sequence[Sequence[Any]]) -> Any:
        """The matrix with these rows of elements."""
        ...

    def transposed_matrix(self, value: Any) -> Any:
        """The transpose."""
        ...

    def diagonal(self, value: Any) -> Any:
        """The diagonal of a matrix, or the matrix with this diagonal."""
        ...

    def inverse(self, value: Any) -> Any:
        """The inverse of a square matrix."""
        ...

    def cosine_sine(self, angle: Any) -> tuple[Any, Any]:
        """Cosine and sine of a number, exact at multiples of pi/2 if it is constant."""
        ...


Compute = (
    Callable[[Arithmetic, Any], Any]
    | Callable[[Arithmetic, Any, Any], Any]
    | Callable[[Arithmetic, Any, Any, Any], Any]
)
"""The implementation of a function of one to three arguments."""


@dataclass(frozen=True, kw_only=True)
class Function:
    """A function of ``min_arguments`` to ``max_arguments`` values, or a constant (none)."""

    arguments: str
    """The arguments in the documentation, ``x, y``."""
    meaning: str
    group: str
    min_arguments: int
    max_arguments: int
    compute: Callable[..., Any]
    """From :class:`Arithmetic` and the arguments; with ``creates_array``, from plain numbers to an array."""
    elementwise: bool = False
    """Whether the arguments are combined element by element."""
    creates_array: bool = False
    """Whether the arguments are the size of the result; they must be constant."""
    real_from: float = -math.inf
    real_to: float = math.inf
    """The interval of arguments with real values. Scripts raise an error outside; formulas give NaN."""
    reserved: bool = False
    """Whether no parameter may have this name. Parameters hide the other functions, as in MATLAB."""
    elementary: bool = False
    """Whether numbers are computed by integer arithmetic, which is much slower than a sum."""
    takes_text: bool = False
    """Whether the optional argument is text in quotes."""
    reduction: Function | None = None
    """The function of ``(x, k)`` that a call with ``(x, [], k)`` selects."""

    def may_be_text(self, position: int) -> bool:
        """Whether the argument at a position, counted from 0, may be text."""
        return self.takes_text and position >= self.min_arguments


def constant(value: float, meaning: str, *, reserved: bool = False) -> Function:
    """A named constant."""

    def compute(ops: Arithmetic) -> Any:
        return ops.constant(np.array([[value]]))

    return Function(
        arguments="",
        meaning=meaning,
        group=CONSTANTS,
        min_arguments=0,
        max_arguments=0,
        compute=compute,
        reserved=reserved,
    )


def rounded_function(
    name: str, meaning: str, group: str, real_from: float = -math.inf, real_to: float = math.inf
) -> Function:
    """A function of one argument of :mod:`armblocks.rounded_functions`."""
    return elementwise_function(
        "x",
        meaning,
        group,
        lambda ops, x: ops.elementary(name, x),
        real_from=real_from,
        real_to=real_to,
        reserved=True,
        elementary=True,
    )


def elementwise_function(
    arguments: str, meaning: str, group: str, compute: Compute, **options: Any
) -> Function:
    """A function of these arguments, element by element."""
    return array_function(arguments, meaning, group, compute, elementwise=True, **options)


def array_function(
    arguments: str, meaning: str, group: str, compute: Compute, *, optional: int = 0, **options: Any
) -> Function:
    """A function of whole arrays; the last ``optional`` arguments may be missing."""
    count = arguments.count(",") + 1
    return Function(
        arguments=arguments,
        meaning=meaning,
        group=group,
        min_arguments=count - optional,
        max_arguments=count,
        compute=compute,
        **options,
    )


def reduction_function(
    meaning: str, group: str, compute: Callable[[Arithmetic, Any], Any], **options: Any
) -> Function:
    """A function that reduces a vector to a number, and a matrix by column or along a dimension."""

    def reduced(ops: Arithmetic, x: Any, dimension: Any = None) -> Any:
        if dimension is None:
            return compute(ops, x)
        along, shape = dimension_of(ops, x, dimension), ops.shape(x)
        # Arrays of numbers only: reduce each element separately.
        if shape[along - 1] == 1 and shape != (1, 1):
            return np.array([compute(ops, np.array([[entry]])) for entry in ops.entries(x)]).reshape(shape)
        return (
            compute(ops, x) if along == 1 else ops.transposed_matrix(compute(ops, ops.transposed_matrix(x)))
        )

    reduction_meaning = f"{meaning[:-1]}; of a matrix by column, with `(A, 2)` by row."
    return array_function("x, k", reduction_meaning, group, reduced, optional=1, **options)


def dimension_of(ops: Arithmetic, x: Any, dimension: Any) -> int:
    """The dimension: 1 for the rows, 2 for the columns. Raises :class:`MismatchError` for other values."""
    number = ops.constant_number(dimension)
    if number not in (1.0, 2.0):
        raise MismatchError("the dimension is not 1 or 2")
    if not ops.has_orientation and 1 in ops.shape(x) and ops.shape(x) != (1, 1):
        raise MismatchError("a vector of a formula is neither row nor column: omit the dimension")
    return int(number)


def creation_function(
    arguments: str, meaning: str, compute: Callable[..., NDArray[np.float64]], *, optional: int = 0
) -> Function:
    """An array of a given size, from plain numbers."""
    return array_function(
        arguments, meaning, ARRAYS, compute, optional=optional, creates_array=True, reserved=True
    )
