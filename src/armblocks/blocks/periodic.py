"""Blocks that sample their input once a period and have a continuous-time output between samples.

T is the period, t_k = offset + k T is the k-th sample time. The sampled value includes the effects of all
ticks and events at t_k: the block samples again until the input at this time equals the sample.
"""

from __future__ import annotations

from casadi import SX, fabs, fmax, if_else, logic_and, logic_or, mmax, mmin, vertcat

from armblocks.blocks.switching import since
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
SAME_VALUE = 2.0**-40
"""Relative tolerance for a signal to equal its sample; in a loop the rounding errors of both differ."""


def sample_time(p: Signals, count: SX) -> SX:
    """The sample time t_k = offset + k T, computed as for the ticks of a clock."""
    return p["offset"] + count * p["period"]


def sampled(t: SX, x: Signals, p: Signals, e: Signals) -> tuple[SX, SX, Signals]:
    """Whether a period begins, whether to sample the input, and the next values of the states.

    At t = 0 no event is necessary, because every mode iteration samples the input again.
    """
    at_sample_time = logic_or(e["instant"] > 0.0, t >= sample_time(p, x["count"]))
    samples = logic_or(at_sample_time, _just_sampled(t, x, p))
    odd = if_else(mmin(e["again"]) < 0.0, 1.0 - x["odd"], x["odd"])
    return (
        at_sample_time,
        samples,
        {"count": x["count"] + at_sample_time, "when": if_else(at_sample_time, t, x["when"]), "odd": odd},
    )


def sampling_guards(t: SX, x: Signals, p: Signals, value: SX, sample: SX) -> Signals:
    """The guards of two events: a sample time is reached; the input differs from its sample.

    The two entries of the second guard alternate, because a guard must change its sign before it can fire
    again.
    """
    # The comparison is false for NaN, so a NaN is not sampled repeatedly. The run ends with an error at the
    # block that outputs the NaN.
    different = fabs(value - sample) > SAME_VALUE * fmax(fabs(value), fabs(sample))
    differs = logic_and(_just_sampled(t, x, p), mmax(different))
    values = [if_else(logic_and(differs, x["odd"] == parity), -1.0, 1.0) for parity in (0.0, 1.0)]
    return {"instant": since(t, sample_time(p, x["count"])), "again": vertcat(*values)}


def _just_sampled(t: SX, x: Signals, p: Signals) -> SX:
    """Whether the last sample was taken at this instant, within a few units in the last place."""
    last = fmax(x["when"], sample_time(p, x["count"] - 1.0))
    return logic_and(x["count"] > 0.0, t <= last)
