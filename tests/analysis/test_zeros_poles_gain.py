"""Transfer functions of systems that are built from chosen zeros, poles and gains, over many decades."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from numpy.typing import NDArray

from armblocks.analysis.connections import series
from armblocks.analysis.linear_system import LinearSystem
from armblocks.analysis.shown_values import shown_zeros

Array = NDArray[np.float64]
SEEDS = range(40)


def agree(found: NDArray[np.complex128], expected: list[float], tolerance: float) -> bool:
    """Whether real numbers are equal, each with a relative tolerance."""
    a, b = np.sort(found.real), np.sort(np.array(expected))
    return len(a) == len(b) and bool((np.abs(a - b) <= tolerance * np.abs(b)).all())


def chain(
    random: np.random.Generator, sections: int, dt: float = 0.0, decades: tuple[float, float] = (-6.0, 10.0)
) -> tuple[LinearSystem, list[float], list[float], float]:
    """A series connection with its zeros, poles and leading coefficient, in random units of the states.

    The roots of one section are within five decades about a number in a range given by ``decades``; with
    ``dt`` they are inside the unit circle.
    """
    zeros: list[float] = []
    poles: list[float] = []
    gain = 10.0 ** random.uniform(-12.0, 12.0)
    no_states = np.zeros((0, 0))
    system = LinearSystem(no_states, np.zeros((0, 1)), np.zeros((1, 0)), [[gain]], dt=dt)
    for _ in range(sections):
        p, q, z = -(10.0 ** (random.uniform(*decades) + random.uniform(-2.5, 2.5, 3)))
        if dt:
            p, q, z = random.uniform(-0.9, 0.9, 3).tolist()
        kind = int(random.integers(3))
        if kind == 0:  # 1 / (s - p)
            part = LinearSystem([[p]], [[1.0]], [[1.0]], [[0.0]], dt=dt)
            poles += [p]
        elif kind == 1:  # (s - z) / ((s - p) (s - q))
            part = LinearSystem([[0.0, 1.0], [-p * q, p + q]], [[0.0], [1.0]], [[-z, 1.0]], [[0.0]], dt=dt)
            zeros, poles = [*zeros, z], [*poles, p, q]
        else:  # (s - p - z) / (s - p), with direct feedthrough
            part = LinearSystem([[p]], [[1.0]], [[-z]], [[1.0]], dt=dt)
            zeros, poles = [*zeros, p + z], [*poles, p]
        system = series(part, system)
    units = 10.0 ** random.integers(-6, 7, system.order)
    order = random.permutation(system.order)
    scaled = LinearSystem(
        (system.A * units / units[:, None])[np.ix_(order, order)],
        (system.B / units[:, None])[order],
        (system.C * units)[:, order],
        system.D,
        dt=dt,
    )
    return scaled, zeros, poles, gain


@pytest.mark.parametrize("dt", [0.0, 0.1])
@pytest.mark.parametrize("seed", SEEDS)
def test_chosen_zeros_poles_and_gain_are_found_over_many_decades(seed: int, dt: float) -> None:
    random = np.random.default_rng(seed)
    system, zeros, poles, gain = chain(random, 1 + seed % 4, dt)
    function = system.transfer_function()
    tolerance = 1e-6 if dt else 1e-8  # neighbouring poles of a discrete system are ill-conditioned
    assert agree(function.zeros, zeros, tolerance)
    assert agree(function.poles, poles, tolerance)
    assert function.gain == pytest.approx(gain, rel=1e-9)
    if not dt:
        assert agree(shown_zeros(system), zeros, 1e-8)
        signs = [np.sign(function.numerator), np.sign(function.denominator)]
        assert all((sign == 1.0).all() for sign in signs)
        text = repr(function).splitlines()
        assert text[2].count(" + ") == len(poles)
        assert text[0].count(" + ") == len(zeros)


@pytest.mark.parametrize("seed", SEEDS)
def test_zeros_of_several_channels_are_those_of_the_channels_that_are_mixed(seed: int) -> None:
    """``U diag(h) V`` with constant U and V has the zeros of all h, for square and other shapes."""
    random = np.random.default_rng(seed)
    channels = [chain(random, 2, decades=(-0.5, 0.5)) for _ in range(2)]
    n = [channel[0].order for channel in channels]
    A, B, C, D = (np.zeros(shape) for shape in ((sum(n), sum(n)), (sum(n), 2), (2, sum(n)), (2, 2)))
    for k, (system, *_) in enumerate(channels):
        rows = slice(k * n[0], n[0] + k * n[1])
        A[rows, rows], B[rows, k], C[k, rows], D[k, k] = system.A, system.B[:, 0], system.C[0], system.D[0, 0]
    outputs, inputs = [(2, 2), (3, 2), (2, 3)][seed % 3]
    left, right = random.integers(1, 9, (outputs, 2)) * 1.0, random.integers(1, 9, (2, inputs)) * 1.0
    left[:2, :2] += 9.0 * np.eye(2)
    right[:2, :2] += 9.0 * np.eye(2)
    units = 10.0 ** random.integers(-9, 10, outputs)[:, None]
    # Mixed outputs have one scale only if the channels have similar gains.
    gains = np.diag([1.0 / channel[3] for channel in channels])
    system = LinearSystem(A, B @ gains @ right, units * (left @ C), units * (left @ D @ gains @ right))
    expected = [zero for channel in channels for zero in channel[1]]
    assert agree(system.zeros(), expected, 1e-6)


@pytest.mark.parametrize("seed", SEEDS)
def test_units_of_time_inputs_and_outputs_change_results_by_their_scale_only(seed: int) -> None:
    random = np.random.default_rng(seed)
    n = 2 + seed % 5
    A = random.integers(-4, 5, (n, n)) - 3.0 * np.eye(n)
    B, C = random.integers(-3, 4, (n, 1)) * 1.0, random.integers(-3, 4, (1, n)) * 1.0
    D = np.array([[float(seed % 2)]])
    base = LinearSystem(A, B, C, D).transfer_function()
    time, into, out = (
        10.0 ** random.choice([-9, 9]),
        10.0 ** random.choice([-12, 12]),
        10.0 ** random.choice([-12, 12]),
    )
    units = 10.0 ** random.integers(-9, 10, n)
    other = LinearSystem(
        time * A * units / units[:, None], time * into * B / units[:, None], out * C * units, into * out * D
    ).transfer_function()
    degree = len(base.poles) - len(base.zeros)
    assert len(other.zeros) == len(base.zeros)
    assert len(other.poles) == len(base.poles)
    assert other.gain == pytest.approx(base.gain * into * out * time**degree, rel=1e-9)
    for point in (0.3j, 1.0 + 1.0j, 5.0):
        assert other(point * time) / (into * out) == pytest.approx(base(point), rel=1e-8)


def exact_value(system: LinearSystem, s: Fraction) -> Fraction:
    """``C (s I - A)^-1 B + D`` of a system with one input and one output, in rational arithmetic."""
    n = system.order
    rows = [
        [(s if i == k else Fraction(0)) - Fraction(float(system.A[i, k])) for k in range(n)]
        + [Fraction(float(system.B[i, 0]))]
        for i in range(n)
    ]
    for i in range(n):
        pivot = next(k for k in range(i, n) if rows[k][i] != 0)
        rows[i], rows[pivot] = rows[pivot], rows[i]
        for k in range(n):
            if k != i:
                factor = rows[k][i] / rows[i][i]
                rows[k] = [a - factor * b for a, b in zip(rows[k], rows[i])]
    states = [rows[i][n] / rows[i][i] for i in range(n)]
    return Fraction(float(system.D[0, 0])) + sum(Fraction(float(c)) * x for c, x in zip(system.C[0], states))


@pytest.mark.parametrize("seed", SEEDS)
def test_values_agree_with_rational_arithmetic(seed: int) -> None:
    """Integer matrices, many of them singular, nilpotent or with cancelling poles and zeros."""
    random = np.random.default_rng(seed)
    n = 1 + seed % 5
    A = np.triu(random.integers(-3, 4, (n, n)), int(random.integers(2)))
    A = A[np.ix_(*[random.permutation(n)] * 2)] * 1.0
    system = LinearSystem(
        A,
        random.integers(-2, 3, (n, 1)) * 1.0,
        random.integers(-2, 3, (1, n)) * 1.0,
        [[float(seed % 3 == 0)]],
    )
    function = system.transfer_function()
    for s in (Fraction(7, 3), Fraction(-31, 7), Fraction(1001, 13)):
        assert function(complex(float(s))) == pytest.approx(
            float(exact_value(system, s)), rel=1e-9, abs=1e-14
        )


@pytest.mark.parametrize("dt", [0.0, 0.1])
@pytest.mark.parametrize("n", [1, 2, 3, 4, 8])
def test_integrators_or_delays_in_series_have_only_poles_at_zero(n: int, dt: float) -> None:
    system = LinearSystem(5e-12 * np.eye(n, k=1), np.eye(n)[:, -1:], 1e9 * np.eye(n)[:1], [[0.0]], dt=dt)
    function = system.transfer_function()
    assert len(function.zeros) == 0
    assert function.poles.tolist() == [0.0] * n
    assert function.gain == pytest.approx(1e9 * 5e-12 ** (n - 1), rel=1e-12)


@pytest.mark.parametrize(
    ("A", "B", "C", "D", "above", "below"),
    [
        ([[3.0, -9.0], [1.0, -3.0]], [0.0, 1.0], [1.0, 0.0], 0.0, "-9", "s^2"),  # nilpotent
        (
            [[-1e9, 0.0, 0.0], [1.0, -2e-3, -1e-6], [0.0, 1.0, 0.0]],
            [1e-3, 0.0, 0.0],
            [0.0, 1e-12, 0.0],
            0.0,
            "1e-15 s",
            "s^3 + 1e+09 s^2 + 2e+06 s + 1000",
        ),
        ([[1e12, 0.0], [0.0, -1e12]], [1.0, 1.0], [1.0, 1e-12], 1e-12, "1e-12 s^2 + s - 1", "s^2 - 1e+24"),
        (
            [[1e12, 0.0], [0.0, -1e12]],
            [1.0, 1.0],
            [1.0, 1e-12],
            1e-15,
            "1e-15 s^2 + s + 9.99e+11",
            "s^2 - 1e+24",
        ),
        ([[-1e12]], [1e-12], [1.0], 0.0, "1e-12", "s + 1e+12"),
        ([[-7e-4, 0.0], [1e5, -6e-4]], [-2e3, -3e12], [3e4, 0.0], 0.0, "-6e+07", "s + 0.0007"),
        ([[-1.0]], [1.0], [1.0], 1e-15, "1e-15 s + 1", "s + 1"),
        ([[-1.0]], [0.0], [1.0], 0.0, "0", "1"),
    ],
)
def test_small_coefficients_are_kept(
    A: list[list[float]], B: list[float], C: list[float], D: float, above: str, below: str
) -> None:
    system = LinearSystem(A, np.array(B)[:, None], [C], [[D]])
    text = repr(system.transfer_function()).split("\n")
    assert (text[0].strip(), text[2].strip()) == (above, below)
    if D:
        assert repr(system).split("  D\n")[1].split("\n")[1].split() == ["y1", f"{D:g}"]


@pytest.mark.parametrize("fast", [1.0, 1e2, 1e6, 1e8])
def test_bandwidth_and_step_response_follow_the_slow_pole(fast: float) -> None:
    slow = 1e-6
    system = LinearSystem([[-fast, 1.0], [0.0, -slow]], [[0.0], [slow]], [[fast, 0.0]], [[0.0]])
    assert system.bandwidth() == pytest.approx(slow * math.sqrt(10.0**0.3 - 1.0), rel=1e-9)
    measures = system.step_response().measures()
    assert measures.rise_time == pytest.approx(math.log(9.0) / slow, rel=1e-3)
    assert measures.settling_time == pytest.approx(math.log(50.0) / slow, rel=1e-3)


@pytest.mark.parametrize("time", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("gain", [1e-6, 1e-2, 1.0, 10.0, 1e5])
@pytest.mark.parametrize("fast", [1e2, 1e7])
def test_margins_agree_with_their_definition_for_any_gain(fast: float, gain: float, time: float) -> None:
    """L = gain / (s (s + 1) (s / fast + 1)) reaches -180 degrees at sqrt(fast)."""
    A = np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 1.0], [0.0, 0.0, -fast]])
    loop = LinearSystem(time * A, [[0.0], [0.0], [time * gain * fast]], [[1.0, 0.0, 0.0]], [[0.0]])
    margins = loop.margins()
    assert margins.gain == pytest.approx((1.0 + fast) / gain, rel=1e-8)
    w = margins.phase_frequency / time
    assert abs(gain / (1j * w * (1j * w + 1.0) * (1j * w / fast + 1.0))) == pytest.approx(1.0, rel=1e-9)
    assert margins.phase == pytest.approx(90.0 - math.degrees(math.atan(w) + math.atan(w / fast)), abs=1e-6)


@pytest.mark.parametrize("dt", [0.1, 1e-3, 1e-8])
def test_margins_of_a_sampled_integrator_agree_with_closed_forms(dt: float) -> None:
    margins = LinearSystem([[1.0]], [[10.0 * dt]], [[1.0]], [[0.0]], dt=dt).margins()
    w = 2.0 / dt * math.asin(5.0 * dt)
    assert margins.phase_frequency == pytest.approx(w, rel=1e-6)
    assert margins.phase == pytest.approx(90.0 - math.degrees(w * dt / 2.0), abs=1e-5)
    assert margins.gain == pytest.approx(0.2 / dt, rel=1e-9)
