"""A run with snapshots: it can return to a snapshot and continue with identical results.

Simulink's Step Back works the same way: it restores a snapshot. Samples between two snapshots can be
reached as well, because a run that restarts from a snapshot repeats the same steps bit for bit. Tuned
values are not restored: they apply from the time to which the run returns.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.diagram import Diagram
from armblocks.face.diagram_run import DiagramRun, tuned_parameters
from armblocks.face.model import CompiledDiagram
from armblocks.simulation import RunState, Samples, Simulation

Array = NDArray[np.float64]
MAX_BYTES = 64 * 2**20
"""Limit of the memory of all snapshots, bytes; beyond it every second snapshot is removed."""
MIN_SNAPSHOTS = 8


@dataclass(frozen=True)
class Snapshot:
    """State and parameters of a run; ``state`` is ``None`` before the first step."""

    recorded: int
    state: RunState | None
    diagram: Diagram
    parameters: Mapping[str, Array]

    @property
    def time(self) -> float:
        """Time of the snapshot, s."""
        return -math.inf if self.state is None else self.state.time

    @property
    def size(self) -> int:
        """Approximate size, bytes."""
        if self.state is None:
            return 0
        parts = [self.state.states, self.state.discrete, self.state.algebraic, self.state.past]
        if self.state.checkpoint is not None:
            parts += [self.state.checkpoint.reals, self.state.checkpoint.counts]
        return sum(part.nbytes for part in parts)


class RunHistory:
    """One run of a model with snapshots; the numbers of its samples continue after each return."""

    def __init__(self, model: CompiledDiagram) -> None:
        self.run: DiagramRun = model.begin()
        self._snapshots = [Snapshot(0, None, self.run.diagram, self.run.parameters)]
        self._begin = 0
        """Number of the first new sample of ``run``, which restarts at a snapshot."""

    @property
    def recorded(self) -> int:
        """Number of recorded samples."""
        # A resumed run records a sample at its start, which was already recorded before the return.
        return self._begin + max(0, self.run.recorded - (self._begin > 0))

    def samples(self, begin: int) -> Samples:
        """Signals of the recorded samples from number ``begin`` on."""
        samples = self.run.samples(begin - self._begin + (self._begin > 0))
        return dataclasses.replace(samples, begin=begin)

    def add_snapshot(self) -> None:
        """Add a snapshot of the present state."""
        run, snapshots = self.run, self._snapshots
        if run.finished or self.recorded <= snapshots[-1].recorded:
            return
        snapshots.append(Snapshot(self.recorded, run.state(), run.diagram, run.parameters))
        if len(snapshots) > MIN_SNAPSHOTS and sum(snapshot.size for snapshot in snapshots) > MAX_BYTES:
            del snapshots[1:-1:2]

    def step(self) -> None:
        """Advance until at least one more sample is recorded; one solver step may record several."""
        self.add_snapshot()
        before = self.recorded
        while self.recorded == before and not self.run.finished:
            self.run.advance(steps=1)

    def tune(self, values: Mapping[str, object]) -> None:
        """Change parameters from the present time on; raises the errors of :meth:`DiagramRun.set_all`."""
        self.add_snapshot()
        self.run.set_all({path: np.asarray(value, dtype=np.float64) for path, value in values.items()})

    def return_to_sample(self, recorded: int) -> None:
        """Return to the latest state with at most ``recorded`` samples, but not before the first step.

        The present tuned values apply from there on.
        """
        tuned = self.run.diagram
        while len(self._snapshots) > 1 and self._snapshots[-1].recorded > recorded:
            self._snapshots.pop()
        self._resume(self._snapshots[-1])
        # Each step begins with a snapshot: a step that records too many samples is reverted to it.
        while self.recorded < recorded and not self.run.finished:
            self.step()
        if self.recorded > recorded and len(self._snapshots) > 1:
            self._resume(self._snapshots[-1])
        self._tune_to(tuned)

    def return_to_time(self, time: float) -> None:
        """Return to exactly ``time`` (s), which the last step has passed; the step is repeated up to it."""
        while len(self._snapshots) > 1 and self._snapshots[-1].time > time:
            self._snapshots.pop()
        tuned = self.run.diagram
        self._resume(self._snapshots[-1])
        self._tune_to(tuned)
        self.run.advance(time, exactly=True)

    def _resume(self, snapshot: Snapshot) -> None:
        simulation = self.run.simulation
        resumed = Simulation(simulation.compiled, simulation.options, snapshot.parameters, snapshot.state)
        self.run = DiagramRun(snapshot.diagram, resumed)
        self._begin = snapshot.recorded

    def _tune_to(self, diagram: Diagram) -> None:
        """Set the tunable parameters to their values in another version of the diagram."""
        values = tuned_parameters(self.run.diagram, diagram)
        if values and not self.run.finished:
            self.run.simulation.set(values)
            self.run.diagram = diagram
