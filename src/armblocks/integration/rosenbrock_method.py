"""Rosenbrock methods: Jacobian, linear equations, stages.

The rows of K are the derivative at the start of the step, the stages, and the derivative at its end. Error
norm, first step and dense output are therefore shared with the explicit methods. The Jacobian is evaluated
once per step, even if the step is repeated with a shorter length. Infinite and NaN entries of the Jacobian
(the derivative of a square root at zero) are replaced by zero. The derivative of the state is finite there,
and the error estimate includes the effect of the replacement.
"""

from __future__ import annotations

from armblocks.integration.butcher_tableau import Row
from armblocks.integration.evaluation import Evaluation
from armblocks.integration.explicit_method import CHECK_INTERVAL
from armblocks.integration.frame import Frame, copy
from armblocks.integration.linear_equations import LinearEquations, LinearEquationsLayout
from armblocks.integration.method import Method
from armblocks.integration.rosenbrock_tableau import RosenbrockTableau
from armblocks.integration.step_sums import Index
from armblocks.integration.workspace import Count
from armblocks.routines.arithmetic import fma, maximum, select
from armblocks.routines.memory import Reals
from armblocks.routines.values import Real

STABLE_BELOW, STABLE_CHECKS = 2.0, 16
"""An explicit method could take a step if its length times the fastest rate is below this bound. After this
number of consecutive checks with this result, the run returns to the explicit method. The number is
multiplied by four after each return to this method."""


class RosenbrockMethod(Method):
    """Emits the steps of a Rosenbrock tableau, whose linear equations are in ``layout``."""

    short_checks = 512

    def __init__(
        self, frame: Frame, tableau: RosenbrockTableau, evaluation: Evaluation, layout: LinearEquationsLayout
    ) -> None:
        super().__init__(frame, tableau, evaluation)
        self.rosenbrock = tableau
        self.layout = layout
        self.scratch = frame.arrays.scratch
        self.right = self.scratch.after(layout.right)
        self.solution = self.scratch.after(layout.solution)
        self.equations = LinearEquations(frame.r.program, layout, tableau.gamma)
        self._time: Real | None = None

    def prepare(self, time: Real) -> None:
        """The Jacobian at the step's start."""
        self.evaluation.jacobian(self.set_point(time), self.x, self.layout)
        for k in self.r.each(self.layout.T + self.layout.size):
            value = self.scratch[k]
            self.scratch[k] = select(value.finite, value, 0.0)

    def stages(self, time: Real, h: Real, new_time: Real) -> None:
        """Compute all stages. The new state is written to y, the derivatives to their rows of K."""
        r, tableau = self.r, self.rosenbrock
        self._time = time
        r.call(self.equations.factor, self.scratch, h)
        for stage in range(tableau.stages):
            row = 1 + stage
            source = self.K(0)
            if stage:
                self.sums.set_y((0.0, *tableau.matrix[stage]), h)
                self.evaluate(fma(tableau.nodes[stage], h, time), self.y, row)
                source = self.K(row)
            self._right_side(source, stage, h)
            r.call(self.equations.solve, self.scratch)
            if stage == 0 and self.equations.is_accurate:
                # If the elimination without pivoting failed, repeat it with pivoting.
                with r.unless(r.call(self.equations.is_accurate, self.scratch, h)):
                    r.call(self.equations.factor_dense, self.scratch, h)
                    r.call(self.equations.solve, self.scratch)
            copy(r, self.solution, self.K(row), self.n)
        self.sums.set_y((0.0, *tableau.weights), h)
        self.evaluate(new_time, self.y, tableau.end_row)

    def error_norm(self, h: Real, error: Row) -> Real:
        """The larger of two norms: the embedded estimate, and the defect in the middle of the step."""
        assert self._time is not None
        r, tableau = self.r, self.rosenbrock
        ends = self.sums.norm(h, error)
        state, derivative = self.K(tableau.middle_row), self.K(tableau.middle_row + 1)
        middle = fma(0.5, h, self._time)
        self.interpolate(middle, self._time, h, state)
        self.evaluate(middle, state, tableau.middle_row + 1)
        weights = tableau.derivative_weights(0.5)

        def weighted(i: Index) -> Real:
            value = self.solution[i]
            before, after = abs(self.x[i]), abs(self.y[i])
            return value / self.sums.scale(maximum(before, after))

        for i in r.each(self.n):
            self.right[i] = derivative[i] - self.sums.combination(weights, i)
        for i in r.each(self.layout.size - self.n):
            self.right.after(self.n)[i] = 0.0
        r.call(self.equations.solve, self.scratch)
        between = h * self.sums.mean_square(weighted)
        # If one of the norms is NaN, the result is NaN, and the step is repeated with a shorter length.
        return select(between < ends, ends, between + ends * 0.0)

    def check_stiffness(self, h: Real) -> None:
        """Check whether an explicit method could take equally long steps; pause if many checks agree.

        With implicit equations the flow's Jacobian does not give the rates, so the method never changes back.
        """
        if self.layout.size != self.n:
            return
        f, r = self.frame, self.r
        steps, required, non_stiff = (
            f.count[place] for place in (Count.STIFFNESS_STEPS, Count.STIFF, Count.NON_STIFF)
        )
        steps.value = steps.value + 1
        checked = steps.value & (CHECK_INTERVAL - 1)
        due = (f.counts[Count.STIFFNESS_DETECTION] != 0) & (checked == 0)
        with r.when(due):
            stable = h * r.call(self.equations.rate_bound, self.scratch) < STABLE_BELOW
            increased = non_stiff.value + 1
            non_stiff.value = select(stable, increased, 0)
            reached = non_stiff.value >= required.value
            f.steps_of_call.value = select(reached, f.arrays.max_steps, f.steps_of_call.value)

    def _right_side(self, source: Reals, stage: int, h: Real) -> None:
        """``right = f + sum_j couplings[j] k[j] + h time_weight T``."""
        tableau, T = self.rosenbrock, self.scratch.after(self.layout.T)
        weight = tableau.time_weights[stage]
        factor = weight * h if weight else None

        def over_time(i: Index, total: Real) -> Real:
            return total if factor is None else fma(factor, T[i], total)

        for i in self.r.each(self.n):
            total = source[i]
            for j, coupling in enumerate(tableau.couplings[stage]):
                total = fma(coupling, self.K(1 + j)[i], total)
            self.right[i] = over_time(i, total)
        for i in self.r.each(self.layout.size - self.n):
            self.right[i + self.n] = over_time(i + self.n, self.r.constant(0.0))
