"""Linear and logarithmic maps from numbers to px."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_Array = NDArray[np.float64]


@dataclass(frozen=True)
class Scale:
    """Linear map from a range of numbers to a range of px."""

    low: float
    high: float
    start: float
    end: float

    def __call__(self, value: float) -> float:
        return self.start + (0.5 * value - 0.5 * self.low) * self._double_factor

    @property
    def factor(self) -> float:
        """px per unit."""
        return 0.5 * self._double_factor

    @property
    def _double_factor(self) -> float:
        """px per two units: half the length of a range is finite for all finite ends."""
        return (self.end - self.start) / (0.5 * self.high - 0.5 * self.low)

    def array(self, values: _Array) -> _Array:
        """The positions of an array of numbers, px."""
        return self.start + (0.5 * values - 0.5 * self.low) * self._double_factor


@dataclass(frozen=True)
class LogScale:
    """Logarithmic map from a range of positive numbers to a range of px."""

    low: float
    high: float
    start: float
    end: float

    def __call__(self, value: float) -> float:
        return self.start + (math.log10(value) - math.log10(self.low)) * self.factor

    @property
    def factor(self) -> float:
        """px per decade."""
        return (self.end - self.start) / (math.log10(self.high) - math.log10(self.low))

    def array(self, values: _Array) -> _Array:
        """The positions of an array of numbers, px."""
        return self.start + (np.log10(values) - math.log10(self.low)) * self.factor


_LARGEST = float(np.finfo(np.float64).max)
_SHORTEST_HALF = 1e-300
"""Half the length below which a range is shown as one value: px per unit would not be finite."""


def padded_range(values: _Array, fraction: float) -> tuple[float, float]:
    """The range of the finite values, extended by ``fraction`` of its length at both ends.

    The ends are finite, and the range is never empty.
    """
    finite = values[np.isfinite(values)]
    if len(finite) == 0:
        return -1.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    # Rounding noise around a constant is not magnified.
    largest = max(abs(low), abs(high))
    half = 0.5 * high - 0.5 * low  # finite for all finite ends
    if half <= max(0.5e-9 * largest, _SHORTEST_HALF):
        extension = 0.5 * largest if largest > _SHORTEST_HALF else 1.0
    else:
        extension = 2.0 * fraction * half
    return max(low - extension, -_LARGEST), min(high + extension, _LARGEST)
