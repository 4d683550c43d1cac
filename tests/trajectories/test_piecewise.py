"""Piecewise polynomials: derivatives, extremes, joining, splines compared with SciPy, optimal profiles."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.interpolate import CubicSpline, make_interp_spline
from scipy.optimize import linprog

from armblocks.trajectories import PiecewisePolynomial
from armblocks.trajectories.piecewise import extremes, hermite, joined
from armblocks.trajectories.profiles import double_s, from_derivatives, trapezoid
from armblocks.trajectories.splines import cubic_spline, quintic_spline

RANDOM = np.random.default_rng(7)


def random_curve(pieces: int = 4, degree: int = 5, joints: int = 3) -> PiecewisePolynomial:
    times = np.append(0.0, np.cumsum(RANDOM.uniform(0.3, 1.0, pieces)))
    return PiecewisePolynomial(times=times, coefficients=RANDOM.normal(size=(pieces, degree + 1, joints)))


def test_rates_are_the_derivatives_of_the_positions() -> None:
    curve = random_curve()
    for k in range(4):
        t = np.linspace(curve.times[k], curve.times[k + 1], 12)[1:-1]
        for joint in range(3):
            p = np.polynomial.Polynomial(curve.coefficients[k, :, joint])
            u = t - curve.times[k]
            for value, expected in zip(curve.at(t), (p(u), p.deriv()(u), p.deriv(2)(u))):
                assert_allclose(value[:, joint], expected, rtol=1e-12, atol=1e-12)


def test_a_jump_has_a_limit_on_each_side_and_the_ends_are_at_rest_outside() -> None:
    curve = random_curve()
    starts, ends = curve.pieces()
    inner = curve.times[1:-1]
    for order in range(3):
        assert_array_equal(curve.at(inner)[order], starts[order][1:])
        assert_allclose(curve.at(inner, side="left")[order], ends[order][:-1], rtol=1e-14)
    outside = curve.at([curve.times[0] - 1.0, curve.times[-1] + 1.0])
    assert_array_equal(outside.q, [starts.q[0], ends.q[-1]])
    assert_array_equal(outside.qd, np.zeros((2, 3)))
    assert_array_equal(outside.qdd, np.zeros((2, 3)))


@pytest.mark.parametrize("degree", [1, 2, 3, 5])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_extremes_bound_dense_samples_and_are_reached(degree: int, order: int) -> None:
    curve = random_curve(degree=degree)
    low, high = extremes(curve, order)
    t = np.linspace(0.0, curve.times[-1], 20001)
    values = curve.at(t)[order]
    scale = np.abs(values).max() + 1.0
    # Jumps lie between samples, so the extremes may exceed the samples there by one side of the jump.
    sides = np.concatenate([values, curve.at(curve.times, side="left")[order], curve.at(curve.times)[order]])
    assert (low <= sides.min(axis=0) + 1e-12 * scale).all()
    assert (high >= sides.max(axis=0) - 1e-12 * scale).all()
    assert_allclose(low, sides.min(axis=0), atol=1e-5 * scale)
    assert_allclose(high, sides.max(axis=0), atol=1e-5 * scale)


def test_joined_joints_move_as_each_of_them_alone() -> None:
    parts = [random_curve(pieces, degree, 1).stretched(1.0) for pieces, degree in ((3, 2), (5, 3), (1, 5))]
    parts = [part.stretched(2.0 / part.duration) for part in parts]
    whole = joined(parts)
    t = np.linspace(0.0, 2.0, 301)[1:-1]
    for k, part in enumerate(parts):
        for ours, theirs in zip(whole.at(t), part.at(t)):
            assert_allclose(ours[:, k], theirs[:, 0], rtol=1e-9, atol=1e-9)


def test_stretching_divides_the_rates() -> None:
    curve = random_curve()
    slow = curve.stretched(3.0)
    t = np.linspace(0.0, curve.duration, 50)
    fast, stretched = curve.at(t), slow.at(3.0 * t)
    for power, (one, other) in enumerate(zip(fast, stretched)):
        assert_allclose(other * 3.0**power, one, rtol=1e-9, atol=1e-9)


def test_hermite_pieces_have_the_given_values_at_both_ends() -> None:
    times = np.array([0.0, 0.4, 1.5])
    starts, ends = RANDOM.normal(size=(2, 3, 2, 4))
    for count in (2, 3):
        curve = hermite(times, starts[:count], ends[:count])
        for actual, expected in zip(curve.pieces(), (starts, ends)):
            assert_allclose(actual[:count], expected[:count], rtol=0, atol=1e-12)


def test_splines_equal_those_of_scipy() -> None:
    t = np.cumsum(RANDOM.uniform(0.2, 1.0, 9))
    points, x = RANDOM.normal(size=(9, 3)), np.linspace(t[0], t[-1], 200)
    qd0, qd1 = RANDOM.normal(size=(2, 3))
    natural, clamped = (
        CubicSpline(t, points, bc_type="natural"),
        CubicSpline(t, points, bc_type=((1, qd0), (1, qd1))),
    )
    for ours, theirs in ((cubic_spline(t, points), natural), (cubic_spline(t, points, qd0, qd1), clamped)):
        for order in range(3):
            assert_allclose(ours.at(x)[order], theirs(x, order), rtol=0, atol=1e-11)
    zero = np.zeros(3)
    theirs = make_interp_spline(t, points, k=5, bc_type=([(1, qd0), (2, zero)], [(1, qd1), (2, zero)]))
    ours = quintic_spline(t, points, qd0, qd1)
    for order in range(3):
        assert_allclose(ours.at(x)[order], theirs(x, order), rtol=0, atol=1e-9)


def least_duration(limits: list[float], distance: float, dt: float) -> float:
    """The least time from rest to rest by a linear program on a grid: a lower bound up to the grid error.

    The highest limited derivative is constant in each step; the number of steps is found by bisection.
    """
    order = len(limits)

    def reaches(steps: int) -> bool:
        A = np.eye(order) + dt * np.eye(order, k=1) + dt**2 / 2 * np.eye(order, k=2)
        b = np.array([dt ** (order - i) / np.prod(range(1, order - i + 1)) for i in range(order)])
        powers, effects = np.eye(order), []
        for _ in range(steps):
            effects.append(powers @ b)
            powers = A @ powers
        effect = np.array(effects[::-1]).T  # of each step on the final state
        rows, bounds = [], []
        for level in range(1, order):  # limits of the derivatives below the highest one, after each step
            for k in range(1, steps):
                row = np.concatenate([np.array(effects[:k])[::-1, level], np.zeros(steps - k)])
                rows += [row, -row]
                bounds += [limits[level - 1]] * 2
        target = np.zeros(order)
        target[0] = distance
        found = linprog(
            np.zeros(steps), A_ub=rows, b_ub=bounds, A_eq=effect, b_eq=target,
            bounds=[(-limits[-1], limits[-1])] * steps, method="highs",
        )  # fmt: skip
        return found.status == 0

    low, high = 2, 200
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if reaches(middle) else (middle + 1, high)
    return low * dt


@pytest.mark.parametrize(
    "limits", [(0.8, 2.0), (5.0, 2.0), (0.8, 2.0, 9.0), (5.0, 2.0, 9.0), (0.3, 5.0, 4.0), (9.0, 9.0, 5.0)]
)
def test_profiles_have_the_least_duration_of_a_linear_program(limits: tuple[float, ...]) -> None:
    profile = trapezoid(*limits, limits[1]) if len(limits) == 2 else double_s(*limits)
    dt = profile.duration / 40
    assert least_duration(list(limits), 1.0, dt) == pytest.approx(profile.duration, abs=1.01 * dt)
    for order, limit in enumerate(limits[:2], 1):
        low, high = extremes(profile, order)
        assert max(-low[0], high[0]) <= limit * (1 + 1e-12)
    if len(limits) == 3:
        assert np.abs(6.0 * profile.coefficients[:, 3]).max() == pytest.approx(limits[2], rel=1e-12)
    assert profile.at(profile.duration).q[0] == 1.0
    assert profile.at(profile.duration).qd[0] == 0.0


def test_pieces_of_constant_derivatives_are_integrated_exactly() -> None:
    motion = from_derivatives((1.0, 0.0, 2.0), (2.0, 5.0, -1.0), 2)
    assert motion.times.tolist() == [0.0, 1.0, 3.0]
    assert motion.at(2.0).q[0] == 1.0 + 2.0 - 0.5
    assert trapezoid(10.0, 1.0, np.inf).duration == pytest.approx(np.sqrt(2.0))
