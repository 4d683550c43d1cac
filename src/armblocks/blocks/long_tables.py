"""Tables with many points: a binary search finds the interval, and its end points are read by index.

The equations of a short table contain every point, which is faster than a search for up to
``MAX_SHORT_POINTS`` points. The cost of a long table grows with log n, in compilation and in runs. Its
positions and values are run inputs, stored contiguously, and a run is not differentiated with respect to
them. The run inputs of a long cubic spline are computed from positions and values (:mod:`.splines`).
"""

from __future__ import annotations

import math
from collections.abc import Callable

from casadi import SX, fmax, fmin

from armblocks.diagram import Block, Parameter, ParameterKind
from armblocks.equations import Shape, last_at_or_below, read_entry

MAX_SHORT_POINTS = 16
"""Largest number of points of a short table."""
KNOTS = Parameter(
    name="knots", kind=ParameterKind.ARRAY, default=(), doc="positions of the spline, axis after axis"
)
SPLINE = Parameter(
    name="spline",
    kind=ParameterKind.ARRAY,
    default=(),
    doc="values and derivatives of the spline, alternating",
)
"""Run inputs of a block with a long spline, in place of the positions and values."""


def is_long(shape: Shape, method: str = "linear") -> bool:
    """Whether a table with this number of points along each axis is read by index."""
    return max(shape) > MAX_SHORT_POINTS or (method != "cubic" and math.prod(shape) > 4 * MAX_SHORT_POINTS)


def inputs_with(block: Block, long: bool, table: str, *positions: str) -> tuple[Parameter, ...]:
    """The run inputs of a block: its tunable parameters, and the positions of a long ``table``."""
    tunable = tuple(rule for rule in block.parameters() if rule.tunable)
    if is_spline(block, long):
        return (*(rule for rule in tunable if rule.name != table), KNOTS, SPLINE)
    return tuple(rule for rule in block.parameters() if rule.tunable or (long and rule.name in positions))


def is_spline(block: Block, long: bool) -> bool:
    """Whether a block reads values and derivatives of a spline by index."""
    return long and getattr(block, "method", "") == "cubic"


def interval_of(u: SX, positions: SX) -> SX:
    """The index of the interval of u, from 0; the first and last interval extend beyond the ends."""
    return fmin(fmax(last_at_or_below(positions, u), 0.0), positions.numel() - 2.0)


def interpolated(u: SX, positions: SX, interval: SX, entry: Callable[[SX], SX]) -> SX:
    """The linear interpolation in an interval, with the weights of :func:`interpolation.linear_weights`."""
    begin, end = read_entry(positions, interval), read_entry(positions, interval + 1.0)
    fraction = (u - begin) / (end - begin)
    return (1.0 - fraction) * entry(interval) + fraction * entry(interval + 1.0)
