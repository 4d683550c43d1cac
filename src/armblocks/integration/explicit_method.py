"""Explicit Runge-Kutta methods: stages and stiffness detection."""

from __future__ import annotations

from armblocks.integration.butcher_tableau import ButcherTableau, Row
from armblocks.integration.evaluation import Evaluation
from armblocks.integration.frame import Frame
from armblocks.integration.method import Method, change_to
from armblocks.integration.workspace import Count
from armblocks.routines.arithmetic import fma, maximum, select, square_root
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

    def stages(self, time: Real, h: Real, new_time: Real) -> None:
        """All stages, the new state into y and the derivative there into row ``s`` of K."""
        tableau = self.butcher
        for stage in range(1, tableau.stages):
            self.set_y(tableau.matrix[stage], h)
            self.evaluate(fma(tableau.nodes[stage], h, time), self.y, stage)
        self.set_y(tableau.weights, h)
        self.evaluate(new_time, self.y, tableau.stages)

    @property
    def has_extra_stages(self) -> bool:
        """Whether the dense output needs extra stages."""
        return bool(self.butcher.extra_nodes)

    def extra_stages(self, time: Real, h: Real) -> None:
        """The extra stages of the dense output; y keeps its value."""
        tableau = self.butcher
        for k, node in enumerate(tableau.extra_nodes):
            self.set_y(tableau.extra_matrix[k], h)
            self.evaluate(fma(node, h, time), self.y, tableau.stages + 1 + k)
        # The extra stages used y as memory: compute the new state in it again, by the same operations.
        self.set_y(tableau.weights, h)

    def error_norm(self, h: Real, error: Row) -> Real:
        """Norm of the error estimate; for two estimates, their combination as in DOP853."""
        second = self.butcher.second_error
        if second is None:
            return self.norm(h, error)
        e5, e3 = self.square(self.weighted(error)), self.square(self.weighted(second))
        denominator = square_root(fma(0.01, e3, e5) * float(self.n))
        norm = h * e5 / denominator
        return select(denominator == 0.0, 0.0, norm)

    def derivative_change(self, h: Real) -> Real:
        """The larger norm of ``h`` times the change of the derivative from the start to the end and to a
        middle stage.

        The end alone is not enough: a long step may span a whole period, after which the derivative repeats.
        """
        nodes = self.butcher.nodes
        middle = min(range(1, self.butcher.stages), key=lambda stage: abs(nodes[stage] - 0.5))
        return maximum(super().derivative_change(h), self.norm(h, change_to(middle)))

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
            with r.when(self.stiffness() > border):
                stiff.value = stiff.value + 1
                non_stiff.value = 0
                enabled = f.counts[Count.STIFFNESS_DETECTION] != 0
                reached = stiff.value >= STIFF_CHECKS
                f.steps_of_call.value = select(enabled & reached, f.arrays.max_steps, f.steps_of_call.value)
            with r.otherwise():
                non_stiff.value = non_stiff.value + 1
                with r.when(non_stiff.value >= NON_STIFF_CHECKS):
                    stiff.value = 0

    def stiffness(self) -> Real:
        """The square of ``h`` times the fastest rate, estimated from the last two evaluations (Hairer, Wanner
        II, IV.2, equation (2.20)): both are at the step's end, so they differ by the Jacobian times the
        difference of their states."""
        tableau = self.butcher
        last = (*tableau.matrix[-1], 0.0)
        difference = tuple(b - a for a, b in zip(last, tableau.weights))
        end, before = self.K(tableau.stages), self.K(tableau.stages - 1)
        derivatives = self.square(lambda i: end[i] - before[i])
        states = self.square(lambda i: self.combination(difference, i))
        # Both sums lack h^2: y_new - y_last = h sum_j (b_j - a_j) K[j].
        return derivatives / maximum(states, 1e-300)
