"""Joints with several coordinates: quaternions, and motions with known solutions."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import armblocks as ab
from armblocks.errors import InputError, RobotError
from armblocks.robot import (
    JOINT_TYPES,
    Cylindrical,
    Fixed,
    Free,
    Joint,
    JointLimits,
    Link,
    Planar,
    Prismatic,
    Revolute,
    Robot,
    Screw,
    Spherical,
    Universal,
    serial_chain,
)
from armblocks.spatial import transl
from robots_for_tests import (
    MIXED_ROBOTS,
    along,
    build_mixed_tree,
    evaluate,
    random_joint,
    random_states,
)

BODY = {"mass": 2.0, "centre_of_mass": (0.1, -0.2, 0.3), "inertia": (0.3, 0.4, 0.55, 0.02, -0.01, 0.03)}


def test_integration_inverts_differences(robot: Robot):
    for q0, qd, q1 in [
        (q, qd, qn) for (q, qd, _), (qn, _, _) in zip(random_states(robot), random_states(robot, seed=9))
    ]:
        step = evaluate(robot, "difference", q0, q1).ravel()
        reached = along(robot, q0, step, 1.0)
        assert_allclose(evaluate(robot, "fkine", reached), evaluate(robot, "fkine", q1), rtol=0, atol=1e-13)
        # Angles of balls below π are found again.
        small = 0.3 * qd
        assert_allclose(
            evaluate(robot, "difference", q0, along(robot, q0, small, 1.0)).ravel(), small, rtol=0, atol=1e-13
        )
        assert_allclose(evaluate(robot, "difference", q0, q0).ravel(), 0 * qd, rtol=0, atol=1e-15)


def test_position_rates_are_the_derivative_of_integration(robot: Robot):
    h = 1e-6
    for q, qd, _ in random_states(robot, 2):
        unit = evaluate(robot, "normalised", q).ravel()
        change = (along(robot, unit, qd, h) - along(robot, unit, qd, -h)) / (2 * h)
        assert_allclose(evaluate(robot, "position_rates", unit, qd).ravel(), change, rtol=0, atol=1e-8)


def test_tiny_rotations_are_exact():
    ball = Robot(name="ball", links=(Link(name="b", joint=Spherical(), **BODY),))
    for size in (0.0, 1e-300, 1e-160, 1e-20, 1e-9):
        qd = size * np.array((1.0, -2.0, 0.5))
        q = along(ball, ball.neutral, qd, 1.0)
        assert_allclose(q, (1.0, *(qd / 2)), rtol=1e-15, atol=0)
        assert_allclose(evaluate(ball, "difference", ball.neutral, q).ravel(), qd, rtol=1e-15, atol=0)
    opposite = evaluate(ball, "difference", (1, 0, 0, 0), (0, 0, 0, -3.0)).ravel()
    assert_allclose(np.abs(opposite), (0, 0, np.pi), atol=1e-15)


@pytest.mark.parametrize("robot", MIXED_ROBOTS, ids=lambda robot: robot.name)
def test_only_the_direction_of_a_quaternion_counts(robot: Robot):
    arrays = ("fkine", "jacob0", "jacobe", "inertia", "gravload", "potential_energy", "centre_of_mass")
    for q, qd, qdd in random_states(robot, 1):
        unit = evaluate(robot, "normalised", q).ravel()
        scaled = unit.copy()
        position = 0
        for joint in robot.joints:
            for motion in joint.motions:
                count = len(motion.positions)
                if count == 4:
                    assert np.linalg.norm(unit[position : position + 4]) == pytest.approx(1.0, rel=1e-15)
                    scaled[position : position + 4] *= -1e3
                else:
                    assert unit[position] == q[position]
                position += count
        for name in arrays:
            assert_allclose(
                evaluate(robot, name, scaled), evaluate(robot, name, unit), rtol=1e-11, atol=1e-12
            )
        for name in ("rne", "accel"):
            assert_allclose(
                evaluate(robot, name, scaled, qd, qdd), evaluate(robot, name, unit, qd, qdd), rtol=1e-9
            )


@pytest.mark.parametrize("length", [1e300, 1e200, 1e-200, 1e-300])
def test_quaternions_of_extreme_lengths_are_rotations(length: float):
    """Their squares overflow or underflow."""
    robot = Robot(name="ball", links=(Link(name="b", joint=Spherical(), **BODY),))
    for q, qd, qdd in random_states(robot, 2):
        unit = evaluate(robot, "normalised", q).ravel()
        other = length * unit
        assert_allclose(evaluate(robot, "normalised", other).ravel(), unit, rtol=0, atol=1e-15)
        assert_allclose(evaluate(robot, "fkine", other), evaluate(robot, "fkine", unit), rtol=0, atol=1e-15)
        assert_allclose(evaluate(robot, "difference", other, unit), 0.0, rtol=0, atol=1e-15)
        assert_allclose(evaluate(robot, "difference", unit, other), 0.0, rtol=0, atol=1e-15)
        expected = evaluate(robot, "accel", unit, qd, qdd)
        assert_allclose(evaluate(robot, "accel", other, qd, qdd), expected, rtol=1e-12)
        moved = evaluate(robot, "integrate", other, qd, 0.1)
        assert_allclose(moved, evaluate(robot, "integrate", unit, qd, 0.1), rtol=0, atol=1e-15)


def test_a_quaternion_of_zeros_gives_nan_and_not_a_wrong_pose():
    ball = Robot(name="ball", links=(Link(name="b", joint=Spherical(), **BODY),))
    assert np.isnan(evaluate(ball, "fkine", np.zeros(4))[:3, :3]).all()
    assert np.isnan(evaluate(ball, "gravload", np.zeros(4))).all()
    with pytest.raises(InputError, match=r"the quaternion of a joint is 0 0 0 0.*start from arm.neutral"):
        ball.links[0].pose(np.zeros(4))


# -- motions with known solutions ---------------------------------------------------------------------------


def rotate(axis: int, angle: float) -> np.ndarray:
    quaternion = np.zeros(4)
    quaternion[0], quaternion[1 + axis] = np.cos(angle / 2), np.sin(angle / 2)
    return quaternion


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    w = a[0] * b[0] - a[1:] @ b[1:]
    return np.array((w, *(a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))))


def test_a_ball_joint_equals_three_revolute_joints():
    """Torques have the same power: ``tau_angles = E' tau_ball`` with ``omega = E rates``."""
    base = Link(name="base", joint=Revolute(axis=(0.6, 0, 0.8)), before=transl(0.1, 0.2, 0.3), **BODY)
    ball = Robot(name="ball", links=serial_chain((base, Link(name="b", joint=Spherical(), **BODY))))
    axes = [Link(name=f"{k}", joint=Revolute(axis=tuple(np.eye(3)[k]))) for k in range(3)]
    series = Robot(name="series", links=serial_chain((base, *axes[:2], replace(axes[2], **BODY))))
    random = np.random.default_rng(1)
    for _ in range(3):
        q0, (a, b, c) = random.uniform(-1, 1), random.uniform(-1, 1, 3)
        rates, second = random.uniform(-2, 2, 4), random.uniform(-2, 2, 4)
        quaternion = product(product(rotate(0, a), rotate(1, b)), rotate(2, c))
        q = np.array((q0, *quaternion))

        def matrix(b: float, c: float) -> np.ndarray:
            """The angular velocity in the axes of the body is this matrix times the rates of the angles."""
            return np.array(
                (
                    (np.cos(b) * np.cos(c), np.sin(c), 0.0),
                    (-np.cos(b) * np.sin(c), np.cos(c), 0.0),
                    (np.sin(b), 0.0, 1.0),
                )
            )

        E, h = matrix(b, c), 1e-6
        ahead, behind = (matrix(b + s * h * rates[2], c + s * h * rates[3]) for s in (1, -1))
        omega = E @ rates[1:]
        alpha = E @ second[1:] + (ahead - behind) / (2 * h) @ rates[1:]
        angles = np.array((q0, a, b, c))
        assert_allclose(evaluate(ball, "fkine", q), evaluate(series, "fkine", angles), rtol=0, atol=1e-15)
        qd, qdd = np.array((rates[0], *omega)), np.array((second[0], *alpha))
        tau, expected = (
            evaluate(ball, "rne", q, qd, qdd).ravel(),
            evaluate(series, "rne", angles, rates, second),
        )
        assert_allclose((tau[0], *(E.T @ tau[1:])), expected.ravel(), rtol=0, atol=1e-8)
        energy = evaluate(ball, "kinetic_energy", q, qd)
        assert energy == pytest.approx(evaluate(series, "kinetic_energy", angles, rates), rel=1e-13)
        assert evaluate(ball, "manipulability", q) == pytest.approx(
            np.linalg.norm(np.linalg.svd(evaluate(ball, "jacob0", q), compute_uv=False).prod()), rel=1e-12
        )


def simulated(
    robot: Robot, q: np.ndarray, qd: np.ndarray, steps: int, h: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the state after steps of the classical Runge-Kutta method without torques."""
    frictionless, tau = robot.nofriction(), np.zeros(robot.n)

    def rates(q: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        qdd = evaluate(frictionless, "accel", q, qd, tau).ravel()
        return evaluate(robot, "position_rates", q, qd).ravel(), qdd

    for _ in range(steps):
        a1, b1 = rates(q, qd)
        a2, b2 = rates(q + h / 2 * a1, qd + h / 2 * b1)
        a3, b3 = rates(q + h / 2 * a2, qd + h / 2 * b2)
        a4, b4 = rates(q + h * a3, qd + h * b3)
        q, qd = q + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4), qd + h / 6 * (b1 + 2 * b2 + 2 * b3 + b4)
    return q, qd


def test_a_free_body_without_gravity_keeps_its_momenta():
    body = Robot(name="body", links=(Link(name="b", joint=Free(), **BODY),), gravity=(0, 0, 0))
    link = body.links[0]

    def momenta(q: np.ndarray, qd: np.ndarray) -> np.ndarray:
        T, J = evaluate(body, "fkine", q), evaluate(body, "jacob0", q)
        v, w = (J @ qd)[:3], (J @ qd)[3:]
        R, r = T[:3, :3], T[:3, :3] @ link.r
        linear = link.mass * (v + np.cross(w, r))
        return np.concatenate((linear, R @ link.I @ R.T @ w + np.cross(T[:3, 3] + r, linear)))

    q, qd = np.array((1.0, 2.0, 3.0, 0.5, 0.5, -0.5, 0.5)), np.array((0.3, -0.2, 0.1, 2.0, -1.0, 0.5))
    start = momenta(q, qd)
    assert_allclose(momenta(*simulated(body, q, qd, 200, 0.005)), start, rtol=0, atol=1e-8)


def test_a_heavy_symmetric_top_precesses_at_the_rate_of_the_closed_form():
    """Steady precession: ``A cos(θ) Ω² - C s Ω + m g l = 0`` with the spin ``s`` about the axis.

    Source: Goldstein, *Classical Mechanics*, 5.7; A, C: moments about the fixed point.
    """
    mass, length, A0, C = 1.5, 0.4, 0.05, 0.08
    top = Robot(
        name="top",
        links=(
            Link(
                name="t",
                joint=Spherical(),
                mass=mass,
                centre_of_mass=(0, 0, length),
                inertia=(A0, A0, C),
            ),
        ),
    )
    A, tilt, rate = A0 + mass * length**2, 0.6, 1.7
    spin = (A * np.cos(tilt) * rate**2 + mass * 9.81 * length) / (C * rate)
    q = rotate(0, -tilt)
    upright = np.array(top.links[0].pose(q).R.T @ (0, 0, 1.0))
    qd = rate * upright
    qd[2] = spin
    # Precession is a rotation about the vertical, so that the accelerations are known.
    qdd = evaluate(top, "accel", q, qd, np.zeros(3)).ravel()
    relative = np.cross(rate * upright, qd)
    assert_allclose(qdd, relative, rtol=0, atol=1e-12 * spin)
    end, _ = simulated(top, q, qd, 1000, 5e-4)
    axis = np.array(top.links[0].pose(end).R)[:, 2]
    start = np.array(top.links[0].pose(q).R)[:, 2]
    angle = rate * 0.5
    c, s = np.cos(angle), np.sin(angle)
    assert_allclose(axis, np.array(((c, -s, 0), (s, c, 0), (0, 0, 1))) @ start, rtol=0, atol=1e-7)


def test_a_cardan_joint_has_the_known_transmission_ratio():
    """The universal joint between two shafts at an angle β: ``tan φ2 = tan φ1 cos β``, here by its poses."""
    joint = Universal()
    for a, b in ((0.3, -0.4), (1.2, 0.9)):
        R = joint.motion((a, b)).R
        assert_allclose(
            R[:, 1], (0, np.cos(a), np.sin(a)), atol=1e-15
        )  # the first axis is fixed in the parent
        assert_allclose(R.T @ (1, 0, 0), (np.cos(b), 0, np.sin(b)), atol=1e-15)


def test_two_series_of_joints_equal_their_joint_type():
    links = {
        Cylindrical(axis=(1, 2, 3)): (Revolute(axis=(1, 2, 3)), Prismatic(axis=(1, 2, 3))),
        Universal(axis=(1, 0, 1), second_axis=(0, 1, 0)): (
            Revolute(axis=(1, 0, 1)),
            Revolute(axis=(0, 1, 0)),
        ),
        Planar(): (Prismatic(axis=(1, 0, 0)), Prismatic(axis=(0, 1, 0)), Revolute()),
    }
    for joint, parts in links.items():
        one = Robot(name="one", links=(Link(name="b", joint=joint, before=transl(0.1, 0.2, 0), **BODY),))
        first = Link(name="0", joint=parts[0], before=transl(0.1, 0.2, 0))
        rest = [Link(name=f"{k}", joint=part) for k, part in enumerate(parts[1:], start=1)]
        series = [first, *rest]
        series[-1] = replace(series[-1], **BODY)
        two = Robot(name="two", links=serial_chain(series))
        for state in random_states(one, 2):
            for name, values in (
                ("fkine", state[:1]),
                ("rne", state),
                ("accel", state),
                ("coriolis", state[:2]),
            ):
                assert_array_equal(evaluate(one, name, *values), evaluate(two, name, *values))


# -- descriptions -----------------------------------------------------------------------------------------


def test_every_joint_type_has_consistent_coordinates():
    random = np.random.default_rng(2)
    letters = set()
    for kind in JOINT_TYPES:
        joint = random_joint(kind, random)
        letters.add(joint.letter)
        assert joint.nq == len(joint.positions) == len(joint.neutral)
        assert joint.nv == len(joint.speeds) == len(joint.coordinate_limits)
        assert joint.moves is (kind is not Fixed)
        assert {entry.unit for entry in joint.speeds} <= {"rad", "m"}
        names = [entry.name for entry in joint.positions]
        assert len(set(names)) == len(names)
        if joint.offset == 0:
            assert joint.motion(joint.neutral).is_identity
    assert len(letters) == len(JOINT_TYPES)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: Spherical(axis=(1, 0, 0)), "a Spherical joint has no axis"),
        (lambda: Planar(offset=0.1), "a Planar joint has no offset.*put the constant rotation"),
        (lambda: Universal(offset=0.1), "a Universal joint has no offset"),
        (lambda: Screw(), "the pitch of a screw joint is 0 m"),
        (lambda: Screw(pitch=float("nan")), "the pitch of a screw joint is nan m"),
        (lambda: Universal(limits=(JointLimits(),)), "1 limit is given.*2 for a Universal joint"),
        (
            lambda: Spherical(limits=JointLimits(position=(-1, 1))),
            "coordinate wx of a Spherical joint has position",
        ),
        (lambda: Cylindrical(limits=(1, 2)), "limits of a joint"),
        (lambda: Revolute(limits=None), "limits of a joint"),
    ],
)
def test_parameters_that_a_joint_type_does_not_have_are_refused(make, text: str):
    with pytest.raises(RobotError, match=text):
        make()


@pytest.mark.parametrize("joint", [Universal(second_axis=(0, 0, 0)), Universal(axis=(0, 0, 0))])
def test_zero_axes_are_refused(joint: Joint):
    with pytest.raises(RobotError, match="the joint's axis is zero"):
        Robot(name="r", links=(Link(name="l", joint=joint),))


def test_limits_of_several_coordinates_are_in_the_order_of_the_speeds():
    travel = JointLimits(position=(0.0, 0.5), speed=2.0)
    links = (
        Link(name="root", joint=Free(limits=JointLimits(torque=7.0)), mass=1.0),
        Link(name="rod", parent="root", joint=Cylindrical(limits=(JointLimits(position=(-1, 1)), travel))),
    )
    robot = Robot(name="r", links=links)
    assert (robot.nq, robot.nv, robot.n) == (9, 8, 8)
    assert robot.torque_limits.tolist() == [7.0] * 6 + [np.inf] * 2
    assert robot.speed_limits.tolist() == [np.inf] * 7 + [2.0]
    assert robot.qlim[-2:].tolist() == [[-1.0, 1.0], [0.0, 0.5]]
    assert np.isinf(robot.qlim[:-2]).all()
    assert robot.position_of_speed == (0, 1, 2, None, None, None, 7, 8)
    assert robot.neutral.tolist() == [0, 0, 0, 1, 0, 0, 0, 0, 0]
    assert [entry.name for entry in robot.positions[2:5]] == ["root.z", "root.qw", "root.qx"]
    assert links[1].joint.travel == (0.0, 0.5)
    with pytest.raises(InputError, match=r"1 coordinate is given\. Allowed: 7 for a Free joint"):
        links[0].pose(0.3)


def test_every_method_of_an_arm_works_for_every_joint_type():
    """Native code for samples and batches; the laws above use the interpreter."""
    robot = build_mixed_tree(3, (Universal, Spherical))
    arm = ab.Arm(robot)
    assert (arm.nq, arm.n, arm.nv) == (6, 5, 5)
    assert re.match(r"<Arm mixed3: 2 joints (US|SU)>", repr(arm))
    for q, qd, qdd in random_states(robot, 1):
        batch = np.stack((arm.normalised(q), q))
        for name in ("fkine", "jacob0", "jacobe", "inertia", "gravload", "centre_of_mass"):
            method = getattr(arm, name)
            expected = evaluate(robot, name, q)
            assert_allclose(method(q), expected, rtol=1e-10, atol=1e-10)
            assert_array_equal(method(batch)[1], method(q))
        tau = arm.rne(q, qd, qdd)
        assert_allclose(arm.accel(q, qd, tau), qdd, rtol=0, atol=1e-9)
        load = {"wrench": np.arange(6.0), "payload": 2.0}
        assert_allclose(arm.accel(q, qd, arm.rne(q, qd, qdd, **load), **load), qdd, rtol=0, atol=1e-9)
        later = arm.integrate(q, qd, 0.1)
        assert_allclose(arm.difference(q, later), 0.1 * qd, rtol=0, atol=1e-14)
        assert arm.integrate(batch, np.stack((qd, qd)), 0.1).shape == (2, 6)
        assert arm.position_rates(arm.neutral(), qd).shape == (6,)
