"""Reaction wrenches of joints and closures: Newton's and Euler's equations of bodies, and multipliers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import armblocks as ab
from armblocks.dynamics import trace_constrained_motion, trace_joint_wrenches
from armblocks.dynamics.mechanism import Mechanism
from armblocks.errors import RobotError
from armblocks.robot import Motor, Robot
from armblocks.robot.geometry import link_frames
from maximal_coordinates import body_states, newton_euler, reactions
from mechanisms_for_tests import four_bar, random_mechanism
from robots_for_tests import build_random_tree


def without_motors(robot: Robot) -> Robot:
    return replace(robot, links=tuple(replace(link, motor=None) for link in robot.links))


def in_world(robot: Robot, q: np.ndarray, wrenches: np.ndarray) -> dict[str, np.ndarray]:
    """The wrenches on the links in world axes, about the origins of the links' frames."""
    rows: dict[str, np.ndarray] = {}
    for link, T, wrench in zip(robot.links, link_frames(robot, q.tolist())[1:], wrenches):
        joint = T @ link.after.inverse().matrix
        force, moment = joint[:3, :3] @ wrench[:3], joint[:3, :3] @ wrench[3:]
        rows[link.name] = np.concatenate((force, moment + np.cross(joint[:3, 3] - T[:3, 3], force)))
    return rows


def test_the_component_along_the_axis_is_the_torque_of_the_rigid_bodies() -> None:
    puma = ab.load_robot("puma560")
    rigid = ab.Arm(without_motors(puma.robot))
    states = np.random.default_rng(1).uniform(-1, 1, (3, 7, 6))
    loads = {
        "wrench": [1.0, -2.0, 3.0, 0.4, 0.5, -0.6],
        "payload": ab.Payload(mass=2.0, centre=(0.1, 0, 0.2)),
    }
    for more in ({}, loads):
        wrenches = puma.joint_wrenches(*states, **more)
        assert wrenches.shape == (7, 6, 6)
        assert wrenches[:, :, 5] == pytest.approx(rigid.rne(*states, **more), abs=1e-12)
    assert (puma.joint_wrenches(*states)[3] == puma.joint_wrenches(*states[:, 3])).all()


@pytest.mark.parametrize("seed", range(3))
def test_each_body_obeys_the_laws_of_newton_and_euler(seed: int) -> None:
    """The wrench of a link's joint, less those of its children, accelerates the link against gravity.

    Accelerations are differences of the velocities of a formulation that shares no code.
    """
    robot = without_motors(build_random_tree(seed))
    random = np.random.default_rng(seed)
    q, qd, qdd = random.uniform(-1, 1, (3, robot.n))
    found = in_world(robot, q, trace_joint_wrenches(robot)(q, qd, qdd)[0])
    step = 1e-5
    ahead, behind = (
        body_states(robot, q + s * step * qd + step**2 / 2 * qdd, qd + s * step * qdd) for s in (1, -1)
    )
    states = body_states(robot, q, qd)
    for link in robot.links:
        own = states[link.name]
        acceleration = np.concatenate(
            [
                (getattr(ahead[link.name], key) - getattr(behind[link.name], key)) / (2 * step)
                for key in ("v", "w")
            ]
        )
        M, force = newton_euler(robot, link, own)
        net = found[link.name].copy()
        for child in robot.links:
            if child.parent == link.name:
                wrench = found[child.name]
                net[:3] -= wrench[:3]
                net[3:] -= wrench[3:] + np.cross(states[child.name].p - own.p, wrench[:3])
        assert net == pytest.approx(M @ acceleration - force, abs=1e-6 * max(1.0, np.abs(force).max()))


@pytest.mark.parametrize("seed", (2, 3, 4, 6, 9))
def test_wrenches_of_mechanisms_equal_multipliers_in_maximal_coordinates(seed: int) -> None:
    """Closures of all types occur in these mechanisms."""
    robot, q = random_mechanism(seed)
    robot = without_motors(robot)
    mechanism = Mechanism(robot)
    mobility = mechanism.mobility(q)
    driven = _driven(mechanism, q, mobility.independent)
    for name in driven:
        robot = robot.with_link(name, motor=Motor())
    random = np.random.default_rng(seed)
    qd = mechanism.consistent_speeds(q, random.normal(size=robot.n))
    tau = np.where(np.isin(robot.joint_names, driven), random.normal(size=robot.n), 0.0)
    qdd = trace_constrained_motion(robot, near=q)(q, qd, tau)[2]
    (wrenches,) = trace_joint_wrenches(robot, near=q)(q, qd, qdd)
    assert wrenches.shape == (len(robot.links) + len(robot.closures), 6)
    expected = reactions(robot, q, qd, tau, mobility.independent)
    size = max(np.abs(value).max() for value in expected.values())
    for name, wrench in in_world(robot, q, wrenches).items():
        assert wrench == pytest.approx(expected[name], abs=1e-7 * size), name
    poses = dict(zip((link.name for link in robot.links), link_frames(robot, q.tolist())[1:]))
    for closure, wrench in zip(robot.closures, wrenches[len(robot.links) :]):
        if closure.second.link is not None:
            T = poses[closure.second.link]
            frame = T @ closure.second.pose.matrix
            force, moment = frame[:3, :3] @ wrench[:3], frame[:3, :3] @ wrench[3:]
            at_link = np.concatenate((force, moment + np.cross(frame[:3, 3] - T[:3, 3], force)))
            assert at_link == pytest.approx(expected.get(closure.name, np.zeros(6)), abs=1e-7 * size)


def _driven(mechanism: Mechanism, q: np.ndarray, independent: tuple[int, ...]) -> list[str]:
    """Joints that determine the motion: those without pivots in the elimination of the constraints."""
    J = mechanism.jacobian(q)[list(independent)]
    passive: list[int] = []
    for k in range(J.shape[1]):
        columns = J[:, [*passive, k]]
        if len(passive) < len(J) and np.linalg.svd(columns, compute_uv=False).min() > 1e-4:
            passive.append(k)
    return [name for k, name in enumerate(mechanism.robot.joint_names) if k not in passive]


def test_a_mechanism_at_rest_carries_its_weight() -> None:
    """The bearings on the ground carry all weights; the pin transmits forces in the plane only."""
    robot = four_bar().with_link("crank", motor=Motor())
    q = Mechanism(robot).assembled(np.zeros(3))
    wrenches = ab.Arm(robot).joint_wrenches(q, np.zeros(3), np.zeros(3))
    on_links = in_world(robot, q, wrenches)
    bearings = on_links["crank"][:3] + on_links["rocker"][:3]
    assert bearings == pytest.approx([0, 9.81 * sum(link.mass for link in robot.links), 0], abs=1e-9)
    assert wrenches[3, 2:] == pytest.approx(np.zeros(4), abs=1e-9)
    assert np.hypot(*wrenches[3, :2]) > 1.0
    torque = ab.Arm(robot).gravload(q)
    assert wrenches[:3, 5] == pytest.approx(torque, abs=1e-9)
    assert np.isnan(ab.Arm(robot).joint_wrenches(q + 0.1, np.zeros(3), np.zeros(3))).all()


def test_wrenches_of_palletisers_have_the_torques_of_their_couplings() -> None:
    """Virtual work: the components along the axes of all joints give the torques of the four axes."""
    arm = ab.load_robot("irb660")
    q, qd, qdd = np.random.default_rng(5).uniform(-0.5, 0.5, (3, 4))
    axes = np.array([link.joint.axis for link in arm.robot.links])
    along = np.einsum("ij,ij->i", arm.joint_wrenches(q, qd, qdd)[:, 3:], axes)
    assert arm.robot.coordinate_map.speeds.T @ along == pytest.approx(arm.rne(q, qd, qdd), abs=1e-8)


def test_wrenches_need_motors_that_determine_the_motion() -> None:
    with pytest.raises(RobotError, match="the joints with motors have 0 degrees of freedom"):
        ab.Arm(four_bar()).joint_wrenches(np.zeros(3), np.zeros(3), np.zeros(3))
