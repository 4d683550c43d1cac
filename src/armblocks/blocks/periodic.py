"""Blocks that look at their input once a period and give a course in continuous time until they look again.

T is the period, t_k = offset + k T is the k-th instant. What is looked at is the signal as the ticks and
events of that instant have left it: after the event of the look itself a second one looks again.
"""

from __future__ import annotations

from casadi import SX, if_else, logic_and, logic_or

from armblocks.blocks.switching import since
from armblocks.diagram import (
    Guard,
    Signals,
    State,
)

COUNT = State("count", (), "how often the input has been looked at")
FRESH = State("fresh", (), "1 until the input has been looked at again, else 0")
INSTANT = Guard("instant", (), "t - the next instant", 1)
AGAIN = Guard("again", (), "the input has been looked at", -1)


def sample_time(p: Signals, count: SX) -> SX:
    """The instant t_k: one product and one sum, as for the ticks of a clock."""
    return p["offset"] + count * p["period"]


def sampled(t: SX, x: Signals, p: Signals, e: Signals) -> tuple[SX, SX, Signals]:
    """Whether a period begins, whether the input has to be looked at, and the states that say so next.

    The start needs no event; it is settled in turns at the same instant, each of which looks again.
    """
    due = logic_or(e["instant"] > 0.0, t >= sample_time(p, x["count"]))
    same = logic_and(x["count"] > 0.0, t <= sample_time(p, x["count"] - 1.0))
    looks = logic_or(due, logic_or(same, e["again"] < 0.0))
    fresh = if_else(e["instant"] > 0.0, 1.0, if_else(e["again"] < 0.0, 0.0, x["fresh"]))
    return due, looks, {"count": x["count"] + due, "fresh": fresh}


def sampling_guards(t: SX, x: Signals, p: Signals) -> Signals:
    """The guards of both events: a sample time is reached; the input is sampled again."""
    return {"instant": since(t, sample_time(p, x["count"])), "again": 0.5 - x["fresh"]}
