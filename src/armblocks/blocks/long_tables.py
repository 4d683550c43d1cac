"""Curves through many points: the interval is searched for and its ends are read, whatever the count.

The equations of a short table name every point, which is quicker than a search up to ``SHORT`` points; those
of a long one cost log n, to compile and to run. Positions and values have to be inputs of the run then, so
that they lie one after another, and a run is not differentiated by them.
"""

from __future__ import annotations

from collections.abc import Callable

from casadi import SX, fmax, fmin, if_else

from armblocks.diagram import Block, Parameter
from armblocks.equations import last_at_or_below, read_entry

SHORT = 16
LONG_METHODS = ("linear", "flat")
"""What is read by index in long tables; a spline through all points stands in the equations."""


def is_long(count: int, method: str) -> bool:
    """Whether a table of so many points is read by index."""
    return count > SHORT and method in LONG_METHODS


def with_positions(block: Block, long: bool, name: str) -> tuple[Parameter, ...]:
    """The inputs of the run of a block: its tunable parameters, and the positions of a long table."""
    return tuple(rule for rule in block.parameters() if rule.tunable or (long and rule.name == name))


def interval_of(u: SX, positions: SX) -> SX:
    """The index of the interval that u counts to, from 0: the first and the last go on beyond the ends."""
    return fmin(fmax(last_at_or_below(positions, u), 0.0), positions.numel() - 2.0)


def line(u: SX, positions: SX, interval: SX, entry: Callable[[SX], SX]) -> SX:
    """On the straight line of an interval, as :func:`interpolation.linear_weights` works it out."""
    begin, end = read_entry(positions, interval), read_entry(positions, interval + 1.0)
    share = (u - begin) / (end - begin)
    return (1.0 - share) * entry(interval) + share * entry(interval + 1.0)


class Borders:
    """The positions at which a curve or its slope jumps, of a long table."""

    def __init__(self, positions: SX, method: str, extrapolation: str) -> None:
        n = positions.numel()
        self._positions = positions
        held = method == "linear" and extrapolation == "clip"
        self.first = 0 if held else 1
        self.count = n if held else n - 1 if method == "flat" else n - 2

    def at_or_below(self, u: SX) -> SX:
        """How many there are."""
        found = last_at_or_below(self._positions, u) + (1.0 - self.first)
        return fmin(fmax(found, 0.0), float(self.count))

    def to_next(self, u: SX, cell: SX) -> SX:
        """How far u is beyond the border above its cell; -inf where there is none."""
        border = read_entry(self._positions, fmin(cell, self.count - 1.0) + float(self.first))
        return if_else(cell < float(self.count), u - border, -float("inf"))

    def to_last(self, u: SX, cell: SX) -> SX:
        """How far u is beyond the border below its cell; inf where there is none."""
        border = read_entry(self._positions, fmax(cell - 1.0, 0.0) + float(self.first))
        return if_else(cell > 0.0, u - border, float("inf"))
