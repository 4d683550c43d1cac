"""Controllers, drives and kinematic quantities of an arm, tested by their defining properties."""

from __future__ import annotations

import numpy as np
import pytest
from block_evaluation import evaluate

from armblocks import dynamics
from armblocks.blocks import (
    ComputedTorque,
    FeedForward,
    GravityCompensation,
    JacobianInverse,
    JointPD,
    JointStops,
    LoadedRne,
    Manipulability,
    MotorDrive,
    RobotEnergy,
)
from armblocks.errors import DiagramError, InputError
from armblocks.robot import Robot

RANDOM = np.random.default_rng(25)


def test_inverses_of_a_jacobian_have_their_defining_properties() -> None:
    J = RANDOM.normal(size=(6, 6))
    assert evaluate(JacobianInverse(), J)["Ji"] == pytest.approx(np.linalg.inv(J), rel=1e-10)
    assert np.array_equal(evaluate(JacobianInverse(method="transpose"), J)["Ji"], J.T)
    for shape in ((6, 7), (6, 4)):
        J = RANDOM.normal(size=shape)
        pseudo = evaluate(JacobianInverse(method="pseudo"), J)["Ji"]
        assert pseudo == pytest.approx(np.linalg.pinv(J), rel=1e-9, abs=1e-12)
        damped = evaluate(JacobianInverse(method="damped", damping=0.3), J)["Ji"]
        expected = J.T @ np.linalg.inv(J @ J.T + 0.09 * np.eye(6))
        assert damped == pytest.approx(expected, rel=1e-9, abs=1e-11)
    singular = evaluate(JacobianInverse(method="damped"), np.ones((6, 6)))["Ji"]
    assert np.isfinite(singular).all()


def test_arm_quantities_agree_with_the_dynamics_functions(puma560: Robot) -> None:
    q, qd, qdd = RANDOM.uniform(-1, 1, (3, 6))
    (w,) = dynamics.trace_manipulability(puma560)(q)
    assert evaluate(Manipulability(robot=puma560), q)["w"] == pytest.approx(float(w), rel=1e-12)
    energy = evaluate(RobotEnergy(robot=puma560), q, qd)
    (M,) = dynamics.trace_inertia(puma560)(q)
    assert energy["kinetic"] == pytest.approx(float(qd @ M @ qd) / 2, rel=1e-6)
    (V,) = dynamics.trace_potential_energy(puma560)(q)
    assert energy["potential"] == pytest.approx(float(V), rel=1e-12)
    wrench, payload = RANDOM.normal(size=6), [2.0, 0.1, 0, 0.2, 0.1, 0.1, 0.1, 0, 0, 0]
    (tau,) = dynamics.trace_rne_loaded(puma560)(q, qd, qdd, wrench, payload)
    result = evaluate(LoadedRne(robot=puma560), q, qd, qdd, wrench, payload)["tau"]
    assert result == pytest.approx(tau, rel=1e-11, abs=1e-11)


def test_pd_control_acts_on_each_joint() -> None:
    qr, qdr, q, qd = RANDOM.normal(size=(4, 3))
    expected = [10, 20, 30] * (qr - q) + 5 * (qdr - qd)
    assert evaluate(JointPD(Kp=[10, 20, 30], Kd=5.0), qr, qdr, q, qd)["tau"] == pytest.approx(
        expected, rel=1e-14
    )


def test_computed_torque_gives_linear_error_dynamics(puma560: Robot) -> None:
    qr, qdr, qddr, q, qd = RANDOM.uniform(-1, 1, (5, 6))
    tau = evaluate(ComputedTorque(robot=puma560, Kp=25.0, Kd=[10.0] * 6), qr, qdr, qddr, q, qd)["tau"]
    (qdd,) = dynamics.trace_accel(puma560)(q, qd, tau)
    assert qddr - qdd == pytest.approx(-10 * (qdr - qd) - 25 * (qr - q), rel=1e-9)


def test_feed_forward_on_the_reference_motion_gives_the_reference_acceleration(puma560: Robot) -> None:
    q, qd, qdd = RANDOM.uniform(-1, 1, (3, 6))
    tau = evaluate(FeedForward(robot=puma560), q, qd, qdd, q, qd)["tau"]
    (result,) = dynamics.trace_accel(puma560)(q, qd, tau)
    assert result == pytest.approx(qdd, rel=1e-9)
    off = evaluate(FeedForward(robot=puma560, Kp=7.0), q + 0.1, qd, qdd, q, qd)["tau"]
    on = evaluate(FeedForward(robot=puma560, Kp=7.0), q + 0.1, qd, qdd, q + 0.1, qd)["tau"]
    assert off - on == pytest.approx(np.full(6, 0.7), rel=1e-9)


def test_gravity_compensation_at_the_reference_pose_equals_gravload(puma560: Robot) -> None:
    q = RANDOM.uniform(-1, 1, 6)
    tau = evaluate(GravityCompensation(robot=puma560), q, q, np.zeros(6))["tau"]
    (g,) = dynamics.trace_gravload(puma560)(q)
    assert tau == pytest.approx(g, rel=1e-12, abs=1e-12)


def test_a_drive_limits_its_torque() -> None:
    drive = MotorDrive(peak=10.0, stall=20.0, no_load_speed=100.0)
    u = [50.0, 50.0, 50.0, 50.0, -50.0, 3.0, -50.0]
    w = [0.0, 50.0, 75.0, 110.0, 75.0, 0.0, -75.0]
    assert evaluate(drive, u, w)["y"] == pytest.approx([10, 10, 5, -2, -10, 3, -5], rel=1e-14)


def test_joint_stops_push_and_never_pull() -> None:
    stops = JointStops(lower=-1.0, upper=[1.0, 2.0, 1.0, 1.0, np.inf], stiffness=100.0, damping=10.0)
    q, qd = [-1.5, 1.5, 1.2, 1.2, 99.0], [0.0, 0.0, 1.0, -9.0, 0.0]
    assert evaluate(stops, q, qd)["tau"] == pytest.approx([50, 0, -30, 0, 0], rel=1e-14)


def test_inputs_of_inconsistent_sizes_are_refused(puma560: Robot) -> None:
    with pytest.raises(DiagramError, match=r"the Jacobian has shape \(6, 4\).*choose 'pseudo' or 'damped'"):
        evaluate(JacobianInverse(), np.ones((6, 4)))
    with pytest.raises(InputError, match=r"ComputedTorque: Kp has 2 gains. Allowed: 6, one for each joint"):
        ComputedTorque(robot=puma560, Kp=[1, 2])
