"""Scaling of the rows and columns of a matrix, such that its entries have similar magnitudes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SWEEPS = 12
"""Number of passes over all rows and columns; each halves the logarithms of the magnitudes."""


def equilibrating_factors(matrix: Array) -> tuple[Array, Array]:
    """Powers of two for the rows and columns of a matrix (m, n), whose largest entries are then about 1.

    Rows and columns of zeros have the factor 1. The method is that of Ruiz (Rutherford Appleton Laboratory,
    RAL-TR-2001-034), in logarithms.
    """
    logarithms = np.full(matrix.shape, -np.inf)
    logarithms[matrix != 0.0] = np.log2(np.abs(matrix[matrix != 0.0]))
    rows, columns = np.zeros(matrix.shape[0]), np.zeros(matrix.shape[1])
    for _ in range(SWEEPS):
        sizes = logarithms + rows[:, None] + columns
        rows, columns = rows - _largest(sizes) / 2.0, columns - _largest(sizes.T) / 2.0
    return np.exp2(np.round(rows)), np.exp2(np.round(columns))


def _largest(logarithms: Array) -> Array:
    """The largest entry of each row; 0 for a row of zeros."""
    largest = np.array([float(row.max(initial=-np.inf)) for row in logarithms])
    largest[~np.isfinite(largest)] = 0.0
    return largest
