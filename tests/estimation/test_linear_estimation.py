"""Weighted least squares, physical constraints, filters and quantiles against plain references."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import minimize
from scipy.signal import butter, filtfilt, freqz
from scipy.stats import t as student

from armblocks.estimation.consistency import Constraints, consistent_fit, pseudo_inertia
from armblocks.estimation.filtering import advised_cutoff, central_derivative, low_passed
from armblocks.estimation.linear import Rows, weighted_fit
from armblocks.estimation.robust import huber_weights, robust_deviations
from armblocks.estimation.student_t import t_factor


@pytest.mark.parametrize("freedom", [1, 2, 3, 5, 12, 100, 10_000])
@pytest.mark.parametrize("level", [0.5, 0.9, 0.95, 0.999])
def test_quantiles_are_those_of_scipy(freedom: int, level: float) -> None:
    assert_allclose(t_factor(level, freedom), student.ppf(0.5 + 0.5 * level, freedom), rtol=1e-7)
    assert_allclose(t_factor(0.95, np.inf), 1.959963984540054, rtol=1e-12)


def rows_of(matrices: list[np.ndarray], values: list[np.ndarray]) -> list[Rows]:
    found: list[Rows] = []
    for X, y in zip(matrices, values):
        columns = np.flatnonzero(np.abs(X).max(axis=0))
        rows = Rows.without_rows(columns)
        for part in np.array_split(np.arange(len(y)), 3):
            rows.add(X[part][:, columns], y[part])
        found.append(rows)
    return found


def test_the_estimate_and_its_covariance_are_those_of_the_normal_equations() -> None:
    random = np.random.default_rng(3)
    X = [random.normal(size=(700, 4)), random.normal(size=(500, 4)) * (1.0, 0.0, 1.0, 0.0)]
    y = [random.normal(size=700), random.normal(size=500)]
    sigma = np.array([0.5, 2.0])
    fit = weighted_fit(rows_of(X, y), np.zeros(4), sigma)
    W = np.vstack([X[0] / 0.5, X[1] / 2.0])
    covariance = np.linalg.inv(W.T @ W)
    assert_allclose(fit.values, covariance @ W.T @ np.concatenate([y[0] / 0.5, y[1] / 2.0]), rtol=1e-10)
    assert_allclose(fit.covariance, covariance, rtol=1e-10, atol=1e-14)
    assert_allclose(fit.condition, np.linalg.cond(W / np.linalg.norm(W, axis=0)), rtol=1e-10)


def test_the_noise_of_each_sensor_is_estimated_without_bias() -> None:
    random = np.random.default_rng(4)
    found = []
    for _ in range(200):
        X = [random.normal(size=(30, 6)), random.normal(size=(40, 6))]
        y = [X[0] @ np.ones(6) + random.normal(size=30), X[1] @ np.ones(6) + 5.0 * random.normal(size=40)]
        found.append(weighted_fit(rows_of(X, y), np.zeros(6)).deviations ** 2)
    # The mean of 200 variances of about 26 degrees of freedom has a standard error of 2 %.
    assert_allclose(np.mean(found, axis=0), [1.0, 25.0], rtol=0.08)


def test_undetermined_directions_keep_the_start_and_are_named() -> None:
    random = np.random.default_rng(5)
    X = random.normal(size=(50, 3))
    X = np.column_stack([X[:, 0], X[:, 1], X[:, 0] + X[:, 1], X[:, 2]])
    fit = weighted_fit(rows_of([X], [X @ [1.0, 2.0, 3.0, 4.0]]), np.array([1.0, 2.0, 3.0, 0.0]), np.ones(1))
    assert fit.rank == 3 and fit.unknown.tolist() == [True, True, True, False]
    assert_allclose(fit.values, [1.0, 2.0, 3.0, 4.0], rtol=1e-9)


def test_robust_weights_reduce_outliers_only() -> None:
    random = np.random.default_rng(6)
    residuals = random.normal(size=(5000, 1))
    residuals[::50] += 40.0
    deviations = robust_deviations(residuals)
    assert_allclose(deviations, 1.0, rtol=0.05)
    weights = huber_weights(residuals, deviations)
    assert weights[::50].max() < 0.05 and np.mean(weights == 1.0) > 0.75


def one_body(scale: float = 1.0) -> Constraints:
    none = np.empty(0, dtype=np.intp)
    return Constraints(bodies=np.arange(10)[None], positive=none, negative=none, scale=np.full(10, scale))


def test_a_consistent_estimate_is_not_changed() -> None:
    random = np.random.default_rng(7)
    true = np.array([2.0, 0.1, -0.2, 0.3, 0.5, 0.6, 0.7, 0.01, 0.02, -0.03])
    A = 100.0 * random.normal(size=(40, 10))
    found = consistent_fit(A, A @ true, np.array([1.0, 0, 0, 0, 0.4, 0.4, 0.4, 0, 0, 0]), one_body())
    assert_allclose(found, true, atol=2e-6)


def test_the_constrained_minimum_is_that_of_a_general_optimiser() -> None:
    # A measurement of a body with negative density: the nearest possible one is at the limit.
    random = np.random.default_rng(8)
    wrong = np.array([1.0, 0.5, 0.0, 0.0, 0.1, 0.2, 0.9, 0.0, 0.0, 0.0])
    A = random.normal(size=(30, 10)) * 10.0
    prior = np.array([1.0, 0, 0, 0, 0.4, 0.4, 0.4, 0, 0, 0])
    found = consistent_fit(A, A @ wrong, prior, one_body())
    assert np.linalg.eigvalsh(pseudo_inertia(found))[0] > 0.0

    def body(theta: np.ndarray) -> np.ndarray:
        L = np.zeros((4, 4))
        L[np.tril_indices(4)] = theta
        P = L @ L.T
        second = np.trace(P[:3, :3]) * np.eye(3) - P[:3, :3]
        entries = [second[0, 0], second[1, 1], second[2, 2], second[0, 1], second[1, 2], second[0, 2]]
        return np.array([P[3, 3], *P[:3, 3], *entries])

    def misfit(theta: np.ndarray) -> float:
        return float(np.sum((A @ (body(theta) - wrong)) ** 2))

    start = np.linalg.cholesky(pseudo_inertia(prior))[np.tril_indices(4)]
    reference = minimize(misfit, start, method="BFGS", options={"gtol": 1e-7, "maxiter": 5000})
    assert_allclose(np.sum((A @ (found - wrong)) ** 2), reference.fun, rtol=1e-3)
    assert_allclose(found, body(reference.x), atol=2e-3)


def test_the_low_pass_filter_has_no_phase_and_the_gain_of_two_passes() -> None:
    step = 1e-3
    t = np.arange(4000) * step
    b, a = butter(4, 20.0, fs=1 / step)
    for frequency in (2.0, 10.0, 20.0, 40.0):
        signal = np.sin(2 * np.pi * frequency * t)
        filtered = low_passed(signal[:, None], step, 20.0)[:, 0]
        middle = slice(1000, 3000)
        gain = 1.0 / (1.0 + (frequency / 20.0) ** 8)
        assert_allclose(filtered[middle], gain * signal[middle], atol=2e-3)
        # The bilinear transform of SciPy's digital filter changes its gain slightly.
        _, response = freqz(b, a, worN=[2 * np.pi * frequency * step])
        assert_allclose(abs(response[0]) ** 2, gain, atol=0.01)
        assert_allclose(filtered[middle], filtfilt(b, a, signal)[middle], atol=0.02)
    line = 3.0 + 2.0 * t[:, None]
    assert_allclose(low_passed(line, step, 20.0), line, atol=1e-9)
    assert_allclose(low_passed(line, step, 900.0), line)


def test_derivatives_and_the_advised_cutoff_of_a_noisy_sine() -> None:
    step = 1e-3
    t = np.arange(10_000) * step
    q = np.column_stack([np.sin(2 * np.pi * 0.5 * t), 0.3 * np.sin(2 * np.pi * 2.0 * t)])
    exact = np.column_stack([np.pi * np.cos(np.pi * t), 1.2 * np.pi * np.cos(4 * np.pi * t)])
    assert_allclose(central_derivative(q, step)[2:-2], exact[2:-2], atol=1e-8)
    noisy = q + 1e-5 * np.random.default_rng(9).normal(size=q.shape)
    cutoff = advised_cutoff(noisy, step)
    assert 5.0 < cutoff < 30.0  # the motion reaches 2 Hz
    speed = central_derivative(low_passed(noisy, step, cutoff), step)
    assert np.abs(speed - exact)[500:-500].max() < 0.01
