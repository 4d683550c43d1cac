"""The two passes of time-optimal path parameterisation over a grid, as native code.

On each segment of the grid the unknowns are the squared path speeds ``x0`` and ``x1`` at its ends, and all
constraints are linear: ``lower <= alpha x0 + beta x1 <= upper``, ``0 <= x0 <= limit0``. The backward pass
computes for each grid point the interval of squared speeds from which the end can be reached; the forward
pass selects the largest squared speed within these intervals, segment by segment.

Source: H. Pham and Q.-C. Pham, A new approach to time-optimal path parameterization based on reachability
analysis, IEEE Trans. Robotics 2018 (TOPP-RA). There, two-variable linear programs are solved by Seidel's
algorithm. Here ``x1`` is eliminated: the largest ``x0`` is a zero of a concave piecewise linear function,
which Newton's iteration finds in a finite number of steps.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from armblocks.compiler.native import NativeCode, load_code
from armblocks.routines.arithmetic import maximum, minimum, select
from armblocks.routines.llvm import definitions
from armblocks.routines.memory import Reals
from armblocks.routines.routine import Program, Routine
from armblocks.routines.values import Integer, Real

Array = NDArray[np.float64]

MAX_NEWTON = 100
"""Maximum number of Newton steps at one grid point; each step excludes at least one pair of constraints."""

NEGLIGIBLE = 1e-9
"""Ratio of the coefficients of x1 and x0 below which a constraint is treated as a constraint on x0 alone. The
division by smaller coefficients would hide other constraints in rounding errors."""


class Rows(NamedTuple):
    """Constraints of all segments: ``lower <= alpha x0 + beta x1 <= upper``, each array (R, N)."""

    alpha: Array
    beta: Array
    lower: Array
    upper: Array


class Profile(NamedTuple):
    """Squared path speeds (N + 1,) at the grid points, or ``failed``: an infeasible grid point."""

    x: Array
    failed: int | None


class Lines(NamedTuple):
    """The constraints solved for x1: ``bottom + slope x0 <= x1 <= top + slope x0``, each array (R, N), and
    ``least <= x0 <= most`` (N,) from the constraints on x0 alone."""

    slope: Array
    bottom: Array
    top: Array
    least: Array
    most: Array


def lines_of(rows: Rows, limit: Array) -> Lines:
    """The constraints solved for x1, and the bounds of x0, with its ``limit`` (N,)."""
    alone = np.abs(rows.beta) <= NEGLIGIBLE * np.abs(rows.alpha)
    any_alone = bool(alone.any())
    beta = np.where(alone, 1.0, rows.beta) if any_alone else rows.beta
    one, other = rows.lower / beta, rows.upper / beta
    slope = -rows.alpha / beta
    bottom, top = np.minimum(one, other), np.maximum(one, other)
    least, most = np.zeros_like(limit), limit
    if any_alone:
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = np.stack([rows.lower, rows.upper]) / np.where(alone, rows.alpha, 1.0)
        least = np.maximum(least, np.where(alone, ends.min(axis=0), 0.0).max(axis=0))
        most = np.minimum(most, np.where(alone, ends.max(axis=0), np.inf).min(axis=0))
        slope, bottom, top = (
            np.where(alone, value, line) for value, line in ((0.0, slope), (-np.inf, bottom), (np.inf, top))
        )
    return Lines(slope, bottom, top, least, most)


def _gap(
    r: Routine,
    slope: Reals,
    bottom: Reals,
    top: Reals,
    R: Integer,
    x0: Real,
    low: Real,
    high: Real,
) -> tuple[Real, Real]:
    """The length of the interval of x1 for a given x0, and its derivative with respect to x0.

    ``low``, ``high``: the interval of x1 without the constraints.
    """
    above, above_slope = r.real(high), r.real(0.0)
    below, below_slope = r.real(low), r.real(0.0)
    for k in r.range(0, R):
        rise = slope[k]
        shift = rise * x0
        upper, lower = top[k] + shift, bottom[k] + shift
        is_lower, is_higher = upper < above.value, lower > below.value
        above.value, above_slope.value = (
            select(is_lower, upper, above.value),
            select(is_lower, rise, above_slope.value),
        )
        below.value, below_slope.value = (
            select(is_higher, lower, below.value),
            select(is_higher, rise, below_slope.value),
        )
    return above.value - below.value, above_slope.value - below_slope.value


def backward(
    r: Routine,
    slope: Reals,
    bottom: Reals,
    top: Reals,
    least: Reals,
    most: Reals,
    low: Reals,
    high: Reals,
    N: Integer,
    R: Integer,
) -> Integer:
    """Fill the intervals ``low``, ``high`` (N + 1,) of squared speeds; the interval of the last point is
    given.

    Returns -1, or the index of a point whose interval is empty.
    """
    gap = r.program.define(_gap, inlined=False)
    for k in r.range(0, N):
        i = N - 1 - k
        first = i * R
        lines = (slope.after(first), bottom.after(first), top.after(first))
        begin, end = r.real(least[i]), r.real(most[i])
        end_low, end_high = low[i + 1], high[i + 1]
        # Rounding errors of x1, relative to the sizes of both ends, do not make a point infeasible.
        margin = (end_high + end.value) * -1e-13
        for bound, sign in ((end, 1.0), (begin, -1.0)):
            steps = r.integer(0)
            with r.loop() as search:
                length, rise = r.call(gap, *lines, R, bound.value, end_low, end_high)
                search.leave_when(length >= margin)
                steps.value = steps.value + 1
                with r.unless(rise * sign < 0.0):
                    r.return_(i)
                with r.when(steps.value > MAX_NEWTON):
                    r.return_(i)
                step = length / rise
                bound.value = bound.value - step
                # Where x1 has almost no effect, the length of the interval has large rounding errors, but its
                # zero is accurate.
                search.leave_when(abs(step) <= abs(bound.value) * 1e-13)
        with r.when(end.value < begin.value):
            with r.when(begin.value - end.value > 1e-12 * begin.value):
                r.return_(i)
            end.value = begin.value
        low[i], high[i] = begin.value, end.value
    return r.constant_integer(-1)


def forward(
    r: Routine, slope: Reals, top: Reals, low: Reals, high: Reals, x: Reals, N: Integer, R: Integer
) -> None:
    """Fill ``x`` (N + 1,) from the given first element on: the largest reachable squared speeds."""
    for i in r.range(0, N):
        x0, first = x[i], i * R
        most = r.real(high[i + 1])
        for j in r.range(0, R):
            k = first + j
            most.value = minimum(top[k] + slope[k] * x0, most.value)
        x[i + 1] = maximum(most.value, low[i + 1])


def fastest_profile(rows: Rows, limit: Array, start: float, end: float) -> Profile:
    """The largest squared path speeds ``x`` from ``start`` to ``end`` under the constraints.

    ``limit`` (N + 1,): bounds of x from limits of the speeds alone.
    """
    R, N = rows.alpha.shape
    lines = [np.ascontiguousarray(part.T, dtype=np.float64) for part in lines_of(rows, limit[:-1])]
    low, high, x = np.zeros(N + 1), np.zeros(N + 1), np.zeros(N + 1)
    low[-1] = high[-1] = end
    slope, bottom, top, least, most = (part.ctypes.data for part in lines)
    back, forth = _functions()
    intervals = low.ctypes.data, high.ctypes.data
    failed = int(back(slope, bottom, top, least, most, *intervals, N, R))
    if failed < 0 and not low[0] * (1.0 - 1e-9) - 1e-300 <= start <= high[0] * (1.0 + 1e-9):
        failed = 0
    if failed >= 0:
        return Profile(x, failed)
    x[0] = start
    forth(slope, top, *intervals, x.ctypes.data, N, R)
    return Profile(x, None)


@cache
def _code() -> NativeCode:
    program = Program()
    program.define(backward, public=True, distinct=True)
    program.define(forward, public=True, distinct=True)
    return loaded(program)


@cache
def _functions() -> tuple[Callable[..., int], Callable[..., None]]:
    code = _code()
    array, sizes = ctypes.c_void_p, [ctypes.c_int64] * 2
    result: list[Any] = [
        ctypes.CFUNCTYPE(ctypes.c_int64, *[array] * 7, *sizes)(code.address("backward")),
        ctypes.CFUNCTYPE(None, *[array] * 5, *sizes)(code.address("forward")),
    ]
    return result[0], result[1]


def loaded(program: Program) -> NativeCode:
    """The machine code of a program."""
    parts = definitions(program)
    return load_code(("least time", *parts.values()), lambda: "\n\n".join(parts.values()))
