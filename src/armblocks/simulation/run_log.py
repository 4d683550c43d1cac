"""The log of a run: its file, which is written during the run, and a view in memory.

The use of memory does not depend on the duration of the run: one window of samples, the data being written,
and the view. Figures of the view look like figures of all rows. The view has complete rows: in each interval
the first row, and the rows in which a signal has its minimum or maximum.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from armblocks.equations import Signature
from armblocks.errors import FormatError
from armblocks.simulation.export import description_of, open_log
from armblocks.simulation.plan import LogRequest
from armblocks.simulation.result import SimulationResult
from armblocks.simulation.signal_names import element_names, signal_path

Array = NDArray[np.float64]

VIEW_ROWS = 20_000
"""Approximate number of rows of the view: several for each pixel of a figure."""
MAX_VIEW_ROWS = 4 * VIEW_ROWS
"""Number of rows above which the intervals of the view are doubled."""
WINDOW_NUMBERS = 2_000_000
"""Number of doubles of the window, 16 MB."""


def window_rows(width: int) -> int:
    """Number of samples with ``width`` numbers each in the window."""
    return max(256, min(65_536, WINDOW_NUMBERS // width))


class View:
    """Selected rows of a growing table that include all extremes. A row is a column of ``append``'s
    argument."""

    def __init__(self, total: int, watched: Sequence[int]) -> None:
        """``total`` is the number of rows to expect; the view has the extremes of the ``watched``
        quantities."""
        self._watched = list(watched)
        self._interval = max(1, math.ceil(total * (1 + 2 * len(self._watched)) / VIEW_ROWS))
        self._selected: list[Array] = []
        self._pending: list[Array] = []
        self._rows_in_interval = 0

    def append(self, columns: Array) -> None:
        """Append rows, ``(quantities, N)``."""
        start, count = 0, columns.shape[1]
        while start < count:
            end = min(count, start + self._interval - self._rows_in_interval)
            self._pending.append(self._extremes(columns[:, start:end]))
            self._rows_in_interval += end - start
            start = end
            if self._rows_in_interval == self._interval:
                self._flush()

    def rows(self) -> Array:
        """The selected rows, ``(quantities, rows)``."""
        parts = [*self._selected, *self._pending]
        return np.concatenate(parts, axis=1) if parts else np.empty((0, 0))

    def _flush(self) -> None:
        rows = np.concatenate(self._pending, axis=1)
        self._selected.append(self._extremes(rows) if len(self._pending) > 1 else rows)
        self._pending, self._rows_in_interval = [], 0
        if sum(part.shape[1] for part in self._selected) > MAX_VIEW_ROWS:
            # More rows than expected, because of jumps: double the intervals.
            self._interval *= 2
            pairs = [self._selected[k : k + 2] for k in range(0, len(self._selected), 2)]
            self._selected = [self._extremes(np.concatenate(pair, axis=1)) for pair in pairs]

    def _extremes(self, columns: Array) -> Array:
        if columns.shape[1] <= 1 or self._interval == 1:
            return columns.copy()
        watched = columns[self._watched]
        places = {0, *watched.argmin(axis=1).tolist(), *watched.argmax(axis=1).tolist()}
        return columns[:, sorted(places)]


class RunLog:
    """The file and the view of one run. A separate thread writes the file during the run."""

    def __init__(
        self, request: LogRequest, layout: Signature, aliases: Mapping[str, str], states: int, instants: int
    ) -> None:
        """Raises ``UnknownNameError`` for unknown signals and file types, ``FormatError`` for a path that
        cannot be written."""
        names = [signal_path(name, layout, aliases, "log") for name in request.signals] or list(layout.names)
        self.path = request.path
        self.samples = 0
        """Number of samples written."""
        self.rows = 0
        """Number of rows: the samples and both sides of the jumps."""
        self._indices = np.array([k for name in names for k in range(*_range(layout, name))], dtype=np.intp)
        self._all = len(self._indices) == layout.size
        columns = [column for name in names for column in element_names(layout[name])]
        self._file = open_log(request.path, columns)
        self._states = states
        self._view = View(instants, [1 + states + k for k in self._indices.tolist()])
        self._thread = ThreadPoolExecutor(1)
        self._writing: Future[None] | None = None

    def append(self, time: Array, states: Array, signals: Array, *, samples: int) -> None:
        """Add rows: ``time (N,)``, ``states (N, nx)``, ``signals (ny, N)``; ``samples`` of them are samples
        and all others are sides of jumps. The caller must not change them later.

        Raises ``FormatError`` if earlier samples could not be written.
        """
        self._wait()
        self.rows += time.size
        self.samples += samples
        logged_signals = signals if self._all else signals[self._indices]
        self._writing = self._thread.submit(self._file.append, time.copy(), logged_signals)
        self._view.append(np.concatenate([time[np.newaxis], states.T, signals]))

    def view(self, signals: int) -> tuple[Array, Array, Array]:
        """Time ``(N,)``, states ``(N, nx)`` and signals ``(ny, N)`` of the rows of the view."""
        rows = self._view.rows() if self.rows else np.empty((1 + self._states + signals, 0))
        first = 1 + self._states
        return rows[0], np.ascontiguousarray(rows[1:first].T), rows[first:]

    def finish(self, result: SimulationResult) -> None:
        """Complete the file with the description of the run."""
        try:
            self._wait()
            self._file.finish(description_of(result))
        finally:
            self._thread.shutdown()

    def _wait(self) -> None:
        if self._writing is None:
            return
        try:
            self._writing.result()
        except OSError as error:
            self._file.abandon()
            raise FormatError(
                f"writing to the log failed ({error.strerror or error})",
                where=str(self.path),
                fix="free space on the disk, or log fewer signals with a longer sample time",
            ) from error
        self._writing = None


def _range(layout: Signature, name: str) -> tuple[int, int]:
    place = layout.ranges[name]
    return place.start, place.stop
