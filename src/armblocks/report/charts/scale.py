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
        return self.start + (value - self.low) * self.factor

    @property
    def factor(self) -> float:
        """px per unit."""
        return (self.end - self.start) / (self.high - self.low)

    def array(self, values: _Array) -> _Array:
        """The positions of an array of numbers, px."""
        return self.start + (values - self.low) * self.factor


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


def padded_range(values: _Array, fraction: float) -> tuple[float, float]:
    """The range of the finite values, extended by ``fraction`` of its length at both ends; never
    empty."""
    finite = values[np.isfinite(values)]
    if len(finite) == 0:
        return -1.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    # Rounding noise around a constant is not magnified.
    if high - low <= 1e-9 * max(abs(low), abs(high)) or high == low:
        half = max(abs(low), abs(high)) * 0.5 or 1.0
        return low - half, high + half
    return low - fraction * (high - low), high + fraction * (high - low)
