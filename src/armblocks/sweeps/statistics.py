"""Statistics of the columns of a sweep."""

from __future__ import annotations

import math
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def wilson_interval(successes: int, count: int, confidence: float) -> tuple[float, float]:
    """The Wilson score interval of a probability, from ``successes`` in ``count`` independent trials.

    Source: E. B. Wilson, Journal of the American Statistical Association 22, 1927.
    """
    z = NormalDist().inv_cdf(0.5 + 0.5 * confidence)
    share, weight = successes / count, z * z / count
    centre = (share + 0.5 * weight) / (1.0 + weight)
    half = z / (1.0 + weight) * math.sqrt(share * (1.0 - share) / count + 0.25 * weight / count)
    # Without successes the lower limit is 0, without failures the upper one is 1; rounding could change them.
    low = 0.0 if successes == 0 else max(0.0, centre - half)
    high = 1.0 if successes == count else min(1.0, centre + half)
    return low, high


def rank_correlation(first: Array, second: Array) -> float:
    """Spearman's rank correlation of two columns; NaN if one of them is constant. Equal values have the
    average of their ranks."""
    ranks = [_ranks(values) for values in (first, second)]
    a, b = (values - values.mean() if values.size else values for values in ranks)
    size = math.sqrt(float(np.sum(a * a)) * float(np.sum(b * b)))
    return float(np.sum(a * b)) / size if size > 0.0 else math.nan


def _ranks(values: Array) -> Array:
    _, inverse, counts = np.unique(values, return_inverse=True, return_counts=True)
    last = np.cumsum(counts)
    return (last - 0.5 * (counts - 1))[inverse.reshape(-1)]
