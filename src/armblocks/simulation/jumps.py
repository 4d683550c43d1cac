"""Jumps of signals: the left limit and the value at every instant at which a signal jumps.

The native loop records states and discrete variables on both sides of each instant (tick, event, breakpoint,
delayed jump). The signals are computed from these at first use, because most runs need only the samples.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from armblocks.equations import Signature
from armblocks.errors import counted
from armblocks.integration.records import row_width
from armblocks.integration.run_point import RunPoint
from armblocks.integration.system import CompiledSystem
from armblocks.simulation.signal_names import signal_path

Array = NDArray[np.float64]
Booleans = NDArray[np.bool_]
Places = NDArray[np.intp]

MAX_NUMBERS = 20_000_000
"""Maximum number of doubles for the states and signals on both sides of the recorded instants, 160 MB."""
MIN_JUMP = 1e-9
"""A change is a jump if it exceeds this fraction of the largest absolute value of the signal so far. Rounding
and the location of events cause smaller changes."""


def max_sides(compiled: CompiledSystem) -> int:
    """Maximum number of recorded sides of instants."""
    return max(64, MAX_NUMBERS // (row_width(compiled.sizes) + compiled.signals_layout.size))


@dataclass(frozen=True, kw_only=True)
class Side:
    """One side of M instants: ``states (M, nx)`` and ``signals (ny, M)``."""

    states: Array
    signals: Array

    def selected(self, instants: Booleans, rows: slice | Places = slice(None)) -> Side:
        """Some of the instants and rows of the signals."""
        return Side(states=self.states[instants], signals=self.signals[rows][:, instants])


@dataclass(frozen=True, kw_only=True)
class JumpTable:
    """M instants: ``time (M,)`` s, left limits, values, and the signals that jump, ``jumping (ny, M)``."""

    time: Array
    before: Side
    after: Side
    jumping: Booleans

    @staticmethod
    def empty(signals: int, states: int) -> JumpTable:
        """A table without jumps."""
        empty_side = Side(states=np.empty((0, states)), signals=np.empty((signals, 0)))
        jumping = np.empty((signals, 0), dtype=np.bool_)
        return JumpTable(time=np.empty(0), before=empty_side, after=empty_side, jumping=jumping)

    def selected(self, rows: Places | slice, begin: float, end: float) -> JumpTable:
        """The instants after ``begin`` up to ``end`` (s) at which a signal of ``rows`` jumps."""
        jumping: Booleans = self.jumping[rows]
        instants: Booleans = jumping.any(axis=0) & (self.time > begin) & (self.time <= end)
        return JumpTable(
            time=self.time[instants],
            before=self.before.selected(instants, rows),
            after=self.after.selected(instants, rows),
            jumping=jumping[:, instants],
        )


class Jumps:
    """The instants at which recorded signals jump, with both sides of each.

    ``jumps.time (M,)`` s. ``jumps["block/port"]`` are the jumps of one signal: times ``(K,)``, left limits
    and values ``(K, *shape)``. The signals are evaluated at the first use.
    """

    def __init__(
        self, layout: Signature, aliases: Mapping[str, str], table: JumpTable | Callable[[], JumpTable]
    ) -> None:
        self.layout = layout
        self._aliases = aliases
        self._table = table

    def __reduce__(self) -> tuple[object, ...]:
        return Jumps, (self.layout, dict(self._aliases), self.table)

    @cached_property
    def table(self) -> JumpTable:
        """Both sides of all signals."""
        return self._table if isinstance(self._table, JumpTable) else self._table()

    @property
    def time(self) -> Array:
        """Times at which at least one signal jumps, ``(M,)`` s."""
        return self.table.time

    def __len__(self) -> int:
        return self.time.size

    def __getitem__(self, name: str) -> tuple[Array, Array, Array]:
        path = signal_path(name, self.layout, self._aliases, "jumps")
        rows, table = self.layout.ranges[path], self.table
        instants = table.jumping[rows].any(axis=0)
        shape = self.layout[path].shape
        before, after = (
            side.signals[rows][:, instants].T.reshape(-1, *shape) for side in (table.before, table.after)
        )
        return table.time[instants], before, after

    def __repr__(self) -> str:
        return f"<Jumps of {counted(len(self.layout), 'signal')} at {counted(len(self), 'instant')}>"


@dataclass(frozen=True, kw_only=True)
class InstantRows:
    """Both sides of M instants of one part of a run, before the signals are evaluated.

    ``rows (M, 2, 2 + nx + nz + nw)`` are the rows that the native loop records; ``sample (M, 2)`` is the
    number of samples of the run before each side. ``change``: the point and the parameters before a change of
    parameters, if the first instant is such a change.
    """

    rows: Array
    sample: NDArray[np.int64]
    p: Array
    change: tuple[RunPoint, Array] | None = None

    def sides(self, compiled: CompiledSystem) -> tuple[Side, Side]:
        """The left limits and the values."""
        left, right = (_side(compiled, self.rows[:, side], self.p) for side in (0, 1))
        if self.change is not None:
            point, p = self.change
            row = np.concatenate([[point.time, 0.0], point.x, point.z, point.w])
            before = _side(compiled, row[np.newaxis], p)
            left.signals[:, :1], left.states[:1] = before.signals, before.states
        return left, right


def _side(compiled: CompiledSystem, rows: Array, p: Array) -> Side:
    sizes = compiled.sizes
    places = np.cumsum([1, 1, sizes.states, sizes.discrete])
    time, _, *parts = (np.ascontiguousarray(part) for part in np.split(rows, places, axis=1))
    states, discrete, algebraic = parts
    return Side(states=states, signals=compiled.evaluate_signals(time[:, 0], states, discrete, algebraic, p))


class JumpSearch:
    """Finds the jumps of consecutive parts of a run."""

    def __init__(self, compiled: CompiledSystem) -> None:
        self._compiled = compiled
        self._largest = np.zeros(compiled.signals_layout.size)
        """The largest absolute value of each signal in the previous parts."""

    def find(
        self, parts: Sequence[InstantRows], begin: int, time: Array, signals: Array, previous: float
    ) -> JumpTable:
        """The jumps at the instants of samples ``begin`` to ``begin + N - 1``: ``time (N,)`` s and
        ``signals (ny, N)``.

        ``previous`` is the time of the sample before them, s. An instant with a signal that is not finite is
        omitted.
        """
        parts = [part for part in parts if len(part.rows)]
        if not parts:
            self._update_largest(signals)
            return JumpTable.empty(len(signals), self._compiled.states.size)
        sides = [part.sides(self._compiled) for part in parts]
        before, after = (
            Side(
                states=np.concatenate([pair[side].states for pair in sides]),
                signals=np.concatenate([pair[side].signals for pair in sides], axis=1),
            )
            for side in (0, 1)
        )
        sample = np.concatenate([part.sample for part in parts]) - begin
        rows = np.concatenate([part.rows for part in parts])
        jumping = self._jumping_signals(signals, sample[:, 0], before.signals, after.signals)
        instants = np.asarray(jumping.any(axis=0))
        return JumpTable(
            time=_times(rows[:, 1, 0], sample, time, previous)[instants],
            before=before.selected(instants),
            after=after.selected(instants),
            jumping=jumping[:, instants],
        )

    def _jumping_signals(
        self, signals: Array, sample: NDArray[np.int64], before: Array, after: Array
    ) -> Booleans:
        """Whether each signal jumps at each instant, ``(ny, M)``."""
        finite = (np.isfinite(before) & np.isfinite(after)).all(axis=0)
        jumping = (before != after) & finite
        for row in np.flatnonzero(jumping.any(axis=1)):
            sizes = np.maximum.accumulate(np.abs(signals[row]))
            largest = np.where(sample > 0, sizes[np.maximum(sample, 1) - 1], 0.0)
            sides = np.maximum(np.abs(before[row]), np.abs(after[row]))
            sides = np.maximum.accumulate(np.where(finite, sides, 0.0))
            largest = np.maximum(np.maximum(largest, sides), self._largest[row])
            jumping[row] &= np.abs(after[row] - before[row]) > MIN_JUMP * largest
        self._update_largest(signals)
        return jumping

    def _update_largest(self, signals: Array) -> None:
        if signals.shape[1]:
            self._largest = np.fmax(self._largest, np.abs(signals).max(axis=1))


def _times(instants: Array, sample: NDArray[np.int64], time: Array, previous: float) -> Array:
    """The times of jumps, s: the time of the sample at the instant, else the time of the instant.

    A sample just before a change of parameters has the time of the change and the old values. The jump is
    then at the next double, so that the sample belongs to the time before it.
    """
    first, last = sample[:, 0], sample[:, 1]
    times = np.where(last > first, time[first], instants)
    earlier = np.where(first > 0, time[np.maximum(first, 1) - 1], previous)
    return np.clip(times, np.nextafter(earlier, np.inf), time[first])


def merged(time: Array, signals: Array, jumps: JumpTable) -> tuple[Array, Array]:
    """Times ``(R,)`` and signals ``(ny, R)`` of samples and jumps.

    A jump has two rows with the same time: the left limits, then the values. The second row is the sample at
    that time, if there is one.
    """
    order = _TimeOrder(time, jumps.time)
    return order.times, order.merged(signals, jumps.before.signals, jumps.after.signals)


def merged_states(time: Array, states: Array, jumps: JumpTable) -> Array:
    """States ``(R, nx)`` in the order of :func:`merged`."""
    return _TimeOrder(time, jumps.time).merged(states.T, jumps.before.states.T, jumps.after.states.T).T


class _TimeOrder:
    """The order of samples and both sides of jumps by time."""

    def __init__(self, time: Array, jumps: Array) -> None:
        self.times = time
        self._order: NDArray[np.intp] | None = None
        if not jumps.size:
            return
        self._without_sample = time[np.minimum(np.searchsorted(time, jumps), time.size - 1)] != jumps
        times = np.concatenate([time, jumps, jumps[self._without_sample]])
        left = np.zeros(times.size, dtype=np.bool_)
        left[time.size : time.size + jumps.size] = True
        self._order = np.lexsort((~left, times))
        self.times = times[self._order]

    def merged(self, samples: Array, before: Array, after: Array) -> Array:
        """Columns of samples and of both sides of the jumps in this order."""
        if self._order is None:
            return samples
        return np.concatenate([samples, before, after[:, self._without_sample]], axis=1)[:, self._order]
