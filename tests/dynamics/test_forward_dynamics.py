"""The two algorithms of forward dynamics compared with each other, and arms with singular inertia."""

import re

import numpy as np
import pytest
from casadi import SX, Function, vertcat
from numpy.testing import assert_allclose

from armblocks.dynamics import TRACES
from armblocks.dynamics.aba import aba
from armblocks.dynamics.base_parameters import regrouped
from armblocks.dynamics.forward import MAX_JOINTS_BY_MATRIX, forward_dynamics
from armblocks.dynamics.joint_motion import entries, joint_motions
from armblocks.dynamics.rnea import Wrench
from armblocks.errors import RobotError
from armblocks.robot import Fixed, Link, Motor, Prismatic, Revolute, Robot, serial_chain
from armblocks.robot.tree import KinematicTree
from armblocks.spatial import transl
from robots_for_tests import evaluate, random_inertia, random_states, random_transform

ROD = {"mass": 1.0, "centre_of_mass": (0.5, 0.0, 0.0), "inertia": (0.0, 0.08, 0.08)}


def test_articulated_body_algorithm_agrees_with_the_factored_mass_matrix(robot: Robot):
    tree = regrouped(KinematicTree.of(robot))
    q, qd, tau = SX.sym("q", robot.nq), SX.sym("qd", robot.n), SX.sym("tau", robot.n)
    rates, torques = entries(qd), entries(tau)
    wrench = {tree.n - 1: Wrench((1.0, -2.0, 3.0), (0.1, 0.2, -0.3))}
    by_matrix = forward_dynamics(tree, q, rates, torques, wrench)
    by_bodies = aba(tree, joint_motions(tree, q), rates, torques, tree.gravity, wrench)
    both = Function("both", [q, qd, tau], [vertcat(*by_matrix), vertcat(*by_bodies)])
    for state in random_states(robot):
        one, two = (np.asarray(value).ravel() for value in both(*state))
        condition = np.linalg.cond(evaluate(robot, "inertia", state[0]))
        tolerance = max(1e-12, 1e2 * condition * np.finfo(float).eps)
        assert_allclose(two, one, rtol=0, atol=tolerance * max(1.0, np.abs(one).max()))


def test_long_chains_use_the_articulated_body_algorithm():
    random = np.random.default_rng(0)
    links = [
        Link(
            name=f"l{i}",
            before=random_transform(random),
            mass=1.0,
            inertia=random_inertia(random) + np.eye(3) * 0.1,
        )
        for i in range(MAX_JOINTS_BY_MATRIX + 1)
    ]
    snake = Robot(name="snake", links=serial_chain(links))
    for q, qd, qdd in random_states(snake, 1):
        tau = evaluate(snake, "rne", q, qd, qdd)
        # The condition number of M is 1e5 here.
        assert_allclose(evaluate(snake, "accel", q, qd, tau), qdd, rtol=0, atol=1e-8)


MASSLESS = "has no inertia to accelerate: the inertia matrix is singular at every position"


@pytest.mark.parametrize(
    ("links", "joint"),
    [
        ((Link(name="ghost"),), "ghost"),
        ((Link(name="rod", **ROD), Link(name="pin", parent="rod")), "pin"),
        # A point mass on the joint axis has no inertia about it.
        ((Link(name="point", mass=2.0, centre_of_mass=(0, 0, 0.3)),), "point"),
        # Two joints on one axis without mass between them: the inner joint has no separate inertia.
        ((Link(name="inner"), Link(name="outer", parent="inner", **ROD)), "inner"),
        ((Link(name="slider", joint=Prismatic()),), "slider"),
    ],
)
def test_a_joint_without_inertia_is_refused_with_its_name(links: tuple[Link, ...], joint: str):
    arm = Robot(name="arm", links=links)
    expected = re.escape(f"robot 'arm', link '{joint}': joint '{joint}' {MASSLESS}")
    with pytest.raises(RobotError, match=expected + ".*Fix: give the link a mass and an inertia"):
        TRACES["accel"](arm)


def test_motor_inertia_or_payload_is_sufficient_for_forward_dynamics():
    driven = Robot(name="driven", links=(Link(name="l", motor=Motor(inertia=1e-3, gear_ratio=10)),))
    assert evaluate(driven, "accel", [0], [0], [1.0]) == pytest.approx([10.0])
    massless = Robot(name="bare", links=(Link(name="l", joint=Revolute()),), tool=transl(1.0, 0.0, 0.0))
    payload = (2.0, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    accel = evaluate(massless, "accel_loaded", [0], [0], [1.0], np.zeros(6), payload)
    assert accel == pytest.approx([0.5])
    fixed_tool = Robot(
        name="fixed tool",
        links=(Link(name="l"), Link(name="stand", joint=Fixed())),
    )
    with pytest.raises(RobotError, match=f"joint 'l' {MASSLESS}"):
        TRACES["accel_loaded"](fixed_tool)


def test_a_robot_without_mass_has_no_centre_of_mass():
    massless = Robot(name="bare", links=(Link(name="l"),))
    with pytest.raises(RobotError, match="robot 'bare': no link has a mass, so there is no centre of mass"):
        TRACES["centre_of_mass"](massless)


@pytest.mark.parametrize("name", TRACES)
def test_a_robot_without_moving_joints_is_refused(name: str):
    pole = Robot(name="pole", links=(Link(name="pole", joint=Fixed(), mass=1.0),))
    of_inverse_kinematics = name in ("branches", "pose_error_in_world", "pose_error_in_tool")
    method = "inverse kinematics" if of_inverse_kinematics else name.removesuffix("_loaded")
    with pytest.raises(RobotError, match=f"robot 'pole': no joint moves, so there is no {method}"):
        TRACES[name](pole)


def test_a_load_on_a_stationary_link_does_not_change_the_torques():
    arm = Robot(name="arm", links=(Link(name="rod", **ROD), Link(name="stand", joint=Fixed(), mass=1.0)))
    load = (np.ones(6), (1.0, 0, 0, 0, 1, 1, 1, 0, 0, 0))
    state = ([0.3], [0.2], [0.1])
    assert evaluate(arm, "rne_loaded", *state, *load) == evaluate(arm, "rne", *state)
    assert evaluate(arm, "jacob0", [0.3]) == pytest.approx(np.zeros((6, 1)))
