"""Balancing: scaling of states so that the entries of a system have similar magnitudes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MAX_SWEEPS = 30
"""Maximum number of passes over all states."""


def balanced(A: Array, B: Array, C: Array) -> tuple[Array, Array, Array]:
    """The same system with its states scaled by powers of two, which causes no rounding errors.

    For each state the norms of its column in ``[A; C]`` and of its row in ``[A, B]`` are made as equal as
    possible (Osborne, J. ACM 7, 1960, 338-345, with inputs and outputs as in TB01ID of SLICOT).
    """
    factors = balancing_factors(A, B, C)
    return A * factors / factors[:, None], B / factors[:, None], C * factors


def balancing_factors(A: Array, B: Array, C: Array) -> Array:
    """The powers of two ``f`` (nx,) of :func:`balanced`: ``x = f x_balanced``."""
    a, b, c = A.copy(), B.copy(), C.copy()
    factors = np.ones(a.shape[0])
    for _ in range(MAX_SWEEPS):
        changed = False
        for k in range(a.shape[0]):
            column = math.hypot(_length(np.delete(a[:, k], k)), _length(c[:, k]))
            row = math.hypot(_length(np.delete(a[k], k)), _length(b[k]))
            if column == 0.0 or row == 0.0:
                continue
            factor = 2.0 ** round(math.log2(row / column) / 2.0)
            if factor != 1.0 and column * factor + row / factor < 0.95 * (column + row):
                a[:, k] *= factor
                c[:, k] *= factor
                a[k] /= factor
                b[k] /= factor
                factors[k] *= factor
                changed = True
        if not changed:
            break
    return factors


def _length(vector: Array) -> float:
    return float(np.linalg.norm(vector))
