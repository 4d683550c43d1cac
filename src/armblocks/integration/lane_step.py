"""One trial step of the loop that computes a run in each lane of the vector registers.

The operations are those of :mod:`armblocks.integration.step_control` and
:mod:`armblocks.integration.segments`, for all lanes at a time.
"""

from __future__ import annotations

from armblocks.integration.butcher_tableau import Row as Weights
from armblocks.integration.explicit_method import (
    CHECK_INTERVAL,
    NON_STIFF_CHECKS,
    STIFF_CHECKS,
    ExplicitMethod,
)
from armblocks.integration.lane_frame import Row, SharedCount, SharedNumber, SharedPlace
from armblocks.integration.lane_method import shortest_step
from armblocks.integration.lane_runs import LaneFunctions
from armblocks.integration.step_control import (
    GROW,
    MAX_FURTHER_STEPS,
    SAFETY,
    SHORT_CHECK_INTERVAL,
    SHORT_DECREASE,
    SHRINK,
)
from armblocks.integration.workspace import Status
from armblocks.routines.arithmetic import fma, in_all_lanes, inverse_root, maximum, minimum, select
from armblocks.routines.lanes import IntegerLanes, LaneArray, Lanes, Mask
from armblocks.routines.memory import Addresses
from armblocks.routines.routine import Routine


class LaneStep:
    """Emits one trial step in all lanes."""

    def __init__(
        self, r: Routine, loop: LaneFunctions, memory: LaneArray, addresses: Addresses, running: Mask
    ) -> None:
        self.r = r
        self.loop = loop
        self.memory = memory
        self.addresses = addresses
        self.running = running
        self.method = loop.method(r, memory, addresses)
        self.time = memory[Row.TIME]
        self.end = memory[Row.SEGMENT_END]
        self.failed = r.integer(0)
        """The lanes that leave the loop at the end of the trial, a bit for each."""

    def write(self) -> None:
        """Emit the step."""
        error = self.method.tableau.error
        if error is not None:
            self._adaptive(error)
        else:
            self._fixed()
        with self.r.when(self.failed.value != 0, rarely=True):
            status = self.r.constant_integer(Status.NON_FINITE)
            self.r.call(self.loop.end_runs, self.memory, self.addresses, self.failed.value, status)

    def _valid_lanes(self) -> Mask:
        """The running lanes whose arguments the vector functions support; the other running lanes fail."""
        unsupported = self.method.unsupported.value & self.running.bits()
        memory, r, loop = self.memory, self.r, self.loop
        with r.when(unsupported != 0, rarely=True):
            self.failed.value = self.failed.value | unsupported
            for lane in r.range(0, loop.lanes):
                with r.when(((unsupported >> lane) & 1) != 0):
                    memory.reals[lane + Row.RUNNING * loop.lanes] = 0.0
        return memory[Row.RUNNING] > 0.0

    def _adaptive(self, error: Weights) -> None:
        memory, method, time = self.memory, self.method, self.time
        new_time = minimum(time + memory[Row.LENGTH], self.end)
        h = new_time - time
        method.explicit.stages(time, h, new_time)
        norm = method.explicit.error_norm(h, error)
        bounded = minimum(maximum(norm, 1e-30), 1e30)
        ideal = SAFETY * inverse_root(bounded, method.tableau.error_order + 1)
        running = self._valid_lanes()
        accepted = running & (norm < 1.0) & method.sums.all_finite(method.y)
        self._check_stiffness(accepted)
        self._check_short_steps(accepted, new_time, h)
        proposed = h * minimum(ideal, memory[Row.GROWTH])
        shrunk = h * select(norm >= 1.0, maximum(ideal, SHRINK), SHRINK)
        shortest = shortest_step(select(accepted, new_time, time))
        following = method.limited_length(proposed, shortest)
        memory[Row.LENGTH] = select(accepted, following, shrunk)
        memory[Row.GROWTH] = select(accepted, GROW, method.number(1.0))
        rejected = running & ~accepted
        self.failed.value = self.failed.value | (rejected & (shrunk < shortest)).bits()
        self._accept(accepted, new_time, h)

    def _fixed(self) -> None:
        r, memory, method, time = self.r, self.memory, self.method, self.time
        spacing = in_all_lanes(self.addresses[SharedPlace.SHARED].reals[SharedNumber.STEP])
        grid = method.variable(memory[Row.GRID])
        with r.loop() as search:
            behind = self.running & (grid.value * spacing <= time)
            search.leave_unless(behind.any)
            grid.value = select(behind, grid.value + 1.0, grid.value)
        instant = grid.value * spacing
        memory[Row.GRID] = grid.value
        new_time = select(fma(spacing, 1e-9, instant) >= self.end, self.end, instant)
        h = new_time - time
        method.explicit.stages(time, h, new_time)
        finite = method.sums.all_finite(method.y, method.K(method.tableau.end_row))
        running = self._valid_lanes()
        self.failed.value = self.failed.value | (running & ~finite).bits()
        self._accept(running & finite, new_time, h)

    def _check_stiffness(self, accepted: Mask) -> None:
        """As :meth:`ExplicitMethod.check_stiffness`."""
        r, memory, method = self.r, self.memory, self.method
        if not method.tableau.measures_stiffness:
            return
        steps = memory[Row.ACCEPTED].bits() + 1
        due = accepted & ((steps & (CHECK_INTERVAL - 1)) == 0)
        with r.when(due.any):
            limited = method.is_at_border()
            stiff, non_stiff = memory[Row.STIFF].bits(), memory[Row.NON_STIFF].bits()
            more_stiff, more_non_stiff = stiff + 1, non_stiff + 1
            remaining = select(more_non_stiff >= NON_STIFF_CHECKS, _zero(stiff), stiff)
            new_stiff = select(due, select(limited, more_stiff, remaining), stiff)
            new_non_stiff = select(due, select(limited, _zero(more_non_stiff), more_non_stiff), non_stiff)
            memory[Row.STIFF] = new_stiff.from_bits()
            memory[Row.NON_STIFF] = new_non_stiff.from_bits()
            reached = due & limited & (more_stiff >= STIFF_CHECKS)
            detection = self.addresses[SharedPlace.COUNTS].integers[SharedCount.STIFFNESS_DETECTION]
            with r.when(reached.any & (detection != 0), rarely=True):
                memory[Row.ALLOWED] = select(reached, 0.0, memory[Row.ALLOWED])

    def _check_short_steps(self, accepted: Mask, new_time: Lanes, h: Lanes) -> None:
        """As :meth:`armblocks.integration.step_control.Steps._check_short_steps`."""
        r, memory, method = self.r, self.memory, self.method
        due = accepted & ((memory[Row.ACCEPTED].bits() & (SHORT_CHECK_INTERVAL - 1)) == 0)
        due = due & (new_time < self.end) & (h < method.max_step)
        with r.when(due.any):
            small = method.explicit.derivative_change(h) < method.short_change()
            count = memory[Row.SHORT_STEPS].bits()
            more, less = count + 1, count - SHORT_DECREASE
            less = select(less < 1, _zero(less), less)
            changed = select(due, select(small, more, less), count)
            memory[Row.SHORT_STEPS] = changed.from_bits()
            far = memory[Row.LAST_END] - new_time > MAX_FURTHER_STEPS * h
            ended = due & small & far & (changed >= ExplicitMethod.short_checks)
            self.failed.value = self.failed.value | ended.bits()

    def _accept(self, accepted: Mask, new_time: Lanes, h: Lanes) -> None:
        """Record the samples of the accepted steps, and make their ends the new points."""
        r, memory, method = self.r, self.memory, self.method
        self._record(accepted, new_time, h)
        for i in r.each(self.loop.n):
            method.x[i] = select(accepted, method.y[i], method.x[i])
            end = method.K(method.tableau.end_row)
            method.K(0)[i] = select(accepted, end[i], method.K(0)[i])
        memory[Row.TIME] = select(accepted, new_time, self.time)
        count = memory[Row.ACCEPTED].bits()
        memory[Row.ACCEPTED] = select(accepted, count + 1, count).from_bits()
        ended = (accepted & (new_time >= self.end)).bits()
        with r.when(ended != 0, rarely=True):
            remaining = ended & (-1 - self.failed.value)
            r.call(self.loop.end_segments, memory, self.addresses, remaining)

    def _record(self, accepted: Mask, new_time: Lanes, h: Lanes) -> None:
        """As :meth:`armblocks.integration.records.Records.samples`."""
        r, memory, method = self.r, self.memory, self.method
        due = accepted & (memory[Row.NEXT_SAMPLE] <= new_time)
        with r.when(due.any):
            if method.tableau.extra_nodes:
                inside = due & (memory[Row.NEXT_SAMPLE] < new_time)
                with r.when(inside.any):
                    method.explicit.extra_stages(self.time, h)
                    unsupported = method.unsupported.value & accepted.bits()
                    self.failed.value = self.failed.value | unsupported
            memory[Row.NEW_TIME], memory[Row.TRIED] = new_time, h
            r.call(self.loop.write_samples, memory, self.addresses, due.bits())


def _zero(integers: IntegerLanes) -> IntegerLanes:
    return integers & 0
