"""What blocks that switch share: thresholds with sides, limits in order, and zones between two limits."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from casadi import SX, if_else, logic_or

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
    """-1 below both limits, 1 above, 0 between."""
    return if_else(u > upper, 1.0, if_else(u < lower, -1.0, 0.0))


def zone_after(mode: SX, e: Signals) -> SX:
    """The zone after an event of the guards ``upper`` and ``lower``, which fire in both directions."""
    inner = if_else(logic_or(e["upper"] < 0.0, e["lower"] > 0.0), 0.0, mode)
    return if_else(e["upper"] > 0.0, 1.0, if_else(e["lower"] < 0.0, -1.0, inner))
