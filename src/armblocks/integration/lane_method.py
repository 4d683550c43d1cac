"""Explicit Runge-Kutta methods with a run in each lane, see :mod:`armblocks.integration.explicit_method`."""

from __future__ import annotations

from armblocks.integration.butcher_tableau import ButcherTableau
from armblocks.integration.explicit_method import NEAR_BORDER
from armblocks.integration.lane_frame import LaneWorkspace, Row, SharedNumber
from armblocks.integration.step_control import SHORT_CHANGE, resolved_change
from armblocks.integration.step_sums import ExplicitSums, StepSums
from armblocks.routines.arithmetic import in_all_lanes, maximum, minimum
from armblocks.routines.lanes import LaneArray, Lanes, Mask
from armblocks.routines.memory import NumberVariable, Reals
from armblocks.routines.routine import Routine, external
from armblocks.routines.tree import Constant, Kind
from armblocks.routines.values import Integer


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
        self.unsupported = r.integer(0)
        """The lanes with arguments that the vector functions do not support, a bit for each lane.

        Their results are invalid.
        """
        rtol, atol = in_all_lanes(shared[SharedNumber.RTOL]), in_all_lanes(shared[SharedNumber.ATOL])
        self.max_step = in_all_lanes(shared[SharedNumber.MAX_STEP])
        self.sums = StepSums(r, self.n, self.x, self.y, self.K, self.number, rtol, atol)
        self.explicit = ExplicitSums(self.sums, tableau, self.evaluate)

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
        self.unsupported.value = self.unsupported.value | bits

    def short_change(self) -> Lanes:
        """The change of the derivative below which a step is needlessly short."""
        power = resolved_change(self.r, self._shared[SharedNumber.RTOL], self.tableau.error_order)
        return in_all_lanes(minimum(self.r.constant(SHORT_CHANGE), power))

    def is_at_border(self) -> Mask:
        """Whether stability limits the step, see :meth:`ExplicitMethod.check_stiffness`."""
        return self.explicit.stiffness() > (NEAR_BORDER * self.tableau.real_stability) ** 2

    def first_step(self, time: Lanes, interval: Lanes) -> Lanes:
        """Length of the first step of a segment."""
        order = self.tableau.error_order
        return self.sums.first_step(self.evaluate, time, interval, self.max_step, order)[0]

    def limited_length(self, length: Lanes, shortest: Lanes) -> Lanes:
        """The length of the next step before the end of the segment limits it."""
        return minimum(maximum(length, shortest), self.max_step)


def shortest_step(time: Lanes) -> Lanes:
    """The minimum length of adaptive steps."""
    following = (time.bits() + 1).from_bits()
    return 10.0 * (following - time)
