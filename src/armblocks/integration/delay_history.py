"""Native functions of the delay buffer: store and interpolate the history of delayed signals.

The history is a table at the end of the run's array of doubles. A row has a time, a flag for the middle of a
step, and the value and exact derivative of every delayed signal.

Steps: each step adds two rows, its middle and its end. The quintic Hermite interpolant through three values
and derivatives has the accuracy of the step. A signal may vary faster than the states, for example a square
root or a fast sine of time. The step is then subdivided until the interpolant matches the signal within the
tolerances. Where a derivative is not finite, the derivative of the parabola through the three values replaces
it.

Jumps: where a signal or its derivative jumps, two rows have the same time, the left and the right limit. A
line (one delayed scalar) reads only the rows before the next jump until its delayed time reaches the jump.
Its value is therefore smooth within a step, and the loop ends a step exactly at the jump.
"""

from __future__ import annotations

import sys

from armblocks.integration import system_functions
from armblocks.integration.workspace import Count, LoopSizes, Scalar, Workspace
from armblocks.routines.arithmetic import fma, select
from armblocks.routines.memory import Integers, Reals, RealVariable
from armblocks.routines.routine import Program, Routine
from armblocks.routines.values import Boolean, Integer, Real

SAME_ABOVE = 1.0 + 2.0**-50
"""Two times are the same instant if their ratio is at most this factor."""
MAX_SUBINTERVALS = 256
"""Maximum number of subintervals of one step. The subintervals become shorter toward the singularity of a
square root, down to about 2^-48 of the time, and longer after it."""
ROWS_OF_A_STEP = 2 * MAX_SUBINTERVALS + 6
"""Maximum number of rows that one step adds, including events at its end and the row for comparison."""
NO_DERIVATIVE = sys.float_info.max
"""Marks a derivative that is not finite."""


class DelayHistory:
    """The functions of a program for the delayed signals of a system, and the table that they share.

    All functions take ``reals`` and ``counts``, the arrays of the run. ``t`` and ``x`` are a point at which
    the implicit equations are solved.
    """

    def __init__(self, program: Program, workspace: Workspace, sizes: LoopSizes) -> None:
        self.workspace = workspace
        self.lines = sizes.delays
        self.count = len(sizes.delays)
        self.first = int(Count.END) + len(sizes.clocks)
        self.read = program.define(self._read, "read_history")
        self.write = program.define(self._write, "write_history")
        self.write_change = program.define(self._write_change, "write_change")
        self.deviates = program.define(self._deviates, "deviates")
        self.pass_jumps = program.define(self._pass_jumps, "pass_jumps")
        self.next_jump = program.define(self._next_jump, "next_jump")
        self.ensure_capacity = program.define(self._ensure_capacity, "ensure_capacity")

    # The table.

    def entry(self, row: Integer, column: Integer | int) -> Integer:
        """The index of a table entry in ``reals``."""
        return row * self.workspace.history_width + self.workspace.history + column

    def time(self, reals: Reals, row: Integer) -> Real:
        """The time of a row."""
        return reals[self.entry(row, 0)]

    def middle(self, reals: Reals, row: Integer) -> Real:
        """Whether a row is the middle of a subinterval: 1, else 0."""
        return reals[self.entry(row, 1)]

    def value(self, reals: Reals, row: Integer, line: Integer | int) -> Real:
        """The signal of a line in a row."""
        return reals[self.entry(row, line + 2)]

    def derivative(self, reals: Reals, row: Integer, line: Integer | int) -> Real:
        """The derivative of the signal of a line in a row, with respect to time."""
        return reals[self.entry(row, line + (2 + self.count))]

    def first_rows(self, counts: Integers) -> Integers:
        """The first row that each line reads."""
        return counts.after(self.first)

    def last_rows(self, counts: Integers) -> Integers:
        """The last row that each line reads, where its signal jumps. -1 - n: the line reads up to the newest
        row, and no jump is known to begin before row n."""
        return counts.after(self.first + self.count)

    # Reading.

    def _read(self, r: Routine, t: Reals, x: Reals, reals: Reals, counts: Integers, p: Reals) -> None:
        """The delayed values at a point, into ``z``."""
        workspace = self.workspace
        z, unknowns, taus = (reals.after(place) for place in (workspace.z, workspace.trial_w, workspace.taus))
        if not all(line.fixed for line in self.lines):
            r.call(system_functions.delay_times, t, x, z, unknowns, p, taus)
        time = t[0]
        for k, line in enumerate(self.lines):
            instant = time - taus[k]
            value, derivative = self.at_instant(r, reals, counts, instant, k)
            z[line.value] = value
            z[line.derivative] = derivative

    def at_instant(
        self, r: Routine, reals: Reals, counts: Integers, instant: Real, line: int
    ) -> tuple[Real, Real]:
        """Value and derivative of a line's signal at a past time."""
        first, last = self.first_rows(counts)[line], self.last_rows(counts)[line]
        newest = counts[Count.HISTORY_ROWS] - 1
        # The search does not start at a middle row whose end row does not exist yet.
        newest = newest - self.middle(reals, newest).to_integer()
        last = select(last < 0, newest, last)
        # The last row at or before the time, by bisection; the first row if there is none.
        low, high = r.integer(first), r.integer(last)
        with r.loop() as bisection:
            a, b = low.value, high.value
            bisection.leave_unless(a < b)
            half = b - (b - a) // 2
            with r.when(self.time(reals, half) <= instant):
                low.value = half
            with r.otherwise():
                high.value = half - 1
        value, derivative = r.real(0.0), r.real(0.0)
        i = low.value
        before = instant < self.time(reals, i)
        with r.when(before | (i >= last)):
            # A time after the last row differs from it by rounding only: extrapolate linearly. Before the
            # first readable row the signal has the value of that row, because the signal or its derivative
            # may jump between them.
            excess = select(before, 0.0, instant - self.time(reals, i))
            row_derivative = self.derivative(reals, i, line)
            row_derivative = select(is_derivative(row_derivative), row_derivative, 0.0)
            value.value = fma(row_derivative, excess, self.value(reals, i, line))
            derivative.value = self.derivative(reals, i, line)
        with r.otherwise():
            centre = i + 1 - self.middle(reals, i).to_integer()
            rows = centre - 1, centre, centre + 1
            H = 0.5 * (self.time(reals, rows[2]) - self.time(reals, rows[0]))
            theta = (instant - self.time(reals, centre)) / H
            self.quintic(reals, theta, H, line, rows, value, derivative)
        return value.value, derivative.value

    def quintic(
        self,
        reals: Reals,
        s: Real,
        H: Real,
        line: Integer | int,
        rows: tuple[Integer, Integer, Integer],
        value: RealVariable,
        derivative: RealVariable,
    ) -> None:
        """The quintic Hermite interpolant through values and derivatives at -1, 0, 1, at ``s``; and its
        derivative."""
        minus = -1.0 * s
        square = s * s
        rest = 1.0 - square
        # Differences to the middle value make the result exact for constants.
        centre = self.value(reals, rows[1], line)
        values = [self.value(reals, row, line) - centre for row in rows]
        bases = end_basis(minus, -1.0), middle_basis(s, square, rest), end_basis(s, 1.0)
        total: Real | float = 0.0
        rate: Real | float = 0.0
        for place, (row, u, parts) in enumerate(zip(rows, values, bases)):
            of_value, of_derivative, rate_of_value, rate_of_derivative = parts
            row_derivative = self.derivative(reals, row, line)
            of_parabola = parabola_derivative(values[0], values[2], place)
            du = select(is_derivative(row_derivative), H * row_derivative, of_parabola)
            total = fma(of_value, u, fma(of_derivative, du, total))
            rate = fma(rate_of_value, u, fma(rate_of_derivative, du, rate))
        value.value = centre + total
        derivative.value = rate / H

    # Writing.

    def write_row(
        self, r: Routine, t: Reals, x: Reals, reals: Reals, counts: Integers, p: Reals, middle: Real | float
    ) -> Integer:
        """Write the row after the last row without increasing the number of rows; return its index."""
        rows = counts[Count.HISTORY_ROWS]
        z, unknowns = (reals.after(place) for place in (self.workspace.z, self.workspace.trial_w))
        reals[self.entry(rows, 0)] = t[0]
        reals[self.entry(rows, 1)] = middle
        values, derivatives = (reals.after(self.entry(rows, first)) for first in (2, 2 + self.count))
        r.call(system_functions.delay_inputs, t, x, z, unknowns, p, values, derivatives)
        for k in r.each(self.count):
            derivative = derivatives[k]
            derivatives[k] = select(is_derivative(derivative), derivative, NO_DERIVATIVE)
        return rows

    def _write(
        self, r: Routine, t: Reals, x: Reals, reals: Reals, counts: Integers, p: Reals, middle: Real
    ) -> None:
        """Add a row for a point, which is the ``middle`` of a subinterval (1) or not (0)."""
        self.write_row(r, t, x, reals, counts, p, middle)
        counts[Count.HISTORY_ROWS] = counts[Count.HISTORY_ROWS] + 1

    def _write_change(
        self, r: Routine, t: Reals, x: Reals, reals: Reals, counts: Integers, p: Reals, middle: Real
    ) -> None:
        """Add a row for a point only if it differs from the last row."""
        rows = self.write_row(r, t, x, reals, counts, p, middle)
        before = rows - 1
        same = r.real(1.0)
        for column in r.each(2 * self.count):
            place = column + 2
            old, new = reals[self.entry(before, place)], reals[self.entry(rows, place)]
            same.value = select(old == new, same.value, 0.0)
        with r.when(same.value == 0.0):
            # Left and right limit have exactly the same time.
            reals[self.entry(rows, 0)] = self.time(reals, before)
            counts[Count.HISTORY_ROWS] = counts[Count.HISTORY_ROWS] + 1

    def _deviates(
        self,
        r: Routine,
        t: Reals,
        x: Reals,
        reals: Reals,
        counts: Integers,
        p: Reals,
        s: Real,
        factor: Real,
    ) -> Boolean:
        """Whether the quintic through the last three rows, at ``s`` (-1 to 1), deviates from a signal at the
        point by more than ``factor`` times the tolerances."""
        rows = self.write_row(r, t, x, reals, counts, p, 0.0)
        start, centre, end = (rows - back for back in (3, 2, 1))
        H = 0.5 * (self.time(reals, end) - self.time(reals, start))
        rtol, atol = (reals[place] for place in (Scalar.RTOL, Scalar.ATOL))
        value, derivative = r.real(0.0), r.real(0.0)
        deviates = r.boolean(False)
        for line in r.each(self.count):
            self.quintic(reals, s, H, line, (start, centre, end), value, derivative)
            exact = self.value(reals, rows, line)
            deviation = abs(value.value - exact)
            tolerance = factor * fma(abs(exact), rtol, atol)
            exceeded = deviation > tolerance
            deviates.value = deviates.value | exceeded
        return deviates.value

    # Jumps of signals.

    def _pass_jumps(self, r: Routine, time: Real, reals: Reals, counts: Integers) -> None:
        """Move each line past the jumps that it has reached, and find the next jump."""
        until = time * SAME_ABOVE
        first_rows, last_rows = self.first_rows(counts), self.last_rows(counts)
        for k, line in enumerate(self.lines):
            if not line.fixed:
                continue
            i = r.integer(0)
            with r.part() as search, r.loop():
                last = last_rows[k]
                i.value = select(last < 0, -1 - last, 0)
                with r.when(last >= 0):
                    tau = reals[self.workspace.taus + k]
                    search.leave_unless(self.time(reals, last) + tau <= until)
                    first_rows[k] = last + 1
                    i.value = last + 1
                with r.part() as rows:
                    row = i.value
                    last_rows[k] = -1 - row
                    next_row = row + 1
                    search.leave_unless(next_row < counts[Count.HISTORY_ROWS])
                    i.value = next_row
                    same_time = self.time(reals, row) == self.time(reals, next_row)
                    jumps = self.value(reals, row, k) != self.value(reals, next_row, k)
                    derivative_jumps = self.derivative(reals, row, k) != self.derivative(reals, next_row, k)
                    with r.unless(same_time & (jumps | derivative_jumps)):
                        rows.again()
                last_rows[k] = row

    def _next_jump(self, r: Routine, reals: Reals, counts: Integers) -> Real:
        """The time at which a line reaches its next jump; infinite if none is known."""
        next_arrival = r.constant(float("inf"))
        for k, line in enumerate(self.lines):
            if not line.fixed:
                continue
            last = self.last_rows(counts)[k]
            is_known = last >= 0
            row = select(is_known, last, 0)
            arrival = self.time(reals, row) + reals[self.workspace.taus + k]
            next_arrival = select(is_known & (arrival < next_arrival), arrival, next_arrival)
        return next_arrival

    # Memory.

    def _ensure_capacity(self, r: Routine, time: Real, reals: Reals, counts: Integers) -> Boolean:
        """Drop rows that no line needs; return whether there is memory for another step."""
        workspace = self.workspace
        capacity = counts[Count.HISTORY_CAPACITY]
        needed = counts[Count.HISTORY_ROWS] + ROWS_OF_A_STEP
        with r.when(needed <= capacity):
            r.return_(r.constant_boolean(True))
        oldest = time - reals[workspace.longest]
        # Keep the rows from the last end of a step that is earlier than all readable times.
        first_row, i = r.integer(0), r.integer(0)
        with r.loop() as search:
            row = i.value
            exists = row < counts[Count.HISTORY_ROWS]
            existing_row = select(exists, row, 0)
            old = self.time(reals, existing_row) < oldest
            search.leave_unless(exists & old)
            at_end = self.middle(reals, existing_row) == 0.0
            first_row.value = select(at_end, row, first_row.value)
            i.value = i.value + 1
        dropped_rows = first_row.value
        remaining_rows = counts[Count.HISTORY_ROWS] - dropped_rows
        counts[Count.HISTORY_ROWS] = remaining_rows
        total, shift = remaining_rows * workspace.history_width, dropped_rows * workspace.history_width
        for n in r.range(0, total):
            target = n + workspace.history
            reals[target] = reals[target + shift]
        for k in range(self.count):
            first, last = self.first_rows(counts), self.last_rows(counts)
            shifted, last_row = first[k] - dropped_rows, last[k]
            first[k] = select(shifted >= 0, shifted, 0)
            # A negative last row contains the number of rows in which no jump begins.
            searched = last_row + dropped_rows
            searched = select(searched < 0, searched, -1)
            last[k] = select(last_row >= dropped_rows, last_row - dropped_rows, searched)
        # Also request more memory if less than half is free, so that requests are rare.
        half_is_free = remaining_rows * 2 <= capacity
        fits = remaining_rows + ROWS_OF_A_STEP <= capacity
        return half_is_free & fits


def is_derivative(derivative: Real) -> Boolean:
    """Whether an entry of the table is a finite derivative, and not ``NO_DERIVATIVE``."""
    return abs(derivative) < NO_DERIVATIVE


def parabola_derivative(before: Real, after: Real, place: int) -> Real:
    """Derivative at -1, 0 or 1 (``place`` 0, 1, 2) of the parabola with values at -1 and 1, and 0 at 0."""
    of_before, of_after = ((-1.5, -0.5), (-0.5, 0.5), (0.5, 1.5))[place]
    return fma(of_before, before, of_after * after)


def middle_basis(s: Real, square: Real, rest: Real) -> tuple[Real, Real, Real, Real]:
    """(1 - s^2)^2, s (1 - s^2)^2 and their derivatives."""
    of_value = rest * rest
    rate_of_value = -4.0 * s * rest
    five = fma(-5.0, square, 1.0)
    return of_value, s * of_value, rate_of_value, rest * five


def end_basis(s: Real, side: float) -> tuple[Real, Real, Real, Real]:
    """s^2 (1 + s)^2 (4 - 3 s) / 4, s^2 (1 + s)^2 (s - 1) / 4 and their derivatives; or mirrored."""
    up = 1.0 + s
    common = 0.25 * s * up
    outer = common * (s * up)
    of_value = outer * fma(-3.0, s, 4.0)
    of_derivative = outer * (s - 1.0)
    down = 1.0 - s
    rate_of_value = common * (down * fma(15.0, s, 8.0))
    inner = fma(fma(5.0, s, -1.0), s, -2.0)
    rate_of_derivative = common * inner
    return of_value, side * of_derivative, side * rate_of_value, rate_of_derivative
