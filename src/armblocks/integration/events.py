"""Events of a loop: guards whose sign changes, at an instant and within a step.

A guard fires where its sign is the opposite of the one it had after the last step, tick or event, in a step
that its direction allows. A zero takes no side: a guard that is zero keeps its last sign, and one that is
zero at the start counts with the sign that it takes first. Right after it fired, a zero guard of one
direction is on the side that it came from, and one of both directions counts with the sign it takes first.
"""

from __future__ import annotations

from armblocks.integration import system_functions
from armblocks.integration.evaluation import Evaluation
from armblocks.integration.frame import SAME_ABOVE, SAME_BELOW, Frame, copy
from armblocks.integration.guard_functions import GuardFunctions
from armblocks.integration.method import Method
from armblocks.integration.records import Records
from armblocks.integration.workspace import Count, Scalar, Status
from armblocks.routines.arithmetic import fma, maximum, minimum, select
from armblocks.routines.memory import IntegerVariable, Reals, RealVariable
from armblocks.routines.values import Boolean, Integer, Real

TURNS_TOGETHER, MOST_TURNS = 8, 32
"""Modes are changed together in so many turns, and one for each mode; in all, so many turns for each mode."""
LAST_PLACE = 2.0**-52
"""Of a double, beside its size."""
FINEST = 2.0**-12
"""Guards are evaluated at distances no shorter than this part of a step."""
NEAR_START = 2.0**-6
"""Up to this part of a step, values between the steps are poor beside what has changed since its start."""


class Events:
    """Writes what a loop does for guards. ``point`` holds the time of an evaluation."""

    def __init__(
        self, frame: Frame, method: Method, records: Records, evaluation: Evaluation, point: RealVariable
    ) -> None:
        self.frame = frame
        self.method = method
        self.records = records
        self.evaluation = evaluation
        self.point = point
        self.guards = len(frame.sizes.directions)
        self.modes = len(frame.sizes.modes)
        self.functions = GuardFunctions(frame.r.program, frame.places, frame.sizes)
        self.happened = frame.r.integer(0)
        """Whether a guard has fired within the step."""
        places = frame.places
        self.x, self.y, self.new_x = (frame.vector(place) for place in (places.x, places.y, places.new_x))

    def watch(self, time: Real, x: Reals) -> Integer:
        """Evaluate all guards and mark those that fire; how many do."""
        f = self.frame
        self.point.value = time
        t = self.point.memory
        self.evaluation.solve(t, x)
        return f.r.call(self.functions.watch, t, x, f.reals, f.p)

    def watch_inside(self, instant: Real, time: Real, h: Real) -> Integer:
        """How many guards have fired at an instant within the step."""
        self.method.interpolate(instant, time, h, self.new_x)
        return self.watch(minimum(instant, self.frame.clamp.value), self.new_x)

    # At an instant.

    def make_modes_consistent(self, time: Real) -> None:
        """At the start, resets without events: modes and states take the values that the signals ask for.

        A mode may move a signal on which another one depends, so this is repeated until nothing changes, at
        most as often as there are guards.
        """
        f, r, places = self.frame, self.frame.r, self.frame.places
        left, fired = Count.AT_START, f.vector(places.fired)
        with r.when(f.counts[left] != 0):
            self.point.value = time
            for i in r.each(self.guards):
                fired[i] = 0.0
            if self.modes:
                self._follow_at_start()
            f.counts[left] = self.guards
            with r.part() as iteration:
                self.evaluation.solve(self.point.memory, self.x)
                self.reset()
                same = r.real(1.0)
                for before, after, count in (
                    (places.x, places.new_x, f.n),
                    (places.z, places.new_z, f.sizes.discrete),
                ):
                    for i in r.each(count):
                        old, new = f.vector(before)[i], f.vector(after)[i]
                        same.value = select(old != new, 0.0, same.value)
                self.take_reset()
                remaining = f.counts[left] - 1
                f.counts[left] = remaining
                iteration.again_when((same.value == 0.0) & (remaining > 0))
            f.counts[left] = 0

    def _follow_at_start(self) -> None:
        """Modes that follow the signals, before anything with a memory is asked."""
        f, r, functions, t = self.frame, self.frame.r, self.functions, self.point.memory
        turns = r.integer(0)
        with r.loop() as loop:
            self.evaluation.solve(t, self.x)
            functions.evaluate(r, t, self.x, f.reals, f.p)
            turns.value = turns.value + 1
            loop.leave_unless(turns.value < TURNS_TOGETHER + self.modes)
            loop.leave_unless(r.call(functions.any_contradicts, f.reals, r.constant_boolean(True)))
            self.reset()
            self._hold(turns, follows=True)
            r.call(functions.take_followers, f.reals)

    def reset(self) -> None:
        """``new_x`` and ``new_z`` after the events that are marked in ``fired``."""
        f, places = self.frame, self.frame.places
        z, unknowns, fired, new_z = (
            f.vector(place) for place in (places.z, places.trial_w, places.fired, places.new_z)
        )
        t = self.point.memory
        f.r.call(system_functions.reset, t, self.x, z, unknowns, f.p, fired, self.new_x, new_z)

    def take_reset(self) -> None:
        """States and discrete variables become what the reset makes of them."""
        f, places = self.frame, self.frame.places
        f.copy(places.new_x, places.x, f.n)
        f.copy(places.new_z, places.z, f.sizes.discrete)

    def fire(self, time: Real) -> None:
        """Make modes consistent and fire guards, in turns, until nothing is left to change.

        First the modes that follow the signals: those whose guards have passed zero here, and those that
        contradict their conditions. Until they are consistent, signals are not those of this instant, and
        nothing with a memory may act on them. Then all other guards that fire cause one reset. Where none
        fires, modes with a memory that contradict their conditions take their consistent values.

        Contradicting modes change together in the first turns, then the first of them alone, which ends for
        every complementarity problem with a P-matrix (Murty 1974, the least index rule). Where that does not
        end either, no choice of the modes is consistent.
        """
        f, r, functions = self.frame, self.frame.r, self.functions
        yes, no = r.constant_boolean(True), r.constant_boolean(False)
        quiet_turns = r.integer(0)
        with r.loop() as turns:
            turns.leave_when(self.watch(time, self.x) == 0)
            f.count[Count.FRESH].value = 1
            # A turn counts as a step, so that a call of few steps ends soon also where there are many events.
            f.taken.value = f.taken.value + 1
            if self.modes:
                with r.when(r.call(functions.any_contradicts, f.reals, yes)):
                    self._follow(time, quiet_turns)
                    turns.again()
                with r.unless(r.call(functions.any_fired, f.reals, no)):
                    turns.leave_unless(r.call(functions.any_contradicts, f.reals, no))
                    self._remember(time, quiet_turns)
                    turns.again()
            r.call(functions.take_signs, f.reals, no)
            self._count_events(time, yes, bounds=True)
            self.reset()
            self.take_reset()
            self._take_fired_signs()
        r.call(functions.take_signs, f.reals, no)
        places, slopes = f.places, f.vector(f.places.guard_slopes)
        f.copy(places.guards, places.guards_before, self.guards)
        for i in r.each(self.guards):
            slopes[i] = float("nan")

    def _follow(self, time: Real, quiet_turns: IntegerVariable) -> None:
        """One turn of the modes that follow the signals."""
        f, r, functions = self.frame, self.frame.r, self.functions
        r.call(functions.any_fired, f.reals, r.constant_boolean(True))
        self._count_quiet_turn(time, quiet_turns)
        self.reset()
        self._hold(quiet_turns, follows=True)
        r.call(functions.take_followers, f.reals)
        self.evaluation.solve(self.point.memory, self.x)
        if f.sizes.tangents is not None:
            functions.evaluate(r, self.point.memory, self.x, f.reals, f.p)
            r.call(functions.take_tangent_signs, f.reals)

    def _remember(self, time: Real, quiet_turns: IntegerVariable) -> None:
        """One turn of the modes with a memory, without an event."""
        f, r = self.frame, self.frame.r
        r.call(self.functions.take_signs, f.reals, r.constant_boolean(False))
        self._count_quiet_turn(time, quiet_turns)
        self.reset()
        self._hold(quiet_turns, follows=False)
        self.take_reset()
        self._take_fired_signs()

    def _count_quiet_turn(self, time: Real, quiet_turns: IntegerVariable) -> None:
        """Return after too many turns without an event."""
        self._count_events(time, quiet_turns.value == 0, bounds=False)
        quiet_turns.value = quiet_turns.value + 1
        few = quiet_turns.value < MOST_TURNS * self.modes
        self.frame.leave_unless(few, Status.INCONSISTENT_MODES)

    def _hold(self, quiet_turns: IntegerVariable, *, follows: bool) -> None:
        """Modes that are consistent keep their values; late, only the first of the others changes."""
        f, r = self.frame, self.frame.r
        one_by_one = quiet_turns.value > TURNS_TOGETHER + self.modes
        r.call(self.functions.hold_modes, f.reals, r.constant_boolean(follows), one_by_one)

    def _take_fired_signs(self) -> None:
        """Guards that fired take the sign that the reset gives them; the others keep theirs."""
        f, r, t = self.frame, self.frame.r, self.point.memory
        self.evaluation.solve(t, self.x)
        self.functions.evaluate(r, t, self.x, f.reals, f.p)
        r.call(self.functions.take_signs, f.reals, r.constant_boolean(True))

    def _count_events(self, time: Real, first: Boolean, *, bounds: bool) -> None:
        """Return where events follow one another without end; the first step after an event is short."""
        f = self.frame
        bound = f.r.call(self.functions.note_events, time, f.reals, f.counts, first)
        if bounds:
            f.scalar[Scalar.BOUND].value = bound
        # A negative bound is how the count of events says that there is no end to them.
        f.leave_unless(bound >= 0.0, Status.ENDLESS_EVENTS)

    def stop(self, time: Real) -> None:
        """Where a guard that ends the run is positive, record this instant, if it is not, and return."""
        f, r = self.frame, self.frame.r
        if not f.sizes.stops:
            return
        signs = [f.vector(f.places.signs)[k] for k in f.sizes.stops]
        positive: Boolean = signs[0] > 0.0
        for sign in signs[1:]:
            positive = positive | (sign > 0.0)
        with r.when(positive):
            number = f.count[Count.SAMPLE].value
            before = number - 1
            first = before < 0
            latest = f.arrays.samples[select(first, 0, before)]
            later = latest < time * SAME_BELOW
            with r.when((number < f.samples) & (first | later)):
                f.arrays.samples[number] = time
                row = f.arrays.out.after(number * f.n)
                copy(r, self.x, row, f.n)
                self.records.others(time, number, row)
                f.increase(Count.SAMPLE)
            f.leave(Status.STOPPED)

    # Within a step.

    def search(self, time: Real, h: Real) -> None:
        """If a guard fires within the step, go back to the first instant at which one does.

        The step is searched in windows, at the middle and the end of each. A window is as long as the last
        ones proved to be smooth enough, at the start an eighth of the step, and is halved where a guard may
        have gone to zero and come back (``dips``). Then bisection: what is bracketed is "some guard has
        fired", so that the first of several is found; the step ends on the far side of the zero, where it has
        fired.
        """
        f, r, places = self.frame, self.frame.r, self.frame.places
        end = f.new_time.value
        low, high = r.real(time), r.real(end)
        scan = f.reals.after(Scalar.SCAN)
        unknown = scan[0] == float("inf")
        scan[0] = select(unknown, 0.125 * h, minimum(scan[0], h))
        finest = h * FINEST
        self.records.extra_stages_once(time, h)
        with r.part() as search:
            with r.part() as found:
                with r.part() as window:
                    a = low.value
                    middle = fma(0.5, scan[0], a)
                    reached = a + scan[0]
                    # What would leave less than half a window goes along with it, and so does all that is
                    # left where the middle of a window cannot be told from its ends.
                    whole = fma(0.5, scan[0], reached) >= end
                    apart = (middle > a) & (middle < reached)
                    whole = whole | ~apart
                    middle = select(whole, fma(0.5, end - a, a), middle)
                    reached = select(whole, end, reached)
                    high.value = middle
                    found.leave_unless(self.watch_inside(middle, time, h) == 0)
                    f.copy(places.guards, places.guards_middle, self.guards)
                    high.value = reached
                    count = r.integer(0)
                    with r.when(reached >= end):
                        count.value = self.watch(minimum(end, f.clamp.value), self.y)
                    with r.otherwise():
                        count.value = self.watch_inside(reached, time, h)
                    with r.unless(count.value == 0):
                        low.value = middle
                        found.leave()
                    half = middle - a
                    dips = r.call(self.functions.dips, f.reals, half) != 0
                    with r.when(dips & (scan[0] > finest)):
                        length = minimum(scan[0], reached - a)
                        scan[0] = 0.5 * length
                        window.again()
                    r.call(self.functions.note_slopes, f.reals, half)
                    r.call(self.functions.take_signs, f.reals, r.constant_boolean(False))
                    f.copy(places.guards, places.guards_before, self.guards)
                    low.value = reached
                    scan[0] = 2.0 * scan[0]
                    window.again_unless(reached >= end)
                search.leave()
            self.happened.value = 1
            self._bisect(low, high, time, h)
            with r.when(high.value < end):
                # A step across the border of a mode has no stages of its own, and cannot be taken again.
                taken = h > 2.0 * self.crossing(time)
                with r.when((high.value - time < NEAR_START * h) & taken):
                    self._step_again(high.value, time, h)
                with r.otherwise():
                    self.method.interpolate(high.value, time, h, self.y)
                # An event that is one instant with a tick or breakpoint is at its time.
                known = f.end.value
                f.new_time.value = select(high.value * SAME_ABOVE >= known, known, high.value)

    def _step_again(self, instant: Real, time: Real, h: Real) -> None:
        """Make an instant near the start of the step its end, if a guard fires there then as well.

        What leaves zero as a high power of the time has the wrong sign there between the steps, but not at
        their ends: a mass at rest moves once its speed does, and does not pass zero.
        """
        f, r, end = self.frame, self.frame.r, self.frame.new_time.value
        self._take_step(time, instant)
        with r.when(self.watch(minimum(instant, f.clamp.value), self.y) == 0):
            self._take_step(time, end)
            self.records.extra_stages_once(time, h)
            self.method.interpolate(instant, time, h, self.y)

    def _take_step(self, time: Real, new_time: Real) -> None:
        h = new_time - time
        self.records.extra_done.value = 0
        self.frame.h.value = h
        self.method.stages(time, h, new_time)

    def _bisect(self, low: RealVariable, high: RealVariable, time: Real, h: Real) -> None:
        """Move ``high`` to the first instant, to the last place, at which a guard has fired.

        None has at ``low``, some has at ``high``. Instants within four units in the last place are one
        instant: located to the last place, an event at a recorded instant or a tick belongs to it. Near the
        time 0 the last place is that of a millionth of the run.
        """
        r = self.frame.r
        closest = (LAST_PLACE * 1e-6) * self.frame.reals[Scalar.SPAN]
        with r.loop() as bisection:
            a, b = low.value, high.value
            middle = fma(0.5, b - a, a)
            bisection.leave_unless((middle > a) & (middle < b) & (b - a > closest))
            with r.when(self.watch_inside(middle, time, h) == 0):
                low.value = middle
            with r.otherwise():
                high.value = middle

    def shortest(self, time: Real) -> Real:
        """A length that is as good as nothing beside the time."""
        return 2.0**-46 * maximum(time, self.frame.reals[Scalar.SPAN])

    def crossing(self, time: Real) -> Real:
        """The length of the step of :meth:`cross`."""
        return 8.0 * self.shortest(time)

    def cross(self, time: Real) -> None:
        """A step of next to no length along the old derivative, after which some guard must have fired.

        The equations of a mode may end where the mode does: a root of something that is about to be mirrored.
        """
        f, method = self.frame, self.method
        new_time = minimum(time + self.crossing(time), f.end.value)
        h = new_time - time
        f.new_time.value = new_time
        f.h.value = h
        # All stages alike, so that the values between the steps are on the same line.
        for row in range(1, method.tableau.rows):
            copy(f.r, method.K(0), method.K(row), f.n)
        self.records.extra_done.value = 1
        method.move((1.0,), h)
        fired = self.watch(minimum(new_time, f.clamp.value), self.y)
        f.leave_unless(fired != 0, Status.NON_FINITE)
