"""The data of a run: time, every signal by its path, and the statistics of the run."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.equations import Signature, Slot
from armblocks.simulation.jumps import Jumps, JumpTable, merged, merged_states
from armblocks.simulation.signal_names import element_names, signal_path

if TYPE_CHECKING:
    from armblocks.simulation.run_state import RunState

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class RunReport(metaclass=ArgumentErrors):
    """The statistics of a run.

    - ``solver``: name of the integrator, ``"none"`` without integration.
    - ``reason``: reason for its choice.
    - ``steps``, ``rejected``: numbers of accepted and rejected steps.
    - ``evaluations``: number of evaluations of the derivative.
    - ``ticks``: number of times at which a clock ticked.
    - ``events``: number of guards that fired.
    - ``calls``: number of calls of Python functions at ticks.
    - ``call_time``: time in these calls, s.
    - ``preparation_time``: time to compile or load the native code, s.
    - ``wall_time``: time of the run itself, s.
    - ``real_time_factor``: simulated time over ``wall_time``.
    - ``complete``: whether the stop time was reached.
    - ``message``: remarks for the user (reason of the end, stiffness), else empty.
    """

    solver: str
    reason: str
    steps: int = 0
    rejected: int = 0
    evaluations: int = 0
    ticks: int = 0
    events: int = 0
    calls: int = 0
    call_time: float = 0.0
    preparation_time: float = 0.0
    wall_time: float = 0.0
    real_time_factor: float = 0.0
    complete: bool = True
    message: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class ParameterChange:
    """A change of tunable parameters, ``block.parameter``, to new ``values`` at a ``time`` (s) of the run."""

    time: float
    values: Mapping[str, Array]


@dataclass(frozen=True, kw_only=True)
class LoggedFile:
    """A log file with all ``rows`` of a run; the result has a selection of these rows."""

    path: Path
    rows: int


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class RunData(metaclass=ArgumentErrors):
    """Signals of one run. ``result["block/port"]`` is ``(N, *shape)``, a view.

    - ``time`` (N,) s.
    - ``signals`` (ny, N): ``signals_layout`` has the names, shapes and units of its rows.
    - ``states`` (N, nx): ``states_layout`` has the names of its columns.
    - ``parameters``: the values at the end of the run, after ``parameter_changes``.
    - ``final_state``: the state from which another run continues; ``None`` for a failed run.
    - ``given_jumps``: both sides of each jump between the samples.
    - ``log``: the log file, if any. The result then has a selection of the file's rows with all extremes of
      the logged signals.
    """

    name: str
    time: Array
    signals_layout: Signature
    signals: Array
    states_layout: Signature
    states: Array
    parameters_layout: Signature
    parameter_values: Array
    aliases: Mapping[str, str]
    run: RunReport
    final_state: RunState | None = None
    parameter_changes: tuple[ParameterChange, ...] = ()
    log: LoggedFile | None = None
    given_jumps: Jumps | None = None

    @property
    def jumps(self) -> Jumps:
        """The instants at which signals jump, with the left limits and the values."""
        if self.given_jumps is not None:
            return self.given_jumps
        table = JumpTable.empty(self.signals_layout.size, self.states.shape[1])
        return Jumps(self.signals_layout, self.aliases, table)

    def with_jumps(self) -> Self:
        """The result with two more rows for each jump: at the same time, the left limits, then the values.

        A sample at the time of a jump is the second row. Files and figures have these rows. The times ascend,
        but not strictly.
        """
        jumps = self.jumps.table
        time, signals = merged(self.time, self.signals, jumps)
        states = merged_states(self.time, self.states, jumps)
        return dataclasses.replace(self, time=time, states=states, signals=signals, given_jumps=None)

    @property
    def names(self) -> tuple[str, ...]:
        """Paths of all signals, ``block/port``, in evaluation order."""
        return self.signals_layout.names

    @property
    def units(self) -> Mapping[str, str]:
        """SI unit of every signal, ``""`` if it has none."""
        return {slot.name: slot.unit for slot in self.signals_layout}

    @property
    def parameters(self) -> Mapping[str, Array]:
        """The value of every tunable parameter, ``block.parameter``, in the run."""
        return self.parameters_layout.unpack(self.parameter_values)

    def resolve(self, name: str) -> str:
        """The path of a signal. ``name`` is a path, a block with one output, or an input port that it drives.

        Raises ``UnknownNameError`` with the nearest name.
        """
        return signal_path(name, self.signals_layout, self.aliases, self.name)

    def __getitem__(self, name: str) -> Array:
        path = self.resolve(name)
        place = self.signals_layout.ranges[path]
        return self.signals[place].T.reshape(self.time.size, *self.signals_layout[path].shape)

    def __contains__(self, name: object) -> bool:
        return name in self.signals_layout.ranges or name in self.aliases

    def select(self, names: Mapping[str, str], rows: slice = slice(None)) -> Self:
        """A result with some signals, ``{new name: path}``, and a slice of the samples.

        Raises ``UnknownNameError`` for a path that does not exist.
        """
        slots: list[Slot] = []
        places: list[Array] = []
        for name, path in names.items():
            signal_name = self.resolve(path)
            slots.append(dataclasses.replace(self.signals_layout[signal_name], name=name))
            places.append(self.signals[self.signals_layout.ranges[signal_name]])
        return dataclasses.replace(
            self,
            time=self.time[rows],
            signals_layout=Signature(tuple(slots)),
            signals=np.concatenate(places)[:, rows] if places else np.empty((0, self.time[rows].size)),
            states=self.states[rows],
            aliases={},
            given_jumps=self._selected_jumps(slots, names.values(), self.time[rows]),
        )

    def _selected_jumps(self, slots: list[Slot], paths: Iterable[str], time: Array) -> Jumps:
        """The jumps of some signals between the first and the last of some samples."""
        jumps, ranges = self.jumps, [self.signals_layout.ranges[self.resolve(path)] for path in paths]
        indices = np.array([k for part in ranges for k in range(part.start, part.stop)], dtype=np.intp)
        begin, end = (float(time[0]), float(time[-1])) if time.size else (0.0, 0.0)
        return Jumps(Signature(tuple(slots)), {}, lambda: jumps.table.selected(indices, begin, end))

    def columns(self) -> tuple[str, ...]:
        """A name for each scalar of ``signals``: ``clock/y``, ``rne/tau[link2]``, ``fkine/T[0,3]``.

        Entries of joint vectors have the names of the joints.
        """
        return tuple(name for slot in self.signals_layout for name in element_names(slot))
