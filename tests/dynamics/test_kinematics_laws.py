"""Kinematics compared with the transforms of the description, and Jacobians with derivatives."""

from dataclasses import replace

import numpy as np
import pytest
from casadi import SX, Function, horzcat, jacobian, jtimes, mtimes, vertcat
from numpy.testing import assert_allclose

from armblocks.dynamics import TRACES
from armblocks.dynamics.ball_joints import position_rates, rotation_vector
from armblocks.dynamics.jacobian import MAX_COLUMNS_BY_MINORS
from armblocks.dynamics.joint_motion import entries
from armblocks.robot import (
    Fixed,
    Link,
    Motor,
    Prismatic,
    Revolute,
    Robot,
    modified_dh,
    serial_chain,
    standard_dh,
)
from armblocks.spatial import Transform
from robots_for_tests import build_random_tree, evaluate, random_states, random_transform


def described_poses(robot: Robot, q: np.ndarray) -> list[np.ndarray]:
    """Return the poses of base, links and tool as numeric products of the description's matrices."""
    starts = np.cumsum([0, *(joint.nq for joint in robot.joints)])
    at = {name: q[a:b] for name, a, b in zip(robot.joint_names, starts, starts[1:])}
    world: dict[str | None, np.ndarray] = {None: robot.base.matrix}
    remaining = list(robot.links)
    while remaining:
        for link in [link for link in remaining if link.parent in world]:
            world[link.name] = world[link.parent] @ link.pose(at.get(link.name)).matrix
            remaining.remove(link)
    links = [world[link.name] for link in robot.links]
    return [robot.base.matrix, *links, links[-1] @ robot.tool.matrix]


def test_poses_are_products_of_the_described_transforms(robot: Robot):
    for q, _, _ in random_states(robot):
        expected = described_poses(robot, q)
        # A product of ten rotations has ten rounding errors.
        assert_allclose(evaluate(robot, "link_poses", q), expected, rtol=0, atol=2e-14)
        assert_allclose(evaluate(robot, "fkine", q), expected[-1], rtol=0, atol=2e-14)


def test_jacobian_is_the_derivative_of_kinematics(robot: Robot):
    traced = TRACES["fkine"](robot)
    (symbol,) = traced.arguments
    rates = [position_rates(robot, entries(symbol), unit) for unit in np.eye(robot.n).tolist()]
    N = horzcat(*(vertcat(*rate) for rate in rates))
    pose_jacobian = Function("dT", [symbol], [mtimes(jacobian(traced.results[0], symbol), N)])
    for q, _, _ in random_states(robot):
        T = evaluate(robot, "fkine", q)
        dT = np.asarray(pose_jacobian(q)).reshape(4, 4, robot.n)
        J = np.empty((6, robot.n))
        J[:3] = dT[:3, 3]
        for j in range(robot.n):
            W = dT[:3, :3, j] @ T[:3, :3].T  # [w]x
            J[3:, j] = W[2, 1], W[0, 2], W[1, 0]
        assert_allclose(evaluate(robot, "jacob0", q), J, rtol=0, atol=1e-13)


def test_jacobians_differ_by_the_tool_rotation(robot: Robot):
    for q, _, _ in random_states(robot):
        R = evaluate(robot, "fkine", q)[:3, :3]
        J0, Je = evaluate(robot, "jacob0", q), evaluate(robot, "jacobe", q)
        assert_allclose(np.vstack((R @ Je[:3], R @ Je[3:])), J0, rtol=0, atol=1e-13)


def test_manipulability_is_the_product_of_singular_values(robot: Robot):
    for q, _, _ in random_states(robot):
        J = evaluate(robot, "jacob0", q)
        expected = np.prod(np.linalg.svd(J, compute_uv=False))
        # With many joints it is the square root of a determinant, whose rounding errors are 1e-16.
        tolerance = 1e-12 if robot.n <= MAX_COLUMNS_BY_MINORS else 1e-7
        assert evaluate(robot, "manipulability", q) == pytest.approx(expected, rel=1e-9, abs=tolerance)


@pytest.mark.parametrize("count", [7, 8, 9, 11])
def test_manipulability_of_any_number_of_joints_is_the_product_of_singular_values(count: int):
    links = [Link(name=f"l{i}", before=random_transform(np.random.default_rng(i))) for i in range(count)]
    arm = Robot(name="redundant", links=serial_chain(links))
    q = np.linspace(-1, 1, count)
    expected = np.prod(np.linalg.svd(evaluate(arm, "jacob0", q), compute_uv=False))
    assert evaluate(arm, "manipulability", q) == pytest.approx(expected, rel=1e-9)


def test_manipulability_vanishes_at_a_singular_position(puma560: Robot):
    # Wrist singularity: axes 4 and 6 coincide. The square root of a determinant is accurate to 1e-8 only.
    assert evaluate(puma560, "manipulability", [0.3, 0.5, -1.0, 0.2, 0.0, 0.1]) < 1e-16


def test_standard_and_modified_tables_of_one_robot_agree():
    """A modified row has alpha and a of the preceding standard row; those of the last row become the tool."""
    random = np.random.default_rng(11)
    alpha, a, d = (random.uniform(-1, 1, 4) for _ in range(3))
    mass = random.uniform(1, 2, 4)
    before = np.concatenate(([0.0], alpha[:-1])), np.concatenate(([0.0], a[:-1]))
    standard, modified = [], []
    for i in range(4):
        link = standard_dh(
            f"l{i}",
            alpha=alpha[i],
            a=a[i],
            d=d[i],
            mass=mass[i],
            centre_of_mass=random.uniform(-0.2, 0.2, 3),
            inertia=(0.3, 0.4, 0.5),
            motor=Motor(inertia=1e-4, gear_ratio=20),
        )
        # The same body in the frame of the modified table, which is located at its joint.
        R, p = (Transform(rotation=link.after.rotation), link.after.translation)
        shift = np.array((0.0, 0.0, d[i]))
        modified.append(
            modified_dh(
                f"l{i}",
                alpha=before[0][i],
                a=before[1][i],
                d=d[i],
                mass=mass[i],
                centre_of_mass=R.R @ link.r + np.array(p) - shift,
                inertia=R.R @ link.I @ R.R.T,
                motor=link.motor,
            )
        )
        standard.append(link)
    last = Transform(rotation=standard[-1].after.rotation, translation=(a[-1], 0.0, 0.0))
    one = Robot(name="standard", links=serial_chain(standard))
    two = Robot(name="modified", links=serial_chain(modified), tool=last)
    for q, qd, qdd in random_states(one):
        assert_allclose(evaluate(two, "fkine", q), evaluate(one, "fkine", q), rtol=0, atol=1e-14)
        for name, values in (("rne", (q, qd, qdd)), ("inertia", (q,)), ("jacob0", (q,))):
            expected = evaluate(one, name, *values)
            size = np.abs(expected).max()
            assert_allclose(evaluate(two, name, *values), expected, rtol=0, atol=1e-13 * size)


@pytest.mark.parametrize("convention", [standard_dh, modified_dh])
def test_rows_of_both_conventions_agree_with_the_textbook_matrices(convention):
    alpha, a, d, theta, offset, q = 0.3, 0.5, 0.7, 0.2, 0.1, 0.4
    for sigma in (0, 1):
        link = convention("l", alpha=alpha, a=a, d=d, theta=theta, sigma=sigma, offset=offset)
        angle, length = (theta, q + offset) if sigma else (q + offset, d)
        c, s, ca, sa = np.cos(angle), np.sin(angle), np.cos(alpha), np.sin(alpha)
        if convention is standard_dh:
            expected = [
                [c, -s * ca, s * sa, a * c],
                [s, c * ca, -c * sa, a * s],
                [0, sa, ca, length],
                [0, 0, 0, 1],
            ]
        else:
            expected = [
                [c, -s, 0, a],
                [s * ca, c * ca, -sa, -sa * length],
                [s * sa, c * sa, ca, ca * length],
                [0, 0, 0, 1],
            ]
        assert_allclose(link.pose(q).matrix, expected, rtol=0, atol=1e-15)
        arm = Robot(name="arm", links=(link,))
        assert_allclose(evaluate(arm, "fkine", [q]), expected, rtol=0, atol=1e-15)


def test_torques_do_not_change_when_base_and_gravity_are_rotated_together(puma560: Robot):
    T = random_transform(np.random.default_rng(2))
    turned = replace(puma560, base=T, gravity=T.R @ np.array(puma560.gravity))
    for q, qd, qdd in random_states(puma560):
        assert_allclose(
            evaluate(turned, "rne", q, qd, qdd), evaluate(puma560, "rne", q, qd, qdd), rtol=0, atol=1e-12
        )
        expected = T.matrix @ evaluate(puma560, "fkine", q)
        assert_allclose(evaluate(turned, "fkine", q), expected, rtol=0, atol=1e-14)


def test_moving_the_base_does_not_change_the_inertia(puma560: Robot):
    turned = replace(puma560, base=random_transform(np.random.default_rng(2)))
    for q, _, _ in random_states(puma560):
        assert_allclose(evaluate(turned, "inertia", q), evaluate(puma560, "inertia", q), rtol=0, atol=1e-14)


def test_the_order_of_the_links_does_not_change_the_dynamics():
    robot = build_random_tree(2)
    last = robot.links[-1]
    turned = replace(robot, links=(*reversed(robot.links[:-1]), last))
    order = [turned.joint_names.index(name) for name in robot.joint_names]
    back = [robot.joint_names.index(name) for name in turned.joint_names]
    for q, qd, qdd in random_states(robot, 2):
        state = [x[back] for x in (q, qd, qdd)]
        for name in ("rne", "accel"):
            expected = evaluate(robot, name, q, qd, qdd)
            actual = evaluate(turned, name, *state)[order]
            assert_allclose(actual, expected, rtol=0, atol=1e-11 * np.abs(expected).max())


def test_a_fixed_link_and_its_parent_form_one_rigid_body():
    """Two halves of a body with a fixed joint between them have the dynamics of the whole body."""
    random = np.random.default_rng(4)
    T = random_transform(random)
    half = {"mass": 2.0, "centre_of_mass": (0.1, 0.2, 0.3), "inertia": (0.3, 0.4, 0.5)}
    split = Robot(
        name="split",
        links=(
            Link(name="base", joint=Fixed(), **half),
            Link(name="arm", parent="base", joint=Revolute(axis=(0, 1, 0)), **half),
            Link(name="bolted", parent="arm", joint=Fixed(), before=T, **half),
        ),
    )
    R, p, c = T.R, T.p, np.array(half["centre_of_mass"])
    c2 = R @ c + p
    centre = (c + c2) / 2
    I0 = np.diag(half["inertia"])

    def steiner(r: np.ndarray) -> np.ndarray:
        return 2.0 * (r @ r * np.eye(3) - np.outer(r, r))

    inertia = I0 + steiner(c - centre) + R @ I0 @ R.T + steiner(c2 - centre)
    whole = Robot(
        name="whole",
        links=(
            Link(
                name="arm", joint=Revolute(axis=(0, 1, 0)), mass=4.0, centre_of_mass=centre, inertia=inertia
            ),
        ),
        tool=T,
    )
    for q, qd, qdd in random_states(whole):
        assert_allclose(evaluate(split, "fkine", q), evaluate(whole, "fkine", q), rtol=0, atol=1e-14)
        assert_allclose(evaluate(split, "rne", q, qd, qdd), evaluate(whole, "rne", q, qd, qdd), rtol=1e-13)


def test_a_vertical_prismatic_joint_carries_the_weight():
    lift = Robot(
        name="lift",
        links=(Link(name="cage", joint=Prismatic(), mass=3.0, motor=Motor(inertia=2e-3, gear_ratio=10)),),
    )
    assert evaluate(lift, "gravload", [0.4]) == pytest.approx([3 * 9.81])
    assert evaluate(lift, "inertia", [0.4]) == pytest.approx(np.array([[3.2]]))
    assert evaluate(lift, "accel", [0.0], [0.0], [0.0]) == pytest.approx([-9.81 * 3 / 3.2])
    assert evaluate(lift, "jacob0", [0.0]) == pytest.approx(np.array([[0, 0, 1, 0, 0, 0]]).T)


def test_rotation_vectors_of_quaternions_of_any_length() -> None:
    """The vectors have full accuracy for all angles, and finite derivatives of high order at the angle 0."""
    quaternion = SX.sym("quaternion", 4)
    vector = vertcat(*rotation_vector(entries(quaternion)))
    rotation = Function("f", [quaternion], [vector])
    random = np.random.default_rng(3)
    for _ in range(500):
        axis = random.normal(size=3)
        axis /= np.linalg.norm(axis)
        half = min(10.0 ** random.uniform(-60.0, 0.2), 0.499 * np.pi)
        length = random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(-200.0, 150.0)
        found = rotation(length * np.r_[np.cos(half), np.sin(half) * axis]).full().ravel()
        assert_allclose(found, 2.0 * half * axis, rtol=1e-14, atol=4e-16 * half)
    derivative = vector
    for _ in range(5):
        derivative = jtimes(derivative, quaternion, SX([1.0, 0.3, 0.2, 0.1]))
        at_zero = Function("d", [quaternion], [derivative])([1.0, 0.0, 0.0, 0.0])
        assert np.isfinite(at_zero.full()).all()
