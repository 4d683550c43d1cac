"""Explicit Runge-Kutta methods: stages and stiffness detection."""

from __future__ import annotations

from armblocks.integration.butcher_tableau import ButcherTableau, Row
from armblocks.integration.evaluation import Evaluation
from armblocks.integration.frame import Frame
from armblocks.integration.method import Method
from armblocks.integration.step_sums import ExplicitSums
from armblocks.integration.workspace import Count
from armblocks.routines.arithmetic import select
from armblocks.routines.values import Real

CHECK_INTERVAL = 16
"""Number of steps between two checks for stability-limited steps: a power of two."""
NEAR_BORDER = 0.97
"""Fraction of the stability interval beyond which a step counts as stability-limited (3.2 of 3.3, as in
Hairer's DOPRI5)."""
STIFF_CHECKS, NON_STIFF_CHECKS = 250, 6
"""Number of checks with a stability-limited step after which the system counts as stiff (4000 steps), and
number of consecutive accuracy-limited checks that reset this count."""


class ExplicitMethod(Method):
    """Emits the steps of an explicit tableau."""

    short_checks = 2048

    def __init__(self, frame: Frame, tableau: ButcherTableau, evaluation: Evaluation) -> None:
        super().__init__(frame, tableau, evaluation)
        self.butcher = tableau
        self._explicit = ExplicitSums(self.sums, tableau, self.evaluate)

    def stages(self, time: Real, h: Real, new_time: Real) -> None:
        """All stages, the new state into y and the derivative there into row ``s`` of K."""
        self._explicit.stages(time, h, new_time)

    @property
    def has_extra_stages(self) -> bool:
        """Whether the dense output needs extra stages."""
        return bool(self.butcher.extra_nodes)

    def extra_stages(self, time: Real, h: Real) -> None:
        """The extra stages of the dense output; y keeps its value."""
        self._explicit.extra_stages(time, h)

    def error_norm(self, h: Real, error: Row) -> Real:
        """Norm of the error estimate; for two estimates, their combination as in DOP853."""
        return self._explicit.error_norm(h, error)

    def derivative_change(self, h: Real) -> Real:
        """The larger norm of ``h`` times the change of the derivative to the end and to a middle stage."""
        return self._explicit.derivative_change(h)

    def check_stiffness(self, h: Real) -> None:
        """Check whether stability limits the step; pause if it has limited many steps.

        A step is stability-limited if ``h`` times the fastest rate reaches the border of the stability
        region. Six consecutive checks without such a step reset the count (Hairer, Wanner II, IV.2).
        """
        if not self.butcher.measures_stiffness:
            return
        f, r = self.frame, self.r
        steps, stiff, non_stiff = (
            f.count[place] for place in (Count.STIFFNESS_STEPS, Count.STIFF, Count.NON_STIFF)
        )
        steps.value = steps.value + 1
        with r.when(steps.value & (CHECK_INTERVAL - 1) == 0):
            border = (NEAR_BORDER * self.butcher.real_stability) ** 2
            with r.when(self._explicit.stiffness() > border):
                stiff.value = stiff.value + 1
                non_stiff.value = 0
                enabled = f.counts[Count.STIFFNESS_DETECTION] != 0
                reached = stiff.value >= STIFF_CHECKS
                f.steps_of_call.value = select(enabled & reached, f.arrays.max_steps, f.steps_of_call.value)
            with r.otherwise():
                non_stiff.value = non_stiff.value + 1
                with r.when(non_stiff.value >= NON_STIFF_CHECKS):
                    stiff.value = 0
