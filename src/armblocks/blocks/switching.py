"""Functions shared by switching blocks: thresholds, checks of limits, zones between two limits."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from casadi import SX, fabs, fmax, fmin, if_else, logic_or

from armblocks.diagram import (
    Block,
    Condition,
    Signals,
    broadcast,
    parameter,
    shape_of,
)
from armblocks.errors import InputError

THRESHOLD_OFFSET = 1e-300
"""An offset below the resolution of any signal: a guard with this offset is positive at its threshold."""


SMALLEST_JUMP = 1e-9
"""Relative size of the smallest jump that a block can distinguish from rounding errors."""
SAME_VALUE = 2.0**-40
"""Relative tolerance for a signal to equal a stored value of it; in a loop the rounding errors differ."""
SAME_INSTANT = 2.0**-50
"""Relative tolerance within which two times are equal."""
_HALF_LATER = 1.0 + 2.0**-51
"""Factor that shifts a time later by half of that tolerance."""


def since(t: SX, instant: SX) -> SX:
    """A guard: the time since an instant that depends on parameters (s), positive from the instant on.

    A computed time, such as 5 times 0.2 s, may differ by rounding from a recorded time or a tick at the same
    time. The guard is therefore already positive two units in the last place earlier.
    """
    return t * _HALF_LATER - instant + THRESHOLD_OFFSET


def same_instant(t: SX, instant: SX) -> SX:
    """Whether a time equals a stored time, within four units in the last place."""
    return fabs(t - instant) <= SAME_INSTANT * fabs(t)


def zero_crossing_parameter() -> Any:
    """Declare the parameter ``zero_crossing``, Simulink's "Enable zero-crossing detection"."""
    return parameter(True, doc="whether the switching times of the block are located as events")


def located(block: Block, *conditions: Condition) -> tuple[Condition, ...]:
    """The conditions of a block, located as events if its parameter ``zero_crossing`` is true."""
    crossing = bool(block.parameter_value("zero_crossing"))
    return tuple(dataclasses.replace(entry, located=crossing) for entry in conditions)


def limits_in_order(block: Block, lower: str, upper: str) -> None:
    """Raise ``InputError`` if a lower limit exceeds the upper limit."""
    low, high = block.parameter_value(lower), block.parameter_value(upper)
    broadcast({lower: shape_of(low), upper: shape_of(high)})
    if np.any(np.greater(np.asarray(low), np.asarray(high))):
        raise InputError(
            f"{lower} is {low} and {upper} is {high}",
            where=block.type_name(),
            allowed=f"{lower} <= {upper}",
            fix="exchange the two values",
        )


def zone(u: SX, lower: SX, upper: SX) -> SX:
    """The zone of u: -1 below the lower limit, 1 above the upper limit, else 0.

    The function compares the same differences as the guards ``u - upper`` and ``u - lower``, so that mode and
    guard agree even if the compiler fuses a product with the subtraction.
    """
    return if_else(u - upper > 0.0, 1.0, if_else(u - lower < 0.0, -1.0, 0.0))


def beyond(guards: Signals, up: str = "up", down: str = "down") -> SX:
    """Whether a signal has left the cell of its mode, by the guards at both ends of the cell."""
    return logic_or(guards[up] > 0.0, guards[down] < 0.0)


def cell_of(target: SX, before: SX, guards: Signals, up: str = "up", down: str = "down") -> SX:
    """The consistent cell: ``before`` while no guard at its ends has crossed 0, else ``target``.

    ``target`` is computed from the present values. If it equals ``before`` because of rounding, the result is
    the next cell.
    """
    lower = if_else(guards[down] < 0.0, fmin(target, before - 1.0), before)
    return if_else(guards[up] > 0.0, fmax(target, before + 1.0), lower)


def edge_count(target: SX, before: SX, next_edge: SX) -> SX:
    """The number of past edges: ``before`` until the event ``next_edge``, then at least ``before + 1``.

    ``target`` is the number that follows from the time; it may be larger.
    """
    return if_else(next_edge, fmax(target, before + 1.0), before)


def zone_after(mode: SX, e: Signals) -> SX:
    """The zone after an event of the guards ``upper`` and ``lower``, which trigger in both directions."""
    inner = if_else(logic_or(e["upper"] < 0.0, e["lower"] > 0.0), 0.0, mode)
    return if_else(e["upper"] > 0.0, 1.0, if_else(e["lower"] < 0.0, -1.0, inner))
