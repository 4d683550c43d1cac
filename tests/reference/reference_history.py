"""History of a signal: one cubic polynomial per step of a run, with jumps between them."""

from __future__ import annotations

import bisect

import numpy as np

SAME_TIME = 2.0**-50
POSITIONS = np.array([0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0])
TO_COEFFICIENTS = np.linalg.inv(np.vander(POSITIONS, 4, increasing=True))


class History:
    """The history of a delayed signal. A *segment* is the part between two jumps; 0 is before the start."""

    def __init__(self, size: int) -> None:
        self.size = size
        self.segment = 0

    def begin(self, before: np.ndarray) -> None:
        self.before = before.copy()
        self.starts: list[float] = []
        self.steps: list[tuple[float, float, np.ndarray]] = []
        self.jumps: list[float] = []
        self.first_step: list[int] = []

    def add(self, t: float, h: float, values: np.ndarray) -> None:
        """Add a step from ``t`` of length ``h`` with the values (4, size) at its thirds."""
        if h <= 0.0:
            return
        if not self.steps or self._jumps(values[0]):
            self.jumps.append(t)
            self.first_step.append(len(self.steps))
        self.starts.append(t)
        self.steps.append((t, h, TO_COEFFICIENTS @ values))

    def _jumps(self, value: np.ndarray) -> bool:
        last = self.steps[-1][2].sum(axis=0)
        return bool(np.max(np.abs(last - value)) > 1e-11 * (1.0 + np.max(np.abs(value))))

    def segment_at(self, when: float) -> int:
        return bisect.bisect_right(self.jumps, when * (1.0 + SAME_TIME) + 1e-300)

    def at(self, when: float, segment: int | None) -> np.ndarray:
        """Return the value at a time; ``segment`` selects a segment, whose polynomial may be extrapolated."""
        segment = self.segment_at(when) if segment is None else segment
        if segment == 0 or not self.steps:
            return self.before
        first = self.first_step[segment - 1]
        last = self.first_step[segment] if segment < len(self.first_step) else len(self.steps)
        k = min(max(bisect.bisect_right(self.starts, when) - 1, first), last - 1)
        t, h, coefficients = self.steps[k]
        s = (when - t) / h
        return coefficients.T @ np.array([1.0, s, s * s, s * s * s])
