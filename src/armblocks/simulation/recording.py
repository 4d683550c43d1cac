"""The recorded samples of a run: all in memory, or one window in memory and the rest in a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from armblocks.equations import Signature
from armblocks.errors import SimulationError
from armblocks.integration.native_integrator import Integration
from armblocks.integration.system import CompiledSystem
from armblocks.simulation.diagnosis import first_invalid_signal
from armblocks.simulation.jumps import InstantRows, Jumps, JumpSearch, JumpTable, merged, merged_states
from armblocks.simulation.plan import LogRequest, SampleTimes
from armblocks.simulation.result import SimulationResult
from armblocks.simulation.run_data import LoggedFile
from armblocks.simulation.run_part import Consumer, Rows, RunPart
from armblocks.simulation.signal_names import signal_path

if TYPE_CHECKING:
    from armblocks.simulation.run_log import RunLog

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Samples:
    """Recorded samples of a run in progress: ``time (N,)`` s and ``signals (ny, N)``.

    ``begin`` is the number of the first sample, ``end`` the number of the sample after the last.
    ``samples["block/port"]`` is ``(N, *shape)``.
    """

    begin: int
    time: Array
    signals: Array
    layout: Signature
    aliases: Mapping[str, str]
    jumps: Jumps
    """The jumps after the preceding sample, up to the last of these samples."""

    @property
    def end(self) -> int:
        """Number of the sample after the last."""
        return self.begin + self.time.size

    def __getitem__(self, name: str) -> Array:
        path = signal_path(name, self.layout, self.aliases, "samples")
        rows = self.signals[self.layout.ranges[path]]
        return rows.T.reshape(self.time.size, *self.layout[path].shape)


@dataclass(frozen=True, kw_only=True)
class ValidSamples:
    """Samples with finite signals: ``time (N,)`` s, ``states (N, nx)`` and ``signals (ny, N)``.

    ``jumps`` are both sides of the jumps between the samples. ``failure`` is the error for the next sample if
    one of its signals is not finite.
    """

    time: Array
    states: Array
    signals: Array
    jumps: Jumps
    failure: SimulationError | None = None


class Recording:
    """The parts of a run with constant parameters, and the log file of a logged run."""

    def __init__(
        self, compiled: CompiledSystem, sample_times: SampleTimes, log: LogRequest | None, layout: Signature
    ) -> None:
        """Raises the errors of :func:`~armblocks.simulation.export.open_log`."""
        self._compiled = compiled
        self._layout = layout
        self._search = JumpSearch(compiled)
        """The search of a logged run; it continues from window to window."""
        self.parts: list[RunPart] = []
        self.window: int | None = None
        """Number of samples in memory of a logged run."""
        self._log: RunLog | None = None
        if log is not None:
            # Imported only for runs with a log, because the file writers load slowly.
            from armblocks.simulation.run_log import RunLog, window_rows

            states = compiled.states.size
            self._log = RunLog(log, layout, compiled.aliases, states, sample_times.count)
            self.window = window_rows(1 + states + layout.size)

    @property
    def recorded(self) -> int:
        """Number of samples recorded so far."""
        return self.parts[-1].recorded if self.parts else 0

    @property
    def integrations(self) -> list[Integration]:
        """The native loops, one for each part of a run that is integrated."""
        return [part.integration for part in self.parts if part.integration is not None]

    @property
    def file(self) -> LoggedFile | None:
        """The log file with its number of rows, or None."""
        return None if self._log is None else LoggedFile(path=self._log.path, rows=self._log.rows)

    @property
    def consumer(self) -> Consumer | None:
        """The function that writes full windows of a logged run. It raises ``SimulationError`` if a signal is
        not finite."""
        return None if self._log is None else self._write

    def write_remaining(self) -> None:
        """Write the remaining samples of the last part to the log.

        Raises the errors of the :attr:`consumer`.
        """
        if self._log is not None and self.parts:
            self.parts[-1].undo_interrupted_chunk()
            self._write(self.parts[-1].rows())

    def samples(self, begin: int) -> Samples:
        """Signals of the samples from number ``begin`` on that are in memory."""
        parts, compiled = self._rows(begin), self._compiled
        no_signals = np.empty((compiled.signals_layout.size, 0))
        time = _concatenated([rows.time for rows in parts] or [np.empty(0)])
        signals = _concatenated([rows.signals(compiled) for rows in parts] or [no_signals], axis=1)
        return Samples(
            begin=parts[0].begin if parts else min(begin, self.recorded),
            time=time,
            signals=signals,
            layout=compiled.signals_layout,
            aliases=compiled.aliases,
            jumps=self._jumps(parts, time, signals),
        )

    def valid_samples(self) -> ValidSamples:
        """All samples before the first signal that is not finite; of a logged run, the view in memory."""
        compiled = self._compiled
        if self._log is not None:
            time, states, signals = self._log.view(compiled.signals_layout.size)
            return ValidSamples(
                time=time, states=states, signals=signals, jumps=self._jumps([], time, signals)
            )
        parts = self._rows(0) or [self.parts[-1].rows()]
        time = _concatenated([rows.time for rows in parts])
        states = _concatenated([rows.states for rows in parts])
        signals = _concatenated([rows.signals(compiled) for rows in parts], axis=1)
        error = first_invalid_signal(
            compiled, time, signals, _concatenated([rows.algebraic for rows in parts])
        )
        failure, count = (None, time.size) if error is None else error
        time, states, signals = time[:count], states[:count], signals[:, :count]
        jumps = self._jumps(parts, time, signals)
        return ValidSamples(time=time, states=states, signals=signals, jumps=jumps, failure=failure)

    def _jumps(self, parts: list[Rows], time: Array, signals: Array) -> Jumps:
        """The jumps between samples; they are evaluated at their first use."""
        compiled = self._compiled

        def table() -> JumpTable:
            if not parts:
                return JumpTable.empty(compiled.signals_layout.size, compiled.states.size)
            first = parts[0]
            instants = self._instants(first.begin, time.size)
            return JumpSearch(compiled).find(instants, first.begin, time, signals, first.previous)

        return Jumps(self._layout, compiled.aliases, table)

    def _instants(self, begin: int, count: int) -> list[InstantRows]:
        """The instants of ``count`` samples. Instants just before a change of parameters belong to the first
        sample of the next part."""
        return [part.instants(begin, begin + count) for part in self.parts]

    def in_memory(self) -> list[Rows]:
        """The rows that are in memory."""
        return self._rows(0)

    def finish(self, result: SimulationResult) -> None:
        """Complete the file of a logged run with the description of the run."""
        if self._log is not None:
            self._log.finish(result)

    def _rows(self, begin: int) -> list[Rows]:
        return [rows for rows in (part.rows(begin) for part in self.parts) if rows.time.size]

    def _write(self, rows: Rows) -> None:
        """Write a window to the log, without the rows that were written before an interruption."""
        assert self._log is not None
        rows = rows.after(self._log.samples)
        if not rows.time.size:
            return
        signals = rows.signals(self._compiled)
        error = first_invalid_signal(self._compiled, rows.time, signals, rows.algebraic)
        valid = rows.time.size if error is None else error[1]
        time, states, signals = rows.time[:valid], rows.states[:valid], signals[:, :valid]
        instants = self._instants(rows.begin, valid)
        jumps = self._search.find(instants, rows.begin, time, signals, rows.previous)
        states = merged_states(time, states, jumps)
        time, signals = merged(time, signals, jumps)
        self._log.append(time, states, signals, samples=valid)
        if error is not None:
            raise error[0]


def _concatenated(parts: Sequence[Array], axis: int = 0) -> Array:
    """The concatenated parts; a single part is not copied."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=axis)
