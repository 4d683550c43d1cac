"""What happens at an instant of a hybrid run, as LLVM IR: ticks, events, the end.

The order of these is that of :mod:`armblocks.compiler.hybrid_loop`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from armblocks.compiler.integrator_workspace import Count, Real, Status
from armblocks.compiler.ir_text import number_text

if TYPE_CHECKING:
    from armblocks.compiler.hybrid_loop import HybridLoop

SAME_ABOVE, SAME_BELOW = 1.0 + 2.0**-50, 1.0 - 2.0**-50
"""Two times within these factors of one another are the same instant."""


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
        """What keeps how things were just before this instant, from the flow with the old ``z``."""
        loop, w, places = self.loop, self.loop.w, self.loop.places
        zero = number_text(0.0)
        for clock in range(len(loop.sizes.clocks)):
            w.put(zero, loop.at(places.ticking + clock))
        before = w.from_bits(w.word_op("sub", w.bits(time), "1"))
        w.put(w.select(w.compare("ogt", time, zero), before, time), loop.instant)
        self.update()

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
        """Fire guards until none fires any more."""
        loop, w, places = self.loop, self.loop.w, self.loop.places
        turn, fire, settled, on = (w.fresh(stem) for stem in ("guards", "fire", "settled", "on"))
        w.place(turn)
        fired = loop.watch(time, places.x)
        w.do("call void @take_signs(ptr %reals, i1 false)")
        loop.copy(places.guards, places.guards_before, loop.guards)
        unknown = number_text(float("nan"))
        w.for_each(loop.guards, lambda i: w.put(unknown, loop.step.element(places.guard_slopes, i)))
        w.branch(w.word_test("eq", fired, "0"), settled, fire)
        w.place(fire)
        w.put("1", loop.counts[Count.FRESH], "i64")
        bound = w.let(f"call double @note_events(double {time}, ptr %reals, ptr %counts)")
        w.put(bound, loop.kept[Real.BOUND])
        # A negative bound is how the count of events says that there is no end to them.
        loop.leave_unless(w.compare("oge", bound, number_text(0.0)), Status.ENDLESS_EVENTS)
        arguments = (places.x, places.z, places.trial_w)
        x, z, unknowns = (f"ptr {loop.at(place)}" for place in arguments)
        e, new_x, new_z = (f"ptr {loop.at(place)}" for place in (places.fired, places.new_x, places.new_z))
        w.do(f"call void @reset(ptr {loop.instant}, {x}, {z}, {unknowns}, ptr %p, {e}, {new_x}, {new_z})")
        loop.copy(places.new_x, places.x, loop.n)
        loop.copy(places.new_z, places.z, loop.sizes.discrete)
        # Guards that fired take the sign that the reset gives them; the others keep theirs, to be compared.
        loop.emit_solve(loop.instant, loop.at(places.x))
        arguments = (places.x, places.z, places.trial_w)
        x, z, unknowns = (f"ptr {loop.at(place)}" for place in arguments)
        g = f"ptr {loop.at(places.guards)}"
        w.do(f"call void @guards(ptr {loop.instant}, {x}, {z}, {unknowns}, ptr %p, {g})")
        w.do("call void @take_signs(ptr %reals, i1 true)")
        w.jump(turn)
        w.place(settled)
        w.place(on)
