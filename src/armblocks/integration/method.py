"""The common part of one-step methods: evaluations, error norm, first step, dense output.

The code works on vectors of ``n`` states in the workspace: the old state ``x``, the new state ``y`` and the
rows of ``K``. The enclosing loop makes all decisions.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

from armblocks.integration.butcher_tableau import Row
from armblocks.integration.evaluation import Evaluation
from armblocks.integration.frame import Frame
from armblocks.integration.rosenbrock_tableau import Tableau
from armblocks.integration.step_sums import StepSums, change_to, interpolate
from armblocks.integration.workspace import Count, Scalar
from armblocks.routines.arithmetic import minimum
from armblocks.routines.memory import Reals
from armblocks.routines.values import Boolean, Real


class Method(ABC):
    """Emits the arithmetic of the steps of a ``tableau`` into the routine of a loop."""

    short_checks: int
    """Number of checks with a needlessly short step after which a run counts as limited to its minimum
    step."""

    def __init__(self, frame: Frame, tableau: Tableau, evaluation: Evaluation) -> None:
        self.frame = frame
        self.r = frame.r
        self.tableau = tableau
        self.evaluation = evaluation
        self.n = frame.n
        self.x = frame.vector(frame.workspace.x)
        self.y = frame.vector(frame.workspace.y)
        self._point = frame.r.real(0.0)
        rtol, atol = frame.reals[Scalar.RTOL], frame.reals[Scalar.ATOL]
        self.sums = StepSums(self.r, self.n, self.x, self.y, self.K, self.r.constant, rtol, atol)

    def K(self, row: int) -> Reals:
        """One row of the stage derivatives."""
        return self.frame.vector(self.frame.workspace.stage_derivative(row))

    # The step.

    def prepare(self, time: Real) -> None:  # noqa: B027  # most methods have no such part
        """Compute the part of a step that does not depend on its length."""

    @abstractmethod
    def stages(self, time: Real, h: Real, new_time: Real) -> None:
        """Compute all stages. The new state is written to y, its derivative to row ``end_row`` of K."""

    @property
    def has_extra_stages(self) -> bool:
        """Whether the dense output needs extra stages."""
        return False

    def extra_stages(self, time: Real, h: Real) -> None:  # noqa: B027
        """The extra stages of the dense output; y keeps its value."""

    def error_norm(self, h: Real, error: Row) -> Real:
        """Weighted root-mean-square norm of the error estimate of the step to y."""
        return self.sums.norm(h, error)

    def derivative_change(self, h: Real) -> Real:
        """Norm of ``h`` times the change of the derivative within the step."""
        return self.sums.norm(h, change_to(self.tableau.end_row))

    def check_stiffness(self, h: Real) -> None:  # noqa: B027
        """Check at intervals whether another method is faster; pause the run in that case."""

    def set_point(self, time: Real) -> Reals:
        """The time of an evaluation. Before a breakpoint it is clamped, so that a source keeps its old
        value."""
        self._point.value = minimum(time, self.frame.clamp.value)
        return self._point.memory

    def evaluate(self, time: Real, state: Reals, row: int) -> None:
        """``K[row] = f(min(time, clamp), state)``."""
        self.evaluation.flow(self.set_point(time), state, self.K(row))
        self.frame.increase(Count.EVALUATIONS)

    def first_step(self, time: Real, interval: Real, max_step: Real) -> tuple[Real, Boolean]:
        """Length of the first step of a segment, chosen as in SciPy (Hairer, Norsett, Wanner I, II.4).

        Also returns whether the length of the interval limits it.
        """

        return self.sums.first_step(self.evaluate, time, interval, max_step, self.tableau.error_order)

    # Between steps.

    def interpolate(self, instant: Real, time: Real, h: Real, target: Reals) -> None:
        """The state at ``instant``, between ``time`` and ``time + h``, into ``target``."""
        theta = (instant - time) / h
        interpolate(
            self.r,
            self.n,
            self.tableau.dense_rows,
            theta,
            h,
            lambda i: self.x[i],
            lambda row, i: self.K(row)[i],
            target,
        )
