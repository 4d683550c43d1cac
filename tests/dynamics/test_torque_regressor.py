"""The regressor reproduces the torques of inverse dynamics, and has the published base parameters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import armblocks as ab
from armblocks.dynamics.torque_regressor import INERTIAL, MOTOR, trace_torque_regressor
from armblocks.errors import RobotError, UnknownNameError
from armblocks.estimation.base_columns import base_columns
from armblocks.face.torque_model import TorqueModel, description_of, linear_parameters
from armblocks.robot import Coupling, Robot
from mechanisms_for_tests import four_bar
from robots_for_tests import MIXED_ROBOTS, RANDOM_ROBOTS, build_random_tree, evaluate, random_states


def coupled() -> Robot:
    robot = build_random_tree(5, count=5, chain=True)
    names = [link.name for link in robot.tree_links]
    gear = Coupling(name="gear", terms=((names[2], 1.0), (names[0], -2.0)), constant=0.4)
    return replace(robot, constraints=(gear,))


def with_springs() -> Robot:
    robot = RANDOM_ROBOTS[0]
    joint = next(link.name for link in robot.links if link.joint.moves)
    return replace(robot, springs=(ab.JointSpring(name="s", joint=joint, stiffness=30.0, rest=0.2),))


ROBOTS = [*MIXED_ROBOTS, *RANDOM_ROBOTS, coupled(), with_springs()]


@pytest.mark.parametrize("every", [1, 2])
@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_regressor_times_parameters_is_the_torque(robot: Robot, every: int) -> None:
    names = [link.name for link in robot.links][::every]
    traced = trace_torque_regressor(robot, names)
    tree = robot.uncoupled
    G = tree.gear_ratios
    motors = [motor or ab.Motor() for motor in tree.motors]
    factors = [robot.friction_model.factors(float(ratio)) for ratio in G]
    parameters = np.concatenate(
        [
            *(linear_parameters(robot.link(name)) for name in names),
            [motor.reflected_inertia for motor in motors],
            [factor[0] * motor.viscous_friction for motor, factor in zip(motors, factors)],
            [factor[1] * motor.coulomb_friction[0] for motor, factor in zip(motors, factors)],
            [factor[1] * motor.coulomb_friction[1] for motor, factor in zip(motors, factors)],
            [1.0],
        ]
    )
    assert len(parameters) == len(INERTIAL) * len(names) + len(MOTOR) * tree.n + 1
    for q, qd, qdd in random_states(robot, 3):
        (Y,) = traced(q, qd, qdd)
        expected = evaluate(robot, "rne", q, qd, qdd).ravel()
        assert_allclose(Y @ parameters, expected, rtol=1e-9, atol=1e-9)


def base_count(name: str) -> int:
    robot = ab.load_robot(name).robot.nofriction()
    model = TorqueModel(robot, [link.name for link in robot.tree_links], "none", rotor_inertia=False)
    return len(model.base()[0].base)


def test_the_numbers_of_base_parameters_are_the_published_ones() -> None:
    # Puma 560: 36 (Mayeda, Yoshida, Osuka, IEEE Trans. Robotics and Automation 1990; Gautier, Khalil 1990).
    assert base_count("puma560") == 36
    # Panda: 43 (Gaz et al., IEEE Robotics and Automation Letters 2019, without friction).
    assert base_count("panda") == 43
    # Two links in a vertical plane: Izz1 + m2 a1^2, m1 + m2 a1, my1, Izz2, mx2, my2.
    assert base_count("twolink") in (5, 6)


def test_descriptions_and_linear_parameters_are_inverse() -> None:
    for link in ab.load_robot("puma560").robot.links[1:]:
        mass, centre, inertia = description_of(linear_parameters(link))
        assert_allclose(mass, link.mass)
        assert_allclose(centre, link.r, atol=1e-15)
        assert_allclose(inertia, link.I, atol=1e-14)


def test_base_columns_reproduce_a_matrix_of_known_rank() -> None:
    random = np.random.default_rng(1)
    W = random.normal(size=(80, 5)) @ random.normal(size=(5, 9)) * np.logspace(-6, 3, 9)
    W = np.insert(W, 4, 0.0, axis=1)
    found = base_columns(W, range(10))
    assert found.base.tolist() == [0, 1, 2, 3, 5] and found.without_effect.tolist() == [4]
    parameters = random.normal(size=10)
    assert_allclose(W[:, found.base] @ found.combined(parameters), W @ parameters, rtol=1e-6)
    assert_allclose(found.expansion(10) @ parameters, found.combined(parameters))


def test_closed_loops_and_unknown_links_are_refused() -> None:
    robot = four_bar()
    with pytest.raises(RobotError, match="the robot has the closed loop"):
        trace_torque_regressor(robot, [robot.links[0].name])
    with pytest.raises(UnknownNameError, match="no link named 'hand'"):
        trace_torque_regressor(RANDOM_ROBOTS[0], ["hand"])
