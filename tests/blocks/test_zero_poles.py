"""Zeros, poles and filters compared with SciPy: designs, and step responses with fixed and adaptive steps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy import signal

from armblocks.blocks import BLOCKS, AnalogFilter, DigitalFilter, DiscreteZeroPole, SineWave, Step, ZeroPole
from armblocks.blocks.linear_systems import ZeroPoleGain, realised
from armblocks.diagram import Block, DiagramBuilder
from armblocks.equations import SimulationOptions
from armblocks.errors import InputError
from armblocks.formats import read_diagram, write_diagram
from armblocks.simulation import simulate
from compiled_diagrams import compiled

SOLVERS = pytest.mark.parametrize(("solver", "step"), [("rk45", None), ("rk4", 0.002)])
SYSTEMS = [
    ([1.0], [0.0, -1.0], 1.0),
    ([], [-2.0], 3.0),
    ([-3.0], [-2.0], 3.0),
    ([-0.5 + 2j, -0.5 - 2j], [-1.0, -3.0], 2.0),
    ([-0.5 + 2j, -0.5 - 2j, 4.0], [-1.0, -1.0, -3.0, -2 + 5j, -2 - 5j], 2.0),
    ([0.0], [-1 + 20j, -1 - 20j, -0.1], 50.0),
    ([], [-1 + 1j, -1 - 1j, -2 + 1j, -2 - 1j, -0.5], 7.0),
]


def run(
    block: Block, source: Block, sample: float, solver: str = "auto", step: float | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    builder = DiagramBuilder("d")
    builder.add("block", block, builder.add("u", source))
    options = SimulationOptions(
        stop_time=4.0, sample_time=sample, solver=solver, step=step, rtol=1e-10, atol=1e-12
    )
    result = simulate(compiled(builder.build()), options)
    return result.time, result["u/y"], result["block/y"]


@SOLVERS
@pytest.mark.parametrize(("zeros", "poles", "gain"), SYSTEMS)
def test_step_responses_agree_with_scipy(
    zeros: list[complex], poles: list[complex], gain: float, solver: str, step: float | None
) -> None:
    t, _, y = run(ZeroPole(zeros=zeros, poles=poles, gain=gain), Step(time=0.0), 0.02, solver, step)
    # an independent realisation: the polynomials in controllable canonical form
    _, expected = signal.step(signal.ZerosPolesGain(zeros, poles, gain).to_tf(), T=t)
    # error of the fixed steps: (|pole| h)^5 / 120 per step; the fastest pole is 20 rad/s
    np.testing.assert_allclose(y, expected, atol=2e-4 if step and max(map(abs, poles)) > 10 else 2e-8)


@pytest.mark.parametrize(("zeros", "poles", "gain"), SYSTEMS)
def test_the_realised_chain_has_the_frequency_response_of_the_roots(
    zeros: list[complex], poles: list[complex], gain: float
) -> None:
    system = realised(ZeroPoleGain(zeros=np.array(zeros, complex), poles=np.array(poles, complex), gain=gain))
    for s in 1j * np.logspace(-2, 3, 30):
        direct = gain * np.prod([s - z for z in zeros]) / np.prod([s - p for p in poles])
        chain = system.C @ np.linalg.solve(s * np.eye(len(poles)) - system.A, system.B) + system.D
        assert chain == pytest.approx(direct, rel=1e-11)


def test_thirty_close_poles_are_realised_accurately() -> None:
    """Thirty poles in a narrow band, which the rounded coefficients of their polynomial cannot represent."""
    z, p, k = signal.butter(15, [100.0, 110.0], "bandpass", analog=True, output="zpk")
    points = 1j * np.linspace(90.0, 120.0, 31)
    expected = np.array([k * np.prod(s - z) / np.prod(s - p) for s in points])
    actual = response(AnalogFilter(filter_type="band_pass", order=15, edge=100.0, upper_edge=110.0), points)
    np.testing.assert_allclose(actual, expected, rtol=1e-9)
    multiplied = signal.freqs(*signal.zpk2tf(z, p, k), points.imag)[1]
    assert np.max(np.abs(multiplied - expected) / np.abs(expected)) > 1e-6


@pytest.mark.parametrize(
    ("zeros", "poles"),
    [([], [0.5]), ([0.2, -0.4], [0.5, 0.5]), ([1j, -1j], [0.9, 0.3 + 0.6j, 0.3 - 0.6j]), ([0.0], [0.0, 0.5])],
)
def test_sampled_systems_agree_with_scipy(zeros: list[complex], poles: list[complex]) -> None:
    block = DiscreteZeroPole(zeros=zeros, poles=poles, gain=1.5, sample_time=0.1)
    _, u, y = run(block, SineWave(frequency=3.0, phase=0.4), 0.1)
    b, a = signal.zpk2tf(zeros, poles, 1.5)
    expected = signal.lfilter(np.concatenate([np.zeros(len(a) - len(b)), b]), a, u)
    np.testing.assert_allclose(y, expected, atol=1e-12)


def response(block: Block, points: np.ndarray) -> np.ndarray:
    system = block.system  # type: ignore[attr-defined]
    return np.array(
        [
            system.C @ np.linalg.solve(s * np.eye(len(system.B)) - system.A, system.B) + system.D
            for s in points
        ]
    )


@pytest.mark.parametrize("order", [1, 2, 3, 4, 7])
@pytest.mark.parametrize("kind", ["low_pass", "high_pass", "band_pass", "band_stop"])
@pytest.mark.parametrize("design", ["butterworth", "chebyshev1", "chebyshev2"])
def test_filters_agree_with_scipy(design: str, kind: str, order: int) -> None:
    scipy_kind = kind.replace("_", "")
    band = kind.startswith("band")
    design_of = {
        "butterworth": lambda e, a: signal.butter(order, e, scipy_kind, analog=a, output="zpk"),
        "chebyshev1": lambda e, a: signal.cheby1(order, 0.5, e, scipy_kind, analog=a, output="zpk"),
        "chebyshev2": lambda e, a: signal.cheby2(order, 30.0, e, scipy_kind, analog=a, output="zpk"),
    }[design]
    common = {"design": design, "filter_type": kind, "order": order, "ripple": 0.5, "attenuation": 30.0}

    points = 1j * np.logspace(-1, 3, 41)
    z, p, k = design_of([5.0, 40.0] if band else 5.0, True)
    expected = [k * np.prod(s - z) / np.prod(s - p) for s in points]
    actual = response(AnalogFilter(edge=5.0, upper_edge=40.0, **common), points)
    np.testing.assert_allclose(actual, expected, rtol=1e-9, atol=1e-12)

    circle = np.exp(1j * np.pi * np.linspace(0.01, 0.99, 41))
    z, p, k = design_of([0.2, 0.5] if band else 0.2, False)
    expected = [k * np.prod(s - z) / np.prod(s - p) for s in circle]
    actual = response(DigitalFilter(edge=0.2, upper_edge=0.5, **common), circle)
    np.testing.assert_allclose(actual, expected, rtol=1e-9, atol=1e-12)


@SOLVERS
def test_a_simulated_filter_agrees_with_scipy(solver: str, step: float | None) -> None:
    t, _, y = run(AnalogFilter(order=4, edge=6.0), Step(time=0.0), 0.02, solver, step)
    _, expected = signal.step(signal.butter(4, 6.0, analog=True), T=t)
    np.testing.assert_allclose(y, expected, atol=1e-7)
    _, u, y = run(DigitalFilter(order=3, edge=0.1, sample_time=0.02), SineWave(frequency=9.0), 0.02)
    np.testing.assert_allclose(y, signal.lfilter(*signal.butter(3, 0.1), u), atol=1e-12)


def test_a_file_keeps_zeros_and_poles(tmp_path: Path) -> None:
    builder = DiagramBuilder("roots")
    builder.add("none", ZeroPole(zeros=[], poles=[-1 + 2j, -1 - 2j]), builder.add("u", Step()))
    diagram = builder.build()
    path = write_diagram(tmp_path / "roots.json", diagram)
    assert read_diagram(path, BLOCKS) == diagram
    assert diagram.blocks["none"].parameter_value("poles") == ((-1.0, 2.0), (-1.0, -2.0))


def test_invalid_zeros_poles_and_filters_are_refused() -> None:
    with pytest.raises(InputError, match=r"ZeroPole: the system has 2 zeros and 1 pole.*is not causal"):
        ZeroPole(zeros=[1.0, 2.0], poles=[-1.0])
    with pytest.raises(InputError, match="complex numbers in conjugate pairs"):
        ZeroPole(zeros=[], poles=[-1 + 2j, -1 - 3j])
    with pytest.raises(InputError, match=r"poles has shape \(1, 3\)\. Allowed: \(n,\), or \(n, 2\)"):
        DiscreteZeroPole(poles=[[1.0, 2.0, 3.0]])
    with pytest.raises(InputError, match=r"edge is 2\.0 and upper_edge is 1\.0\. Allowed: edge < upper_edge"):
        AnalogFilter(filter_type="band_pass", edge=2.0, upper_edge=1.0)
