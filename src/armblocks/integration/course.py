"""The course of a run: its division into pieces, and the actions between two pieces."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

from armblocks.integration.workspace import Stage
from armblocks.routines.routine import Part, Stages
from armblocks.routines.values import Boolean, Real

INSTANT, START, STEP = "instant", "start", "step"
"""Stages of the loop: ticks and events at the time reached, the first derivative, a step."""
STAGE = {Stage.INSTANT: INSTANT, Stage.START: START, Stage.RUNNING: STEP}

Trial = Callable[[Real, Real], Real]
"""Emits the stages of a step between two times; returns its length."""


class Course(ABC):
    """Emits the bounds of a step that do not come from its error, and the actions after an accepted step."""

    @abstractmethod
    def enter(self, stages: Stages) -> None:
        """Continue where the last call stopped."""

    def before_step(self) -> None:  # noqa: B027  # a flow leaves nothing
        """Make sure that there is memory for the results of a step."""

    @abstractmethod
    def first_step(self, time: Real) -> None:
        """Choose the length of the step after a start."""

    @abstractmethod
    def accept(self, stages: Stages) -> None:
        """Record an accepted step, make its end the new point, and continue at a stage."""

    @abstractmethod
    def try_finite(self, trial: Trial, time: Real, new_time: Real) -> None:
        """Try a fixed step whose end must be finite."""

    @abstractmethod
    def not_finite(self, time: Real, finite: Boolean, accepted: Part) -> None:
        """Handle a step of minimum length whose result is not finite: return, or leave ``accepted``."""

    def passed(self, time: Real, spacing: Real) -> Real:
        """Grid points of fixed steps up to the returned time count as passed."""
        return time

    def bounded(self, time: Real, new_time: Real) -> Real:
        """The end of a fixed step, which may be earlier than the next grid point."""
        return new_time

    def next_length(self, proposed: Real) -> Real:
        """The length of the step after an accepted one."""
        return proposed
