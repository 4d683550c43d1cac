"""A part of a run with constant parameters, and its recorded samples in memory."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.integration.native_integrator import Checkpoint, Integration
from armblocks.integration.system import CompiledSystem
from armblocks.integration.workspace import Status
from armblocks.simulation.plan import Instants

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Rows:
    """Recorded instants number ``begin`` and on: ``time (N,)`` s, ``states (N, nx)``, and so on."""

    begin: int
    time: Array
    states: Array
    discrete: Array
    algebraic: Array
    p: Array

    def after(self, number: int) -> Rows:
        """Those from instant ``number`` on."""
        skip = max(0, number - self.begin)
        parts = (self.time, self.states, self.discrete, self.algebraic)
        time, states, discrete, algebraic = (part[skip:] for part in parts)
        begin = self.begin + skip
        return Rows(begin=begin, time=time, states=states, discrete=discrete, algebraic=algebraic, p=self.p)

    def signals(self, compiled: CompiledSystem) -> Array:
        """All signals at these instants, ``(ny, N)``."""
        return compiled.evaluate_signals(self.time, self.states, self.discrete, self.algebraic, self.p)


Consumer = Callable[[Rows], None]


class Stretch:
    """Records the instants of a run from number ``begin`` on, integrated or, without states, just told.

    With a ``window`` only so many are held at once: they are handed to a consumer before the next ones take
    their place. Which step records an instant depends on nothing but its time, so a chunk of steps that has
    more instants to record than fit is simply repeated for those that did not.
    """

    def __init__(
        self, instants: Instants, begin: int, p: Array, integration: Integration | None, window: int | None
    ) -> None:
        self.p = p
        self.integration = integration
        self.first = begin
        """Number of its first instant."""
        self.begin = begin
        """Number of the first one that is held."""
        self.window = window
        self._instants = instants
        self._time = first_window(instants, begin, window)
        self._position = 0
        self._repeat: tuple[int, Checkpoint] | None = None

    @property
    def held(self) -> int:
        """How many recorded instants are held."""
        return self._position if self.integration is None else self.integration.recorded

    @property
    def recorded(self) -> int:
        """Number of the first instant that is not recorded yet."""
        return self.begin + self.held

    @property
    def taken(self) -> int:
        """Steps that are done; the instants of a run that integrates nothing."""
        return self.recorded if self.integration is None else self.integration.accepted

    @property
    def time(self) -> float:
        """Time that is reached, s."""
        if self.integration is not None:
            return self.integration.time
        last = max(0, self.recorded - 1)
        return float(self._instants.part(last, last + 1)[0])

    @property
    def status(self) -> Status:
        """Whether it goes on."""
        if self.integration is not None:
            return self.integration.status
        return Status.DONE if self.recorded == self._instants.count else Status.PAUSED

    @property
    def wants_other(self) -> bool:
        """Whether another method would go on better."""
        return self.integration is not None and self.integration.wants_other

    def rows(self, begin: int | None = None) -> Rows:
        """What is held from instant number ``begin`` on: views."""
        start = 0 if begin is None else min(self.held, max(0, begin - self.begin))
        held, run = self.held, self.integration
        nothing = np.empty((held, 0))
        parts = (nothing,) * 3 if run is None else (run.states, run.discrete, run.algebraic)
        states, discrete, algebraic = (part[start:held] for part in parts)
        return Rows(
            begin=self.begin + start,
            # The loop's own: a block that ends the run puts the instant at which it did there.
            time=(self._time if run is None else run.course[1])[start:held],
            states=states,
            discrete=discrete,
            algebraic=algebraic,
            p=self.p,
        )

    def advance(self, steps: int, pause: float, consume: Consumer | None) -> None:
        """Take at most ``steps`` steps, none beginning at ``pause`` (s) or later; hand over full windows."""
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
        """After an interruption amid a chunk: stand where the chunk began, nothing lost and nothing twice."""
        if self._repeat is None or self.integration is None:
            return
        begin, before = self._repeat
        self.integration.back_to(before)
        if begin != self.begin:
            self.integration.record(self._time)
        self._repeat = None

    def _hold(self, begin: int) -> None:
        """Make room for the instants from number ``begin`` on."""
        self._time = first_window(self._instants, begin, self.window)
        self.begin = begin
        self._position = 0
        if self.integration is not None:
            self.integration.record(self._time)

    def _go(self, steps: int, pause: float) -> None:
        if self.integration is not None:
            self.integration.advance(steps, pause)
            return
        # An instant is the step of a system without states; it is at `pause` that the last one is told.
        until = max(0, self._instants.up_to(pause) - self.begin)
        self._position = min(self._time.size, self._position + steps, max(until, self._position))


def first_window(instants: Instants, begin: int, window: int | None) -> Array:
    """The instants that are held first, s."""
    return instants.part(begin, min(instants.count, begin + (window or sys.maxsize)))
