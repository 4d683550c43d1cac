"""Small native functions of the hybrid loop: which guards fire, their signs, and whether events ever end."""

from __future__ import annotations

from armblocks.compiler.delay_lines import DelayLines
from armblocks.compiler.implicit_equations import define_solve
from armblocks.compiler.integrator_workspace import Count, LoopSizes, Real, Workspace
from armblocks.compiler.ir_routine import Routine
from armblocks.compiler.ir_text import Module, number_text
from armblocks.compiler.program_text import add_program
from armblocks.routines.routine import Program

MOST_AT_ONCE = 1000
"""Events that may follow one another closely, at distances that do not shrink."""
CLOSE = 1e-12
"""Events nearer than this, beside the time, follow one another closely."""
SHRINKING, SHRUNK = 10, 2.0**-46
"""So many events of a guard in a row, each sooner than the one before, down to this distance beside the
time, some 100 units in its last place, are taken for the first of infinitely many."""
SHORT = 0.01
"""The first step after an event, beside the time since the guard's event before it."""


def emit_functions(module: Module, workspace: Workspace, sizes: LoopSizes) -> None:
    """Add those functions that the system needs.

    ``i64 watch(ptr t, ptr x, ptr reals, ptr p)`` evaluates the guards with ``trial_w`` and marks in ``fired``
    which ones fire and whether upwards; it gives their count and that of the modes that contradict their
    conditions. ``i1 any_fired(ptr reals)`` tells whether a guard is marked, and ``void hold_modes(ptr reals,
    i1 only_first)`` restricts what a reset without events does to modes to those (or the first of those) that
    contradict their conditions. ``void take_signs(ptr reals, i1 only_fired)``
    notes the sides on which guards are. ``double note_events(double t, ptr reals, ptr counts)`` counts those
    that fired and gives a bound for the next step, negative where there are too many events. ``i64 dips(ptr
    reals, double half)`` counts the guards that may have been at zero between their three last values, which
    are ``half`` apart, and ``note_slopes`` keeps how fast they change at the last of them.
    """
    if sizes.algebraic:
        program = Program()
        define_solve(program, workspace, sizes.algebraic)
        add_program(module, program)
    if sizes.delays:
        program = Program()
        DelayLines(program, workspace, sizes)
        add_program(module, program)
    if sizes.directions:
        writer = _GuardFunctions(module, workspace, sizes)
        module.define("watch", writer.watch)
        module.define("take_signs", writer.take_signs)
        module.define("note_events", writer.note_events)
        module.define("dips", writer.dips)
        module.define("note_slopes", writer.note_slopes)
        if sizes.modes:
            module.define("any_fired", writer.any_fired)
            module.define("hold_modes", writer.hold_modes)


def call_guards(w: Routine, places: Workspace, modes: int, t: str, x: str) -> None:
    """Evaluate the guards and the contradictions of modes at a point whose unknowns are solved."""
    z, unknowns, g = (w.at("%reals", place) for place in (places.z, places.trial_w, places.guards))
    further = f", ptr {w.at('%reals', places.contradictions)}" if modes else ""
    w.do(f"call void @guards(ptr {t}, ptr {x}, ptr {z}, ptr {unknowns}, ptr %p, ptr {g}{further})")


class _GuardFunctions:
    def __init__(self, module: Module, workspace: Workspace, sizes: LoopSizes) -> None:
        directions = sizes.directions
        self.module = module
        self.places = workspace
        self.count = len(directions)
        self.modes = len(sizes.modes)
        numbers = ", ".join(f"double {number_text(float(direction))}" for direction in directions)
        module.add(
            "guard.directions",
            f"@guard.directions = internal constant [{self.count} x double] [{numbers}]",
        )
        if sizes.modes:
            places = ", ".join(f"i64 {place}" for place in sizes.modes)
            module.add("mode.places", f"@mode.places = internal constant [{self.modes} x i64] [{places}]")

    def element(self, w: Routine, place: int, index: str) -> str:
        return w.at("%reals", w.word_op("add", index, str(place)))

    def sign(self, w: Routine, value: str) -> str:
        """-1, 0 or 1; 0 for NaN."""
        below = w.select(w.compare("olt", value, number_text(0.0)), number_text(-1.0), number_text(0.0))
        return w.select(w.compare("ogt", value, number_text(0.0)), number_text(1.0), below)

    def watch(self) -> str:
        w, places = Routine(self.module), self.places
        call_guards(w, places, self.modes, "%t", "%x")
        total = w.variable("i64", "0")

        def look(i: str) -> None:
            now = self.sign(w, w.get(self.element(w, places.guards, i)))
            known = w.get(self.element(w, places.signs, i))
            wanted = w.get(w.at("@guard.directions", i))
            crossed = w.both(
                w.compare("olt", w.multiply(now, known), number_text(0.0)),
                w.compare("oge", w.multiply(now, wanted), number_text(0.0)),
            )
            w.put(w.select(crossed, now, number_text(0.0)), self.element(w, places.fired, i))
            w.put(w.word_op("add", w.get(total, "i64"), w.let(f"zext i1 {crossed} to i64")), total, "i64")

        w.for_each(self.count, look)

        def contradicts(i: str) -> None:
            found = w.compare("une", w.get(self.element(w, places.contradictions, i)), number_text(0.0))
            w.put(w.word_op("add", w.get(total, "i64"), w.let(f"zext i1 {found} to i64")), total, "i64")

        w.for_each(self.modes, contradicts)
        w.do(f"ret i64 {w.get(total, 'i64')}")
        return w.text("define internal i64 @watch(ptr %t, ptr %x, ptr %reals, ptr %p)")

    def any_fired(self) -> str:
        w = Routine(self.module)
        found = w.variable("i1", "false")

        def look(i: str) -> None:
            mark = w.get(self.element(w, self.places.fired, i))
            fired = w.compare("une", mark, number_text(0.0))
            w.put(w.either(w.get(found, "i1"), fired), found, "i1")

        w.for_each(self.count, look)
        w.do(f"ret i1 {w.get(found, 'i1')}")
        return w.text("define internal i1 @any_fired(ptr %reals)")

    def hold_modes(self) -> str:
        """Modes that do not contradict their conditions keep their values; of the others, all or the first
        take those of the reset."""
        w, places = Routine(self.module), self.places
        held = w.variable("i1", "false")

        def hold(i: str) -> None:
            place = w.get(w.at("@mode.places", i, "i64"), "i64")
            contradicts = w.compare("une", w.get(self.element(w, places.contradictions, i)), number_text(0.0))
            kept = w.get(held, "i1")
            before, after = self.element(w, places.z, place), self.element(w, places.new_z, place)
            free = w.both(contradicts, w.let(f"xor i1 {kept}, true"))
            w.put(w.select(free, w.get(after), w.get(before)), after)
            w.put(w.either(kept, w.both(contradicts, "%only_first")), held, "i1")

        w.for_each(self.modes, hold)
        w.do("ret void")
        return w.text("define internal void @hold_modes(ptr %reals, i1 %only_first)")

    def dips(self) -> str:
        """Where a guard may have gone to zero and come back between three values of one sign.

        With A, M, B the values at the beginning, in the middle and at the end, as distances from zero, the
        parabola through them is M + (B - A) s / 2 + C s^2 / 2, C = A - 2 M + B, for s from -1 to 1. It is
        doubtful where its extremum lies between them, near zero; and where it begins at another slope than
        that at which the stretch before this one ended: a cubic that turns such a difference D, times half
        the stretch, is D / 5 away from the parabola, so half of D has to be less than the distances.
        """
        w, places = Routine(self.module), self.places
        total = w.variable("i64", "0")

        def look(i: str) -> None:
            side = w.get(self.element(w, places.signs, i))
            A, M, B = (
                w.multiply(side, w.get(self.element(w, place, i)))
                for place in (places.guards_before, places.guards_middle, places.guards)
            )
            rise = w.subtract(B, A)
            bend = w.add(w.subtract(A, M), w.subtract(B, M))
            inside = w.compare("olt", w.absolute(rise), w.multiply(number_text(1.98), bend))
            # least = M - rise^2 / (8 bend), doubtful by a quarter of the bend
            eight = w.multiply(number_text(8.0), bend)
            least = w.fma(eight, M, w.multiply(number_text(-1.0), w.multiply(rise, rise)))
            near = w.compare("olt", least, w.multiply(w.multiply(number_text(0.25), bend), eight))
            dips = w.either(w.both(inside, near), self.turns(w, i, side, (A, M, B)))
            w.put(w.word_op("add", w.get(total, "i64"), w.let(f"zext i1 {dips} to i64")), total, "i64")

        w.for_each(self.count, look)
        w.do(f"ret i64 {w.get(total, 'i64')}")
        return w.text("define internal i64 @dips(ptr %reals, double %half)")

    def turns(self, w: Routine, i: str, side: str, distances: tuple[str, str, str]) -> str:
        """Whether a guard does not go on as the stretch before this one ended; false where that is NaN."""
        A, M, B = distances
        known = w.multiply(side, w.get(self.element(w, self.places.guard_slopes, i)))
        now = w.fma(number_text(-1.5), A, w.fma(number_text(2.0), M, w.multiply(number_text(-0.5), B)))
        turn = w.absolute(w.subtract(now, w.multiply(known, "%half")))
        least = w.minimum(A, w.minimum(M, B))
        doubtful = w.compare("ogt", w.multiply(number_text(0.5), turn), least)
        return w.both(w.compare("ogt", least, number_text(0.0)), doubtful)

    def note_slopes(self) -> str:
        """The slope at the end of the parabola through the last three values."""
        w, places = Routine(self.module), self.places

        def note(i: str) -> None:
            A, M, B = (
                w.get(self.element(w, place, i))
                for place in (places.guards_before, places.guards_middle, places.guards)
            )
            rise = w.fma(number_text(1.5), B, w.fma(number_text(-2.0), M, w.multiply(number_text(0.5), A)))
            w.put(w.divide(rise, "%half"), self.element(w, places.guard_slopes, i))

        w.for_each(self.count, note)
        w.do("ret void")
        return w.text("define internal void @note_slopes(ptr %reals, double %half)")

    def take_signs(self) -> str:
        w, places = Routine(self.module), self.places

        def take(i: str) -> None:
            now = self.sign(w, w.get(self.element(w, places.guards, i)))
            known = w.get(self.element(w, places.signs, i))
            mark = w.get(self.element(w, places.fired, i))
            fired = w.compare("une", mark, number_text(0.0))
            nonzero = w.compare("une", now, number_text(0.0))
            side = w.select(nonzero, now, known)
            # A guard of one direction that is put onto its zero comes from the other side: a ball on the
            # floor that falls on bounces again.
            directed = w.compare("une", w.get(w.at("@guard.directions", i)), number_text(0.0))
            back = w.select(w.both(directed, fired), w.multiply(number_text(-1.0), mark), now)
            after = w.select(fired, w.select(nonzero, now, back), known)
            w.put(w.select("%only_fired", after, side), self.element(w, places.signs, i))

        w.for_each(self.count, take)
        w.do("ret void")
        return w.text("define internal void @take_signs(ptr %reals, i1 %only_fired)")

    def note_events(self) -> str:
        """Count the events of an instant, and the ones in a row that follow one another without an end.

        Events follow closely where less than ``CLOSE`` of the time lies between them. A series whose
        distances shrink, as those of a bouncing ball, may come to an end by itself: it has none only where
        the distances become as short as the rounding of the time.
        """
        w, places = Routine(self.module), self.places
        bound = w.variable("double", number_text(float("inf")))
        span = w.multiply(number_text(1e-6), w.get(w.at("%reals", Real.SPAN)))
        scale = w.maximum("%t", span)
        close_by, shrunk = (w.multiply(number_text(part), scale) for part in (CLOSE, SHRUNK))
        close_place = w.at("%counts", Count.CLOSE, "i64")
        latest = w.at("%reals", Real.LAST_EVENT)
        close = w.compare("ole", w.subtract("%t", w.get(latest)), close_by)
        w.put("%t", latest)
        fired_one = w.variable("i1", "false")
        ending = w.variable("i1", "true")
        endless = w.variable("i1", "false")

        def note(i: str) -> None:
            fired, on = w.fresh("fired"), w.fresh("on")
            mark = w.get(self.element(w, places.fired, i))
            repeats = self.element(w, places.repeats, i)
            w.put(w.select(close, w.get(repeats), number_text(0.0)), repeats)
            w.branch(w.compare("une", mark, number_text(0.0)), fired, on)
            w.place(fired)
            w.put("true", fired_one, "i1")
            w.put(w.word_op("add", i, "1"), w.at("%counts", Count.GUARD, "i64"), "i64")
            w.increase(w.at("%counts", Count.EVENTS, "i64"))
            w.put(w.add(w.get(repeats), number_text(1.0)), repeats)
            last, gap = (self.element(w, place, i) for place in (places.last, places.gap))
            passed, known = w.subtract("%t", w.get(last)), w.get(gap)
            later = w.compare("ogt", passed, number_text(0.0))
            shorter = w.both(later, w.compare("olt", passed, known))
            w.put(w.both(w.get(ending, "i1"), shorter), ending, "i1")
            row = self.element(w, places.shrinking, i)
            in_a_row = w.select(shorter, w.add(w.get(row), number_text(1.0)), number_text(0.0))
            in_a_row = w.select(later, in_a_row, w.get(row))
            w.put(in_a_row, row)
            ends = w.both(shorter, w.compare("olt", passed, shrunk))
            ends = w.both(ends, w.compare("oge", in_a_row, number_text(float(SHRINKING))))
            w.put(w.either(w.get(endless, "i1"), ends), endless, "i1")
            distance = w.select(later, passed, known)
            w.put(distance, gap)
            w.put("%t", last)
            w.put(w.minimum(w.multiply(number_text(SHORT), distance), w.get(bound)), bound)
            w.place(on)

        w.for_each(self.count, note)
        shrinks = w.both(w.get(fired_one, "i1"), w.get(ending, "i1"))
        counted = w.let(f"select i1 {shrinks}, i64 0, i64 1")
        further = w.word_op("add", w.get(close_place, "i64"), counted)
        in_a_row = w.let(f"select i1 {close}, i64 {further}, i64 0")
        w.put(in_a_row, close_place, "i64")
        many = w.word_test("sgt", in_a_row, str(MOST_AT_ONCE))
        without_end = w.either(w.get(endless, "i1"), many)
        w.do(f"ret double {w.select(without_end, number_text(-1.0), w.get(bound))}")
        return w.text("define internal double @note_events(double %t, ptr %reals, ptr %counts)")
