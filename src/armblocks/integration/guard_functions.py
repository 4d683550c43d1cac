"""Functions of a loop for guards: fired guards, signs, and detection of endless events."""

from __future__ import annotations

from collections.abc import Iterator

from armblocks.integration import system_functions
from armblocks.integration.workspace import Count, LoopSizes, Scalar, Workspace
from armblocks.routines.arithmetic import fma, maximum, minimum, select, sign
from armblocks.routines.memory import Integers, Reals
from armblocks.routines.routine import Program, Routine
from armblocks.routines.values import Boolean, Integer, Real

MOST_AT_ONCE = 1000
"""Maximum number of close events at distances that do not shrink."""
CLOSE = 1e-12
"""Relative distance below which events count as close."""
MOST_CROWDED, CROWD = 100_000, 1e-8
"""Number of consecutive events at most this relative distance apart that count as endless. The run advances
by less than a thousandth of its time during them."""
SHRINKING, SHRUNK = 10, 2.0**-46
"""Zeno behaviour: a guard has fired at least this many times in a row at shrinking distances, and the last
distance is below this fraction of the time (about 100 units in the last place)."""
SHORT = 0.01
"""Maximum first step after an event, relative to the time between the last two events of the guard."""

UNDECIDED, NEXT_TO_ZERO = 2, 1
"""Reasons for a doubtful event: the fired guard had no sign at the start of the step, or was near zero."""
NEAR = 2.0**-3
"""A guard is near zero at the start of a step if it is below this fraction of its value at the end."""


class GuardFunctions:
    """The functions of a program for the guards of a system.

    All functions take ``reals``, the array of the run with the guards' vectors. The direction of a guard is 1
    if it fires upwards, -1 if downwards, 0 for both.
    """

    def __init__(self, program: Program, workspace: Workspace, sizes: LoopSizes) -> None:
        self.places = workspace
        self.count = len(sizes.directions)
        self.modes = sizes.modes
        self.followers = tuple(int(follows) for follows in sizes.followers)
        self.silenced = sizes.silenced
        self.locating = tuple(int(number in sizes.locating) for number in range(self.count))
        self.tangents = sizes.tangents
        self.states, self.discrete = sizes.states, sizes.discrete
        self.directions = tuple(float(direction) for direction in sizes.directions)
        self.watch = program.define(self._watch, "watch")
        self.take_signs = program.define(self._take_signs, "take_signs")
        self.begin_anew = program.define(self._begin_anew, "begin_anew") if sizes.silenced else None
        self.note_events = program.define(self._note_events, "note_events")
        self.dips = program.define(self._dips, "dips")
        self.note_slopes = program.define(self._note_slopes, "note_slopes")
        self.doubtful = program.define(self._doubtful, "doubtful")
        self.any_returned = program.define(self._any_returned, "any_returned")
        self.any_fired = program.define(self._any_fired, "any_fired")
        self.any_contradicts = program.define(self._any_contradicts, "any_contradicts")
        self.take_followers = program.define(self._take_followers, "take_followers")
        self.take_tangent_signs = program.define(self._take_tangent_signs, "take_tangent_signs")
        self.hold_modes = program.define(self._hold_modes, "hold_modes")

    def evaluate(self, r: Routine, t: Reals, x: Reals, reals: Reals, p: Reals) -> None:
        """Evaluate the guards and the inconsistencies of modes at a point whose unknowns are solved."""
        places = self.places
        z, unknowns, values = (reals.after(place) for place in (places.z, places.trial_w, places.guards))
        if self.modes:
            contradictions = reals.after(places.contradictions)
            r.call(system_functions.guards_and_modes, t, x, z, unknowns, p, values, contradictions)
        else:
            r.call(system_functions.guards, t, x, z, unknowns, p, values)

    def _watch(self, r: Routine, t: Reals, x: Reals, reals: Reals, p: Reals) -> Integer:
        """Evaluate the guards with ``trial_w`` and mark in ``fired`` those that fire, with the direction.
        Returns the number of guards that fire plus the number of inconsistent modes."""
        places = self.places
        self.evaluate(r, t, x, reals, p)
        values, signs, fired, contradictions = (
            reals.after(place) for place in (places.guards, places.signs, places.fired, places.contradictions)
        )
        directions = r.reals("guard.directions", self.directions)
        total = r.integer(0)
        for i in r.each(self.count):
            now, known, wanted = sign(values[i]), signs[i], directions[i]
            crossed = (now * known < 0.0) & (now * wanted >= 0.0)
            fired[i] = select(crossed, now, 0.0)
            total.value = total.value + crossed.count()
        z = reals.after(places.z)
        for guard, place in self._silenced(r):
            heard = (fired[guard] == 0.0) | (z[place] == 0.0)
            fired[guard] = select(heard, fired[guard], 0.0)
            total.value = total.value - (~heard).count()
        for i in r.each(len(self.modes)):
            found = contradictions[i] != 0.0
            total.value = total.value + found.count()
        return total.value

    def _doubtful(self, r: Routine, reals: Reals) -> Integer:
        """The reason why a marked guard is doubtful, or 0: it had no sign at the start of the step, or was
        near zero there. The values in ``guards`` are those at the end of the step."""
        places, found = self.places, r.integer(0)
        for i in r.each(self.count):
            fired, known, before, after = (
                reals.after(place)[i]
                for place in (places.fired, places.signs_at_start, places.guards_at_start, places.guards)
            )
            near = abs(before) <= NEAR * abs(after)
            why = select(known == 0.0, r.constant_integer(UNDECIDED), near.count())
            worse = (fired != 0.0) & (why > found.value)
            found.value = select(worse, why, found.value)
        return found.value

    def _any_returned(self, r: Routine, reals: Reals) -> Boolean:
        """Whether a guard without a sign at the start of the step has a sign now and is zero at the end."""
        places, found = self.places, r.boolean(False)
        for i in r.each(self.count):
            before, now, value = (
                reals.after(place)[i] for place in (places.signs_at_start, places.signs, places.guards)
            )
            found.value = found.value | ((before == 0.0) & (now != 0.0) & (value == 0.0))
        return found.value

    def _any_fired(self, r: Routine, reals: Reals, locating: Boolean) -> Boolean:
        """Whether a guard of one kind is marked; clears the marks of the other kind. With ``locating`` the
        kind is the guards that only locate mode changes, else all others. Guards of derivatives belong to
        both."""
        found, fired = r.boolean(False), reals.after(self.places.fired)
        locates = r.integers("guard.locates", self.locating)
        for i in r.each(self.count):
            asked = _same(locates[i] != 0, locating)
            if self.tangents is not None:
                asked = asked | (r.constant_integer(0) + i >= self.tangents[2])
            fired[i] = select(asked, fired[i], 0.0)
            found.value = found.value | (fired[i] != 0.0)
        return found.value

    def _any_contradicts(self, r: Routine, reals: Reals, follows: Boolean) -> Boolean:
        """Whether a following mode is inconsistent (``follows``), or whether a stateful mode is."""
        found, contradictions = r.boolean(False), reals.after(self.places.contradictions)
        followers = r.integers("mode.follows", self.followers)
        for i in r.each(len(self.modes)):
            asked = _same(followers[i] != 0, follows)
            found.value = found.value | (asked & (contradictions[i] != 0.0))
        return found.value

    def _hold_modes(self, r: Routine, reals: Reals, follows: Boolean, only_first: Boolean) -> None:
        """Keep in ``new_z`` the values of the reset for inconsistent modes of one kind, all or only the
        first; give all other modes their old values. ``follows`` selects following modes, else stateful
        modes."""
        z, new_z, contradictions = (
            reals.after(place) for place in (self.places.z, self.places.new_z, self.places.contradictions)
        )
        places, followers = r.integers("mode.places", self.modes), r.integers("mode.follows", self.followers)
        held = r.boolean(False)
        for i in r.each(len(self.modes)):
            place = places[i]
            asked = _same(followers[i] != 0, follows)
            contradicts, kept = asked & (contradictions[i] != 0.0), held.value
            new_z[place] = select(contradicts & ~kept, new_z[place], z[place])
            held.value = kept | (contradicts & only_first)

    def _take_followers(self, r: Routine, reals: Reals) -> None:
        """Copy the values of the reset for following modes, and for derivatives."""
        places = self.places
        x, new_x, z, new_z = (
            reals.after(place) for place in (places.x, places.new_x, places.z, places.new_z)
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

    def _take_tangent_signs(self, r: Routine, reals: Reals) -> None:
        """Update the signs of the fired guards of derivatives."""
        places = self.places
        values, signs, fired = (reals.after(place) for place in (places.guards, places.signs, places.fired))
        first = self.count if self.tangents is None else self.tangents[2]
        for i in range(first, self.count):
            signs[i] = select(fired[i] != 0.0, sign(values[i]), signs[i])

    def _dips(self, r: Routine, reals: Reals, half: Real) -> Integer:
        """Count the guards that may have touched zero and returned within a window, although its three
        values, ``half`` apart, have the same sign.

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
            side = reals.after(self.places.signs)[i]
            A, M, B = (side * value for value in self._window(reals, i))
            rise = B - A
            bend = A - M + (B - M)
            inside = abs(rise) < 1.98 * bend
            # The minimum is M - rise^2 / (8 bend). It is near zero if it is below a quarter of the bend.
            eight = 8.0 * bend
            least = fma(eight, M, -1.0 * (rise * rise))
            near = least < 0.25 * bend * eight
            dips = (inside & near) | self._turns(reals, half, i, side, (A, M, B))
            total.value = total.value + dips.count()
        return total.value

    def _window(self, reals: Reals, i: Integer | int) -> tuple[Real, Real, Real]:
        """The values of a guard at the beginning, in the middle and at the end of a window."""
        places = self.places
        before, middle, end = (
            reals.after(place)[i] for place in (places.guards_before, places.guards_middle, places.guards)
        )
        return before, middle, end

    def _turns(
        self, reals: Reals, half: Real, i: Integer | int, side: Real, distances: tuple[Real, Real, Real]
    ) -> Boolean:
        """Whether the derivative of a guard differs too much from that at the end of the previous window.
        False where the previous one is NaN."""
        A, M, B = distances
        known = side * reals.after(self.places.guard_slopes)[i]
        now = fma(-1.5, A, fma(2.0, M, -0.5 * B))
        turn = abs(now - known * half)
        least = minimum(A, minimum(M, B))
        doubtful = 0.5 * turn > least
        return (least > 0.0) & doubtful

    def _note_slopes(self, r: Routine, reals: Reals, half: Real) -> None:
        """Store the derivative at the end of the parabola through the last three values of each guard."""
        for i in r.each(self.count):
            A, M, B = self._window(reals, i)
            rise = fma(1.5, B, fma(-2.0, M, 0.5 * A))
            reals.after(self.places.guard_slopes)[i] = rise / half

    def _take_signs(self, r: Routine, reals: Reals, only_fired: Boolean) -> None:
        """Store the signs of all guards, or of the fired ones only."""
        places = self.places
        values, signs, fired = (reals.after(place) for place in (places.guards, places.signs, places.fired))
        directions = r.reals("guard.directions", self.directions)
        for i in r.each(self.count):
            now, known, mark = sign(values[i]), signs[i], fired[i]
            has_fired, nonzero = mark != 0.0, now != 0.0
            side = select(nonzero, now, known)
            # A guard of one direction that is zero after its reset gets the sign opposite to the crossing. So
            # a ball that is placed on the floor with a downward speed bounces again.
            directed = directions[i] != 0.0
            back = select(directed & has_fired, -1.0 * mark, now)
            after = select(has_fired, select(nonzero, now, back), known)
            signs[i] = select(only_fired, after, side)

    def _begin_anew(self, r: Routine, reals: Reals) -> None:
        """Set the signs of silenced guards to those of their values, 0 included."""
        places = self.places
        values, signs, z = (reals.after(place) for place in (places.guards, places.signs, places.z))
        for guard, place in self._silenced(r):
            signs[guard] = select(z[place] == 0.0, signs[guard], sign(values[guard]))

    def _silenced(self, r: Routine) -> Iterator[tuple[Integer, Integer]]:
        """A loop of the routine over the silenced guards; yields each with the place of its momentary
        value."""
        if not self.silenced:
            return
        guards, places = zip(*self.silenced)
        of_guards, of_places = r.integers("silenced.guards", guards), r.integers("silenced.by", places)
        for i in r.each(len(self.silenced)):
            yield of_guards[i], of_places[i]

    def _note_events(self, r: Routine, t: Real, reals: Reals, counts: Integers, first: Boolean) -> Real:
        """Count the events at a time, and the consecutive close ones. Returns the maximum length of the next
        step, negative for endless events.

        ``first`` is false in further mode iterations at the same time. A guard is counted once at each time.

        Events are close if their distance is below ``CLOSE`` times the time. A series with shrinking
        distances, such as a bouncing ball, may end. It counts as endless only if the distances reach the
        rounding error of time, or after ``MOST_CROWDED`` consecutive events.
        """
        places = self.places
        bound = r.real(float("inf"))
        scale = maximum(t, 1e-6 * reals[Scalar.SPAN])
        shrunk = SHRUNK * scale
        since_last = t - reals[Scalar.LAST_EVENT]
        close, crowd = since_last <= CLOSE * scale, since_last <= CROWD * scale
        reals[Scalar.LAST_EVENT] = t
        fired_one, ending, endless = r.boolean(False), r.boolean(True), r.boolean(False)
        fired, repeats, last, gap, shrinking = (
            reals.after(place)
            for place in (places.fired, places.repeats, places.last, places.gap, places.shrinking)
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
                row = select(shorter, shrinking[i] + 1.0, 0.0)
                row = select(later, row, shrinking[i])
                shrinking[i] = row
                ends = shorter & (passed < shrunk) & (row >= float(SHRINKING))
                endless.value = endless.value | ends
                distance = select(later, passed, known)
                gap[i] = distance
                last[i] = t
                bound.value = minimum(SHORT * distance, bound.value)
        shrinks = fired_one.value & ending.value
        further = counts[Count.CLOSE] + (first & ~shrinks).count()
        in_a_row = select(close, further, 0)
        counts[Count.CLOSE] = in_a_row
        crowded = select(crowd, counts[Count.CROWDED] + first.count(), 0)
        counts[Count.CROWDED] = crowded
        without_end = endless.value | (in_a_row > MOST_AT_ONCE) | (crowded > MOST_CROWDED)
        return select(without_end, -1.0, bound.value)


def _same(one: Boolean, other: Boolean) -> Boolean:
    """Whether both are true or both are false."""
    return (one & other) | (~one & ~other)
