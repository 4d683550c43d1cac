"""A run with checkpoints: it can return to one and continue with identical results.

Simulink's Step Back works the same way: it restores a snapshot. Here the instants between two marks can be
reached as well, because a run from a mark to there repeats the same steps bit for bit. Tuned values are not
taken back: they hold from the instant to which the run has returned.
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
MOST_BYTES = 64 * 2**20
"""All marks together; when they are more, every second one goes."""
FEWEST_MARKS = 8


@dataclass(frozen=True)
class Mark:
    """Where a run stood, with the values of then; ``state`` is ``None`` before its first step."""

    recorded: int
    state: RunState | None
    diagram: Diagram
    parameters: Mapping[str, Array]

    @property
    def time(self) -> float:
        """Time at which the run stood, s."""
        return -math.inf if self.state is None else self.state.time

    @property
    def size(self) -> int:
        """Bytes, roughly."""
        if self.state is None:
            return 0
        parts = [self.state.states, self.state.discrete, self.state.algebraic, self.state.past]
        if self.state.checkpoint is not None:
            parts += [self.state.checkpoint.reals, self.state.checkpoint.counts]
        return sum(part.nbytes for part in parts)


class RunHistory:
    """One run of a model, with marks at which it can be taken up again; instants are numbered through."""

    def __init__(self, model: CompiledDiagram) -> None:
        self.run: DiagramRun = model.begin()
        self._marks = [Mark(0, None, self.run.diagram, self.run.parameters)]
        self._begin = 0
        """Number of the first instant of the present run that is new."""

    @property
    def recorded(self) -> int:
        """How many instants are recorded so far."""
        # A run that goes on records first the instant at which it begins: it is there already.
        return self._begin + max(0, self.run.recorded - (self._begin > 0))

    def samples(self, begin: int) -> Samples:
        """Signals at the recorded instants from number ``begin`` on."""
        fresh = self.run.samples(begin - self._begin + (self._begin > 0))
        return dataclasses.replace(fresh, begin=begin)

    def mark(self) -> None:
        """Remember where the run stands."""
        run, marks = self.run, self._marks
        if run.finished or self.recorded <= marks[-1].recorded:
            return
        marks.append(Mark(self.recorded, run.state(), run.diagram, run.parameters))
        if len(marks) > FEWEST_MARKS and sum(mark.size for mark in marks) > MOST_BYTES:
            del marks[1:-1:2]

    def step(self) -> None:
        """Go on until at least one more instant is recorded: a step of the solver may record several."""
        self.mark()
        before = self.recorded
        while self.recorded == before and not self.run.finished:
            self.run.advance(steps=1)

    def tune(self, path: str, value: object) -> None:
        """Change a parameter from here on; raises what :meth:`DiagramRun.set` raises."""
        self.mark()
        self.run.set(path, np.asarray(value, dtype=np.float64))

    def back_to(self, recorded: int) -> None:
        """Stand as late as possible where at most so many instants were recorded, at least those of one step.

        The values that are tuned now hold from there on.
        """
        tuned = self.run.diagram
        while len(self._marks) > 1 and self._marks[-1].recorded > recorded:
            self._marks.pop()
        self._resume(self._marks[-1])
        # Step by step: the step that would go too far is taken back by its own mark.
        while self.recorded < recorded and not self.run.finished:
            self.step()
        if self.recorded > recorded and len(self._marks) > 1:
            self._resume(self._marks[-1])
        self._tune_to(tuned)

    def stand_at(self, time: float) -> None:
        """Stand exactly at a time (s) beyond which the last step went: it is taken again, up to there."""
        while len(self._marks) > 1 and self._marks[-1].time > time:
            self._marks.pop()
        tuned = self.run.diagram
        self._resume(self._marks[-1])
        self._tune_to(tuned)
        self.run.advance(time, exactly=True)

    def _resume(self, mark: Mark) -> None:
        simulation = self.run.simulation
        again = Simulation(simulation.compiled, simulation.options, mark.parameters, mark.state)
        self.run = DiagramRun(mark.diagram, again)
        self._begin = mark.recorded

    def _tune_to(self, diagram: Diagram) -> None:
        """Give the tunable parameters the values that they have in another form of the diagram."""
        values = tuned_parameters(self.run.diagram, diagram)
        if values and not self.run.finished:
            self.run.simulation.set(values)
            self.run.diagram = diagram
