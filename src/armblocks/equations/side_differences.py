"""Differences of values for small changes of the parameters to both sides, compared with the derivatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from casadi import SX, fabs, logic_or

STEP = 1e-9
"""The change of a parameter."""
KINK, ROUNDING = 1e-2, 1e-5
"""The smallest relative difference of two derivatives, and the part of it for each unit of a value."""


def combined(columns: Sequence[SX]) -> SX:
    """The derivative along a change of all parameters, from one derivative for each. The changes differ, so
    that no effects cancel."""
    total = SX.zeros(columns[0].numel())
    for k, column in enumerate(columns):
        total = total + (1.0 + 0.37 * k) * column
    return total


def without_derivative(change: Callable[[float], SX], rate: SX, size: SX) -> SX:
    """Which values have a kink or a jump. ``change(step)``: the change of the values for a change of the
    parameters, ``rate``: their derivative, ``size``: their magnitude."""
    limit = STEP * (KINK * (1.0 + fabs(rate)) + ROUNDING * size)
    found = SX.zeros(rate.numel())
    for step in (-STEP, STEP):
        found = logic_or(found, fabs(change(step) - step * rate) > limit)
    return found
