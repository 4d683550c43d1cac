"""Time-optimal motion along a path: linear constraints, viscous friction, and limits between grid points.

With the path ``q(s)``, its speed ``y = ds/dt``, ``x = y^2`` and ``u = d²s/dt²``, each limited quantity (a
torque or an acceleration) is ``a u + b x + d y + c``. In a segment of the grid ``u`` is constant, so ``u =
(x1 - x0) / (2 h)``. Each limit holds at both ends of each segment, with the values of this segment.

``d y`` is viscous friction. It is linear in the speed and not in ``x``. Newton's iteration replaces it by its
tangent at the speed of the previous solution until the solution does not change. Where no motion is feasible
with this tangent, the iteration continues at half the speed.

In the middle of a segment the quantities may exceed their limits by terms of second order in h. The limits of
such a segment are reduced by the excess, and the solution is repeated. All iterations are native code.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armblocks.compiler.native import NativeCode
from armblocks.planning.passes import NEGLIGIBLE, backward, forward, loaded
from armblocks.routines.arithmetic import maximum, minimum, select, square_root
from armblocks.routines.memory import Reals
from armblocks.routines.routine import Program, Routine
from armblocks.routines.values import Integer, Real

Array = NDArray[np.float64]

CONVERGED = 1e-7
"""Change of x, relative to its greatest value, below which the iteration has converged."""
NEAR = 1e-3
"""Change of x below which the limits in the middle of the segments are checked."""
EXCESS = 1e-6
"""Excess over a limit in the middle of a segment, relative to the limit, that is accepted."""
MAX_ITERATIONS = 60


@dataclass(frozen=True, kw_only=True)
class Limits:
    """The limited quantities at the start, the middle and the end of N segments: arrays (3, N, R).

    ``-bound <= a u + b x + d y + c <= bound``, with ``bound`` (R,). ``lengths`` (N,): the segments h;
    ``fastest`` (N + 1,) and ``fastest_middle`` (N,): bounds of x from speed limits.
    """

    lengths: Array
    fastest: Array
    fastest_middle: Array
    a: Array
    b: Array
    c: Array
    d: Array
    bound: Array


@dataclass(frozen=True, kw_only=True)
class Solution:
    """Squared path speeds (N + 1,), or the index of an infeasible grid point.

    ``excess``: the greatest excess in the middle of a segment, relative to the limits.
    """

    x: Array
    failed: int | None
    excess: float
    iterations: int


def solve(limits: Limits, margin: Array | None = None) -> Solution:
    """The fastest squared path speeds from rest to rest; limits also hold in the middle of the segments.

    ``margin`` (N, R): the reductions of the limits of each segment, which are increased in place.
    """
    _, N, R = np.shape(limits.a)
    inputs = [
        np.ascontiguousarray(part, dtype=np.float64)
        for part in (limits.a, limits.b, limits.c, limits.d, limits.bound, limits.lengths)
    ]
    inputs += [np.array(limits.fastest), np.ascontiguousarray(limits.fastest_middle)]
    margin = np.zeros((N, R)) if margin is None else margin
    x, result = np.zeros(N + 1), np.array([np.inf, 0.0, 0.0, 0.0])
    work = np.zeros(6 * N * R + 5 * (N + 1))
    pointers = [part.ctypes.data for part in (*inputs, x, result, margin, work)]
    failed = int(_function()(*pointers, N, R, int(limits.d.any())))
    return Solution(
        x=x, failed=failed if failed >= 0 else None, excess=float(result[0]), iterations=int(result[1])
    )


def segment_times(x: Array, lengths: Array) -> Array:
    """The duration (N,) of each segment, s."""
    y = np.sqrt(x)
    return 2.0 * lengths / (y[:-1] + y[1:])


def _line(
    r: Routine,
    alpha: Real,
    beta: Real,
    lower: Real,
    upper: Real,
    slope: Reals,
    bottom: Reals,
    top: Reals,
    bounds: Reals,
    k: Integer,
) -> None:
    """Solve the constraint ``lower <= alpha x0 + beta x1 <= upper`` for x1, into element ``k`` of the lines.

    A constraint without x1 changes the two ``bounds`` of x0.
    """  # fmt: skip
    with r.when(abs(beta) <= abs(alpha) * NEGLIGIBLE):
        slope[k], bottom[k], top[k] = 0.0, -np.inf, np.inf
        with r.unless(alpha == 0.0):
            one, other = lower / alpha, upper / alpha
            bounds[0] = maximum(minimum(one, other), bounds[0])
            bounds[1] = minimum(maximum(one, other), bounds[1])
    with r.unless(abs(beta) <= abs(alpha) * NEGLIGIBLE):
        one, other = lower / beta, upper / beta
        slope[k], bottom[k], top[k] = -(alpha / beta), minimum(one, other), maximum(one, other)


def _fill_lines(
    r: Routine,
    a: Reals,
    b: Reals,
    c: Reals,
    d: Reals,
    bound: Reals,
    lengths: Reals,
    limit: Reals,
    guess: Reals,
    margin: Reals,
    slope: Reals,
    bottom: Reals,
    top: Reals,
    least: Reals,
    most: Reals,
    bounds: Reals,
    N: Integer,
    R: Integer,
    linearised: Integer,
) -> None:
    """The constraints at both ends of each segment as lines, with viscous friction linearised at ``guess``.

    ``linearised`` is 0 for the first solution, without viscous friction.
    """  # fmt: skip
    line = r.program.define(_line, inlined=True)
    fastest = r.real(0.0)
    for i in r.range(0, N + 1):
        fastest.value = maximum(guess[i], fastest.value)
    floor = maximum(fastest.value * 1e-12, 1e-300)
    last = N * R * 2
    for i in r.range(0, N):
        bounds[0], bounds[1] = r.constant(0.0), limit[i]
        half = 0.5 / lengths[i]
        y0, y1 = (square_root(maximum(guess[i + k], floor)) for k in (0, 1))
        for j in r.range(0, R):
            k = i * R + j
            for end, y, place in ((0, y0, 0), (1, y1, R)):
                at = k + last if end else k
                rise = a[at] * half
                here, offset = r.real(b[at]), r.real(c[at])
                with r.when(linearised > 0):
                    here.value = here.value + d[at] / (2.0 * y)
                    offset.value = offset.value + d[at] * (y * 0.5)
                alpha = -rise if end else here.value - rise
                beta = rise + here.value if end else rise
                reduced = bound[j] - margin[k]
                r.call(
                    line, alpha, beta, -reduced - offset.value, reduced - offset.value,
                    slope, bottom, top, bounds, 2 * i * R + j + place,
                )  # fmt: skip
        least[i], most[i] = bounds[0], bounds[1]


def _reduce_limits(
    r: Routine,
    a: Reals,
    b: Reals,
    c: Reals,
    d: Reals,
    bound: Reals,
    lengths: Reals,
    limit: Reals,
    fastest_middle: Reals,
    x: Reals,
    margin: Reals,
    N: Integer,
    R: Integer,
) -> Real:
    """Reduce the limits of segments in whose middle they are exceeded.

    Returns the greatest excess, relative to the limits.
    """  # fmt: skip
    excess = r.real(-1.0)
    for i in r.range(0, N):
        x0, x1 = x[i], x[i + 1]
        middle, u = (x0 + x1) * 0.5, (x1 - x0) * (0.5 / lengths[i])
        y = square_root(middle)
        for j in r.range(0, R):
            k = (N + i) * R + j
            value = abs(a[k] * u + b[k] * middle + c[k] + d[k] * y)
            beyond = value - bound[j]
            excess.value = maximum(beyond / bound[j], excess.value)
            with r.when(beyond > 0.0):
                own = i * R + j
                margin[own] = margin[own] + beyond * 1.01
        factor = middle / fastest_middle[i]
        excess.value = maximum(factor - 1.0, excess.value)
        with r.when(factor > 1.0):
            reduction = 1.0 / (factor * (factor * 0.01 + 0.99))
            limit[i], limit[i + 1] = limit[i] * reduction, limit[i + 1] * reduction
    return excess.value


def _solve(
    r: Routine,
    a: Reals,
    b: Reals,
    c: Reals,
    d: Reals,
    bound: Reals,
    lengths: Reals,
    limit: Reals,
    fastest_middle: Reals,
    x: Reals,
    result: Reals,
    margin: Reals,
    work: Reals,
    N: Integer,
    R: Integer,
    viscous: Integer,
) -> Integer:
    """Fill ``x`` and ``result``: greatest excess, number of iterations, two numbers of working memory.

    Returns -1, or the index of an infeasible point.
    """  # fmt: skip
    fill, reduce = r.program.define(_fill_lines), r.program.define(_reduce_limits)
    back, forth = r.program.define(backward), r.program.define(forward)
    size, points = N * R, N + 1
    slope = work
    bottom, top = slope.after(2 * size), slope.after(4 * size)
    least = slope.after(6 * size)
    most, low, high, guess = (least.after(points * k) for k in range(1, 5))
    problem = (a, b, c, d, bound, lengths, limit)
    iteration = r.integer(0)
    with r.loop() as search:
        count = iteration.value
        iteration.value = count + 1
        result[1] = result[1] + 1.0
        linearised = select(count > 0, viscous, 0)
        bounds = result.after(2)
        r.call(fill, *problem, guess, margin, slope, bottom, top, least, most, bounds, N, R, linearised)
        low[N], high[N] = r.constant(0.0), r.constant(0.0)
        failed = r.call(back, slope, bottom, top, least, most, low, high, N, 2 * R)
        failed = select(failed >= 0, failed, select(low[0] > 0.0, r.constant_integer(0), failed))
        with r.when(failed >= 0):
            # The tangent at a fast guess overestimates the friction of slow motions.
            is_final = (linearised == 0) | (iteration.value >= MAX_ITERATIONS)
            with r.when(is_final):
                r.return_(failed)
            for i in r.range(0, points):
                guess[i] = guess[i] * 0.25
            search.again()
        x[0] = r.constant(0.0)
        r.call(forth, slope, top, low, high, x, N, 2 * R)
        change, fastest = r.real(0.0), r.real(0.0)
        for i in r.range(0, points):
            change.value = maximum(abs(x[i] - guess[i]), change.value)
            fastest.value = maximum(x[i], fastest.value)
            guess[i] = x[i]
        with r.when(viscous == 0):
            change.value = r.constant(0.0)
        search.leave_when(iteration.value >= MAX_ITERATIONS)
        with r.when(change.value <= fastest.value * NEAR):
            excess = r.call(reduce, *problem, fastest_middle, x, margin, N, R)
            result[0] = excess
            with r.when(excess <= EXCESS):
                search.leave_when(change.value <= fastest.value * CONVERGED)
    return r.constant_integer(-1)


@cache
def _code() -> NativeCode:
    program = Program()
    program.define(_solve, "solve", public=True)
    return loaded(program)


@cache
def _function() -> Callable[..., int]:
    code = _code()
    kinds = [*[ctypes.c_void_p] * 12, *[ctypes.c_int64] * 3]
    function: Any = ctypes.CFUNCTYPE(ctypes.c_int64, *kinds)(code.address("solve"))
    return function
