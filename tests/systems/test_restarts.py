"""A subsystem whose states are reset continues as at the start of a run.

A subsystem with blocks of every kind that store values is reset once in each period of its inputs. Every
inner signal must then be equal in all periods, the first of which begins with the start of the run.
"""

from __future__ import annotations

import numpy as np
import pytest

import armblocks as ab
from armblocks import Diagram, DiagramBuilder
from armblocks.blocks import (
    ActionSubsystem,
    Backlash,
    Bias,
    Constant,
    CoulombFriction,
    EnabledSubsystem,
    EnabledTriggeredSubsystem,
    Gain,
    HitCrossing,
    If,
    Inport,
    Integrator,
    Merge,
    Outport,
    PulseGenerator,
    RateLimiterContinuous,
    Relay,
    ResettableSubsystem,
    SignalGenerator,
    SineWave,
    Sum,
    TriggeredSubsystem,
    UnitDelay,
    ZeroOrderHold,
)
from armblocks.diagram import Block

PERIODS, SAMPLES = 4, 64


def _around(block: Block) -> Diagram:
    inner = DiagramBuilder("part")
    y = inner.add("block", block, inner.add("u", Inport(port=1)))
    inner.add("y", Outport(port=1, initial=-2.0), y)
    return inner.build()


def _contents() -> Diagram:
    """Blocks with events, hysteresis, holds, triggers, enables and resets after an integrator."""
    b = DiagramBuilder("contents")
    u, v = b.add("u", Inport(port=1)), b.add("v", Inport(port=2))
    x = b.add("x", Integrator(initial=-0.2), u)
    above = b.add("above", Sum(signs="+-"), x, b.add("level", Constant(value=0.1)))
    for edge in ("rising", "falling", "either"):
        b.add(f"hit {edge}", HitCrossing(offset=0.1, direction=edge), x)
        b.add(f"trigger {edge}", TriggeredSubsystem(diagram=_around(Gain()), edge=edge), x, above)
        b.add(f"reset {edge}", ResettableSubsystem(diagram=_around(Integrator()), edge=edge), u, above)
    for states in ("held", "reset"):
        enabled = EnabledSubsystem(diagram=_around(Integrator()), states_when_enabling=states)
        b.add(f"enabled {states}", enabled, u, above)
    b.add("both", EnabledTriggeredSubsystem(diagram=_around(Gain())), x, v, above)
    loose = b.add("second play", Backlash(width=0.2, initial=-1.0), b.add("play", Backlash(initial=1.0), x))
    b.add("hit play", HitCrossing(offset=-0.05), loose)
    b.add("hit relay", HitCrossing(offset=0.5), b.add("relay", Relay(on_point=0.15, off_point=-0.1), x))
    limited = b.add("limited", RateLimiterContinuous(rising=1.0, falling=-1.0), v)
    b.add("hit limited", HitCrossing(offset=0.1), limited)
    b.add("friction", CoulombFriction(), above)
    b.add("delay", UnitDelay(sample_time=0.125, initial=3.0), x)
    choice = b.add("choice", If(expressions="u > 0.3"), x)
    one = b.add("one", ActionSubsystem(diagram=_around(Gain(gain=2.0))), x, choice["if1"])
    b.add("merged", Merge(inputs=1, initial=5.0), one)
    return b.build()


@pytest.mark.parametrize("sampled", (False, True))
@pytest.mark.parametrize("kind", ("reset", "enabled"))
def test_a_subsystem_continues_after_a_reset_as_at_the_start_of_a_run(kind: str, sampled: bool) -> None:
    b = DiagramBuilder("restarts")
    pulse = b.add("pulse", PulseGenerator(period=1.0))
    pulse = b.add("ticks", ZeroOrderHold(sample_time=0.25), pulse) if sampled else pulse
    sine = b.add("sine", SineWave(frequency=4.0 * np.pi, amplitude=4.0, phase=0.4))
    saw = b.add("saw", SignalGenerator(waveform="sawtooth", amplitude=0.7, frequency=3.0))
    saw = b.add("shifted", Bias(bias=0.11), saw)
    inside = _contents()
    if kind == "reset":
        b.add("sub", ResettableSubsystem(diagram=inside), sine, saw, pulse)
    else:
        enabled = EnabledSubsystem(diagram=inside, states_when_enabling="reset")
        b.add("sub", enabled, sine, saw, pulse)
    result = ab.simulate(
        b.build(), stop_time=PERIODS - 1.0 / SAMPLES, sample_time=1.0 / SAMPLES, rtol=1e-9, atol=1e-12
    )
    compared = SAMPLES if kind == "reset" else SAMPLES // 2
    seen = 0
    for name in result.names:
        if name.startswith("sub/") and not name.endswith("/last"):
            course = np.asarray(result[name], dtype=np.float64).reshape(PERIODS, SAMPLES)[:, :compared]
            later = np.broadcast_to(course[0], course.shape)
            np.testing.assert_allclose(course, later, rtol=0.0, atol=1e-6, err_msg=name)
            seen += np.ptp(course) > 0.0
    assert seen > 40
