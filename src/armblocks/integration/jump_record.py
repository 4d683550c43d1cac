"""The memory of a run for both sides of its instants, which the native loop fills."""

from __future__ import annotations

from bisect import bisect_right

import numpy as np
from numpy.typing import NDArray

from armblocks.integration.records import JUMP_ROWS_OF_A_STEP, row_width
from armblocks.integration.workspace import Count, LoopSizes

Vector = NDArray[np.float64]

INITIAL_SIZE = 1_000_000
"""Initial number of doubles, 8 MB. The operating system allocates only the memory that is used."""
NO_LIMIT = np.iinfo(np.int64).max


class JumpRecord:
    """Two rows for each instant; the native loop counts them in ``counts``. Initially empty and disabled.

    After :meth:`begin`, :meth:`share` and :meth:`enlarge` the memory has another address.
    """

    def __init__(self, counts: NDArray[np.int64], sizes: LoopSizes) -> None:
        self._counts = counts
        self.memory: Vector = np.empty((0, row_width(sizes)))
        self.end: float | None = None
        """The time from which instants are not recorded, because the record has its maximum size."""
        self._max_rows = 0
        self.begin(0)

    def begin(self, max_rows: int) -> None:
        """Begin an empty record with at most ``max_rows`` rows; 0: no record."""
        width = self.memory.shape[1]
        self._max_rows = max_rows
        self.memory = np.empty((min(max_rows, max(64, INITIAL_SIZE // width)), width))
        self._counts[Count.JUMPS] = 0
        self.enable()

    def share(self, record: JumpRecord) -> None:
        """Continue another record of the same system."""
        self.memory, self.end, self._max_rows = record.memory, record.end, record._max_rows
        self.enable()

    def enable(self) -> None:
        """Set the counters of the native loop for the present memory."""
        enabled = bool(self.memory.size) and self.end is None
        self._counts[Count.JUMPS_RECORDED] = int(enabled)
        self._counts[Count.JUMPS_CAPACITY] = len(self.memory) - JUMP_ROWS_OF_A_STEP if enabled else NO_LIMIT

    def enlarge(self, time: float) -> None:
        """Double the memory; at its maximum size, end the record at the present ``time`` (s)."""
        rows = min(self._max_rows, 2 * len(self.memory))
        if rows == len(self.memory):
            self.end = time
        else:
            self.memory = np.concatenate(
                [self.memory, np.empty((rows - len(self.memory), self.memory.shape[1]))]
            )
        self.enable()

    @property
    def rows(self) -> Vector:
        """Both sides of the recorded instants, ``(M, 2, 2 + nx + nz + nw)``, as a view.

        A row has the time of the evaluation in s, and the number of samples recorded before it. Then follow
        the states, the discrete variables and the unknowns of the implicit equations.
        """
        # A run that failed within an instant has only its first side.
        complete = self._counts[Count.JUMPS] // 2
        return self.memory[: 2 * complete].reshape(complete, 2, self.memory.shape[1])

    def drop(self, until: float, samples: int) -> None:
        """Drop the instants up to a time (s); the first ``samples`` samples are removed from memory."""
        first = 2 * bisect_right(self.rows, until, key=lambda sides: sides[1, 0])
        # The instant that is being processed may have its first side only.
        later = self.memory[first : self._counts[Count.JUMPS]].copy()
        later[:, 1] -= samples
        self.memory[: len(later)] = later
        self._counts[Count.JUMPS] = len(later)
