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
"""Events that may follow one another as good as at one instant."""
CLOSE = 1e-12
"""Events nearer than this, beside the time, are as good as at one instant."""
SHRINKING, SHRUNK = 10, 1e-9
"""So many events of a guard in a row, each sooner than the one before, down to this distance beside the
time, are taken for the first of infinitely many."""
SHORT = 0.01
"""The first step after an event, beside the time since the guard's event before it."""


def emit_functions(module: Module, workspace: Workspace, sizes: LoopSizes) -> None:
    """Add those functions that the system needs.

    ``i64 watch(ptr t, ptr x, ptr reals, ptr p)`` evaluates the guards with ``trial_w`` and marks in ``fired``
    which ones fire and whether upwards; it gives their count. ``void take_signs(ptr reals, i1 only_fired)``
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
        writer = _GuardFunctions(module, workspace, sizes.directions)
        module.define("watch", writer.watch)
        module.define("take_signs", writer.take_signs)
        module.define("note_events", writer.note_events)
        module.define("dips", writer.dips)
        module.define("note_slopes", writer.note_slopes)


class _GuardFunctions:
    def __init__(self, module: Module, workspace: Workspace, directions: tuple[int, ...]) -> None:
        self.module = module
        self.places = workspace
        self.count = len(directions)
        numbers = ", ".join(f"double {number_text(float(direction))}" for direction in directions)
        module.add(
            "guard.directions",
            f"@guard.directions = internal constant [{self.count} x double] [{numbers}]",
        )

    def element(self, w: Routine, place: int, index: str) -> str:
        return w.at("%reals", w.word_op("add", index, str(place)))

    def sign(self, w: Routine, value: str) -> str:
        """-1, 0 or 1; 0 for NaN."""
        below = w.select(w.compare("olt", value, number_text(0.0)), number_text(-1.0), number_text(0.0))
        return w.select(w.compare("ogt", value, number_text(0.0)), number_text(1.0), below)

    def watch(self) -> str:
        w, places = Routine(self.module), self.places
        z, unknowns, g = (w.at("%reals", place) for place in (places.z, places.trial_w, places.guards))
        w.do(f"call void @guards(ptr %t, ptr %x, ptr {z}, ptr {unknowns}, ptr %p, ptr {g})")
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
        w.do(f"ret i64 {w.get(total, 'i64')}")
        return w.text("define internal i64 @watch(ptr %t, ptr %x, ptr %reals, ptr %p)")

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
            fired = w.compare("une", w.get(self.element(w, places.fired, i)), number_text(0.0))
            side = w.select(w.compare("une", now, number_text(0.0)), now, known)
            after = w.select(fired, now, known)
            w.put(w.select("%only_fired", after, side), self.element(w, places.signs, i))

        w.for_each(self.count, take)
        w.do("ret void")
        return w.text("define internal void @take_signs(ptr %reals, i1 %only_fired)")

    def note_events(self) -> str:
        w, places = Routine(self.module), self.places
        bound = w.variable("double", number_text(float("inf")))
        span = w.multiply(number_text(1e-6), w.get(w.at("%reals", Real.SPAN)))
        scale = w.maximum("%t", span)
        close_by = w.multiply(number_text(CLOSE), scale)
        close_place = w.at("%counts", Count.CLOSE, "i64")
        latest = w.at("%reals", Real.LAST_EVENT)
        close = w.compare("ole", w.subtract("%t", w.get(latest)), close_by)
        w.put("%t", latest)
        in_a_row = w.let(f"select i1 {close}, i64 {w.word_op('add', w.get(close_place, 'i64'), '1')}, i64 0")
        w.put(in_a_row, close_place, "i64")
        endless = w.variable("i1", w.word_test("sgt", in_a_row, str(MOST_AT_ONCE)))

        def note(i: str) -> None:
            fired, on = w.fresh("fired"), w.fresh("on")
            mark = w.get(self.element(w, places.fired, i))
            w.branch(w.compare("une", mark, number_text(0.0)), fired, on)
            w.place(fired)
            w.put(w.word_op("add", i, "1"), w.at("%counts", Count.GUARD, "i64"), "i64")
            w.increase(w.at("%counts", Count.EVENTS, "i64"))
            last, gap, row = (
                self.element(w, place, i) for place in (places.last, places.gap, places.shrinking)
            )
            passed, known = w.subtract("%t", w.get(last)), w.get(gap)
            later = w.compare("ogt", passed, number_text(0.0))
            shorter = w.both(later, w.compare("olt", passed, known))
            count = w.add(w.get(row), number_text(1.0))
            kept = w.select(later, number_text(0.0), w.get(row))
            count = w.select(shorter, count, kept)
            w.put(count, row)
            small = w.compare("olt", passed, w.multiply(number_text(SHRUNK), scale))
            ends = w.both(small, w.compare("oge", count, number_text(float(SHRINKING))))
            w.put(w.either(w.get(endless, "i1"), w.both(later, ends)), endless, "i1")
            distance = w.select(later, passed, known)
            w.put(distance, gap)
            w.put("%t", last)
            w.put(w.minimum(w.multiply(number_text(SHORT), distance), w.get(bound)), bound)
            w.place(on)

        w.for_each(self.count, note)
        result = w.select(w.get(endless, "i1"), number_text(-1.0), w.get(bound))
        w.do(f"ret double {result}")
        return w.text("define internal double @note_events(double %t, ptr %reals, ptr %counts)")
