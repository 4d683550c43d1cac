"""Blocks that sample their input once a period and have a continuous-time output between samples.

T is the period, t_k = offset + k T is the k-th sample time. The sampled value includes the effects of all
ticks and events at t_k: a second event samples the input again after the first one.
"""

from __future__ import annotations

from casadi import SX, if_else, logic_and, logic_or

from armblocks.blocks.switching import since
from armblocks.diagram import (
    Guard,
    Signals,
    State,
)

COUNT = State("count", (), "number of samples taken")
FRESH = State("fresh", (), "1 until the input has been sampled again, else 0")
INSTANT = Guard("instant", (), "t - the next sample time", 1)
AGAIN = Guard("again", (), "the input has been sampled", -1)


def sample_time(p: Signals, count: SX) -> SX:
    """The sample time t_k = offset + k T, computed as for the ticks of a clock."""
    return p["offset"] + count * p["period"]


def sampled(t: SX, x: Signals, p: Signals, e: Signals) -> tuple[SX, SX, Signals]:
    """Whether a period begins, whether to sample the input, and the next values of the states.

    The start needs no event: every mode iteration at t = 0 samples the input again.
    """
    due = logic_or(e["instant"] > 0.0, t >= sample_time(p, x["count"]))
    same = logic_and(x["count"] > 0.0, t <= sample_time(p, x["count"] - 1.0))
    looks = logic_or(due, logic_or(same, e["again"] < 0.0))
    fresh = if_else(e["instant"] > 0.0, 1.0, if_else(e["again"] < 0.0, 0.0, x["fresh"]))
    return due, looks, {"count": x["count"] + due, "fresh": fresh}


def sampling_guards(t: SX, x: Signals, p: Signals) -> Signals:
    """The guards of both events: a sample time is reached; the input is sampled again."""
    return {"instant": since(t, sample_time(p, x["count"])), "again": 0.5 - x["fresh"]}
