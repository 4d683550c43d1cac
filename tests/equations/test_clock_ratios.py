"""Exact ratios of sample times that are rounded to doubles."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from armblocks.equations import SampleClock
from armblocks.equations.clock_ratios import common_period, exact_clocks, simplest_between


def test_rounded_sample_times_have_the_common_period_of_their_fractions() -> None:
    random = np.random.default_rng(9)
    for _ in range(200):
        periods = [Fraction(int(a), int(b)) for a, b in random.integers(1, 1000, (3, 2))]
        offsets = [period * Fraction(int(k), 64) for period, k in zip(periods, random.integers(0, 64, 3))]
        clocks = exact_clocks([SampleClock(float(own), float(at)) for own, at in zip(periods, offsets)])
        assert clocks == list(zip(periods, offsets))
        period = common_period(clocks)
        assert all((period / own).denominator == 1 for own in periods)
        assert math.gcd(*(int(period / own) for own in periods)) == 1


def test_the_period_of_a_single_clock_is_unchanged_bit_for_bit() -> None:
    for period in [0.1, 1.0 / 3.0, math.pi / 100.0, 2.0**-20, *np.random.default_rng(1).random(100).tolist()]:
        assert float(common_period(exact_clocks([SampleClock(period)]))) == period


def test_multiples_of_an_irrational_sample_time_have_a_common_period() -> None:
    step = math.pi / 100.0
    clocks = exact_clocks([SampleClock(2.0 * step), SampleClock(3.0 * step)])
    assert abs(float(common_period(clocks)) / (6.0 * step) - 1.0) < 1e-15


def test_the_simplest_fraction_of_an_interval_agrees_with_a_search() -> None:
    random = np.random.default_rng(2)
    for _ in range(100):
        low = Fraction(int(random.integers(0, 500)), int(random.integers(1, 100)))
        high = low + Fraction(1, int(random.integers(1, 300)))
        below = next(n for n in range(1, 1000) if math.floor(high * n) >= low * n)
        assert simplest_between(low, high) == Fraction(math.ceil(low * below), below)
