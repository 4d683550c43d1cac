"""Comparison of numbers whose order rounding decides: poles, zeros, crossings."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment


def matched(found: Any, wanted: Any, tolerance: float = 1e-8) -> bool:
    """Whether both are the same numbers in any order, each to ``tolerance * max(1, |wanted|)``.

    The pairs are those with the least sum of distances. Sorting would not do: where two real parts agree but
    for rounding, the last bits of LAPACK decide which number comes first.
    """
    left, right = (np.ravel(np.asarray(values, dtype=np.complex128)) for values in (found, wanted))
    if left.size != right.size:
        return False
    apart = np.abs(left[:, None] - right[None, :])
    rows, columns = linear_sum_assignment(apart)
    return bool((apart[rows, columns] <= tolerance * np.maximum(1.0, np.abs(right[columns]))).all())
