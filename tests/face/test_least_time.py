"""Time-optimal motions: all limits hold at all times, and one of them is reached; closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

import armblocks as ab
from armblocks.errors import InputError, LimitWarning, RobotError
from armblocks.robot import standard_dh

ROBOTS = ("puma560", "iiwa14", "kr180", "stanford", "irb460")


def one_joint(friction: ab.Motor | None = None, gravity: float = 0.0) -> ab.Arm:
    """A rod of 2 kg m² about a vertical axis; with gravity its axis is horizontal."""
    link = standard_dh("a", a=1.0, mass=2.0, centre_of_mass=(0.0, 0, 0), inertia=(0, 0, 0), motor=friction)
    return ab.Arm(ab.Robot(name="rod", links=(link,), gravity=(0.0, -gravity, 0.0)))


def random_motion(name: str, count: int, seed: int = 0) -> tuple[ab.Arm, np.ndarray, dict[str, Any]]:
    """Points within the joint ranges, and limits that allow slow motions."""
    arm, random = ab.load_robot(name), np.random.default_rng([seed, count, *name.encode()])
    low, high = np.clip(arm.robot.qlim, -1.5, 1.5).T
    points = (low + high) / 2 + random.uniform(-0.3, 0.3, (count, arm.n)) * (high - low)
    t = np.linspace(0.0, 1.0, 60)
    dense = ab.spline_trajectory(points, np.linspace(0, 1, count))(t).q
    holding = np.abs(arm.rne(dense, 0 * dense, 0 * dense, payload=1.5)).max(axis=0)
    torque = random.uniform(1.3, 3.0) * holding + np.abs(arm.friction(np.full(arm.n, 1e-6))) + 5.0
    return arm, points, {"torque": torque, "speed": random.uniform(0.5, 2.0), "acceleration": 8.0}


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("blend", [None, 0.4])
def test_all_limits_hold_at_all_times_and_one_binds(name: str, blend: float | None) -> None:
    arm, points, limits = random_motion(name, 4)
    path = ab.least_time(arm, points, payload=1.5, blend=blend, **limits)
    knots = path.curve.times
    t = np.concatenate([knots[:-1] + f * np.diff(knots) for f in (1e-6, 0.25, 0.5, 0.75, 1 - 1e-6)])
    q, qd, qdd = path(t)
    tau = arm.rne(q, qd, qdd, payload=1.5)
    ratios = np.hstack(
        [np.abs(tau) / limits["torque"], np.abs(qd) / limits["speed"], np.abs(qdd) / limits["acceleration"]]
    )
    assert ratios.max() <= 1.0 + 2e-3
    # In each segment some limit is reached, up to the change of a quantity within the segment.
    of_segment = ratios.max(axis=1).reshape(5, -1).max(axis=0)
    assert np.quantile(of_segment, 0.03) > 0.97
    assert_allclose(path.q[[0, -1]], points[[0, -1]], atol=1e-12)
    assert_allclose(path.qd[[0, -1]], 0.0, atol=1e-9)
    if blend is None:  # the path passes all points
        dense = path(np.linspace(0, path.duration, 20001)).q
        assert np.abs(dense[:, None] - points).max(axis=2).min(axis=0).max() < 1e-3


@pytest.mark.parametrize("name", ["puma560", "irb460"])
def test_halving_the_grid_converges(name: str) -> None:
    arm, points, limits = random_motion(name, 5)
    durations = [
        ab.least_time(arm, points, grid=grid, **limits).duration for grid in (50, 100, 200, 400, 800)
    ]
    steps = -np.diff(durations)
    # The error is of first order in the length of the segments.
    assert np.abs(steps[-1]) < 0.01 * durations[-1]
    assert np.abs(steps[2:]).sum() < 0.7 * np.abs(steps[:2]).sum()


@pytest.mark.parametrize("seed", range(8))
def test_strong_friction_leaves_a_motion_at_any_grid(seed: int) -> None:
    arm, points, limits = random_motion("puma560", 5, seed)
    dry = np.abs(arm.friction([np.full(6, 1e-6), np.full(6, -1e-6)])).max(axis=0)
    limits["torque"][0] = 1.05 * dry[0]  # the axis of the first joint is vertical: no weight
    path = ab.least_time(arm, points, grid=100, **limits)
    t = np.linspace(0.0, path.duration, 3000)
    tau = arm.rne(*path(t))
    assert (np.abs(tau) / limits["torque"]).max() < 1.005


def test_one_joint_without_friction_accelerates_and_brakes() -> None:
    inertia = 2.0  # 2 kg at 1 m
    path = ab.least_time(one_joint(), [[0.0], [1.5]], speed=50.0, torque=3.0)
    assert path.duration == pytest.approx(2 * np.sqrt(1.5 * inertia / 3.0), rel=1e-9)
    loaded = ab.least_time(one_joint(), [[0.0], [1.5]], speed=50.0, torque=3.0, payload=1.0)
    assert loaded.duration == pytest.approx(2 * np.sqrt(1.5 * (inertia + 1.0) / 3.0), rel=1e-9)
    with_rotor = one_joint(ab.Motor(inertia=0.02, gear_ratio=10.0))
    assert ab.least_time(with_rotor, [[0.0], [1.5]], speed=50.0, torque=3.0).duration == pytest.approx(
        2 * np.sqrt(1.5 * (inertia + 2.0) / 3.0), rel=1e-9
    )


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("viscous", "coulomb"), [(0.0, 0.6), (2.5, 0.0), (1.5, 0.4)])
def test_friction_of_one_joint_agrees_with_the_closed_form(
    sign: float, viscous: float, coulomb: float
) -> None:
    """Phases of constant torque: I v' = ±tau - Tc - B v; the switching speed is that of the distance."""
    inertia, limit, distance = 2.0, 3.0, 1.5

    def phase(v: float, force: float) -> tuple[float, float]:
        """Time and distance between rest and the speed v, under the net force at rest."""
        if viscous == 0.0:
            return abs(v * inertia / force), abs(v * v * inertia / (2 * force))
        ratio = 1.0 - viscous * v / force
        time = -inertia / viscous * np.log(ratio)
        return abs(time), abs((force * time - inertia * v) / viscous)

    up, down = limit - coulomb, -(limit + coulomb)
    most = 0.999999 * up / viscous if viscous else 100.0
    v = brentq(lambda v: phase(v, up)[1] + phase(v, down)[1] - distance, 1e-6, most, xtol=1e-14)
    expected = phase(v, up)[0] + phase(v, down)[0]
    arm = one_joint(ab.Motor(viscous_friction=viscous, coulomb_friction=coulomb))
    errors = [
        ab.least_time(arm, [[0.0], [sign * distance]], speed=50.0, torque=limit, grid=grid).duration
        - expected
        for grid in (200, 400, 800)
    ]
    assert abs(errors[0]) < 0.02 * expected
    assert abs(errors[2]) < 0.4 * abs(errors[0]) + 1e-9


def test_positions_outside_the_limits_raise_a_warning() -> None:
    arm = ab.load_robot("puma560")
    points = np.zeros((2, 6))
    points[:, 1], points[1, 0] = 1.2, 3.0
    with pytest.warns(LimitWarning, match=r"link1"):
        ab.least_time(arm, points, speed=1.0, acceleration=5.0, torque=200.0)


def test_speed_limits_alone_give_the_largest_speed_at_each_point() -> None:
    arm, points, _ = random_motion("iiwa14", 4)
    free = arm.robot.n * [np.inf]
    path = ab.least_time(arm, points, speed=1.0, acceleration=1e4, torque=free)
    middle = path(np.linspace(0.05, 0.95, 300) * path.duration)
    assert_allclose(np.abs(middle.qd).max(axis=1), 1.0, rtol=0.015)


def test_motions_that_cannot_be_found_are_refused() -> None:
    arm = ab.load_robot("puma560")
    points = [[0, 0.2, 0, 0, 0, 0], [1, 0.4, 0, 0, 0, 0]]
    with pytest.raises(InputError, match=r"the path is infeasible at 100 %.*joint 'link2' needs .* to hold"):
        ab.least_time(arm, points, torque=20.0, speed=1.0)
    with pytest.raises(InputError, match="nothing limits the motion of the robot"):
        ab.least_time(one_joint(), [[0.0], [1.0]])
    with pytest.raises(InputError, match=r"the points have 2 joints.*6, the number of joints of robot"):
        ab.least_time(arm, [[0, 0], [1, 1]])
    with pytest.raises(InputError, match="the points 1 and 2 are the same"):
        ab.least_time(arm, [points[0], points[0]], torque=100.0)
    with pytest.raises(InputError, match="the points 1 and 2 are the same"):
        ab.least_time(arm, [[0.0] * 6, [1e-15] * 6], torque=100.0, speed=1.0)
    with pytest.raises(InputError, match=r"blend = 0.7.*up to 0.5"):
        ab.least_time(arm, [*points, points[0]], torque=100.0, blend=0.7)
    with pytest.raises(InputError, match=r"grid = 3.*an integer of 10 or more"):
        ab.least_time(arm, points, torque=100.0, grid=3)
    ball = ab.Arm(ab.Robot(name="ball", links=(ab.Link(name="a", joint=ab.Spherical(), mass=1.0),)))
    with pytest.raises(RobotError, match="least_time, robot 'ball': the robot has ball joints"):
        ab.least_time(ball, [[0.0], [1.0]])
