"""Delayed signals in a loop: bounds of the steps, and the history that each step stores."""

from __future__ import annotations

from armblocks.integration import system_functions
from armblocks.integration.delay_history import MAX_SUBINTERVALS, DelayHistory
from armblocks.integration.evaluation import Evaluation
from armblocks.integration.frame import Frame
from armblocks.integration.method import Method
from armblocks.integration.records import Records
from armblocks.integration.workspace import Count, Status
from armblocks.routines.arithmetic import fma, maximum, minimum, select
from armblocks.routines.memory import RealVariable
from armblocks.routines.values import Boolean, Real

HIGH_ORDER = 7
"""For methods of this order and higher, the steps are too long for one quintic of the history."""


class Delays:
    """Emits the code for delayed signals. ``point`` is the variable that holds the time of an evaluation."""

    def __init__(
        self,
        frame: Frame,
        method: Method,
        records: Records,
        evaluation: Evaluation,
        history: DelayHistory,
        point: RealVariable,
    ) -> None:
        self.frame = frame
        self.method = method
        self.records = records
        self.evaluation = evaluation
        self.history = history
        self.point = point

    def bound_steps(self) -> None:
        """Limit steps to the shortest delay, so that all delayed values are in the history."""
        f, workspace, n = self.frame, self.frame.workspace, len(self.frame.sizes.delays)
        bounds, taus = f.vector(workspace.bounds), f.vector(workspace.taus)
        f.r.call(system_functions.delay_bounds, f.p, bounds)
        shortest, longest = f.max_step, f.r.constant(0.0)
        for k in range(n):
            shortest = minimum(shortest, bounds[k])
            longest = maximum(longest, bounds[n + k])
            taus[k] = bounds[k]
        f.max_step = shortest
        f.reals[workspace.longest] = longest

    def ensure_capacity(self) -> None:
        """Return from the loop if the history has no memory for another step."""
        f = self.frame
        enough = f.r.call(self.history.ensure_capacity, f.time.value, f.reals, f.counts)
        f.leave_unless(enough, Status.HISTORY_FULL)

    def next_jump(self) -> Real:
        """The next time at which a delayed signal jumps."""
        return self.frame.r.call(self.history.next_jump, self.frame.reals, self.frame.counts)

    def pass_jumps(self, time: Real) -> None:
        """Move each delayed signal past the jumps that it has reached."""
        self.frame.r.call(self.history.pass_jumps, time, self.frame.reals, self.frame.counts)

    def write_change(self, time: Real) -> None:
        """Store the signals after an event or tick in the history, if they have changed."""
        f = self.frame
        t, x = self.point.memory, f.vector(f.workspace.x)
        self.point.value = time
        self.evaluation.solve(t, x)
        f.r.call(self.history.write_change, t, x, f.reals, f.counts, f.p, f.r.constant(0.0))
        self.pass_jumps(time)

    def write_step(self, time: Real, new_time: Real, h: Real) -> None:
        """Store an accepted step in the history, in subintervals with a middle and an end.

        A subinterval is the whole step, half of a step for methods of high order, or shorter where the
        quintic deviates from a signal. After half of the maximum number of subintervals, the tolerance is
        increased with each one. The rest of the step then needs at most the other half.
        """
        f, r, history = self.frame, self.frame.r, self.history
        self.records.extra_stages_once(time, h)
        before = f.counts[Count.HISTORY_ROWS]
        max_rows, half_rows = (before + 2 * count for count in (MAX_SUBINTERVALS - 1, MAX_SUBINTERVALS // 2))
        factor = r.real(1.0)
        begin, end = r.real(time), r.real(new_time)
        half = fma(0.5, new_time - time, time)
        end.value = half if self.method.tableau.order >= HIGH_ORDER else new_time
        t, x = self.point.memory, f.vector(f.workspace.new_x)
        with r.loop() as subintervals:
            a, b = begin.value, end.value
            length, rows_before = b - a, f.counts[Count.HISTORY_ROWS]
            # After the maximum number, the rest of the step is one subinterval.
            last = rows_before >= max_rows
            b = select(last, new_time, b)
            for part, mark in ((0.5, 1.0), (1.0, 0.0)):
                self._point(part, a, b, time, new_time, h)
                r.call(history.write, t, x, f.reals, f.counts, f.p, r.constant(mark))
            subintervals.leave_when(last)
            deviates: Boolean | None = None
            for part in (0.25, 0.75):
                self._point(part, a, b, time, new_time, h)
                place = r.constant(2.0 * part - 1.0)
                part_deviates = r.call(history.deviates, t, x, f.reals, f.counts, f.p, place, factor.value)
                deviates = part_deviates if deviates is None else deviates | part_deviates
            assert deviates is not None
            divisible = length > b * 2.0**-48
            with r.when(deviates & divisible):
                f.counts[Count.HISTORY_ROWS] = rows_before
                end.value = fma(0.5, length, a)
                subintervals.again()
            factor.value = factor.value * select(rows_before >= half_rows, 1.1, 1.0)
            begin.value = b
            reached = fma(2.0, length, b)
            end.value = minimum(reached, new_time)
            subintervals.leave_when(b >= new_time)

    def _point(self, part: float, a: Real, b: Real, time: Real, new_time: Real, h: Real) -> None:
        """Write the state at the fraction ``part`` of the subinterval from ``a`` to ``b`` into ``new_x``, and
        evaluate the system there."""
        f, workspace = self.frame, self.frame.workspace
        x, y = f.vector(workspace.new_x), f.vector(workspace.y)
        instant = b if part == 1.0 else fma(part, b - a, a)
        self.method.interpolate(instant, time, h, x)
        if part == 1.0:
            at_end = b >= new_time
            for i in f.r.each(f.n):
                x[i] = select(at_end, y[i], x[i])
        self.point.value = minimum(instant, f.clamp.value)
        self.evaluation.solve(self.point.memory, x)
