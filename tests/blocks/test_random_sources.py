"""Random numbers: the generator compared bit for bit with integer arithmetic, and statistical tests.

The bounds are those of tests at the 0.1 % level. The seeds are fixed, so that no test fails by chance.
"""

from __future__ import annotations

import numpy as np
import pytest
from casadi import SX, Function
from scipy import special, stats

from armblocks.blocks import (
    BandLimitedWhiteNoise,
    FirstOrderLag,
    RandomNumber,
    UniformRandomNumber,
)
from armblocks.blocks.random_streams import normal_quantile
from armblocks.diagram import Block, DiagramBuilder, trace_diagram
from armblocks.equations import SimulationOptions
from armblocks.integration.system import compile_system
from armblocks.simulation import simulate
from compiled_diagrams import compiled

M1, M2 = 4294967087, 4294944443
A1 = ((0, 1, 0), (0, 0, 1), (-810728, 1403580, 0))
A2 = ((0, 1, 0), (0, 0, 1), (-1370589, 0, 527612))


def power(matrix: tuple[tuple[int, ...], ...], exponent: int, modulus: int) -> np.ndarray:
    """A matrix power modulo m, in integers of any size."""
    result, square = np.eye(3, dtype=object), np.array(matrix, dtype=object)
    while exponent:
        if exponent & 1:
            result = result.dot(square) % modulus
        square = square.dot(square) % modulus
        exponent >>= 1
    return result


def reference(seed: int, element: int, count: int) -> list[float]:
    """MRG32k3a in Python's integers, from the start of a stream."""
    jump = seed * 2**127 + element * 2**76
    first, second = (
        list(power(matrix, jump, modulus).dot([12345] * 3) % modulus)
        for matrix, modulus in ((A1, M1), (A2, M2))
    )
    numbers = list[float]()
    for _ in range(count):
        first = [*first[1:], (1403580 * first[1] - 810728 * first[0]) % M1]
        second = [*second[1:], (527612 * second[2] - 1370589 * second[0]) % M2]
        numbers.append(((first[2] - second[2]) % M1 or M1) / (M1 + 1))
    return numbers


def outputs(block: Block, count: int, period: float = 0.001) -> np.ndarray:
    """Return the outputs at the first ticks, computed by native code."""
    builder = DiagramBuilder("d")
    builder.add("noise", block)
    options = SimulationOptions(stop_time=(count - 1) * period, sample_time=period)
    return simulate(compiled(builder.build()), options)["noise/y"]


def test_the_generator_agrees_with_mrg32k3a_to_the_last_bit() -> None:
    block = UniformRandomNumber(minimum=[0.0, 0.0, 0.0], seed=54321, sample_time=0.001)
    expected = [reference(54321, element, 2000) for element in range(3)]
    assert outputs(block, 2000).T.tolist() == expected
    # the first numbers of L'Ecuyer's program with its default seed
    assert reference(0, 0, 3) == pytest.approx([0.127011122, 0.318527565, 0.309186015], abs=1e-9)


def test_each_matrix_element_has_its_own_stream_row_by_row() -> None:
    values = outputs(UniformRandomNumber(minimum=np.zeros((2, 2)), seed=7, sample_time=0.001), 5)
    for element in range(4):
        assert values[:, element // 2, element % 2].tolist() == reference(7, element, 5)


def test_the_normal_quantile_agrees_with_scipy() -> None:
    p = SX.sym("p")
    quantile = Function("f", [p], [normal_quantile(p)])
    tails = 10.0 ** -np.linspace(0.5, 9.0, 60)
    points = np.concatenate([np.linspace(1e-3, 1.0 - 1e-3, 997), tails, 1.0 - tails[tails > 1e-6]])
    quantiles = np.array([float(quantile(point)) for point in points])
    # AS 241 has an error of 1e-16; SciPy's own rounding adds to it
    np.testing.assert_allclose(quantiles, special.ndtri(points), rtol=1e-14, atol=1e-15)


@pytest.mark.parametrize("seed", [0, 1, 2, 65535])
def test_normal_numbers_are_normally_distributed_and_uncorrelated(seed: int) -> None:
    count = 20_000
    values = outputs(RandomNumber(mean=3.0, variance=4.0, seed=seed, sample_time=0.001), count)
    normal = (values - 3.0) / 2.0
    assert abs(normal.mean()) < 3.3 / np.sqrt(count)
    assert abs(normal.var() - 1.0) < 3.3 * np.sqrt(2.0 / count)
    assert stats.kstest(normal, "norm").pvalue > 1e-3
    counts = np.histogram(stats.norm.cdf(normal), bins=100, range=(0.0, 1.0))[0]
    assert stats.chisquare(counts).pvalue > 1e-3
    for lag in (1, 2, 3, 10):
        assert abs(np.mean(normal[lag:] * normal[:-lag])) < 3.3 / np.sqrt(count)


def test_streams_are_independent() -> None:
    count = 20_000
    one, two = outputs(RandomNumber(mean=[0.0, 0.0], seed=3, sample_time=0.001), count).T
    other = outputs(RandomNumber(seed=4, sample_time=0.001), count)
    for left, right in ((one, two), (one, other), (two, other)):
        assert abs(np.mean(left * right)) < 3.3 / np.sqrt(count)


def test_uniform_numbers_are_uniformly_distributed() -> None:
    values = outputs(UniformRandomNumber(minimum=-2.0, maximum=5.0, seed=9, sample_time=0.001), 20_000)
    assert -2.0 < values.min() < -1.99 < 4.99 < values.max() < 5.0
    assert stats.kstest((values + 2.0) / 7.0, "uniform").pvalue > 1e-3


def test_the_seed_is_tunable() -> None:
    builder = DiagramBuilder("d")
    builder.add("noise", UniformRandomNumber(minimum=0.0, sample_time=0.001))
    compiled = compile_system(trace_diagram(builder.build()))
    options = SimulationOptions(stop_time=0.01, sample_time=0.001)
    repeated = simulate(compiled, options, {"noise.seed": 12.0})
    assert repeated["noise/y"].tolist() == reference(12, 0, 11)


@pytest.mark.parametrize("solver", ["rk45", "rk4"])
def test_white_noise_after_a_lag_has_the_theoretical_variance(solver: str) -> None:
    """x' = (n - x) / tau with noise of power P has variance P / (2 tau) as T goes to 0.

    With n held for T it is exactly (P / T) (1 - a) / (1 + a), a = exp(-T / tau).
    """
    power, tau, period, stop = 0.4, 0.05, 0.002, 400.0
    builder = DiagramBuilder("d")
    noise = builder.add("noise", BandLimitedWhiteNoise(noise_power=power, sample_time=period))
    builder.add("lag", FirstOrderLag(time_constant=tau), noise)
    step = period if solver == "rk4" else None
    options = SimulationOptions(stop_time=stop, sample_time=0.05, solver=solver, step=step)
    result = simulate(compiled(builder.build()), options)
    values = result["lag/y"][20:]
    a = np.exp(-period / tau)
    exact = power / period * (1 - a) / (1 + a)
    assert exact == pytest.approx(power / (2 * tau), rel=1e-3)
    # samples are 0.05 s = tau apart with correlation 1/e: the number of independent samples is count tanh(1)
    independent = len(values) * np.tanh(1.0)
    assert values.var() == pytest.approx(exact, rel=3.3 * np.sqrt(2.0 / independent))
