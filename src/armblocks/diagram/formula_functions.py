"""Constants and functions of formulas, by name. A new one is one line here."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial

import casadi
import numpy as np
from casadi import SX, if_else
from numpy.typing import NDArray

from armblocks.equations import elementary

MOST_ELEMENTS = 100_000
"""Maximum number of elements of an array that a function creates."""


def _elementary(name: str) -> Callable[..., SX]:
    return partial(elementary, name)


def _where(condition: SX, yes: SX, no: SX) -> SX:
    return if_else(condition != 0.0, yes, no)


def _radians(degrees: SX) -> SX:
    return degrees * (math.pi / 180.0)


def _degrees(radians: SX) -> SX:
    return radians * (180.0 / math.pi)


def _inverse(value: SX) -> SX:
    if value.shape[0] != value.shape[1]:
        raise ValueError(f"a {value.shape[0]} x {value.shape[1]} matrix has no inverse")
    return casadi.inv(value)


CONSTANTS: Mapping[str, float] = {
    "pi": math.pi,
    "e": math.e,
    "deg": math.pi / 180.0,
    "rad": 1.0,
    "inf": math.inf,
    "Inf": math.inf,
}

FUNCTIONS: Mapping[str, tuple[int, Callable[..., SX]]] = {
    **{
        name: (1, _elementary(name))
        for name in (
            *("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh"),
            *("exp", "expm1", "log", "log10", "log1p", "erf"),
        )
    },
    **{name: (1, getattr(casadi, name)) for name in ("sqrt", "floor", "ceil", "sign")},
    "abs": (1, casadi.fabs),
    "ln": (1, _elementary("log")),
    "atan2": (2, _elementary("atan2")),
    "hypot": (2, _elementary("hypot")),
    "min": (2, casadi.fmin),
    "max": (2, casadi.fmax),
    "power": (2, _elementary("power")),
    "pow": (2, _elementary("power")),
    "rem": (2, casadi.fmod),
    "deg2rad": (1, _radians),
    "rad2deg": (1, _degrees),
    "if": (3, _where),
}
"""Elementwise functions by name: number of arguments, and implementation."""

MATRIX_FUNCTIONS: Mapping[str, Callable[[SX], SX]] = {
    "transpose": casadi.transpose,
    "diag": casadi.diag,
    "inv": _inverse,
    "sum": casadi.sum1,
    "norm": casadi.norm_fro,
}
"""Functions of one vector or matrix as a whole."""


def _count(number: float) -> int:
    if not (number >= 0 and number == int(number) and number <= MOST_ELEMENTS):
        raise ValueError(f"{number:g} is not a number of elements")
    return int(number)


def _filled(value: float, rows: float, columns: float | None) -> NDArray[np.float64]:
    both = (_count(rows), _count(rows if columns is None else columns))
    _count(float(both[0] * both[1]))
    return np.full(both, value)


def _identity(n: float) -> NDArray[np.float64]:
    size = _count(n)
    _count(n * n)
    return np.eye(size)


def range_of(first: float, step: float, last: float | None = None) -> NDArray[np.float64]:
    """``first:last`` with steps of 1, or ``first:step:last``: the elements are first + k step."""
    if last is None:
        step, last = 1.0, step
    if step == 0 or not math.isfinite(last - first):
        raise ValueError("the steps do not lead from the first to the last number")
    # The number of steps that fit, with a tolerance for rounding.
    count = _count(max(0.0, math.floor((last - first) / step * (1 + 4e-16) + 1e-10) + 1.0))
    return first + step * np.arange(count, dtype=np.float64)


def _zeros(rows: float, columns: float | None = None) -> NDArray[np.float64]:
    return _filled(0.0, rows, columns)


def _ones(rows: float, columns: float | None = None) -> NDArray[np.float64]:
    return _filled(1.0, rows, columns)


def _linspace(first: float, last: float, count: float) -> NDArray[np.float64]:
    share = np.arange(_count(count), dtype=np.float64) / max(1.0, count - 1.0)
    return first * (1.0 - share) + last * share


MAKERS: Mapping[str, Callable[..., NDArray[np.float64]]] = {
    "eye": _identity,
    "zeros": _zeros,
    "ones": _ones,
    "linspace": _linspace,
}
"""Functions whose arguments give the size of the created array."""
