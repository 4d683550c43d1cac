"""The step loop of a system with clocks, events or implicit equations, around the same Runge-Kutta steps.

At an instant (a tick, an event, a breakpoint, the start) things happen in this order, all in native code:

1. the flow is integrated up to it with the old values; the step ends exactly there, and where something
   keeps left limits, ``update`` is called for that with no clock marked;
2. all clocks that tick now are marked and ``update`` gives ``z``;
3. guards whose sign the jump has changed fire, and so do those whose zero was located here; ``reset`` gives
   ``x`` and ``z``; this is repeated until none fires; then modes that contradict their conditions take their
   consistent values, and all this is repeated until nothing changes;
4. the instant is recorded: signals are right-continuous;
5. the integration starts anew. The first step after an event is at most a hundredth of the time since the
   event before it, and later ones grow tenfold at most: no step leaps over a bounce that is getting shorter.

Tick ``k`` of a clock is at ``offset + k period``, one product and one sum, never accumulated. Instants that
are not more than four units in the last place apart are one instant: so 3 times 0.1 s and 0.3 s coincide
although their doubles differ, and a breakpoint or a recorded instant coincides with a tick likewise.

A guard fires where its sign is the opposite of the one it had after the last step, tick or event, in a step
that its direction allows. A zero takes no side: a guard that is zero keeps its last sign, and one that is
zero at the start counts with the sign that it takes first. Right after it fired, a zero guard of one
direction is on the side that it came from, and one of both directions counts with the sign it takes first.
"""

from __future__ import annotations

from armblocks.compiler.delay_lines import MOST_PIECES
from armblocks.compiler.happenings import SAME_ABOVE, SAME_BELOW, Happenings
from armblocks.compiler.hybrid_functions import emit_functions
from armblocks.compiler.integrator_workspace import Count, LoopSizes, Real, Stage, Status, Workspace
from armblocks.compiler.ir_text import Module, number_text
from armblocks.compiler.linear_equations import LinearSpace
from armblocks.compiler.rosenbrock_tableau import Tableau
from armblocks.compiler.runge_kutta import Loop

HIGH_ORDER = 7
"""From this order on, steps are too long for one quintic of the past."""
FINEST = 2.0**-12
"""Guards are looked at no closer than this part of a step."""


class HybridLoop(Loop):
    """Writes the loop. The module has all functions of the system, each ``void f(ptr t, ptr x, …)``."""

    kept_reals = (*Loop.kept_reals, Real.BOUND)
    kept_counts = (*Loop.kept_counts, Count.INSTANTS)

    def __init__(
        self,
        module: Module,
        tableau: Tableau,
        workspace: Workspace,
        sizes: LoopSizes,
        space: LinearSpace | None = None,
    ) -> None:
        super().__init__(module, tableau, workspace, space)
        self.sizes = sizes
        self.guards = len(sizes.directions)
        emit_functions(module, workspace, sizes)
        self.delays = len(sizes.delays)
        w = self.w
        self.instant = w.variable("double", number_text(0.0))
        self.event = w.variable("i64", "0")
        self.piece_end = self.end
        self.segment_end = w.variable("double", number_text(0.0))
        self.on_instant = w.fresh("instant")
        self.happenings = Happenings(self)

    # Evaluations.

    def at(self, place: int) -> str:
        """Address of a vector of the workspace."""
        return self.w.at("%reals", place)

    def emit_delay_bounds(self) -> None:
        """No step is longer than a delay: what is looked up is then always there."""
        w, places, n = self.w, self.places, self.delays
        w.do(f"call void @delay_bounds(ptr %p, ptr {self.at(places.bounds)})")
        shortest, longest = self.max_step, number_text(0.0)
        for k in range(n):
            shortest = w.minimum(shortest, w.get(self.at(places.bounds + k)))
            longest = w.maximum(longest, w.get(self.at(places.bounds + n + k)))
            w.put(w.get(self.at(places.bounds + k)), self.at(places.taus + k))
        self.max_step = shortest
        w.put(longest, self.at(places.longest))

    def reals_size(self) -> str:
        """Bytes of the array of doubles, with the past as far as it is kept."""
        if not self.delays:
            return super().reals_size()
        w, places = self.w, self.places
        rows = w.get(w.at("%counts", Count.PAST, "i64"), "i64")
        length = w.word_op("add", w.word_op("mul", rows, str(places.past_width)), str(places.past))
        return w.word_op("mul", length, "8")

    def emit_room(self) -> None:
        """Make sure that the past of delayed signals has room for another step."""
        if self.delays:
            time = self.w.get(self.kept[Real.TIME])
            room = self.w.let(f"call i1 @make_room(double {time}, ptr %reals, ptr %counts)")
            self.leave_unless(room, Status.PAST_FULL)

    def keep(self, instant: str, x: str, function: str, middle: float = 0.0) -> None:
        """A row of the past at a point, whose unknowns are solved and whose delayed values are looked up."""
        arguments = f"ptr {instant}, ptr {x}, ptr %reals, ptr %counts, ptr %p"
        self.w.do(f"call void @{function}({arguments}, double {number_text(middle)})")

    def emit_solve(self, instant: str, x: str) -> None:
        """The delayed values at a point into ``z``, the unknowns of implicit equations into ``trial_w``."""
        if self.delays:
            self.w.do(f"call void @look_back(ptr {instant}, ptr {x}, ptr %reals, ptr %counts, ptr %p)")
        if self.sizes.algebraic:
            self.w.do(f"call void @solve(ptr {instant}, ptr {x}, ptr %reals, ptr %p)")

    def emit_flow(self, instant: str, x: str, xd: str) -> None:
        """One evaluation of the derivative, between three addresses."""
        self.emit_solve(instant, x)
        z, w = self.at(self.places.z), self.at(self.places.trial_w)
        self.w.do(f"call void @derivative(ptr {instant}, ptr {x}, ptr {z}, ptr {w}, ptr %p, ptr {xd})")

    def emit_jacobian(self, instant: str, x: str) -> None:
        """The derivatives of the flow and of the implicit equations at a point, into the scratch."""
        self.emit_solve(instant, x)
        z, w = self.at(self.places.z), self.at(self.places.trial_w)
        arguments = f"ptr {instant}, ptr {x}, ptr {z}, ptr {w}, ptr %p"
        self.w.do(f"call void @flow_jacobian({arguments}, {self.jacobian_places()})")

    def watch(self, time: str, x: int) -> str:
        """Evaluate all guards and mark those that fire; how many do."""
        w = self.w
        w.put(time, self.instant)
        self.emit_solve(self.instant, self.at(x))
        return w.let(f"call i64 @watch(ptr {self.instant}, ptr {self.at(x)}, ptr %reals, ptr %p)")

    def copy(self, source: int, target: int, count: int) -> None:
        """One vector of the workspace to another place."""
        w, step = self.w, self.step
        w.for_each(count, lambda i: w.put(step.read(source, i), step.element(target, i)))

    def accept_unknowns(self) -> None:
        """``w`` becomes what was found last."""
        self.copy(self.places.trial_w, self.places.w, self.sizes.algebraic)

    # The loop.

    def emit_entry(self) -> None:
        """Go on where the last call stopped; the ends of the current piece are worked out again."""
        w = self.w
        if self.delays:
            self.emit_delay_bounds()
        self.emit_piece()
        started = w.get(self.counts[Count.STARTED], "i64")
        running, other = w.word_test("eq", started, str(int(Stage.RUNNING))), w.fresh("other")
        w.branch(running, self.on_step, other)
        w.place(other)
        w.branch(
            w.word_test("eq", started, str(int(Stage.START))),
            self.on_start,
            self.on_instant,
        )
        w.place(self.on_instant)
        self.emit_instant()

    def tick_time(self, clock: int) -> str:
        """When a clock ticks next."""
        w = self.w
        period, offset = self.sizes.clocks[clock]
        number = w.get(w.at("%counts", Count.END + clock, "i64"), "i64")
        product = w.multiply(w.let(f"sitofp i64 {number} to double"), number_text(period))
        return product if offset == 0.0 else w.add(product, number_text(offset))

    def emit_piece(self) -> None:
        """How far the steps may go: to the next tick or the segment's end, whichever is earlier."""
        w = self.w
        last = w.word_op("sub", self.segments, "1")
        segment = w.get(self.counts[Count.SEGMENT], "i64")
        segment = w.let(f"select i1 {w.word_test('slt', segment, last)}, i64 {segment}, i64 {last}")
        end = w.get(w.at("%ends", segment))
        w.put(end, self.segment_end)
        w.put(w.get(w.at("%clamps", segment)), self.clamp)
        # A tick a few rounding errors before the end is at the end.
        shortest = w.multiply(end, number_text(SAME_BELOW))
        earliest = end
        for clock in range(len(self.sizes.clocks)):
            time = self.tick_time(clock)
            earlier = w.both(w.compare("olt", time, shortest), w.compare("olt", time, earliest))
            earliest = w.select(earlier, time, earliest)
        if self.delays:
            time = w.let("call double @next_arrival(ptr %reals, ptr %counts)")
            earlier = w.both(w.compare("olt", time, shortest), w.compare("olt", time, earliest))
            earliest = w.select(earlier, time, earliest)
        w.put(earliest, self.piece_end)

    def emit_instant(self) -> None:
        """Ticks, events and records at the time reached; goes on below at the start of the next piece."""
        w = self.w
        time = w.get(self.kept[Real.TIME])
        until = w.multiply(time, number_text(SAME_ABOVE))
        # A record that is one instant with a tick or breakpoint is of that instant. An event is located to
        # the last place: what is recorded later comes later.
        known = w.compare("oge", time, w.multiply(w.get(self.end), number_text(SAME_BELOW)))
        recorded = w.variable("double", time)
        w.put(w.select(known, until, time), recorded)
        if self.sizes.captures:
            self.happenings.captures(time)
        if self.delays:
            w.do(f"call void @arrive(double {time}, ptr %reals, ptr %counts)")
        self.happenings.ticks(time, until)
        if self.guards:
            self.happenings.settle(time)
            self.happenings.fire(time)
        else:
            w.put("0", w.at("%counts", Count.SETTLE, "i64"), "i64")
            w.put(time, self.instant)
            self.emit_solve(self.instant, self.at(self.places.x))
        if self.delays:
            w.put(time, self.instant)
            self.emit_solve(self.instant, self.at(self.places.x))
            self.keep(self.instant, self.at(self.places.x), "keep_change")
            w.do(f"call void @arrive(double {time}, ptr %reals, ptr %counts)")
        self.accept_unknowns()
        self.emit_samples(time, w.get(recorded), None)
        if self.sizes.stops:
            self.happenings.stop(time)
        finished = w.word_test("slt", w.get(self.counts[Count.SEGMENT], "i64"), self.segments)
        self.leave_unless(finished, Status.DONE)
        self.emit_piece()
        w.put(str(int(Stage.START)), self.counts[Count.STARTED], "i64")
        w.jump(self.on_start)

    def emit_first_step(self, time: str) -> None:
        """The length of the step after a start; after a tick, the length that was to come next."""
        w = self.w
        choose, chosen = w.fresh("choose"), w.fresh("chosen")
        fresh = w.word_test("ne", w.get(self.counts[Count.FRESH], "i64"), "0")
        w.branch(fresh, choose, chosen)
        w.place(choose)
        interval = w.subtract(w.get(self.end), time)
        length, bounded = self.step.first_step(time, interval, self.max_step)
        self.emit_checkpoint(w.both(bounded, w.compare("oge", w.get(self.end), self.last_end)))
        w.put(w.minimum(length, w.get(self.kept[Real.BOUND])), self.kept[Real.STEP])
        w.place(chosen)

    # Equations of a mode that end where the mode does: a root of something that is about to be mirrored.

    def emit_trial(self, time: str, new_time: str) -> str:
        """Stages of a step to ``new_time``; gives its length."""
        self.w.put("0", self.extra_done, "i64")
        return super().emit_trial(time, new_time)

    def emit_finite_trial(self, time: str, new_time: str) -> None:
        """A fixed step, shorter where its end would not be finite; at last one across the border."""
        if not self.guards:
            super().emit_finite_trial(time, new_time)
            return
        w, step = self.w, self.step
        attempt, shorter, short, finite = (
            w.fresh(stem) for stem in ("attempt", "shorter", "short", "finite")
        )
        end = w.variable("double", new_time)
        w.put(new_time, end)
        w.place(attempt)
        self.emit_trial(time, w.get(end))
        w.branch(step.all_finite(step.y, step.K(self.tableau.end_row)), finite, shorter)
        w.place(shorter)
        h = w.multiply(number_text(0.25), w.subtract(w.get(end), time))
        w.put(w.add(time, h), end)
        w.branch(w.compare("ogt", h, self.shortest(time)), attempt, short)
        w.place(short)
        self.emit_crossing(time)
        w.place(finite)

    def emit_not_finite(self, time: str, finite: str, accepted: str) -> None:
        """Steps have become as short as they can be: go across the border of a mode, if that is the cause."""
        if self.guards:
            w = self.w
            cross, on = w.fresh("cross"), w.fresh("on")
            w.branch(finite, on, cross)
            w.place(cross)
            self.emit_crossing(time)
            w.jump(accepted)
            w.place(on)
        else:
            super().emit_not_finite(time, finite, accepted)

    def shortest(self, time: str) -> str:
        """A length that is as good as nothing beside the time."""
        w = self.w
        return w.multiply(number_text(2.0**-46), w.maximum(time, w.get(w.at("%reals", Real.SPAN))))

    def emit_crossing(self, time: str) -> None:
        """A step of next to no length along the old derivative, after which some guard must have fired."""
        w, step = self.w, self.step
        h = w.multiply(number_text(8.0), self.shortest(time))
        new_time = w.minimum(w.add(time, h), w.get(self.end))
        h = w.subtract(new_time, time)
        w.put(new_time, self.new_time)
        w.put(h, self.h)
        # All stages alike, so that the values between the steps are on the same line.
        for row in range(1, self.tableau.rows):
            step.copy(step.K(0), step.K(row))
        w.put("1", self.extra_done, "i64")
        step.move((1.0,), h)
        fired = self.watch(w.minimum(new_time, w.get(self.clamp)), self.places.y)
        self.leave_unless(w.word_test("ne", fired, "0"), Status.NON_FINITE)

    def emit_next_length(self, proposed: str) -> None:
        """A step that was cut short by a tick says nothing against the length that was to be tried."""
        w = self.w
        length = w.get(self.kept[Real.STEP])
        cut = w.compare("oge", w.get(self.new_time), w.get(self.end))
        w.put(w.select(cut, w.maximum(proposed, length), proposed), self.kept[Real.STEP])

    def passed(self, time: str, spacing: str) -> str:
        """Grid instants up to this time are behind: one a rounding error after a tick is the tick."""
        return self.w.fma(spacing, number_text(1e-9), time)

    def bounded(self, time: str, new_time: str) -> str:
        """The end of a fixed step, sooner right after an event."""
        w = self.w
        following = w.from_bits(w.word_op("add", w.bits(time), "10"))
        soon = w.maximum(w.add(time, w.get(self.kept[Real.BOUND])), following)
        if self.delays:
            soon = w.minimum(soon, w.add(time, self.max_step))
        return w.minimum(soon, new_time)

    def emit_record(self, instant: str, sample: str, row: str) -> None:
        """What else than the state a sample instant records: ``z``, and ``w`` for the state just written."""
        w, step, places = self.w, self.step, self.places
        if self.delays or self.sizes.algebraic:
            w.put(instant, self.instant)
            self.emit_solve(self.instant, row)
        for name, place, count in (
            ("%out_z", places.z, self.sizes.discrete),
            ("%out_w", places.trial_w, self.sizes.algebraic),
        ):
            if not count:
                continue
            target = w.at(name, w.word_op("mul", sample, str(count)))
            w.for_each(count, lambda i: w.put(step.read(place, i), w.at(target, i)))  # noqa: B023

    def emit_accepted(self) -> None:
        """Events within the step, its samples, then the new point becomes the old one."""
        w, step = self.w, self.step
        w.put("0", self.event, "i64")
        plain, instant = w.fresh("plain"), w.fresh("instant")
        time, h = w.get(self.kept[Real.TIME]), w.get(self.h)
        if self.guards:
            self.emit_search(time, h)
        new_time = w.get(self.new_time)
        before = w.multiply(new_time, number_text(SAME_BELOW))
        if self.guards:
            # An event is located to the last place: a record before it shows what was before it, unless a
            # tick or breakpoint is at this instant as well.
            apart = w.both(
                w.word_test("ne", w.get(self.event, "i64"), "0"),
                w.compare("olt", new_time, w.multiply(w.get(self.end), number_text(SAME_BELOW))),
            )
            just_before = w.from_bits(w.word_op("sub", w.bits(new_time), "1"))
            before = w.select(apart, just_before, before)
        self.emit_samples(time, before, h)
        if self.delays:
            self.emit_past(time, new_time, h)
        step.copy(step.y, step.x)
        w.put(new_time, self.kept[Real.TIME])
        w.increase(self.counts[Count.ACCEPTED])
        w.put("0", self.counts[Count.FRESH], "i64")
        w.put(w.multiply(w.get(self.kept[Real.BOUND]), number_text(10.0)), self.kept[Real.BOUND])
        w.increase(self.taken)
        happens = w.either(
            w.word_test("ne", w.get(self.event, "i64"), "0"), w.compare("oge", new_time, w.get(self.end))
        )
        w.branch(happens, instant, plain)
        w.place(plain)
        step.copy(step.K(self.tableau.end_row), step.K(0))
        if self.sizes.algebraic or self.delays:
            # The samples may have changed it; a zero of the same equations is found again at once.
            w.put(w.minimum(new_time, w.get(self.clamp)), self.instant)
            self.emit_solve(self.instant, self.at(self.places.x))
            self.accept_unknowns()
        self.emit_samples(new_time, w.multiply(new_time, number_text(SAME_ABOVE)), None)
        w.jump(self.on_step)
        w.place(instant)
        over, same = w.fresh("over"), w.fresh("same")
        w.branch(w.compare("oge", new_time, w.get(self.segment_end)), over, same)
        w.place(over)
        w.increase(self.counts[Count.SEGMENT])
        w.put("1", self.counts[Count.FRESH], "i64")
        w.place(same)
        w.put(str(int(Stage.INSTANT)), self.counts[Count.STARTED], "i64")
        if self.sizes.clocks:
            self.emit_halt(new_time)
        w.jump(self.on_instant)

    def emit_halt(self, time: str) -> None:
        """Return before the ticks of an instant that somebody waits for, all values as they are there."""
        w = self.w
        halt, on = w.fresh("halt"), w.fresh("no_halt")
        halted = w.compare("oge", w.multiply(time, number_text(SAME_ABOVE)), w.get(w.at("%reals", Real.HALT)))
        w.branch(halted, halt, on)
        w.place(halt)
        w.put(time, self.instant)
        self.emit_solve(self.instant, self.at(self.places.x))
        self.accept_unknowns()
        self.leave(Status.PAUSED)
        w.place(on)

    def emit_search(self, time: str, h: str) -> None:
        """If a guard fires within the step, go back to the first instant at which one does.

        The step is looked through in stretches, at the middle and the end of each. A stretch is as long as
        the last ones proved to be smooth enough, at the start an eighth of the step, and is halved where a
        guard may have gone to zero and come back (``dips``). Then bisection: what is bracketed is "some guard
        has fired", so that the first of several is found; the step ends on the far side of the zero, where it
        has fired.
        """
        w, places = self.w, self.places
        turn, second, look, halve, follow, quiet, found, on = (
            w.fresh(stem) for stem in ("turn", "second", "look", "halve", "follow", "quiet", "found", "on")
        )
        end = w.get(self.new_time)
        low, high = w.variable("double", time), w.variable("double", end)
        w.put(time, low)
        scan = w.at("%reals", Real.SCAN)
        unknown = w.compare("oeq", w.get(scan), number_text(float("inf")))
        w.put(w.select(unknown, w.multiply(number_text(0.125), h), w.minimum(w.get(scan), h)), scan)
        finest = w.multiply(h, number_text(FINEST))
        self.emit_extra_stages_once(time, h)
        w.place(turn)
        a = w.get(low)
        middle = w.fma(number_text(0.5), w.get(scan), a)
        reached = w.add(a, w.get(scan))
        # What would leave less than half a stretch goes along with it, and so does all that is left where the
        # middle of a stretch cannot be told from its ends.
        whole = w.compare("oge", w.fma(number_text(0.5), w.get(scan), reached), end)
        apart = w.both(w.compare("ogt", middle, a), w.compare("olt", middle, reached))
        whole = w.either(whole, w.let(f"xor i1 {apart}, true"))
        middle = w.select(whole, w.fma(number_text(0.5), w.subtract(end, a), a), middle)
        reached = w.select(whole, end, reached)
        w.put(middle, high)
        w.branch(w.word_test("eq", self.watch_inside(middle, time, h), "0"), second, found)
        w.place(second)
        self.copy(places.guards, places.guards_middle, self.guards)
        w.put(reached, high)
        at_end, inside, looked = w.fresh("end"), w.fresh("inside"), w.fresh("looked")
        count = w.variable("i64", "0")
        w.branch(w.compare("oge", reached, end), at_end, inside)
        w.place(at_end)
        w.put(self.watch(w.minimum(end, w.get(self.clamp)), places.y), count, "i64")
        w.jump(looked)
        w.place(inside)
        w.put(self.watch_inside(reached, time, h), count, "i64")
        w.place(looked)
        beyond = w.fresh("beyond")
        w.branch(w.word_test("eq", w.get(count, "i64"), "0"), look, beyond)
        w.place(beyond)
        w.put(middle, low)
        w.jump(found)
        w.place(look)
        half = w.subtract(middle, a)
        dips = w.word_test("ne", w.let(f"call i64 @dips(ptr %reals, double {half})"), "0")
        w.branch(w.both(dips, w.compare("ogt", w.get(scan), finest)), halve, follow)
        w.place(halve)
        length = w.minimum(w.get(scan), w.subtract(reached, a))
        w.put(w.multiply(number_text(0.5), length), scan)
        w.jump(turn)
        w.place(follow)
        w.do(f"call void @note_slopes(ptr %reals, double {half})")
        w.do("call void @take_signs(ptr %reals, i1 false)")
        self.copy(places.guards, places.guards_before, self.guards)
        w.put(reached, low)
        w.put(w.multiply(number_text(2.0), w.get(scan)), scan)
        w.branch(w.compare("oge", reached, end), quiet, turn)
        w.place(found)
        w.put("1", self.event, "i64")
        self.emit_bisection(low, high, time, h)
        w.branch(w.compare("olt", w.get(high), end), moved := w.fresh("moved"), on)
        w.place(moved)
        self.step.interpolate(w.get(high), time, h, self.at(places.y))
        w.put(w.get(high), self.new_time)
        w.jump(on)
        w.place(quiet)
        w.place(on)

    def emit_past(self, time: str, new_time: str, h: str) -> None:
        """Write an accepted step into the table of the past, by pieces with a middle and an end.

        A piece is the whole step, a half of the long steps of a method of high order, or shorter where the
        quintic of a piece strays from a signal.

        From half of the most pieces on, the tolerance grows, so that the rest fits into the other half.
        """
        w, places = self.w, self.places
        self.emit_extra_stages_once(time, h)
        turn, strayed, shorter, kept, done = (
            w.fresh(stem) for stem in ("piece", "strayed", "shorter", "kept", "done")
        )
        rows = w.at("%counts", Count.PAST, "i64")
        before = w.get(rows, "i64")
        most, many = (
            w.word_op("add", before, str(2 * count)) for count in (MOST_PIECES - 1, MOST_PIECES // 2)
        )
        factor = w.variable("double", number_text(1.0))
        w.put(number_text(1.0), factor)
        begin, end = w.variable("double", time), w.variable("double", new_time)
        w.put(time, begin)
        half = w.fma(number_text(0.5), w.subtract(new_time, time), time)
        w.put(half if self.tableau.order >= HIGH_ORDER else new_time, end)
        w.place(turn)
        a, b = w.get(begin), w.get(end)
        length, known = w.subtract(b, a), w.get(rows, "i64")
        # Past the most pieces, all that is left is one.
        last = w.word_test("sge", known, most)
        b = w.select(last, new_time, b)

        def point(part: float) -> None:
            """The state at a part of the piece into ``new_x``, and all that follows from it."""
            instant = b if part == 1.0 else w.fma(number_text(part), w.subtract(b, a), a)
            self.step.interpolate(instant, time, h, self.at(places.new_x))
            if part == 1.0:
                at_end = w.compare("oge", b, new_time)

                def exact(i: str) -> None:
                    y, inside = self.step.read(places.y, i), self.step.read(places.new_x, i)
                    w.put(w.select(at_end, y, inside), self.step.element(places.new_x, i))

                w.for_each(self.n, exact)
            w.put(w.minimum(instant, w.get(self.clamp)), self.instant)
            self.emit_solve(self.instant, self.at(places.new_x))

        for part, mark in ((0.5, 1.0), (1.0, 0.0)):
            point(part)
            self.keep(self.instant, self.at(places.new_x), "keep", mark)
        w.branch(last, done, strayed)
        w.place(strayed)
        arguments = f"ptr {self.instant}, ptr {self.at(places.new_x)}, ptr %reals, ptr %counts, ptr %p"
        found = "false"
        for part in (0.25, 0.75):
            point(part)
            place = number_text(2.0 * part - 1.0)
            numbers = f"double {place}, double {w.get(factor)}"
            found = w.either(found, w.let(f"call i1 @strays({arguments}, {numbers})"))
        divisible = w.compare("ogt", length, w.multiply(b, number_text(2.0**-48)))
        w.branch(w.both(found, divisible), shorter, kept)
        w.place(shorter)
        w.put(known, rows, "i64")
        w.put(w.fma(number_text(0.5), length, a), end)
        w.jump(turn)
        w.place(kept)
        growth = w.select(w.word_test("sge", known, many), number_text(1.1), number_text(1.0))
        w.put(w.multiply(w.get(factor), growth), factor)
        w.put(b, begin)
        reached = w.fma(number_text(2.0), length, b)
        w.put(w.minimum(reached, new_time), end)
        w.branch(w.compare("oge", b, new_time), done, turn)
        w.place(done)

    def watch_inside(self, instant: str, time: str, h: str) -> str:
        """How many guards have fired at an instant within the step."""
        self.step.interpolate(instant, time, h, self.at(self.places.new_x))
        return self.watch(self.w.minimum(instant, self.w.get(self.clamp)), self.places.new_x)

    def emit_bisection(self, low: str, high: str, time: str, h: str) -> None:
        """Move ``high`` to the first instant, to the last place, at which a guard has fired.

        None has at ``low``, some has at ``high``. Instants within four units in the last place are one
        instant: located to the last place, an event at a recorded instant or a tick belongs to it.
        """
        w = self.w
        turn, evaluate, before, after, located = (
            w.fresh(stem) for stem in ("turn", "evaluate", "before", "after", "located")
        )
        w.place(turn)
        a, b = w.get(low), w.get(high)
        width = w.subtract(b, a)
        middle = w.fma(number_text(0.5), width, a)
        inside = w.both(w.compare("ogt", middle, a), w.compare("olt", middle, b))
        w.branch(inside, evaluate, located)
        w.place(evaluate)
        w.branch(w.word_test("eq", self.watch_inside(middle, time, h), "0"), before, after)
        w.place(before)
        w.put(middle, low)
        w.jump(turn)
        w.place(after)
        w.put(middle, high)
        w.jump(turn)
        w.place(located)
