"""The common part of one-step methods: error norm, first step, dense output.

The code works on vectors of ``n`` states in the workspace: the old state ``x``, the new state ``y`` and the
rows of ``K``. The enclosing loop makes all decisions.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

from armblocks.integration.butcher_tableau import Row
from armblocks.integration.evaluation import Evaluation
from armblocks.integration.frame import Frame
from armblocks.integration.rosenbrock_tableau import Tableau
from armblocks.integration.workspace import Count, Scalar
from armblocks.routines.arithmetic import (
    fma,
    inverse_root,
    maximum,
    minimum,
    polynomial,
    select,
    square_root,
)
from armblocks.routines.memory import Reals
from armblocks.routines.values import Boolean, Integer, Real

Index = Integer | int


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
        self._rtol = frame.reals[Scalar.RTOL]
        self._atol = frame.reals[Scalar.ATOL]

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
        return self.norm(h, error)

    def derivative_change(self, h: Real) -> Real:
        """Norm of ``h`` times the change of the derivative within the step."""
        return self.norm(h, change_to(self.tableau.end_row))

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

    def set_y(self, weights: Row, h: Real) -> None:
        """``y = x + h sum_j weights[j] K[j]``."""
        for i in self.r.each(self.n):
            self.y[i] = fma(h, self.combination(weights, i), self.x[i])

    def all_finite(self, *vectors: Reals) -> Boolean:
        """Whether every element of the vectors is finite. ``0 v`` is NaN where v is infinite or NaN."""
        total = self.r.real(0.0)
        for i in self.r.each(self.n):
            subtotal = total.value
            for vector in vectors:
                subtotal = fma(vector[i], 0.0, subtotal)
            total.value = subtotal
        return total.value == 0.0

    def weighted(self, weights: Row) -> Callable[[Index], Real]:
        """Elements of ``sum_j weights[j] K[j]`` divided by the tolerance of the step to y."""

        def element(i: Index) -> Real:
            before, after = abs(self.x[i]), abs(self.y[i])
            return self.combination(weights, i) / self.scale(maximum(before, after))

        return element

    def norm(self, h: Real, weights: Row) -> Real:
        """Weighted root-mean-square norm of ``h sum_j weights[j] K[j]``."""
        return h * self.mean_square(self.weighted(weights))

    def first_step(self, time: Real, interval: Real, max_step: Real) -> tuple[Real, Boolean]:
        """Length of the first step of a segment, chosen as in SciPy (Hairer, Norsett, Wanner I, II.4).

        Also returns whether the length of the interval limits it.
        """

        def weighted(value: Callable[[Index], Real]) -> Callable[[Index], Real]:
            return lambda i: value(i) / self.scale(abs(self.x[i]))

        d0 = self.mean_square(weighted(lambda i: self.x[i]))
        d1 = self.mean_square(weighted(lambda i: self.K(0)[i]))
        small = (d0 < 1e-5) | (d1 < 1e-5)
        h0 = select(small, 1e-6, 0.01 * d0 / d1)
        clipped = h0 >= interval
        h0 = minimum(h0, interval)
        self.set_y((1.0,), h0)
        self.evaluate(time + h0, self.y, 1)
        d2 = self.mean_square(weighted(lambda i: self.K(1)[i] - self.K(0)[i])) / h0
        steepest = maximum(d2, d1)
        # Clamped to the range of inverse_root. Outside it another bound limits the step.
        bounded = maximum(minimum(100.0 * steepest, 1e300), 1e-300)
        h1 = select(
            steepest <= 1e-15,
            maximum(h0 * 1e-3, 1e-6),
            inverse_root(bounded, self.tableau.error_order + 1),
        )
        h = minimum(h1, 100.0 * h0)
        return minimum(minimum(h, interval), max_step), clipped

    # Between steps.

    def interpolate(self, instant: Real, time: Real, h: Real, target: Reals) -> None:
        """The state at ``instant``, between ``time`` and ``time + h``, into ``target``."""
        theta = (instant - time) / h
        weights = [
            (self.K(row), polynomial(theta, powers) * theta)
            for row, powers in enumerate(self.tableau.dense_rows)
            if any(powers)
        ]
        for i in self.r.each(self.n):
            total: Real | float = 0.0
            for row, weight in weights:
                total = fma(weight, row[i], total)
            target[i] = fma(h, total, self.x[i])

    # Sums.

    def scale(self, magnitude: Real) -> Real:
        """The error tolerance: ``atol + rtol magnitude``."""
        return fma(magnitude, self._rtol, self._atol)

    def combination(self, weights: Row, i: Index) -> Real:
        """``sum_j weights[j] K[j][i]``, without zero terms."""
        total: Real | None = None
        for row, weight in enumerate(weights):
            if weight != 0.0:
                element = self.K(row)[i]
                total = weight * element if total is None else fma(weight, element, total)
        return self.r.constant(0.0) if total is None else total

    def square(self, element: Callable[[Index], Real]) -> Real:
        """``sum_i element(i)^2``."""
        total = self.r.real(0.0)
        for i in self.r.each(self.n):
            subtotal = total.value
            value = element(i)
            total.value = fma(value, value, subtotal)
        return total.value

    def mean_square(self, element: Callable[[Index], Real]) -> Real:
        """``sqrt(sum_i element(i)^2 / n)``."""
        return square_root(self.square(element) / float(self.n))


def change_to(row: int) -> Row:
    """Weights of K that give the change of the derivative from the step's start to a row."""
    return (-1.0, *[0.0] * (row - 1), 1.0)
