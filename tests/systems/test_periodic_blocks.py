"""First Order Hold, PWM and Memory compared with closed forms, for fixed and adaptive steps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from armblocks.blocks import (
    PWM,
    Clock,
    Constant,
    FirstOrderHold,
    Gain,
    Integrator,
    Memory,
    PulseGenerator,
    Ramp,
    SineWave,
    Sqrt,
    Sum,
    UnitDelay,
    ZeroOrderHold,
)
from armblocks.diagram import Block, Diagram, DiagramBuilder
from armblocks.equations import SimulationOptions
from armblocks.errors import ArmblocksError, DiagramError
from armblocks.simulation import simulate
from compiled_diagrams import compiled

Run = Callable[[Diagram, float], dict[str, np.ndarray]]
SAMPLES = 200


def native(solver: str, step: float | None = None) -> Run:
    def run(diagram: Diagram, stop: float) -> dict[str, np.ndarray]:
        options = SimulationOptions(
            stop_time=stop, sample_time=stop / SAMPLES, solver=solver, step=step, rtol=1e-10, atol=1e-12
        )
        result = simulate(compiled(diagram), options)
        return {name: result[name] for name in result.names} | {"t": result.time}

    return run


RUNS = {"adaptive": native("rk45"), "fixed": native("rk4", 0.013), "stiff": native("rodas5p")}


@pytest.fixture(params=RUNS.values(), ids=RUNS)
def run(request: pytest.FixtureRequest) -> Run:
    return request.param


def with_integral(block: Block, source: Block) -> Diagram:
    """A source, a block, and the integral of its output, which depends on the switching times."""
    builder = DiagramBuilder("d")
    out = builder.add("block", block, builder.add("source", source))
    builder.add("integral", Integrator(), out)
    return builder.build()


def sample_index(t: np.ndarray, period: float, offset: float = 0.0) -> np.ndarray:
    return np.floor((t - offset) / period + 1e-9)


@pytest.mark.parametrize("method", ["extrapolation", "interpolation"])
def test_a_first_order_hold_of_a_sine_is_piecewise_linear(run: Run, method: str) -> None:
    period, offset, first = 0.3, 0.2, 0.7
    block = FirstOrderHold(method=method, period=period, offset=offset, initial=first)
    result = run(with_integral(block, SineWave(frequency=1.3)), 4.0)
    t = result["t"]
    k = sample_index(t, period, offset)
    last = np.where(k < 0, first, np.sin(1.3 * (offset + k * period)))
    before = np.where(k < 1, first, np.sin(1.3 * (offset + (k - 1) * period)))
    start = last if method == "extrapolation" else before
    expected = start + (last - before) * np.where(k < 0, 0.0, (t - offset - k * period) / period)
    # The source is sampled at located times, exact to rounding.
    assert result["block/y"] == pytest.approx(expected, abs=1e-12)
    # The integral by the trapezoidal rule, exact for linear pieces.
    knots = np.unique(np.concatenate([t, offset + period * np.arange(14)]))
    knots = knots[knots <= t[-1]]
    j = sample_index(knots[:-1], period, offset)
    a = np.where(j < 0, first, np.sin(1.3 * (offset + j * period)))
    b = np.where(j < 1, first, np.sin(1.3 * (offset + (j - 1) * period)))
    middle = (knots[:-1] + knots[1:]) / 2
    height = (a if method == "extrapolation" else b) + (a - b) * np.where(
        j < 0, 0.0, (middle - offset - j * period) / period
    )
    assert result["integral/y"][-1] == pytest.approx(float(np.sum(height * np.diff(knots))), abs=1e-10)


def test_an_extrapolating_hold_is_exact_for_a_ramp(run: Run) -> None:
    result = run(with_integral(FirstOrderHold(period=0.25, initial=-0.25), Clock()), 3.0)
    assert result["block/y"] == pytest.approx(result["t"], abs=1e-12)


def test_a_first_order_hold_samples_a_sampled_block_at_the_same_tick(run: Run) -> None:
    builder = DiagramBuilder("d")
    held = builder.add("held", ZeroOrderHold(sample_time=0.1), builder.add("t", Clock()))
    builder.add("block", FirstOrderHold(period=0.1, method="interpolation"), held)
    result = run(builder.build(), 2.0)
    assert result["block/y"] == pytest.approx(np.maximum(result["t"] - 0.1, 0.0), abs=1e-12)


def test_a_first_order_hold_extrapolates_each_element(run: Run) -> None:
    result = run(
        with_integral(FirstOrderHold(period=0.5, initial=(1.0, 2.0)), Constant(value=(3.0, -4.0))), 2.0
    )
    assert result["block/y"][-1] == pytest.approx([3.0, -4.0])
    # 3 + (3 - 1) t / T within the first period
    early = result["t"] < 0.5 - 1e-9
    assert result["block/y"][early, 0] == pytest.approx(3.0 + 2.0 * result["t"][early] / 0.5, abs=1e-12)


def test_the_input_is_sampled_after_the_events_at_the_same_time(run: Run) -> None:
    """The edges of the pulses are at the sample times of the hold and of the PWM, including the start."""
    builder = DiagramBuilder("d")
    pulses = builder.add("pulses", PulseGenerator(period=0.5))
    builder.add("hold", FirstOrderHold(period=0.25, method="interpolation"), pulses)
    builder.add("pwm", PWM(period=0.25), pulses)
    result = run(builder.build(), 3.125)
    t = result["t"]
    k = sample_index(t, 0.25)
    sampled, before = 1.0 - k % 2, np.where(k < 1, 0.0, k % 2)
    assert result["hold/y"] == pytest.approx(before + (sampled - before) * (t / 0.25 - k), abs=1e-12)
    assert result["pwm/y"] == pytest.approx(sampled)


def test_a_chain_of_holds_has_the_value_of_its_source_at_each_sample_time(run: Run) -> None:
    """Each hold jumps at the sample time, and the next one samples after that jump."""
    builder = DiagramBuilder("d")
    out = builder.add("pulses", PulseGenerator(period=0.5))
    for number in range(4):
        out = builder.add(f"hold {number}", FirstOrderHold(period=0.25), out)
    result = run(builder.build(), 3.125)
    ticks = np.abs(result["t"] / 0.25 - np.round(result["t"] / 0.25)) < 1e-9
    assert result["hold 3/y"][ticks] == pytest.approx(result["pulses/y"][ticks], abs=1e-12)


@pytest.mark.parametrize("gain", [0.5, -0.9, 0.0])
def test_a_loop_through_an_extrapolating_hold_is_solved_at_each_sample_time(run: Run, gain: float) -> None:
    """u = gain y + 1, and y = u at the sample times."""
    result = run(loop_through_a_hold(gain), 1.0)
    assert result["sum/y"][::50] == pytest.approx(1.0 / (1.0 - gain), rel=1e-9)


def test_a_loop_through_an_extrapolating_hold_with_a_gain_above_1_is_refused() -> None:
    with pytest.raises(ArmblocksError, match=r"break the loop through .hold. with"):
        native("rk45")(loop_through_a_hold(-2.0), 1.0)


@pytest.mark.parametrize("block", [FirstOrderHold(period=0.2), PWM(period=0.2)])
def test_a_sample_that_is_not_a_number_is_an_error_of_the_block_that_causes_it(block: Block) -> None:
    builder = DiagramBuilder("d")
    root = builder.add("root", Sqrt(), builder.add("falling", Ramp(slope=-1.0, initial=0.5)))
    builder.add("block", block, root)
    with pytest.raises(ArmblocksError, match="'root/y' is nan"):
        native("rk45")(builder.build(), 1.0)


def loop_through_a_hold(gain: float) -> Diagram:
    builder = DiagramBuilder("d")
    hold = builder.add("hold", FirstOrderHold(period=0.25))
    total = builder.add(
        "sum", Sum(), builder.add("gain", Gain(gain=gain), hold), builder.add("1", Constant())
    )
    builder.connect(total, hold)
    return builder.build()


@pytest.mark.parametrize("duty", [-0.5, 0.0, 0.3, 1.0, 1.5])
def test_the_pulse_width_is_given_by_the_duty_cycle(run: Run, duty: float) -> None:
    result = run(with_integral(PWM(period=0.4, offset=0.1, amplitude=2.0), Constant(value=duty)), 3.99)
    t, width = result["t"], 0.4 * min(max(duty, 0.0), 1.0)
    k = sample_index(t, 0.4, 0.1)
    into = t - 0.1 - 0.4 * k
    expected = np.where(k < 0, 0.0, 2.0 * (np.maximum(k, 0) * width + np.minimum(into, width)))
    # Only exactly located edges give the integral to rounding.
    assert result["integral/y"] == pytest.approx(expected, abs=1e-11)
    assert result["block/y"] == pytest.approx(np.where((k >= 0) & (into < width - 1e-9), 2.0, 0.0))


def test_the_duty_cycle_is_sampled_at_the_start_of_each_period(run: Run) -> None:
    result = run(with_integral(PWM(period=0.5), Ramp(slope=0.25)), 4.0)
    t = result["t"]
    widths = 0.5 * np.minimum(0.25 * 0.5 * np.arange(9), 1.0)
    k = sample_index(t, 0.5).astype(int)
    expected = np.concatenate([[0.0], np.cumsum(widths)])[k] + np.minimum(t - 0.5 * k, widths[k])
    assert result["integral/y"] == pytest.approx(expected, abs=1e-11)


def test_a_memory_is_a_unit_delay_at_its_ticks(run: Run) -> None:
    builder = DiagramBuilder("d")
    wave = builder.add("wave", SineWave())
    held = builder.add("held", ZeroOrderHold(sample_time=0.25), wave)
    builder.add("inherits", Memory(sample_time=-1.0, initial=0.5), held)
    builder.add("samples", Memory(sample_time=0.25, initial=0.5), wave)
    builder.add("delay", UnitDelay(sample_time=0.25, initial=0.5), wave)
    result = run(builder.build(), 3.0)
    k = sample_index(result["t"], 0.25)
    expected = np.where(k < 1, 0.5, np.sin(0.25 * (k - 1)))
    for name in ("inherits", "samples", "delay"):
        assert result[f"{name}/y"] == pytest.approx(expected, abs=1e-12)


def test_a_memory_of_a_continuous_signal_is_refused_with_a_fix() -> None:
    builder = DiagramBuilder("d")
    builder.add("memory", Memory(sample_time=-1.0), builder.add("wave", SineWave()))
    with pytest.raises(DiagramError, match=r"'wave.*' changes continuously.*set the sample_time.*Transport"):
        builder.build()
