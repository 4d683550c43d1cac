"""Integration of a system without ticks and events: segments between breakpoints."""

from __future__ import annotations

from armblocks.integration.course import START, STEP, Course, Trial
from armblocks.integration.frame import Frame
from armblocks.integration.method import Method
from armblocks.integration.records import Records
from armblocks.integration.workspace import Count, Scalar, Stage, Status
from armblocks.routines.arithmetic import select
from armblocks.routines.routine import Part, Stages
from armblocks.routines.values import Boolean, Real


class Segments(Course):
    """Integrates segment by segment, with a restart at each breakpoint."""

    def __init__(self, frame: Frame, method: Method, records: Records) -> None:
        self.frame = frame
        self.method = method
        self.records = records

    def enter(self, stages: Stages) -> None:
        """Continue with a step, or with the start of a segment."""
        with self.frame.r.when(self.frame.count[Count.STARTED].value == Stage.RUNNING):
            stages.go(STEP)

    def first_step(self, time: Real) -> None:
        """Choose the length of the step after a start."""
        choose_first_step(self.frame, self.method, self.records, time)

    def try_finite(self, trial: Trial, time: Real, new_time: Real) -> None:
        """Try a fixed step; return if its result is not finite."""
        trial(time, new_time)
        method = self.method
        finite = method.all_finite(method.y, method.K(method.tableau.end_row))
        self.frame.leave_unless(finite, Status.NON_FINITE)

    def not_finite(self, time: Real, finite: Boolean, accepted: Part) -> None:
        """Return if steps of the minimum length are not finite."""
        self.frame.leave_unless(finite, Status.NON_FINITE)

    def accept(self, stages: Stages) -> None:
        """Record the samples of the step and accept it; at the end of a segment, restart."""
        f, records = self.frame, self.records
        new_time = f.new_time.value
        records.extra_done.value = 0
        records.samples(f.time.value, new_time, f.h.value)
        f.copy(f.places.y, f.places.x, f.n)
        f.copy(f.places.slope(self.method.tableau.end_row), f.places.slope(0), f.n)
        f.time.value = new_time
        f.increase(Count.ACCEPTED)
        f.count[Count.FRESH].value = 0
        f.taken.value = f.taken.value + 1
        with f.r.unless(new_time >= f.end.value):
            stages.go(STEP)
        with f.r.when(records.jumps_recorded & (f.clamp.value < new_time)):
            self.jump(new_time)
        f.increase(Count.SEGMENT)
        f.count[Count.STARTED].value = Stage.START
        f.count[Count.FRESH].value = 1
        segment = f.count[Count.SEGMENT].value
        f.leave_unless(segment < f.segments, Status.DONE)
        f.end.value = f.arrays.ends[segment]
        f.clamp.value = f.arrays.clamps[segment]
        stages.go(START)

    def jump(self, time: Real) -> None:
        """Record both sides of a breakpoint, where a sample at this time is already recorded."""
        f = self.frame
        x, sample = f.vector(f.places.x), f.count[Count.SAMPLE].value
        first = sample == 0
        recorded = f.arrays.samples[select(first, 0, sample - 1)] >= time
        before = select(first | ~recorded, sample, sample - 1)
        self.records.side_of_jump(f.clamp.value, before, x)
        self.records.side_of_jump(time, sample, x)


def choose_first_step(frame: Frame, method: Method, records: Records, time: Real) -> None:
    """Choose the length of the first step from the derivative, limited by the end of the run."""
    interval = frame.end.value - time
    length, bounded = method.first_step(time, interval, frame.max_step)
    records.checkpoint(bounded & (frame.end.value >= frame.last_end))
    frame.scalar[Scalar.STEP].value = length
