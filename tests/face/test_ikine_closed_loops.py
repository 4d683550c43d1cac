"""Inverse kinematics of parallel robots and linkages: poses and constraints together."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import armblocks as ab
from armblocks.dynamics.mechanism import mechanism
from armblocks.errors import InputError, RobotError, UnknownNameError
from armblocks.robot import Robot
from armblocks.spatial import transl, trotx, troty, trotz
from mechanisms_for_tests import four_bar


def delta() -> Robot:
    """A Delta robot: three upper arms of 0.2 m, each with two rods of 0.4 m to a free platform."""
    links = [
        ab.Link(
            name=f"arm{k}",
            joint=ab.Revolute(axis=(0, 1, 0), limits=ab.JointLimits(position=(-0.5, 1.5))),
            before=trotz(2 * math.pi / 3 * k) @ transl(0.1, 0, 0),
        )
        for k in range(3)
    ]
    links.append(ab.Link(name="platform", joint=ab.Free(), before=transl(0, 0, -0.38)))
    rods = [
        ab.Rod(
            name=f"rod{k}{side}",
            first=ab.Attachment(link=f"arm{k}", pose=transl(0.2, 0.04 * side, 0)),
            second=ab.Attachment(
                link="platform", pose=trotz(2 * math.pi / 3 * k) @ transl(0.05, 0.04 * side, 0)
            ),
            length=0.4,
        )
        for k in range(3)
        for side in (-1, 1)
    ]
    return Robot(name="delta", links=tuple(links), constraints=tuple(rods))


def stewart() -> Robot:
    """A Stewart platform: six legs of a universal and a prismatic joint, with a ball at the platform."""
    links: list[ab.Link] = []
    closures: list[ab.SphericalClosure] = []
    for k in range(6):
        foot = trotz(math.pi / 3 * k + (0.3 if k % 2 else -0.3)) @ transl(0.5, 0, 0)
        ball = trotz(math.pi / 3 * k + (-0.3 if k % 2 else 0.3)) @ transl(0.3, 0, 0)
        cardan = ab.Universal(axis=(1, 0, 0), second_axis=(0, 1, 0))
        links.append(ab.Link(name=f"hinge{k}", joint=cardan, before=foot))
        stroke = ab.Prismatic(limits=ab.JointLimits(position=(-0.25, 0.25)))
        links.append(ab.Link(name=f"leg{k}", parent=f"hinge{k}", joint=stroke, before=transl(0, 0, 0.6)))
        closures.append(
            ab.SphericalClosure(
                name=f"ball{k}",
                first=ab.Attachment(link=f"leg{k}"),
                second=ab.Attachment(link="platform", pose=ball),
            )
        )
    links.append(ab.Link(name="platform", joint=ab.Free(), before=transl(0, 0, 0.5)))
    return Robot(name="stewart", links=tuple(links), constraints=tuple(closures))


def check_solution(
    arm: ab.Arm, result: ab.IkineResult, T: np.ndarray, mask: np.ndarray | None = None
) -> None:
    assert result.success, str(result)
    assert mechanism(arm.robot).distance(result.q) <= 1e-11
    difference = arm.fkine(result.q) - T
    assert_allclose(difference[:3, 3] * (1 if mask is None else mask[:3]), 0, atol=2e-9)
    if mask is None:
        assert_allclose(difference, 0, atol=4e-9)
    low, high = arm.robot.qlim.T
    assert np.all(result.q >= low - 1e-9) and np.all(result.q <= high + 1e-9)


def test_a_stewart_platform_reaches_poses() -> None:
    arm = ab.Arm(stewart())
    poses = [
        (transl(0.05, -0.04, 0.52) @ trotx(0.1) @ troty(-0.15) @ trotz(0.2)).matrix,
        (transl(-0.08, 0.02, 0.58) @ trotx(-0.1)).matrix,
    ]
    results = arm.ikine(np.array(poses))
    assert results.q.shape == (2, arm.nq)
    for k, T in enumerate(poses):
        check_solution(arm, results[k], T)
        # The lengths of the legs are the distances of their ends.
        for leg, closure in enumerate(arm.robot.closures):
            foot = trotz(math.pi / 3 * leg + (0.3 if leg % 2 else -0.3)) @ transl(0.5, 0, 0)
            ball = ab.Transform.from_matrix(T) @ closure.second.pose
            stroke = results[k].q[3 * leg + 2]
            assert abs(0.6 + stroke) == pytest.approx(np.linalg.norm(ball.p - foot.p), abs=1e-9)
    again = arm.ikine(poses[1], results.q[0])
    check_solution(arm, again, poses[1])
    assert arm.ikine(poses[1], results.q[0]).q.tobytes() == again.q.tobytes()


def test_a_stewart_platform_names_the_reasons_of_failures() -> None:
    arm = ab.Arm(stewart())
    low = transl(0, 0, 0.05).matrix
    beyond = arm.ikine(low, restarts=1)
    assert not beyond.success and beyond.reason == "limits" and (beyond.excess > 0.0).any()
    assert arm.ikine(low, limits=False, restarts=3).success
    far = arm.ikine(transl(0, 0, 2.0).matrix, restarts=1, limits=True)
    assert not far.success


def test_a_batch_without_targets_is_empty() -> None:
    loop, chain = (arm.ikine(np.zeros((0, 4, 4))) for arm in (ab.Arm(stewart()), ab.load_robot("puma560")))
    assert len(loop) == 0
    nq = {"q": ab.Arm(stewart()).nq, "excess": ab.Arm(stewart()).nq}
    for name in ("q", "success", "reason", "excess", "iterations", "restarts", "position_error"):
        found, expected = getattr(loop, name), getattr(chain, name)
        assert found.dtype == expected.dtype
        assert found.shape == ((0, nq[name]) if name in nq else expected.shape)


def test_a_delta_robot_reaches_positions() -> None:
    arm = ab.Arm(delta())
    mask = np.array((1, 1, 1, 0, 0, 0))
    random = np.random.default_rng(2)
    targets = random.uniform((-0.1, -0.1, -0.45), (0.1, 0.1, -0.35), (4, 3))
    for p in targets:
        T = transl(*p).matrix
        result = arm.ikine(T, mask=mask)
        check_solution(arm, result, T, mask)
        # The platform does not rotate near the middle of the workspace; its pose needs no mask.
        assert_allclose(arm.fkine(result.q)[:3, :3], np.eye(3), atol=1e-6)
        check_solution(arm, arm.ikine(T), T)
    turned = arm.ikine((transl(0, 0, -0.4) @ trotx(0.3)).matrix, restarts=2)
    assert turned.reason == "out of reach" and not turned.success
    assert turned.position_error < 0.2 and turned.rotation_error > 0.01
    assert mechanism(arm.robot).distance(turned.q) <= 1e-11
    far = arm.ikine(transl(0, 0, -2.0).matrix, mask=mask, restarts=2, limits=False)
    assert far.reason == "out of reach"
    # Arms and rods are stretched: 1.4 m are missing or a little more.
    assert far.position_error > 1.4 and far.lost_direction[2] == pytest.approx(-1.0, abs=1e-3)


def test_linkages_and_trees_with_couplings_reach_points_of_their_curves() -> None:
    robot = four_bar()
    arm = ab.Arm(robot)
    q = arm.assemble(locked=()).q
    for angle in (0.2, 0.6):
        start = arm.assemble(q + np.eye(arm.nq)[0] * angle, locked=[robot.joint_names[0]]).q
        T = arm.fkine(start, frame="coupler")
        found = arm.ikine(T, q, frame="coupler")
        assert found.success
        assert_allclose(arm.fkine(found.q, frame="coupler"), T, atol=4e-9)
        assert mechanism(robot).distance(found.q) <= 1e-11
    with pytest.raises(UnknownNameError, match="there is no frame named 'nowhere'"):
        arm.ikine(T, frame="nowhere")


def test_all_branches_of_a_frame_on_the_last_link() -> None:
    robot = replace(ab.load_robot("puma560").robot, tool=transl(0.1, 0, 0.2) @ trotx(0.4))
    camera = ab.NamedFrame(name="camera", link="link6", pose=transl(0.05, 0.02, 0.1) @ troty(0.5))
    arm = ab.Arm(replace(robot, frames=(camera,)))
    q = np.array(((0.1, 0.4, -2.0, 0.3, 0.5, 0.2), (-0.5, 0.7, -1.5, 0.4, 0.8, -0.3)))
    T = arm.fkine(q, frame="camera")
    found = arm.ikine_all(T, frame="camera", limits=False)
    for k in range(2):
        solutions = found.q[k][found.exists[k]]
        assert len(solutions) == 8 and np.abs(solutions - q[k]).max(axis=1).min() < 1e-7
        reached = np.broadcast_to(T[k], (8, 4, 4))
        assert_allclose(arm.fkine(solutions, frame="camera"), reached, atol=1e-8)
    one = arm.ikine_all(T[0], frame="camera", limits=False)
    assert one.q.shape == (8, 6) and one.q.tobytes() == found.q[0].tobytes()
    with pytest.raises(RobotError, match="frame 'link3' moves relative to the tool"):
        arm.ikine_all(T, frame="link3")


def test_closed_forms_and_blocks_are_refused_by_name() -> None:
    arm = ab.Arm(four_bar())
    with pytest.raises(RobotError, match="closed forms and rates of inverse kinematics do not support"):
        arm.ikine_all(np.eye(4))
    with pytest.raises(InputError, match="robot 'four-bar' has closed loops, such as 'pin'"):
        ab.blocks.DifferentialIkine(robot=arm, q0=[0.0] * arm.nq)


def test_dependent_joints_stay_within_their_limits() -> None:
    robot = delta()
    gear = ab.Coupling(name="gear", terms=(("extra", 1.0), ("arm0", -2.0)))
    extra = ab.Link(
        name="extra", joint=ab.Revolute(limits=ab.JointLimits(position=(-3.0, 0.1))), before=transl(1, 0, 0)
    )
    links = (extra, *robot.links)
    arm = ab.Arm(replace(robot, links=links, constraints=(*robot.constraints, gear)))
    result = arm.ikine(transl(0, 0, -0.45).matrix, mask=(1, 1, 1, 0, 0, 0), restarts=2)
    assert not result.success or 2.0 * result.q[0] <= 0.1 + 1e-9
