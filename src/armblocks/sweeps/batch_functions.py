"""Functions that the native loop over runs calls."""

from __future__ import annotations

from armblocks.routines.memory import Reals
from armblocks.routines.routine import Routine
from armblocks.routines.values import Boolean, Integer


def signals(
    r: Routine,
    start: Integer,
    stop: Integer,
    columns: Integer,
    t: Reals,
    x: Reals,
    z: Reals,
    w: Reals,
    p: Reals,
    y: Reals,
) -> None:
    """The signals at many times."""


def expressions(
    r: Routine, start: Integer, stop: Integer, columns: Integer, t: Reals, y: Reals, values: Reals
) -> None:
    """The expressions at many times."""


def all_finite(r: Routine, values: Reals, count: Integer) -> Boolean:
    """Whether all numbers are finite.

    Eight partial sums are independent of each other, so that the processor overlaps the additions.
    """
    lanes = 8
    sums = [r.real(0.0) for _ in range(lanes)]
    whole = count - (count & (lanes - 1))
    for k in r.range(0, whole, lanes):
        for lane, total in enumerate(sums):
            total.value = total.value + values[k + lane] * 0.0
    for k in r.range(whole, count):
        sums[0].value = sums[0].value + values[k] * 0.0
    total = sums[0].value
    for other in sums[1:]:
        total = total + other.value
    return total == 0.0
