"""A part of a run with constant parameters, and its recorded samples in memory."""

from __future__ import annotations

import sys
from bisect import bisect_left, bisect_right
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.integration.breakpoints import ends_of_segments, evaluation_times
from armblocks.integration.frame import SAME_ABOVE, SAME_BELOW
from armblocks.integration.native_integrator import Integration
from armblocks.integration.run_point import NO_NUMBERS, Checkpoint, RunPoint
from armblocks.integration.system import CompiledSystem
from armblocks.integration.workspace import Status
from armblocks.simulation.jumps import InstantRows
from armblocks.simulation.plan import SampleTimes

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Rows:
    """Recorded samples from number ``begin`` on.

    ``time (N,)`` s, ``states (N, nx)``, ``discrete (N, nz)``, ``algebraic (N, nw)``, and the parameters ``p
    (np,)``. ``instant (N,)`` s are the times at which the signals are evaluated; they differ by rounding from
    the sample times just before a breakpoint. ``previous`` is the time of the preceding sample, s.
    """

    begin: int
    time: Array
    instant: Array
    states: Array
    discrete: Array
    algebraic: Array
    p: Array
    previous: float = -np.inf

    def after(self, number: int) -> Rows:
        """The samples from ``number`` on."""
        skip = max(0, number - self.begin)
        parts = (self.time, self.states, self.discrete, self.algebraic)
        time, states, discrete, algebraic = (part[skip:] for part in parts)
        return Rows(
            begin=self.begin + skip,
            time=time,
            instant=self.instant[skip:],
            states=states,
            discrete=discrete,
            algebraic=algebraic,
            p=self.p,
            previous=float(self.time[skip - 1]) if skip else self.previous,
        )

    def signals(self, compiled: CompiledSystem) -> Array:
        """All signals of these samples, ``(ny, N)``."""
        return compiled.evaluate_signals(self.instant, self.states, self.discrete, self.algebraic, self.p)


Consumer = Callable[[Rows], None]
Change = tuple[RunPoint, Array]
"""The point and the parameters before a change of parameters."""


class RunPart:
    """Records the samples of a run from number ``begin`` on; without states there is no integration.

    With a ``window``, at most that number of samples is in memory. A consumer receives the samples before the
    next window replaces them. If a chunk of steps has more samples than fit into the window, the chunk is
    repeated for the remaining samples.
    """

    def __init__(
        self,
        sample_times: SampleTimes,
        begin: int,
        p: Array,
        integration: Integration | None,
        window: int | None,
        change: Change | None = None,
        breakpoints: Array = NO_NUMBERS,
        record_jumps: bool = True,
    ) -> None:
        """``change``: the point and the parameters before a change of parameters at the start of this part.
        ``breakpoints``: times at which sources jump, s; without integration these jumps are recorded here,
        unless ``record_jumps`` is false."""
        self.p = p
        self.integration = integration
        self.first = begin
        """Number of the first sample of this part."""
        self.begin = begin
        """Number of the first sample in memory."""
        self.window = window
        self._change = change
        self._start = -np.inf if integration is None else integration.time
        """The time of this part's first instant, s."""
        self._ends = ends_of_segments(breakpoints, self._start, sample_times.stop)[0]
        recorded = breakpoints if record_jumps else NO_NUMBERS
        self._breakpoints = _breakpoint_sides(recorded, sample_times) if integration is None else None
        self._delivered = sample_times.start * SAME_ABOVE if begin == 0 else -np.inf
        """Instants up to this time (s) belong to another run or were received by a consumer."""
        self._sample_times = sample_times
        self._time = first_window(sample_times, begin, window)
        self._position = 0
        self._repeat: tuple[int, Checkpoint] | None = None

    @property
    def in_memory(self) -> int:
        """Number of recorded samples in memory."""
        return self._position if self.integration is None else self.integration.recorded

    @property
    def recorded(self) -> int:
        """Number of the first sample that is not recorded yet."""
        return self.begin + self.in_memory

    @property
    def steps_taken(self) -> int:
        """Number of accepted steps; without integration, the number of recorded samples."""
        return self.recorded if self.integration is None else self.integration.accepted

    @property
    def time(self) -> float:
        """Present time of the run, s."""
        if self.integration is not None:
            return self.integration.time
        last = max(0, self.recorded - 1)
        return float(self._sample_times.part(last, last + 1)[0])

    def reached(self, pause: float) -> bool:
        """Whether no further step begins before ``pause`` (s)."""
        if self.integration is not None:
            return not self.integration.time < pause
        return self.recorded >= self._sample_times.up_to(pause)

    @property
    def status(self) -> Status:
        """Whether the run is paused or has ended, and why."""
        if self.integration is not None:
            return self.integration.status
        return Status.DONE if self.recorded == self._sample_times.count else Status.PAUSED

    @property
    def other_method_faster(self) -> bool:
        """Whether another method is faster from the present time on."""
        return self.integration is not None and self.integration.other_method_faster

    def rows(self, begin: int | None = None) -> Rows:
        """The samples in memory from number ``begin`` on, as views."""
        start = 0 if begin is None else min(self.in_memory, max(0, begin - self.begin))
        in_memory, run = self.in_memory, self.integration
        no_columns = np.empty((in_memory, 0))
        parts = (no_columns,) * 3 if run is None else (run.states, run.discrete, run.algebraic)
        states, discrete, algebraic = (part[start:in_memory] for part in parts)
        # The native loop stores the times, because a block that ends the run adds a sample at the stop time.
        time = (self._time if run is None else run.inputs[1])[start:in_memory]
        return Rows(
            begin=self.begin + start,
            time=time,
            instant=evaluation_times(time, self._start, self._ends),
            states=states,
            discrete=discrete,
            algebraic=algebraic,
            p=self.p,
            previous=self._previous(self.begin + start),
        )

    def _previous(self, number: int) -> float:
        """The time of the sample before sample ``number``, s."""
        return float(self._sample_times.part(number - 1, number)[0]) if number else -np.inf

    def instants(self, begin: int, end: int) -> InstantRows:
        """Both sides of the instants of samples ``begin`` to ``end - 1``, without instants that a consumer
        has received. An instant belongs to the sample at its time, else to the next sample."""
        rows, sample = self._sides
        new = bisect_right(rows, self._delivered, key=_time)
        numbers = sample[new:, 0]
        first, last = (new + bisect_left(numbers, number - self._offset) for number in (begin, end))
        rows, sample = rows[first:last], sample[first:last].astype(np.int64) + self._offset
        change = self._change if begin <= self.first < end else None
        if change is not None and not self._processes_start:
            # The states are continuous, and no instant is processed.
            both = np.concatenate([[change[0].time, 0.0], change[0].x])[np.newaxis, np.newaxis]
            rows = np.concatenate([both.repeat(2, axis=1), rows])
            sample = np.concatenate([np.full((1, 2), self.first), sample])
        return InstantRows(rows=rows, sample=sample, p=self.p, change=change)

    @property
    def _processes_start(self) -> bool:
        """Whether the native loop processes an instant at the start of this part."""
        return self.integration is not None and self.integration.integrator.sizes.hybrid

    @property
    def _offset(self) -> int:
        """Difference between the sample numbers of the run and of the native loop."""
        return 0 if self.integration is None else self.begin

    @property
    def _sides(self) -> tuple[Array, Array]:
        """Rows ``(M, 2, width)`` of all instants in memory, and their recorded numbers of samples
        ``(M, 2)``. Both increase after the instants that a consumer has received."""
        if self.integration is None:
            assert self._breakpoints is not None
            rows, sample = self._breakpoints
            own = slice(*(bisect_left(sample[:, 0], number) for number in (self.first, self.recorded)))
            return rows[own], sample[own]
        rows = self.integration.jumps.rows
        return rows, rows[:, :, 1]

    def advance(self, steps: int, pause: float, consume: Consumer | None) -> None:
        """Take at most ``steps`` steps that begin before ``pause`` (s); pass full windows to ``consume``."""
        if consume is None:
            self._advance_loop(steps, pause)
            return
        self.undo_interrupted_chunk()
        if self.integration is not None:
            self._repeat = (self.begin, self.integration.present_checkpoint())
        self._advance_loop(steps, pause)
        while self.in_memory == self._time.size and self.recorded < self._sample_times.count:
            self._deliver(consume)
            if self._repeat is not None and self.integration is not None:
                self.integration.restore(self._repeat[1])
            self._start_window(self.begin + self._time.size)
            self._advance_loop(steps, pause)
        self._repeat = None
        jumps = 0 if self.integration is None else len(self.integration.jumps.rows)
        if self.in_memory and self.in_memory + jumps > self._time.size // 2:
            self._deliver(consume)
            if self.integration is not None:
                self.integration.jumps.drop(self._delivered, self.in_memory)
            self._start_window(self.recorded)

    def _deliver(self, consume: Consumer) -> None:
        """Pass the window to the consumer."""
        rows = self.rows()
        instants = self.instants(rows.begin, rows.begin + rows.time.size)
        consume(rows)
        if len(instants.rows):
            self._delivered = _time(instants.rows[-1])
        if rows.time.size:
            self._change = None

    def undo_interrupted_chunk(self) -> None:
        """After an interruption within a chunk: return to the start of the chunk, so that it can be
        repeated."""
        if self._repeat is None or self.integration is None:
            return
        begin, before = self._repeat
        self.integration.restore(before)
        if begin != self.begin:
            self.integration.record_at(self._time)
        self._repeat = None

    def _start_window(self, begin: int) -> None:
        """Make room for the samples from number ``begin`` on."""
        self._time = first_window(self._sample_times, begin, self.window)
        self.begin = begin
        self._position = 0
        if self.integration is not None:
            self.integration.record_at(self._time)

    def _advance_loop(self, steps: int, pause: float) -> None:
        if self.integration is not None:
            self.integration.advance(steps, pause)
            return
        # Without states each sample counts as a step, and the last sample is at `pause`.
        until = max(0, self._sample_times.up_to(pause) - self.begin)
        self._position = min(self._time.size, self._position + steps, max(until, self._position))


def _time(sides: Array) -> float:
    """The time of an instant with the rows ``(2, width)``, s."""
    return float(sides[1, 0])


def first_window(sample_times: SampleTimes, begin: int, window: int | None) -> Array:
    """The sample times of the first window, s."""
    return sample_times.part(begin, min(sample_times.count, begin + (window or sys.maxsize)))


def _breakpoint_sides(breakpoints: Array, sample_times: SampleTimes) -> tuple[Array, Array]:
    """Rows ``(M, 2, 2)`` and numbers of samples ``(M, 2)`` of the breakpoints inside a run."""
    times = np.stack(ends_of_segments(breakpoints, sample_times.start, sample_times.stop)[::-1], axis=1)
    times = times[times[:, 0] < times[:, 1]]
    rows = np.stack([times, np.zeros_like(times)], axis=2)
    ends = [(end * SAME_BELOW, end * SAME_ABOVE) for end in times[:, 1].tolist()]
    sample = np.array([[sample_times.up_to(t) for t in pair] for pair in ends], dtype=np.float64)
    return rows, sample.reshape(-1, 2)
