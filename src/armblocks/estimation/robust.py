"""Huber's weights for rows with outliers.

Source: Huber, Ronchetti, *Robust Statistics*, 7.3 to 7.8 (regression, computation, covariance).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

THRESHOLD = 1.345
"""Residuals beyond this number of standard deviations have less weight: 95 % efficiency without outliers."""


def robust_deviations(residuals: Array) -> Array:
    """The standard deviation (n,) of residuals (N, n) from the median of their magnitudes."""
    size = np.abs(residuals).max(axis=0, initial=0.0)
    return np.maximum(np.median(np.abs(residuals), axis=0) / 0.674489750196, 1e-12 * size + 1e-300)


def huber_weights(residuals: Array, deviations: Array) -> Array:
    """Weights (N, n), 1 for residuals up to the threshold."""
    ratio = np.abs(residuals) / (THRESHOLD * deviations)
    return 1.0 / np.maximum(ratio, 1.0)


def sandwich_factors(residuals: Array, deviations: Array) -> tuple[Array, Array]:
    """For each column of residuals (N, n) the means of psi' and of psi^2, in units of the deviations.

    With ``H = sum m_j X_j' X_j / s_j^2`` and ``G`` with ``k_j`` instead of ``m_j``, the covariance of the
    estimate is ``H^-1 G H^-1``.
    """
    ratio = residuals / deviations
    inliers = np.mean(np.abs(ratio) <= THRESHOLD, axis=0)
    squares = np.mean(np.clip(ratio, -THRESHOLD, THRESHOLD) ** 2, axis=0)
    return inliers, squares
