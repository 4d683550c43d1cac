"""Dynamics with inertial parameters as arguments: equal to those of a robot with these numbers."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import armblocks as ab
from armblocks.dynamics.inertial_inputs import PARAMETRIC, trace_parametric
from armblocks.errors import InputError, UnknownNameError
from armblocks.robot import Coupling, Robot
from mechanisms_for_tests import four_bar
from robots_for_tests import MIXED_ROBOTS, build_random_tree, evaluate, random_states

METHODS = {"rne": 3, "gravload": 1, "inertia": 1, "accel": 3, "kinetic_energy": 2, "potential_energy": 1}


def changed(robot: Robot, names: list[str], rows: np.ndarray) -> Robot:
    """The robot with other numbers of some links."""
    for name, row in zip(names, rows):
        inertia = np.array(((row[4], row[7], row[9]), (row[7], row[5], row[8]), (row[9], row[8], row[6])))
        robot = robot.with_link(name, mass=row[0], centre_of_mass=row[1:4], inertia=inertia, dh=None)
    return robot


def random_rows(count: int, seed: int) -> np.ndarray:
    random = np.random.default_rng(seed)
    rows = random.uniform(0.1, 0.3, size=(count, 10))
    rows[:, 0] *= 10.0
    rows[:, 4:7] += 0.5
    return rows


def coupled() -> Robot:
    robot = build_random_tree(5, count=5, chain=True)
    names = [link.name for link in robot.tree_links]
    gear = Coupling(name="gear", terms=((names[2], 1.0), (names[0], -2.0)), constant=0.4)
    return replace(robot, constraints=(gear,))


@pytest.mark.parametrize("robot", [*MIXED_ROBOTS[:2], build_random_tree(2), coupled()], ids=lambda r: r.name)
def test_functions_with_parameters_are_those_of_a_robot_with_these_numbers(robot: Robot) -> None:
    names = [link.name for link in robot.links][::2]
    rows = random_rows(len(names), 3)
    other = changed(robot, names, rows)
    assert set(METHODS) == set(PARAMETRIC)
    for name, count in METHODS.items():
        traced = trace_parametric(name, robot, names).casadi_function()
        for state in random_states(robot, 2):
            arguments = [np.asarray(value, float) for value in state[:count]]
            expected = evaluate(other, name, *arguments)
            value = np.asarray(traced(*arguments, rows.ravel()).full()).reshape(expected.shape)
            assert_allclose(value, expected, rtol=1e-9, atol=1e-9)


def test_mechanisms_with_loops_have_parameters_as_well() -> None:
    robot = four_bar().with_link("crank", motor=ab.Motor(inertia=0.01))
    rows = random_rows(2, 4)
    parametric = ab.Arm(robot).parametric(["crank", "coupler"])
    other = ab.Arm(changed(robot, ["crank", "coupler"], rows))
    state = other.assemble(qd=[1.0, 0, 0], locked=["crank"])
    tau = np.array((2.0, 0.0, 0.0))
    qdd = other.accel(state.q, state.qd, tau)
    assert_allclose(parametric.accel(state.q, state.qd, tau, rows), qdd, rtol=1e-10)
    assert_allclose(parametric.rne(state.q, state.qd, qdd, rows), tau, atol=1e-10)


def test_samples_and_batches_agree_and_copies_give_the_same_numbers() -> None:
    arm = ab.load_robot("twolink")
    parametric = arm.parametric([link.name for link in arm.robot.links])
    assert_array_equal(parametric.defaults[:, 0], [link.mass for link in arm.robot.links])
    q = np.random.default_rng(1).normal(size=(4, arm.n))
    rows = np.array([random_rows(len(arm.robot.links), k) for k in range(4)])
    batch = parametric.gravload(q, rows)
    copy = pickle.loads(pickle.dumps(parametric))
    for k in range(4):
        assert_array_equal(copy.gravload(q[k], rows[k]), batch[k])
    assert_allclose(parametric.gravload(q[0], parametric.defaults), arm.gravload(q[0]), rtol=1e-13)
    assert "parameters of" in repr(parametric)


def test_links_that_do_not_exist_or_occur_twice_are_refused() -> None:
    arm = ab.load_robot("twolink")
    name = arm.robot.links[0].name
    with pytest.raises(UnknownNameError, match="no link named 'nowhere'"):
        arm.parametric(["nowhere"])
    with pytest.raises(InputError, match="a link occurs twice"):
        arm.parametric([name, name])
    with pytest.raises(InputError, match="no link is named"):
        arm.parametric([])
