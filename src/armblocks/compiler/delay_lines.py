"""Small native functions that keep the past of delayed signals, and look it up.

The past is a table at the end of the array of doubles: a row is a time, whether the row stands in the middle
of a step, and the value and the exact slope of every signal that is delayed. Each step leaves two rows, its
middle and its end, so that between the ends of a step the quintic through three values and slopes (Hermite)
is as good as the step. A signal can bend more than the states do (a root, a fast sine, no state at all): a
step is then divided until the quintics meet the signal within the tolerances. Where a slope is not finite,
the parabola through the three values gives another. Where a signal jumps, or its slope does, two rows have
the same time: what was before and what is after. A line (one delayed scalar) looks no further than the next
such place until it has come to it: its value is then smooth, and the loop ends a step exactly there.
"""

from __future__ import annotations

import sys

from armblocks.compiler.integrator_workspace import Count, LoopSizes, Real, Workspace
from armblocks.compiler.ir_routine import Routine
from armblocks.compiler.ir_text import Module, number_text

SAME_ABOVE = 1.0 + 2.0**-50
MOST_PIECES = 256
"""Of one step: on both sides of a root's steepest point they shrink and grow by 48 powers of two."""
ROWS_OF_A_STEP = 2 * MOST_PIECES + 6
"""Rows that one step, the instant at its end and the row that a signal is compared in add at most."""
NO_SLOPE = sys.float_info.max
"""Stands in the table for a slope that is not finite."""


def emit_delay_lines(module: Module, workspace: Workspace, sizes: LoopSizes) -> None:
    """Add the functions.

    ``void look_back(ptr t, ptr x, ptr reals, ptr counts, ptr p)`` writes the delayed values at ``t`` into
    ``z``. ``void keep(ptr t, ptr x, ptr reals, ptr counts, ptr p, double middle)`` adds a row; ``void
    keep_change`` of the same arguments adds one only if it differs from the last. ``i1 strays(ptr t, ptr x,
    ptr reals, ptr counts, ptr p, double s, double factor)``, whether the quintic of the last three rows at
    ``s`` (-1 to 1) is further from a signal at ``t`` than ``factor`` times the tolerances. ``void
    arrive(double t, ptr reals, ptr counts)`` moves each line past the places that it has come to, and finds
    the next one. ``double next_arrival(ptr reals, ptr counts)`` is when a line comes to one. ``i1
    make_room(double t, ptr reals, ptr counts)`` forgets what no line can reach any more, and tells whether
    there is room for another step.
    """
    writer = _DelayLines(module, workspace, sizes)
    for name in ("look_back", "keep", "keep_change", "strays", "arrive", "next_arrival", "make_room"):
        module.define(name, getattr(writer, name))


class _DelayLines:
    def __init__(self, module: Module, workspace: Workspace, sizes: LoopSizes) -> None:
        self.module = module
        self.places = workspace
        self.lines = sizes.delays
        self.count = len(sizes.delays)
        self.first = int(Count.END) + len(sizes.clocks)

    # Places.

    def row(self, w: Routine, index: str, column: int | str = 0) -> str:
        """Address of an entry of the table."""
        start = w.word_op("mul", index, str(self.places.past_width))
        return w.at("%reals", w.word_op("add", w.word_op("add", start, str(self.places.past)), str(column)))

    def of_line(self, w: Routine, what: int, line: str) -> str:
        """Address of a line's first row (0) or last row (1) that it looks at."""
        return w.at("%counts", w.word_op("add", line, str(self.first + what * self.count)), "i64")

    def value(self, w: Routine, index: str, line: str) -> str:
        return w.get(self.row(w, index, w.word_op("add", line, "2")))

    def slope(self, w: Routine, index: str, line: str) -> str:
        return w.get(self.row(w, index, w.word_op("add", line, str(2 + self.count))))

    def rows(self, w: Routine) -> str:
        return w.at("%counts", Count.PAST, "i64")

    # Looking back.

    def look_back(self) -> str:
        w, places = Routine(self.module), self.places
        if not all(line.fixed for line in self.lines):
            z, unknowns, tau = (w.at("%reals", place) for place in (places.z, places.trial_w, places.taus))
            w.do(f"call void @delay_times(ptr %t, ptr %x, ptr {z}, ptr {unknowns}, ptr %p, ptr {tau})")
        t = w.get("%t")
        for k, line in enumerate(self.lines):
            instant = w.subtract(t, w.get(w.at("%reals", places.taus + k)))
            value, slope = self.at_instant(w, instant, str(k))
            w.put(value, w.at("%reals", places.z + line.value))
            w.put(slope, w.at("%reals", places.z + line.slope))
        w.do("ret void")
        return w.text("define internal void @look_back(ptr %t, ptr %x, ptr %reals, ptr %counts, ptr %p)")

    def at_instant(self, w: Routine, instant: str, line: str) -> tuple[str, str]:
        """Value and slope of a line's signal at an instant of the past."""
        first = w.get(self.of_line(w, 0, line), "i64")
        last = w.get(self.of_line(w, 1, line), "i64")
        newest = w.word_op("sub", w.get(self.rows(w), "i64"), "1")
        # A middle whose end is still to come is no place to look from.
        loose = w.let(f"fptosi double {w.get(self.row(w, newest, 1))} to i64")
        newest = w.word_op("sub", newest, loose)
        last = w.let(f"select i1 {w.word_test('slt', last, '0')}, i64 {newest}, i64 {last}")
        low, high = w.variable("i64", "0"), w.variable("i64", "0")
        w.put(first, low, "i64")
        w.put(last, high, "i64")
        turn, half, later, sooner, found = (
            w.fresh(stem) for stem in ("turn", "half", "later", "sooner", "found")
        )
        # The last row not after the instant, by bisection; the first one if there is none.
        w.place(turn)
        a, b = w.get(low, "i64"), w.get(high, "i64")
        w.branch(w.word_test("slt", a, b), half, found)
        w.place(half)
        middle = w.word_op("sub", b, w.word_op("sdiv", w.word_op("sub", b, a), "2"))
        w.branch(w.compare("ole", w.get(self.row(w, middle)), instant), later, sooner)
        w.place(later)
        w.put(middle, low, "i64")
        w.jump(turn)
        w.place(sooner)
        w.put(w.word_op("sub", middle, "1"), high, "i64")
        w.jump(turn)
        w.place(found)
        value, slope = w.variable("double", number_text(0.0)), w.variable("double", number_text(0.0))
        i = w.get(low, "i64")
        beyond, between, done = w.fresh("beyond"), w.fresh("between"), w.fresh("done")
        before = w.compare("olt", instant, w.get(self.row(w, i)))
        w.branch(w.either(before, w.word_test("sge", i, last)), beyond, between)
        w.place(beyond)
        # A rounding error past the last row, or before anything was: straight on.
        past = w.subtract(instant, w.get(self.row(w, i)))
        known = self.slope(w, i, line)
        known = w.select(self.is_slope(w, known), known, number_text(0.0))
        w.put(w.fma(known, past, self.value(w, i, line)), value)
        w.put(self.slope(w, i, line), slope)
        w.jump(done)
        w.place(between)
        in_middle = w.let(f"fptosi double {w.get(self.row(w, i, 1))} to i64")
        centre = w.word_op("sub", w.word_op("add", i, "1"), in_middle)
        ends = w.word_op("sub", centre, "1"), w.word_op("add", centre, "1")
        H = w.multiply(number_text(0.5), w.subtract(w.get(self.row(w, ends[1])), w.get(self.row(w, ends[0]))))
        theta = w.divide(w.subtract(instant, w.get(self.row(w, centre))), H)
        self.quintic(w, theta, H, line, (ends[0], centre, ends[1]), value, slope)
        w.place(done)
        return w.get(value), w.get(slope)

    def quintic(
        self, w: Routine, s: str, H: str, line: str, rows: tuple[str, str, str], value: str, slope: str
    ) -> None:
        """Hermite's quintic through values and slopes at -1, 0 and 1, at ``s``; its own slope too."""
        minus = w.multiply(number_text(-1.0), s)
        square = w.multiply(s, s)
        rest = w.subtract(number_text(1.0), square)
        # Over the differences from the middle: a constant is then itself, to the bit.
        centre = self.value(w, rows[1], line)
        values = [w.subtract(self.value(w, row, line), centre) for row in rows]
        bases = (
            self.end_basis(w, minus, -1.0),
            self.middle_basis(w, s, square, rest),
            self.end_basis(w, s, 1.0),
        )
        total, rate = number_text(0.0), number_text(0.0)
        for place, (row, u, parts) in enumerate(zip(rows, values, bases)):
            of_value, of_slope, rate_of_value, rate_of_slope = parts
            known = self.slope(w, row, line)
            of_parabola = self.parabola_slope(w, values[0], values[2], place)
            du = w.select(self.is_slope(w, known), w.multiply(H, known), of_parabola)
            total = w.fma(of_value, u, w.fma(of_slope, du, total))
            rate = w.fma(rate_of_value, u, w.fma(rate_of_slope, du, rate))
        w.put(w.add(centre, total), value)
        w.put(w.divide(rate, H), slope)

    @staticmethod
    def is_slope(w: Routine, slope: str) -> str:
        """Whether an entry of the table is a slope, and not ``NO_SLOPE``."""
        return w.compare("olt", w.absolute(slope), number_text(NO_SLOPE))

    @staticmethod
    def parabola_slope(w: Routine, before: str, after: str, place: int) -> str:
        """Slope at -1, 0 or 1 (``place`` 0, 1, 2) of the parabola with values at -1 and 1, and 0 at 0."""
        of_before, of_after = ((-1.5, -0.5), (-0.5, 0.5), (0.5, 1.5))[place]
        return w.fma(number_text(of_before), before, w.multiply(number_text(of_after), after))

    @staticmethod
    def middle_basis(w: Routine, s: str, square: str, rest: str) -> tuple[str, str, str, str]:
        """(1 - s^2)^2, s (1 - s^2)^2 and their derivatives."""
        of_value = w.multiply(rest, rest)
        rate_of_value = w.multiply(w.multiply(number_text(-4.0), s), rest)
        five = w.fma(number_text(-5.0), square, number_text(1.0))
        return of_value, w.multiply(s, of_value), rate_of_value, w.multiply(rest, five)

    @staticmethod
    def end_basis(w: Routine, s: str, side: float) -> tuple[str, str, str, str]:
        """s^2 (1 + s)^2 (4 - 3 s) / 4, s^2 (1 + s)^2 (s - 1) / 4 and their derivatives; or mirrored."""
        up = w.add(number_text(1.0), s)
        common = w.multiply(w.multiply(number_text(0.25), s), up)
        outer = w.multiply(common, w.multiply(s, up))
        of_value = w.multiply(outer, w.fma(number_text(-3.0), s, number_text(4.0)))
        of_slope = w.multiply(outer, w.subtract(s, number_text(1.0)))
        down = w.subtract(number_text(1.0), s)
        rate_of_value = w.multiply(common, w.multiply(down, w.fma(number_text(15.0), s, number_text(8.0))))
        inner = w.fma(w.fma(number_text(5.0), s, number_text(-1.0)), s, number_text(-2.0))
        rate_of_slope = w.multiply(common, inner)
        sign = number_text(side)
        return of_value, w.multiply(sign, of_slope), w.multiply(sign, rate_of_value), rate_of_slope

    # Keeping.

    def fill(self, w: Routine, middle: str) -> str:
        """Write the row after the last one, without counting it; its number."""
        places = self.places
        rows = w.get(self.rows(w), "i64")
        z, unknowns = (w.at("%reals", place) for place in (places.z, places.trial_w))
        w.put(w.get("%t"), self.row(w, rows))
        w.put(middle, self.row(w, rows, 1))
        target = self.row(w, rows, 2)
        w.do(f"call void @delay_inputs(ptr %t, ptr %x, ptr {z}, ptr {unknowns}, ptr %p, ptr {target})")

        def hold(line: str) -> None:
            place = self.row(w, rows, w.word_op("add", line, str(2 + self.count)))
            slope = w.get(place)
            w.put(w.select(self.is_slope(w, slope), slope, number_text(NO_SLOPE)), place)

        w.for_each(self.count, hold)
        return rows

    def keep(self) -> str:
        w = Routine(self.module)
        self.fill(w, "%middle")
        w.increase(self.rows(w))
        w.do("ret void")
        return w.text(
            "define internal void @keep(ptr %t, ptr %x, ptr %reals, ptr %counts, ptr %p, double %middle)"
        )

    def keep_change(self) -> str:
        w = Routine(self.module)
        rows = self.fill(w, "%middle")
        before = w.word_op("sub", rows, "1")
        same = w.variable("double", number_text(1.0))
        w.put(number_text(1.0), same)

        def compare(column: str) -> None:
            place = w.word_op("add", column, "2")
            old, new = (w.get(self.row(w, row, place)) for row in (before, rows))
            w.put(w.select(w.compare("oeq", old, new), w.get(same), number_text(0.0)), same)

        w.for_each(2 * self.count, compare)
        change, on = w.fresh("change"), w.fresh("on")
        w.branch(w.compare("oeq", w.get(same), number_text(0.0)), change, on)
        w.place(change)
        # What comes after stands at the very time of what was before.
        w.put(w.get(self.row(w, before)), self.row(w, rows))
        w.increase(self.rows(w))
        w.place(on)
        w.do("ret void")
        pointers = "ptr %t, ptr %x, ptr %reals, ptr %counts, ptr %p"
        return w.text(f"define internal void @keep_change({pointers}, double %middle)")

    def strays(self) -> str:
        w = Routine(self.module)
        rows = self.fill(w, number_text(0.0))
        start, centre, end = (w.word_op("sub", rows, str(back)) for back in (3, 2, 1))
        H = w.multiply(number_text(0.5), w.subtract(w.get(self.row(w, end)), w.get(self.row(w, start))))
        rtol, atol = (w.get(w.at("%reals", place)) for place in (Real.RTOL, Real.ATOL))
        value, slope = w.variable("double", number_text(0.0)), w.variable("double", number_text(0.0))
        found = w.variable("i1", "false")

        def compare(line: str) -> None:
            self.quintic(w, "%s", H, line, (start, centre, end), value, slope)
            exact = self.value(w, rows, line)
            off = w.absolute(w.subtract(w.get(value), exact))
            tolerance = w.multiply("%factor", w.fma(w.absolute(exact), rtol, atol))
            beyond = w.compare("ogt", off, tolerance)
            w.put(w.either(w.get(found, "i1"), beyond), found, "i1")

        w.for_each(self.count, compare)
        w.do(f"ret i1 {w.get(found, 'i1')}")
        arguments = "ptr %t, ptr %x, ptr %reals, ptr %counts, ptr %p, double %s, double %factor"
        return w.text(f"define internal i1 @strays({arguments})")

    # Places where a signal jumps.

    def arrive(self) -> str:
        w, places = Routine(self.module), self.places
        until = w.multiply("%now", number_text(SAME_ABOVE))
        for k, line in enumerate(self.lines):
            if not line.fixed:
                continue
            first, last = self.of_line(w, 0, str(k)), self.of_line(w, 1, str(k))
            turn, known, passed, seek, look, next_row, mark, done = (
                w.fresh(stem) for stem in ("turn", "known", "passed", "seek", "look", "next", "mark", "done")
            )
            i = w.variable("i64", "0")
            w.place(turn)
            w.branch(w.word_test("sge", w.get(last, "i64"), "0"), known, seek)
            w.place(known)
            tau = w.get(w.at("%reals", places.taus + k))
            arrival = w.add(w.get(self.row(w, w.get(last, "i64"))), tau)
            w.branch(w.compare("ole", arrival, until), passed, done)
            w.place(passed)
            w.put(w.word_op("add", w.get(last, "i64"), "1"), first, "i64")
            w.place(seek)
            w.put("-1", last, "i64")
            w.put(w.get(first, "i64"), i, "i64")
            w.place(look)
            here = w.get(i, "i64")
            after = w.word_op("add", here, "1")
            w.branch(w.word_test("slt", after, w.get(self.rows(w), "i64")), next_row, done)
            w.place(next_row)
            w.put(after, i, "i64")
            together = w.compare("oeq", w.get(self.row(w, here)), w.get(self.row(w, after)))
            jumps = w.compare("une", self.value(w, here, str(k)), self.value(w, after, str(k)))
            bends = w.compare("une", self.slope(w, here, str(k)), self.slope(w, after, str(k)))
            w.branch(w.both(together, w.either(jumps, bends)), mark, look)
            w.place(mark)
            w.put(here, last, "i64")
            w.jump(turn)
            w.place(done)
        w.do("ret void")
        return w.text("define internal void @arrive(double %now, ptr %reals, ptr %counts)")

    def next_arrival(self) -> str:
        w, places = Routine(self.module), self.places
        soonest = number_text(float("inf"))
        for k, line in enumerate(self.lines):
            if not line.fixed:
                continue
            last = w.get(self.of_line(w, 1, str(k)), "i64")
            known = w.word_test("sge", last, "0")
            row = w.let(f"select i1 {known}, i64 {last}, i64 0")
            arrival = w.add(w.get(self.row(w, row)), w.get(w.at("%reals", places.taus + k)))
            soonest = w.select(w.both(known, w.compare("olt", arrival, soonest)), arrival, soonest)
        w.do(f"ret double {soonest}")
        return w.text("define internal double @next_arrival(ptr %reals, ptr %counts)")

    # Room.

    def make_room(self) -> str:
        w, places = Routine(self.module), self.places
        capacity = w.get(w.at("%counts", Count.PAST_ROOM, "i64"), "i64")
        crowded, roomy, look, older, forget, move, moved = (
            w.fresh(stem) for stem in ("crowded", "roomy", "look", "older", "forget", "move", "moved")
        )
        needed = w.word_op("add", w.get(self.rows(w), "i64"), str(ROWS_OF_A_STEP))
        w.branch(w.word_test("sle", needed, capacity), roomy, crowded)
        w.place(crowded)
        oldest = w.subtract("%now", w.get(w.at("%reals", places.longest)))
        # The first row that must stay: an end of a step, the last one before all that can be looked at.
        keep, i = w.variable("i64", "0"), w.variable("i64", "0")
        w.put("0", keep, "i64")
        w.put("0", i, "i64")
        w.place(look)
        here = w.get(i, "i64")
        inside = w.word_test("slt", here, w.get(self.rows(w), "i64"))
        safe = w.let(f"select i1 {inside}, i64 {here}, i64 0")
        old = w.compare("olt", w.get(self.row(w, safe)), oldest)
        w.branch(w.both(inside, old), older, forget)
        w.place(older)
        at_end = w.compare("oeq", w.get(self.row(w, safe, 1)), number_text(0.0))
        w.put(w.let(f"select i1 {at_end}, i64 {here}, i64 {w.get(keep, 'i64')}"), keep, "i64")
        w.increase(i)
        w.jump(look)
        w.place(forget)
        gone = w.get(keep, "i64")
        left = w.word_op("sub", w.get(self.rows(w), "i64"), gone)
        w.put(left, self.rows(w), "i64")
        total = w.word_op("mul", left, str(places.past_width))
        shift = w.word_op("mul", gone, str(places.past_width))
        n = w.variable("i64", "0")
        w.put("0", n, "i64")
        w.place(move)
        at = w.get(n, "i64")
        step = w.fresh("shift")
        w.branch(w.word_test("slt", at, total), step, moved)
        w.place(step)
        target = w.word_op("add", at, str(places.past))
        w.put(w.get(w.at("%reals", w.word_op("add", target, shift))), w.at("%reals", target))
        w.increase(n)
        w.jump(move)
        w.place(moved)
        for k in range(self.count):
            for what in (0, 1):
                place = self.of_line(w, what, str(k))
                number = w.get(place, "i64")
                shifted = w.word_op("sub", number, gone)
                # The first row may be forgotten; where no last one is known, the number is -1.
                least, kept = ("0", "0") if what == 0 else ("0", number)
                known = w.word_test("sge", shifted, least)
                w.put(w.let(f"select i1 {known}, i64 {shifted}, i64 {kept}"), place, "i64")
        # Twice the room where half of it is not free: else it would soon be full again.
        enough = w.word_test("sle", w.word_op("mul", left, "2"), capacity)
        fits = w.word_test("sle", w.word_op("add", left, str(ROWS_OF_A_STEP)), capacity)
        w.do(f"ret i1 {w.both(enough, fits)}")
        w.place(roomy)
        w.do("ret i1 true")
        return w.text("define internal i1 @make_room(double %now, ptr %reals, ptr %counts)")
