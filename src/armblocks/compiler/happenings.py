"""What happens at an instant of a hybrid run, as LLVM IR: ticks, events, the end.

The order of these is that of :mod:`armblocks.compiler.hybrid_loop`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from armblocks.compiler.hybrid_functions import call_guards
from armblocks.compiler.integrator_workspace import Count, Real, Status
from armblocks.compiler.ir_text import number_text

if TYPE_CHECKING:
    from armblocks.compiler.hybrid_loop import HybridLoop

SAME_ABOVE, SAME_BELOW = 1.0 + 2.0**-50, 1.0 - 2.0**-50
"""Two times within these factors of one another are the same instant."""

TURNS_TOGETHER, MOST_TURNS = 8, 32
"""Modes are changed together in so many turns, and one for each mode; in all, so many turns for each mode."""


class Happenings:
    """Writes them into a loop, at the place where its routine stands."""

    def __init__(self, loop: HybridLoop) -> None:
        self.loop = loop

    def ticks(self, time: str, until: str) -> None:
        """Mark the clocks that tick and update ``z``."""
        loop, w, places = self.loop, self.loop.w, self.loop.places
        if not loop.sizes.clocks:
            return
        any_ticks: str | None = None
        for clock in range(len(loop.sizes.clocks)):
            ticks = w.compare("ole", loop.tick_time(clock), until)
            place = w.at("%counts", Count.END + clock, "i64")
            w.put(w.word_op("add", w.get(place, "i64"), w.let(f"zext i1 {ticks} to i64")), place, "i64")
            marked = w.select(ticks, number_text(1.0), number_text(0.0))
            w.put(marked, loop.at(places.ticking + clock))
            any_ticks = ticks if any_ticks is None else w.either(any_ticks, ticks)
        assert any_ticks is not None
        tick, on = w.fresh("tick"), w.fresh("ticked")
        w.branch(any_ticks, tick, on)
        w.place(tick)
        w.increase(loop.counts[Count.INSTANTS])
        w.put(time, loop.instant)
        self.update()
        w.place(on)

    def captures(self, time: str) -> None:
        """What keeps how things were just before this instant, from the flow with the old ``z``.

        Nothing was before the start: there it keeps its start values.
        """
        loop, w, places = self.loop, self.loop.w, self.loop.places
        zero = number_text(0.0)
        capture, on = w.fresh("capture"), w.fresh("captured")
        begins = w.word_test("ne", w.get(w.at("%counts", Count.SETTLE, "i64"), "i64"), "0")
        w.branch(begins, on, capture)
        w.place(capture)
        for clock in range(len(loop.sizes.clocks)):
            w.put(zero, loop.at(places.ticking + clock))
        before = w.from_bits(w.word_op("sub", w.bits(time), "1"))
        w.put(w.select(w.compare("ogt", time, zero), before, time), loop.instant)
        self.update()
        w.place(on)

    def update(self) -> None:
        """``z`` becomes what ``update`` gives for the clocks that are marked."""
        loop, w, places = self.loop, self.loop.w, self.loop.places
        loop.emit_solve(loop.instant, loop.at(places.x))
        arguments = (places.x, places.z, places.trial_w)
        x, z, unknowns = (f"ptr {loop.at(place)}" for place in arguments)
        m, new = (f"ptr {loop.at(place)}" for place in (places.ticking, places.new_z))
        w.do(f"call void @update(ptr {loop.instant}, {x}, {z}, {unknowns}, ptr %p, {m}, {new})")
        loop.copy(places.new_z, places.z, loop.sizes.discrete)

    def stop(self, time: str) -> None:
        """Where a guard that ends the run is positive, record this instant, if it is not, and leave."""
        loop, w, places = self.loop, self.loop.w, self.loop.places
        sample = loop.counts[Count.SAMPLE]
        stop, write, leave, on = (w.fresh(stem) for stem in ("stop", "write", "leave", "on"))
        signs = [w.get(loop.at(places.signs + k)) for k in loop.sizes.stops]
        positive = w.compare("ogt", signs[0], number_text(0.0))
        for sign in signs[1:]:
            positive = w.either(positive, w.compare("ogt", sign, number_text(0.0)))
        w.branch(positive, stop, on)
        w.place(stop)
        number = w.get(sample, "i64")
        before = w.word_op("sub", number, "1")
        first = w.word_test("slt", before, "0")
        latest = w.get(w.at("%samples", w.let(f"select i1 {first}, i64 0, i64 {before}")))
        later = w.compare("olt", latest, w.multiply(time, number_text(SAME_BELOW)))
        w.branch(w.both(w.word_test("slt", number, loop.samples), w.either(first, later)), write, leave)
        w.place(write)
        w.put(time, w.at("%samples", number))
        row = w.at("%out", w.word_op("mul", number, str(loop.n)))
        w.for_each(loop.n, lambda i: w.put(loop.step.read(places.x, i), w.at(row, i)))
        loop.emit_record(time, number, row)
        w.increase(sample)
        w.place(leave)
        loop.leave(Status.STOPPED)
        w.place(on)

    def settle(self, time: str) -> None:
        """At the start, resets without events: modes and states take the values that the signals ask for.

        A mode may move a signal on which another one depends, so this is repeated until nothing changes, at
        most as often as there are guards.
        """
        loop, w, places = self.loop, self.loop.w, self.loop.places
        settle, turn, on = w.fresh("settle"), w.fresh("turn"), w.fresh("on")
        place = w.at("%counts", Count.SETTLE, "i64")
        w.branch(w.word_test("ne", w.get(place, "i64"), "0"), settle, on)
        w.place(settle)
        w.put(time, loop.instant)
        zero = number_text(0.0)
        w.for_each(loop.guards, lambda i: w.put(zero, loop.step.element(places.fired, i)))
        w.put(str(loop.guards), place, "i64")
        w.jump(turn)
        w.place(turn)
        loop.emit_solve(loop.instant, loop.at(places.x))
        arguments = (places.x, places.z, places.trial_w, places.fired, places.new_x, places.new_z)
        x, z, unknowns, e, new_x, new_z = (f"ptr {loop.at(place)}" for place in arguments)
        w.do(f"call void @reset(ptr {loop.instant}, {x}, {z}, {unknowns}, ptr %p, {e}, {new_x}, {new_z})")
        same = w.variable("double", number_text(1.0))

        def compare(i: str, before: int, after: int) -> None:
            old, new = (loop.step.read(where, i) for where in (before, after))
            w.put(w.select(w.compare("une", old, new), number_text(0.0), w.get(same)), same)

        w.put(number_text(1.0), same)
        w.for_each(loop.n, lambda i: compare(i, places.x, places.new_x))
        w.for_each(loop.sizes.discrete, lambda i: compare(i, places.z, places.new_z))
        loop.copy(places.new_x, places.x, loop.n)
        loop.copy(places.new_z, places.z, loop.sizes.discrete)
        left = w.word_op("sub", w.get(place, "i64"), "1")
        w.put(left, place, "i64")
        again = w.both(w.compare("oeq", w.get(same), number_text(0.0)), w.word_test("sgt", left, "0"))
        done = w.fresh("done")
        w.branch(again, turn, done)
        w.place(done)
        w.put("0", place, "i64")
        w.jump(on)
        w.place(on)

    def fire(self, time: str) -> None:
        """Fire guards and make modes consistent, in turns, until nothing is left to change.

        In a turn in which guards fire, ``reset`` is told which. Where none fires and modes contradict their
        conditions, they take their consistent values: all of them at once in the first turns, then the first
        of them alone, which ends for every complementarity problem with a P-matrix (Murty 1974, the least
        index rule). Where that does not end either, no choice of the modes is consistent.
        """
        loop, w, places = self.loop, self.loop.w, self.loop.places
        modes = len(loop.sizes.modes)
        turn, act, settled, on = (w.fresh(stem) for stem in ("guards", "fire", "settled", "on"))
        turns = w.variable("i64", "0")
        w.place(turn)
        changes = loop.watch(time, places.x)
        w.do("call void @take_signs(ptr %reals, i1 false)")
        loop.copy(places.guards, places.guards_before, loop.guards)
        unknown = number_text(float("nan"))
        w.for_each(loop.guards, lambda i: w.put(unknown, loop.step.element(places.guard_slopes, i)))
        w.branch(w.word_test("eq", changes, "0"), settled, act)
        w.place(act)
        w.put("1", loop.counts[Count.FRESH], "i64")
        # A turn counts as a step, so that a call of few steps ends soon also where there are many events.
        w.increase(loop.taken)
        if modes:
            event, first, more, reset = (w.fresh(stem) for stem in ("event", "first", "more", "reset"))
            quiet = w.fresh("quiet")
            w.branch(w.let("call i1 @any_fired(ptr %reals)"), event, quiet)
            w.place(quiet)
            before = w.get(turns, "i64")
            w.increase(turns)
            w.branch(w.word_test("eq", before, "0"), first, more)
            w.place(first)
            self.count_events(time, bounds=False)
            w.jump(more)
            w.place(more)
            loop.leave_unless(
                w.word_test("slt", w.get(turns, "i64"), str(MOST_TURNS * modes)), Status.INCONSISTENT_MODES
            )
            w.jump(reset)
            w.place(event)
            self.count_events(time, bounds=True)
            w.jump(reset)
            w.place(reset)
        else:
            self.count_events(time, bounds=True)
        self.reset(quiet_turns=turns if modes else None)
        # Guards that fired take the sign that the reset gives them; the others keep theirs, to be compared.
        loop.emit_solve(loop.instant, loop.at(places.x))
        call_guards(w, places, modes, loop.instant, loop.at(places.x))
        w.do("call void @take_signs(ptr %reals, i1 true)")
        w.jump(turn)
        w.place(settled)
        w.place(on)

    def count_events(self, time: str, *, bounds: bool) -> None:
        """Leave where events follow one another without end; the first step after an event is short."""
        loop, w = self.loop, self.loop.w
        bound = w.let(f"call double @note_events(double {time}, ptr %reals, ptr %counts)")
        if bounds:
            w.put(bound, loop.kept[Real.BOUND])
        # A negative bound is how the count of events says that there is no end to them.
        loop.leave_unless(w.compare("oge", bound, number_text(0.0)), Status.ENDLESS_EVENTS)

    def reset(self, quiet_turns: str | None) -> None:
        """States and discrete variables after the events that are marked, or with consistent modes."""
        loop, w, places = self.loop, self.loop.w, self.loop.places
        arguments = (places.x, places.z, places.trial_w)
        x, z, unknowns = (f"ptr {loop.at(place)}" for place in arguments)
        e, new_x, new_z = (f"ptr {loop.at(place)}" for place in (places.fired, places.new_x, places.new_z))
        w.do(f"call void @reset(ptr {loop.instant}, {x}, {z}, {unknowns}, ptr %p, {e}, {new_x}, {new_z})")
        if quiet_turns is not None:
            hold, done = w.fresh("hold"), w.fresh("held")
            w.branch(w.let("call i1 @any_fired(ptr %reals)"), done, hold)
            w.place(hold)
            together = TURNS_TOGETHER + len(loop.sizes.modes)
            one_by_one = w.word_test("sgt", w.get(quiet_turns, "i64"), str(together))
            w.do(f"call void @hold_modes(ptr %reals, i1 {one_by_one})")
            w.jump(done)
            w.place(done)
        loop.copy(places.new_x, places.x, loop.n)
        loop.copy(places.new_z, places.z, loop.sizes.discrete)
