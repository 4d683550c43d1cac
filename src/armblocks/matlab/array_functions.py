"""Functions of whole arrays, arrays of a given size, and rigid motions."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import counted
from armblocks.matlab.function_kinds import (
    ARRAYS,
    GEOMETRY,
    Arithmetic,
    Function,
    MismatchError,
    array_function,
    creation_function,
    dimension_of,
    reduction_function,
)

MAX_ELEMENTS = 100_000
"""Maximum number of elements of an array."""


# Whole arrays.


def _mean(ops: Arithmetic, x: Any) -> Any:
    rows, columns = ops.shape(x)
    return ops.quotient(ops.total(x), ops.constant(np.array([[float(rows if rows != 1 else columns)]])))


def _norm(ops: Arithmetic, x: Any, kind: Any = None) -> Any:
    if kind is None and 1 not in ops.shape(x):
        raise MismatchError("the argument is a matrix, whose norm(A) would be its largest singular value")
    if not (kind is None or (isinstance(kind, str) and kind == "fro")):
        raise MismatchError("the option is not known; allowed is 'fro'")
    return ops.norm(x)


def _vectors(ops: Arithmetic, name: str, count: int | None, *vectors: Any) -> list[list[Any]]:
    vectors_entries = [ops.entries(vector) for vector in vectors]
    sizes = {len(entries) for entries in vectors_entries}
    if (
        any(1 not in ops.shape(vector) for vector in vectors)
        or len(sizes) > 1
        or (count and sizes != {count})
    ):
        expected = f"vectors of {count} numbers" if count else "vectors of equal length"
        raise MismatchError(f"the arguments of {name} are not {expected}")
    return vectors_entries


def _dot(ops: Arithmetic, a: Any, b: Any) -> Any:
    left, right = _vectors(ops, "dot", None, a, b)
    products = [x * y for x, y in zip(left, right)]
    return ops.total(ops.vector_like(products, a)) if products else ops.constant(np.zeros((1, 1)))


def _cross(ops: Arithmetic, a: Any, b: Any) -> Any:
    (a1, a2, a3), (b1, b2, b3) = _vectors(ops, "cross", 3, a, b)
    return ops.vector_like([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1], a)


def _trace(ops: Arithmetic, x: Any) -> Any:
    rows, columns = ops.shape(x)
    if rows != columns:
        raise MismatchError(f"a {rows} x {columns} matrix has no trace")
    return ops.total(ops.diagonal(x)) if rows > 1 else x


def _count(measure: Callable[[int, int], int]) -> Callable[..., Any]:
    def compute(ops: Arithmetic, x: Any) -> Any:
        return ops.constant(np.array([[float(measure(*ops.shape(x)))]]))

    return compute


def _size(ops: Arithmetic, x: Any, dimension: Any = None) -> Any:
    if dimension is None:
        return ops.constant(np.array([[float(extent) for extent in ops.shape(x)]]))
    along = dimension_of(ops, x, dimension)
    return ops.constant(np.array([[float(ops.shape(x)[along - 1])]]))


# Arrays of a given size, from plain numbers.


def number_of_elements(number: float) -> int:
    """The number as a count of elements. Raises :class:`MismatchError` for other numbers."""
    if not (number >= 0 and number == number // 1):
        raise MismatchError(f"{number:g} is not a number of elements")
    if number > MAX_ELEMENTS:
        raise MismatchError(f"an array would have {number:g} elements; at most {MAX_ELEMENTS} are allowed")
    return int(number)


def _extents(sizes: Sequence[Any]) -> tuple[int, int]:
    """``zeros``, ``zeros(n)``, ``zeros(m, n)``, ``zeros([m n])``"""
    numbers = [float(number) for size in sizes for number in np.ravel(size)] or [1.0]
    if len(numbers) > 2:
        raise MismatchError(f"{counted(len(numbers), 'number is', 'numbers are')} given as a size")
    rows, columns = number_of_elements(numbers[0]), number_of_elements(numbers[-1])
    number_of_elements(float(rows * columns))
    return rows, columns


def range_of(first: float, step: float, last: float) -> NDArray[np.float64]:
    """``first:step:last``: the elements are first + k step, none for a step of 0.

    Raises :class:`MismatchError` for numbers that are not finite.
    """
    if step == 0.0:
        return np.zeros((1, 0))
    steps = (last - first) / step
    if not (math.isfinite(step) and math.isfinite(steps)):
        raise MismatchError("the number of steps is not finite")
    # As in MATLAB: a last number within rounding belongs to the range, and the upper half of the elements is
    # counted from the end (MathWorks, "How does the COLON operator work?").
    tolerance = 2.0 * 2.0**-52 * max(abs(first), abs(last))
    direction = math.copysign(1.0, step)
    count = float(round(steps))
    if direction * (first + count * step - last) > tolerance:
        count -= 1.0
    count = float(number_of_elements(max(0.0, count + 1.0))) - 1.0
    end = first + count * step
    end = last if direction * (end - last) > -tolerance else end
    k = np.arange(count + 1.0)
    elements = np.where(2.0 * k <= count, first + k * step, end - (count - k) * step)
    if count > 0.0 and count % 2.0 == 0.0:
        elements[int(count) // 2] = (first + end) / 2.0
    return elements.reshape(1, -1)


def _linspace(first: Any, last: Any, count: Any = 100.0) -> NDArray[np.float64]:
    first, last, count = (float(np.ravel(number)[0]) for number in (first, last, count))
    if count == 1.0:
        return np.array([[last]])
    share = np.arange(number_of_elements(count), dtype=np.float64) / max(1.0, count - 1.0)
    return (first * (1.0 - share) + last * share).reshape(1, -1)


# Rigid motions.


def _translation(ops: Arithmetic, *arguments: Any) -> Any:
    if len(arguments) == 1 and ops.shape(arguments[0]) == (4, 4):
        return ops.from_rows([[entry] for entry in ops.entries(arguments[0])[12:15]])
    entries = [entry for value in arguments for entry in ops.entries(value)]
    if len(arguments) not in (1, 3) or len(entries) != 3:
        raise MismatchError(
            f"{counted(len(arguments), 'argument')} with {counted(len(entries), 'element')} in all: no "
            "translation; "
            "allowed are x, y, z, or [x y z], or a 4x4 pose"
        )
    x, y, z = entries
    return ops.from_rows([[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, y], [0.0, 0.0, 1.0, z], [0.0, 0.0, 0.0, 1.0]])


def _pose(ops: Arithmetic, *arguments: Any) -> Any:
    """``SE3()``, ``SE3(T)``, ``SE3(x, y, z)``, ``SE3([x y z])`` of release 10: a 4x4 matrix here."""
    if not arguments:
        return ops.constant(np.eye(4))
    if len(arguments) == 1 and ops.shape(arguments[0]) == (4, 4):
        return arguments[0]
    return _translation(ops, *arguments)


def _rotation(name: str, axis: int, extent: int) -> Callable[..., Any]:
    """``rotx(angle)`` (extent 3) or ``trotx(angle)`` (extent 4) for the axes 0, 1, 2."""

    def compute(ops: Arithmetic, angle: Any, unit: Any = None) -> Any:
        if ops.shape(angle) != (1, 1):
            raise MismatchError(f"the angle of {name} is not one number")
        if unit is not None:
            if not (isinstance(unit, str) and unit == "deg"):
                raise MismatchError(f"the option of {name} is not known; allowed is 'deg'")
            angle = ops.constant(np.array([[math.pi / 180]])) * angle
        c, s = ops.cosine_sine(angle)
        rows: list[list[Any]] = [[1.0 if i == j else 0.0 for j in range(extent)] for i in range(extent)]
        j, k = (axis + 1) % 3, (axis + 2) % 3
        rows[j][j], rows[j][k], rows[k][j], rows[k][k] = c, 0.0 - s, s, c
        return ops.from_rows(rows)

    return compute


def _rotations() -> Mapping[str, Function]:
    functions: dict[str, Function] = {}
    for prefix, extent, kind in (("rot", 3, "rotation matrix"), ("trot", 4, "pose")):
        for axis, letter in enumerate("xyz"):
            name = f"{prefix}{letter}"
            functions[name] = array_function(
                "angle, 'deg'",
                f"The {extent}x{extent} {kind} of a rotation about {letter}; "
                "the angle in rad, with `'deg'` in degrees.",
                GEOMETRY,
                _rotation(name, axis, extent),
                optional=1,
                takes_text=True,
            )
    return functions


FUNCTIONS_OF_ARRAYS: Mapping[str, Function] = {
    "zeros": creation_function(
        "m, n", "m x n zeros; `zeros(n)` is square.", lambda *n: np.zeros(_extents(n)), optional=2
    ),
    "ones": creation_function(
        "m, n", "m x n ones; `ones(n)` is square.", lambda *n: np.ones(_extents(n)), optional=2
    ),
    "eye": creation_function(
        "m, n", "The identity matrix; `eye(n)` is square.", lambda *n: np.eye(*_extents(n)), optional=2
    ),
    "linspace": creation_function(
        "first, last, n", "n numbers with equal distances; 100 without n.", _linspace, optional=1
    ),
    "sum": reduction_function("The sum of the elements.", ARRAYS, lambda ops, x: ops.total(x), reserved=True),
    "prod": reduction_function(
        "The product of the elements.", ARRAYS, lambda ops, x: ops.fold(lambda a, b: a * b, x)
    ),
    "mean": reduction_function("The mean of the elements.", ARRAYS, _mean),
    "norm": array_function(
        "x, 'fro'",
        "The length of a vector; of a matrix, `norm(A, 'fro')` is the root of the sum of all squares.",
        ARRAYS,
        _norm,
        optional=1,
        takes_text=True,
        reserved=True,
    ),
    "dot": array_function("a, b", "The scalar product of two vectors.", ARRAYS, _dot),
    "cross": array_function("a, b", "The vector product of two vectors with 3 elements.", ARRAYS, _cross),
    "transpose": array_function(
        "A", "The transpose, as `A'`.", ARRAYS, lambda ops, x: ops.transposed_matrix(x), reserved=True
    ),
    "diag": array_function(
        "x",
        "The diagonal of a matrix, or the matrix with this diagonal.",
        ARRAYS,
        lambda ops, x: ops.diagonal(x),
        reserved=True,
    ),
    "inv": array_function(
        "A", "The inverse of a matrix.", ARRAYS, lambda ops, x: ops.inverse(x), reserved=True
    ),
    "trace": array_function("A", "The sum of the diagonal.", ARRAYS, _trace),
    "numel": array_function("x", "The number of elements.", ARRAYS, _count(lambda m, n: m * n)),
    "length": array_function(
        "x",
        "The larger of the numbers of rows and columns.",
        ARRAYS,
        _count(lambda m, n: max(m, n) if m * n else 0),
    ),
    "size": array_function(
        "x, k",
        "The numbers of rows and columns; in formulas a vector counts as a column. `size(A, 1)` is the "
        "number of rows, `size(A, 2)` the number of columns.",
        ARRAYS,
        _size,
        optional=1,
    ),
}
RIGID_MOTIONS: Mapping[str, Function] = {
    "transl": array_function(
        "x, y, z",
        "The 4x4 pose of a translation, also `transl([x y z])`; of a pose, its translation.",
        GEOMETRY,
        _translation,
        optional=2,
    ),
    **_rotations(),
    "SE3": array_function(
        "x, y, z",
        "The 4x4 pose of a translation, also `SE3([x y z])`; `SE3()` is the identity.",
        GEOMETRY,
        _pose,
        optional=3,
    ),
}
