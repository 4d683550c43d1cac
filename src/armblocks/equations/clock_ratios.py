"""Periods and offsets of clocks as exact fractions of a second, consistent with the ticks of a run.

A run treats ticks within 4 units in the last place as simultaneous. The ratio of two sample times is
therefore the simplest fraction within that tolerance: 0.3 s is three times 0.1 s, and 1/3 s is 10/3 times 0.1
s, although no double equals 1/3. The common period of any number of clocks follows exactly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

from armblocks.equations.hybrid_system import SampleClock

SAME_INSTANT = Fraction(1, 2**50)
"""Relative tolerance of simultaneous times: 4 units in the last place."""


def ratio(numerator: float, denominator: float) -> Fraction:
    """The simplest fraction within ``SAME_INSTANT`` of the quotient of two times; denominator > 0."""
    quotient = Fraction(numerator) / Fraction(denominator)
    if quotient < 0:
        return -ratio(-numerator, denominator)
    return simplest_between(quotient * (1 - SAME_INSTANT), quotient * (1 + SAME_INSTANT))


def simplest_between(low: Fraction, high: Fraction) -> Fraction:
    """The fraction with the smallest denominator in ``[low, high]``, ``0 <= low <= high``; the smallest of
    several.

    Method: continued fractions (Knuth, The Art of Computer Programming, volume 2, 4.5.3, exercise 39).
    """
    whole = math.ceil(low)
    if whole <= high:
        return Fraction(whole)
    whole -= 1
    return whole + 1 / simplest_between(1 / (high - whole), 1 / (low - whole))


def exact_clocks(clocks: Sequence[SampleClock]) -> list[tuple[Fraction, Fraction]]:
    """Period and offset (s) of each clock.

    The first period is the simplest fraction that rounds to its double. The other periods follow from their
    ratios to the first.
    """
    first = clocks[0].period
    below, above = (Fraction(math.nextafter(first, side)) for side in (0.0, math.inf))
    unit = simplest_between((below + Fraction(first)) / 2, (Fraction(first) + above) / 2)
    return [(unit * ratio(clock.period, first), unit * ratio(clock.offset, first)) for clock in clocks]


def common_period(clocks: Sequence[tuple[Fraction, Fraction]]) -> Fraction:
    """The least common multiple (s) of the periods that :func:`exact_clocks` returns."""
    denominator = math.lcm(*(period.denominator for period, _ in clocks))
    return Fraction(math.lcm(*(int(period * denominator) for period, _ in clocks)), denominator)
