"""Slider gain, sample time arithmetic and sine wave function, in fixed and adaptive runs."""

from __future__ import annotations

import numpy as np
import pytest

from armblocks.blocks import Clock, Integrator, SineWave, SineWaveFunction, SliderGain, WeightedSampleTime
from armblocks.diagram import Block, DiagramBuilder
from armblocks.equations import SimulationOptions
from armblocks.errors import InputError
from armblocks.simulation import SimulationResult, simulate
from compiled_diagrams import compiled


def run(block: Block, source: Block, solver: str = "auto") -> SimulationResult:
    builder = DiagramBuilder("d")
    handle = builder.add("b", block, builder.add("u", source))
    builder.add("x", Integrator(), handle)
    step = 0.01 if solver == "rk4" else None
    options = SimulationOptions(
        stop_time=2.0, sample_time=0.1, solver=solver, step=step, rtol=1e-10, atol=1e-12
    )
    return simulate(compiled(builder.build()), options)


@pytest.mark.parametrize("solver", ["rk45", "rk4"])
def test_a_sine_of_the_clock_agrees_with_the_sine_wave(solver: str) -> None:
    parameters = {"amplitude": 2.0, "frequency": 3.0, "phase": 0.4, "bias": -1.0}
    result = run(SineWaveFunction(**parameters), Clock(), solver)
    t = result.time
    np.testing.assert_allclose(result["b/y"], 2.0 * np.sin(3.0 * t + 0.4) - 1.0, rtol=1e-13)
    area = 2.0 / 3.0 * (np.cos(0.4) - np.cos(3.0 * t + 0.4)) - t
    # error of Simpson's rule with 0.01 s: 2 * (3 * 0.01)^4 / 2880 * 2 s
    np.testing.assert_allclose(result["x/y"], area, atol=2e-9)


@pytest.mark.parametrize("solver", ["rk45", "rk4"])
def test_a_slider_gain_multiplies_its_input(solver: str) -> None:
    result = run(SliderGain(gain=1.5), Clock(), solver)
    np.testing.assert_allclose(result["x/y"], 0.75 * result.time**2, atol=1e-12)
    with pytest.raises(InputError, match=r"gain is 3\.0\. Allowed: low <= gain <= high: 0\.0 to 2\.0"):
        SliderGain(gain=3.0)


@pytest.mark.parametrize(
    ("operation", "expected"),
    [("+", lambda u: u + 0.3), ("-", lambda u: u - 0.3), ("*", lambda u: u * 0.3), ("/", lambda u: u / 0.3)],
)
def test_the_weighted_sample_time_is_combined_with_the_input(operation: str, expected: object) -> None:
    block = WeightedSampleTime(operation=operation, weight=3.0, sample_time=0.1)
    result = run(block, SineWave())
    np.testing.assert_allclose(result["b/y"], expected(result["u/y"]), rtol=1e-14)  # type: ignore[operator]
