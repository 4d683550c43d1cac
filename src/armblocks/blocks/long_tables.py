"""Curves through many points: the interval is searched for and its ends are read, whatever the count.

The equations of a short table name every point, which is quicker than a search up to ``SHORT`` points; those
of a long one cost log n, to compile and to run. Positions and values have to be inputs of the run then, so
that they lie one after another, and a run is not differentiated by them. Of a long cubic spline the
inputs are what follows from positions and values (:mod:`.splines`).
"""

from __future__ import annotations

import math
from collections.abc import Callable

from casadi import SX, fmax, fmin

from armblocks.diagram import Block, Parameter, ParameterKind
from armblocks.equations import Shape, last_at_or_below, read_entry

SHORT = 16
KNOTS = Parameter(
    name="knots", kind=ParameterKind.ARRAY, default=(), doc="positions of the spline, axis after axis"
)
SPLINE = Parameter(name="spline", kind=ParameterKind.ARRAY, default=(), doc="its values and slopes in turn")
"""What a block with a long spline reads, instead of the positions and values from which both follow."""


def is_long(shape: Shape, method: str = "linear") -> bool:
    """Whether a table of so many points along each of its axes is read by index."""
    return max(shape) > SHORT or (method != "cubic" and math.prod(shape) > 4 * SHORT)


def inputs_with(block: Block, long: bool, table: str, *positions: str) -> tuple[Parameter, ...]:
    """The inputs of the run of a block: its tunable parameters, and the positions of a long ``table``."""
    tunable = tuple(rule for rule in block.parameters() if rule.tunable)
    if is_spline(block, long):
        return (*(rule for rule in tunable if rule.name != table), KNOTS, SPLINE)
    return tuple(rule for rule in block.parameters() if rule.tunable or (long and rule.name in positions))


def is_spline(block: Block, long: bool) -> bool:
    """Whether a block reads values and slopes of a spline by index."""
    return long and getattr(block, "method", "") == "cubic"


def interval_of(u: SX, positions: SX) -> SX:
    """The index of the interval that u counts to, from 0: the first and the last go on beyond the ends."""
    return fmin(fmax(last_at_or_below(positions, u), 0.0), positions.numel() - 2.0)


def line(u: SX, positions: SX, interval: SX, entry: Callable[[SX], SX]) -> SX:
    """On the straight line of an interval, as :func:`interpolation.linear_weights` works it out."""
    begin, end = read_entry(positions, interval), read_entry(positions, interval + 1.0)
    share = (u - begin) / (end - begin)
    return (1.0 - share) * entry(interval) + share * entry(interval + 1.0)
