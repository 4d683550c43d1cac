"""The whole loop of an explicit Runge-Kutta method, written as LLVM IR around one traced derivative.

One call of the native function takes many steps: stages, error estimate, step control, values at the sample
instants and restarts at breakpoints, without returning to Python. All of its state lies in two flat arrays,
so a run can stop after any number of steps and go on with the same bits.

Step control is that of SciPy's ``RK45`` (Hairer, Norsett, Wanner I, II.4): root-mean-square norm of the
error over ``atol + rtol max(|x|, |x_new|)``, safety 0.9, factors 0.2 to 10, no growth right after a
rejection, the same choice of the first step. Step counts can therefore be laid beside SciPy's.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum

from armblocks.compiler.butcher_tableau import ButcherTableau
from armblocks.compiler.ir_routine import Routine
from armblocks.compiler.ir_text import Module
from armblocks.compiler.ir_text import number_text as literal

SAFETY, SHRINK, GROW = 0.9, 0.2, 10.0


class Status(IntEnum):
    """Why the native function returned."""

    DONE = 0
    PAUSED = 1
    """The asked number of steps is taken: call again."""
    STEP_TOO_SMALL = 2
    """The error stays too large however short the step."""
    NON_FINITE = 3
    """A derivative or state became NaN or infinite, however short the step (fixed step: at this step)."""
    NON_FINITE_START = 4
    """The derivative at the start of a segment is NaN or infinite."""


class Real(IntEnum):
    """Places in the array of doubles; after them come x (n), y (n) and K (rows n)."""

    TIME = 0
    STEP = 1
    """Length of the next step; with a fixed step, the spacing of the grid."""
    TRIED = 2
    """Length of the step tried last."""
    RTOL = 3
    ATOL = 4
    MAX_STEP = 5
    END = 6


class Count(IntEnum):
    """Places in the array of integers."""

    SAMPLE = 0
    """The next sample instant to be written."""
    SAMPLES = 1
    SEGMENT = 2
    SEGMENTS = 3
    STARTED = 4
    """Whether the current segment's first derivative is in place."""
    GRID = 5
    """With a fixed step: the next step ends at ``GRID * STEP``."""
    ACCEPTED = 6
    REJECTED = 7
    EVALUATIONS = 8
    END = 9


def workspace_size(tableau: ButcherTableau, states: int) -> int:
    """Doubles that the native function needs."""
    return Real.END + states * (2 + tableau.rows)


def emit_integrator(
    module: Module, tableau: ButcherTableau, states: int, symbol: str, derivative: str
) -> None:
    """Add ``i64 symbol(reals, counts, p, samples, ends, clamps, out, max_steps)`` to a module.

    ``derivative`` names a function ``void (ptr t, ptr x, ptr p, ptr xd)`` of the same module. ``samples``
    are the instants to record and ``out`` their states, ``(N, n)``. ``ends`` are the ends of the segments
    between breakpoints and ``clamps`` the latest time at which each segment may evaluate its derivative.
    The integers and all other pointers are ``int64`` and ``float64``.
    """
    module.define(symbol, lambda: _Loop(module, tableau, states, derivative).emit(symbol))


class _Loop:
    """Writes the loop for one method and one number of states."""

    def __init__(self, module: Module, tableau: ButcherTableau, states: int, derivative: str) -> None:
        self.tableau = tableau
        self.n = states
        self.derivative = derivative
        self.w = Routine(module)
        self.x = Real.END
        self.y = Real.END + states

    # -- pieces ------------------------------------------------------------------------------------------

    def K(self, row: int) -> int:
        """Place of row ``row`` of the stage derivatives."""
        return Real.END + (2 + row) * self.n

    def element(self, place: int, index: str) -> str:
        return self.w.at("%reals", index if place == 0 else self.w.word_op("add", index, str(place)))

    def read(self, place: int, index: str) -> str:
        return self.w.get(self.element(place, index))

    def evaluate(self, time: str, state: int, row: int) -> None:
        """``K[row] = f(min(time, clamp), state)``: before a breakpoint the old value of a jump holds."""
        w = self.w
        time = w.minimum(time, w.get(self.clamp))
        x, xd = w.at("%reals", state), w.at("%reals", self.K(row))
        w.put(time, self.evaluation_time)
        w.do(f"call void @{self.derivative}(ptr {self.evaluation_time}, ptr {x}, ptr %p, ptr {xd})")
        w.increase(self.evaluations)

    def combination(self, weights: tuple[float, ...], index: str) -> str | None:
        """``sum_j weights[j] K[j][index]``, zeros left out; ``None`` where all are zero."""
        total: str | None = None
        for row, weight in enumerate(weights):
            if weight == 0.0:
                continue
            k = self.read(self.K(row), index)
            total = (
                self.w.multiply(literal(weight), k)
                if total is None
                else self.w.fma(literal(weight), k, total)
            )
        return total

    def move(self, weights: tuple[float, ...], h: str) -> None:
        """``y = x + h sum_j weights[j] K[j]``."""

        def body(index: str) -> None:
            slope = self.combination(weights, index)
            x = self.read(self.x, index)
            self.w.put(x if slope is None else self.w.fma(h, slope, x), self.element(self.y, index))

        self.w.for_each(self.n, body)

    def total(self, term: Callable[[str, str], str]) -> str:
        """``sum_i``: ``term(index, sum so far)`` gives the next sum."""
        slot = self.w.variable("double", literal(0.0))
        self.w.for_each(self.n, lambda index: self.w.put(term(index, self.w.get(slot)), slot))
        return self.w.get(slot)

    def mean_square(self, element: Callable[[str], str]) -> str:
        """``sqrt(sum_i element(i)^2 / n)``."""

        def term(index: str, total: str) -> str:
            e = element(index)
            return self.w.fma(e, e, total)

        return self.w.square_root(self.w.divide(self.total(term), literal(float(self.n))))

    def all_finite(self, *places: int) -> str:
        """Whether every element of the vectors is finite: ``0 v`` is NaN for an infinity or a NaN."""

        def term(index: str, total: str) -> str:
            for place in places:
                total = self.w.fma(self.read(place, index), literal(0.0), total)
            return total

        return self.w.compare("oeq", self.total(term), literal(0.0))

    def inverse_root(self, a: str, k: int) -> str:
        """``a^(-1/k)`` for ``a`` in 1e-300 … 1e300, to a few units in the last place.

        A first guess from the divided bits, its excess centred by 0.064, then twice ``y (1 - r)^(-1/k)`` with
        ``r = 1 - a y^k`` (below 0.25, then 1e-3), as its Taylor polynomial of degree 4. All operations are
        exactly rounded: no library's ``pow`` decides a step.
        """
        w = self.w
        one = 1023 << 52
        offset = one + one // k - int(0.064 * (1 << 52))
        y = w.from_bits(w.word_op("sub", str(offset), w.word_op("udiv", w.bits(a), str(k))))
        coefficients = [1.0]
        for m in range(4):
            coefficients.append(coefficients[-1] * (1 / k + m) / (m + 1))
        for _ in range(2):
            power = y
            for _ in range(k - 1):
                power = w.multiply(power, y)
            r = w.subtract(literal(1.0), w.multiply(a, power))
            y = w.multiply(y, w.polynomial(r, coefficients))
        return y

    def scale(self, magnitude: str) -> str:
        return self.w.fma(magnitude, self.rtol, self.atol)

    # -- the function ------------------------------------------------------------------------------------

    def emit(self, symbol: str) -> str:
        w = self.w
        self.load_workspace()
        self.start, self.step, self.finish = w.fresh("start"), w.fresh("step"), w.fresh("finish")
        w.branch(w.word_test("eq", w.get(self.started, "i64"), "0"), self.start, self.step)
        w.place(self.start)
        self.emit_start()
        w.place(self.step)
        paused = w.fresh("paused")
        going = w.fresh("going")
        w.branch(w.word_test("sge", w.get(self.taken, "i64"), "%max_steps"), paused, going)
        w.place(paused)
        self.leave(Status.PAUSED)
        w.place(going)
        if self.tableau.adaptive:
            self.emit_adaptive_step()
        else:
            self.emit_fixed_step()
        self.emit_accepted()
        w.place(self.finish)
        self.store_workspace()
        w.do(f"ret i64 {w.get(self.status, 'i64')}")
        arguments = (
            "ptr noalias %reals, ptr noalias %counts, ptr noalias %p, ptr noalias %samples, ptr noalias %ends"
        )
        return w.text(
            f"define i64 @{symbol}({arguments}, ptr noalias %clamps, ptr noalias %out, i64 %max_steps)"
        )

    def load_workspace(self) -> None:
        w = self.w
        self.time = w.variable("double", w.get(w.at("%reals", Real.TIME)))
        self.length = w.variable("double", w.get(w.at("%reals", Real.STEP)))
        self.tried = w.variable("double", w.get(w.at("%reals", Real.TRIED)))
        self.rtol = w.get(w.at("%reals", Real.RTOL))
        self.atol = w.get(w.at("%reals", Real.ATOL))
        self.max_step = w.get(w.at("%reals", Real.MAX_STEP))
        self.sample, self.segment, self.started, self.grid, self.accepted, self.rejected, self.evaluations = (
            w.variable("i64", w.get(w.at("%counts", place, "i64"), "i64"))
            for place in (
                Count.SAMPLE,
                Count.SEGMENT,
                Count.STARTED,
                Count.GRID,
                Count.ACCEPTED,
                Count.REJECTED,
                Count.EVALUATIONS,
            )
        )
        self.samples = w.get(w.at("%counts", Count.SAMPLES, "i64"), "i64")
        self.segments = w.get(w.at("%counts", Count.SEGMENTS, "i64"), "i64")
        segment = w.get(self.segment, "i64")
        self.end = w.variable("double", w.get(w.at("%ends", segment)))
        self.clamp = w.variable("double", w.get(w.at("%clamps", segment)))
        self.taken = w.variable("i64", "0")
        self.status = w.variable("i64", str(int(Status.DONE)))
        self.evaluation_time = w.variable("double", literal(0.0))
        self.h = w.variable("double", literal(0.0))
        self.new_time = w.variable("double", literal(0.0))

    def store_workspace(self) -> None:
        w = self.w
        for place, slot in ((Real.TIME, self.time), (Real.STEP, self.length), (Real.TRIED, self.tried)):
            w.put(w.get(slot), w.at("%reals", place))
        for place, slot in (
            (Count.SAMPLE, self.sample),
            (Count.SEGMENT, self.segment),
            (Count.STARTED, self.started),
            (Count.GRID, self.grid),
            (Count.ACCEPTED, self.accepted),
            (Count.REJECTED, self.rejected),
            (Count.EVALUATIONS, self.evaluations),
        ):
            w.put(w.get(slot, "i64"), w.at("%counts", place, "i64"), "i64")

    def leave(self, status: Status) -> None:
        self.w.put(str(int(status)), self.status, "i64")
        self.w.jump(self.finish)

    def leave_unless(self, condition: str, status: Status) -> None:
        w = self.w
        failed, on = w.fresh("failed"), w.fresh("on")
        w.branch(condition, on, failed)
        w.place(failed)
        self.leave(status)
        w.place(on)

    def emit_start(self) -> None:
        """First derivative of a segment, the samples at its very start, the first step's length."""
        w = self.w
        time = w.get(self.time)
        self.evaluate(time, self.x, 0)
        self.emit_samples(time, lambda instant: None, exact=self.x)
        self.leave_unless(self.all_finite(self.K(0)), Status.NON_FINITE_START)
        if self.tableau.adaptive:
            self.emit_first_step(time)
        w.put("1", self.started, "i64")

    def emit_first_step(self, time: str) -> None:
        """Length of a segment's first step: Hairer, Norsett, Wanner I, II.4, as SciPy does it."""
        w = self.w
        order = self.tableau.error_order

        def weighted(place: int) -> Callable[[str], str]:
            return lambda i: w.divide(self.read(place, i), self.scale(w.absolute(self.read(self.x, i))))

        def change(i: str) -> str:
            difference = w.subtract(self.read(self.K(1), i), self.read(self.K(0), i))
            return w.divide(difference, self.scale(w.absolute(self.read(self.x, i))))

        interval = w.subtract(w.get(self.end), time)
        d0, d1 = self.mean_square(weighted(self.x)), self.mean_square(weighted(self.K(0)))
        small = w.let(f"or i1 {w.compare('olt', d0, literal(1e-5))}, {w.compare('olt', d1, literal(1e-5))}")
        h0 = w.select(small, literal(1e-6), w.divide(w.multiply(literal(0.01), d0), d1))
        h0 = w.minimum(h0, interval)
        self.move((1.0,), h0)
        self.evaluate(w.add(time, h0), self.y, 1)
        d2 = w.divide(self.mean_square(change), h0)
        steepest = w.maximum(d2, d1)
        flat = w.compare("ole", steepest, literal(1e-15))
        # Kept inside the range of inverse_root; beyond it the other bounds decide anyway.
        bounded = w.maximum(w.minimum(w.multiply(literal(100.0), steepest), literal(1e300)), literal(1e-300))
        h1 = w.select(
            flat,
            w.maximum(w.multiply(h0, literal(1e-3)), literal(1e-6)),
            self.inverse_root(bounded, order + 1),
        )
        h = w.minimum(h1, w.multiply(literal(100.0), h0))
        w.put(w.minimum(w.minimum(h, interval), self.max_step), self.length)

    def emit_stages(self, time: str, h: str) -> None:
        """All stages, the new state into ``y`` and the derivative there into row ``s`` of K."""
        w = self.w
        tableau = self.tableau
        for stage in range(1, tableau.stages):
            self.move(tableau.matrix[stage], h)
            self.evaluate(w.fma(literal(tableau.nodes[stage]), h, time), self.y, stage)
        self.move(tableau.weights, h)
        self.evaluate(w.get(self.new_time), self.y, tableau.stages)

    def emit_adaptive_step(self) -> None:
        """Try steps until the error is small enough; falls through once one is."""
        w = self.w
        time = w.get(self.time)
        bits = w.bits(time)
        following = w.from_bits(w.word_op("add", bits, "1"))
        shortest = w.multiply(literal(10.0), w.subtract(following, time))
        w.put(w.minimum(w.maximum(w.get(self.length), shortest), self.max_step), self.length)
        growth = w.variable("double", literal(GROW))
        w.put(literal(GROW), growth)
        attempt, rejected, again, too_small, accepted = (
            w.fresh(stem) for stem in ("attempt", "rejected", "again", "small", "accepted")
        )
        w.place(attempt)
        end = w.get(self.end)
        w.put(w.minimum(w.add(time, w.get(self.length)), end), self.new_time)
        h = w.subtract(w.get(self.new_time), time)
        w.put(h, self.h)
        w.put(h, self.tried)
        self.emit_stages(time, h)
        norm = self.error_norm(h)
        good = w.compare("olt", norm, literal(1.0))
        good = w.both(good, self.all_finite(self.y))
        # 1e-30 stands for an exact zero: the factor is at its upper bound long before.
        bounded = w.minimum(w.maximum(norm, literal(1e-30)), literal(1e30))
        ideal = w.multiply(literal(SAFETY), self.inverse_root(bounded, self.tableau.error_order + 1))
        w.branch(good, accepted, rejected)
        w.place(rejected)
        w.increase(self.rejected)
        w.put(literal(1.0), growth)
        # A NaN compares false and takes the strongest reduction; so does an infinite new state.
        failing = w.compare("oge", norm, literal(1.0))
        shrunk = w.multiply(h, w.select(failing, w.maximum(ideal, literal(SHRINK)), literal(SHRINK)))
        w.put(shrunk, self.length)
        w.branch(w.compare("olt", shrunk, shortest), too_small, again)
        w.place(too_small)
        self.leave_unless(w.compare("oeq", w.multiply(norm, literal(0.0)), literal(0.0)), Status.NON_FINITE)
        self.leave(Status.STEP_TOO_SMALL)
        w.place(again)
        w.jump(attempt)
        w.place(accepted)
        w.put(w.multiply(h, w.minimum(ideal, w.get(growth))), self.length)

    def error_norm(self, h: str) -> str:
        """Weighted root-mean-square norm of the error estimate of the step in ``y``."""
        w = self.w
        tableau = self.tableau
        assert tableau.error is not None

        def scale(index: str) -> str:
            before, after = w.absolute(self.read(self.x, index)), w.absolute(self.read(self.y, index))
            return self.scale(w.maximum(before, after))

        def weighted(weights: tuple[float, ...], index: str) -> str:
            return w.divide(self.combination(weights, index) or literal(0.0), scale(index))

        error = tableau.error
        if tableau.stretched_error is None:
            return w.multiply(h, self.mean_square(lambda index: weighted(error, index)))
        stretched = tableau.stretched_error

        def square(weights: tuple[float, ...]) -> str:
            def term(index: str, total: str) -> str:
                e = weighted(weights, index)
                return w.fma(e, e, total)

            return self.total(term)

        e5, e3 = square(error), square(stretched)
        denominator = w.square_root(w.multiply(w.fma(literal(0.01), e3, e5), literal(float(self.n))))
        norm = w.divide(w.multiply(h, e5), denominator)
        return w.select(w.compare("oeq", denominator, literal(0.0)), literal(0.0), norm)

    def emit_fixed_step(self) -> None:
        """One step to the next grid instant, which is ``k STEP`` and never a sum, or to the segment's end."""
        w = self.w
        time, step, end = w.get(self.time), w.get(self.length), w.get(self.end)
        search, following, found = w.fresh("search"), w.fresh("following"), w.fresh("found")
        w.place(search)
        instant = w.multiply(w.let(f"sitofp i64 {w.get(self.grid, 'i64')} to double"), step)
        w.branch(w.compare("ole", instant, time), following, found)
        w.place(following)
        w.increase(self.grid)
        w.jump(search)
        w.place(found)
        # An instant a rounding error before the end is the end: no step of 1e-16 s.
        last = w.compare("oge", w.fma(step, literal(1e-9), instant), end)
        w.put(w.select(last, end, instant), self.new_time)
        h = w.subtract(w.get(self.new_time), time)
        w.put(h, self.h)
        w.put(h, self.tried)
        self.emit_stages(time, h)
        self.leave_unless(self.all_finite(self.y, self.K(self.tableau.stages)), Status.NON_FINITE)

    def emit_samples(self, until: str, between: Callable[[str], None], exact: int) -> None:
        """Write every sample instant not after ``until``; at ``until`` itself the state at ``exact``."""
        w = self.w
        turn, check, write, inside, on_point, written, done = (
            w.fresh(stem) for stem in ("turn", "check", "write", "inside", "point", "written", "done")
        )
        w.place(turn)
        sample = w.get(self.sample, "i64")
        w.branch(w.word_test("slt", sample, self.samples), check, done)
        w.place(check)
        instant = w.get(w.at("%samples", sample))
        w.branch(w.compare("ole", instant, until), write, done)
        w.place(write)
        self.row = w.at("%out", w.word_op("mul", sample, str(self.n)))
        w.branch(w.compare("olt", instant, until), inside, on_point)
        w.place(inside)
        between(instant)
        w.jump(written)
        w.place(on_point)
        w.for_each(self.n, lambda index: w.put(self.read(exact, index), w.at(self.row, index)))
        w.place(written)
        w.increase(self.sample)
        w.jump(turn)
        w.place(done)

    def emit_interpolation(self, time: str, h: str, extra_done: str) -> Callable[[str], None]:
        """Writer of one state between ``time`` and ``time + h`` by the method's dense polynomial."""
        w = self.w
        tableau = self.tableau

        def between(instant: str) -> None:
            if tableau.extra_nodes:
                needed, ready = w.fresh("extra"), w.fresh("ready")
                w.branch(w.word_test("eq", w.get(extra_done, "i64"), "0"), needed, ready)
                w.place(needed)
                for k, node in enumerate(tableau.extra_nodes):
                    self.move(tableau.extra_matrix[k], h)
                    self.evaluate(w.fma(literal(node), h, time), self.y, tableau.stages + 1 + k)
                # The extra stages went through y: give it the new state again, by the same operations.
                self.move(tableau.weights, h)
                w.put("1", extra_done, "i64")
                w.place(ready)
            theta = w.divide(w.subtract(instant, time), h)
            values: list[tuple[int, str]] = []
            for row, powers in enumerate(tableau.dense):
                if not any(powers):
                    continue
                values.append((row, w.multiply(w.polynomial(theta, powers), theta)))

            def body(index: str) -> None:
                total = literal(0.0)
                for row, value in values:
                    total = w.fma(value, self.read(self.K(row), index), total)
                w.put(w.fma(h, total, self.read(self.x, index)), w.at(self.row, index))

            w.for_each(self.n, body)

        return between

    def emit_accepted(self) -> None:
        """Samples of the step, then the new point becomes the old one; at a segment's end, restart."""
        w = self.w
        time, h, new_time = w.get(self.time), w.get(self.h), w.get(self.new_time)
        extra_done = w.variable("i64", "0")
        w.put("0", extra_done, "i64")
        self.emit_samples(new_time, self.emit_interpolation(time, h, extra_done), exact=self.y)

        def shift(index: str) -> None:
            w.put(self.read(self.y, index), self.element(self.x, index))
            w.put(self.read(self.K(self.tableau.stages), index), self.element(self.K(0), index))

        w.for_each(self.n, shift)
        w.put(new_time, self.time)
        w.increase(self.accepted)
        w.increase(self.taken)
        at_end, more, complete = w.fresh("end"), w.fresh("more"), w.fresh("complete")
        w.branch(w.compare("oge", new_time, w.get(self.end)), at_end, self.step)
        w.place(at_end)
        w.increase(self.segment)
        w.put("0", self.started, "i64")
        segment = w.get(self.segment, "i64")
        w.branch(w.word_test("slt", segment, self.segments), more, complete)
        w.place(complete)
        self.leave(Status.DONE)
        w.place(more)
        w.put(w.get(w.at("%ends", segment)), self.end)
        w.put(w.get(w.at("%clamps", segment)), self.clamp)
        w.jump(self.start)
