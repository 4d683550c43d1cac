"""Sampled, switching and implicit diagrams compared with closed forms, for fixed and adaptive steps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from reference_simulator import run_reference

from armblocks.blocks import (
    Backlash,
    Clock,
    Constant,
    CoulombFriction,
    DeadZone,
    Gain,
    Integrator,
    IntegratorLimited,
    PulseGenerator,
    Quantizer,
    Relay,
    ResettableIntegrator,
    Saturation,
    SineWave,
    Step,
    StickSlipFriction,
    Sum,
    Switch,
    Trigonometry,
    UnitDelay,
    ZeroOrderHold,
)
from armblocks.diagram import Block, BlockHandle, Diagram, DiagramBuilder, trace_diagram
from armblocks.equations import SimulationOptions
from armblocks.simulation import simulate
from compiled_diagrams import compiled

Run = Callable[[Diagram, float], dict[str, np.ndarray]]
SAMPLES = 100


def native_run(solver: str, step: float | None = None) -> Run:
    def run(diagram: Diagram, stop: float) -> dict[str, np.ndarray]:
        options = SimulationOptions(
            stop_time=stop, sample_time=stop / SAMPLES, solver=solver, step=step, rtol=1e-10, atol=1e-12
        )
        result = simulate(compiled(diagram), options)
        return {name: result[name] for name in result.names} | {"t": result.time}

    return run


def reference_run(diagram: Diagram, stop: float) -> dict[str, np.ndarray]:
    times = np.arange(SAMPLES + 1) * (stop / SAMPLES)
    return run_reference(diagram, times.tolist(), step=stop / SAMPLES / 3) | {"t": times}


RUNS = {"adaptive": native_run("rk45"), "fixed": native_run("rk4", 0.01), "reference": reference_run}


@pytest.fixture(params=RUNS.values(), ids=RUNS)
def run(request: pytest.FixtureRequest) -> Run:
    return request.param


def with_integral(block: Block, source: Block, *, name: str = "block") -> Diagram:
    """A source, a block, and the integral of its output. This integral depends on the switching times."""
    builder = DiagramBuilder("d")
    out = builder.add(name, block, builder.add("source", source))
    builder.add("integral", Integrator(), out)
    return builder.build()


def assert_close(actual: np.ndarray, expected: np.ndarray, tolerance: float = 5e-9) -> None:
    # rtol 1e-10 over a few hundred steps; RK4 with h = 0.01 s on sines: h^4/120 = 1e-10
    assert actual == pytest.approx(expected, abs=tolerance)


# -- sampled blocks -----------------------------------------------------------------------------------------


def test_a_sampled_loop_around_an_integrator_agrees_with_its_recurrence(run: Run) -> None:
    """x' = -k x(jT): x((j+1)T) = (1 - kT) x(jT), and x is linear between the ticks."""
    builder = DiagramBuilder("d")
    x = builder.add("x", Integrator(initial=1.0))
    hold = builder.add("hold", ZeroOrderHold(sample_time=0.25), x)
    builder.connect(builder.add("k", Gain(gain=-2.0), hold), x)
    result = run(builder.build(), 2.0)
    j = np.floor(result["t"] / 0.25 + 1e-9)
    start = 0.5**j
    assert_close(result["hold/y"], start, 1e-14)
    assert_close(result["x/y"], start * (1 - 2.0 * (result["t"] - 0.25 * j)), 1e-14)


def test_a_hold_samples_an_exponential_exactly(run: Run) -> None:
    """The hold of x' = -x gives exp(-jT) exactly at jT, also where jT is not a multiple of the step."""
    builder = DiagramBuilder("d")
    x = builder.add("x", Integrator(initial=1.0))
    builder.connect(builder.add("k", Gain(gain=-1.0), x), x)
    builder.add("hold", ZeroOrderHold(sample_time=(0.3, 0.1)), x)
    result = run(builder.build(), 3.0)
    j = np.floor((result["t"] - 0.1) / 0.3 + 1e-9)
    assert_close(result["hold/y"], np.where(j >= 0, np.exp(-(0.1 + 0.3 * j)), 0.0))


def test_slow_blocks_sample_fast_ones_at_common_ticks(run: Run) -> None:
    """A slow block samples the fast one at a common tick; the delay outputs the previous value."""
    builder = DiagramBuilder("d")
    t = builder.add("t", Clock())
    fast = builder.add("fast", ZeroOrderHold(sample_time=0.2), t)
    slow = builder.add("slow", ZeroOrderHold(sample_time=0.5), fast)
    builder.add("before", UnitDelay(), slow)
    result = run(builder.build(), 5.0)
    fast_tick = 0.2 * np.floor(result["t"] / 0.2 + 1e-9)
    slow_tick = 0.5 * np.floor(result["t"] / 0.5 + 1e-9)
    sampled = 0.2 * np.floor(slow_tick / 0.2 + 1e-9)
    assert_close(result["fast/y"], fast_tick, 1e-14)
    assert_close(result["slow/y"], sampled, 1e-14)
    before = np.where(slow_tick > 0, 0.2 * np.floor((slow_tick - 0.5) / 0.2 + 1e-9), 0.0)
    assert_close(result["before/y"], before, 1e-14)


def test_a_limiter_between_sampled_blocks_limits_at_the_tick(run: Run) -> None:
    builder = DiagramBuilder("d")
    hold = builder.add("hold", ZeroOrderHold(sample_time=0.5), builder.add("t", Clock()))
    limit = builder.add("limit", Saturation(lower=-1.0, upper=1.2), hold)
    builder.add("again", ZeroOrderHold(), limit)
    result = run(builder.build(), 5.0)
    expected = np.minimum(0.5 * np.floor(result["t"] / 0.5 + 1e-9), 1.2)
    assert_close(result["again/y"], expected, 1e-15)
    assert_close(result["limit/y"], expected, 1e-15)


# -- switching ---------------------------------------------------------------------------------------------


def test_saturation_and_dead_zone_of_a_sine_have_exact_integrals(run: Run) -> None:
    """The integral is exact only if steps end at the kinks, at sin t = 1/2."""
    t = np.linspace(0.0, 3.0, SAMPLES + 1)
    edge = np.pi / 6
    rise, fall = np.minimum(t, edge), np.maximum(t - (np.pi - edge), 0.0)
    flat = np.clip(t - edge, 0.0, np.pi - 2 * edge)
    limited = (1 - np.cos(rise)) + 0.5 * flat + (np.cos(np.pi - edge) - np.cos(np.pi - edge + fall))
    result = run(with_integral(Saturation(), SineWave()), 3.0)
    assert_close(result["block/y"], np.clip(np.sin(t), -0.5, 0.5))
    assert_close(result["integral/y"], limited)
    result = run(with_integral(DeadZone(), SineWave()), 3.0)
    assert_close(result["block/y"], np.maximum(np.sin(t) - 0.5, 0.0))
    assert_close(result["integral/y"], 1 - np.cos(t) - limited)


def test_a_limited_step_jumps_from_the_upper_to_the_lower_limit(run: Run) -> None:
    result = run(with_integral(Saturation(), Step(time=1.0, initial=3.0, final=-2.0)), 2.0)
    assert result["block/y"].tolist() == [0.5] * 50 + [-0.5] * 51
    assert_close(result["integral/y"][-1:], np.zeros(1), 1e-14)


def test_a_relay_with_hysteresis_switches_at_its_thresholds(run: Run) -> None:
    """The relay is on from pi/6 (sin t = 0.5, rising) to 7 pi/6 (sin t = -0.5, falling)."""
    result = run(with_integral(Relay(on_value=2.0, off_value=-1.0), SineWave()), 6.0)
    t = result["t"]
    on = (t >= np.pi / 6) & (t < 7 * np.pi / 6)
    assert result["block/y"].tolist() == np.where(on, 2.0, -1.0).tolist()
    assert_close(result["integral/y"], -t + 3 * np.clip(t - np.pi / 6, 0.0, np.pi))


def test_a_thermostat_oscillates_with_the_exact_period(run: Run) -> None:
    """x' = 1 until x = 1, then x' = -1 until x = -1: a triangle wave with a period of 4 s."""
    builder = DiagramBuilder("d")
    x = builder.add("x", Integrator())
    relay = builder.add("relay", Relay(on_point=1.0, off_point=-1.0, on_value=-1.0, off_value=1.0), x)
    builder.connect(relay, x)
    result = run(builder.build(), 12.5)
    phase = (result["t"] + 1.0) % 4.0
    assert_close(result["x/y"], 1.0 - np.abs(phase - 2.0), 1e-10)


def test_a_quantizer_switches_between_its_levels_at_the_exact_times(run: Run) -> None:
    result = run(with_integral(Quantizer(interval=0.4), SineWave()), 3.0)
    t = result["t"]
    assert result["block/y"] == pytest.approx(0.4 * np.floor(np.sin(t) / 0.4 + 0.5), abs=1e-15)
    edges = np.arcsin([0.2, 0.6])
    levels = 0.4 * sum(np.clip(t - edge, 0, np.pi - 2 * edge) for edge in edges)
    # Downward steps are late: their threshold is lower by 1e-9 intervals.
    assert_close(result["integral/y"], levels, 2e-9)


def test_coulomb_friction_changes_its_sign_with_the_speed(run: Run) -> None:
    result = run(with_integral(CoulombFriction(offset=2.0, gain=3.0), SineWave(frequency=2.0)), 3.0)
    t, u = result["t"], np.sin(2.0 * result["t"])
    assert result["block/y"][0] == 0.0
    assert_close(result["block/y"], np.sign(u) * 2.0 + 3.0 * u)
    integral = 2.0 * (np.minimum(t, np.pi / 2) - np.maximum(t - np.pi / 2, 0.0)) + 1.5 * (1 - np.cos(2 * t))
    assert_close(result["integral/y"], integral)


def test_the_output_of_a_backlash_follows_and_rests(run: Run) -> None:
    """u = sin t, width 0.5: y leaves 0 at sin t = 0.25, and stays 0.75 from pi/2 until sin t = 0.5."""
    result = run(with_integral(Backlash(width=0.5), SineWave()), 6.0)
    t, u = result["t"], np.sin(result["t"])
    expected = np.where(t < np.pi / 2, np.maximum(u - 0.25, 0.0), np.minimum(u + 0.25, 0.75))
    expected = np.where(t > 3 * np.pi / 2, np.maximum(u - 0.25, -0.75), expected)
    assert_close(result["block/y"], expected)


def test_a_switch_changes_at_its_threshold(run: Run) -> None:
    builder = DiagramBuilder("d")
    t, one = builder.add("t", Clock()), builder.add("one", Constant(value=5.0))
    switch = builder.add("switch", Switch(threshold=0.7), one, t, t)
    builder.add("integral", Integrator(), switch)
    result = run(builder.build(), 2.0)
    assert_close(result["switch/y"], np.where(result["t"] >= 0.7, 5.0, result["t"]), 1e-12)
    assert_close(
        result["integral/y"],
        np.minimum(result["t"], 0.7) ** 2 / 2 + 5 * np.maximum(result["t"] - 0.7, 0),
        1e-11,
    )


def test_a_pulse_generator_has_exact_edges(run: Run) -> None:
    builder = DiagramBuilder("d")
    pulses = builder.add("pulses", PulseGenerator(amplitude=3.0, period=0.5, width=50.0, delay=0.125))
    builder.add("integral", Integrator(), pulses)
    result = run(builder.build(), 2.0)
    since = result["t"] - 0.125
    count = np.floor(since / 0.5)
    within = since - 0.5 * count
    assert result["pulses/y"].tolist() == np.where((since >= 0) & (within < 0.25), 3.0, 0.0).tolist()
    area = np.where(since < 0, 0.0, 0.75 * count + 3.0 * np.minimum(within, 0.25))
    assert_close(result["integral/y"], area, 1e-11)


def test_a_limited_integrator_stays_at_its_limit_and_leaves_it_without_delay(run: Run) -> None:
    """x' = 2 cos t, |x| <= 1: x is 1 from pi/6 until cos t < 0 at pi/2, then 2 sin t - 1."""
    builder = DiagramBuilder("d")
    rate = builder.add("rate", SineWave(amplitude=2.0, phase=np.pi / 2))
    builder.add("x", IntegratorLimited(), rate)
    result = run(builder.build(), 3.0)
    t = result["t"]
    expected = np.where(t < np.pi / 2, np.minimum(2 * np.sin(t), 1.0), 2 * np.sin(t) - 1.0)
    assert_close(result["x/y"], expected)
    assert result["x/saturated"].tolist() == ((t >= np.pi / 6) & (t < np.pi / 2)).astype(float).tolist()


def test_an_integrator_is_reset_at_the_edges_of_pulses(run: Run) -> None:
    """The integral of 1 is reset at rising edges (0.5 s, 1 s, …) or falling edges (0.25 s, 0.75 s, …)."""
    builder = DiagramBuilder("d")
    pulses = builder.add("pulses", PulseGenerator(period=0.5, width=50.0))
    one = builder.add("one", Constant())
    builder.add("rising", ResettableIntegrator(initial=0.25), one, pulses)
    builder.add("falling", ResettableIntegrator(external_reset="falling"), one, pulses)
    result = run(builder.build(), 2.0)
    t = result["t"]
    assert_close(result["rising/y"], 0.25 + t - 0.5 * np.floor(t / 0.5), 1e-12)
    since = t - 0.25
    assert_close(result["falling/y"], np.where(since < 0, t, since - 0.5 * np.floor(since / 0.5)), 1e-12)


def ball(builder: DiagramBuilder, restitution: float, height: float) -> BlockHandle:
    """Add a ball that falls from ``height`` (m); each impact multiplies its speed by -``restitution``."""
    g = builder.add("g", Constant(value=-9.81))
    speed = builder.add(
        "speed",
        ResettableIntegrator(external_reset="falling", initial_condition_source="external at resets"),
    )
    builder.connect(g, speed["u"])
    builder.connect(builder.add("bounce", Gain(gain=-restitution), speed), speed["initial"])
    position = builder.add("height", Integrator(initial=height), speed)
    builder.connect(position, speed["reset"])
    return position


def test_a_bouncing_ball_reaches_the_ground_at_the_published_times(run: Run) -> None:
    """h0 = 1 m, e = 0.7: the impact times (s) are those of the FMI reference."""
    builder = DiagramBuilder("d")
    ball(builder, 0.7, 1.0)
    result = run(builder.build(), 1.8)
    impacts = [0.451523640985731, 1.08365673836575, 1.52614990653177]
    t, v = result["t"], 9.81 * impacts[0]
    height = 1.0 - 9.81 * t**2 / 2
    for k, impact in enumerate(impacts):
        since = t - impact
        height = np.where(since >= 0, 0.7 ** (k + 1) * v * since - 9.81 * since**2 / 2, height)
    assert_close(result["height/y"], height, 1e-9)


def test_a_sliding_mass_comes_to_rest_exactly(run: Run) -> None:
    """v0 = 3 m/s with 2 N on 1 kg: the mass stops after 1.5 s and 2.25 m with a speed of exactly 0."""
    builder = DiagramBuilder("d")
    force = builder.add("force", Constant(value=0.0))
    builder.add("mass", StickSlipFriction(coulomb=2.0, static=2.5, initial_speed=3.0), force)
    result = run(builder.build(), 3.0)
    t = np.minimum(result["t"], 1.5)
    assert_close(result["mass/x"], 3 * t - t**2, 1e-11)
    assert_close(result["mass/v"], 3 - 2 * t, 1e-11)
    assert not result["mass/v"][51:].any()


def test_a_stuck_mass_breaks_away_at_the_exact_time(run: Run) -> None:
    """F = t: the mass sticks until t = 1.2, then v' = t - 1."""
    builder = DiagramBuilder("d")
    builder.add("mass", StickSlipFriction(), builder.add("force", Clock()))
    result = run(builder.build(), 3.0)
    t = result["t"]
    assert not result["mass/v"][t < 1.2 - 1e-9].any()
    since = np.maximum(t - 1.2, 0.0)
    assert_close(result["mass/v"], 0.2 * since + since**2 / 2, 1e-10)
    # at 1.2 s, the values before and after the event are both correct
    other = np.abs(t - 1.2) > 1e-9
    assert_close(result["mass/friction"][other], np.where(t < 1.2, t, 1.0)[other], 1e-10)


# -- implicit equations ------------------------------------------------------------------------------------


def test_a_constant_nonlinear_loop_is_solved(run: Run) -> None:
    """The solution of u = cos(u) is 0.739…, and x' = u."""
    builder = DiagramBuilder("d")
    u = builder.add("u", Trigonometry(function="cos"))
    builder.connect(u, u)
    builder.add("x", Integrator(), u)
    result = run(builder.build(), 2.0)
    assert_close(result["u/y"], np.full(SAMPLES + 1, 0.7390851332151607), 1e-14)
    assert_close(result["x/y"], 0.7390851332151607 * result["t"], 1e-12)


def test_an_implicit_equation_that_depends_on_time_is_solved(run: Run) -> None:
    """u = t + cos(u)/2 has the derivative u' = 1 / (1 + sin(u)/2)."""
    builder = DiagramBuilder("d")
    t = builder.add("t", Clock())
    u = builder.add("u", Sum(), t)
    half = builder.add("half", Gain(gain=0.5), builder.add("cos", Trigonometry(function="cos"), u))
    builder.connect(half, u["u2"])
    result = run(builder.build(), 3.0)
    assert_close(result["u/y"], result["t"] + np.cos(result["u/y"]) / 2, 1e-13)


def test_a_loop_with_saturation_is_piecewise_linear(run: Run) -> None:
    """u = 2 sin t - sat(u): u is sin t while |sin t| < 1/2, and 2 sin t ∓ 1/2 beyond."""
    builder = DiagramBuilder("d")
    source = builder.add("source", SineWave(amplitude=2.0))
    u = builder.add("u", Sum(signs="+-"), source)
    builder.connect(builder.add("limit", Saturation(), u), u["u2"])
    diagram = builder.build()
    assert trace_diagram(diagram).algebraic.size == 0
    result = run(diagram, 3.0)
    s = np.sin(result["t"])
    assert_close(result["u/y"], np.where(s < 0.5, s, 2 * s - 0.5))
