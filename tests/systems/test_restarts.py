"""A subsystem whose states are reset continues as at the start of a run.

A subsystem with blocks of every kind that store values is reset once in each period of its inputs. Every
inner signal must then be equal in all periods, the first of which begins with the start of the run.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from casadi import SX, if_else
from numpy.typing import ArrayLike

import armblocks as ab
from armblocks import Diagram, DiagramBuilder
from armblocks.blocks import (
    PWM,
    ActionSubsystem,
    Backlash,
    Bias,
    Clock,
    Constant,
    CoulombFriction,
    Derivative,
    EnabledSubsystem,
    EnabledTriggeredSubsystem,
    FirstOrderHold,
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
    RepeatingSequenceStair,
    ResettableIntegrator,
    ResettableSubsystem,
    SignalGenerator,
    SineWave,
    Sum,
    TriggeredSubsystem,
    UnitDelay,
    ZeroOrderHold,
)
from armblocks.diagram import Block, Guard, Port, Shapes, Signals, State, sample_time_parameter

PERIODS, SAMPLES = 4, 64


@dataclass(frozen=True, kw_only=True)
class Tally(Block):
    """A sampled tick counter with a guard, which counts the events at which the count exceeds 4.5.

    The count starts at 6 and continues with 2 after each 7.
    """

    title: ClassVar[str] = "Tally"
    sampled: ClassVar[bool] = True
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return ()

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the count", "", ()), Port("crossings", "number of times it exceeded 4.5", "", ()))

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return State("count", (), "the count"), State("crossing_count", (), "number of times it exceeded 4.5")

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return (Guard("exceeds", (), "the count exceeds 4.5", 1),)

    def initial_states(self, p: Signals) -> Signals:
        return {"count": SX(6.0), "crossing_count": SX(0.0)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["count"], "crossings": x["crossing_count"]}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {
            "count": if_else(x["count"] == 7.0, 2.0, x["count"] + 1.0),
            "crossing_count": x["crossing_count"],
        }

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"exceeds": x["count"] - 4.5}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return {"crossing_count": x["crossing_count"] + if_else(e["exceeds"] != 0.0, 1.0, 0.0)}


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
    for name, hysteresis in (
        ("relay", Relay(on_point=-0.5, off_point=-1.0)),
        ("play", Backlash(initial=-1.0)),
    ):
        # Disabled at the start, where the consistent mode differs from the initial one.
        b.add(f"enabled {name}", EnabledSubsystem(diagram=_around(hysteresis)), x, above)
    b.add("both", EnabledTriggeredSubsystem(diagram=_around(Gain())), x, v, above)
    second_play = b.add(
        "second play", Backlash(width=0.2, initial=-1.0), b.add("play", Backlash(initial=1.0), x)
    )
    b.add("hit play", HitCrossing(offset=-0.05), second_play)
    b.add("hit relay", HitCrossing(offset=0.5), b.add("relay", Relay(on_point=0.15, off_point=-0.1), x))
    limited = b.add("limited", RateLimiterContinuous(rising=1.0, falling=-1.0), v)
    b.add("hit limited", HitCrossing(offset=0.1), limited)
    stairs = b.add("stairs", RepeatingSequenceStair(values=(-0.7, 0.4, -0.3), sample_time=0.125))
    b.add("limited stairs", RateLimiterContinuous(), stairs)
    for method in ("extrapolation", "interpolation"):
        b.add(method, FirstOrderHold(method=method, period=0.125, initial=0.3), x)
    b.add("pulses", PWM(period=0.125), above)
    from_port = ResettableIntegrator(
        external_reset="rising", initial_condition_source="external", initial=9.0, state_port=True
    )
    first = b.add("from x", from_port, u, above, x)
    second = b.add("from first", from_port, first["y"], above, first["y"])
    third = b.add("from second", from_port.with_parameters(limit_output=True), v, above, second["state"])
    b.add("sampled state", ZeroOrderHold(sample_time=0.125), third["state"])
    b.add("from a hold", from_port, v, above, b.add("held x", ZeroOrderHold(sample_time=0.125), x))
    b.add("friction", CoulombFriction(), above)
    b.add("tally", Tally(sample_time=0.0625))
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
    changes = 0
    for name in result.names:
        if name.startswith("sub/") and not name.endswith("/last"):
            periods = np.asarray(result[name], dtype=np.float64).reshape(PERIODS, SAMPLES)[:, :compared]
            first_period = np.broadcast_to(periods[0], periods.shape)
            np.testing.assert_allclose(periods, first_period, rtol=0.0, atol=1e-6, err_msg=name)
            changes += np.ptp(periods) > 0.0
    assert changes > 60


def test_the_initial_value_from_a_port_is_the_value_of_the_signal_at_the_start() -> None:
    """x(0) = k x(0) + 1 is solved also where an iteration diverges; a hold reads the state at the start."""
    b = DiagramBuilder("starts")
    one = b.add("one", Constant(value=1.0))
    rule = ResettableIntegrator(
        external_reset="none", initial_condition_source="external", initial=0.5, state_port=True
    )
    for number, k in enumerate((-1.0, 0.99, 2.0)):
        x = b.add(f"x {number}", rule)
        b.connect(one, x["u"])
        product = b.add(f"gain {number}", Gain(gain=k), x["y"])
        b.connect(b.add(f"sum {number}", Sum(), product, one), x["initial"])
        b.add(f"hold {number}", ZeroOrderHold(sample_time=0.25), x["state"])
        b.add(f"rate {number}", Derivative(), x["y"])
    result = ab.simulate(b.build(), stop_time=1.0, sample_time=0.25)
    for number, k in enumerate((-1.0, 0.99, 2.0)):
        expected = 1.0 / (1.0 - k) + result.time
        for name in (f"x {number}/y", f"x {number}/state", f"hold {number}"):
            np.testing.assert_allclose(result[name], expected, rtol=1e-9, atol=1e-9, err_msg=name)
        assert [*result[f"rate {number}"]] == [1.0] * 5


@pytest.mark.parametrize("states", ("held", "reset"))
def test_a_sampling_block_in_a_subsystem_misses_the_samples_while_it_is_off(states: str) -> None:
    """On for 0.3 to 0.9 s and 1.3 to 1.9 s: the samples at 0.5, 0.75, 1.5 and 1.75 s are taken."""
    inner = DiagramBuilder("part")
    u = inner.add("u", Inport())
    inner.add("line", FirstOrderHold(period=0.25, initial=-1.0), u)
    inner.add("pulses", PWM(period=0.25), inner.add("duty", Constant(value=0.4)))
    inner.add("y", Outport(), u)
    b = DiagramBuilder("misses")
    on = b.add("on", PulseGenerator(period=1.0, width=60.0, delay=0.3))
    inside = EnabledSubsystem(diagram=inner.build(), states_when_enabling=states)
    b.add("sub", inside, b.add("t", Clock()), enable=on)
    result = ab.simulate(b.build(), stop_time=1.875, sample_time=0.0625)
    t = result.time
    is_on = ((t > 0.3) & (t < 0.9)) | (t > 1.3)
    latest = np.floor(4.0 * t) / 4.0  # the latest sample time
    taken = (latest == 0.5) | (latest == 0.75) | (latest == 1.5) | (latest == 1.75)
    kept = np.where(t < 1.0, -1.0, {"held": 0.75, "reset": -1.0}[states])
    before = np.where((latest == 0.5) | (latest == 1.5), kept, latest - 0.25)
    line = np.where(taken, latest + (latest - before) * (t - latest) / 0.25, kept)
    np.testing.assert_allclose(result["sub/line"][is_on], line[is_on], rtol=0.0, atol=1e-12)
    pulses = taken & (t - latest < 0.1)
    assert np.array_equal(result["sub/pulses"][is_on], pulses[is_on])


def test_guards_of_a_sampled_block_fire_after_the_tick_that_changes_its_states() -> None:
    b = DiagramBuilder("events of a sampled block")
    b.add("tally", Tally(sample_time=1.0))
    result = ab.simulate(b.build(), stop_time=16.0, sample_time=1.0)
    assert [*result["tally/y"]] == [6, 7, *(2, 3, 4, 5, 6, 7) * 2, 2, 3, 4]
    assert [*result["tally/crossings"]] == [0] * 5 + [1] * 6 + [2] * 6
