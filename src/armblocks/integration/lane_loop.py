"""The loop of explicit methods over many runs, with a run in each lane of the vector registers.

The runs have different parameters, start values and steps. A lane repeats a rejected step with its next
trial, while the other lanes continue; a lane whose run has ended takes the next run. The operations of a
lane are those of the loop of a single run (:mod:`armblocks.integration.loop`) in the same order, so the
results are bit-identical. Runs that need anything else, such as another method or the error of a failed step,
end with a status other than ``DONE``, and the caller computes them alone.
"""

from __future__ import annotations

from collections.abc import Callable

from armblocks.compiler.ir_text import Module
from armblocks.compiler.lane_function import emit_lane_function
from armblocks.compiler.native import NativeCode, load_code
from armblocks.compiler.program_text import add_program
from armblocks.compiler.tape import Tape
from armblocks.integration.butcher_tableau import ButcherTableau
from armblocks.integration.explicit_method import (
    CHECK_INTERVAL,
    NON_STIFF_CHECKS,
    STIFF_CHECKS,
    ExplicitMethod,
)
from armblocks.integration.frame import SAME_BELOW
from armblocks.integration.lane_frame import LanePlace, LaneWorkspace, Row, Shared, SharedCount, SharedPlace
from armblocks.integration.lane_method import LaneMethod
from armblocks.integration.records import row_width
from armblocks.integration.step_control import (
    GROW,
    MAX_FURTHER_STEPS,
    SAFETY,
    SHORT_CHECK_INTERVAL,
    SHORT_DECREASE,
    SHRINK,
)
from armblocks.integration.workspace import Count, LoopSizes, Scalar, Status, Workspace
from armblocks.routines.arithmetic import (
    fma,
    in_all_lanes,
    inverse_root,
    maximum,
    minimum,
    polynomial,
    select,
)
from armblocks.routines.lanes import IntegerLanes, LaneArray, Lanes, Mask
from armblocks.routines.memory import Addresses, Integers, Reals
from armblocks.routines.routine import Program, Routine, external
from armblocks.routines.values import Boolean, Integer, Real


def lane_code(
    sizes: LoopSizes, digest: str, tape: Callable[[], Tape], tableau: ButcherTableau, lanes: int
) -> NativeCode:
    """The loop of a system without ticks and events, as function ``runs`` of the arguments of
    :func:`define_lane_loop`. ``digest`` and ``tape`` are those of the derivative."""

    def write() -> str:
        module = Module()
        emit_lane_function(module, tape(), "lane_derivative", lanes, reports_undecided=True)
        program = Program(lanes)
        define_lane_loop(program, "runs", tableau, sizes)
        add_program(module, program)
        return module.text

    return load_code(("runs in lanes", tableau.content, repr(sizes), str(lanes), digest), write)


def define_lane_loop(program: Program, symbol: str, tableau: ButcherTableau, sizes: LoopSizes) -> None:
    """Define the loop ``(memory, addresses, first, stop)`` over the runs ``first`` to ``stop - 1``.

    ``memory`` has the rows of :class:`LaneWorkspace`; ``addresses`` is the table of :class:`SharedPlace`.
    """
    assert not sizes.hybrid
    writer = _LaneLoop(program, tableau, sizes)

    def runs(r: Routine, memory: LaneArray, addresses: Addresses, first: Integer, stop: Integer) -> None:
        counts = addresses[SharedPlace.COUNTS].integers
        counts[SharedCount.NEXT_RUN], counts[SharedCount.STOP_RUN] = first, stop
        for lane in r.range(0, program.lanes):
            r.call(writer.take, memory, addresses, lane)
        with r.loop() as iteration:
            starting, running = memory[Row.STARTING] > 0.0, memory[Row.RUNNING] > 0.0
            with r.when(starting.any, rarely=True):
                r.call(writer.start, memory, addresses)
                iteration.again()
            iteration.leave_unless(running.any)
            over = running & (memory[Row.ACCEPTED].bits() >= memory[Row.ALLOWED].bits())
            with r.when(over.any, rarely=True):
                r.call(writer.end_runs, memory, addresses, over.bits(), r.constant_integer(Status.PAUSED))
                iteration.again()
            _Step(r, writer, memory, addresses, running).write()

    program.define(runs, symbol, public=True)


def _start_run(r: Routine, table: Addresses, numbers: Integers, run: Integer, p: Reals) -> Boolean:
    """Write the start values of a run; returns whether they are finite."""
    raise NotImplementedError


def _finish_run(
    r: Routine, table: Addresses, numbers: Integers, run: Integer, p: Reals, status: Integer
) -> None:
    """Write the results of a run."""


class _Lane:
    """The arrays of one lane."""

    def __init__(self, addresses: Addresses, lane: Integer | int) -> None:
        self._addresses = addresses
        self._first = lane * LanePlace.END + int(SharedPlace.END)

    def reals(self, place: LanePlace) -> Reals:
        return self._addresses[self._first + int(place)].reals

    def integers(self, place: LanePlace) -> Integers:
        return self._addresses[self._first + int(place)].integers

    @property
    def table(self) -> Addresses:
        table = self._addresses[self._first + int(LanePlace.TABLE)]
        return Addresses(table.writer, table.operand)


class _LaneLoop:
    """The functions of the loop for single lanes, and for the start of segments."""

    def __init__(self, program: Program, tableau: ButcherTableau, sizes: LoopSizes) -> None:
        self.lanes = program.lanes
        self.tableau = tableau
        self.sizes = sizes
        self.n = sizes.states
        self.workspace = LaneWorkspace(tableau, sizes)
        self.x_of_run = Workspace(tableau, sizes).x
        self.take = program.define(self._take, "take", inlined=False)
        self.finish = program.define(self._finish, "finish", inlined=False)
        self.end_runs = program.define(self._end_runs, "end_runs", inlined=False)
        self.end_segments = program.define(self._end_segments, "end_segments", inlined=False)
        self.write_first = program.define(self._write_first, "write_first", inlined=False)
        self.write_samples = program.define(self._write_samples, "write_samples", inlined=False)
        self.start = program.define(self._start, "start", inlined=False)

    def method(self, r: Routine, memory: LaneArray, addresses: Addresses) -> LaneMethod:
        """The arithmetic of the method in a routine."""
        shared = addresses[SharedPlace.SHARED].reals
        return LaneMethod(r, self.tableau, self.workspace, memory, shared)

    def _lanes_of(self, r: Routine, bits: Integer, action: Callable[[Integer], None]) -> None:
        """Emit an action for each lane whose bit is set."""
        for lane in r.range(0, self.lanes):
            with r.when(((bits >> lane) & 1) != 0):
                action(lane)

    def _take(self, r: Routine, memory: LaneArray, addresses: Addresses, lane: Integer) -> None:
        """Begin the next run in a lane; without further runs, the lane remains idle."""
        here = _Lane(addresses, lane)
        counts, one = addresses[SharedPlace.COUNTS].integers, memory.reals
        start, numbers = addresses[SharedPlace.START], addresses[SharedPlace.NUMBERS].integers

        def put(row: int) -> Integer:
            return lane + row * self.lanes

        one[put(Row.RUNNING)] = 0.0
        one[put(Row.STARTING)] = 0.0
        with r.part() as search:
            run = counts[SharedCount.NEXT_RUN]
            with r.unless(run < counts[SharedCount.STOP_RUN]):
                r.return_()
            counts[SharedCount.NEXT_RUN] = run + 1
            p = addresses[SharedPlace.PARAMETERS].reals.after(run * self.sizes.parameters)
            search.again_unless(r.call(external(_start_run).at(start), here.table, numbers, run, p))
        here.integers(LanePlace.RUN)[0] = run
        reals, ends = here.reals(LanePlace.REALS), here.reals(LanePlace.ENDS)
        for k in r.each(self.n):
            one[put_row(lane, k, self.workspace.x, self.lanes)] = reals.after(self.x_of_run)[k]
        for k in r.each(self.sizes.parameters):
            one[put_row(lane, k, self.workspace.p, self.lanes)] = p[k]
        segments = here.integers(LanePlace.COUNTS)[Count.SEGMENTS]
        one[put(Row.TIME)] = reals[Scalar.TIME]
        one[put(Row.SEGMENT_END)] = ends[0]
        one[put(Row.CLAMP)] = here.reals(LanePlace.CLAMPS)[0]
        one[put(Row.LAST_END)] = ends[segments - 1]
        one[put(Row.NEXT_SAMPLE)] = addresses[SharedPlace.SAMPLES].reals[0]
        one[put(Row.GRID)] = 0.0
        integers = one.integers
        for row in (Row.SAMPLE, Row.ACCEPTED, Row.SHORT_STEPS, Row.STIFF, Row.NON_STIFF):
            integers[put(row)] = 0
        integers[put(Row.ALLOWED)] = counts[SharedCount.MAX_STEPS]
        one[put(Row.STARTING)] = 1.0

    def _finish(
        self, r: Routine, memory: LaneArray, addresses: Addresses, lane: Integer, status: Integer
    ) -> None:
        """Compute the results of a lane's run, and take the next run."""
        here = _Lane(addresses, lane)
        run = here.integers(LanePlace.RUN)[0]
        p = addresses[SharedPlace.PARAMETERS].reals.after(run * self.sizes.parameters)
        here.reals(LanePlace.REALS)[Scalar.TIME] = memory.reals[lane + Row.TIME * self.lanes]
        integers, counts = memory.reals.integers, here.integers(LanePlace.COUNTS)
        counts[Count.ACCEPTED] = integers[lane + Row.ACCEPTED * self.lanes]
        counts[Count.SAMPLE] = integers[lane + Row.SAMPLE * self.lanes]
        function = external(_finish_run).at(addresses[SharedPlace.FINISH])
        r.call(function, here.table, addresses[SharedPlace.NUMBERS].integers, run, p, status)
        r.call(self.take, memory, addresses, lane)

    def _end_runs(
        self, r: Routine, memory: LaneArray, addresses: Addresses, ending: Integer, status: Integer
    ) -> None:
        """End the runs of some lanes, a bit for each, with a status."""
        self._lanes_of(r, ending, lambda lane: r.call(self.finish, memory, addresses, lane, status))

    def _end_segments(self, r: Routine, memory: LaneArray, addresses: Addresses, ended: Integer) -> None:
        """Record the breakpoints of some lanes, and go to their next segments, or end their runs."""

        def end(lane: Integer) -> None:
            here = _Lane(addresses, lane)
            one, counts = memory.reals, here.integers(LanePlace.COUNTS)
            time = one[lane + Row.TIME * self.lanes]
            clamp = one[lane + Row.CLAMP * self.lanes]
            with r.when((counts[Count.JUMPS_RECORDED] != 0) & (clamp < time)):
                samples = addresses[SharedPlace.SAMPLES].reals
                sample = one.integers[lane + Row.SAMPLE * self.lanes]
                first = sample == 0
                recorded = samples[select(first, 0, sample - 1)] > time * SAME_BELOW
                before = select(first | ~recorded, sample, sample - 1)
                width, number = row_width(self.sizes), counts[Count.JUMPS]
                for side, (instant, until) in enumerate(((clamp, before), (time, sample))):
                    row = here.reals(LanePlace.JUMPS).after((number + side) * width)
                    row[0], row[1] = instant, until.to_real()
                    for k in r.each(self.n):
                        row[k + 2] = one[put_row(lane, k, self.workspace.x, self.lanes)]
                counts[Count.JUMPS] = number + 2
            segment = counts[Count.SEGMENT] + 1
            counts[Count.SEGMENT] = segment
            with r.when(segment < counts[Count.SEGMENTS]):
                one[lane + Row.SEGMENT_END * self.lanes] = here.reals(LanePlace.ENDS)[segment]
                one[lane + Row.CLAMP * self.lanes] = here.reals(LanePlace.CLAMPS)[segment]
                one[lane + Row.RUNNING * self.lanes] = 0.0
                one[lane + Row.STARTING * self.lanes] = 1.0
            with r.otherwise():
                r.call(self.finish, memory, addresses, lane, r.constant_integer(Status.DONE))

        self._lanes_of(r, ended, end)

    def _write_samples(self, r: Routine, memory: LaneArray, addresses: Addresses, due: Integer) -> None:
        """Record the samples of an accepted step of some lanes, one lane after the other.

        The numbers of samples differ, so that most lanes would wait for the one with the most samples.
        """
        dense = [(row, powers) for row, powers in enumerate(self.tableau.dense_rows) if any(powers)]

        def write(row: Reals, instant: Real, lane: Integer) -> None:
            def number(first: int, k: Integer | int = 0) -> Real:
                return memory.reals[put_row(lane, k, first, self.lanes)]

            time, until, h = number(Row.TIME), number(Row.NEW_TIME), number(Row.TRIED)
            with r.when(instant < until):
                theta = (instant - time) / h
                weights = [
                    (self.workspace.stage_derivative(k), polynomial(theta, powers) * theta)
                    for k, powers in dense
                ]
                for k in r.each(self.n):
                    total: Real | float = 0.0
                    for derivative, weight in weights:
                        total = fma(weight, number(derivative, k), total)
                    row[k] = fma(h, total, number(self.workspace.x, k))
            with r.otherwise():
                for k in r.each(self.n):
                    row[k] = number(self.workspace.y, k)

        self._samples_until(r, memory, addresses, due, Row.NEW_TIME, write)

    def _write_first(self, r: Routine, memory: LaneArray, addresses: Addresses, due: Integer) -> None:
        """Record the samples at the start of a segment of some lanes."""

        def write(row: Reals, instant: Real, lane: Integer) -> None:
            for k in r.each(self.n):
                row[k] = memory.reals[put_row(lane, k, self.workspace.x, self.lanes)]

        self._samples_until(r, memory, addresses, due, Row.TIME, write)

    def _samples_until(
        self,
        r: Routine,
        memory: LaneArray,
        addresses: Addresses,
        due: Integer,
        until: Row,
        write: Callable[[Reals, Real, Integer], None],
    ) -> None:
        """Emit the loop over all samples of some lanes up to the time in a row. ``write(row, instant, lane)``
        emits the state at the sample."""
        samples, one = addresses[SharedPlace.SAMPLES].reals, memory.reals

        def record(lane: Integer) -> None:
            place = lane + Row.SAMPLE * self.lanes
            states = _Lane(addresses, lane).reals(LanePlace.STATES)
            number = r.integer(one.integers[place])
            with r.loop() as recording:
                sample = number.value
                instant = samples[sample]
                recording.leave_unless(instant <= one[lane + until * self.lanes])
                write(states.after(sample * self.n), instant, lane)
                number.value = sample + 1
            one.integers[place] = number.value
            one[lane + Row.NEXT_SAMPLE * self.lanes] = samples[number.value]

        self._lanes_of(r, due, record)

    def _start(self, r: Routine, memory: LaneArray, addresses: Addresses) -> None:
        """Start the segments of all lanes that wait for it: derivative, samples, length of the first step."""
        method = self.method(r, memory, addresses)
        starting, time = memory[Row.STARTING] > 0.0, memory[Row.TIME]
        method.evaluate(time, method.x, 1)  # a row that every step overwrites
        for i in r.each(self.n):
            method.K(0)[i] = select(starting, method.K(1)[i], method.K(0)[i])
        due = starting & (memory[Row.NEXT_SAMPLE] <= time)
        with r.when(due.any):
            r.call(self.write_first, memory, addresses, due.bits())
        not_finite = (starting & ~method.all_finite(method.K(0))).bits()
        if self.tableau.adaptive:
            length = method.first_step(time, memory[Row.SEGMENT_END] - time)
            length = method.limited_length(length, shortest_step(time))
            memory[Row.LENGTH] = select(starting, length, memory[Row.LENGTH])
            memory[Row.GROWTH] = select(starting, GROW, memory[Row.GROWTH])
        memory[Row.STARTING] = select(starting, 0.0, memory[Row.STARTING])
        memory[Row.RUNNING] = select(starting, 1.0, memory[Row.RUNNING])
        failed = not_finite | method.undecided.value & starting.bits()

        def check(lane: Integer) -> None:
            counts = _Lane(addresses, lane).integers(LanePlace.COUNTS)
            with r.when(((failed >> lane) & 1) != 0):
                r.call(self.finish, memory, addresses, lane, r.constant_integer(Status.NON_FINITE_START))
            with r.otherwise(), r.when(counts[Count.JUMPS] >= counts[Count.JUMPS_CAPACITY]):
                r.call(self.finish, memory, addresses, lane, r.constant_integer(Status.JUMPS_FULL))

        self._lanes_of(r, starting.bits(), check)


class _Step:
    """Emits one trial step in all lanes."""

    def __init__(
        self, r: Routine, loop: _LaneLoop, memory: LaneArray, addresses: Addresses, running: Mask
    ) -> None:
        self.r = r
        self.loop = loop
        self.memory = memory
        self.addresses = addresses
        self.running = running
        self.method = loop.method(r, memory, addresses)
        self.time = memory[Row.TIME]
        self.end = memory[Row.SEGMENT_END]
        self.failed = r.integer(0)
        """The lanes that leave the loop at the end of the trial, a bit for each."""

    def write(self) -> None:
        """Emit the step."""
        if self.method.tableau.adaptive:
            self._adaptive()
        else:
            self._fixed()
        with self.r.when(self.failed.value != 0, rarely=True):
            status = self.r.constant_integer(Status.NON_FINITE)
            self.r.call(self.loop.end_runs, self.memory, self.addresses, self.failed.value, status)

    def _decided(self) -> Mask:
        """Running lanes whose stages are valid; the others fail."""
        undecided = self.method.undecided.value & self.running.bits()
        memory, r, loop = self.memory, self.r, self.loop
        with r.when(undecided != 0, rarely=True):
            self.failed.value = self.failed.value | undecided
            for lane in r.range(0, loop.lanes):
                with r.when(((undecided >> lane) & 1) != 0):
                    memory.reals[lane + Row.RUNNING * loop.lanes] = 0.0
        return memory[Row.RUNNING] > 0.0

    def _adaptive(self) -> None:
        memory, method, time = self.memory, self.method, self.time
        new_time = minimum(time + memory[Row.LENGTH], self.end)
        h = new_time - time
        method.stages(time, h, new_time)
        norm = method.error_norm(h)
        bounded = minimum(maximum(norm, 1e-30), 1e30)
        ideal = SAFETY * inverse_root(bounded, method.tableau.error_order + 1)
        running = self._decided()
        accepted = running & (norm < 1.0) & method.finite_y()
        self._check_stiffness(accepted)
        self._check_short_steps(accepted, new_time, h)
        proposed = h * minimum(ideal, memory[Row.GROWTH])
        shrunk = h * select(norm >= 1.0, maximum(ideal, SHRINK), SHRINK)
        shortest = shortest_step(select(accepted, new_time, time))
        following = method.limited_length(proposed, shortest)
        memory[Row.LENGTH] = select(accepted, following, shrunk)
        memory[Row.GROWTH] = select(accepted, GROW, method.number(1.0))
        rejected = running & ~accepted
        self.failed.value = self.failed.value | (rejected & (shrunk < shortest)).bits()
        self._accept(accepted, new_time, h)

    def _fixed(self) -> None:
        r, memory, method, time = self.r, self.memory, self.method, self.time
        spacing = in_all_lanes(self.addresses[SharedPlace.SHARED].reals[Shared.STEP])
        grid = method.variable(memory[Row.GRID])
        with r.loop() as search:
            behind = self.running & (grid.value * spacing <= time)
            search.leave_unless(behind.any)
            grid.value = select(behind, grid.value + 1.0, grid.value)
        instant = grid.value * spacing
        memory[Row.GRID] = grid.value
        new_time = select(fma(spacing, 1e-9, instant) >= self.end, self.end, instant)
        h = new_time - time
        method.stages(time, h, new_time)
        finite = method.all_finite(method.y, method.K(method.tableau.end_row))
        running = self._decided()
        self.failed.value = self.failed.value | (running & ~finite).bits()
        self._accept(running & finite, new_time, h)

    def _check_stiffness(self, accepted: Mask) -> None:
        """As :meth:`ExplicitMethod.check_stiffness`."""
        r, memory, method = self.r, self.memory, self.method
        if not method.tableau.measures_stiffness:
            return
        steps = memory[Row.ACCEPTED].bits() + 1
        due = accepted & ((steps & (CHECK_INTERVAL - 1)) == 0)
        with r.when(due.any):
            limited = method.is_at_border()
            stiff, non_stiff = memory[Row.STIFF].bits(), memory[Row.NON_STIFF].bits()
            more, calm = stiff + 1, non_stiff + 1
            kept = select(calm >= NON_STIFF_CHECKS, _zero(stiff), stiff)
            new_stiff = select(due, select(limited, more, kept), stiff)
            new_calm = select(due, select(limited, _zero(calm), calm), non_stiff)
            memory[Row.STIFF] = new_stiff.from_bits()
            memory[Row.NON_STIFF] = new_calm.from_bits()
            reached = due & limited & (more >= STIFF_CHECKS)
            detection = self.addresses[SharedPlace.COUNTS].integers[SharedCount.STIFFNESS_DETECTION]
            with r.when(reached.any & (detection != 0), rarely=True):
                memory[Row.ALLOWED] = select(reached, 0.0, memory[Row.ALLOWED])

    def _check_short_steps(self, accepted: Mask, new_time: Lanes, h: Lanes) -> None:
        """As :meth:`armblocks.integration.step_control.Steps._check_short_steps`."""
        r, memory, method = self.r, self.memory, self.method
        due = accepted & ((memory[Row.ACCEPTED].bits() & (SHORT_CHECK_INTERVAL - 1)) == 0)
        due = due & (new_time < self.end) & (h < method.max_step)
        with r.when(due.any):
            small = method.derivative_change(h) < method.short_change()
            count = memory[Row.SHORT_STEPS].bits()
            more, less = count + 1, count - SHORT_DECREASE
            less = select(less < 1, _zero(less), less)
            changed = select(due, select(small, more, less), count)
            memory[Row.SHORT_STEPS] = changed.from_bits()
            far = memory[Row.LAST_END] - new_time > MAX_FURTHER_STEPS * h
            ended = due & small & far & (changed >= ExplicitMethod.short_checks)
            self.failed.value = self.failed.value | ended.bits()

    def _accept(self, accepted: Mask, new_time: Lanes, h: Lanes) -> None:
        """Record the samples of the accepted steps, and make their ends the new points."""
        r, memory, method = self.r, self.memory, self.method
        self._record(accepted, new_time, h)
        for i in r.each(self.loop.n):
            method.x[i] = select(accepted, method.y[i], method.x[i])
            end = method.K(method.tableau.end_row)
            method.K(0)[i] = select(accepted, end[i], method.K(0)[i])
        memory[Row.TIME] = select(accepted, new_time, self.time)
        count = memory[Row.ACCEPTED].bits()
        memory[Row.ACCEPTED] = select(accepted, count + 1, count).from_bits()
        ended = (accepted & (new_time >= self.end)).bits()
        with r.when(ended != 0, rarely=True):
            remaining = ended & (-1 - self.failed.value)
            r.call(self.loop.end_segments, memory, self.addresses, remaining)

    def _record(self, accepted: Mask, new_time: Lanes, h: Lanes) -> None:
        """As :meth:`armblocks.integration.records.Records.samples`."""
        r, memory, method = self.r, self.memory, self.method
        due = accepted & (memory[Row.NEXT_SAMPLE] <= new_time)
        with r.when(due.any):
            if method.tableau.extra_nodes:
                inside = due & (memory[Row.NEXT_SAMPLE] < new_time)
                with r.when(inside.any):
                    method.extra_stages(self.time, h)
                    undecided = method.undecided.value & accepted.bits()
                    self.failed.value = self.failed.value | undecided
            memory[Row.NEW_TIME], memory[Row.TRIED] = new_time, h
            r.call(self.loop.write_samples, memory, self.addresses, due.bits())


def shortest_step(time: Lanes) -> Lanes:
    """The minimum length of adaptive steps."""
    following = (time.bits() + 1).from_bits()
    return 10.0 * (following - time)


def put_row(lane: Integer | int, k: Integer | int, first: int, lanes: int) -> Integer | int:
    """The index of a lane's number in row ``first + k``."""
    return (k + first) * lanes + lane


def _zero(integers: IntegerLanes) -> IntegerLanes:
    return integers & 0
