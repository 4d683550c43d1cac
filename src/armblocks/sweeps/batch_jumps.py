"""The jumps of a run in the native loop over runs.

The rows of each quantity are equal to the rows of
:meth:`armblocks.simulation.SimulationResult.with_jumps`.
"""

from __future__ import annotations

from armblocks.routines.arithmetic import maximum, minimum, select
from armblocks.routines.memory import Addresses, Integers, Reals
from armblocks.routines.routine import Routine, external
from armblocks.routines.values import Integer, Real
from armblocks.simulation.jumps import MIN_JUMP
from armblocks.sweeps.batch_functions import expressions, signals
from armblocks.sweeps.batch_places import Number, Place, Quantity


def find_jumps(r: Routine, a: Addresses, n: Integers, p: Reals, count: Integer, instants: Integer) -> Integer:
    """Evaluate both sides of all instants, and find the signals that jump; returns the number of instants.

    The criteria are the same as in :class:`armblocks.simulation.jumps.JumpSearch`.
    """
    sides = instants + instants
    _unpack(r, a, n, sides)
    times, y = a[Place.SIDE_TIMES].reals, a[Place.SIDE_VALUES].reals
    x, z, w = (a[k].reals for k in (Place.SIDE_STATES, Place.SIDE_DISCRETE, Place.SIDE_ALGEBRAIC))
    zero = r.constant_integer(0)
    with r.when(n[Number.SIGNALS] > 0):
        r.call(external(signals).at(a[Place.SIGNALS]), zero, sides, sides, times, x, z, w, p, y)
    _set_times(r, a, n, count, instants)
    with r.unless(a[Place.EXPRESSIONS].is_null):
        values = a[Place.SIDE_EXPRESSIONS].reals
        r.call(external(expressions).at(a[Place.EXPRESSIONS]), zero, sides, sides, times, y, values)
    used, jumping = n[Number.USED], a[Place.JUMPING].integers
    finite = jumping.after(used * instants)
    _find_finite(r, y, n[Number.SIGNALS], sides, finite)
    rows, search = a[Place.USED].integers, r.program.define(_find_jumping)
    for u in r.range(0, used):
        row = rows[u]
        samples = a[Place.VALUES].reals.after(row * count)
        r.call(search, a, n, samples, y.after(row * sides), finite, jumping.after(u * instants), instants)
    return instants


def _unpack(r: Routine, a: Addresses, n: Integers, sides: Integer) -> None:
    """Copy the rows of the record of the jumps to arrays of times, states, discrete variables, unknowns."""
    nx, nz, nw = n[Number.STATES], n[Number.DISCRETE], n[Number.ALGEBRAIC]
    width = nx + nz + nw + 2
    rows, times = a[Place.JUMPS].reals, a[Place.SIDE_TIMES].reals
    x, z, w = (a[k].reals for k in (Place.SIDE_STATES, Place.SIDE_DISCRETE, Place.SIDE_ALGEBRAIC))
    for k in r.range(0, sides):
        row = rows.after(k * width)
        times[k] = row[0]
        for j in r.range(0, nx):
            x[k * nx + j] = row[j + 2]
        for j in r.range(0, nz):
            z[k * nz + j] = row[nx + (j + 2)]
        for j in r.range(0, nw):
            w[k * nw + j] = row[nx + nz + (j + 2)]


def _set_times(r: Routine, a: Addresses, n: Integers, count: Integer, instants: Integer) -> None:
    """Write the times of the jumps, for both sides: the time of the sample at an instant, else the time of
    the instant.

    Instants that do not belong to a sample of the run get the time -1.
    """
    width = n[Number.STATES] + n[Number.DISCRETE] + n[Number.ALGEBRAIC] + 2
    rows, samples = a[Place.JUMPS].reals, a[Place.SAMPLES].reals
    times, jumps = a[Place.SIDE_TIMES].reals, a[Place.JUMP_TIMES].reals
    for j in r.range(0, instants):
        left = rows.after((j + j) * width)
        right = left.after(width)
        time, first, last = right[0], left[1].to_integer(), right[1].to_integer()
        jump = r.real(-1.0)
        with r.when((time > 0.0) & (first < count)):
            at_sample = samples[first]
            with r.when(first > 0):
                earliest = (samples[first - 1].bits() + 1).from_bits()
                earliest = select(samples[first - 1] > 0.0, earliest, 5e-324)
                taken = select(last > first, at_sample, time)
                jump.value = minimum(maximum(taken, earliest), at_sample)
        jumps[j] = jump.value
        times[j + j] = jump.value
        times[j + j + 1] = jump.value


def _find_finite(r: Routine, y: Reals, rows: Integer, sides: Integer, finite: Integers) -> None:
    """Mark the instants at which all signals are finite on both sides."""
    for j in r.range(0, sides >> 1):
        total = r.real(0.0)
        for row in r.range(0, rows):
            place = row * sides + (j + j)
            total.value = total.value + (y[place] * 0.0 + y[place + 1] * 0.0)
        finite[j] = (total.value == 0.0).count()


def _find_jumping(
    r: Routine,
    a: Addresses,
    n: Integers,
    samples: Reals,
    sides: Reals,
    finite: Integers,
    jumping: Integers,
    instants: Integer,
) -> None:
    """Mark the instants at which one signal jumps: by more than the fraction ``MIN_JUMP`` of its largest
    absolute value so far."""
    width = n[Number.STATES] + n[Number.DISCRETE] + n[Number.ALGEBRAIC] + 2
    rows, times = a[Place.JUMPS].reals, a[Place.JUMP_TIMES].reals
    largest, seen = r.real(0.0), r.integer(0)
    for j in r.range(0, instants):
        jumping[j] = 0
        with r.when(times[j] > 0.0):
            until = rows[(j + j) * width + 1].to_integer()
            for k in r.range(seen.value, until):
                largest.value = maximum(abs(samples[k]), largest.value)
            seen.value = until
            before, after = sides[j + j], sides[j + j + 1]
            with r.when(finite[j] != 0):
                largest.value = maximum(maximum(abs(before), abs(after)), largest.value)
                change = abs(after - before)
                jumping[j] = ((before != after) & (change > MIN_JUMP * largest.value)).count()


def series_with_jumps(
    r: Routine, a: Addresses, n: Integers, quantity: Integer, count: Integer, instants: Integer
) -> Integer:
    """Write the rows of one quantity, including its jumps; returns the number of rows.

    A jump has two rows: the left limit, then the sample at the same time or, if there is no sample, the value
    after the jump.
    """
    row = a[Place.QUANTITIES].integers.after(quantity * Quantity.END)[Quantity.ROW]
    sides = instants + instants
    main, other = a[Place.VALUES].reals, a[Place.EXPRESSION_VALUES].reals
    values = select(row >= 0, main.after(row * count).start, other.after((-1 - row) * count).start).reals
    main, other = a[Place.SIDE_VALUES].reals, a[Place.SIDE_EXPRESSIONS].reals
    both = select(row >= 0, main.after(row * sides).start, other.after((-1 - row) * sides).start).reals
    samples, times = a[Place.SAMPLES].reals, a[Place.JUMP_TIMES].reals
    series_t, series_y = a[Place.SERIES_TIMES].reals, a[Place.SERIES_VALUES].reals
    written, sample, jump = r.integer(0), r.integer(0), r.integer(0)

    def write(time: Real, value: Real) -> None:
        series_t[written.value] = time
        series_y[written.value] = value
        written.value = written.value + 1

    def write_samples(until: Real) -> None:
        with r.loop() as copying:
            k = sample.value
            copying.leave_unless(k < count)
            copying.leave_unless(samples[k] < until)
            write(samples[k], values[k])
            sample.value = k + 1

    selected = r.program.define(_jumps)
    with r.loop() as merging:
        j = jump.value
        merging.leave_unless(j < instants)
        jump.value = j + 1
        with r.when(r.call(selected, a, quantity, j, instants) != 0):
            time, end = times[j], r.integer(j)
            write_samples(time)
            with r.loop() as lefts:
                e = end.value
                lefts.leave_unless(e < instants)
                lefts.leave_unless(times[e] <= time)
                with r.when(r.call(selected, a, quantity, e, instants) != 0):
                    write(time, both[e + e])
                end.value = e + 1
            k = sample.value
            at_sample = select(k < count, samples[select(k < count, k, 0)], -1.0) == time
            with r.when(at_sample):
                write(time, values[k])
                sample.value = k + 1
            with r.otherwise():
                for e in r.range(j, end.value):
                    with r.when(r.call(selected, a, quantity, e, instants) != 0):
                        write(time, both[e + e + 1])
            jump.value = end.value
    for k in r.range(sample.value, count):
        write(samples[k], values[k])
    return written.value


def _jumps(r: Routine, a: Addresses, quantity: Integer, instant: Integer, instants: Integer) -> Integer:
    """Whether a quantity jumps at an instant: at least one of its signals jumps."""
    table = a[Place.QUANTITIES].integers.after(quantity * Quantity.END)
    indices, jumping = a[Place.QUANTITY_SIGNALS].integers, a[Place.JUMPING].integers
    found = r.integer(0)
    first = table[Quantity.FIRST]
    for k in r.range(first, first + table[Quantity.COUNT]):
        found.value = found.value | jumping[indices[k] * instants + instant]
    return found.value
