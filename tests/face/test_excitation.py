"""Motions for identification: within the limits, at rest at the ends, and better than random ones."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import armblocks as ab
from armblocks.errors import InputError, RobotError
from robots_for_tests import MIXED_ROBOTS


def limited_arm() -> ab.Arm:
    """Return a vertical arm of two revolute joints and a prismatic one, one of them without limits."""
    links = [
        ab.Link(
            name=name,
            parent=parent,
            joint=joint,
            before=ab.Transform(translation=(0.4, 0.0, 0.1)),
            mass=2.0,
            centre_of_mass=(0.1, 0.05, 0.02),
            inertia=(0.02, 0.03, 0.04),
            motor=ab.Motor(inertia=1e-4, gear_ratio=20.0),
        )
        for name, parent, joint in (
            ("a", None, ab.Revolute(axis=(0, 1, 0), limits=ab.JointLimits(position=(-1.0, 2.0)))),
            ("b", "a", ab.Prismatic(axis=(1, 0, 0), limits=ab.JointLimits(position=(0.1, 0.6), speed=0.3))),
            ("c", "b", ab.Revolute(axis=(0, 1, 0))),
        )
    ]
    return ab.Arm(ab.Robot(name="limited", links=tuple(links)))


def test_motions_are_within_the_limits_and_at_rest_at_both_ends() -> None:
    arm = limited_arm()
    found = ab.excitation(arm, 4.0, acceleration=3.0, torque=[200, 100, 50], evaluations=60, dt=0.05)
    path = found.trajectory
    low, high = arm.robot.qlim.T
    assert (path.q > low).all() and (path.q < high).all()
    assert np.abs(path.qd[:, 1]).max() < 0.3 and np.abs(path.qdd).max() < 3.0
    assert_allclose(path.t[[0, -1]], [0.0, 4.0])
    assert_array_equal(path.qd[[0, -1]], 0.0)
    assert_array_equal(path.qdd[[0, -1]], 0.0)
    assert_allclose(path.q[0], path.q[-1], atol=1e-12)  # the motion can be repeated
    assert (np.abs(arm.rne(*path)) <= [200, 100, 50]).all()
    # The derivatives are those of the positions.
    assert_allclose(np.gradient(path.q, path.t, axis=0)[2:-2], path.qd[2:-2], atol=0.02)
    assert_allclose(np.gradient(path.qd, path.t, axis=0)[2:-2], path.qdd[2:-2], atol=0.1)
    assert f"condition number {found.condition:.4g} after 60 evaluations" in repr(found)


def test_the_search_improves_the_condition_number_and_is_reproducible() -> None:
    arm = limited_arm()
    seen: list[float] = []
    found = ab.excitation(
        arm, speed=1.0, evaluations=80, progress=lambda _, condition: seen.append(condition)
    )
    again = ab.excitation(arm, speed=1.0, evaluations=80)
    assert_array_equal(found.trajectory.q, again.trajectory.q)
    assert found.condition == min(seen) and found.condition < 0.7 * max(seen)
    # The parameters are identified along this motion.
    q, qd, qdd = found.trajectory
    result = ab.identify(
        arm, {"t": found.trajectory.t, "q": q, "qd": qd, "qdd": qdd, "tau": arm.rne(q, qd, qdd)}
    )
    assert not result.not_identified
    assert_allclose(result.values, result.prior, atol=1e-6)


def test_the_search_can_be_stopped() -> None:
    def interrupt(count: int, condition: float) -> None:
        raise KeyboardInterrupt

    stopped = ab.excitation(limited_arm(), evaluations=50, progress=interrupt)
    assert stopped.stopped and stopped.evaluations < 50 and np.isfinite(stopped.condition)


def test_limits_hold_between_samples_also_with_many_harmonics() -> None:
    found = ab.excitation(
        limited_arm(), 4.0, harmonics=60, speed=1.0, acceleration=40.0, dt=4 / 4001, evaluations=3
    )
    assert np.abs(found.trajectory.qd).max() <= 1.0 and np.abs(found.trajectory.qdd).max() <= 40.0


def test_unsuitable_arguments_are_refused() -> None:
    arm = limited_arm()
    with pytest.raises(InputError, match="an integer from 2 to 100"):
        ab.excitation(arm, harmonics=1)
    for wrong in ({"harmonics": float("nan")}, {"harmonics": "3"}):
        with pytest.raises(InputError, match=r"harmonics = .*an integer from 2 to 100"):
            ab.excitation(arm, **wrong)
    for name, value in (
        ("evaluations", 0),
        ("evaluations", float("nan")),
        ("evaluations", 2.5),
        ("seed", -1),
    ):
        with pytest.raises(InputError, match=rf"{name} = {value}.*an integer, . or more"):
            ab.excitation(arm, **{name: value})
    with pytest.raises(InputError, match=r"dt = 5.0.*up to 0.2 s: 4 samples"):
        ab.excitation(arm, 4.0, dt=5.0)
    with pytest.raises(InputError, match="no motion within the torque limits was found"):
        ab.excitation(arm, torque=0.01, evaluations=5)
    with pytest.raises(RobotError, match="the robot has ball joints"):
        ab.excitation(ab.Arm(MIXED_ROBOTS[1]))
