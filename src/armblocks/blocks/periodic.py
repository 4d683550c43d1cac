"""Blocks that sample their input once a period and have a continuous-time output between samples.

T is the period, t_k = offset + k T is the k-th sample time. The sampled value includes the effects of all
ticks and events at t_k: the block samples again until the input at this time equals the sample.

A block in a subsystem misses the sample times at which the subsystem is off. At the restart of a subsystem no
guard fires. The mode ``up_to_date`` then causes the reset: it is inconsistent while a sample time has been
reached that is not counted, and while the input differs from its sample.
"""

from __future__ import annotations

from dataclasses import dataclass

from casadi import SX, fabs, floor, fmax, if_else, logic_and, logic_not, logic_or, mmax, mmin, vertcat

from armblocks.blocks.switching import SAME_INSTANT, SAME_VALUE, since
from armblocks.diagram import (
    Guard,
    Signals,
    State,
)

COUNT = State("count", (), "number of samples taken")
WHEN = State("when", (), "time of the last sample")
ODD = State("odd", (), "whether the number of repeated samples is odd, 1 or 0")
INSTANT = Guard("instant", (), "t - the next sample time", 1)
RESAMPLE = Guard("again", (2,), "the input differs from its sample", -1)
UP_TO_DATE = State("up_to_date", (), "1: all sample times until now are counted")
ON_TIME = 1e-9
"""The longest time after a sample time at which the input is still sampled, in periods."""


def sample_time(p: Signals, count: SX) -> SX:
    """The sample time t_k = offset + k T, computed as for the ticks of a clock."""
    return p["offset"] + count * p["period"]


@dataclass(frozen=True)
class Sampling:
    """What happens at an instant: ``begins``: a period begins, or has begun while the block was off.
    ``samples``: the input is sampled. ``missed``: the latest sample time was missed. ``states``: the next
    values of the states of this module."""

    begins: SX
    samples: SX
    missed: SX
    states: Signals


def sampled(t: SX, x: Signals, p: Signals, e: Signals) -> Sampling:
    """The sampling at this instant.

    At t = 0 no event is necessary, because every mode iteration samples the input again.
    """
    begins = logic_or(e["instant"] > 0.0, _is_due(t, x, p))
    latest = fmax(floor((t - p["offset"]) / p["period"] + ON_TIME), x["count"])
    late = t - sample_time(p, latest) > ON_TIME * p["period"] + SAME_INSTANT * fabs(t)
    missed = logic_and(begins, late)
    odd = if_else(mmin(e["again"]) < 0.0, 1.0 - x["odd"], x["odd"])
    return Sampling(
        begins,
        logic_and(logic_or(begins, _just_sampled(t, x, p)), logic_not(missed)),
        missed,
        {
            "count": if_else(begins, latest + 1.0, x["count"]),
            "when": if_else(logic_and(begins, logic_not(late)), t, x["when"]),
            "odd": odd,
        },
    )


def sampling_guards(t: SX, x: Signals, p: Signals, value: SX, sample: SX) -> Signals:
    """The guards of two events: a sample time is reached; the input differs from its sample.

    The two entries of the second guard alternate, because a guard must change its sign before it can fire
    again.
    """
    differs = _differs(t, x, p, value, sample)
    values = [if_else(logic_and(differs, x["odd"] == parity), -1.0, 1.0) for parity in (0.0, 1.0)]
    return {"instant": since(t, sample_time(p, x["count"])), "again": vertcat(*values)}


def sampling_contradictions(t: SX, x: Signals, p: Signals, value: SX, sample: SX) -> Signals:
    """The inconsistency of the mode ``up_to_date``."""
    return {"up_to_date": logic_or(_is_due(t, x, p), _differs(t, x, p, value, sample))}


def _is_due(t: SX, x: Signals, p: Signals) -> SX:
    """Whether the next sample time is reached."""
    return since(t, sample_time(p, x["count"])) > 0.0


def _differs(t: SX, x: Signals, p: Signals, value: SX, sample: SX) -> SX:
    """Whether a sample of this instant differs from the input.

    The comparison is false for NaN, so a NaN is not sampled repeatedly. The run ends with an error at the
    block that outputs the NaN.
    """
    different = fabs(value - sample) > SAME_VALUE * fmax(fabs(value), fabs(sample))
    return logic_and(_just_sampled(t, x, p), mmax(different))


def _just_sampled(t: SX, x: Signals, p: Signals) -> SX:
    """Whether the last sample was taken at this instant, within a few units in the last place."""
    last = fmax(x["when"], sample_time(p, x["count"] - 1.0))
    return logic_and(x["count"] > 0.0, t <= last)
