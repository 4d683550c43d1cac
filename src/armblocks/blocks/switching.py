"""What blocks that switch share: thresholds with sides, limits in order, and zones between two limits."""

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

JUST = 1e-300
"""Beside a threshold by less than any signal can tell: it gives the threshold itself a side."""


SMALLEST_JUMP = 1e-9
"""A smaller jump of a signal, beside its size, cannot be told from rounding by a block that looks for one."""
SAME_INSTANT = 2.0**-50
"""Times that differ less, beside their size, are one instant."""
_HALF_LATER = 1.0 + 2.0**-51
"""A time times this is later by half of what is one instant."""


def since(t: SX, instant: SX) -> SX:
    """The time since an instant that follows from parameters (s), positive from it on: a guard.

    An instant that is rounded, such as 5 times 0.2 s, and a recorded time or a tick that is rounded otherwise
    are one instant: the guard is positive two units in the last place before it.
    """
    return t * _HALF_LATER - instant + JUST


def same_instant(t: SX, instant: SX) -> SX:
    """Whether a time is that of an instant that the block has kept: four units in the last place."""
    return fabs(t - instant) <= SAME_INSTANT * fabs(t)


def zero_crossing_parameter() -> Any:
    """Declare the parameter ``zero_crossing``, Simulink's "Enable zero-crossing detection"."""
    return parameter(True, doc="whether the instants at which the block switches are located, as events")


def located(block: Block, *conditions: Condition) -> tuple[Condition, ...]:
    """Conditions of a block that has the parameter ``zero_crossing``."""
    crossing = bool(block.parameter_value("zero_crossing"))
    return tuple(dataclasses.replace(entry, located=crossing) for entry in conditions)


def limits_in_order(block: Block, lower: str, upper: str) -> None:
    """Raise ``InputError`` where a lower limit exceeds the upper one."""
    low, high = block.parameter_value(lower), block.parameter_value(upper)
    broadcast({lower: shape_of(low), upper: shape_of(high)})
    if np.any(np.greater(np.asarray(low), np.asarray(high))):
        raise InputError(
            f"{lower} is {low} and {upper} is {high}",
            where=block.type_name(),
            allowed=f"{lower} <= {upper}",
            fix="exchange them",
        )


def zone(u: SX, lower: SX, upper: SX) -> SX:
    """-1 below both limits, 1 above, 0 between.

    It compares the same differences as the guards ``u - upper`` and ``u - lower``: where a product and this
    subtraction become one rounded operation, mode and guard still agree.
    """
    return if_else(u - upper > 0.0, 1.0, if_else(u - lower < 0.0, -1.0, 0.0))


def beyond(guards: Signals, up: str = "up", down: str = "down") -> SX:
    """Whether a signal has left the cell that a mode counts, by the guards at both ends of the cell."""
    return logic_or(guards[up] > 0.0, guards[down] < 0.0)


def cell_of(now: SX, before: SX, guards: Signals, up: str = "up", down: str = "down") -> SX:
    """The consistent cell: the one before while the guards at its ends allow it, else ``now``.

    ``now`` follows from the values of the moment; where rounding does not tell it from ``before``, it is the
    next cell.
    """
    left = if_else(guards[down] < 0.0, fmin(now, before - 1.0), before)
    return if_else(guards[up] > 0.0, fmax(now, before + 1.0), left)


def counted(now: SX, before: SX, due: SX) -> SX:
    """How many edges have passed: one more than ``before``, or ``now`` by the time, once the next is due."""
    return if_else(due, fmax(now, before + 1.0), before)


def zone_after(mode: SX, e: Signals) -> SX:
    """The zone after an event of the guards ``upper`` and ``lower``, which fire in both directions."""
    inner = if_else(logic_or(e["upper"] < 0.0, e["lower"] > 0.0), 0.0, mode)
    return if_else(e["upper"] > 0.0, 1.0, if_else(e["lower"] < 0.0, -1.0, inner))
