"""The native loop over the runs of a batch: start values, run, signals, jumps, measures.

One call computes many runs without Python, so that threads compute in parallel. A run that the loop cannot
complete gets the outcome ``OTHER``; ``RunProgram.run_alone`` then repeats the run.
"""

from __future__ import annotations

from functools import cache

from armblocks.compiler.ir_text import Module
from armblocks.compiler.native import NativeCode, load_code
from armblocks.integration.frame import SAME_ABOVE, SAME_BELOW
from armblocks.integration.workspace import Count, Scalar, Status
from armblocks.routines.arithmetic import maximum, select
from armblocks.routines.llvm import definitions
from armblocks.routines.memory import Addresses, Integers, Reals
from armblocks.routines.routine import Program, Routine, external
from armblocks.routines.values import Boolean, Integer, Real
from armblocks.sweeps.batch_functions import all_finite, expressions, signals
from armblocks.sweeps.batch_jumps import find_jumps, series_with_jumps
from armblocks.sweeps.batch_places import Number, Outcome, Place, Quantity, Report
from armblocks.sweeps.measure_routines import OPTIONS, define_measures


def _of_parameters(r: Routine, p: Reals, result: Reals) -> None:
    """A function of the parameters."""


def _advance(
    r: Routine,
    reals: Reals,
    counts: Integers,
    p: Reals,
    samples: Reals,
    ends: Reals,
    clamps: Reals,
    x: Reals,
    z: Reals,
    w: Reals,
    jumps: Reals,
    saved_reals: Reals,
    saved_counts: Integers,
    scratch: Reals,
    max_steps: Integer,
) -> Integer:
    """The loop of a run."""
    raise NotImplementedError


def _measure(r: Routine, t: Reals, y: Reals, n: Integer, options: Reals) -> Real:
    """A measure."""
    raise NotImplementedError


def set_segments(r: Routine, times: Reals, count: Integer, ends: Reals, clamps: Reals, stop: Real) -> Integer:
    """Sort the breakpoints, and write the ends of the segments as
    :func:`armblocks.integration.breakpoints.ends_of_segments`; returns their number."""
    inside = r.integer(0)
    for k in r.range(0, count):
        time = times[k]
        with r.when((time > 0.0) & (time <= stop * SAME_ABOVE)):
            place = r.integer(inside.value)
            with r.loop() as moving:
                j = place.value
                moving.leave_unless(j > 0)
                moving.leave_unless(times[j - 1] > time)
                times[j] = times[j - 1]
                place.value = j - 1
            times[place.value] = time
            inside.value = inside.value + 1
    last, segments = r.real(0.0), r.integer(0)
    for k in r.range(0, inside.value):
        time, number = times[k], segments.value
        with r.when((number > 0) & (last.value > time * SAME_BELOW)):
            ends[number - 1] = time
        with r.otherwise():
            last.value = time
            ends[number] = time
            clamps[number] = (time.bits() - 1).from_bits()
            segments.value = number + 1
    number = segments.value
    with r.when((number > 0) & (last.value > stop * SAME_BELOW)):
        ends[number - 1] = maximum(ends[number - 1], stop)
    with r.otherwise():
        ends[number] = stop
        clamps[number] = stop
        segments.value = number + 1
    return segments.value


def set_instants(
    r: Routine, samples: Reals, count: Integer, ends: Reals, segments: Integer, instants: Reals
) -> None:
    """Write the times at which the signals of samples are evaluated, as
    :func:`armblocks.integration.breakpoints.evaluation_times` for a run from 0."""
    later = r.integer(0)  # the index of the first of the instants 0, ends … after the sample
    for k in r.range(0, count):
        sample = samples[k]
        with r.loop() as searching:
            place = later.value
            searching.leave_unless(place < segments)
            time = select(place > 0, ends[select(place > 0, place - 1, 0)], 0.0)
            searching.leave_unless(time <= sample)
            later.value = place + 1
        place = later.value
        after = select(place > 0, ends[select(place > 0, place - 1, 0)], 0.0)
        before = select(place > 1, ends[select(place > 1, place - 2, 0)], 0.0)
        recorded = (before <= sample) & (sample <= before * SAME_ABOVE)
        same = (sample > after * SAME_BELOW) & (sample < after) & ~recorded
        instants[k] = select(same, after, sample)


def _start(r: Routine, a: Addresses, n: Integers, run: Integer, p: Reals) -> Boolean:
    """Set a run to its start; returns whether all initial values are finite."""
    reals, counts = a[Place.REALS].reals, a[Place.COUNTS].integers
    r.copy(a[Place.FIRST_REALS].reals, reals, n[Number.REALS])
    r.copy(a[Place.FIRST_COUNTS].integers, counts, n[Number.COUNTS])
    with r.when(n[Number.STOPS] > 0):  # a block that ends the run adds a sample at the stop time
        r.copy(a[Place.FIRST_SAMPLES].reals, a[Place.SAMPLES].reals, n[Number.SAMPLES])
    function = external(_of_parameters)
    x, z = reals.after(n[Number.X]), reals.after(n[Number.Z])
    nx, nz, nw = n[Number.STATES], n[Number.DISCRETE], n[Number.ALGEBRAIC]
    with r.when(nx > 0):
        r.call(function.at(a[Place.INITIAL_STATES]), p, x)
    with r.when(nz > 0):
        r.call(function.at(a[Place.INITIAL_DISCRETE]), p, z)
    with r.when(nw > 0):
        r.copy(a[Place.GUESSES].reals.after(run * nw), reals.after(n[Number.W]), nw)
    history, delayed = reals.after(n[Number.HISTORY] + 2), a[Place.DELAYED].integers
    for k in r.range(0, n[Number.DELAYS]):
        history[k] = z[delayed[k]]
    times = a[Place.BREAKPOINT_TIMES].reals
    count = n[Number.BREAKPOINTS]
    with r.when(count > 0):
        r.call(function.at(a[Place.BREAKPOINTS]), p, times)
    stop = a[Place.FIRST_SAMPLES].reals[n[Number.SAMPLES] - 1]
    segments = r.call(
        r.program.define(set_segments), times, count, a[Place.ENDS].reals, a[Place.CLAMPS].reals, stop
    )
    counts[Count.SEGMENTS] = segments
    finite = r.program.define(all_finite)
    return r.call(finite, x, nx) & r.call(finite, z, nz)


def _sample(r: Routine, a: Addresses, n: Integers) -> None:
    """A run without states and ticks: all samples, and both sides of the breakpoints as jumps."""
    reals, counts, samples = a[Place.REALS].reals, a[Place.COUNTS].integers, a[Place.SAMPLES].reals
    ends, clamps, rows = a[Place.ENDS].reals, a[Place.CLAMPS].reals, a[Place.JUMPS].reals
    count = n[Number.SAMPLES]
    reals[Scalar.TIME] = samples[count - 1]
    counts[Count.SAMPLE] = count
    with r.unless(n[Number.SIDES] > 0):
        r.return_()
    written = r.integer(0)
    before, after = r.integer(0), r.integer(0)  # numbers of samples before and after a breakpoint
    for k in r.range(0, counts[Count.SEGMENTS]):
        end = ends[k]
        for number, bound in ((before, end * SAME_BELOW), (after, end * SAME_ABOVE)):
            with r.loop() as passing:
                passing.leave_unless(number.value < count)
                passing.leave_unless(samples[number.value] <= bound)
                number.value = number.value + 1
        with r.when(clamps[k] < end):
            row = rows.after(written.value * 2)
            row[0], row[1] = clamps[k], before.value.to_real()
            row[2], row[3] = end, after.value.to_real()
            written.value = written.value + 2
    counts[Count.JUMPS] = written.value


def _integrate(r: Routine, a: Addresses, n: Integers, p: Reals) -> Integer:
    """Run to the end; returns the status of the loop."""
    return r.call(
        external(_advance).at(a[Place.ADVANCE]),
        reals=a[Place.REALS].reals,
        counts=a[Place.COUNTS].integers,
        p=p,
        samples=a[Place.SAMPLES].reals,
        ends=a[Place.ENDS].reals,
        clamps=a[Place.CLAMPS].reals,
        x=a[Place.STATES].reals,
        z=a[Place.DISCRETE].reals,
        w=a[Place.ALGEBRAIC].reals,
        jumps=a[Place.JUMPS].reals,
        saved_reals=a[Place.SAVED_REALS].reals,
        saved_counts=a[Place.SAVED_COUNTS].integers,
        scratch=a[Place.SCRATCH].reals,
        max_steps=n[Number.MAX_STEPS],
    )


def _evaluate(r: Routine, a: Addresses, n: Integers, p: Reals, count: Integer) -> Boolean:
    """Evaluate all signals and expressions; returns whether all signals are finite."""
    samples, instants, y = (a[k].reals for k in (Place.SAMPLES, Place.INSTANTS, Place.VALUES))
    segments = a[Place.COUNTS].integers[Count.SEGMENTS]
    r.call(r.program.define(set_instants), samples, count, a[Place.ENDS].reals, segments, instants)
    x, z, w = (a[k].reals for k in (Place.STATES, Place.DISCRETE, Place.ALGEBRAIC))
    zero = r.constant_integer(0)
    with r.when(n[Number.SIGNALS] > 0):
        r.call(external(signals).at(a[Place.SIGNALS]), zero, count, count, instants, x, z, w, p, y)
    with r.unless(a[Place.EXPRESSIONS].is_null):
        values = a[Place.EXPRESSION_VALUES].reals
        r.call(external(expressions).at(a[Place.EXPRESSIONS]), zero, count, count, samples, y, values)
    finite = r.program.define(all_finite)
    unknowns = r.call(finite, w, count * n[Number.ALGEBRAIC])
    return r.call(finite, y, count * n[Number.SIGNALS]) & unknowns


def _write_measures(
    r: Routine, a: Addresses, n: Integers, run: Integer, count: Integer, jumps: Integer
) -> None:
    """Compute all measures of a run, and copy the kept samples."""
    table, samples = a[Place.QUANTITIES].integers, a[Place.SAMPLES].reals
    y, e = a[Place.VALUES].reals, a[Place.EXPRESSION_VALUES].reals
    measures, quantities = n[Number.MEASURES], a[Place.MEASURE_QUANTITIES].integers
    results = a[Place.RESULTS].reals.after(run * measures)
    functions, options = a[Place.MEASURES].integers, a[Place.MEASURE_OPTIONS].reals
    with_jumps = r.program.define(series_with_jumps)
    for q in r.range(0, n[Number.QUANTITIES]):
        row = table[q * Quantity.END + Quantity.ROW]
        of_signals, of_expressions = y.after(row * count).start, e.after((-1 - row) * count).start
        values = r.address(select(row >= 0, of_signals, of_expressions))
        times, length = r.address(samples.start), r.integer(count)
        with r.when(jumps > 0):
            total = r.call(with_jumps, a, n, q, count, jumps)
            with r.when(total > count):
                length.value = total
                times.value = a[Place.SERIES_TIMES]
                values.value = a[Place.SERIES_VALUES]
        for m in r.range(0, measures):
            with r.when((quantities[m] == q) & (functions[m] != 0)):
                address = Addresses(r, a[Place.MEASURES].operand)[m]
                function = external(_measure).at(address)
                results[m] = r.call(
                    function, times.value.reals, values.value.reals, length.value, options.after(m * OPTIONS)
                )
    for m in r.range(0, measures):
        with r.when(functions[m] == 0):
            results[m] = a[Place.COUNTS].integers[Count.EVENTS].to_real()
    _write_kept(r, a, n, run, count)


def _write_kept(r: Routine, a: Addresses, n: Integers, run: Integer, count: Integer) -> None:
    """Copy the kept samples of a run. Entries after the end of the run are not changed."""
    samples, kept, table = n[Number.SAMPLES], a[Place.KEPT].integers, a[Place.QUANTITIES].integers
    y, e = a[Place.VALUES].reals, a[Place.EXPRESSION_VALUES].reals
    for k in r.range(0, n[Number.KEPT]):
        row = table[kept[k] * Quantity.END + Quantity.ROW]
        of_signals, of_expressions = y.after(row * count).start, e.after((-1 - row) * count).start
        source = select(row >= 0, of_signals, of_expressions).reals
        target = a[Place.KEPT_VALUES].reals.after((run * n[Number.KEPT] + k) * samples)
        r.copy(source, target, count)


def _run(r: Routine, a: Addresses, n: Integers, run: Integer) -> None:
    """Compute one run, and write its row of results."""
    p = a[Place.PARAMETERS].reals.after(run * n[Number.PARAMETERS])
    report = a[Place.REPORTS].integers.after(run * Report.END)
    report[Report.STATUS] = Outcome.OTHER
    with r.unless(r.call(r.program.define(_start), a, n, run, p)):
        r.return_()
    outcome = r.integer(Status.DONE)
    with r.when(a[Place.ADVANCE].is_null):
        r.call(r.program.define(_sample), a, n)
    with r.otherwise():
        outcome.value = _integrate(r, a, n, p)
    r.call(r.program.define(_finish), a, n, run, p, outcome.value)


def _finish(r: Routine, a: Addresses, n: Integers, run: Integer, p: Reals, status: Integer) -> None:
    """Write the results of a run that has ended with a status of the loop."""
    report, counts = a[Place.REPORTS].integers.after(run * Report.END), a[Place.COUNTS].integers
    reals = a[Place.REALS].reals
    a[Place.END_TIMES].reals[run] = reals[Scalar.TIME]
    report[Report.STEPS], report[Report.EVENTS] = counts[Count.ACCEPTED], counts[Count.EVENTS]
    report[Report.GUARD] = status
    with r.when(status == Status.PAUSED):
        report[Report.STATUS] = Outcome.LIMIT
    with r.unless((status == Status.DONE) | (status == Status.STOPPED)):
        r.return_()
    count, sides = counts[Count.SAMPLE], counts[Count.JUMPS]
    report[Report.SAMPLES] = count
    with r.unless(r.call(r.program.define(_evaluate), a, n, p, count)):
        r.return_()
    jumps = r.integer(0)
    with r.when(sides > 1):
        jumps.value = r.call(r.program.define(find_jumps), a, n, p, count, sides >> 1)
    r.call(r.program.define(_write_measures), a, n, run, count, jumps.value)
    report[Report.STATUS] = Outcome.COMPLETED
    with r.when(status == Status.STOPPED):
        report[Report.STATUS] = Outcome.STOPPED
        guards, signs = a[Place.STOPS].integers, reals.after(n[Number.SIGNS])
        with r.part() as search:
            for k in r.range(0, n[Number.STOPS]):
                guard = guards[k]
                with r.when(signs[guard] > 0.0):
                    report[Report.GUARD] = guard
                    search.leave()


def _runs(r: Routine, a: Addresses, n: Integers, first: Integer, stop: Integer) -> None:
    """Compute the runs ``first`` to ``stop - 1`` of a batch."""
    one = r.program.define(_run)
    for run in r.range(first, stop):
        r.call(one, a, n, run)


@cache
def batch_code() -> NativeCode:
    """The functions ``runs``, ``run.start``, ``run.finish`` and ``measure.*``; every model uses the same
    code."""
    program = Program()
    program.define(_runs, "runs", public=True)
    program.define(_start, "run.start", public=True)
    program.define(_finish, "run.finish", public=True)
    define_measures(program)
    parts = definitions(program)

    def write() -> str:
        module = Module()
        for symbol, text in parts.items():
            module.add(symbol, text)
        return module.text

    return load_code(("sweep", *parts.values()), write)
