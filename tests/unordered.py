"""Comparison of sets of numbers, such as poles and zeros, whose order depends on rounding."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment


def matched(actual: Any, expected: Any, tolerance: float = 1e-8) -> bool:
    """Return whether both have the same numbers in any order, each within ``tolerance * max(1, |expected|)``.

    The numbers are paired such that the sum of distances is least. Sorting is not enough: where two real
    parts are equal up to rounding, the last bits of LAPACK's result decide the order.
    """
    left, right = (np.ravel(np.asarray(values, dtype=np.complex128)) for values in (actual, expected))
    if left.size != right.size:
        return False
    distances = np.abs(left[:, None] - right[None, :])
    rows, columns = linear_sum_assignment(distances)
    return bool((distances[rows, columns] <= tolerance * np.maximum(1.0, np.abs(right[columns]))).all())
