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
    with np.errstate(divide="ignore"):
        logarithms = np.log2(np.abs(matrix))
    rows, columns = np.zeros((matrix.shape[0], 1)), np.zeros((1, matrix.shape[1]))
    for _ in range(SWEEPS):
        sizes = logarithms + rows + columns
        row_sizes = sizes.max(axis=1, keepdims=True, initial=-np.inf)
        column_sizes = sizes.max(axis=0, keepdims=True, initial=-np.inf)
        rows -= np.where(np.isfinite(row_sizes), row_sizes, 0.0) / 2.0
        columns -= np.where(np.isfinite(column_sizes), column_sizes, 0.0) / 2.0
    return np.exp2(np.round(rows[:, 0])), np.exp2(np.round(columns[0]))
