"""The measures of a sweep as native functions of one signal.

Each function has the arguments ``t (n,)`` s, ``y (n,)``, ``n``, and ``options (4,)``. The rows are the same
as in :meth:`armblocks.simulation.SimulationResult.with_jumps`: a jump has two rows with the same time, the
left limit and the value. Between two rows the signal is linear, and the integrals are exact.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from armblocks.routines.arithmetic import maximum, minimum, select, square_root
from armblocks.routines.memory import Reals
from armblocks.routines.routine import Program, Routine
from armblocks.routines.values import Boolean, Integer, Real

OPTIONS = 4
"""Number of options of a measure."""


def minimum_value(r: Routine, t: Reals, y: Reals, n: Integer, options: Reals) -> Real:
    """The smallest value."""
    least = r.real(y[0])
    for k in r.range(1, n):
        least.value = minimum(y[k], least.value)
    return least.value


def maximum_value(r: Routine, t: Reals, y: Reals, n: Integer, options: Reals) -> Real:
    """The largest value."""
    largest = r.real(y[0])
    for k in r.range(1, n):
        largest.value = maximum(y[k], largest.value)
    return largest.value


def peak(r: Routine, t: Reals, y: Reals, n: Integer, options: Reals) -> Real:
    """The largest absolute value."""
    largest = r.real(0.0)
    for k in r.range(0, n):
        largest.value = maximum(abs(y[k]), largest.value)
    return largest.value


def final(r: Routine, t: Reals, y: Reals, n: Integer, options: Reals) -> Real:
    """The last value."""
    return y[n - 1]


def _sum_of_intervals(
    r: Routine, t: Reals, y: Reals, n: Integer, term: Callable[[Real, Real, Real, Real], Real]
) -> Real:
    """The sum of ``term(t0, t1, y0, y1)`` over all intervals between rows."""
    total = r.real(0.0)
    for k in r.range(1, n):
        total.value = total.value + term(t[k - 1], t[k], y[k - 1], y[k])
    return total.value


def integral(r: Routine, t: Reals, y: Reals, n: Integer, options: Reals) -> Real:
    """The integral over time."""
    return _sum_of_intervals(r, t, y, n, lambda t0, t1, a, b: (t1 - t0) * (0.5 * (a + b)))


def _square(t0: Real, t1: Real, a: Real, b: Real) -> Real:
    return (t1 - t0) * ((a * a + a * b + b * b) * (1.0 / 3.0))


def ise(r: Routine, t: Reals, y: Reals, n: Integer, options: Reals) -> Real:
    """The integral of the square of the error."""
    reference = options[0]
    return _sum_of_intervals(r, t, y, n, lambda t0, t1, a, b: _square(t0, t1, reference - a, reference - b))


def _absolute(t0: Real, t1: Real, a: Real, b: Real) -> Real:
    """The integral of ``|e|``: two triangles where the sign changes, else a trapezoid."""
    sizes = abs(a) + abs(b)
    triangles = (a * a + b * b) / select(sizes > 0.0, sizes, 1.0)
    return (t1 - t0) * (0.5 * select(a * b < 0.0, triangles, sizes))


def iae(r: Routine, t: Reals, y: Reals, n: Integer, options: Reals) -> Real:
    """The integral of the absolute value of the error."""
    reference = options[0]
    return _sum_of_intervals(r, t, y, n, lambda t0, t1, a, b: _absolute(t0, t1, reference - a, reference - b))


def _weighted(t0: Real, t1: Real, a: Real, b: Real) -> Real:
    """The integral of ``t |e|``; the interval is divided where the sign of the error changes."""

    def piece(begin: Real, end: Real, first: Real, last: Real) -> Real:
        weight = begin * (2.0 * first + last) + end * (first + 2.0 * last)
        return (end - begin) * (weight * (1.0 / 6.0))

    before, after = abs(a), abs(b)
    sizes = before + after
    zero = t0 + (t1 - t0) * (before / select(sizes > 0.0, sizes, 1.0))
    none = before * 0.0
    divided = piece(t0, zero, before, none) + piece(zero, t1, none, after)
    return select(a * b < 0.0, divided, piece(t0, t1, before, after))


def itae(r: Routine, t: Reals, y: Reals, n: Integer, options: Reals) -> Real:
    """The integral of the absolute value of the error times the time."""
    reference = options[0]
    return _sum_of_intervals(r, t, y, n, lambda t0, t1, a, b: _weighted(t0, t1, reference - a, reference - b))


def mean(r: Routine, t: Reals, y: Reals, n: Integer, options: Reals) -> Real:
    """The average over time; the value of a run without duration."""
    total, span = integral(r, t, y, n, options), t[n - 1] - t[0]
    return select(span > 0.0, total / span, y[n - 1])


def rms(r: Routine, t: Reals, y: Reals, n: Integer, options: Reals) -> Real:
    """The root of the average square over time."""
    total, span = _sum_of_intervals(r, t, y, n, _square), t[n - 1] - t[0]
    return select(span > 0.0, square_root(total / span), abs(y[n - 1]))


def _final_value(r: Routine, y: Reals, n: Integer, options: Reals) -> tuple[Real, Boolean]:
    """The final value (by default the last value), and whether this value is finite and not 0."""
    given = options[0]
    value = select(given.ordered, given, y[n - 1])
    return value, value.finite & (value != 0.0)


def _only(r: Routine, valid: Boolean, value: Real) -> Real:
    return select(valid, value, math.nan)


def overshoot(r: Routine, t: Reals, y: Reals, n: Integer, options: Reals) -> Real:
    """The overshoot, per cent of the final value."""
    value, valid = _final_value(r, y, n, options)
    largest = r.real(y[0] / value)
    for k in r.range(1, n):
        largest.value = maximum(y[k] / value, largest.value)
    return _only(r, valid, maximum(100.0 * (largest.value - 1.0), 0.0))


def undershoot(r: Routine, t: Reals, y: Reals, n: Integer, options: Reals) -> Real:
    """The largest deviation from 0 with the opposite sign of the final value, per cent of the final value."""
    value, valid = _final_value(r, y, n, options)
    least = r.real(y[0] / value)
    for k in r.range(1, n):
        least.value = minimum(y[k] / value, least.value)
    return _only(r, valid, maximum(-100.0 * least.value, 0.0))


def _first_above(r: Routine, t: Reals, y: Reals, n: Integer, value: Real, level: float) -> Real:
    """The first time at which ``y / value`` reaches a level; NaN if there is none."""
    found, previous = r.real(math.nan), r.real(0.0)
    with r.part() as search:
        for k in r.range(0, n):
            fraction = y[k] / value
            with r.when(fraction >= level):
                before, at = previous.value, t[k]
                found.value = at
                with r.when(k > 0):
                    share = (level - before) / (fraction - before)
                    found.value = t[k - 1] + share * (at - t[k - 1])
                search.leave()
            previous.value = fraction
    return found.value


def rise_time(r: Routine, t: Reals, y: Reals, n: Integer, options: Reals) -> Real:
    """The time from 10 to 90 per cent of the final value, s."""
    value, valid = _final_value(r, y, n, options)
    begin, end = (_first_above(r, t, y, n, value, level) for level in (0.1, 0.9))
    return _only(r, valid, end - begin)


def settling_time(r: Routine, t: Reals, y: Reals, n: Integer, options: Reals) -> Real:
    """The time after which the signal stays within a band around the final value, s."""
    value, valid = _final_value(r, y, n, options)
    band = options[1]
    outside = r.integer(-1)
    for k in r.range(0, n):
        with r.when(abs(y[k] / value - 1.0) > band):
            outside.value = k
    k, settled = outside.value, r.real(0.0)
    with r.when(k >= 0):
        settled.value = math.nan
        with r.when(k < n - 1):
            off, on = abs(y[k] / value - 1.0), abs(y[k + 1] / value - 1.0)
            settled.value = t[k] + (off - band) / (off - on) * (t[k + 1] - t[k])
    return _only(r, valid, settled.value)


def crossing_time(r: Routine, t: Reals, y: Reals, n: Integer, options: Reals) -> Real:
    """The first time at which the signal crosses a level, s; NaN if there is none.

    Option 1: 1 for crossings from below, -1 for crossings from above, 0 for both.
    """
    level, direction = options[0], options[1]
    found = r.real(math.nan)
    with r.part() as search:
        with r.when((y[0] == level) & (direction == 0.0)):
            found.value = t[0]
            search.leave()
        for k in r.range(1, n):
            a, b = y[k - 1], y[k]
            rising = (a < level) & (b >= level) & (direction >= 0.0)
            falling = (a > level) & (b <= level) & (direction <= 0.0)
            with r.when(rising | falling):
                found.value = t[k - 1] + (level - a) / (b - a) * (t[k] - t[k - 1])
                search.leave()
    return found.value


def _share_above(a: Real, b: Real, level: Real) -> Real:
    """The share of an interval in which the line from ``a`` to ``b`` is above a level."""
    top, least = maximum(a, b), minimum(a, b)
    inside = (top - level) / select(top > least, top - least, 1.0)
    return select(top <= level, 0.0, select(least >= level, 1.0, inside))


def time_outside(r: Routine, t: Reals, y: Reals, n: Integer, options: Reals) -> Real:
    """The total time outside of two limits, s."""
    low, high = options[0], options[1]

    def term(t0: Real, t1: Real, a: Real, b: Real) -> Real:
        return (t1 - t0) * (_share_above(a, b, high) + _share_above(-a, -b, -low))

    return _sum_of_intervals(r, t, y, n, term)


ROUTINES: Mapping[str, Callable[..., Real]] = {
    "minimum": minimum_value,
    "maximum": maximum_value,
    **{
        function.__name__: function
        for function in (
            *(peak, final, integral, ise, iae, itae, mean, rms, overshoot, undershoot),
            *(rise_time, settling_time, crossing_time, time_outside),
        )
    },
}
"""The function of each kind of measure."""


def define_measures(program: Program) -> None:
    """Add all measures to a program."""
    for kind, function in ROUTINES.items():
        program.define(function, f"measure.{kind}", public=True)
