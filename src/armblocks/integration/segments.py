"""Integration of a system without ticks and events: segments between breakpoints."""

from __future__ import annotations

from armblocks.integration.frame import SAME_BELOW, Frame
from armblocks.integration.method import Method
from armblocks.integration.records import Records
from armblocks.integration.schedule import START, STEP, Schedule, Trial
from armblocks.integration.workspace import Count, Scalar, Stage, Status
from armblocks.routines.arithmetic import select
from armblocks.routines.routine import Part, Stages
from armblocks.routines.values import Boolean, Real


class Segments(Schedule):
    """Integrates segment by segment, with a restart at each breakpoint."""

    def __init__(self, frame: Frame, method: Method, records: Records) -> None:
        self.frame = frame
        self.method = method
        self.records = records

    def enter(self, stages: Stages) -> None:
        """Continue with a step, or with the start of a segment."""
        with self.frame.r.when(self.frame.count[Count.STAGE].value == Stage.RUNNING):
            stages.go(STEP)

    def first_step(self, time: Real) -> None:
        """Choose the length of the first step after a restart."""
        choose_first_step(self.frame, self.method, self.records, time)

    def take_fixed_step(self, trial: Trial, time: Real, new_time: Real) -> None:
        """Take a fixed step; return from the loop if its result is not finite."""
        trial(time, new_time)
        method = self.method
        finite = method.sums.all_finite(method.y, method.K(method.tableau.end_row))
        self.frame.leave_unless(finite, Status.NON_FINITE)

    def handle_non_finite(self, time: Real, finite: Boolean, accepted: Part) -> None:
        """Return from the loop if the result of a step of minimum length is not finite."""
        self.frame.leave_unless(finite, Status.NON_FINITE)

    def accept(self, stages: Stages) -> None:
        """Record the samples of the step and accept it. At a breakpoint, start the next segment."""
        f, records = self.frame, self.records
        new_time = f.new_time.value
        records.extra_stages_done.value = 0
        records.samples(f.time.value, new_time, f.h.value)
        f.copy(f.workspace.y, f.workspace.x, f.n)
        f.copy(
            f.workspace.stage_derivative(self.method.tableau.end_row), f.workspace.stage_derivative(0), f.n
        )
        f.time.value = new_time
        f.increase(Count.ACCEPTED)
        f.count[Count.RESTARTED].value = 0
        f.steps_of_call.value = f.steps_of_call.value + 1
        with f.r.unless(new_time >= f.end.value):
            stages.go(STEP)
        with f.r.when(records.jumps_recorded & (f.clamp.value < new_time)):
            self.record_breakpoint(new_time)
        f.increase(Count.SEGMENT)
        f.count[Count.STAGE].value = Stage.START
        f.count[Count.RESTARTED].value = 1
        segment = f.count[Count.SEGMENT].value
        f.leave_unless(segment < f.segments, Status.DONE)
        f.end.value = f.arrays.ends[segment]
        f.clamp.value = f.arrays.clamps[segment]
        stages.go(START)

    def record_breakpoint(self, time: Real) -> None:
        """Record the values before and after a breakpoint. A sample at its time is already recorded."""
        f = self.frame
        x, sample = f.vector(f.workspace.x), f.count[Count.SAMPLE].value
        first = sample == 0
        recorded = f.arrays.samples[select(first, 0, sample - 1)] > time * SAME_BELOW
        before = select(first | ~recorded, sample, sample - 1)
        self.records.record_side(f.clamp.value, before, x)
        self.records.record_side(time, sample, x)


def choose_first_step(frame: Frame, method: Method, records: Records, time: Real) -> None:
    """Choose the length of the first step from the derivative, limited by the end of the segment."""
    interval = frame.end.value - time
    length, bounded = method.first_step(time, interval, frame.max_step)
    records.checkpoint(bounded & (frame.end.value >= frame.last_end))
    frame.scalar[Scalar.STEP].value = length
