"""Clocks of a loop: tick times and updates.

Tick ``k`` of a clock is at ``offset + k period``. Times are computed from ``k`` and never accumulated.
"""

from __future__ import annotations

from collections.abc import Sequence

from armblocks.integration import system_functions
from armblocks.integration.evaluation import Evaluation
from armblocks.integration.frame import SAME_ABOVE, Frame
from armblocks.integration.workspace import Count, Scalar, Stage, Status
from armblocks.routines.arithmetic import select
from armblocks.routines.memory import RealVariable
from armblocks.routines.values import Boolean, Real

ALL_LEVELS, FIRST_LEVEL = 1.0, 2.0
"""Marks of a clock that ticks: for all its blocks, and for its blocks on the first level of ticks."""


class Clocks:
    """Emits the code for ticks. ``point`` is the variable that holds the time of an evaluation."""

    def __init__(self, frame: Frame, evaluation: Evaluation, point: RealVariable) -> None:
        self.frame = frame
        self.evaluation = evaluation
        self.point = point
        self.count = len(frame.sizes.clocks)
        self.numbers = frame.counts.after(Count.END)
        """The number of the next tick of every clock."""
        self.ticking = frame.vector(frame.workspace.ticking)

    def next_tick(self, clock: int) -> Real:
        """The time of the next tick of a clock."""
        period, offset = self.frame.sizes.clocks[clock]
        product = self.numbers[clock].to_real() * period
        return product if offset == 0.0 else product + offset

    def capture(self, time: Real) -> None:
        """Call ``update`` without a marked clock, with the left limits of the states and the old ``z``.

        At the start of the run there is no left limit: ``z`` keeps its initial values.
        """
        if not self.frame.sizes.captures:
            return
        with self.frame.r.unless(self.frame.counts[Count.AT_START] != 0):
            for clock in range(self.count):
                self.ticking[clock] = 0.0
            self.point.value = self.frame.just_before(time)
            self.update()

    def due(self, until: Real) -> tuple[list[Boolean], Boolean | None]:
        """Whether each clock ticks up to ``until``, and whether any does; the number of its next tick
        increases."""
        due: list[Boolean] = []
        any_due: Boolean | None = None
        for clock in range(self.count):
            ticks = self.next_tick(clock) <= until
            self.numbers[clock] = self.numbers[clock] + ticks.count()
            any_due = ticks if any_due is None else any_due | ticks
            due.append(ticks)
        return due, any_due

    def tick(self, time: Real, due: Sequence[Boolean], level: int | None = None) -> None:
        """Mark these clocks, for one level or for all, and update ``z``."""
        mark = ALL_LEVELS if level is None else FIRST_LEVEL + level
        for clock, ticks in enumerate(due):
            self.ticking[clock] = select(ticks, mark, 0.0)
        self.point.value = time
        self.update()

    def update(self) -> None:
        """Set ``z`` to the result of ``update`` for the marked clocks."""
        f, workspace = self.frame, self.frame.workspace
        x, z, unknowns, new_z = (
            f.vector(place) for place in (workspace.x, workspace.z, workspace.trial_w, workspace.new_z)
        )
        t = self.point.memory
        self.evaluation.solve(t, x)
        f.r.call(system_functions.update, t, x, z, unknowns, f.p, self.ticking, new_z)
        f.copy(workspace.new_z, workspace.z, f.sizes.discrete)

    def pause_before_ticks(self, time: Real) -> None:
        """Return before the ticks at ``time`` if the caller requested a pause at this time or earlier.

        The next call continues with the ticks.
        """
        if not self.count:
            return
        f = self.frame
        with f.r.when(time * SAME_ABOVE >= f.reals[Scalar.HALT]):
            self.point.value = time
            self.evaluation.solve(self.point.memory, f.vector(f.workspace.x))
            self.evaluation.accept_unknowns()
            f.count[Count.STAGE].value = Stage.TICKS
            f.leave(Status.PAUSED)
