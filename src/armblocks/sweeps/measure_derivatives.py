"""Derivatives of the measures of a run with respect to parameters.

The measures are functions of rows ``t (R,)`` s and ``y (R,)``, as in ``measure_routines``. The derivatives
follow from those of the rows by the rules of differentiation (forward mode). Only the rows at jumps have
times that depend on parameters.

A largest value has the derivative of the row at which it occurs. If it occurs at several rows, the largest
value has different derivatives to both sides; :func:`largest_of_parts` has the largest value of each part of
the run, which a solver can treat as separate functions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Dual:
    """Values ``v`` of any shape and their derivatives ``d (*shape, n)`` with respect to n parameters."""

    v: Array
    d: Array

    def __add__(self, other: Dual | float) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.v + other.v, self.d + other.d)
        return Dual(self.v + other, self.d)

    def __neg__(self) -> Dual:
        return Dual(-self.v, -self.d)

    def __sub__(self, other: Dual | float) -> Dual:
        return self + (-other)

    def __mul__(self, other: Dual | float) -> Dual:
        if isinstance(other, Dual):
            return Dual(
                self.v * other.v, self.d * other.v[..., np.newaxis] + other.d * self.v[..., np.newaxis]
            )
        return Dual(self.v * other, self.d * other)

    def __truediv__(self, other: Dual | float) -> Dual:
        if not isinstance(other, Dual):
            return self * (1.0 / other)
        value = self.v / other.v
        rest = self.d - other.d * value[..., np.newaxis]
        return Dual(value, rest / other.v[..., np.newaxis])

    def __getitem__(self, place: Any) -> Dual:
        return Dual(self.v[place], self.d[place])

    def size(self) -> Dual:
        """The absolute value."""
        sign = np.where(self.v < 0.0, -1.0, 1.0)
        return Dual(np.abs(self.v), self.d * sign[..., np.newaxis])

    def root(self) -> Dual:
        """The square root. The derivative at 0 is that of 0."""
        value = np.sqrt(self.v)
        half = np.where(value > 0.0, 0.5 / np.where(value > 0.0, value, 1.0), 0.0)
        return Dual(value, self.d * half[..., np.newaxis])

    def total(self) -> Dual:
        """The sum over the first axis."""
        return Dual(self.v.sum(axis=0), self.d.sum(axis=0))


def where(condition: NDArray[np.bool_], first: Dual, second: Dual) -> Dual:
    """The first value where the condition is true, else the second one."""
    return Dual(np.where(condition, first.v, second.v), np.where(condition[..., None], first.d, second.d))


def constant(value: float, like: Dual) -> Dual:
    """A number for each of the values of ``like``."""
    return Dual(np.full_like(like.v, value), np.zeros_like(like.d))


Options = Sequence[float]


def _intervals(t: Dual, y: Dual) -> tuple[Dual, Dual, Dual, Dual]:
    return t[:-1], t[1:], y[:-1], y[1:]


def _integral(t: Dual, y: Dual, options: Options) -> Dual:
    t0, t1, a, b = _intervals(t, y)
    return ((t1 - t0) * ((a + b) * 0.5)).total()


def _ise(t: Dual, y: Dual, options: Options) -> Dual:
    t0, t1, a, b = _intervals(t, y - options[0])
    return ((t1 - t0) * ((a * a + a * b + b * b) * (1.0 / 3.0))).total()


def _absolute(t0: Dual, t1: Dual, a: Dual, b: Dual, weighted: bool) -> Dual:
    """The integrals of ``|e|`` or of ``t |e|`` over intervals; they are divided where the sign changes."""

    def piece(begin: Dual, end: Dual, first: Dual, last: Dual) -> Dual:
        if not weighted:
            return (end - begin) * ((first + last) * 0.5)
        weight = begin * (first * 2.0 + last) + end * (first + last * 2.0)
        return (end - begin) * (weight * (1.0 / 6.0))

    before, after = a.size(), b.size()
    sizes = before + after
    sizes = where(sizes.v > 0.0, sizes, constant(1.0, sizes))
    zero = t0 + (t1 - t0) * (before / sizes)
    none = constant(0.0, before)
    divided = piece(t0, zero, before, none) + piece(zero, t1, none, after)
    return where(a.v * b.v < 0.0, divided, piece(t0, t1, before, after)).total()


def _iae(t: Dual, y: Dual, options: Options) -> Dual:
    return _absolute(*_intervals(t, y - options[0]), weighted=False)


def _itae(t: Dual, y: Dual, options: Options) -> Dual:
    return _absolute(*_intervals(t, y - options[0]), weighted=True)


def _mean(t: Dual, y: Dual, options: Options) -> Dual:
    span = t[-1] - t[0]
    return _integral(t, y, options) / span if float(span.v) > 0.0 else y[-1]


def _rms(t: Dual, y: Dual, options: Options) -> Dual:
    span = t[-1] - t[0]
    return (_ise(t, y, (0.0,)) / span).root() if float(span.v) > 0.0 else y[-1].size()


def _final(t: Dual, y: Dual, options: Options) -> Dual:
    return y[-1]


def _share_above(a: Dual, b: Dual, level: float) -> Dual:
    order = a.v > b.v
    top, least = where(order, a, b), where(order, b, a)
    range_ = top - least
    inside = (top - level) / where(range_.v > 0.0, range_, constant(1.0, range_))
    share = where(least.v >= level, constant(1.0, top), inside)
    return where(top.v <= level, constant(0.0, top), share)


def _time_outside(t: Dual, y: Dual, options: Options) -> Dual:
    t0, t1, a, b = _intervals(t, y)
    parts = [_share_above(a, b, options[1])] if math.isfinite(options[1]) else []
    parts += [_share_above(-a, -b, -options[0])] if math.isfinite(options[0]) else []
    total = constant(0.0, y[0])
    for share in parts:
        total = total + ((t1 - t0) * share).total()
    return total


def _nothing(y: Dual) -> Dual:
    return constant(math.nan, y[0])


def _final_value(y: Dual, options: Options) -> Dual | None:
    value = y[-1] if math.isnan(options[0]) else constant(options[0], y[0])
    return value if math.isfinite(float(value.v)) and float(value.v) != 0.0 else None


def _fractions(y: Dual, final: Dual) -> Dual:
    """``y / final`` for all rows."""
    return y / Dual(np.broadcast_to(final.v, y.v.shape), np.broadcast_to(final.d, y.d.shape))


def _between(t: Dual, k: int, share: Dual) -> Dual:
    return t[k - 1] + share * (t[k] - t[k - 1])


def _first_above(t: Dual, y: Dual, level: float) -> Dual:
    above = np.flatnonzero(y.v >= level)
    if not above.size:
        return _nothing(y)
    k = int(above[0])
    return t[0] if k == 0 else _between(t, k, (-y[k - 1] + level) / (y[k] - y[k - 1]))


def _rise_time(t: Dual, y: Dual, options: Options) -> Dual:
    final = _final_value(y, options)
    if final is None:
        return _nothing(y)
    fractions = _fractions(y, final)
    return _first_above(t, fractions, 0.9) - _first_above(t, fractions, 0.1)


def _settling_time(t: Dual, y: Dual, options: Options) -> Dual:
    final, band = _final_value(y, options), options[1]
    if final is None:
        return _nothing(y)
    deviation = (_fractions(y, final) - 1.0).size()
    outside = np.flatnonzero(deviation.v > band)
    if not outside.size:
        return constant(0.0, y[0])
    k = int(outside[-1])
    if k == y.v.size - 1:
        return _nothing(y)
    off, on = deviation[k], deviation[k + 1]
    return _between(t, k + 1, (off - band) / (off - on))


def _crossing_time(t: Dual, y: Dual, options: Options) -> Dual:
    level, direction = options
    if y.v[0] == level and direction == 0.0:
        return t[0]
    a, b = y.v[:-1], y.v[1:]
    rising = (a < level) & (b >= level) & (direction >= 0.0)
    falling = (a > level) & (b <= level) & (direction <= 0.0)
    places = np.flatnonzero(rising | falling)
    if not places.size:
        return _nothing(y)
    k = int(places[0]) + 1
    return _between(t, k, (-y[k - 1] + level) / (y[k] - y[k - 1]))


@dataclass(frozen=True, eq=False)
class Extreme:
    """A measure that is the largest of ``values`` and ``least``, with another sign if ``negative``."""

    values: Dual
    least: float = -math.inf
    negative: bool = False


def _extreme(kind: str, y: Dual, options: Options) -> Extreme | None:
    """The extreme value that a measure is; ``None`` for a measure without a value."""
    if kind in ("maximum", "minimum"):
        return Extreme(y if kind == "maximum" else -y, negative=kind == "minimum")
    if kind == "peak":
        return Extreme(y.size(), 0.0)
    final = _final_value(y, options)
    if final is None:
        return None
    fractions = _fractions(y, final)
    return Extreme((fractions - 1.0 if kind == "overshoot" else -fractions) * 100.0, 0.0)


EXTREMES = ("maximum", "minimum", "peak", "overshoot", "undershoot")
"""The measures that are extreme values."""
SMOOTH: Mapping[str, Callable[[Dual, Dual, Options], Dual]] = {
    "final": _final,
    "integral": _integral,
    "iae": _iae,
    "ise": _ise,
    "itae": _itae,
    "mean": _mean,
    "rms": _rms,
    "rise_time": _rise_time,
    "settling_time": _settling_time,
    "crossing_time": _crossing_time,
    "time_outside": _time_outside,
}
"""The other measures with a derivative, by kind. The number of events has none."""


def measure_with_derivatives(kind: str, options: Options, t: Dual, y: Dual) -> Dual:
    """The measure of rows, and its derivatives; NaN if the measure has no value."""
    if kind not in EXTREMES:
        return SMOOTH[kind](t, y, options)
    extreme = _extreme(kind, y, options)
    if extreme is None:
        return _nothing(y)
    k = int(np.argmax(extreme.values.v))
    value = extreme.values[k]
    if float(value.v) < extreme.least:
        value = constant(extreme.least, value)
    return -value if extreme.negative else value


def largest_of_parts(kind: str, options: Options, t: Dual, y: Dual, ends: Array) -> tuple[Dual, float] | None:
    """The largest value in each part of the run between times ``ends (K + 1,)`` s, as ``(K,)`` values, and
    a lower limit. The measure is the largest of them; for ``minimum`` it is the largest of them with the
    other sign. ``None`` if the measure has no value.
    """
    extreme = _extreme(kind, y, options)
    if extreme is None:
        return None
    parts = np.clip(np.searchsorted(ends, t.v, side="right") - 1, 0, ends.size - 2)
    order = np.lexsort((extreme.values.v, parts))
    last = np.searchsorted(parts[order], np.arange(ends.size - 1), side="right") - 1
    return extreme.values[order[last]], extreme.least
