"""A part of a run with constant parameters, and its recorded samples in memory."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.integration.native_integrator import Integration
from armblocks.integration.run_point import Checkpoint
from armblocks.integration.system import CompiledSystem
from armblocks.integration.workspace import Status
from armblocks.simulation.plan import Instants

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Rows:
    """Recorded samples from number ``begin`` on: ``time (N,)`` s, ``states (N, nx)``, and so on."""

    begin: int
    time: Array
    states: Array
    discrete: Array
    algebraic: Array
    p: Array

    def after(self, number: int) -> Rows:
        """The samples from ``number`` on."""
        skip = max(0, number - self.begin)
        parts = (self.time, self.states, self.discrete, self.algebraic)
        time, states, discrete, algebraic = (part[skip:] for part in parts)
        begin = self.begin + skip
        return Rows(begin=begin, time=time, states=states, discrete=discrete, algebraic=algebraic, p=self.p)

    def signals(self, compiled: CompiledSystem) -> Array:
        """All signals of these samples, ``(ny, N)``."""
        return compiled.evaluate_signals(self.time, self.states, self.discrete, self.algebraic, self.p)


Consumer = Callable[[Rows], None]


class Stretch:
    """Records the samples of a run from number ``begin`` on; without states there is no integration.

    With a ``window`` only that number of samples is in memory. A consumer receives them before the next ones
    replace them. Which step records a sample depends only on its time. A chunk of steps with more samples
    than fit into the window is therefore repeated for the remaining ones.
    """

    def __init__(
        self, instants: Instants, begin: int, p: Array, integration: Integration | None, window: int | None
    ) -> None:
        self.p = p
        self.integration = integration
        self.first = begin
        """Number of the first sample of this part."""
        self.begin = begin
        """Number of the first sample in memory."""
        self.window = window
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
        )

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
            consume(self.rows())
            if self._repeat is not None and self.integration is not None:
                self.integration.back_to(self._repeat[1])
            self._hold(self.begin + self._time.size)
            self._go(steps, pause)
        self._repeat = None
        if self.held > self._time.size // 2:
            consume(self.rows())
            self._hold(self.recorded)

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
