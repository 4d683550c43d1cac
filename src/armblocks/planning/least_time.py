"""The fastest motion along a path: linear constraints with exact viscous friction, and limits between points.

With the path ``q(s)``, its speed ``y = ds/dt``, ``x = y^2`` and ``u = d²s/dt²``, each limited quantity (a
torque or an acceleration) is ``a u + b x + d y + c``. In a segment of the grid ``u`` is constant, so ``u =
(x1 - x0) / (2 h)``. Each limit holds at both ends of each segment, with the values of this segment.

``d y`` is viscous friction. It is linear in the speed and not in ``x``; it is replaced by its tangent at the
speed of the previous solution, and the solutions are repeated until they do not change: Newton's iteration.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from armblocks.planning.passes import Rows, fastest_profile

Array = NDArray[np.float64]

CONVERGED = 1e-7
"""Change of x, relative to its greatest value, below which the iteration has converged."""
EXCESS = 1e-7
"""Excess over a limit in the middle of a segment, relative to the limit, that is accepted."""
MAX_ITERATIONS = 60


@dataclass(frozen=True, kw_only=True)
class Limits:
    """The limited quantities at the start, the middle and the end of N segments: arrays (3, R, N).

    ``-bound <= a u + b x + d y + c <= bound``, with ``bound`` (R, 1). ``lengths`` (N,): the segments h;
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

    @cached_property
    def is_viscous(self) -> bool:
        """Whether a torque depends linearly on the speed."""
        return bool(self.d.any())


@dataclass(frozen=True, kw_only=True)
class Solution:
    """Squared path speeds (N + 1,), or the index of a grid point that the path cannot pass.

    ``excess``: the greatest excess in the middle of a segment, relative to the limits.
    """

    x: Array
    failed: int | None
    excess: float
    iterations: int


def solve(limits: Limits) -> Solution:
    """The fastest squared path speeds from rest to rest; limits also hold in the middle of the segments.

    There the quantities may exceed their limits by terms of second order in h. The limits of these segments
    are reduced by the excess.
    """
    fastest = limits.fastest
    margin = np.zeros_like(limits.a[0])
    guess: Array | None = None
    excess, change, iteration = np.inf, 0.0, 0
    x = fastest
    while iteration < MAX_ITERATIONS:
        iteration += 1
        found = fastest_profile(rows_of(limits, margin, guess), fastest, 0.0, 0.0)
        x = found.x
        if found.failed is not None:
            return Solution(x=x, failed=found.failed, excess=excess, iterations=iteration)
        if limits.is_viscous:
            change = np.inf if guess is None else float(np.abs(x - guess).max() / x.max())
        guess = x
        if change > 1e-3:
            continue
        beyond, factor = excesses(limits, x)
        excess = max(float((beyond / limits.bound).max(initial=-1.0)), float(factor.max()) - 1.0)
        if change <= CONVERGED and excess <= EXCESS:
            break
        margin += 1.01 * np.maximum(beyond, 0.0)
        reduction = np.maximum(factor, 1.0) ** -1.01
        fastest = fastest * np.minimum(np.append(reduction, 1.0), np.append(1.0, reduction))
    return Solution(x=x, failed=None, excess=excess, iterations=iteration)


def excesses(limits: Limits, x: Array) -> tuple[Array, Array]:
    """How far each quantity exceeds its limit in the middle of each segment, (R, N), and by which factor x
    exceeds the speed limits there, (N,)."""
    middle = (x[:-1] + x[1:]) / 2.0
    u = (x[1:] - x[:-1]) / (2.0 * limits.lengths)
    values = limits.a[1] * u + limits.b[1] * middle + limits.c[1]
    if limits.is_viscous:
        values += limits.d[1] * np.sqrt(middle)
    return np.abs(values) - limits.bound, middle / limits.fastest_middle


def rows_of(limits: Limits, margin: Array, x: Array | None) -> Rows:
    """The linear constraints of both ends of each segment, with viscous friction linearised at ``x``.

    Without ``x`` the viscous friction is left out.
    """
    half = limits.a[::2] / (2.0 * limits.lengths)
    here, offset = limits.b[::2], limits.c[::2]
    if x is not None and limits.is_viscous:
        y = np.sqrt(np.maximum(x, 1e-12 * x.max()))
        at_ends = np.stack([y[:-1], y[1:]])[:, None, :]
        here = here + limits.d[::2] / (2.0 * at_ends)
        offset = offset + limits.d[::2] * (at_ends / 2.0)
    alpha, beta = -half, half
    alpha[0] += here[0]
    beta[1] += here[1]
    reduced = limits.bound - margin
    shape = (-1, len(limits.lengths))
    return Rows(*(part.reshape(shape) for part in (alpha, beta, -reduced - offset, reduced - offset)))


def segment_times(x: Array, lengths: Array) -> Array:
    """The duration (N,) of each segment, s."""
    y = np.sqrt(x)
    return 2.0 * lengths / (y[:-1] + y[1:])
