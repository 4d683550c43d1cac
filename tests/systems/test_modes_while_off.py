"""Switching blocks inside disabled subsystems: their modes are consistent when the subsystem is enabled."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

import armblocks as ab
from armblocks import blocks as bl
from armblocks.diagram import Block

RUNS: list[dict[str, Any]] = [
    {"solver": "rk45", "rtol": 1e-9, "atol": 1e-12},
    {"solver": "rodas5p", "rtol": 1e-9, "atol": 1e-12},
    {"solver": "rk4", "step": 0.01},
]


def inside(block: Block, end: str = "") -> ab.Diagram:
    """A subsystem of one block with one input."""
    inner = ab.DiagramBuilder("inside")
    handle = inner.add("block", block, inner.input("u"))
    inner.output("o", handle[end] if end else handle)
    return inner.build()


def enabled_diagram(
    block: Block, source: Block, enable: Block, *, end: str = "", when: str = "held"
) -> ab.Diagram:
    return diagram_of_enabled_blocks({"": block}, source, enable, end=end, when=when)


def diagram_of_enabled_blocks(
    blocks: Mapping[str, Block], source: Block, enable: Block, *, end: str = "", when: str = "held"
) -> ab.Diagram:
    """Put each block in its own subsystem ``sub k`` with a common source; its integral is ``total k``."""
    builder = ab.DiagramBuilder("enabled")
    source_handle = builder.add("source", source)
    control = builder.add("control", enable)
    for key, block in blocks.items():
        subsystem = bl.EnabledSubsystem(diagram=inside(block, end), states_when_enabling=when)
        held = builder.add(f"sub {key}".strip(), subsystem, source_handle, enable=control)
        builder.add(f"total {key}".strip(), bl.Integrator(), held)
    return builder.build()


SWITCHING: list[tuple[Block, float]] = [
    (bl.Saturation(lower=-0.3, upper=0.3), 0.3),
    (bl.DeadZone(), 0.5),
    (bl.Relay(), 1.0),
    (bl.Quantizer(interval=0.5), 1.0),
    (bl.Abs(), 1.0),
    (bl.Sign(), 1.0),
    (bl.CompareToZero(relation=">"), 1.0),
    (bl.CoulombFriction(offset=2.0, gain=3.0), 5.0),
    (bl.LookupTable1D(positions=(-2.0, 0.0, 2.0), table=(4.0, 0.0, 1.0)), 0.5),
]
"""Blocks and their outputs for the input 1."""


@pytest.mark.parametrize("settings", RUNS, ids=lambda run: run["solver"])
def test_modes_are_consistent_with_a_jump_before_the_first_enabling(settings: dict[str, Any]) -> None:
    """The input jumps from -1 to 1 at 0.2 s; the subsystems are enabled at 0.5 s."""
    blocks = {block.type_name(): block for block, _ in SWITCHING}
    diagram = diagram_of_enabled_blocks(blocks, bl.Step(time=0.2, initial=-1.0), bl.Step(time=0.5))
    result = ab.simulate(diagram, stop_time=1.0, sample_time=0.1, **settings)
    for kind, (_, expected) in zip(blocks, SWITCHING):
        expected_values = pytest.approx([0.0] * 5 + [expected] * 6, abs=1e-12)
        assert result[f"sub {kind}/o"].tolist() == expected_values, kind
        assert result[f"total {kind}"][-1] == pytest.approx(0.5 * expected, abs=1e-9), kind


@pytest.mark.parametrize("settings", RUNS, ids=lambda run: run["solver"])
@pytest.mark.parametrize("sampled", [False, True])
def test_a_limiter_limits_whenever_its_subsystem_is_enabled(sampled: bool, settings: dict[str, Any]) -> None:
    """While the subsystem is enabled, its output is the limited wave."""
    builder = ab.DiagramBuilder("intermittent")
    wave = builder.add("wave", bl.SineWave(frequency=3.0, phase=-0.1))
    control = builder.add("control", bl.PulseGenerator(period=1.0, width=30.0, delay=0.37))
    if sampled:
        control = builder.add("hold", bl.ZeroOrderHold(sample_time=0.11), control)
    limiter = bl.EnabledSubsystem(diagram=inside(bl.Saturation(lower=-0.3, upper=0.3)))
    builder.add("total", bl.Integrator(), builder.add("sub", limiter, wave, enable=control))
    result = ab.simulate(builder.build(), stop_time=8.0, sample_time=0.05, **settings)
    on = result["hold" if sampled else "control"] > 0.0
    assert 20 < on.sum() < on.size - 20
    np.testing.assert_allclose(result["sub/o"][on], np.clip(result["wave"], -0.3, 0.3)[on], atol=1e-12)


@pytest.mark.parametrize("settings", RUNS, ids=lambda run: run["solver"])
def test_a_relay_keeps_its_mode_while_disabled(settings: dict[str, Any]) -> None:
    """On at 0.25 s, disabled from 0.4 s to 0.8 s; the input falls to 0.1, within the hysteresis: still on."""
    source = bl.FromTable(times=(0.0, 0.2, 0.3, 0.5, 0.6, 2.0), values=(0.0, 0.0, 1.0, 1.0, 0.1, 0.1))
    control = bl.FromTable(times=(0.0, 0.4, 0.8), values=(1.0, 0.0, 1.0), method="flat")
    result = ab.simulate(
        enabled_diagram(bl.Relay(on_value=2.0, off_value=-1.0), source, control),
        stop_time=1.0,
        sample_time=0.1,
        **settings,
    )
    assert result["sub/o"].tolist() == [-1.0] * 3 + [2.0] * 8


@pytest.mark.parametrize("settings", RUNS, ids=lambda run: run["solver"])
def test_the_motion_of_a_sliding_mass_is_suspended_while_disabled(settings: dict[str, Any]) -> None:
    """2 N stop 1 kg from 3 m/s within 1.5 s. It is disabled from 0.5 s to 1.5 s, so it rests after 2.5 s."""
    block = bl.StickSlipFriction(coulomb=2.0, static=2.5, initial_speed=3.0)
    control = bl.FromTable(times=(0.0, 0.5, 1.5), values=(1.0, 0.0, 1.0), method="flat")
    diagram = enabled_diagram(block, bl.Constant(value=0.0), control, end="v")
    result = ab.simulate(diagram, stop_time=4.0, sample_time=0.1, **settings)
    passed = np.minimum(result.time, 0.5) + np.maximum(result.time - 1.5, 0.0)
    np.testing.assert_allclose(result["sub/o"], np.maximum(3.0 - 2.0 * passed, 0.0), atol=1e-9)
    assert not result["sub/o"][result.time > 2.51].any()


@pytest.mark.parametrize("settings", RUNS, ids=lambda run: run["solver"])
def test_a_limited_integrator_that_is_reset_leaves_its_limit(settings: dict[str, Any]) -> None:
    """The integral rises with rate 1 to its limit 0.2; each enabling resets the integral to 0."""
    block = bl.IntegratorLimited(lower=-0.2, upper=0.2)
    control = bl.PulseGenerator(period=1.0, width=50.0)
    diagram = enabled_diagram(block, bl.Constant(value=1.0), control, end="y", when="reset")
    result = ab.simulate(diagram, stop_time=3.0, sample_time=0.05, **settings)
    since = result.time - np.floor(result.time + 1e-9)
    np.testing.assert_allclose(result["sub/o"], np.minimum(since, 0.2), atol=1e-9)


def test_no_event_is_computed_from_the_old_states_of_a_subsystem_when_it_is_enabled() -> None:
    """-1 while disabled, rising from 0 to 0.2 while enabled: 0.1 is crossed twice per period."""
    inner = ab.DiagramBuilder("inside")
    climb = inner.add("climb", bl.IntegratorLimited(upper=0.2), inner.input("u"))
    inner.add("o", bl.Outport(when_off="reset", initial=-1.0), climb["y"])
    builder = ab.DiagramBuilder("climbing")
    subsystem = bl.EnabledSubsystem(diagram=inner.build(), states_when_enabling="reset")
    control = builder.add("control", bl.PulseGenerator(period=1.0, width=50.0, delay=0.25))
    climbing = builder.add("sub", subsystem, builder.add("one", bl.Constant()), control)
    builder.add("hits", bl.HitCrossing(offset=0.1), climbing)
    result = ab.simulate(builder.build(), stop_time=4.0, sample_time=0.05)
    since = result.time - np.floor(result.time + 0.75 + 1e-9) + 0.75
    on = (since < 0.5 - 1e-9) & (result.time > 0.24)
    np.testing.assert_allclose(result["sub/o"], np.where(on, np.minimum(since, 0.2), -1.0), atol=1e-9)
    assert result["hits/count"][-1] == 2.0 * 4


@pytest.mark.parametrize("settings", RUNS, ids=lambda run: run["solver"])
def test_a_rate_limiter_that_is_reset_rises_again(settings: dict[str, Any]) -> None:
    """The input of the limiter is constant: a reset has the same effect as the start of a run."""
    builder = ab.DiagramBuilder("climbing")
    reset = builder.add("reset", bl.PulseGenerator(period=1.0, width=50.0, delay=0.25))
    limited = bl.ResettableSubsystem(diagram=inside(bl.RateLimiterContinuous()), edge="rising")
    builder.add("sub", limited, builder.add("level", bl.Constant(value=0.3)), reset)
    result = ab.simulate(builder.build(), stop_time=3.0, sample_time=0.05, **settings)
    since = np.where(
        result.time < 0.249, result.time, result.time - np.floor(result.time + 0.75 + 1e-9) + 0.75
    )
    np.testing.assert_allclose(result["sub/o"], np.minimum(since, 0.3), atol=1e-9)


def test_events_in_a_disabled_subsystem_do_not_change_the_result() -> None:
    """Events of comparisons are located also while the subsystem is disabled, without effect."""
    wave, control = bl.SineWave(frequency=50.0), bl.Step(time=0.7)
    located = ab.simulate(enabled_diagram(bl.CompareToZero(), wave, control), stop_time=1.0, sample_time=0.01)
    assert located.run.events > 10
    off = located.time < 0.7 - 1e-9
    assert not located["sub/o"][off].any()
    expected = np.sin(50.0 * located.time) <= 0.0
    assert located["sub/o"][~off].tolist() == expected[~off].astype(float).tolist()
    # Disabled until 0.7 s: the integral includes only the time after it.
    edges = np.arange(0, 20) * math.pi / 50.0
    low = [(edges[k], edges[k + 1]) for k in range(1, 19, 2)]
    exact = sum(max(0.0, min(b, 1.0) - max(a, 0.7)) for a, b in low)
    assert located["total"][-1] == pytest.approx(exact, abs=1e-9)


@pytest.mark.parametrize("settings", RUNS)
@pytest.mark.parametrize("source", [bl.Constant(value=1.0), bl.Step(time=1.0)])
def test_a_hysteresis_after_a_rate_limiter_uses_only_consistent_outputs(
    source: Block, settings: dict[str, Any]
) -> None:
    """Enabled at 1 s with the input 1, the limiter rises from 0 at 1/s. Its old mode would give 1 at once,
    which must not become the previous mode of the relay or of the backlash after it."""
    inner = ab.DiagramBuilder("inside")
    limited = inner.add("limited", bl.RateLimiterContinuous(), inner.input("u"))
    inner.output("relay", inner.add("switch", bl.Relay(), limited))
    inner.output("play", inner.add("gap", bl.Backlash(), limited))
    builder = ab.DiagramBuilder("enabled")
    enable = builder.add("enable", bl.Step(time=1.0))
    builder.add(
        "sub", bl.EnabledSubsystem(diagram=inner.build()), builder.add("source", source), enable=enable
    )
    result = ab.simulate(builder.build(), stop_time=2.5, sample_time=0.1, **settings)
    y = np.clip(result.time - 1.0, 0.0, 1.0)
    np.testing.assert_allclose(result["sub/gap/y"], np.maximum(y - 0.5, 0.0), atol=1e-9)
    away_from_limit = np.abs(y - 0.5) > 1e-6
    np.testing.assert_array_equal(result["sub/switch/y"][away_from_limit], (y > 0.5)[away_from_limit])


@pytest.mark.parametrize("settings", RUNS)
@pytest.mark.parametrize("block", [bl.Relay(), bl.Backlash()])
def test_a_hysteresis_ignores_a_jump_at_the_instant_at_which_it_is_disabled(
    block: Block, settings: dict[str, Any]
) -> None:
    """The input jumps from 0 to 2 when the subsystem is disabled, through two blocks with modes, and returns
    before it is enabled again: while it is enabled, the input of the block is never 2."""
    builder = ab.DiagramBuilder("disabled")
    jump = builder.add("jump", bl.Step(time=1.0, final=2.0))
    back = builder.add("back", bl.Step(time=2.0, final=2.0))
    pulse = builder.add("pulse", bl.Sum(signs="+-"), jump, back)
    high = builder.add("high", bl.Relay(on_point=1.5, off_point=0.5), pulse)
    low = builder.add("low", bl.CompareToConstant(relation="<", constant=0.5), high)
    builder.add("sub", bl.EnabledSubsystem(diagram=inside(block)), pulse, enable=low)
    result = ab.simulate(builder.build(), stop_time=3.0, sample_time=0.25, **settings)
    np.testing.assert_array_equal(result["pulse/y"], 2.0 * ((result.time >= 1.0) & (result.time < 2.0)))
    np.testing.assert_array_equal(result["sub/block/y"], 0.0)
    np.testing.assert_array_equal(result["sub"], 0.0)
