"""Displayed values near zero: rounding errors are shown as 0, small values are unchanged."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from numpy.typing import NDArray

from armblocks.analysis.linear_system import LinearSystem
from armblocks.analysis.margins import shown_margins
from armblocks.analysis.shown_values import (
    shown_dcgain,
    shown_matrices,
    shown_modes,
    shown_poles,
    shown_zeros,
)
from armblocks.analysis.time_response import shown_measures
from armblocks.report.motion_summary import shown_summary, summarise
from robots_for_tests import build_puma560
from unordered import matched

Array = NDArray[np.float64]
SEEDS = range(12)


def similar(A: Array, random: np.random.Generator) -> tuple[Array, Array]:
    """A after a random, well-conditioned similarity transformation, and the transformation matrix."""
    n = A.shape[0]
    T = np.linalg.qr(random.normal(size=(n, n)))[0] @ np.diag(random.uniform(0.5, 2.0, n))
    return np.linalg.solve(T, A @ T), T


def plant(random: np.random.Generator, integrators: int, scale: float = 1.0) -> tuple[Array, int]:
    """A chain of integrators after three decaying states, whose poles have the given scale in rad/s."""
    n = integrators + 3
    A = np.zeros((n, n))
    A[:integrators, :integrators] = np.eye(integrators, k=1)
    A[:integrators, integrators:] = random.normal(size=(integrators, 3))
    A[integrators:, integrators:] = random.normal(size=(3, 3)) - 5.0 * np.eye(3)
    return scale * A, integrators


@pytest.mark.parametrize("scale", [1.0, 1e-12, 1e9])
@pytest.mark.parametrize("integrators", [1, 2, 3])
def test_poles_at_zero_are_shown_as_zero_in_any_states_and_units(integrators: int, scale: float) -> None:
    for seed in SEEDS:
        random = np.random.default_rng([seed, integrators])
        A, count = plant(random, integrators, scale)
        hidden, _ = similar(A, random)
        units = 10.0 ** random.integers(-6, 7, A.shape[0])
        system = LinearSystem(
            hidden * units / units[:, None], np.ones((A.shape[0], 1)), np.ones((1, A.shape[0])), [[0.0]]
        )
        poles = shown_poles(system)
        assert int((poles == 0.0).sum()) == count
        others = np.linalg.eigvals(A[count:, count:])
        assert matched(poles[poles != 0.0] / scale, others / scale, 1e-6)
        assert "on the stability boundary" in repr(system)
        assert not system.is_stable


@pytest.mark.parametrize("small", [1e-3, 1e-6, 1e-12])
def test_small_poles_of_a_slow_subsystem_are_shown_beside_a_fast_subsystem(small: float) -> None:
    """1e-12 rad/s is a pole of the slow subsystem and not a rounding error, for any fast subsystem."""
    for seed in SEEDS:
        random = np.random.default_rng(seed)
        slow = small * (random.normal(size=(3, 3)) - 4.0 * np.eye(3))
        fast = random.normal(size=(2, 2)) - 6.0 * np.eye(2)
        A = np.block([[slow, small * random.normal(size=(3, 2))], [np.zeros((2, 3)), fast]])
        order = random.permutation(5)
        A = A[np.ix_(order, order)]
        system = LinearSystem(A, np.zeros((5, 0)), np.zeros((0, 5)), np.zeros((0, 0)))
        poles = shown_poles(system)
        assert system.is_stable
        assert matched(poles[:3] / small, np.linalg.eigvals(slow / small))
        assert poles.tolist() == system.poles().tolist()


@pytest.mark.parametrize("seed", SEEDS)
def test_an_undamped_pair_and_a_double_pole_are_shown_without_rounding_errors(seed: int) -> None:
    random = np.random.default_rng(seed)
    A = np.zeros((5, 5))
    A[:2, :2] = [[0.0, 3.0], [-3.0, 0.0]]
    A[2:4, 2:4] = [[-2.0, 1.0], [0.0, -2.0]]
    A[4, 4] = -7.0
    A[:4, 4] = 1.0
    system = LinearSystem(similar(A, random)[0], np.zeros((5, 0)), np.zeros((0, 5)), np.zeros((0, 0)))
    poles = shown_poles(system)
    assert matched(poles[poles.imag != 0.0], [3j, -3j])
    assert (poles.real[poles.imag != 0.0] == 0.0).all()
    assert matched(poles[poles.imag == 0.0], [-2.0, -2.0, -7.0], 1e-6)
    oscillating_modes = [mode for mode in shown_modes(system) if mode.pole.imag]
    assert [(mode.damping, mode.time_constant) for mode in oscillating_modes] == [(0.0, math.inf)] * 2


def test_a_damping_of_1e_9_is_shown() -> None:
    """A real part of -1e-9 is not a rounding error, even beside an undamped pair of the same frequency."""
    A = np.array(
        [[0.0, 3.0, 0.0, 0.0], [-3.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1e-9, 3.0], [0.0, 0.0, -3.0, -1e-9]]
    )
    system = LinearSystem(A, np.zeros((4, 0)), np.zeros((0, 4)), np.zeros((0, 0)))
    assert sorted(shown_poles(system).real.tolist()) == [-1e-9, -1e-9, 0.0, 0.0]


@pytest.mark.parametrize("seed", SEEDS)
def test_poles_of_a_discrete_system_are_shown_at_0_at_1_and_on_the_unit_circle(seed: int) -> None:
    random = np.random.default_rng(seed)
    angle = 0.7
    A = np.diag([0.0, 1.0, 0.0, 0.0, 0.4])
    A[2:4, 2:4] = [[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]]
    system = LinearSystem(similar(A, random)[0], np.zeros((5, 0)), np.zeros((0, 5)), np.zeros((0, 0)), dt=0.1)
    poles = shown_poles(system)
    assert {0j, 1 + 0j} <= set(poles.tolist())
    assert matched(poles, np.linalg.eigvals(A))
    modes = {round(mode.frequency, 6): mode for mode in shown_modes(system)}
    assert modes[0.0].time_constant == math.inf
    assert (modes[7.0].damping, modes[7.0].time_constant) == (0.0, math.inf)
    assert "on the stability boundary" in repr(system)


@pytest.mark.parametrize("seed", SEEDS)
def test_zeros_and_the_static_gain_of_a_derivative_are_shown_as_zero(seed: int) -> None:
    """G(s) = s (s + 4) / ((s + 1) (s + 2) (s + 3)), with an input gain of 1e-12, in any state basis."""
    random = np.random.default_rng(seed)
    A = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-6.0, -11.0, -6.0]])
    hidden, T = similar(A, random)
    B = np.linalg.solve(T, [[0.0], [0.0], [1e-12]])
    derivative = LinearSystem(hidden, B, np.array([[0.0, 4.0, 1.0]]) @ T, [[0.0]])
    assert shown_zeros(derivative)[0] == 0.0
    assert matched(shown_zeros(derivative), [0.0, -4.0])
    assert shown_dcgain(derivative)[0, 0] == 0.0
    small = LinearSystem(hidden, B, np.array([[1e-3, 4.0, 1.0]]) @ T, [[0.0]])
    assert shown_dcgain(small)[0, 0] == pytest.approx(1e-15 / 6.0, rel=1e-9)
    assert shown_zeros(small)[0].real == pytest.approx(-2.5001563e-4, rel=1e-6)


def test_a_loop_through_minus_one_is_shown_with_margins_of_zero() -> None:
    """L = 8 / (s + 1)^3 passes -1 at sqrt(3) rad/s; with 7.99 it does not. L = 1 / s^2 passes at 1 rad/s."""
    lag = np.array([[-1.0, 1.0, 0.0], [0.0, -1.0, 1.0], [0.0, 0.0, -1.0]])
    for seed in SEEDS:
        A, T = similar(lag, np.random.default_rng(seed))
        B = np.linalg.solve(T, [[0.0], [0.0], [8.0]])
        C = np.array([[1.0, 0.0, 0.0]]) @ T
        margins = shown_margins(LinearSystem(A, B, C, [[0.0]]))
        assert (margins.gain_decibels, margins.phase, margins.delay, margins.modulus) == (0.0, 0.0, 0.0, 0.0)
        assert margins.gain_frequency == pytest.approx(math.sqrt(3.0))
        assert not margins.stable
        margins = shown_margins(LinearSystem(A, B * (1.0 - 1e-9), C, [[0.0]]))
        assert margins.gain - 1.0 == pytest.approx(1e-9, rel=1e-3)
        assert 0.0 < margins.phase < 1e-6
        assert margins.modulus > 1e-10
        assert margins.stable
    double = LinearSystem([[0.0, 1.0], [0.0, 0.0]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]])
    assert shown_margins(double).phase == 0.0


def test_entries_of_matrices_are_shown_as_zero_only_beside_larger_ones_in_any_units() -> None:
    A = np.array([[-1.0, math.cos(math.pi / 2), 1.0], [2.0, -3.0, 1.0], [1.0, 1.0, -2.0]])
    for unit in (1.0, 1e-9, 1e9):
        scale = np.array([1.0, unit, 1.0])
        B, C = np.ones((3, 1)) * unit / scale[:, None], np.ones((1, 3)) * scale * unit
        shown = shown_matrices(LinearSystem(A * scale / scale[:, None], B, C, [[unit**2]]))
        assert shown[0][0, 1] == 0.0
        assert int((shown[0] == 0.0).sum()) == 1
    slow = LinearSystem([[-1e-17, 0.0], [0.0, -1.0]], np.zeros((2, 1)), np.zeros((1, 2)), [[1e-30]])
    assert shown_matrices(slow)[0][0, 0] == -1e-17
    assert shown_matrices(slow)[3][0, 0] == 1e-30


@pytest.mark.parametrize("seed", SEEDS)
def test_a_transfer_function_is_printed_without_rounding_errors(seed: int) -> None:
    """(s^2 + 4) / (s^2 (s + 1)) has exact coefficients; the small ones of 1 / (s + 1e-12)^2 are not changed
    to 0."""
    A = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    hidden, T = similar(A, np.random.default_rng(seed))
    system = LinearSystem(
        hidden, np.linalg.solve(T, [[0.0], [0.0], [1.0]]), np.array([[4.0, 0.0, 1.0]]) @ T, [[0.0]]
    )
    above, _, below = repr(system.transfer_function()).split("\n")
    assert above.strip() == "s^2 + 4"
    assert below.strip() == "s^3 + s^2"
    slow = LinearSystem([[-1e-12, 1.0], [0.0, -1e-12]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]])
    assert repr(slow.transfer_function()).split("\n")[2].strip() == "s^2 + 2e-12 s + 1e-24"


def test_a_step_response_without_overshoot_is_shown_with_an_overshoot_of_zero() -> None:
    lag = LinearSystem([[-1.0, 0.3], [0.0, -2.0]], [[0.0], [1.0]], [[1.0, 0.1]], [[0.0]])
    measures = shown_measures(lag.step_response(100.0))
    assert (measures.overshoot, measures.undershoot) == (0.0, 0.0)
    wave = LinearSystem([[0.0, 1.0], [-1.0, -1.98]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]])
    exact = 100.0 * math.exp(-math.pi * 0.99 / math.sqrt(1.0 - 0.99**2))
    assert shown_measures(wave.step_response(40.0, 4000)).overshoot == pytest.approx(exact, rel=1e-2)


def test_joints_that_do_not_move_are_shown_as_at_rest() -> None:
    """The second joint moves; the values of the others are rounding errors."""
    robot = build_puma560()
    n = len(robot.joints)
    time = np.linspace(0.0, 1.0, 11)
    q, qd, qdd, tau = (np.full((11, n), 3e-17) for _ in range(4))
    q[:, 1], qd[:, 1], qdd[:, 1], tau[:, 1] = time, 1.0, 0.5, 40.0
    tau[:, 0] = 1e-9  # small, but not a rounding error
    summary = summarise(robot, time, q, qd, qdd, tau, np.zeros((11, 3)))
    shown = shown_summary(summary)
    assert shown.joints[2].position_max == shown.joints[2].speed_peak == shown.joints[2].torque_rms == 0.0
    assert shown.joints[1] == dataclasses.replace(summary.joints[1], position_min=0.0)
    assert shown.joints[0].torque_peak == 1e-9
    assert shown.findings == summary.findings
