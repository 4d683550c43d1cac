"""The schedule of a system with clocks, events, delays or implicit equations.

The integration is divided into pieces, which end at instants.

At an instant (a tick, an event, a breakpoint, the start) the loop does the following, in native code:

1. the flow is integrated up to the instant with the old values, and a step ends exactly there; if states
store left limits, ``update`` is called without a marked clock;
2. events on which no sampled signal acts are processed as in step 3, if sampled blocks read them; all clocks
   that tick now are marked and ``update`` gives ``z``. If sampled blocks read events that ticks cause, this
   is repeated for each level of ticks (:mod:`armblocks.diagram.event_order`);
3. mode iteration: following modes are made consistent; then ``reset`` gives ``x`` and ``z`` for the guards
   that fire, because the jump changed their sign or their zero was located here; if none fires, inconsistent
   stateful modes take their consistent values; this is repeated until nothing changes;
4. the instant is recorded: signals are right-continuous;
5. the integration restarts. The first step after an event is at most a hundredth of the time between the last
   two events, and each later step at most ten times the previous step. No step can then pass over several
   bounces whose distances shrink.

Times within four units in the last place are one instant. So 3 times 0.1 s and 0.3 s coincide although their
doubles differ, and a tick can coincide with a breakpoint or a recorded time.
"""

from __future__ import annotations

from armblocks.integration.clocks import Clocks
from armblocks.integration.delays import Delays
from armblocks.integration.evaluation import Evaluation
from armblocks.integration.event_search import EventSearch
from armblocks.integration.events import Events
from armblocks.integration.frame import SAME_ABOVE, SAME_BELOW, Frame
from armblocks.integration.method import Method
from armblocks.integration.records import Records
from armblocks.integration.schedule import INSTANT, START, STEP, TICKS, Schedule, Trial
from armblocks.integration.segments import choose_first_step
from armblocks.integration.workspace import Count, Scalar, Stage, Status
from armblocks.routines.arithmetic import fma, maximum, minimum, select
from armblocks.routines.memory import RealVariable
from armblocks.routines.routine import Part, Stages
from armblocks.routines.values import Boolean, Real


class Instants(Schedule):
    """Pieces end at ticks, events, breakpoints, and where a delayed signal jumps.

    ``point`` is the variable that holds the time of an evaluation.
    """

    def __init__(
        self, frame: Frame, method: Method, records: Records, evaluation: Evaluation, point: RealVariable
    ) -> None:
        self.frame = frame
        self.method = method
        self.records = records
        self.evaluation = evaluation
        self.point = point
        self.clocks = Clocks(frame, evaluation, point)
        self.events = Events(frame, method, records, evaluation, point) if frame.sizes.directions else None
        self.search = EventSearch(self.events) if self.events else None
        history = evaluation.history
        self.delays = Delays(frame, method, records, evaluation, history, point) if history else None
        self.segment_end = frame.r.real(0.0)
        self.x = frame.vector(frame.workspace.x)

    def enter(self, stages: Stages) -> None:
        """Continue where the last call stopped; the end of the current piece is computed again."""
        f, r = self.frame, self.frame.r
        if self.delays:
            self.delays.bound_steps()
        self.begin_piece()
        started = f.count[Count.STAGE].value
        with r.when(started == Stage.RUNNING):
            stages.go(STEP)
        with r.when(started == Stage.START):
            stages.go(START)
        with r.when(started == Stage.TICKS):
            stages.go(TICKS)
        stages.begin(INSTANT)
        self.before_ticks()
        stages.begin(TICKS)
        self.ticks_and_events()

    def begin_piece(self) -> None:
        """Set the end of the next piece: the next tick, the next jump of a delayed signal, or the segment's
        end."""
        f = self.frame
        last = f.segments - 1
        segment = f.count[Count.SEGMENT].value
        segment = select(segment < last, segment, last)
        end = f.arrays.ends[segment]
        self.segment_end.value = end
        f.clamp.value = f.arrays.clamps[segment]
        # A tick within rounding before the end of the segment belongs to the end.
        shortest = end * SAME_BELOW
        earliest = end
        for clock in range(self.clocks.count):
            time = self.clocks.next_tick(clock)
            earliest = select((time < shortest) & (time < earliest), time, earliest)
        if self.delays:
            time = self.delays.next_jump()
            earliest = select((time < shortest) & (time < earliest), time, earliest)
        f.end.value = earliest

    def before_ticks(self) -> None:
        """Store the left limits at the present time, and process the events that come before the ticks."""
        time = self.frame.time.value
        self.record_left_limits(time)
        self.clocks.capture(time)
        if self.delays:
            self.delays.pass_jumps(time)
        if self.events:
            self.events.process_before_ticks(time, level=0)
        self.clocks.pause_before_ticks(time)

    def ticks_and_events(self) -> None:
        """Process ticks and events at the present time, record the instant, and start the next piece."""
        f = self.frame
        time = f.time.value
        until = time * SAME_ABOVE
        # A sample time within rounding of a tick or breakpoint is recorded with it. An event is located to
        # the last place: a later sample time is not recorded with it, even if it is close.
        known = time >= f.end.value * SAME_BELOW
        recorded = select(known, until, time)
        self.tick(time, until)
        if self.events:
            self.events.make_modes_consistent(time)
            self.events.process(time)
        else:
            f.counts[Count.AT_START] = 0
            self.point.value = time
            self.evaluation.solve(self.point.memory, self.x)
        if self.delays:
            self.delays.write_change(time)
        self.evaluation.accept_unknowns()
        self.records.samples(time, recorded, None)
        with f.r.when(self.records.jumps_recorded):
            self.records.record_side(time, f.count[Count.SAMPLE].value, self.x)
        if self.events:
            self.events.end_run(time)
        f.leave_unless(f.count[Count.SEGMENT].value < f.segments, Status.DONE)
        self.begin_piece()
        f.count[Count.STAGE].value = Stage.START

    def tick(self, time: Real, until: Real) -> None:
        """Process the ticks up to ``until`` level by level, and the events between the levels."""
        f, levels = self.frame, len(self.frame.sizes.ranks_before_ticks)
        due, any_due = self.clocks.due(until)
        if any_due is not None:
            with f.r.when(any_due):
                f.increase(Count.INSTANTS)
                for level in range(levels):
                    if level and self.events:
                        self.events.process_before_ticks(time, level)
                    self.clocks.tick(time, due, None if levels == 1 else level)

    def record_left_limits(self, time: Real) -> None:
        """Record the left limits at an instant, unless they are recorded. At the start of a run they are the
        initial values."""
        f, records = self.frame, self.records
        with f.r.when(records.jumps_recorded & (f.counts[Count.JUMPS] & 1 == 0)):
            before = f.just_before(time)
            self.point.value = before
            self.evaluation.solve(self.point.memory, self.x)
            records.record_side(before, f.count[Count.SAMPLE].value, self.x)

    def before_step(self) -> None:
        """Ensure that the history of delayed signals has memory for another step."""
        if self.delays:
            self.delays.ensure_capacity()

    def first_step(self, time: Real) -> None:
        """Choose the length of the step after a restart; after a tick the proposed length stays."""
        f = self.frame
        with f.r.when(f.count[Count.RESTARTED].value != 0):
            choose_first_step(f, self.method, self.records, time)
            length = f.scalar[Scalar.STEP]
            length.value = minimum(length.value, f.scalar[Scalar.BOUND].value)

    def take_fixed_step(self, trial: Trial, time: Real, new_time: Real) -> None:
        """Try a fixed step; quarter it while its end is not finite, then cross the boundary of a mode."""
        f, r, method = self.frame, self.frame.r, self.method
        end_row = method.K(method.tableau.end_row)
        if not self.search:
            trial(time, new_time)
            f.leave_unless(method.sums.all_finite(method.y, end_row), Status.NON_FINITE)
            return
        end = r.real(new_time)
        with r.part() as finite:
            with r.part() as attempt:
                trial(time, end.value)
                finite.leave_when(method.sums.all_finite(method.y, end_row))
                h = 0.25 * (end.value - time)
                end.value = time + h
                attempt.again_when(h > self.search.negligible_step(time))
            self.search.cross_mode_boundary(time)

    def handle_non_finite(self, time: Real, finite: Boolean, accepted: Part) -> None:
        """If steps of minimum length are not finite, cross the boundary of a mode, else return."""
        if self.search:
            with self.frame.r.unless(finite):
                self.search.cross_mode_boundary(time)
                accepted.leave()
        else:
            self.frame.leave_unless(finite, Status.NON_FINITE)

    def passed_until(self, time: Real, spacing: Real) -> Real:
        """The time up to which grid points are passed. A grid point that follows a tick within rounding
        errors coincides with the tick."""
        return fma(spacing, 1e-9, time)

    def fixed_step_end(self, time: Real, new_time: Real) -> Real:
        """The end of a fixed step, which is earlier right after an event."""
        f = self.frame
        ten_units_later = (time.bits() + 10).from_bits()
        shortened_end = maximum(time + f.scalar[Scalar.BOUND].value, ten_units_later)
        if self.delays:
            shortened_end = minimum(shortened_end, time + f.max_step)
        return minimum(shortened_end, new_time)

    def next_step_length(self, proposed: Real) -> Real:
        """The length of the next step. A step that was shortened to end at a tick does not reduce it."""
        f = self.frame
        length = f.scalar[Scalar.STEP].value
        shortened = f.new_time.value >= f.end.value
        return select(shortened, maximum(proposed, length), proposed)

    def accept(self, stages: Stages) -> None:
        """Locate the first event within the step, record its samples, and make its end the new point."""
        f, r, workspace, records = self.frame, self.frame.r, self.frame.workspace, self.records
        if self.search:
            self.search.event_located.value = 0
        time, h = f.time.value, f.h.value
        if self.search:
            self.search.locate_first_event(time)
            h = f.h.value
        new_time = f.new_time.value
        before = new_time * SAME_BELOW
        if self.search:
            # An event is located to the last place: a sample time just before it is recorded with the values
            # before the event, unless a tick or breakpoint is at this instant as well.
            event_only = (self.search.event_located.value != 0) & (new_time < f.end.value * SAME_BELOW)
            before = select(event_only, (new_time.bits() - 1).from_bits(), before)
        records.samples(time, before, h)
        if self.delays:
            self.delays.write_step(time, new_time, h)
        f.copy(workspace.y, workspace.x, f.n)
        f.time.value = new_time
        f.increase(Count.ACCEPTED)
        f.count[Count.RESTARTED].value = 0
        bound = f.scalar[Scalar.BOUND]
        bound.value = bound.value * 10.0
        f.steps_of_call.value = f.steps_of_call.value + 1
        ends = new_time >= f.end.value
        with r.unless((self.search.event_located.value != 0) | ends if self.search else ends):
            f.copy(
                workspace.stage_derivative(self.method.tableau.end_row), workspace.stage_derivative(0), f.n
            )
            if f.sizes.algebraic or self.delays:
                # Recording samples may have changed ``trial_w``. Newton's method finds the same solution
                # quickly.
                self.point.value = minimum(new_time, f.clamp.value)
                self.evaluation.solve(self.point.memory, self.x)
                self.evaluation.accept_unknowns()
            # A sample time within rounding of the end of the step is recorded with the values there, unless
            # an event may come before it.
            until = new_time if self.search else new_time * SAME_ABOVE
            records.samples(new_time, minimum(until, f.end.value * SAME_BELOW), None)
            stages.go(STEP)
        with r.when(new_time >= self.segment_end.value):
            f.increase(Count.SEGMENT)
            f.count[Count.RESTARTED].value = 1
        f.count[Count.STAGE].value = Stage.INSTANT
        # The left limits are recorded before the caller changes variables.
        self.record_left_limits(new_time)
        stages.go(INSTANT)
