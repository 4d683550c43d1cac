"""The pace of a run: a real-time factor, or as fast as possible."""

from __future__ import annotations

import math
from collections.abc import Callable
from time import perf_counter


class Pace:
    """The relation of simulated time to clock time; ``speed`` ``None`` means as fast as possible."""

    def __init__(self, speed: float | None, clock: Callable[[], float] = perf_counter) -> None:
        self.speed = speed
        self._clock = clock
        self.count_from(0.0)

    def count_from(self, time: float) -> None:
        """Set the simulated ``time`` (s) that corresponds to the present clock time."""
        self._time, self._since = time, self._clock()

    @property
    def target_time(self) -> float:
        """Simulated time (s) that a run should have reached by now; infinite without a speed."""
        if self.speed is None:
            return math.inf
        return self._time + self.speed * (self._clock() - self._since)
