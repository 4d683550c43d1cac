"""Conversion between symbolic quantities of natural shape and flat columns in :class:`Signature` layout."""

from __future__ import annotations

import math

from casadi import SX, densify, reshape

from armblocks.equations.signatures import Shape
from armblocks.errors import InputError


def flatten(value: SX, shape: Shape) -> SX:
    """Flatten a symbolic scalar, vector (column) or matrix into a column, row-major.

    A stack ``(k, m, n)`` is given as the ``(k m, n)`` matrix of its vertically stacked members.
    """
    rows, columns = matrix_shape(shape)
    if value.shape != (rows, columns):
        raise InputError(
            f"symbolic value has shape {value.shape}",
            allowed=f"{(rows, columns)} for {shape}",
            where="symbols",
            fix="return a value of the declared shape",
        )
    return reshape(densify(value).T, rows * columns, 1)


def unflatten(flat: SX, shape: Shape) -> SX:
    """Inverse of :func:`flatten`: a flat column as scalar, column vector or matrix."""
    rows, columns = matrix_shape(shape)
    return reshape(flat, columns, rows).T


def matrix_shape(shape: Shape) -> tuple[int, int]:
    """Rows and columns of the CasADi matrix for a quantity of this shape."""
    if len(shape) == 0:
        return 1, 1
    if len(shape) == 1:
        return shape[0], 1
    return math.prod(shape[:-1]), shape[-1]
