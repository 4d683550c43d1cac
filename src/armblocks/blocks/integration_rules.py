"""The integration rules of sampled blocks: forward Euler, backward Euler, trapezoidal."""

from __future__ import annotations

from casadi import SX

from armblocks.diagram import Signals


def included_fraction(method: str) -> float:
    """The fraction of the increment that the output includes at the same tick."""
    return {"forward_euler": 0.0, "backward_euler": 1.0, "trapezoidal": 0.5}[method]


def interval_of_update(method: str, p: Signals) -> SX:
    """The interval (s) by which an update multiplies the present input.

    The input acts on the part of the interval before this tick that the output includes, and on the rest of
    the interval after it. With a fixed period T the sum is T.
    """
    fraction = included_fraction(method)
    return fraction * p["T"] + (1.0 - fraction) * p["T_next"]
