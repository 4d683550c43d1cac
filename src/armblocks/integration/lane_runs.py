"""Begin and end of runs and segments, and recorded samples, of the loop with a run in each lane.

These are the rare actions of single lanes; :mod:`armblocks.integration.lane_step` has the steps of all lanes.
"""

from __future__ import annotations

from collections.abc import Callable

from armblocks.integration.butcher_tableau import ButcherTableau
from armblocks.integration.frame import SAME_BELOW
from armblocks.integration.lane_frame import LanePlace, LaneWorkspace, Row, SharedCount, SharedPlace
from armblocks.integration.lane_method import LaneMethod, shortest_step
from armblocks.integration.records import row_width
from armblocks.integration.step_control import GROW
from armblocks.integration.step_sums import Index, interpolate
from armblocks.integration.workspace import Count, LoopSizes, Scalar, Status, Workspace
from armblocks.routines.arithmetic import select
from armblocks.routines.lanes import LaneArray
from armblocks.routines.memory import Addresses, Integers, Reals
from armblocks.routines.routine import Program, Routine, external
from armblocks.routines.values import Boolean, Integer, Real


def _start_run(r: Routine, table: Addresses, numbers: Integers, run: Integer, p: Reals) -> Boolean:
    """Write the start values of a run; returns whether they are finite."""
    raise NotImplementedError


def _finish_run(
    r: Routine, table: Addresses, numbers: Integers, run: Integer, p: Reals, status: Integer
) -> None:
    """Write the results of a run."""


class Lane:
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


class LaneFunctions:
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
        here = Lane(addresses, lane)
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
        here = Lane(addresses, lane)
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
            here = Lane(addresses, lane)
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

        def write(row: Reals, instant: Real, lane: Integer) -> None:
            def number(first: int, k: Index = 0) -> Real:
                return memory.reals[put_row(lane, k, first, self.lanes)]

            def derivative(stage: int, k: Index) -> Real:
                return number(self.workspace.stage_derivative(stage), k)

            time, until, h = number(Row.TIME), number(Row.NEW_TIME), number(Row.TRIED)
            with r.when(instant < until):
                theta, rows = (instant - time) / h, self.tableau.dense_rows
                interpolate(r, self.n, rows, theta, h, lambda k: number(self.workspace.x, k), derivative, row)
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
            states = Lane(addresses, lane).reals(LanePlace.STATES)
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
        not_finite = (starting & ~method.sums.all_finite(method.K(0))).bits()
        if self.tableau.adaptive:
            length = method.first_step(time, memory[Row.SEGMENT_END] - time)
            length = method.limited_length(length, shortest_step(time))
            memory[Row.LENGTH] = select(starting, length, memory[Row.LENGTH])
            memory[Row.GROWTH] = select(starting, GROW, memory[Row.GROWTH])
        memory[Row.STARTING] = select(starting, 0.0, memory[Row.STARTING])
        memory[Row.RUNNING] = select(starting, 1.0, memory[Row.RUNNING])
        failed = not_finite | method.unsupported.value & starting.bits()

        def check(lane: Integer) -> None:
            counts = Lane(addresses, lane).integers(LanePlace.COUNTS)
            with r.when(((failed >> lane) & 1) != 0):
                r.call(self.finish, memory, addresses, lane, r.constant_integer(Status.NON_FINITE_START))
            with r.otherwise(), r.when(counts[Count.JUMPS] >= counts[Count.JUMPS_CAPACITY]):
                r.call(self.finish, memory, addresses, lane, r.constant_integer(Status.JUMPS_FULL))

        self._lanes_of(r, starting.bits(), check)


def put_row(lane: Index, k: Index, first: int, lanes: int) -> Index:
    """The index of a lane's number in row ``first + k``."""
    return (k + first) * lanes + lane
