"""Periodic sources, and lags after them, compared with closed forms, with fixed and adaptive steps."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal
from scipy.interpolate import interp1d

from armblocks.blocks import (
    CounterFreeRunning,
    FirstOrderLag,
    Integrator,
    LeadLag,
    RepeatingSequence,
    RepeatingSequenceInterpolated,
    RepeatingSequenceStair,
    SecondOrderLag,
    SignalGenerator,
    SineWave,
    Step,
    TransferFunctionFirstOrder,
    TransferFunctionLeadOrLag,
    TransferFunctionRealZero,
)
from armblocks.diagram import Block, DiagramBuilder
from armblocks.equations import SimulationOptions
from armblocks.errors import InputError
from armblocks.simulation import simulate
from compiled_diagrams import compiled

SOLVERS = pytest.mark.parametrize(("solver", "step"), [("rk45", None), ("rk4", 0.01)])


def run(
    source: Block, *chain: Block, solver: str = "auto", step: float | None = None, stop: float = 5.0
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Return the times and the outputs of a source and of the blocks in series after it."""
    builder = DiagramBuilder("d")
    last = builder.add("b0", source)
    for k, block in enumerate(chain, 1):
        last = builder.add(f"b{k}", block, last["y"])
    options = SimulationOptions(
        stop_time=stop, sample_time=stop / 200, solver=solver, step=step, rtol=1e-10, atol=1e-12
    )
    result = simulate(compiled(builder.build()), options)
    return result.time, [result[f"b{k}/y"] for k in range(len(chain) + 1)]


@SOLVERS
def test_a_sawtooth_falls_and_jumps(solver: str, step: float | None) -> None:
    block = SignalGenerator(waveform="sawtooth", amplitude=[2.0, -1.0], frequency=0.7)
    t, (y, area) = run(block, Integrator(), solver=solver, step=step)
    s = 0.7 * t - np.floor(0.7 * t * (1 + 1e-14))
    np.testing.assert_allclose(y, np.outer(1.0 - 2.0 * s, [2.0, -1.0]), atol=1e-12)
    # steps end at the edges, and all these methods integrate a linear function exactly
    np.testing.assert_allclose(area, np.outer((s - s**2) / 0.7, [2.0, -1.0]), atol=1e-12)


@SOLVERS
@pytest.mark.parametrize(("units", "frequency"), [("Hz", 0.5), ("rad/s", np.pi)])
def test_a_square_wave_starts_low(units: str, frequency: float, solver: str, step: float | None) -> None:
    block = SignalGenerator(waveform="square", amplitude=3.0, frequency=frequency, units=units)
    t, (y, area) = run(block, Integrator(), solver=solver, step=step)
    high = np.floor(t * (1 + 1e-14)) % 2
    assert y.tolist() == (6.0 * high - 3.0).tolist()
    phase = t - 2.0 * np.floor(t / 2.0 * (1 + 1e-14))
    np.testing.assert_allclose(area, 3.0 * np.abs(phase - 1.0) - 3.0, atol=1e-12)


def test_a_signal_generator_has_its_frequency_in_the_chosen_unit() -> None:
    t, (y,) = run(SignalGenerator(amplitude=3.0, frequency=0.5))
    np.testing.assert_allclose(y, 3.0 * np.sin(np.pi * t), atol=1e-13)
    t, (y,) = run(SignalGenerator(amplitude=3.0, frequency=0.5, units="rad/s"))
    np.testing.assert_allclose(y, 3.0 * np.sin(0.5 * t), atol=1e-13)


@SOLVERS
def test_a_repeating_sequence_is_periodic(solver: str, step: float | None) -> None:
    corners, values = [0.0, 0.3, 0.4, 0.9], [1.0, -2.0, 5.0, 2.0]
    block = RepeatingSequence(times=corners, values=values)
    t, (y, area) = run(block, Integrator(), solver=solver, step=step)
    periods = np.floor(t / 0.9 * (1 + 1e-14))
    phase = np.maximum(t - 0.9 * periods, 0.0)
    np.testing.assert_allclose(y, np.interp(phase, corners, values), atol=1e-11)
    areas = np.concatenate([[0.0], np.cumsum(np.diff(corners) * (np.array(values[1:]) + values[:-1]) / 2.0)])
    piece = np.clip(np.searchsorted(corners, phase, side="right") - 1, 0, 2)
    since = phase - np.array(corners)[piece]
    mean = (np.array(values)[piece] + np.interp(phase, corners, values)) / 2.0
    np.testing.assert_allclose(area, periods * areas[-1] + areas[piece] + since * mean, atol=1e-11)


@pytest.mark.parametrize(
    ("method", "kind"), [("linear", "linear"), ("nearest", "nearest-up"), ("flat", "previous")]
)
def test_an_interpolated_repeating_sequence_is_periodic(method: str, kind: str) -> None:
    corners, values = [0.0, 0.1, 0.5, 0.6, 1.0], [3.0, 1.0, 4.0, 2.0, 1.5]
    block = RepeatingSequenceInterpolated(times=corners, values=values, method=method, sample_time=0.0625)
    t, (y,) = run(block)
    phase = np.floor(t / 0.0625) * 0.0625 % 1.0
    np.testing.assert_allclose(y, interp1d(corners, values, kind=kind)(phase), atol=1e-12)


def test_stairs_and_counters_count_ticks() -> None:
    t, (y,) = run(RepeatingSequenceStair(values=[3.0, 1.0, 4.0], sample_time=0.1))
    ticks = np.floor(t / 0.1 * (1 + 1e-12)).astype(int)
    assert y.tolist() == np.array([3.0, 1.0, 4.0])[ticks % 3].tolist()
    t, (y,) = run(CounterFreeRunning(bits=3, sample_time=0.1))
    assert y.tolist() == (ticks % 8).tolist()


@pytest.mark.parametrize("kind", [RepeatingSequence, RepeatingSequenceInterpolated])
def test_a_sequence_that_does_not_start_at_time_zero_is_refused(kind: type[Block]) -> None:
    with pytest.raises(InputError, match=r"the first of the times is 0\.5\. Allowed: times that start at 0"):
        kind(times=[0.5, 1.0], values=[0.0, 1.0])


@SOLVERS
@pytest.mark.parametrize(
    ("block", "numerator", "denominator"),
    [
        (FirstOrderLag(gain=3.0, time_constant=0.4), [3.0], [0.4, 1.0]),
        (SecondOrderLag(gain=2.0, natural_frequency=5.0, damping=0.3), [50.0], [1.0, 3.0, 25.0]),
        (LeadLag(gain=2.0, lead_time=0.5, lag_time=0.2), [1.0, 2.0], [0.2, 1.0]),
    ],
)
def test_step_responses_of_lags_agree_with_their_transfer_functions(
    block: Block, numerator: list[float], denominator: list[float], solver: str, step: float | None
) -> None:
    t, (_, y) = run(Step(time=0.0), block, solver=solver, step=step)
    _, expected = signal.step((numerator, denominator), T=t)
    # error of a fourth-order method at 0.01 s: (5 * 0.01)^4 / 120 over the run
    np.testing.assert_allclose(y, expected, atol=1e-6 if step else 1e-8)


@pytest.mark.parametrize(
    ("block", "numerator", "denominator"),
    [
        (TransferFunctionFirstOrder(pole=0.8, sample_time=0.1), [0.2, 0.0], [1.0, -0.8]),
        (TransferFunctionLeadOrLag(pole=0.9, zero=0.5, sample_time=0.1), [1.0, -0.5], [1.0, -0.9]),
        (TransferFunctionRealZero(zero=0.6, sample_time=0.1), [1.0, -0.6], [1.0, 0.0]),
    ],
)
def test_outputs_of_sampled_lags_agree_with_their_transfer_functions(
    block: Block, numerator: list[float], denominator: list[float]
) -> None:
    t, (u, y) = run(SineWave(frequency=3.0, phase=0.4), block)
    at_ticks = slice(None, None, 4)  # 200 samples in 5 s, four in each sample time of 0.1 s
    assert t[at_ticks][1] == pytest.approx(0.1)
    np.testing.assert_allclose(y[at_ticks], signal.lfilter(numerator, denominator, u[at_ticks]), atol=1e-13)


def test_initial_values_of_sampled_transfer_functions_are_their_previous_values() -> None:
    _, (u, y) = run(
        SineWave(phase=0.4),
        TransferFunctionLeadOrLag(pole=0.9, zero=0.5, initial=2.0, initial_input=3.0, sample_time=0.1),
    )
    assert y[0] == pytest.approx(0.9 * 2.0 + u[0] - 0.5 * 3.0, rel=1e-15)
    _, (u, y) = run(SineWave(phase=0.4), TransferFunctionFirstOrder(pole=0.8, initial=2.0, sample_time=0.1))
    assert y[0] == pytest.approx(0.8 * 2.0 + 0.2 * u[0], rel=1e-15)
    _, (u, y) = run(SineWave(phase=0.4), TransferFunctionRealZero(initial_input=2.0, sample_time=0.1))
    assert y[0] == pytest.approx(u[0] - 0.75 * 2.0, rel=1e-15)
