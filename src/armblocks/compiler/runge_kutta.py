"""The whole loop of a one-step method, explicit or Rosenbrock, as LLVM IR around one traced derivative.

One call of the native function takes many steps: stages, error estimate, step control, values at the sample
instants and restarts at breakpoints, without returning to Python. All of its state lies in two flat arrays
(:mod:`armblocks.compiler.integrator_workspace`), so a run can stop after any number of steps and go on with
the same bits.

Step control is that of SciPy's ``RK45`` (Hairer, Norsett, Wanner I, II.4): root-mean-square norm of the
error over ``atol + rtol max(|x|, |x_new|)``, safety 0.9, factors 0.2 to 10, no growth right after a
rejection, the same choice of the first step. Step counts can therefore be laid beside SciPy's.
"""

from __future__ import annotations

from armblocks.compiler.butcher_tableau import ButcherTableau, Row
from armblocks.compiler.explicit_step import ExplicitStep
from armblocks.compiler.integrator_workspace import Count, Real, Stage, Status, Workspace
from armblocks.compiler.ir_routine import Routine
from armblocks.compiler.ir_text import Module, number_text
from armblocks.compiler.linear_equations import LinearSpace
from armblocks.compiler.rosenbrock_step import RosenbrockStep
from armblocks.compiler.rosenbrock_tableau import Tableau
from armblocks.compiler.step_writer import StepWriter

SAFETY, SHRINK, GROW = 0.9, 0.2, 10.0
LOOK_EVERY = 16
"""Steps between two looks at what bounds them: a power of two."""
NEAR_BORDER = 0.97
"""Of the stability interval: a step beyond it is bound by stability (3.2 of 3.3, as in Hairer's DOPRI5)."""
STIFF_LOOKS, CALM_LOOKS = 250, 6
"""So many looks that find a step bound by stability, 4000 steps, make the system stiff; so many in a row that
do not make it calm again."""
STABLE_BELOW, STABLE_LOOKS = 2.0, 16
"""A step of the method for stiff systems that times the fastest rate is less than this is one that an
explicit method could take as well; so many looks in a row, four times as many after each return, and one
does."""
CRAWL_EVERY, CRAWL_BACK = 64, 8
"""Steps between two looks (a power of two), and how many looks each takes back that finds nothing wrong."""
CRAWL_LOOKS = {True: 2048, False: 512}
"""Looks that make a run crawl, for explicit methods and others: some tenths of a second."""
CRAWL_CHANGE, RESOLVED = 1000.0, 4.0
"""What a step that is short for good reason changes at least, in tolerances: ``h |f(end) - f(start)|``. A
jump of ``f`` passes where it is below 1 over the least weight of the error, some hundreds; a smooth solution
of rate L changes by ``(h L)^2 / rtol``, where the error makes ``(h L)^2`` about 10 to 50 times
``rtol^(2/(q + 1))`` for a method whose error is of order q; ``RESOLVED`` is less."""
MOST_STEPS = 1e8
"""A run that crawls is ended where it has more steps than these before it."""

_ARGUMENTS = (
    "%reals",
    "%counts",
    "%p",
    "%samples",
    "%ends",
    "%clamps",
    "%out",
    "%out_z",
    "%out_w",
    "%saved_reals",
    "%saved_counts",
    "%scratch",
)
POINTERS = len(_ARGUMENTS)
_KEPT_REALS = (Real.TIME, Real.STEP, Real.TRIED)
_KEPT_COUNTS = (
    Count.SAMPLE,
    Count.SEGMENT,
    Count.STARTED,
    Count.GRID,
    Count.ACCEPTED,
    Count.REJECTED,
    Count.EVALUATIONS,
    Count.FRESH,
    Count.SAVED,
    Count.WATCHED,
    Count.STIFF,
    Count.CALM,
    Count.CRAWL,
)


def define_loop(symbol: str, loop: Loop) -> None:
    """Add ``i64 symbol(reals, counts, p, samples, ends, clamps, out, …, max_steps)`` to the loop's module.

    ``samples`` are the instants to record and ``out`` their states, ``(N, n)`` (``out_z``, ``out_w`` likewise
    what a hybrid system has besides). ``ends`` are the ends of the segments between breakpoints and
    ``clamps`` the latest time at which each segment may evaluate its derivative. Into ``saved_reals`` and
    ``saved_counts`` goes the state from which a run that ends later would go on; ``scratch`` has room for the
    linear equations of a step (:class:`LinearSpace`). The integers and all other pointers are ``int64`` and
    ``float64``. The result is a ``Status``.
    """

    def write() -> str:
        pointers = ", ".join(f"ptr noalias {name}" for name in _ARGUMENTS)
        loop.emit()
        return loop.w.text(f"define i64 @{symbol}({pointers}, i64 %max_steps)")

    loop.w.module.define(symbol, write)


class Loop:
    """Writes the loop of a system that only flows, for one method; the blocks stand in the order they run in.

    The module has ``void derivative(ptr t, ptr x, ptr z, ptr w, ptr p, ptr xd)`` and, for a Rosenbrock
    method, whose linear equations lie in ``space``, ``void flow_jacobian(ptr t, …, ptr J, ptr T)``.
    """

    kept_reals: tuple[Real, ...] = _KEPT_REALS
    kept_counts: tuple[Count, ...] = _KEPT_COUNTS

    def __init__(
        self, module: Module, tableau: Tableau, workspace: Workspace, space: LinearSpace | None = None
    ) -> None:
        self.w = w = Routine(module)
        self.tableau = tableau
        self.places = workspace
        self.n = workspace.states
        self.kept = {p: w.variable("double", w.get(w.at("%reals", p))) for p in self.kept_reals}
        self.counts = {
            p: w.variable("i64", w.get(w.at("%counts", p, "i64"), "i64")) for p in self.kept_counts
        }
        self.max_step = w.get(w.at("%reals", Real.MAX_STEP))
        self.pause = w.get(w.at("%reals", Real.PAUSE))
        self.samples = w.get(w.at("%counts", Count.SAMPLES, "i64"), "i64")
        self.segments = w.get(w.at("%counts", Count.SEGMENTS, "i64"), "i64")
        segment = w.get(self.counts[Count.SEGMENT], "i64")
        self.end = w.variable("double", w.get(w.at("%ends", segment)))
        self.clamp = w.variable("double", w.get(w.at("%clamps", segment)))
        self.last_end = w.get(w.at("%ends", w.word_op("sub", self.segments, "1")))
        self.taken = w.variable("i64", "0")
        self.status = w.variable("i64", str(int(Status.DONE)))
        self.h = w.variable("double", number_text(0.0))
        self.new_time = w.variable("double", number_text(0.0))
        self.extra_done = w.variable("i64", "0")
        self.step: StepWriter
        evaluations = self.counts[Count.EVALUATIONS]
        if isinstance(tableau, ButcherTableau):
            self.step = ExplicitStep(w, tableau, workspace, self.emit_flow, self.clamp, evaluations)
        else:
            assert space is not None
            self.space = space
            self.step = RosenbrockStep(
                w, tableau, workspace, self.emit_flow, self.clamp, evaluations, space, self.emit_jacobian
            )
        self.on_start, self.on_step, self.on_leave = (w.fresh(stem) for stem in ("start", "step", "leave"))

    def emit_flow(self, instant: str, x: str, xd: str) -> None:
        """One evaluation of the derivative, between three addresses."""
        self.w.do(f"call void @derivative(ptr {instant}, ptr {x}, ptr null, ptr null, ptr %p, ptr {xd})")

    def emit_jacobian(self, instant: str, x: str) -> None:
        """The derivatives of the flow at a point, into the scratch."""
        arguments = f"ptr {instant}, ptr {x}, ptr null, ptr null, ptr %p"
        self.w.do(f"call void @flow_jacobian({arguments}, {self.jacobian_places()})")

    def jacobian_places(self) -> str:
        """Where ``flow_jacobian`` writes."""
        J, T = (self.w.at("%scratch", place) for place in (self.space.J, self.space.T))
        return f"ptr {J}, ptr {T}"

    def emit(self) -> None:
        """The whole body."""
        w = self.w
        self.emit_entry()
        w.place(self.on_start)
        self.emit_start()
        w.place(self.on_step)
        on = w.word_test("slt", w.get(self.taken, "i64"), "%max_steps")
        on = w.both(on, w.compare("olt", w.get(self.kept[Real.TIME]), self.pause))
        self.leave_unless(on, Status.PAUSED)
        self.emit_room()
        error = self.tableau.error_row
        if error is not None:
            self.emit_adaptive_step(error)
        else:
            self.emit_fixed_step()
        self.emit_accepted()
        w.place(self.on_leave)
        self.emit_keep()
        w.do(f"ret i64 {w.get(self.status, 'i64')}")

    def emit_entry(self) -> None:
        """Go on where the last call stopped."""
        w = self.w
        running = w.word_test("eq", w.get(self.counts[Count.STARTED], "i64"), str(int(Stage.RUNNING)))
        w.branch(running, self.on_step, self.on_start)

    def emit_keep(self) -> None:
        """The variables back into the arrays."""
        w = self.w
        for place, variable in self.kept.items():
            w.put(w.get(variable), w.at("%reals", place))
        for place, variable in self.counts.items():
            w.put(w.get(variable, "i64"), w.at("%counts", place, "i64"), "i64")

    def emit_checkpoint(self, condition: str) -> None:
        """Save the state, once, before the end of the run first bounds a step: a longer run would go on here.

        The first step after a start is saved as the start, because the end bounds the choice of its length.
        """
        w = self.w
        last, on = w.fresh("last"), w.fresh("on")
        unsaved = w.word_test("eq", w.get(self.counts[Count.SAVED], "i64"), "0")
        w.branch(w.both(condition, unsaved), last, on)
        w.place(last)
        self.emit_keep()
        w.module.declare("void", "llvm.memcpy.p0.p0.i64", "ptr", "ptr", "i64", "i1")
        for kind, size in (("reals", self.reals_size()), ("counts", str(8 * self.places.counts))):
            w.do(f"call void @llvm.memcpy.p0.p0.i64(ptr %saved_{kind}, ptr %{kind}, i64 {size}, i1 false)")
        fresh = w.word_test("ne", w.get(self.counts[Count.FRESH], "i64"), "0")
        stage = w.let(f"select i1 {fresh}, i64 {int(Stage.START)}, i64 {int(Stage.RUNNING)}")
        w.put(stage, w.at("%saved_counts", Count.STARTED, "i64"), "i64")
        w.put("1", self.counts[Count.SAVED], "i64")
        w.place(on)

    def reals_size(self) -> str:
        """Bytes of the array of doubles."""
        return str(8 * self.places.size)

    def emit_room(self) -> None:
        """Make sure that what a step leaves behind has room."""

    def leave(self, status: Status) -> None:
        """Return, unconditionally."""
        self.w.put(str(int(status)), self.status, "i64")
        self.w.jump(self.on_leave)

    def leave_unless(self, condition: str, status: Status) -> None:
        """Return where the condition fails."""
        w = self.w
        failed, on = w.fresh("failed"), w.fresh("on")
        w.branch(condition, on, failed)
        w.place(failed)
        self.leave(status)
        w.place(on)

    def emit_start(self) -> None:
        """First derivative of a segment, the samples at its very start, the first step's length."""
        w, step = self.w, self.step
        time = w.get(self.kept[Real.TIME])
        step.evaluate(time, step.x, 0)
        self.emit_samples(time, time, None)
        self.leave_unless(step.all_finite(step.K(0)), Status.NON_FINITE_START)
        if self.tableau.adaptive:
            self.emit_first_step(time)
        w.put(str(int(Stage.RUNNING)), self.counts[Count.STARTED], "i64")

    def emit_first_step(self, time: str) -> None:
        """The length of the step after a start."""
        w = self.w
        interval = w.subtract(w.get(self.end), time)
        length, bounded = self.step.first_step(time, interval, self.max_step)
        self.emit_checkpoint(w.both(bounded, w.compare("oge", w.get(self.end), self.last_end)))
        w.put(length, self.kept[Real.STEP])

    def emit_trial(self, time: str, new_time: str) -> str:
        """Stages of a step to ``new_time``; gives its length."""
        w = self.w
        h = w.subtract(new_time, time)
        w.put(new_time, self.new_time)
        w.put(h, self.h)
        w.put(h, self.kept[Real.TRIED])
        self.step.stages(time, h, new_time)
        return h

    def emit_adaptive_step(self, error: Row) -> None:
        """Try steps until the error is small enough; goes on below once one is."""
        w, step = self.w, self.step
        length = self.kept[Real.STEP]
        time = w.get(self.kept[Real.TIME])
        following = w.from_bits(w.word_op("add", w.bits(time), "1"))
        shortest = w.multiply(number_text(10.0), w.subtract(following, time))
        w.put(w.minimum(w.maximum(w.get(length), shortest), self.max_step), length)
        new_time = w.minimum(w.add(time, w.get(length)), w.get(self.end))
        self.emit_checkpoint(w.compare("oge", new_time, self.last_end))
        step.prepare(time)
        growth = w.variable("double", number_text(GROW))
        attempt, rejected, too_small, accepted = (
            w.fresh(stem) for stem in ("attempt", "rejected", "small", "accepted")
        )
        w.place(attempt)
        h = self.emit_trial(time, w.minimum(w.add(time, w.get(length)), w.get(self.end)))
        norm = step.error_norm(h, error)
        # 1e-30 stands for an exact zero: the factor is at its upper bound long before.
        bounded = w.minimum(w.maximum(norm, number_text(1e-30)), number_text(1e30))
        ideal = w.multiply(number_text(SAFETY), w.inverse_root(bounded, self.tableau.error_order + 1))
        # An infinite new state makes its own error vanish beside it, so it is looked at apart.
        good = w.both(w.compare("olt", norm, number_text(1.0)), step.all_finite(step.y))
        w.branch(good, accepted, rejected)
        w.place(rejected)
        w.increase(self.counts[Count.REJECTED])
        w.put(number_text(1.0), growth)
        # A NaN compares false and takes the strongest reduction; so does an infinite new state.
        measured = w.compare("oge", norm, number_text(1.0))
        shrink = number_text(SHRINK)
        shrunk = w.multiply(h, w.select(measured, w.maximum(ideal, shrink), shrink))
        w.put(shrunk, length)
        w.branch(w.compare("olt", shrunk, shortest), too_small, attempt)
        w.place(too_small)
        finite = w.compare("oeq", w.multiply(norm, number_text(0.0)), number_text(0.0))
        self.emit_not_finite(time, finite, accepted)
        self.leave(Status.STEP_TOO_SMALL)
        w.place(accepted)
        if isinstance(step, ExplicitStep) and step.butcher.measures_stiffness:
            self.emit_stiffness_watch(step)
        if isinstance(step, RosenbrockStep) and step.space.size == self.n:
            self.emit_return_watch(step, h)
        self.emit_crawl_watch(h)
        self.emit_next_length(w.multiply(h, w.minimum(ideal, w.get(growth))))

    def emit_stiffness_watch(self, step: ExplicitStep) -> None:
        """Now and then, see whether stability bounds the step; if it has for long, pause at the next one.

        A step counts as bound where ``h`` times the fastest rate is at the border of the stability region;
        six calm looks in a row clear the count (Hairer, Wanner II, IV.2).
        """
        w = self.w
        watched, stiff, calm = (self.counts[place] for place in (Count.WATCHED, Count.STIFF, Count.CALM))
        look, bound, free, clear, on = (w.fresh(stem) for stem in ("look", "bound", "free", "clear", "on"))
        w.increase(watched)
        turn = w.word_op("and", w.get(watched, "i64"), str(LOOK_EVERY - 1))
        w.branch(w.word_test("eq", turn, "0"), look, on)
        w.place(look)
        border = (NEAR_BORDER * step.butcher.real_stability) ** 2
        w.branch(w.compare("ogt", step.stiffness(), number_text(border)), bound, free)
        w.place(bound)
        w.increase(stiff)
        w.put("0", calm, "i64")
        wanted = w.word_test("ne", w.get(w.at("%counts", Count.WATCHING, "i64"), "i64"), "0")
        long = w.word_test("sge", w.get(stiff, "i64"), str(STIFF_LOOKS))
        enough = w.let(f"select i1 {w.both(wanted, long)}, i64 %max_steps, i64 {w.get(self.taken, 'i64')}")
        w.put(enough, self.taken, "i64")
        w.jump(on)
        w.place(free)
        w.increase(calm)
        w.branch(w.word_test("sge", w.get(calm, "i64"), str(CALM_LOOKS)), clear, on)
        w.place(clear)
        w.put("0", stiff, "i64")
        w.place(on)

    def emit_return_watch(self, step: RosenbrockStep, h: str) -> None:
        """Now and then, see whether an explicit method could take as long steps; pause where it long could.

        With implicit equations the rates are not those of the flow's Jacobian, and nothing returns.
        """
        w = self.w
        watched, wanted, calm = (self.counts[place] for place in (Count.WATCHED, Count.STIFF, Count.CALM))
        look, on = w.fresh("look"), w.fresh("on")
        w.increase(watched)
        turn = w.word_op("and", w.get(watched, "i64"), str(LOOK_EVERY - 1))
        watching = w.get(w.at("%counts", Count.WATCHING, "i64"), "i64")
        due = w.both(w.word_test("ne", watching, "0"), w.word_test("eq", turn, "0"))
        w.branch(due, look, on)
        w.place(look)
        stable = w.compare("olt", w.multiply(h, step.fastest_rate()), number_text(STABLE_BELOW))
        more = w.word_op("add", w.get(calm, "i64"), "1")
        w.put(w.let(f"select i1 {stable}, i64 {more}, i64 0"), calm, "i64")
        long = w.word_test("sge", w.get(calm, "i64"), w.get(wanted, "i64"))
        w.put(w.let(f"select i1 {long}, i64 %max_steps, i64 {w.get(self.taken, 'i64')}"), self.taken, "i64")
        w.jump(on)
        w.place(on)

    def emit_crawl_watch(self, h: str) -> None:
        """Now and then, see whether steps stay short though next to nothing changes in them; end such a run.

        Where equations jump without an event, such as a sign that answers itself, steps shrink until the jump
        is within the tolerance, however good the method is. The same is seen where stability holds an
        explicit method short. Steps that an end or ``max_step`` cuts say nothing.
        """
        w, step, tableau, crawl = self.w, self.step, self.tableau, self.counts[Count.CRAWL]
        look, count, wrong, fine, on = (w.fresh(stem) for stem in ("crawl", "count", "wrong", "fine", "on"))
        turn = w.word_op("and", w.get(self.counts[Count.ACCEPTED], "i64"), str(CRAWL_EVERY - 1))
        w.branch(w.word_test("eq", turn, "0"), look, on)
        w.place(look)
        new_time = w.get(self.new_time)
        free = w.both(w.compare("olt", new_time, w.get(self.end)), w.compare("olt", h, self.max_step))
        w.branch(free, count, on)
        w.place(count)
        # rtol^(2/(q+1) - 1), that is rtol^(-1/(q+1)) to the power q - 1
        root = w.inverse_root(w.get(w.at("%reals", Real.RTOL)), tableau.error_order + 1)
        power = number_text(RESOLVED)
        for _ in range(tableau.error_order - 1):
            power = w.multiply(power, root)
        change = step.norm(h, _change(tableau.end_row))
        if isinstance(tableau, ButcherTableau):
            # A long step may span a whole period, at whose end all is as at its start.
            middle = min(range(1, tableau.stages), key=lambda stage: abs(tableau.nodes[stage] - 0.5))
            change = w.maximum(change, step.norm(h, _change(middle)))
        w.branch(w.compare("olt", change, w.minimum(number_text(CRAWL_CHANGE), power)), wrong, fine)
        w.place(wrong)
        w.increase(crawl)
        far = w.compare("ogt", w.subtract(self.last_end, new_time), w.multiply(number_text(MOST_STEPS), h))
        looks = CRAWL_LOOKS[isinstance(tableau, ButcherTableau)]
        long = w.word_test("sge", w.get(crawl, "i64"), str(looks))
        crawls = w.fresh("crawls")
        w.branch(w.both(far, long), crawls, on)
        w.place(crawls)
        self.leave(Status.CRAWLING)
        w.place(fine)
        less = w.word_op("sub", w.get(crawl, "i64"), str(CRAWL_BACK))
        w.put(w.let(f"select i1 {w.word_test('sgt', less, '0')}, i64 {less}, i64 0"), crawl, "i64")
        w.jump(on)
        w.place(on)

    def emit_next_length(self, proposed: str) -> None:
        """Settle the length of the step after an accepted one."""
        self.w.put(proposed, self.kept[Real.STEP])

    def emit_fixed_step(self) -> None:
        """One step to the next grid instant, which is ``k STEP`` and never a sum, or to the segment's end."""
        w, step = self.w, self.step
        grid = self.counts[Count.GRID]
        time, spacing, end = w.get(self.kept[Real.TIME]), w.get(self.kept[Real.STEP]), w.get(self.end)
        search, following, found = w.fresh("search"), w.fresh("following"), w.fresh("found")
        w.place(search)
        instant = w.multiply(w.let(f"sitofp i64 {w.get(grid, 'i64')} to double"), spacing)
        w.branch(w.compare("ole", instant, self.passed(time, spacing)), following, found)
        w.place(following)
        w.increase(grid)
        w.jump(search)
        w.place(found)
        # An instant a rounding error before the end is the end: no step of 1e-16 s.
        last = w.compare("oge", w.fma(spacing, number_text(1e-9), instant), end)
        new_time = self.bounded(time, w.select(last, end, instant))
        self.emit_checkpoint(w.compare("oge", new_time, self.last_end))
        step.prepare(time)
        self.emit_finite_trial(time, new_time)

    def emit_finite_trial(self, time: str, new_time: str) -> None:
        """A fixed step whose end must be finite."""
        self.emit_trial(time, new_time)
        finite = self.step.all_finite(self.step.y, self.step.K(self.tableau.end_row))
        self.leave_unless(finite, Status.NON_FINITE)

    def emit_not_finite(self, time: str, finite: str, accepted: str) -> None:
        """Steps have become as short as they can be: give up where they are not finite."""
        self.leave_unless(finite, Status.NON_FINITE)

    def passed(self, time: str, spacing: str) -> str:
        """Grid instants up to this time are behind."""
        return time

    def bounded(self, time: str, new_time: str) -> str:
        """The end of a fixed step, where something else than the grid may bound it."""
        return new_time

    def emit_record(self, instant: str, sample: str, row: str) -> None:
        """What else than the state a sample instant records."""

    def emit_samples(self, time: str, until: str, h: str | None) -> None:
        """Record every sample instant not after ``until``: the state itself there, interpolated before.

        Without a step ``h`` there is no before, and the state is x.
        """
        w, step = self.w, self.step
        turn, check, write, on_point, recorded, done = (
            w.fresh(stem) for stem in ("turn", "check", "write", "point", "recorded", "done")
        )
        w.place(turn)
        sample = w.get(self.counts[Count.SAMPLE], "i64")
        w.branch(w.word_test("slt", sample, self.samples), check, done)
        w.place(check)
        instant = w.get(w.at("%samples", sample))
        w.branch(w.compare("ole", instant, until), write, done)
        w.place(write)
        row = w.at("%out", w.word_op("mul", sample, str(self.n)))
        if h is not None:
            inside = w.fresh("inside")
            w.branch(w.compare("olt", instant, until), inside, on_point)
            w.place(inside)
            self.emit_extra_stages_once(time, h)
            step.interpolate(instant, time, h, row)
            w.jump(recorded)
        w.place(on_point)
        state = step.x if h is None else step.y
        w.for_each(self.n, lambda index: w.put(step.read(state, index), w.at(row, index)))
        w.place(recorded)
        self.emit_record(instant, sample, row)
        w.increase(self.counts[Count.SAMPLE])
        w.jump(turn)
        w.place(done)

    def emit_extra_stages_once(self, time: str, h: str) -> None:
        """The stages that only the dense output needs, for the first sample instant inside a step."""
        if not (isinstance(self.tableau, ButcherTableau) and self.tableau.extra_nodes):
            return
        w = self.w
        needed, ready = w.fresh("needed"), w.fresh("ready")
        w.branch(w.word_test("eq", w.get(self.extra_done, "i64"), "0"), needed, ready)
        w.place(needed)
        self.step.extra_stages(time, h)
        w.put("1", self.extra_done, "i64")
        w.place(ready)

    def emit_accepted(self) -> None:
        """Samples of the step, then the new point becomes the old one; at a segment's end, restart."""
        w, step = self.w, self.step
        new_time = w.get(self.new_time)
        w.put("0", self.extra_done, "i64")
        self.emit_samples(w.get(self.kept[Real.TIME]), new_time, w.get(self.h))
        step.copy(step.y, step.x)
        step.copy(step.K(self.tableau.end_row), step.K(0))
        w.put(new_time, self.kept[Real.TIME])
        w.increase(self.counts[Count.ACCEPTED])
        w.put("0", self.counts[Count.FRESH], "i64")
        w.increase(self.taken)
        at_end = w.fresh("end")
        w.branch(w.compare("oge", new_time, w.get(self.end)), at_end, self.on_step)
        w.place(at_end)
        w.increase(self.counts[Count.SEGMENT])
        w.put(str(int(Stage.START)), self.counts[Count.STARTED], "i64")
        w.put("1", self.counts[Count.FRESH], "i64")
        segment = w.get(self.counts[Count.SEGMENT], "i64")
        self.leave_unless(w.word_test("slt", segment, self.segments), Status.DONE)
        w.put(w.get(w.at("%ends", segment)), self.end)
        w.put(w.get(w.at("%clamps", segment)), self.clamp)
        w.jump(self.on_start)


def _change(row: int) -> Row:
    """Weights of K that give what the derivative changed by from the step's start to a row."""
    return (-1.0, *[0.0] * (row - 1), 1.0)
