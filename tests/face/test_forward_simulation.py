"""``Arm.fdyn``: energy, torque laws in continuous and sampled time, joints that stick."""

from __future__ import annotations

import numpy as np
import pytest

import armblocks as ab
from armblocks.errors import ArmblocksError
from armblocks.robot import Link, Motor, Revolute, Robot, Spherical
from robots_for_tests import build_mixed_tree


def pendulum(**motor: object) -> ab.Arm:
    link = Link(
        name="rod",
        joint=Revolute(axis=(0, 1, 0)),
        mass=1.0,
        centre_of_mass=(0, 0, -0.5),
        inertia=(0.1, 0.1, 0.01),
        motor=Motor(**motor) if motor else None,  # type: ignore[arg-type]
    )
    return ab.Arm(Robot(name="pendulum", links=(link,)))


def test_energy_is_constant_without_torque_and_friction() -> None:
    arm = ab.load_robot("puma560").nofriction("all")
    t, q, qd = motion = arm.fdyn(0.5, q0=[0, 0.3, -1.0, 0.2, 0.1, 0], rtol=1e-9, atol=1e-9)
    assert t[0] == 0.0 and t[-1] == 0.5 and len(motion) == 51 and q.shape == (51, 6)
    energy = arm.kinetic_energy(q, qd) + arm.potential_energy(q)
    assert np.ptp(energy) < 1e-6 and np.ptp(arm.kinetic_energy(q, qd)) > 1.0
    assert np.allclose(arm.accel(q, qd, motion.tau), motion.qdd, atol=1e-8) and not motion.tau.any()


def test_energy_is_constant_with_ball_joints() -> None:
    arm = ab.Arm(build_mixed_tree(2, [Spherical]))
    motion = arm.fdyn(0.1, qd0=np.full(arm.n, 0.5), rtol=1e-9, atol=1e-9)
    if not any(link.motor and link.motor.viscous_friction for link in arm.robot.links):
        energy = arm.kinetic_energy(motion.q, motion.qd) + arm.potential_energy(motion.q)
        assert np.ptp(energy) < 1e-5 * max(1.0, float(np.abs(energy).max()))
    assert motion.q.shape[1] == arm.nq


def test_the_swing_of_a_pendulum_has_its_period() -> None:
    arm = pendulum()
    period = 2 * np.pi * np.sqrt((0.1 + 0.25) / (9.81 * 0.5))
    t, q, _ = arm.fdyn(period, q0=[0.01], dt=period / 4, rtol=1e-9, atol=1e-12)
    assert q[:, 0] == pytest.approx([0.01, 0.0, -0.01, 0.0, 0.01], abs=2e-6)
    assert t[-1] == pytest.approx(period)


def test_torques_may_be_constant_or_a_law_of_time_and_state() -> None:
    arm = pendulum()
    held = arm.fdyn(0.3, torque=arm.gravload([0.5]), q0=[0.5])
    assert np.allclose(held.q, 0.5)

    def law(q: object, qd: object) -> object:
        return -20.0 * (q - 0.3) - 5.0 * qd  # type: ignore[operator]

    motion = arm.fdyn(1.0, law, q0=[0.0])
    assert np.allclose(motion.tau, -20.0 * (motion.q - 0.3) - 5.0 * motion.qd)
    timed = arm.fdyn(0.2, lambda t: 2.0 * t)
    assert np.allclose(timed.tau[:, 0], 2.0 * timed.t)


def test_sampled_laws_may_branch() -> None:
    arm = pendulum()
    ticks: list[float] = []

    def law(t: float, q: np.ndarray) -> np.ndarray:
        ticks.append(t)
        return np.array([1.0 if q[0] < 0.05 else -1.0])

    motion = arm.fdyn(0.5, law, sample_time=0.1)
    assert ticks[:5] == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4])
    assert set(np.unique(motion.tau)) == {-1.0, 1.0}


def test_joints_with_coulomb_friction_stick() -> None:
    arm = pendulum(gear_ratio=1.0, coulomb_friction=(3.0, -3.0))
    motion = arm.fdyn(1.0, q0=[0.5])  # gravity exerts less torque than the friction
    assert np.array_equal(motion.q, np.full_like(motion.q, 0.5)) and not motion.qd.any()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ({"duration": 0.0}, "duration = 0.0"),
        ({"duration": [0.1, 0.2]}, r"duration = \[0.1, 0.2\]. Allowed: a finite number above 0, in s"),
        ({"duration": 1.0, "dt": -1.0}, "dt = -1.0. Allowed: a finite number above 0, in s"),
        ({"duration": 1.0, "q0": [0.0, 1.0]}, r"q0 has the shape \(2,\)"),
        ({"duration": 1.0, "torque": [0.0, 1.0]}, r"torque has the shape \(2,\)"),
        ({"duration": 1.0, "torque": lambda robot, t: 0.0}, "the torque function has the argument 'robot'"),
        ({"duration": 1.0, "torque": lambda q: 1.0 if q[0] > 0 else 0.0}, "cannot be traced"),
        ({"duration": 1.0, "tolerance": 1.0}, "there is no argument named 'tolerance'"),
    ],
)
def test_refusals(call: dict[str, object], message: str) -> None:
    with pytest.raises(ArmblocksError, match=message):
        pendulum().fdyn(**call)  # type: ignore[arg-type]
