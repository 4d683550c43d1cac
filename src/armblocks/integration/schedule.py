"""The schedule of a run: its division into pieces, and the actions at their ends."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

from armblocks.routines.routine import Part, Stages
from armblocks.routines.values import Boolean, Real

INSTANT, TICKS, START, STEP = "instant", "ticks", "start", "step"
"""Stages of the loop: the events before the ticks at the present time, the ticks and all other events, the
first derivative, a step."""

Trial = Callable[[Real, Real], Real]
"""Emits the stages of a step between two times; returns its length."""


class Schedule(ABC):
    """Emits the limits of a step other than its error estimate, and the actions after an accepted step."""

    @abstractmethod
    def enter(self, stages: Stages) -> None:
        """Continue where the last call stopped."""

    def before_step(self) -> None:  # noqa: B027  # optional
        """Ensure that there is memory for the results of a step."""

    @abstractmethod
    def first_step(self, time: Real) -> None:
        """Choose the length of the first step after a restart."""

    @abstractmethod
    def accept(self, stages: Stages) -> None:
        """Record an accepted step, make its end the new point, and continue at a stage."""

    @abstractmethod
    def take_fixed_step(self, trial: Trial, time: Real, new_time: Real) -> None:
        """Take a fixed step. The state at its end must be finite."""

    @abstractmethod
    def handle_non_finite(self, time: Real, finite: Boolean, accepted: Part) -> None:
        """Handle a step of minimum length whose result is not finite: return, or accept another step by
        leaving the part ``accepted``."""

    def passed_until(self, time: Real, spacing: Real) -> Real:
        """The time up to which grid points of fixed steps count as passed."""
        return time

    def fixed_step_end(self, time: Real, new_time: Real) -> Real:
        """The end of a fixed step, which may be earlier than the next grid point."""
        return new_time

    def next_step_length(self, proposed: Real) -> Real:
        """The length of the step after an accepted step."""
        return proposed
