"""Quantiles of Student's t distribution, for confidence intervals."""

from __future__ import annotations

import math

import numpy as np

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(80)


def t_factor(level: float, freedom: float) -> float:
    """The half width of a two-sided interval with probability ``level``, in standard errors.

    ``freedom``: degrees of freedom, above 0; infinite for the normal distribution. The relative error is
    below 1e-9.
    """
    if freedom > 1e7:
        from statistics import NormalDist

        return NormalDist().inv_cdf(0.5 + 0.5 * level)
    # With t = sqrt(nu) tan(a), the probability of |t| is the integral of cos(a)^(nu - 1), normalised.
    constant = 2.0 * math.exp(math.lgamma((freedom + 1.0) / 2.0) - math.lgamma(freedom / 2.0))
    constant /= math.sqrt(math.pi)
    low, high = 0.0, 1.0
    while _inside(high, freedom, constant) < level:
        high *= 2.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _inside(middle, freedom, constant) < level else (low, middle)
        if high - low <= 1e-13 * high:
            break
    return 0.5 * (low + high)


def _inside(t: float, freedom: float, constant: float) -> float:
    """The probability of a value between -t and t."""
    end = math.atan2(t, math.sqrt(freedom))
    # The integrand is narrow for many degrees of freedom.
    width = min(end, 12.0 / math.sqrt(freedom))
    angles = 0.5 * width * (_NODES + 1.0)
    integrand = np.cos(angles) ** (freedom - 1.0)
    return constant * 0.5 * width * float(_WEIGHTS @ integrand)
