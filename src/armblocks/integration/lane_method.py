"""Explicit Runge-Kutta methods in lanes: the operations of :mod:`armblocks.integration.explicit_method` and
:mod:`armblocks.integration.method` in the same order, with a run in each lane. The results of a lane are
therefore bit-identical to those of the run alone.
"""

from __future__ import annotations

from collections.abc import Callable

from armblocks.integration.butcher_tableau import ButcherTableau
from armblocks.integration.butcher_tableau import Row as Weights
from armblocks.integration.explicit_method import NEAR_BORDER
from armblocks.integration.lane_frame import LaneWorkspace, Row, Shared
from armblocks.integration.method import change_to
from armblocks.integration.step_control import RESOLVED, SHORT_CHANGE
from armblocks.routines.arithmetic import (
    fma,
    in_all_lanes,
    inverse_root,
    maximum,
    minimum,
    select,
    square_root,
)
from armblocks.routines.lanes import LaneArray, Lanes, Mask
from armblocks.routines.memory import NumberVariable, Reals
from armblocks.routines.routine import Routine, external
from armblocks.routines.tree import Constant, Kind
from armblocks.routines.values import Integer, Real

Index = Integer | int


@external
def lane_derivative(
    r: Routine, t: LaneArray, x: LaneArray, z: LaneArray, w: LaneArray, p: LaneArray, xd: LaneArray
) -> Integer:
    """``xd = f(t, x, z, w, p)`` in each lane; returns the lanes whose results are invalid, a bit for each."""
    raise NotImplementedError


class LaneMethod:
    """Emits the arithmetic of an explicit method into a routine with lanes."""

    def __init__(
        self,
        r: Routine,
        tableau: ButcherTableau,
        workspace: LaneWorkspace,
        memory: LaneArray,
        shared: Reals,
    ) -> None:
        self.r = r
        self.tableau = tableau
        self.n = workspace.states
        self._workspace = workspace
        self.memory = memory
        self.x = memory.after(workspace.x)
        self.y = memory.after(workspace.y)
        self._shared = shared
        self._p = memory.after(workspace.p)
        self._none = LaneArray(r, Constant(Kind.ADDRESS, None))
        self.undecided = r.integer(0)
        """The lanes with an evaluation that is not valid, a bit for each."""
        self.rtol = in_all_lanes(shared[Shared.RTOL])
        self.atol = in_all_lanes(shared[Shared.ATOL])
        self.max_step = in_all_lanes(shared[Shared.MAX_STEP])

    def number(self, value: float) -> Lanes:
        """A constant."""
        return Lanes.constant(self.r, value)

    def variable(self, initial: Lanes | float) -> NumberVariable[Lanes]:
        """A variable with one double for each lane."""
        return self.r.variable(initial if isinstance(initial, Lanes) else self.number(initial))

    def K(self, row: int) -> LaneArray:
        """One row of the stage derivatives."""
        return self.memory.after(self._workspace.stage_derivative(row))

    def evaluate(self, time: Lanes, state: LaneArray, row: int) -> None:
        """``K[row] = f(min(time, clamp), state)``."""
        self.memory[Row.POINT] = minimum(time, self.memory[Row.CLAMP])
        point = self.memory.after(Row.POINT)
        bits = self.r.call(lane_derivative, point, state, self._none, self._none, self._p, self.K(row))
        self.undecided.value = self.undecided.value | bits

    # The step.

    def stages(self, time: Lanes, h: Lanes, new_time: Lanes) -> None:
        """All stages, the new state into y and the derivative there into row ``s`` of K."""
        tableau = self.tableau
        for stage in range(1, tableau.stages):
            self._set_y(tableau.matrix[stage], h)
            self.evaluate(fma(tableau.nodes[stage], h, time), self.y, stage)
        self._set_y(tableau.weights, h)
        self.evaluate(new_time, self.y, tableau.stages)

    def extra_stages(self, time: Lanes, h: Lanes) -> None:
        """The extra stages of the dense output; y keeps its value."""
        tableau = self.tableau
        for k, node in enumerate(tableau.extra_nodes):
            self._set_y(tableau.extra_matrix[k], h)
            self.evaluate(fma(node, h, time), self.y, tableau.stages + 1 + k)
        self._set_y(tableau.weights, h)

    def error_norm(self, h: Lanes) -> Lanes:
        """Norm of the error estimate; for two estimates, their combination as in DOP853."""
        error, second = self.tableau.error, self.tableau.second_error
        assert error is not None
        if second is None:
            return self._norm(h, error)
        e5, e3 = self._square(self._weighted(error)), self._square(self._weighted(second))
        denominator = square_root(fma(0.01, e3, e5) * float(self.n))
        norm = h * e5 / denominator
        return select(denominator == 0.0, 0.0, norm)

    def derivative_change(self, h: Lanes) -> Lanes:
        """The larger norm of ``h`` times the change of the derivative to the end and to a middle stage."""
        nodes = self.tableau.nodes
        middle = min(range(1, self.tableau.stages), key=lambda stage: abs(nodes[stage] - 0.5))
        to_end = self._norm(h, change_to(self.tableau.end_row))
        return maximum(to_end, self._norm(h, change_to(middle)))

    def short_change(self) -> Lanes:
        """The change of the derivative below which a step is needlessly short."""
        root = inverse_root(self._shared[Shared.RTOL], self.tableau.error_order + 1)
        power = self.r.constant(RESOLVED)
        for _ in range(self.tableau.error_order - 1):
            power = power * root
        least: Real = minimum(self.r.constant(SHORT_CHANGE), power)
        return in_all_lanes(least)

    def is_at_border(self) -> Mask:
        """Whether stability limits the step, see :meth:`ExplicitMethod.check_stiffness`."""
        tableau = self.tableau
        last = (*tableau.matrix[-1], 0.0)
        difference = tuple(b - a for a, b in zip(last, tableau.weights))
        end, before = self.K(tableau.stages), self.K(tableau.stages - 1)
        derivatives = self._square(lambda i: end[i] - before[i])
        states = self._square(lambda i: self._combination(difference, i))
        return derivatives / maximum(states, 1e-300) > (NEAR_BORDER * tableau.real_stability) ** 2

    def first_step(self, time: Lanes, interval: Lanes) -> Lanes:
        """Length of the first step of a segment, see :meth:`Method.first_step`."""

        def weighted(value: Callable[[Index], Lanes]) -> Callable[[Index], Lanes]:
            return lambda i: value(i) / self._scale(abs(self.x[i]))

        d0 = self._mean_square(weighted(lambda i: self.x[i]))
        d1 = self._mean_square(weighted(lambda i: self.K(0)[i]))
        small = (d0 < 1e-5) | (d1 < 1e-5)
        h0 = select(small, 1e-6, 0.01 * d0 / d1)
        h0 = minimum(h0, interval)
        self._set_y((1.0,), h0)
        self.evaluate(time + h0, self.y, 1)
        d2 = self._mean_square(weighted(lambda i: self.K(1)[i] - self.K(0)[i])) / h0
        steepest = maximum(d2, d1)
        bounded = maximum(minimum(100.0 * steepest, 1e300), 1e-300)
        h1 = select(
            steepest <= 1e-15,
            maximum(h0 * 1e-3, 1e-6),
            inverse_root(bounded, self.tableau.error_order + 1),
        )
        h = minimum(h1, 100.0 * h0)
        return minimum(minimum(h, interval), self.max_step)

    def limited_length(self, length: Lanes, shortest: Lanes) -> Lanes:
        """The length of the next step before the end of the segment limits it."""
        return minimum(maximum(length, shortest), self.max_step)

    def finite_y(self) -> Mask:
        """Whether the new state is finite."""
        return self.all_finite(self.y)

    def all_finite(self, *vectors: LaneArray) -> Mask:
        """Whether every element of the vectors is finite. ``0 v`` is NaN where v is infinite or NaN."""
        total = self.variable(0.0)
        for i in self.r.each(self.n):
            subtotal = total.value
            for vector in vectors:
                subtotal = fma(vector[i], 0.0, subtotal)
            total.value = subtotal
        return total.value == 0.0

    # Sums.

    def _set_y(self, weights: Weights, h: Lanes) -> None:
        """``y = x + h sum_j weights[j] K[j]``."""
        for i in self.r.each(self.n):
            self.y[i] = fma(h, self._combination(weights, i), self.x[i])

    def _scale(self, magnitude: Lanes) -> Lanes:
        return fma(magnitude, self.rtol, self.atol)

    def _weighted(self, weights: Weights) -> Callable[[Index], Lanes]:
        def element(i: Index) -> Lanes:
            before, after = abs(self.x[i]), abs(self.y[i])
            return self._combination(weights, i) / self._scale(maximum(before, after))

        return element

    def _norm(self, h: Lanes, weights: Weights) -> Lanes:
        return h * self._mean_square(self._weighted(weights))

    def _combination(self, weights: Weights, i: Index) -> Lanes:
        total: Lanes | None = None
        for row, weight in enumerate(weights):
            if weight != 0.0:
                element = self.K(row)[i]
                total = weight * element if total is None else fma(weight, element, total)
        return self.number(0.0) if total is None else total

    def _square(self, element: Callable[[Index], Lanes]) -> Lanes:
        total = self.variable(0.0)
        for i in self.r.each(self.n):
            subtotal = total.value
            value = element(i)
            total.value = fma(value, value, subtotal)
        return total.value

    def _mean_square(self, element: Callable[[Index], Lanes]) -> Lanes:
        return square_root(self._square(element) / float(self.n))
