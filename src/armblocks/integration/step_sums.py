"""Sums over the vectors of a step, for a single run and for a run in each lane.

Both have the same operations in the same order, so the results of a lane are bit-identical to those of the
run alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Generic

from armblocks.integration.butcher_tableau import ButcherTableau, Row
from armblocks.routines.arithmetic import (
    fma,
    inverse_root,
    maximum,
    minimum,
    polynomial,
    select_number,
    square_root,
)
from armblocks.routines.memory import NumberArray
from armblocks.routines.routine import Routine
from armblocks.routines.values import Integer, NumberT, Real

Index = Integer | int
Evaluate = Callable[[NumberT, Any, int], None]
"""``evaluate(time, state, row)``: the derivative at a point into a row of K."""


class StepSums(Generic[NumberT]):
    """Emits sums over ``n`` elements of the old state ``x``, the new state ``y`` and the rows of ``K``."""

    def __init__(
        self,
        r: Routine,
        n: int,
        x: NumberArray[NumberT],
        y: NumberArray[NumberT],
        K: Callable[[int], NumberArray[NumberT]],
        number: Callable[[float], NumberT],
        rtol: NumberT,
        atol: NumberT,
    ) -> None:
        """``number(value)``: a constant."""
        self.r = r
        self.n = n
        self.x = x
        self.y = y
        self.K = K
        self.number = number
        self._rtol = rtol
        self._atol = atol

    def set_y(self, weights: Row, h: NumberT) -> None:
        """``y = x + h sum_j weights[j] K[j]``."""
        for i in self.r.each(self.n):
            self.y[i] = fma(h, self.combination(weights, i), self.x[i])

    def all_finite(self, *vectors: NumberArray[NumberT]) -> Any:
        """Whether every element of the vectors is finite. ``0 v`` is NaN where v is infinite or NaN."""
        total = self.r.variable(self.number(0.0))
        for i in self.r.each(self.n):
            subtotal = total.value
            for vector in vectors:
                subtotal = fma(vector[i], 0.0, subtotal)
            total.value = subtotal
        return total.value == 0.0

    def weighted(self, weights: Row) -> Callable[[Index], NumberT]:
        """Elements of ``sum_j weights[j] K[j]`` divided by the tolerance of the step to y."""

        def element(i: Index) -> NumberT:
            before, after = abs(self.x[i]), abs(self.y[i])
            return self.combination(weights, i) / self.scale(maximum(before, after))

        return element

    def norm(self, h: NumberT, weights: Row) -> NumberT:
        """Weighted root-mean-square norm of ``h sum_j weights[j] K[j]``."""
        return h * self.mean_square(self.weighted(weights))

    def scale(self, magnitude: NumberT) -> NumberT:
        """The error tolerance: ``atol + rtol magnitude``."""
        return fma(magnitude, self._rtol, self._atol)

    def combination(self, weights: Row, i: Index) -> NumberT:
        """``sum_j weights[j] K[j][i]``, without zero terms."""
        total: NumberT | None = None
        for row, weight in enumerate(weights):
            if weight != 0.0:
                element = self.K(row)[i]
                total = weight * element if total is None else fma(weight, element, total)
        return self.number(0.0) if total is None else total

    def square(self, element: Callable[[Index], NumberT]) -> NumberT:
        """``sum_i element(i)^2``."""
        total = self.r.variable(self.number(0.0))
        for i in self.r.each(self.n):
            subtotal = total.value
            value = element(i)
            total.value = fma(value, value, subtotal)
        return total.value

    def mean_square(self, element: Callable[[Index], NumberT]) -> NumberT:
        """``sqrt(sum_i element(i)^2 / n)``."""
        return square_root(self.square(element) / float(self.n))

    def first_step(
        self, evaluate: Evaluate[NumberT], time: NumberT, interval: NumberT, max_step: NumberT, order: int
    ) -> tuple[NumberT, Any]:
        """Length of the first step of a segment, chosen as in SciPy (Hairer, Norsett, Wanner I, II.4).

        ``order``: the order of the error estimate. Also returns whether the length of the interval limits it.
        """

        def weighted(value: Callable[[Index], NumberT]) -> Callable[[Index], NumberT]:
            return lambda i: value(i) / self.scale(abs(self.x[i]))

        d0 = self.mean_square(weighted(lambda i: self.x[i]))
        d1 = self.mean_square(weighted(lambda i: self.K(0)[i]))
        small = (d0 < 1e-5) | (d1 < 1e-5)
        h0 = select_number(small, 1e-6, 0.01 * d0 / d1)
        clipped = h0 >= interval
        h0 = minimum(h0, interval)
        self.set_y((1.0,), h0)
        evaluate(time + h0, self.y, 1)
        d2 = self.mean_square(weighted(lambda i: self.K(1)[i] - self.K(0)[i])) / h0
        steepest = maximum(d2, d1)
        # Clamped to the range of inverse_root. Outside it another bound limits the step.
        bounded = maximum(minimum(100.0 * steepest, 1e300), 1e-300)
        h1 = select_number(steepest <= 1e-15, maximum(h0 * 1e-3, 1e-6), inverse_root(bounded, order + 1))
        h = minimum(h1, 100.0 * h0)
        return minimum(minimum(h, interval), max_step), clipped


class ExplicitSums(Generic[NumberT]):
    """Emits the stages and the norms of an explicit ``tableau``."""

    def __init__(self, sums: StepSums[NumberT], tableau: ButcherTableau, evaluate: Evaluate[NumberT]) -> None:
        self._sums = sums
        self._tableau = tableau
        self._evaluate = evaluate

    def stages(self, time: NumberT, h: NumberT, new_time: NumberT) -> None:
        """All stages, the new state into y and the derivative there into row ``s`` of K."""
        sums, tableau = self._sums, self._tableau
        for stage in range(1, tableau.stages):
            sums.set_y(tableau.matrix[stage], h)
            self._evaluate(fma(tableau.nodes[stage], h, time), sums.y, stage)
        sums.set_y(tableau.weights, h)
        self._evaluate(new_time, sums.y, tableau.stages)

    def extra_stages(self, time: NumberT, h: NumberT) -> None:
        """The extra stages of the dense output; y keeps its value."""
        sums, tableau = self._sums, self._tableau
        for k, node in enumerate(tableau.extra_nodes):
            sums.set_y(tableau.extra_matrix[k], h)
            self._evaluate(fma(node, h, time), sums.y, tableau.stages + 1 + k)
        # The extra stages used y as memory: compute the new state in it again, by the same operations.
        sums.set_y(tableau.weights, h)

    def error_norm(self, h: NumberT, error: Row) -> NumberT:
        """Norm of the error estimate; for two estimates, their combination as in DOP853."""
        sums, second = self._sums, self._tableau.second_error
        if second is None:
            return sums.norm(h, error)
        e5, e3 = sums.square(sums.weighted(error)), sums.square(sums.weighted(second))
        denominator = square_root(fma(0.01, e3, e5) * float(sums.n))
        norm = h * e5 / denominator
        return select_number(denominator == 0.0, 0.0, norm)

    def derivative_change(self, h: NumberT) -> NumberT:
        """The larger norm of ``h`` times the change of the derivative from the start to the end and to a
        middle stage.

        The end alone is not enough: a long step may span a whole period, after which the derivative repeats.
        """
        nodes = self._tableau.nodes
        middle = min(range(1, self._tableau.stages), key=lambda stage: abs(nodes[stage] - 0.5))
        to_end = self._sums.norm(h, change_to(self._tableau.end_row))
        return maximum(to_end, self._sums.norm(h, change_to(middle)))

    def stiffness(self) -> NumberT:
        """The square of ``h`` times the fastest rate, estimated from the last two evaluations (Hairer, Wanner
        II, IV.2, equation (2.20)): both are at the step's end, so they differ by the Jacobian times the
        difference of their states."""
        sums, tableau = self._sums, self._tableau
        last = (*tableau.matrix[-1], 0.0)
        difference = tuple(b - a for a, b in zip(last, tableau.weights))
        end, before = sums.K(tableau.stages), sums.K(tableau.stages - 1)
        derivatives = sums.square(lambda i: end[i] - before[i])
        states = sums.square(lambda i: sums.combination(difference, i))
        # Both sums lack h^2: y_new - y_last = h sum_j (b_j - a_j) K[j].
        return derivatives / maximum(states, 1e-300)


def interpolate(
    r: Routine,
    n: int,
    rows: Sequence[Row],
    theta: Real,
    h: Real,
    x: Callable[[Index], Real],
    derivative: Callable[[int, Index], Real],
    target: NumberArray[Real],
) -> None:
    """The state at the fraction ``theta`` of a step into ``target``. ``rows``: the polynomials of the dense
    output; ``x(i)`` and ``derivative(row, i)``: elements of the old state and of K."""
    weights = [(row, polynomial(theta, powers) * theta) for row, powers in enumerate(rows) if any(powers)]
    for i in r.each(n):
        total: Real | float = 0.0
        for row, weight in weights:
            total = fma(weight, derivative(row, i), total)
        target[i] = fma(h, total, x(i))


def change_to(row: int) -> Row:
    """Weights of K that give the change of the derivative from the step's start to a row."""
    return (-1.0, *[0.0] * (row - 1), 1.0)
