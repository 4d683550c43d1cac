"""Second-order integrators, variable limits, limited rates and sampled logic compared with closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from reference_simulator import run_reference

from armblocks.blocks import (
    BLOCKS,
    Clock,
    Constant,
    Counter,
    DeadZoneDynamic,
    DFlipFlop,
    EdgeDetection,
    FromTable,
    Gain,
    HitCrossing,
    Integrator,
    JKFlipFlop,
    MinMaxRunningResettable,
    RateLimiterContinuous,
    RateLimiterDynamic,
    SaturationDynamic,
    SecondOrderIntegrator,
    SecondOrderIntegratorLimited,
    SineWave,
    SRFlipFlop,
    Step,
    Sum,
    VariableIntegerDelay,
    WrapToZero,
)
from armblocks.diagram import Block, Diagram, DiagramBuilder
from armblocks.equations import SimulationOptions
from armblocks.errors import DiagramError, InputError
from armblocks.simulation import simulate
from compiled_diagrams import compiled

Run = Callable[[Diagram, float], dict[str, np.ndarray]]
SAMPLES = 100


def native(solver: str, step: float | None = None) -> Run:
    def run(diagram: Diagram, stop: float) -> dict[str, np.ndarray]:
        options = SimulationOptions(
            stop_time=stop, sample_time=stop / SAMPLES, solver=solver, step=step, rtol=1e-10, atol=1e-12
        )
        result = simulate(compiled(diagram), options)
        return {name: result[name] for name in result.names} | {"t": result.time}

    return run


def by_reference(diagram: Diagram, stop: float) -> dict[str, np.ndarray]:
    times = np.arange(SAMPLES + 1) * (stop / SAMPLES)
    return run_reference(diagram, times.tolist(), step=stop / SAMPLES / 3) | {"t": times}


RUNS = {"adaptive": native("rk45"), "fixed": native("rk4", 0.01), "reference": by_reference}
NATIVE = pytest.mark.parametrize("run", [RUNS["adaptive"], RUNS["fixed"]], ids=["adaptive", "fixed"])


@pytest.fixture(params=RUNS.values(), ids=RUNS)
def run(request: pytest.FixtureRequest) -> Run:
    return request.param


def close(actual: np.ndarray, expected: np.ndarray, tolerance: float = 5e-9) -> None:
    # rtol 1e-10 over a few hundred steps; RK4 with h = 0.01 s on sines: h^4/120 = 1e-10
    assert actual == pytest.approx(expected, abs=tolerance)


def ball(
    rest_speed: float = 1e-6, height: float = 1.0, speed: float = 0.0, restitution: float = 0.7
) -> Diagram:
    builder = DiagramBuilder("d")
    motion = SecondOrderIntegratorLimited(
        initial=height, initial_speed=speed, lower=0.0, reinitialize=True, rest_speed=rest_speed
    )
    ball = builder.add("ball", motion, builder.add("gravity", Constant(value=-9.81)))
    builder.connect(builder.add("bounce", Gain(gain=-restitution), ball["dx"]), ball["dx0"])
    return builder.build()


@NATIVE
def test_a_spring_and_mass_oscillate_with_their_closed_form(run: Run) -> None:
    builder = DiagramBuilder("d")
    mass = builder.add("mass", SecondOrderIntegrator(initial=1.0, initial_speed=2.0))
    builder.connect(builder.add("spring", Gain(gain=-4.0), mass["x"]), mass["u"])
    result = run(builder.build(), 10.0)
    close(result["mass/x"], np.cos(2 * result["t"]) + np.sin(2 * result["t"]), 2e-7)
    close(result["mass/dx"], 2 * np.cos(2 * result["t"]) - 2 * np.sin(2 * result["t"]), 4e-7)


@NATIVE
def test_a_ball_bounces_and_comes_to_rest_while_the_run_continues(run: Run) -> None:
    """The bounces end at t1 (1 + e) / (1 - e); below the rest speed the ball is exactly at rest."""
    result = run(ball(), 4.0)
    t, first = result["t"], math.sqrt(2 / 9.81)
    starts, speed, start = [], 9.81 * first, first
    while start < 4.0 and speed * 0.7 > 1e-6:
        speed *= 0.7
        starts.append((start, speed))
        start += 2 * speed / 9.81
    assert start == pytest.approx(2.55863396558581, abs=1e-6)  # the published end time of the bounces
    expected = np.where(t < first, 1 - 9.81 * t**2 / 2, 0.0)
    for begins, v in starts:
        within = (t >= begins) & (t < begins + 2 * v / 9.81)
        expected = np.where(within, v * (t - begins) - 9.81 * (t - begins) ** 2 / 2, expected)
    close(result["ball/x"], expected, 1e-8)
    rests = t > start + 1e-9
    assert rests.sum() > 30
    assert not result["ball/x"][rests].any()
    assert not result["ball/dx"][rests].any()


@NATIVE
def test_a_mass_at_rest_on_its_limit_is_accelerated_away(run: Run) -> None:
    builder = DiagramBuilder("d")
    motion = SecondOrderIntegratorLimited(initial=0.5, lower=0.0)
    push = builder.add("push", Step(time=1.0, initial=-1.0, final=2.0))
    builder.add("mass", motion, push)
    result = run(builder.build(), 3.0)
    t = result["t"]
    close(result["mass/x"], np.where(t < 1.0, 0.5 - t**2 / 2, (t - 1.0) ** 2), 1e-9)
    builder = DiagramBuilder("d")
    builder.add("mass", motion, builder.add("push", Step(time=2.0, initial=-1.0, final=2.0)))
    result = run(builder.build(), 3.0)
    t = result["t"]
    close(result["mass/x"], np.where(t < 1.0, 0.5 - t**2 / 2, np.clip(t - 2.0, 0, None) ** 2), 1e-9)


def test_speed_and_position_have_limits(run: Run) -> None:
    """u = 1: speed 1 from t = 1, limit 2 reached at t = 2.5; u = -1 from t = 4."""
    builder = DiagramBuilder("d")
    mass = SecondOrderIntegratorLimited(upper=2.0, lower=-10.0, upper_speed=1.0, lower_speed=-0.5)
    builder.add("mass", mass, builder.add("u", Step(time=4.0, initial=1.0, final=-1.0)))
    result = run(builder.build(), 6.0)
    t = result["t"]
    rise = np.select([t < 1, t < 2.5, t < 4, t < 4.5], [t**2 / 2, t - 0.5, 2.0, 2 - (t - 4) ** 2 / 2])
    close(result["mass/x"], np.where(t < 4.5, rise, 1.875 - 0.5 * (t - 4.5)), 1e-9)
    speed = np.select([t < 1, t < 2.5, t < 4, t < 4.5], [t, 1.0, 0.0, 4.0 - t], -0.5)
    assert result["mass/dx"][(abs(t - 2.5) > 0.01)] == pytest.approx(speed[abs(t - 2.5) > 0.01], abs=1e-9)


def test_limits_of_the_speed_must_include_zero_if_the_position_is_limited() -> None:
    message = r"x has a limit, and dx is held between -inf and -1\.0\. Allowed: lower_speed <= 0"
    with pytest.raises(InputError, match=message):
        SecondOrderIntegratorLimited(initial=1.0, lower=0.0, upper_speed=-1.0)
    with pytest.raises(InputError, match=r"where x has a limit, because the speed is 0 there"):
        SecondOrderIntegratorLimited(upper=(2.0, math.inf), lower_speed=(1.0, 1.0))
    SecondOrderIntegratorLimited(upper=(2.0, math.inf), lower_speed=(0.0, 1.0))
    SecondOrderIntegratorLimited(lower=0.0, lower_speed=1.0)


def test_an_integrator_follows_a_falling_limit(run: Run) -> None:
    """The integral of a ramp reaches the falling limit 2 - t/2 at t = 4/3."""
    for kind, name in ((SaturationDynamic, "held"), (DeadZoneDynamic, "rest")):
        builder = DiagramBuilder("d")
        t = builder.add("t", Clock())
        falling = builder.add("f", Gain(gain=-0.5), t)
        upper = builder.add("upper", Sum(signs="++"), builder.add("two", Constant(value=2.0)), falling)
        lower = builder.add("lower", Constant(value=-5.0))
        builder.add("integral", Integrator(), builder.add(name, kind(), upper, t, lower))
        result = run(builder.build(), 5.0)
        time, meets = result["t"], 4.0 / 3.0
        after = np.clip(time - meets, 0.0, None)
        held = np.minimum(time, meets) ** 2 / 2 + meets * after - after**2 / 4
        expected = held if kind is SaturationDynamic else time**2 / 2 - held
        close(result["integral/y"], expected, 1e-10)


def test_a_ramp_is_zero_after_its_wrap_threshold(run: Run) -> None:
    builder = DiagramBuilder("d")
    wrapped = builder.add("wrapped", WrapToZero(threshold=2.0), builder.add("t", Clock()))
    builder.add("integral", Integrator(), wrapped)
    result = run(builder.build(), 5.0)
    close(result["integral/y"], np.minimum(result["t"], 2.0) ** 2 / 2, 1e-11)


def test_crossings_are_counted_and_timed(run: Run) -> None:
    for direction, expected in (("either", 6), ("rising", 3), ("falling", 3)):
        builder = DiagramBuilder("d")
        builder.add("hits", HitCrossing(offset=0.5, direction=direction), builder.add("u", SineWave()))
        builder.add("keeps the steps short", Integrator(), builder.add("v", SineWave()))
        result = run(builder.build(), 6 * math.pi)
        assert result["hits/count"][-1] == expected
        last = 4 * math.pi + (math.pi / 6 if direction == "rising" else 5 * math.pi / 6)
        assert result["hits/last"][-1] == pytest.approx(last, abs=1e-9)


def test_a_rate_limiter_follows_a_sine_where_its_rate_is_allowed(run: Run) -> None:
    """The output rises with rate 0.5 from 0 until it reaches sin t, which it follows where |cos t| <= 0.5."""
    builder = DiagramBuilder("d")
    limited = builder.add(
        "limited", RateLimiterContinuous(rising=0.5, falling=-0.5), builder.add("u", SineWave())
    )
    builder.add("integral", Integrator(), limited)
    result = run(builder.build(), 6.0)

    def meets(start: float, value: float, rate: float, guess: float) -> float:
        for _ in range(60):
            gap = math.sin(guess) - value - rate * (guess - start)
            guess -= gap / (math.cos(guess) - rate)
        return guess

    up = meets(0.0, 0.0, 0.5, 1.9)
    departure = 2 * math.pi / 3  # cos = -0.5
    down = meets(departure, math.sin(departure), -0.5, 5.0)
    t = result["t"]
    expected = np.select(
        [t < up, t < departure, t < down],
        [0.5 * t, np.sin(t), math.sin(departure) - 0.5 * (t - departure)],
        np.sin(t),
    )
    # after it reaches sin t at `down`, sin t rises faster than 0.5: limited to 0.5 again
    value = math.sin(down)
    after = np.minimum(np.sin(t), value + 0.5 * (t - down)) if math.cos(down) > 0.5 else np.sin(t)
    close(result["limited/y"], np.where(t < down, expected, after), 2e-6)


def test_a_jump_becomes_a_ramp(run: Run) -> None:
    builder = DiagramBuilder("d")
    builder.add("limited", RateLimiterContinuous(rising=2.0), builder.add("u", Step(time=1.0, final=3.0)))
    result = run(builder.build(), 4.0)
    close(result["limited/y"], np.clip(2.0 * (result["t"] - 1.0), 0.0, 3.0), 1e-9)


def test_constant_limit_signals_agree_with_limit_parameters(run: Run) -> None:
    builder = DiagramBuilder("d")
    u = builder.add("u", SineWave())
    builder.add("fixed", RateLimiterContinuous(rising=0.5, falling=-0.3), u)
    rising, falling = builder.add("r", Constant(value=0.5)), builder.add("f", Constant(value=-0.3))
    builder.add("moving", RateLimiterDynamic(), rising, u, falling)
    result = run(builder.build(), 6.0)
    close(result["moving/y"], result["fixed/y"], 1e-9)


def test_a_rate_limit_that_falls_below_the_rate_of_the_input_takes_effect(run: Run) -> None:
    """u = t, limit 2 - t: y = u until t = 1, then y' = 2 - t."""
    builder = DiagramBuilder("d")
    rising = builder.add(
        "rising", Sum(signs="+-"), builder.add("two", Constant(value=2.0)), builder.add("t", Clock())
    )
    builder.add(
        "y", RateLimiterDynamic(), rising, builder.add("u", Clock()), builder.add("f", Constant(value=-1.0))
    )
    result = run(builder.build(), 2.5)
    t = result["t"]
    close(result["y/y"], np.where(t < 1.0, t, 1.0 + (0.5 - (2.0 - t) ** 2 / 2)), 1e-8)


def test_after_a_jump_the_output_rises_with_a_growing_rate_limit(run: Run) -> None:
    """After a jump by 2 at 1 s with the rate limit t, y = t^2/2 - 1/2 reaches 2 at sqrt(5) s."""
    builder = DiagramBuilder("d")
    jump, clock = builder.add("u", Step(time=1.0, final=2.0)), builder.add("t", Clock())
    builder.add("y", RateLimiterDynamic(), clock, jump, builder.add("f", Constant(value=-1.0)))
    result = run(builder.build(), 4.0)
    t = result["t"]
    close(result["y/y"], np.select([t < 1.0, t < math.sqrt(5.0)], [0.0 * t, (t**2 - 1.0) / 2], 2.0), 1e-8)


# -- sampled logic -----------------------------------------------------------------------------------------


def tick_outputs(block: Block, *input_values: list[float]) -> dict[str, list[float]]:
    """Return the outputs of a block with the period 1 s for inputs given for each tick."""
    builder = DiagramBuilder("d")
    n = len(input_values[0])
    fed = [
        builder.add(f"u{k}", FromTable(times=np.arange(n), values=values, method="flat"))
        for k, values in enumerate(input_values)
    ]
    builder.add("block", block, *fed)
    options = SimulationOptions(stop_time=float(n - 1), sample_time=1.0)
    result = simulate(compiled(builder.build()), options)
    return {port.name: result[f"block/{port.name}"].tolist() for port in block.output_ports()}


U = [0.0, 1.0, 1.0, 0.0, -1.0, -1.0, 0.0, 2.0]


@pytest.mark.parametrize(
    ("edge", "expected"),
    [
        ("change", [0, 1, 0, 1, 1, 0, 1, 1]),
        ("increase", [0, 1, 0, 0, 0, 0, 1, 1]),
        ("decrease", [0, 0, 0, 1, 1, 0, 0, 0]),
        ("rise positive", [0, 1, 0, 0, 0, 0, 0, 1]),
        ("rise nonnegative", [0, 0, 0, 0, 0, 0, 1, 0]),
        ("fall negative", [0, 0, 0, 0, 1, 0, 0, 0]),
        ("fall nonpositive", [0, 0, 0, 1, 0, 0, 0, 0]),
    ],
)
def test_edges_are_detected_at_their_ticks(edge: str, expected: list[float]) -> None:
    assert tick_outputs(EdgeDetection(edge=edge, sample_time=1.0), U)["y"] == expected


def test_flip_flops_agree_with_their_truth_tables() -> None:
    S, R = [0, 1, 0, 0, 1, 0, 0], [0, 0, 0, 1, 1, 0, 0]
    result = tick_outputs(SRFlipFlop(sample_time=1.0), S, R)
    assert result["Q"] == [0, 1, 1, 0, 0, 0, 0]
    assert result["not_Q"] == [1, 0, 0, 1, 0, 1, 1]
    D, clock = [3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0], [0, 1, 1, 0, 1, 0, 1]
    result = tick_outputs(DFlipFlop(sample_time=1.0), D, clock)
    assert result["Q"] == [0, 4, 4, 4, 7, 7, 9]
    assert result["not_Q"] == [1, 0, 0, 0, 0, 0, 0]
    assert tick_outputs(DFlipFlop(sample_time=1.0, trigger="level"), D, clock)["Q"] == [0, 4, 5, 5, 7, 7, 9]
    J, K = [1, 1, 0, 0, 1, 1, 1, 1], [0, 0, 1, 1, 1, 1, 1, 1]
    pulses = [1, 0, 1, 0, 1, 0, 1, 0]
    result = tick_outputs(JKFlipFlop(sample_time=1.0), J, pulses, K)
    assert result["Q"] == [0, 1, 1, 0, 0, 1, 1, 0]
    assert result["not_Q"] == [1, 0, 0, 1, 1, 0, 0, 1]


def test_counters_and_running_extremes_restart_at_a_reset() -> None:
    reset = [0, 0, 0, 0, 0, 1, 0, 0]
    assert tick_outputs(Counter(sample_time=1.0, initial=10.0), U, reset)["y"] == [
        10,
        11,
        11,
        11,
        11,
        10,
        10,
        11,
    ]
    highest = tick_outputs(MinMaxRunningResettable(function="max", initial=0.5, sample_time=1.0), U, reset)
    assert highest["y"] == [0.5, 1, 1, 1, 1, 0.5, 0.5, 2]


def test_a_delay_of_variable_length_outputs_the_chosen_sample() -> None:
    u, d = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], [0.0, 1.0, 1.9, 3.0, 9.0, -1.0]
    delayed = tick_outputs(VariableIntegerDelay(longest=3, initial=-1.0, sample_time=1.0), u, d)
    assert delayed["y"] == [1, 1, 2, 1, 2, 6]
    builder = DiagramBuilder("d")
    matrix = builder.add("m", Constant(value=np.eye(2)))
    builder.add("block", VariableIntegerDelay(sample_time=1.0), matrix, builder.add("d", Constant(value=1.0)))
    with pytest.raises(
        DiagramError, match=r"'u' has shape .*Allowed: a scalar or a vector. Fix: put a Reshape"
    ):
        builder.build()


def test_the_tested_blocks_are_in_the_library() -> None:
    assert {"SecondOrderIntegratorLimited", "RateLimiterContinuous", "EdgeDetection"} <= set(BLOCKS)
