"""The toolbox's ``mstraj``: linear segments between via points with quintic blends.

Source: P. Corke, Robotics Toolbox for MATLAB, releases 9 and 10, ``mstraj``; Robotics, Vision and Control,
2017, 3.3.3. As in the toolbox, durations are rounded up to multiples of the sample time.

Where no blend follows a segment, the toolbox ends the segment before its point: at the last sample time of
the given duration, or half of a blend too early. The position then jumps, or the motion ends before the last
point. Here such a segment ends exactly at its point, and its duration is rounded up to a multiple of the
sample time.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armblocks.trajectories.piecewise import PiecewisePolynomial, chained
from armblocks.trajectories.profiles import at_rest, quintic

Array = NDArray[np.float64]


class SegmentMotion(NamedTuple):
    """The motion of ``mstraj``, its number of steps of ``dt``, and when each via point is passed (s)."""

    curve: PiecewisePolynomial
    steps: int
    arrivals: Array


def multi_segment(
    start: Array,
    points: Array,
    dt: float,
    blends: Array,
    *,
    speeds: Array | None,
    durations: Array | None,
    qd0: Array,
    qd1: Array,
) -> SegmentMotion:
    """The motion from ``start`` (n,) past ``points`` (K, n) with blends of the durations (K,), s.

    Either the greatest ``speeds`` (n,) of the joints or the ``durations`` (K,) of the segments are given. The
    motion is continuous and ends at the last point.
    """
    parts: list[PiecewisePolynomial] = []
    q, previous, qd = start, start, qd0
    clock, arrivals = 0, list[float]()
    for k, (point, requested) in enumerate(zip(points, blends)):
        blend, half = _steps(requested, dt), _steps(requested / 2.0, dt)
        first = half if k == 0 else blend
        is_blended = _steps(blends[min(k + 1, len(blends) - 1)], dt) > 0  # the end of this segment
        change = point - previous
        if speeds is not None:
            steps = first + max(_steps(longest, dt) for longest in np.abs(change) / speeds)
            duration = max(steps, 2 * blend, 1) * dt
        else:
            assert durations is not None
            duration = float(durations[k])
            if not is_blended:
                duration = _steps(duration, dt) * dt
        arrivals.append(clock * dt + duration + (half * dt if k else 0.0))
        velocity = change / duration
        if first:
            target = previous + half * dt * velocity
            parts.append(quintic(q, target, first * dt, qd, velocity))
            clock, q = clock + first, target
        blended_ends = 2 if is_blended else 1
        linear = math.floor((duration / dt - blended_ends * half) * (1.0 + 1e-12))
        if linear > 0:
            begin = previous + half * dt * velocity
            parts.append(_linear(begin, velocity, linear * dt))
            clock, q = clock + linear, begin + linear * dt * velocity
        if not is_blended:
            arrivals[-1] = clock * dt
        previous, qd = point, velocity
    half = _steps(blends[-1] / 2.0, dt)
    if half:
        parts.append(quintic(q, previous, half * dt, qd, qd1))
        clock += half
    return SegmentMotion(chained(parts) if parts else at_rest(start), clock, np.array(arrivals))


def _steps(duration: float, dt: float) -> int:
    """The number of steps of a duration, rounded up, with a tolerance for rounding errors of the quotient."""
    return math.ceil(duration / dt * (1.0 - 1e-12))


def _linear(start: Array, velocity: Array, duration: float) -> PiecewisePolynomial:
    coefficients = np.array([start, velocity])[None]
    return PiecewisePolynomial(times=np.array([0.0, duration]), coefficients=coefficients)
