"""Derivatives of the Jacobian, measures of mobility, limits and wrists: laws over random arms."""

from __future__ import annotations

import numpy as np
import pytest

import armblocks as ab
from armblocks.errors import ArmblocksError, RobotError
from armblocks.robot import Fixed, Free, Link, Prismatic, Revolute, Robot, Spherical
from robots_for_tests import build_mixed_tree, build_random_tree

ROBOTS = [build_random_tree(2, chain=True), build_mixed_tree(3, [Revolute, Prismatic, Spherical])]


@pytest.fixture(scope="module", params=range(len(ROBOTS)))
def arm(request: pytest.FixtureRequest) -> ab.Arm:
    return ab.Arm(ROBOTS[request.param])


@pytest.fixture(scope="module")
def puma() -> ab.Arm:
    return ab.load_robot("puma560")


def states(arm: ab.Arm, count: int = 4) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(11)
    q = np.stack([arm.integrate(arm.neutral(), random.normal(size=arm.n), 1.0) for _ in range(count)])
    return q, random.normal(size=(count, arm.n))


def test_the_derivative_of_the_jacobian_is_its_difference_along_the_motion(arm: ab.Arm) -> None:
    q, qd = states(arm)
    h = 1e-5
    before, after = (arm.jacob0(arm.integrate(q, qd, sign * h)) for sign in (-1, 1))
    assert np.allclose(arm.jacob0_dot(q, qd), (after - before) / (2 * h), atol=1e-7)
    product = np.einsum("nij,nj->ni", arm.jacob0_dot(q, qd), qd)
    assert np.allclose(arm.jacob_dot(q, qd), product, atol=1e-12)
    assert np.allclose(arm.jacob0_dot(q, qd), np.einsum("nkij,nk->nij", arm.hessian0(q), qd), atol=1e-12)


def test_derivatives_exist_for_frames_and_coupled_joints(puma: ab.Arm) -> None:
    for arm, frame in ((puma, "link3"), (ab.load_robot("irb460"), None)):
        q, qd = states(arm)
        h = 1e-5
        before, after = (arm.jacob0(q + sign * h * qd, frame=frame) for sign in (-1, 1))
        assert np.allclose(arm.jacob0_dot(q, qd, frame=frame), (after - before) / (2 * h), atol=1e-7)


def test_the_acceleration_of_the_tool_has_the_term_of_the_derivative(puma: ab.Arm) -> None:
    q, qd = states(puma)
    qdd = states(puma)[1][::-1]
    h = 1e-4
    path = [puma.fkine(q + s * qd + 0.5 * s * s * qdd)[:, :3, 3] for s in (-h, 0.0, h)]
    acceleration = (path[0] - 2 * path[1] + path[2]) / h**2
    exact = np.einsum("nij,nj->ni", puma.jacob0(q), qdd) + puma.jacob_dot(q, qd)
    assert np.allclose(acceleration, exact[:, :3], atol=1e-5)


def test_robots_without_moving_joints_have_no_derivatives() -> None:
    fixed = ab.Arm(Robot(name="post", links=(Link(name="post", joint=Fixed()),)))
    with pytest.raises(RobotError, match="no joint moves, so there is no jacob0_dot"):
        fixed.jacob0_dot([], [])


def test_measures_of_mobility_agree_with_their_definitions(puma: ab.Arm) -> None:
    q, _ = states(puma, 20)
    J = puma.jacob0(q)
    assert np.allclose(puma.maniplty(q), puma.manipulability(q))
    trans = np.sqrt(np.linalg.det(J[:, :3] @ np.swapaxes(J[:, :3], 1, 2)))
    assert np.allclose(puma.maniplty(q, axes="trans"), trans)
    values = np.linalg.svd(J[:, 3:], compute_uv=False)
    assert np.allclose(puma.maniplty(q, "condition", "rot"), values[:, -1] / values[:, 0])
    assert np.allclose(puma.maniplty(q, "smallest", "rot"), values[:, -1])
    Ji = np.linalg.inv(J)
    Mx = np.swapaxes(Ji, 1, 2) @ puma.inertia(q) @ Ji
    assert np.allclose(puma.cinertia(q), Mx, rtol=1e-6)
    eigenvalues = np.linalg.eigvalsh(Mx)
    assert np.allclose(puma.maniplty(q, "asada"), eigenvalues[:, 0] / eigenvalues[:, -1], rtol=1e-5)
    block = np.linalg.eigvalsh(Mx[:, :3, :3])
    assert np.allclose(puma.maniplty(q, "asada", "trans"), block[:, 0] / block[:, -1], rtol=1e-5)
    assert puma.maniplty(q[0]).shape == () and puma.maniplty(q[:0]).shape == (0,)


def test_the_toolbox_numbers_of_the_puma_are_reproduced() -> None:
    # roboticstoolbox-python 1.1, rtb.models.DH.Puma560().manipulability(qn)
    puma = ab.load_robot("puma560")
    qn = [0, np.pi / 4, np.pi, 0, np.pi / 4, 0]
    assert puma.maniplty(qn) == pytest.approx(0.0786, abs=1e-4)


def test_singular_configurations_are_recognised(puma: ab.Arm) -> None:
    q = np.zeros(6)  # the wrist is stretched
    assert puma.maniplty(q, "asada") == 0.0 and puma.maniplty(q, "condition") < 1e-12
    assert np.isnan(puma.cinertia(q)).all()
    assert np.isinf(puma.force_ellipsoid(q, "all").radii[0])
    planar = ab.load_robot("twolink")
    assert np.isnan(planar.cinertia([0.1, 0.2])).all() and planar.maniplty([0.1, 0.2], "asada") == 0.0


def test_ellipsoids_are_images_of_balls(arm: ab.Arm) -> None:
    q, _ = states(arm, 5)
    for axes, rows in (("trans", slice(0, 3)), ("rot", slice(3, 6))):
        J = arm.jacob0(q)[:, rows]
        velocity, force = arm.velocity_ellipsoid(q, axes), arm.force_ellipsoid(q, axes)
        V = velocity.directions
        squares = V @ (velocity.radii[..., None] ** 2 * np.swapaxes(V, 1, 2))
        assert np.allclose(squares, J @ np.swapaxes(J, 1, 2), atol=1e-12)
        assert np.allclose(force.radii, 1 / velocity.radii[:, ::-1])
        assert np.allclose(force.volume, 1 / velocity.volume)
        # A force of this ellipsoid is balanced by torques of length 1.
        torque = np.swapaxes(J, 1, 2) @ (force.directions[..., :1] * force.radii[:, None, :1])
        assert np.allclose(np.linalg.norm(torque, axis=1), 1.0)


def test_coordinates_outside_their_limits_are_named(puma: ab.Arm) -> None:
    low, high = puma.robot.qlim.T
    assert not puma.islimit(low).any() and not puma.islimit([low, high]).any()
    q = np.stack([high + 0.1, np.full(6, np.nan)])
    assert puma.islimit(q).all()
    ball = ab.Arm(build_mixed_tree(1, [Free]))
    assert puma.islimit(puma.neutral()).shape == (6,) and ball.islimit(ball.neutral()).shape == (ball.nq,)
    with pytest.raises(ArmblocksError, match=r"q has the shape \(5,\).*\(6,\) or \(N, 6\)"):
        puma.islimit(np.zeros(5))


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("puma560", True),
        ("irb140", True),
        ("stanford", True),
        ("ur5", False),
        ("panda", False),
        ("twolink", False),
    ],
)
def test_spherical_wrists_are_recognised(name: str, expected: bool) -> None:
    assert ab.load_robot(name).isspherical() is expected


def test_other_joints_are_no_spherical_wrist() -> None:
    assert not ab.Arm(build_mixed_tree(1, [Spherical, Free])).isspherical()
    links = [Link(name="a", joint=Revolute())]
    links += [Link(name=f"b{k}", parent="a" if k == 0 else f"b{k - 1}", joint=Prismatic()) for k in range(3)]
    assert not ab.Arm(Robot(name="slides", links=tuple(links))).isspherical()


def test_perturbed_arms_are_repeatable_and_near(puma: ab.Arm) -> None:
    one, same, other = puma.perturb(0.2, seed=4), puma.perturb(0.2, seed=4), puma.perturb(0.2, seed=5)
    assert one.robot == same.robot != other.robot and one.name == "P/Puma 560"
    for link, changed in zip(puma.robot.links, one.robot.links, strict=True):
        assert abs(changed.mass - link.mass) <= 0.2 * link.mass
        before, after = link.I, changed.I
        assert np.allclose(after * before.max(), before * after.max())
        assert (np.abs(after - before) <= 0.2 * np.abs(before) + 1e-15).all()
    assert puma.perturb(0.0).robot.links == puma.robot.links
    with pytest.raises(ArmblocksError, match=r"the perturbation is 1.*masses stay positive"):
        puma.perturb(1.0)


def test_arms_list_their_moving_links(puma: ab.Arm) -> None:
    assert [link.name for link in puma] == list(puma.robot.joint_names)


def test_unknown_measures_and_axes_are_named(puma: ab.Arm) -> None:
    with pytest.raises(ArmblocksError, match="there is no measure of manipulability named 'asadas'"):
        puma.maniplty(np.zeros(6), "asadas")
    with pytest.raises(ArmblocksError, match="there is no choice of axes named 'linear'"):
        puma.velocity_ellipsoid(np.zeros(6), "linear")
