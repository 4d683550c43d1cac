"""Scaling of the rows and columns of a matrix, and of equations, to similar magnitudes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SWEEPS = 12
"""Number of passes over all rows and columns; each halves the logarithms of the magnitudes."""


def equilibrating_factors(matrix: Array) -> tuple[Array, Array]:
    """Powers of two for the rows and columns of a matrix (m, n), whose largest entries are then about 1.

    Rows and columns of zeros have the factor 1. Source: Ruiz (Rutherford Appleton Laboratory,
    RAL-TR-2001-034), here in logarithms.
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


@dataclass(frozen=True, kw_only=True, eq=False)
class ResidualScales:
    """Factors of the equations (``rows``) and of the unknowns (``columns``).

    ``rounding``: residuals that can be rounding errors.
    """

    rows: Array
    columns: Array
    rounding: Array

    @classmethod
    def of(cls, derivatives: Array, residuals: Array, rounding: Array) -> Self:
        """The scales for derivatives of these magnitudes."""
        rows, columns = equilibrating_factors(derivatives)
        # An equation that depends on no unknown has no scale but its residual.
        constant = ~derivatives.any(axis=1) & (residuals != 0.0)
        rows = np.where(constant, 1.0 / np.where(constant, np.abs(residuals), 1.0), rows)
        return cls(rows=rows, columns=columns, rounding=rounding)

    def excess(self, residuals: Array) -> float:
        """The scaled size of the residuals beyond their rounding errors; infinite if one is not finite."""
        if not np.isfinite(residuals).all():
            return np.inf
        return float(np.linalg.norm(self.rows * np.maximum(np.abs(residuals) - self.rounding, 0.0)))
