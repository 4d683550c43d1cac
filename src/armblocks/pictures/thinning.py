"""Reduction of the points of a curve without a visible change."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_Array = NDArray[np.float64]


def thin_out(time: _Array, values: _Array, columns: int) -> tuple[_Array, _Array]:
    """At most four points for each of ``columns`` equal intervals of ascending times: first, minimum, maximum
    and last, so that peaks stay visible."""
    if len(time) <= 4 * columns:
        return time, values
    bounds = np.searchsorted(time, np.linspace(float(time[0]), float(time[-1]), columns + 1))
    bounds[-1] = len(time)
    indices: set[int] = {len(time) - 1}
    for a, b in zip(bounds[:-1].tolist(), bounds[1:].tolist()):
        if a == b:
            continue
        interval_values = values[a:b]
        finite = np.isfinite(interval_values)
        indices.update((a, b - 1))
        if finite.any():
            indices.add(a + int(np.argmin(np.where(finite, interval_values, np.inf))))
            indices.add(a + int(np.argmax(np.where(finite, interval_values, -np.inf))))
    sorted_indices = np.array(sorted(indices))
    return time[sorted_indices], values[sorted_indices]
