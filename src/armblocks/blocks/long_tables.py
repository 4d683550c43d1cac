"""Curves through many points: the interval is searched for and its ends are read, whatever the count.

The equations of a short table name every point, which is quicker than a search up to ``SHORT`` points; those
of a long one cost log n, to compile and to run. Positions and values have to be inputs of the run then, so
that they lie one after another, and a run is not differentiated by them.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from casadi import SX, fmax, fmin

from armblocks.diagram import Block, Parameter
from armblocks.equations import Shape, last_at_or_below, read_entry

SHORT = 16
LONG_METHODS = ("linear", "nearest", "flat")
"""What is read by index in long tables; a spline through all points stands in the equations."""


def is_long(shape: Shape, method: str = "linear") -> bool:
    """Whether a table of so many points along each of its axes is read by index."""
    return method in LONG_METHODS and (max(shape) > SHORT or math.prod(shape) > 4 * SHORT)


def with_positions(block: Block, long: bool, *names: str) -> tuple[Parameter, ...]:
    """The inputs of the run of a block: its tunable parameters, and the positions of a long table."""
    return tuple(rule for rule in block.parameters() if rule.tunable or (long and rule.name in names))


def interval_of(u: SX, positions: SX) -> SX:
    """The index of the interval that u counts to, from 0: the first and the last go on beyond the ends."""
    return fmin(fmax(last_at_or_below(positions, u), 0.0), positions.numel() - 2.0)


def line(u: SX, positions: SX, interval: SX, entry: Callable[[SX], SX]) -> SX:
    """On the straight line of an interval, as :func:`interpolation.linear_weights` works it out."""
    begin, end = read_entry(positions, interval), read_entry(positions, interval + 1.0)
    share = (u - begin) / (end - begin)
    return (1.0 - share) * entry(interval) + share * entry(interval + 1.0)
