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
"""Ratio of the coefficients of x1 and x0 below which a constraint is one of x0 alone. The division by smaller
coefficients would hide other constraints in rounding errors."""


class Rows(NamedTuple):
    """Constraints of all segments: ``lower <= alpha x0 + beta x1 <= upper``, each array (R, N)."""

    alpha: Array
    beta: Array
    lower: Array
    upper: Array


class Profile(NamedTuple):
    """Squared path speeds (N + 1,) at the grid points, or ``failed``: a grid point that admits no speed."""

    x: Array
    failed: int | None


def _gap(
    r: Routine,
    alpha: Reals,
    beta: Reals,
    lower: Reals,
    upper: Reals,
    N: Integer,
    R: Integer,
    x0: Real,
    low: Real,
    high: Real,
) -> tuple[Real, Real]:
    """The length of the interval of x1 for a given x0, and its derivative with respect to x0.

    ``low``, ``high``: the interval of x1 without the constraints.
    """
    top, top_slope = r.real(high), r.real(0.0)
    bottom, bottom_slope = r.real(low), r.real(0.0)
    for j in r.range(0, R):
        k = j * N
        b = beta[k]
        with r.unless(b == 0.0):
            slope = -(alpha[k] / b)
            one, other = (upper[k] - alpha[k] * x0) / b, (lower[k] - alpha[k] * x0) / b
            above, below = select(b > 0.0, one, other), select(b > 0.0, other, one)
            with r.when(above < top.value):
                top.value, top_slope.value = above, slope
            with r.when(below > bottom.value):
                bottom.value, bottom_slope.value = below, slope
    return top.value - bottom.value, top_slope.value - bottom_slope.value


def backward(
    r: Routine,
    alpha: Reals,
    beta: Reals,
    lower: Reals,
    upper: Reals,
    limit: Reals,
    low: Reals,
    high: Reals,
    N: Integer,
    R: Integer,
) -> Integer:
    """Fill the intervals ``low``, ``high`` (N + 1,) of squared speeds; those of the last point are given.

    Returns -1, or the index of a point whose interval is empty.
    """
    gap = r.program.define(_gap, inlined=False)
    for k in r.range(0, N):
        i = N - 1 - k
        rows = (alpha.after(i), beta.after(i), lower.after(i), upper.after(i))
        least, most = r.real(0.0), r.real(limit[i])
        for j in r.range(0, R):  # constraints of x0 alone
            a = rows[0][j * N]
            with r.when(rows[1][j * N] == 0.0):
                one, other = rows[3][j * N] / a, rows[2][j * N] / a
                with r.when(a > 0.0):
                    most.value, least.value = minimum(most.value, one), maximum(least.value, other)
                with r.when(a < 0.0):
                    most.value, least.value = minimum(most.value, other), maximum(least.value, one)
        end_low, end_high = low[i + 1], high[i + 1]
        # Rounding errors of x1, relative to the sizes of both ends, do not make a point infeasible.
        margin = (end_high + most.value) * -1e-13
        for bound, sign in ((most, 1.0), (least, -1.0)):
            steps = r.integer(0)
            with r.loop() as search:
                length, slope = r.call(gap, *rows, N, R, bound.value, end_low, end_high)
                search.leave_when(length >= margin)
                steps.value = steps.value + 1
                with r.unless(slope * sign < 0.0):
                    r.return_(i)
                with r.when(steps.value > MAX_NEWTON):
                    r.return_(i)
                step = length / slope
                bound.value = bound.value - step
                # Where x1 has almost no effect, the gap has large rounding errors, but not its zero.
                search.leave_when(abs(step) <= abs(bound.value) * 1e-13)
        with r.when(most.value < least.value):
            with r.when(least.value - most.value > 1e-12 * least.value):
                r.return_(i)
            most.value = least.value
        low[i], high[i] = least.value, most.value
    return r.constant_integer(-1)


def forward(
    r: Routine,
    alpha: Reals,
    beta: Reals,
    lower: Reals,
    upper: Reals,
    low: Reals,
    high: Reals,
    x: Reals,
    N: Integer,
    R: Integer,
) -> None:
    """Fill ``x`` (N + 1,) from the given first element on: the largest reachable squared speeds."""
    for i in r.range(0, N):
        x0 = x[i]
        most = r.real(high[i + 1])
        for j in r.range(0, R):
            k = j * N + i
            a, b = alpha[k], beta[k]
            with r.when(b > 0.0):
                most.value = minimum(most.value, (upper[k] - a * x0) / b)
            with r.when(b < 0.0):
                most.value = minimum(most.value, (lower[k] - a * x0) / b)
        x[i + 1] = maximum(most.value, low[i + 1])


def fastest_profile(rows: Rows, limit: Array, start: float, end: float) -> Profile:
    """The largest squared path speeds ``x`` from ``start`` to ``end`` under the constraints.

    ``limit`` (N + 1,): bounds of x from limits of the speeds alone.
    """
    R, N = rows.alpha.shape
    data = [np.ascontiguousarray(part, dtype=np.float64) for part in rows]
    data[1] = np.where(np.abs(data[1]) <= NEGLIGIBLE * np.abs(data[0]), 0.0, data[1])
    limit = np.ascontiguousarray(limit, dtype=np.float64)
    low, high, x = np.zeros(N + 1), np.zeros(N + 1), np.zeros(N + 1)
    low[-1] = high[-1] = end
    pointers = [part.ctypes.data for part in data]
    back, forth = _functions()
    failed = int(back(*pointers, limit.ctypes.data, low.ctypes.data, high.ctypes.data, N, R))
    if failed < 0 and not low[0] * (1.0 - 1e-9) - 1e-300 <= start <= high[0] * (1.0 + 1e-9):
        failed = 0
    if failed >= 0:
        return Profile(x, failed)
    x[0] = start
    forth(*pointers, low.ctypes.data, high.ctypes.data, x.ctypes.data, N, R)
    return Profile(x, None)


@cache
def _code() -> NativeCode:
    program = Program()
    program.define(backward, public=True, distinct=True)
    program.define(forward, public=True, distinct=True)
    parts = definitions(program)
    return load_code(("least time", *parts.values()), lambda: "\n\n".join(parts.values()))


@cache
def _functions() -> tuple[Callable[..., int], Callable[..., None]]:
    code = _code()
    arrays = [ctypes.c_void_p] * 7
    sizes = [ctypes.c_int64] * 2
    result: list[Any] = [
        ctypes.CFUNCTYPE(ctypes.c_int64, *arrays, *sizes)(code.address("backward")),
        ctypes.CFUNCTYPE(None, *arrays, *sizes)(code.address("forward")),
    ]
    return result[0], result[1]
