"""The instants of breakpoints, at which sources jump."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from armblocks.integration.frame import SAME_ABOVE, SAME_BELOW

Vector = NDArray[np.float64]


def ends_of_segments(breakpoints: Vector, begin: float, stop: float) -> tuple[Vector, Vector]:
    """The ends of the segments from ``begin`` to ``stop`` (s), and the latest time at which each segment may
    evaluate its derivative.

    Breakpoints within rounding of one another are one instant, at the latest of them. A segment is evaluated
    no later than the last double before the earliest. A breakpoint within rounding of ``stop`` belongs to it.
    """
    inside = sorted({float(time) for time in breakpoints if begin < time <= stop * SAME_ABOVE})
    firsts: list[float] = []
    ends: list[float] = []
    for time in inside:
        if ends and firsts[-1] > time * SAME_BELOW:
            ends[-1] = time
        else:
            firsts.append(time)
            ends.append(time)
    clamps = np.nextafter(firsts, -np.inf).tolist()
    if ends and firsts[-1] > stop * SAME_BELOW:
        ends[-1] = max(ends[-1], stop)
    else:
        ends.append(stop)
        clamps.append(stop)
    return np.array(ends), np.array(clamps)


def evaluation_times(samples: Vector, begin: float, ends: Vector) -> Vector:
    """The times at which the signals of samples are evaluated: a sample just before the end of a segment,
    within rounding, is recorded with the values after this instant."""
    instants = np.concatenate([[begin], ends])
    later = np.minimum(np.searchsorted(instants, samples, side="right"), instants.size - 1)
    earlier = np.maximum(later - 1, 0)
    recorded_there = (instants[earlier] <= samples) & (samples <= instants[earlier] * SAME_ABOVE)
    same = (samples > instants[later] * SAME_BELOW) & (samples < instants[later]) & ~recorded_there
    times: Vector = np.where(same, instants[later], samples)
    return times
