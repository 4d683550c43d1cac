"""Functions of a loop for guards: fired guards, signs, and detection of endless events."""

from __future__ import annotations

from collections.abc import Iterator

from armblocks.integration import system_functions
from armblocks.integration.workspace import Count, LoopSizes, Scalar, Workspace
from armblocks.routines.arithmetic import fma, maximum, minimum, select, sign
from armblocks.routines.memory import Integers, Reals
from armblocks.routines.routine import Program, Routine
from armblocks.routines.values import Boolean, Integer, Real

MAX_CLOSE_EVENTS = 1000
"""Maximum number of consecutive close events whose distances do not shrink."""
CLOSE_DISTANCE = 1e-12
"""Relative distance below which events count as close."""
MAX_RAPID_EVENTS, RAPID_DISTANCE = 100_000, 1e-8
"""Consecutive events count as endless after this number of them at this relative distance or less. The run
advances by less than a thousandth of its time during them."""
ZENO_EVENTS, ZENO_DISTANCE = 10, 2.0**-46
"""Zeno behaviour: a guard has fired at least this many consecutive times at shrinking distances. The last
distance is below this fraction of the time (about 100 units in the last place)."""
FIRST_STEP = 0.01
"""Maximum first step after an event, relative to the time between the last two events of the guard."""

NO_SIGN, NEAR_ZERO = 2, 1
"""Reasons for an unreliable event location: the fired guard had no sign at the start of the step, or was near
zero there."""
NEAR_ZERO_FRACTION = 2.0**-3
"""A guard is near zero at the start of a step if it is below this fraction of its value at the end."""


class GuardFunctions:
    """The functions of a program for the guards of a system.

    All functions take ``reals``, the array of the run with the guards' vectors. The direction of a guard is 1
    if it fires upwards, -1 if downwards, 0 for both.
    """

    def __init__(self, program: Program, workspace: Workspace, sizes: LoopSizes) -> None:
        self.workspace = workspace
        self.count = len(sizes.directions)
        self.modes = sizes.modes
        self.followers = tuple(int(follows) for follows in sizes.followers)
        self.disabled_guards = sizes.disabled_guards
        self.locating_guards = tuple(int(number in sizes.locating_guards) for number in range(self.count))
        self.tangents = sizes.tangents
        self.states, self.discrete = sizes.states, sizes.discrete
        self.directions = tuple(float(direction) for direction in sizes.directions)
        self.mark_fired = program.define(self._mark_fired, "mark_fired")
        self.store_signs = program.define(self._store_signs, "store_signs")
        self.store_other_signs = program.define(self._store_other_signs, "store_other_signs")
        self.store_disabled_signs = (
            program.define(self._store_disabled_signs, "store_disabled_signs")
            if sizes.disabled_guards
            else None
        )
        self.count_events = program.define(self._count_events, "count_events")
        self.possible_touches = program.define(self._possible_touches, "possible_touches")
        self.store_derivatives = program.define(self._store_derivatives, "store_derivatives")
        self.unreliable_location = program.define(self._unreliable_location, "unreliable_location")
        self.any_returned_to_zero = program.define(self._any_returned_to_zero, "any_returned_to_zero")
        self.any_fired = program.define(self._any_fired, "any_fired")
        self.any_inconsistent = program.define(self._any_inconsistent, "any_inconsistent")
        self.copy_following_modes = program.define(self._copy_following_modes, "copy_following_modes")
        self.store_tangent_signs = program.define(self._store_tangent_signs, "store_tangent_signs")
        self.restrict_mode_changes = program.define(self._restrict_mode_changes, "restrict_mode_changes")

    def evaluate(self, r: Routine, t: Reals, x: Reals, reals: Reals, p: Reals) -> None:
        """Evaluate the guards and the inconsistencies of modes at a point whose unknowns are solved."""
        workspace = self.workspace
        z, unknowns, values = (
            reals.after(place) for place in (workspace.z, workspace.trial_w, workspace.guards)
        )
        if self.modes:
            contradictions = reals.after(workspace.contradictions)
            r.call(system_functions.guards_and_modes, t, x, z, unknowns, p, values, contradictions)
        else:
            r.call(system_functions.guards, t, x, z, unknowns, p, values)

    def _mark_fired(self, r: Routine, t: Reals, x: Reals, reals: Reals, p: Reals) -> Integer:
        """Evaluate the guards with ``trial_w`` and mark firing guards in ``fired``, with the direction.
        Returns the number of guards that fire plus the number of inconsistent modes."""
        workspace = self.workspace
        self.evaluate(r, t, x, reals, p)
        values, signs, fired, contradictions = (
            reals.after(place)
            for place in (workspace.guards, workspace.signs, workspace.fired, workspace.contradictions)
        )
        directions = r.reals("guard.directions", self.directions)
        total = r.integer(0)
        for i in r.each(self.count):
            new_sign, old_sign, direction = sign(values[i]), signs[i], directions[i]
            crossed = (new_sign * old_sign < 0.0) & (new_sign * direction >= 0.0)
            fired[i] = select(crossed, new_sign, 0.0)
            total.value = total.value + crossed.count()
        z = reals.after(workspace.z)
        for guard, place in self._each_disabled_guard(r):
            active = (fired[guard] == 0.0) | (z[place] == 0.0)
            fired[guard] = select(active, fired[guard], 0.0)
            total.value = total.value - (~active).count()
        for i in r.each(len(self.modes)):
            inconsistent = contradictions[i] != 0.0
            total.value = total.value + inconsistent.count()
        return total.value

    def _unreliable_location(self, r: Routine, reals: Reals) -> Integer:
        """The reason why the event location of a marked guard is unreliable, or 0: the guard had no sign at
        the start of the step, or was near zero there. ``guards`` has the values at the end of the
        step."""
        workspace, worst_reason = self.workspace, r.integer(0)
        for i in r.each(self.count):
            fired, old_sign, value_at_start, value_at_end = (
                reals.after(place)[i]
                for place in (
                    workspace.fired,
                    workspace.signs_at_start,
                    workspace.guards_at_start,
                    workspace.guards,
                )
            )
            near = abs(value_at_start) <= NEAR_ZERO_FRACTION * abs(value_at_end)
            reason = select(old_sign == 0.0, r.constant_integer(NO_SIGN), near.count())
            worse = (fired != 0.0) & (reason > worst_reason.value)
            worst_reason.value = select(worse, reason, worst_reason.value)
        return worst_reason.value

    def _any_returned_to_zero(self, r: Routine, reals: Reals) -> Boolean:
        """Whether a guard without a sign at the start of the step has a sign now and is zero at the end."""
        workspace, any_returned = self.workspace, r.boolean(False)
        for i in r.each(self.count):
            old_sign, new_sign, value = (
                reals.after(place)[i]
                for place in (workspace.signs_at_start, workspace.signs, workspace.guards)
            )
            any_returned.value = any_returned.value | ((old_sign == 0.0) & (new_sign != 0.0) & (value == 0.0))
        return any_returned.value

    def _any_fired(self, r: Routine, reals: Reals, locating: Boolean) -> Boolean:
        """Whether a selected guard is marked; clears the marks of all other guards. With ``locating``, the
        guards that only locate mode changes are selected, else all others. Guards of derivatives are always
        selected."""
        any_fired, fired = r.boolean(False), reals.after(self.workspace.fired)
        locates = r.integers("guard.locates", self.locating_guards)
        for i in r.each(self.count):
            selected = _equal(locates[i] != 0, locating)
            if self.tangents is not None:
                selected = selected | (r.constant_integer(0) + i >= self.tangents[2])
            fired[i] = select(selected, fired[i], 0.0)
            any_fired.value = any_fired.value | (fired[i] != 0.0)
        return any_fired.value

    def _any_inconsistent(self, r: Routine, reals: Reals, follows: Boolean) -> Boolean:
        """Whether a following mode is inconsistent (``follows``), or whether a stateful mode is."""
        any_inconsistent, contradictions = r.boolean(False), reals.after(self.workspace.contradictions)
        followers = r.integers("mode.follows", self.followers)
        for i in r.each(len(self.modes)):
            selected = _equal(followers[i] != 0, follows)
            any_inconsistent.value = any_inconsistent.value | (selected & (contradictions[i] != 0.0))
        return any_inconsistent.value

    def _restrict_mode_changes(self, r: Routine, reals: Reals, follows: Boolean, only_first: Boolean) -> None:
        """Keep in ``new_z`` the values of the reset for inconsistent modes of one kind, for all or only for
        the first. All other modes get their old values. ``follows`` selects following modes, else stateful
        modes."""
        z, new_z, contradictions = (
            reals.after(place)
            for place in (self.workspace.z, self.workspace.new_z, self.workspace.contradictions)
        )
        indices, followers = r.integers("mode.places", self.modes), r.integers("mode.follows", self.followers)
        changed = r.boolean(False)
        for i in r.each(len(self.modes)):
            place = indices[i]
            selected = _equal(followers[i] != 0, follows)
            inconsistent, before = selected & (contradictions[i] != 0.0), changed.value
            new_z[place] = select(inconsistent & ~before, new_z[place], z[place])
            changed.value = before | (inconsistent & only_first)

    def _copy_following_modes(self, r: Routine, reals: Reals) -> None:
        """Copy the values of the reset for following modes, and for derivatives."""
        workspace = self.workspace
        x, new_x, z, new_z = (
            reals.after(place) for place in (workspace.x, workspace.new_x, workspace.z, workspace.new_z)
        )
        of_modes, followers = (
            r.integers("mode.places", self.modes),
            r.integers("mode.follows", self.followers),
        )
        for i in r.each(len(self.modes)):
            place = of_modes[i]
            z[place] = select(followers[i] != 0, new_z[place], z[place])
        if self.tangents is None:
            return
        first_x, first_z, _ = self.tangents
        r.copy(new_x.after(first_x), x.after(first_x), self.states - first_x)
        r.copy(new_z.after(first_z), z.after(first_z), self.discrete - first_z)

    def _store_tangent_signs(self, r: Routine, reals: Reals) -> None:
        """Update the signs of the fired guards of derivatives."""
        workspace = self.workspace
        values, signs, fired = (
            reals.after(place) for place in (workspace.guards, workspace.signs, workspace.fired)
        )
        first = self.count if self.tangents is None else self.tangents[2]
        for i in range(first, self.count):
            signs[i] = select(fired[i] != 0.0, sign(values[i]), signs[i])

    def _possible_touches(self, r: Routine, reals: Reals, half: Real) -> Integer:
        """Count the guards that may have touched zero and returned within a window, although its three
        values, ``half`` apart, have the same sign. Guards that have fired at the end are not counted.

        A, M, B are the distances from zero at the beginning, in the middle and at the end. The parabola
        through them is M + (B - A) s / 2 + C s^2 / 2 with C = A - 2 M + B, for s from -1 to 1. A guard may
        have touched zero in two cases:

        - The minimum of the parabola lies inside the window and near zero.
        - The initial derivative of the parabola differs from the derivative at the end of the previous
          window. Let D be the difference times half the window. A cubic with the derivative of the previous
          window deviates from the parabola by D / 5. The guard is safe if D / 2 is less than A, M and B.
        """
        total = r.integer(0)
        for i in r.each(self.count):
            side = reals.after(self.workspace.signs)[i]
            A, M, B = (side * value for value in self._window(reals, i))
            rise = B - A
            bend = A - M + (B - M)
            inside = abs(rise) < 1.98 * bend
            # The minimum is M - rise^2 / (8 bend). It is near zero if it is below a quarter of the bend.
            eight = 8.0 * bend
            least = fma(eight, M, -1.0 * (rise * rise))
            near = least < 0.25 * bend * eight
            touches = (inside & near) | self._derivative_jumps(reals, half, i, side, (A, M, B))
            touches = touches & (reals.after(self.workspace.fired)[i] == 0.0)
            total.value = total.value + touches.count()
        return total.value

    def _window(self, reals: Reals, i: Integer | int) -> tuple[Real, Real, Real]:
        """The values of a guard at the beginning, in the middle and at the end of a window."""
        workspace = self.workspace
        before, middle, end = (
            reals.after(place)[i]
            for place in (workspace.guards_before, workspace.guards_middle, workspace.guards)
        )
        return before, middle, end

    def _derivative_jumps(
        self, reals: Reals, half: Real, i: Integer | int, side: Real, distances: tuple[Real, Real, Real]
    ) -> Boolean:
        """Whether the derivative of a guard differs too much from that at the end of the previous window.

        False where the previous derivative is NaN."""
        A, M, B = distances
        previous_derivative = side * reals.after(self.workspace.guard_derivatives)[i]
        derivative = fma(-1.5, A, fma(2.0, M, -0.5 * B))
        jump = abs(derivative - previous_derivative * half)
        least = minimum(A, minimum(M, B))
        large = 0.5 * jump > least
        return (least > 0.0) & large

    def _store_derivatives(self, r: Routine, reals: Reals, half: Real) -> None:
        """Store the derivative at the end of the parabola through the last three values of each guard."""
        for i in r.each(self.count):
            A, M, B = self._window(reals, i)
            rise = fma(1.5, B, fma(-2.0, M, 0.5 * A))
            reals.after(self.workspace.guard_derivatives)[i] = rise / half

    def _store_signs(self, r: Routine, reals: Reals, only_fired: Boolean) -> None:
        """Store the signs of all guards, or of the fired guards only."""
        workspace = self.workspace
        values, signs, fired = (
            reals.after(place) for place in (workspace.guards, workspace.signs, workspace.fired)
        )
        directions = r.reals("guard.directions", self.directions)
        for i in r.each(self.count):
            new_sign, old_sign, mark = sign(values[i]), signs[i], fired[i]
            has_fired, nonzero = mark != 0.0, new_sign != 0.0
            present_sign = select(nonzero, new_sign, old_sign)
            # A guard of one direction that is zero after its reset gets the sign opposite to the crossing. A
            # ball at floor level with a downward speed therefore bounces again.
            directed = directions[i] != 0.0
            sign_after_reset = select(directed & has_fired, -1.0 * mark, new_sign)
            sign_after_event = select(has_fired, select(nonzero, new_sign, sign_after_reset), old_sign)
            signs[i] = select(only_fired, sign_after_event, present_sign)

    def _store_other_signs(self, r: Routine, reals: Reals) -> None:
        """Store the signs of the guards that have not fired."""
        workspace = self.workspace
        values, signs, fired = (
            reals.after(place) for place in (workspace.guards, workspace.signs, workspace.fired)
        )
        for i in r.each(self.count):
            now, known = sign(values[i]), signs[i]
            signs[i] = select((fired[i] == 0.0) & (now != 0.0), now, known)

    def _store_disabled_signs(self, r: Routine, reals: Reals) -> None:
        """Set the signs of disabled guards to the signs of their values, including 0."""
        workspace = self.workspace
        values, signs, z = (reals.after(place) for place in (workspace.guards, workspace.signs, workspace.z))
        for guard, place in self._each_disabled_guard(r):
            signs[guard] = select(z[place] == 0.0, signs[guard], sign(values[guard]))

    def _each_disabled_guard(self, r: Routine) -> Iterator[tuple[Integer, Integer]]:
        """A loop of the routine over the disabled guards; yields each with the index of its momentary
        value."""
        if not self.disabled_guards:
            return
        guards, indices = zip(*self.disabled_guards)
        of_guards, of_places = r.integers("disabled.guards", guards), r.integers("disabled.by", indices)
        for i in r.each(len(self.disabled_guards)):
            yield of_guards[i], of_places[i]

    def _count_events(self, r: Routine, t: Real, reals: Reals, counts: Integers, first: Boolean) -> Real:
        """Count the events at a time, and the consecutive close events.

        Returns the maximum length of the next step, negative for endless events.

        ``first`` is false in further mode iterations at the same time. A guard is counted once at each time.

        Events are close if their distance is below ``CLOSE_DISTANCE`` times the time. A series with shrinking
        distances, such as a bouncing ball, may end. It counts as endless only if the distances reach the
        rounding error of time, or after ``MAX_RAPID_EVENTS`` consecutive events.
        """
        workspace = self.workspace
        bound = r.real(float("inf"))
        scale = maximum(t, 1e-6 * reals[Scalar.SPAN])
        shrunk = ZENO_DISTANCE * scale
        since_last = t - reals[Scalar.LAST_EVENT]
        close, rapid = since_last <= CLOSE_DISTANCE * scale, since_last <= RAPID_DISTANCE * scale
        reals[Scalar.LAST_EVENT] = t
        fired_one, ending, endless = r.boolean(False), r.boolean(True), r.boolean(False)
        fired, repeats, last, gap, shrinking = (
            reals.after(place)
            for place in (
                workspace.fired,
                workspace.repeats,
                workspace.last,
                workspace.gap,
                workspace.shrinking,
            )
        )
        for i in r.each(self.count):
            repeats[i] = select(close, repeats[i], 0.0)
            with r.when((fired[i] != 0.0) & (first | (last[i] != t))):
                fired_one.value = True
                counts[Count.EVENTS] = counts[Count.EVENTS] + 1
                repeats[i] = repeats[i] + 1.0
                passed, known = t - last[i], gap[i]
                later = passed > 0.0
                shorter = later & (passed < known)
                ending.value = ending.value & shorter
                times = select(shorter, shrinking[i] + 1.0, 0.0)
                times = select(later, times, shrinking[i])
                shrinking[i] = times
                ends = shorter & (passed < shrunk) & (times >= float(ZENO_EVENTS))
                endless.value = endless.value | ends
                distance = select(later, passed, known)
                gap[i] = distance
                last[i] = t
                bound.value = minimum(FIRST_STEP * distance, bound.value)
        shrinks = fired_one.value & ending.value
        further = counts[Count.CLOSE_EVENTS] + (first & ~shrinks).count()
        consecutive = select(close, further, 0)
        counts[Count.CLOSE_EVENTS] = consecutive
        rapid_events = select(rapid, counts[Count.RAPID_EVENTS] + first.count(), 0)
        counts[Count.RAPID_EVENTS] = rapid_events
        without_end = endless.value | (consecutive > MAX_CLOSE_EVENTS) | (rapid_events > MAX_RAPID_EVENTS)
        return select(without_end, -1.0, bound.value)


def _equal(one: Boolean, other: Boolean) -> Boolean:
    """Whether both are true or both are false."""
    return (one & other) | (~one & ~other)
