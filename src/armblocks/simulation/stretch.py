"""A part of a run with constant parameters, and its recorded samples in memory."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.integration.frame import SAME_ABOVE
from armblocks.integration.native_integrator import Integration
from armblocks.integration.run_point import NO_NUMBERS, Checkpoint, RunPoint
from armblocks.integration.system import CompiledSystem
from armblocks.integration.workspace import Status
from armblocks.simulation.jumps import InstantRows
from armblocks.simulation.plan import Instants

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, kw_only=True)
class Rows:
    """Recorded samples from number ``begin`` on: ``time (N,)`` s, ``states (N, nx)``, and so on.

    ``instants()`` are both sides of the instants between these samples. ``previous`` is the time of the
    sample before them, s.
    """

    begin: int
    time: Array
    states: Array
    discrete: Array
    algebraic: Array
    p: Array
    instants: Callable[[], InstantRows]
    previous: float = -np.inf

    def after(self, number: int) -> Rows:
        """The samples from ``number`` on."""
        skip = max(0, number - self.begin)
        parts = (self.time, self.states, self.discrete, self.algebraic)
        time, states, discrete, algebraic = (part[skip:] for part in parts)
        return Rows(
            begin=self.begin + skip,
            time=time,
            states=states,
            discrete=discrete,
            algebraic=algebraic,
            p=self.p,
            instants=self.instants,
            previous=float(self.time[skip - 1]) if skip else self.previous,
        )

    def signals(self, compiled: CompiledSystem) -> Array:
        """All signals of these samples, ``(ny, N)``."""
        return compiled.evaluate_signals(self.time, self.states, self.discrete, self.algebraic, self.p)


Consumer = Callable[[Rows], None]
Change = tuple[RunPoint, Array]
"""The point and the parameters before a change of parameters."""


class Stretch:
    """Records the samples of a run from number ``begin`` on; without states there is no integration.

    With a ``window`` only that number of samples is in memory. A consumer receives them before the next ones
    replace them. Which step records a sample depends only on its time. A chunk of steps with more samples
    than fit into the window is therefore repeated for the remaining ones.
    """

    def __init__(
        self,
        instants: Instants,
        begin: int,
        p: Array,
        integration: Integration | None,
        window: int | None,
        change: Change | None = None,
        breakpoints: Array = NO_NUMBERS,
    ) -> None:
        """``change``: the point and the parameters before, if this part begins with a change of parameters.
        ``breakpoints``: jumps of sources, s; without integration they are recorded here."""
        self.p = p
        self.integration = integration
        self.first = begin
        """Number of the first sample of this part."""
        self.begin = begin
        """Number of the first sample in memory."""
        self.window = window
        self._change = change
        self._start = None if integration is None else integration.start_of_jumps
        self._breakpoints = _sides_of(breakpoints, instants) if integration is None else None
        self._delivered = instants.start * SAME_ABOVE if begin == 0 else -np.inf
        """Instants up to this time (s) belong to another run or were received by a consumer."""
        self._instants = instants
        self._time = first_window(instants, begin, window)
        self._position = 0
        self._repeat: tuple[int, Checkpoint] | None = None

    @property
    def held(self) -> int:
        """Number of recorded samples in memory."""
        return self._position if self.integration is None else self.integration.recorded

    @property
    def recorded(self) -> int:
        """Number of the first sample that is not recorded yet."""
        return self.begin + self.held

    @property
    def taken(self) -> int:
        """Number of accepted steps; without integration, the number of recorded samples."""
        return self.recorded if self.integration is None else self.integration.accepted

    @property
    def time(self) -> float:
        """Present time of the run, s."""
        if self.integration is not None:
            return self.integration.time
        last = max(0, self.recorded - 1)
        return float(self._instants.part(last, last + 1)[0])

    @property
    def status(self) -> Status:
        """Whether the run is paused or has ended, and why."""
        if self.integration is not None:
            return self.integration.status
        return Status.DONE if self.recorded == self._instants.count else Status.PAUSED

    @property
    def wants_other(self) -> bool:
        """Whether another method is faster from here on."""
        return self.integration is not None and self.integration.wants_other

    def rows(self, begin: int | None = None) -> Rows:
        """The samples in memory from number ``begin`` on, as views."""
        start = 0 if begin is None else min(self.held, max(0, begin - self.begin))
        held, run = self.held, self.integration
        nothing = np.empty((held, 0))
        parts = (nothing,) * 3 if run is None else (run.states, run.discrete, run.algebraic)
        states, discrete, algebraic = (part[start:held] for part in parts)
        return Rows(
            begin=self.begin + start,
            # The times of the loop, because a block that ends the run adds the time of the end to them.
            time=(self._time if run is None else run.course[1])[start:held],
            states=states,
            discrete=discrete,
            algebraic=algebraic,
            p=self.p,
            instants=self._instant_rows,
            previous=self._previous(self.begin + start),
        )

    def _previous(self, number: int) -> float:
        """The time of the sample before sample ``number``, s."""
        return float(self._instants.part(number - 1, number)[0]) if number else -np.inf

    def _instant_rows(self) -> InstantRows:
        """The instants of this part that are in memory and were not received by a consumer."""
        rows, sample, change = self._native_rows()
        new = rows[:, 1, 0] > self._delivered
        if change is not None:
            new[0] = self._delivered == -np.inf
            change = change if new[0] else None
        return InstantRows(rows=rows[new], sample=sample[new], p=self.p, change=change)

    def _native_rows(self) -> tuple[Array, Integers, Change | None]:
        """Rows ``(M, 2, width)`` and numbers of samples ``(M, 2)``. The start of a run is not an instant with
        two sides; a change of parameters is one, and comes first."""
        if self._breakpoints is not None:
            rows, sample = self._breakpoints
            later = sample[:, 0] >= self.first
            rows, sample = rows[later], sample[later]
        else:
            assert self.integration is not None
            rows = self.integration.jumps.rows
            sample = rows[:, :, 1].astype(np.int64) + self.begin
            if self._start is not None and len(rows) and rows[0, 1, 0] == self._start:
                if self._change is not None:
                    return rows, sample, self._change
                rows, sample = rows[1:], sample[1:]
        if self._change is None:
            return rows, sample, None
        point = self._change[0]
        both = np.concatenate([[point.time, 0.0], point.x])[np.newaxis, np.newaxis].repeat(2, axis=1)
        first = np.full((1, 2), self.first)
        return np.concatenate([both, rows]), np.concatenate([first, sample]), self._change

    def advance(self, steps: int, pause: float, consume: Consumer | None) -> None:
        """Take at most ``steps`` steps that begin before ``pause`` (s); pass full windows to ``consume``."""
        if consume is None:
            self._go(steps, pause)
            return
        self.settle()
        if self.integration is not None:
            self._repeat = (self.begin, self.integration.now())
        self._go(steps, pause)
        while self.held == self._time.size and self.recorded < self._instants.count:
            self._deliver(consume)
            if self._repeat is not None and self.integration is not None:
                self.integration.back_to(self._repeat[1])
            self._hold(self.begin + self._time.size)
            self._go(steps, pause)
        self._repeat = None
        jumps = 0 if self.integration is None else len(self.integration.jumps.rows)
        if self.held and self.held + jumps > self._time.size // 2:
            self._deliver(consume)
            if self.integration is not None:
                self.integration.jumps.drop(self.held)
            self._hold(self.recorded)

    def _deliver(self, consume: Consumer) -> None:
        """Pass the window to the consumer."""
        rows = self.rows()
        consume(rows)
        delivered = rows.instants().between(rows.begin, rows.begin + rows.time.size).rows
        if len(delivered):
            self._delivered = float(delivered[-1, 1, 0])

    def settle(self) -> None:
        """After an interruption within a chunk: return to the start of the chunk, so that it can be
        repeated."""
        if self._repeat is None or self.integration is None:
            return
        begin, before = self._repeat
        self.integration.back_to(before)
        if begin != self.begin:
            self.integration.record(self._time)
        self._repeat = None

    def _hold(self, begin: int) -> None:
        """Make room for the samples from number ``begin`` on."""
        self._time = first_window(self._instants, begin, self.window)
        self.begin = begin
        self._position = 0
        if self.integration is not None:
            self.integration.record(self._time)

    def _go(self, steps: int, pause: float) -> None:
        if self.integration is not None:
            self.integration.advance(steps, pause)
            return
        # Without states each sample counts as a step, and the last one is at `pause`.
        until = max(0, self._instants.up_to(pause) - self.begin)
        self._position = min(self._time.size, self._position + steps, max(until, self._position))


def first_window(instants: Instants, begin: int, window: int | None) -> Array:
    """The sample times of the first window, s."""
    return instants.part(begin, min(instants.count, begin + (window or sys.maxsize)))


def _sides_of(breakpoints: Array, instants: Instants) -> tuple[Array, Integers]:
    """Rows ``(M, 2, 2)`` and numbers of samples ``(M, 2)`` of the breakpoints inside a run."""
    inside = sorted({float(time) for time in breakpoints if instants.start < time <= instants.stop})
    times = np.array([[math.nextafter(time, -math.inf), time] for time in inside]).reshape(-1, 2)
    rows = np.stack([times, np.zeros_like(times)], axis=2)
    sample = np.array([[instants.up_to(t) for t in pair] for pair in times.tolist()], dtype=np.int64)
    return rows, sample.reshape(-1, 2)
