"""Event location within a step: the first time at which a guard fires, on the dense output.

Where the dense output is not accurate enough, the loop takes a shorter step and evaluates the guards at its
end.
"""

from __future__ import annotations

from armblocks.integration.events import Events
from armblocks.integration.frame import SAME_ABOVE, copy
from armblocks.integration.guard_functions import NEAR_ZERO, NO_SIGN
from armblocks.integration.step_control import GROW
from armblocks.integration.workspace import Scalar, Status
from armblocks.routines.arithmetic import fma, maximum, minimum, select
from armblocks.routines.memory import IntegerVariable, RealVariable
from armblocks.routines.routine import Part
from armblocks.routines.values import Boolean, Integer, Real

EPSILON = 2.0**-52
"""Relative rounding error of a double."""
MIN_WINDOW = 2.0**-12
"""Minimum distance of guard evaluations, as a fraction of a step."""
NEAR_START = 2.0**-6
"""Event locations within this fraction of a step after its start are unreliable: the error of the dense
output may be as large as the change since the start."""


class EventSearch:
    """Emits the event search of a step, and the step across the boundary of a mode."""

    def __init__(self, events: Events) -> None:
        self.events = events
        self.frame, self.method, self.records = events.frame, events.method, events.records
        self.functions, self.guards = events.functions, events.guards
        self.event_located = self.frame.r.integer(0)
        """Whether the step ends at an event that was located on the dense output."""
        workspace = self.frame.workspace
        self.y, self.new_x = (self.frame.vector(place) for place in (workspace.y, workspace.new_x))

    def locate_first_event(self, time: Real) -> None:
        """If a guard fires within the step, shorten the step to the first such time.

        The step is searched in windows. The guards are evaluated at the middle and the end of each window.
        The first window is an eighth of the step. Windows grow while the guards are smooth, and are halved
        where a guard may have touched zero and returned (``possible_touches``). A window is also halved if a
        guard has fired at its middle, so that the time before the event is searched in the same way.
        Bisection on the condition "some guard has fired" then finds the first of several events. The step
        ends just after the zero, where the guard has fired.
        """
        f, r = self.frame, self.frame.r
        low, high, reason = r.real(time), r.real(time), r.integer(0)
        before = r.real(time)
        self._save_start()
        with r.part() as search:
            with r.part() as attempt:
                h, end = f.h.value, f.new_time.value
                # A step across the boundary of a mode has no stages of its method and cannot be shortened.
                divisible = h > 2.0 * self.crossing_length(time)
                self.records.extra_stages_once(time, h)
                with r.part() as checked:
                    with r.part() as bracketed:
                        self._search_windows(time, h, low, high, bracketed)
                        search.leave_unless(divisible & r.call(self.functions.any_returned_to_zero, f.reals))
                        reason.value = NO_SIGN
                        checked.leave()
                    self._bisect(low, high, time, h)
                    before.value = low.value
                    reason.value = 0
                    with r.when(high.value < end):
                        self._check_location(reason, high.value, time, h)
                with r.when((reason.value != 0) & divisible):
                    self._step_to_event(high.value, reason.value == NO_SIGN, time, h, attempt)
                    before.value = (f.new_time.value.bits() - 1).from_bits()
                with r.otherwise(), r.when(high.value < end):
                    self.method.interpolate(high.value, time, h, self.y)
                    f.new_time.value = high.value
            self._store_signs_before(before.value, time)
            self.event_located.value = 1
            # An event that coincides with a tick or breakpoint gets the time of the tick or breakpoint.
            end_time, new_time = f.end.value, f.new_time.value
            f.new_time.value = select(new_time * SAME_ABOVE >= end_time, end_time, new_time)

    def _search_windows(
        self, time: Real, h: Real, low: RealVariable, high: RealVariable, bracketed: Part
    ) -> None:
        """Search the windows of a step. Where a guard fires, leave ``bracketed``; ``low`` and
        ``high`` bracket the time."""
        f, r, workspace = self.frame, self.frame.r, self.frame.workspace
        end = f.new_time.value
        limit = r.real(end)
        """The latest end of the present window: the end of the step, or the first time after the start of
        the window at which a guard is known to fire."""
        low.value = time
        next_length = f.reals.after(Scalar.WINDOW)
        unknown = next_length[0] == float("inf")
        next_length[0] = select(unknown, 0.125 * h, minimum(next_length[0], h))
        shortest = h * MIN_WINDOW
        length = r.real(next_length[0])
        with r.part() as window:
            a = low.value
            middle = fma(0.5, length.value, a)
            reached = a + length.value
            # The window extends to the limit if the rest is shorter than half a window, or if rounding
            # makes the middle of the window equal to one of its ends.
            whole = fma(0.5, length.value, reached) >= limit.value
            middle_inside = (middle > a) & (middle < reached)
            whole = whole | ~middle_inside
            middle = select(whole, fma(0.5, limit.value - a, a), middle)
            reached = select(whole, limit.value, reached)
            length.value = reached - a
            divisible = middle_inside & (length.value > shortest)
            high.value = middle
            with r.unless(self.count_fired_at(middle, time, h) == 0):
                bracketed.leave_unless(divisible)
                limit.value = middle
                length.value = middle - a
                window.again()
            f.copy(workspace.guards, workspace.guards_middle, self.guards)
            high.value = reached
            count = r.integer(0)
            with r.when(reached >= end):
                count.value = self.events.mark_fired(minimum(end, f.clamp.value), self.y)
            with r.otherwise():
                count.value = self.count_fired_at(reached, time, h)
            half = middle - a
            touches = r.call(self.functions.possible_touches, f.reals, half) != 0
            with r.when(touches & divisible & (next_length[0] > shortest)):
                length.value = 0.5 * minimum(length.value, next_length[0])
                next_length[0] = length.value
                window.again()
            with r.unless(count.value == 0):
                low.value = middle
                bracketed.leave()
            r.call(self.functions.store_derivatives, f.reals, half)
            r.call(self.functions.store_signs, f.reals, r.constant_boolean(False))
            f.copy(workspace.guards, workspace.guards_before, self.guards)
            low.value = reached
            limit.value = end
            next_length[0] = 2.0 * next_length[0]
            length.value = next_length[0]
            window.again_unless(reached >= end)

    def count_fired_at(self, instant: Real, time: Real, h: Real) -> Integer:
        """The number of guards that have fired at a time within the step."""
        self.method.interpolate(instant, time, h, self.new_x)
        return self.events.mark_fired(minimum(instant, self.frame.clamp.value), self.new_x)

    def _store_signs_before(self, instant: Real, time: Real) -> None:
        """Store the signs of all guards just before the event.

        A guard may have crossed zero against its direction in this step. That crossing is not an event, but
        the guard needs its present sign for the comparison at the event. On the dense output of a step to an
        unreliable location, guards may fire slightly earlier; these guards keep their signs.
        """
        f, r = self.frame, self.frame.r
        h = f.h.value
        self.records.extra_stages_once(time, h)
        self.count_fired_at(maximum(instant, time), time, h)
        r.call(self.functions.store_other_signs, f.reals)

    def _check_location(self, reason: IntegerVariable, instant: Real, time: Real, h: Real) -> None:
        """Set ``reason`` to the reason why the event location is unreliable, or to 0 if it is reliable.

        A location on the dense output is unreliable near the start of the step, and if the guard is near zero
        at the start. A guard that leaves zero in proportion to a high power of time may have the wrong sign
        on the dense output. An example is the position of a mass that starts from rest. At the ends of steps
        the sign of the guard is correct.
        """
        f, r, functions, t = self.frame, self.frame.r, self.functions, self.events.point.memory
        self.count_fired_at(instant, time, h)
        self.events.point.value = minimum(f.new_time.value, f.clamp.value)
        self.events.evaluation.solve(t, self.y)
        functions.evaluate(r, t, self.y, f.reals, f.p)
        early = instant - time < NEAR_START * h
        location_reason = r.call(functions.unreliable_location, f.reals)
        reason.value = select(early & (location_reason == 0), NEAR_ZERO, location_reason)

    def _step_to_event(self, instant: Real, no_sign: Boolean, time: Real, h: Real, attempt: Part) -> None:
        """Take a step to an unreliable event location and evaluate the guards at its end.

        If no guard has fired there, a step of an eighth of the original length is taken and searched, unless
        the location is even earlier. If the guard had no sign at the start, the step ends halfway to the
        location, and the guard gets its sign there.
        """
        f, r, crossing = self.frame, self.frame.r, self.crossing_length(time)
        distance, shorter = instant - time, 0.125 * h
        length = select(no_sign, maximum(0.5 * distance, crossing), distance)
        new_time = r.real(time + length)
        last = no_sign | (distance >= shorter) | (shorter < 2.0 * crossing)
        searched = r.boolean(False)
        with r.part() as step:
            self._take_step(time, new_time.value)
            self._restore_start()
            with r.when(searched.value):
                self._limit_next_step(shorter)
                attempt.again()
            step.leave_unless(self.events.mark_fired(minimum(new_time.value, f.clamp.value), self.y) == 0)
            with r.when(last):
                # At least ``crossing_length``, so that steps without an event are not arbitrarily short.
                step.leave_when(f.h.value > 0.5 * crossing)
                new_time.value = time + crossing
                step.again()
            searched.value = True
            new_time.value = time + shorter
            step.again()
        self._limit_next_step(f.h.value)

    def _save_start(self) -> None:
        """Save the guard data of the start of the step."""
        workspace, f = self.frame.workspace, self.frame
        f.copy(workspace.signs, workspace.signs_at_start, self.guards)
        f.copy(workspace.guards_before, workspace.guards_at_start, self.guards)

    def _restore_start(self) -> None:
        """Restore the guard data of the start of the step."""
        workspace, f = self.frame.workspace, self.frame
        f.copy(workspace.signs_at_start, workspace.signs, self.guards)
        f.copy(workspace.guards_at_start, workspace.guards_before, self.guards)
        for i in f.r.each(self.guards):
            f.vector(workspace.guard_derivatives)[i] = float("nan")

    def _limit_next_step(self, h: Real) -> None:
        """Limit the next adaptive step to ``GROW`` times the length ``h``."""
        if self.method.tableau.adaptive:
            length = self.frame.scalar[Scalar.STEP]
            length.value = minimum(length.value, GROW * h)

    def _take_step(self, time: Real, new_time: Real) -> None:
        f, h = self.frame, new_time - time
        self.records.extra_stages_done.value = 0
        f.h.value = h
        f.new_time.value = new_time
        self.method.stages(time, h, new_time)

    def _bisect(self, low: RealVariable, high: RealVariable, time: Real, h: Real) -> None:
        """Bisect until ``high`` is the first time, to one unit in the last place, at which a guard has fired.

        At ``low`` no guard has fired, at ``high`` some guard has. Times within four units in the last place
        are one instant, so an event at a recorded time or a tick coincides with it. For times below a
        millionth of the length of the run, the unit in the last place of that time applies.
        """
        r = self.frame.r
        closest = (EPSILON * 1e-6) * self.frame.reals[Scalar.SPAN]
        with r.loop() as bisection:
            a, b = low.value, high.value
            middle = fma(0.5, b - a, a)
            bisection.leave_unless((middle > a) & (middle < b) & (b - a > closest))
            with r.when(self.count_fired_at(middle, time, h) == 0):
                low.value = middle
            with r.otherwise():
                high.value = middle

    def negligible_step(self, time: Real) -> Real:
        """A step length that is negligible relative to the time."""
        return 2.0**-46 * maximum(time, self.frame.reals[Scalar.SPAN])

    def crossing_length(self, time: Real) -> Real:
        """The length of the step of :meth:`cross_mode_boundary`."""
        return 8.0 * self.negligible_step(time)

    def cross_mode_boundary(self, time: Real) -> None:
        """Take a step of negligible length along the last derivative. Some guard must have fired at its end.

        It crosses the boundary of a mode beyond which the equations of that mode are undefined, for example
        where the argument of a square root becomes negative.
        """
        f, method = self.frame, self.method
        new_time = minimum(time + self.crossing_length(time), f.end.value)
        h = new_time - time
        f.new_time.value = new_time
        f.h.value = h
        # All stages are equal, so that the dense output is linear.
        for row in range(1, method.tableau.rows):
            copy(f.r, method.K(0), method.K(row), f.n)
        self.records.extra_stages_done.value = 1
        method.sums.set_y((1.0,), h)
        fired = self.events.mark_fired(minimum(new_time, f.clamp.value), self.y)
        f.leave_unless(fired != 0, Status.NON_FINITE)
