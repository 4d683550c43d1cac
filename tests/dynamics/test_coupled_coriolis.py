"""The velocity torques of robots with couplings: random trees and the shipped palletising arms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from casadi import SX, Function, jtimes

from armblocks.dynamics import TRACES
from armblocks.robot import Prismatic, Revolute, Robot, Spherical
from armblocks.robot.constraints import Coupling
from robots_for_tests import build_mixed_tree, build_random_tree, evaluate, random_states, shipped_robot

PALLETISERS = ("irb460", "irb660", "irb760", "kr40_pa", "kr100_2_pa", "kr180_2_pa", "kr700_pa", "m410ic_185")


def coupled(tree: Robot) -> Robot:
    """The tree with two couplings that share a joint."""
    a, b, c, d, *_ = (link.name for link in tree.moving_links if link.joint.nv == 1)
    couplings = (
        Coupling(name="one", terms=((a, 2.0), (c, -1.0), (d, 0.5)), constant=0.3),
        Coupling(name="two", terms=((b, 1.0), (a, 0.7)), constant=-0.1),
    )
    return replace(tree, name=f"coupled {tree.name}", constraints=couplings)


ROBOTS = (
    coupled(build_random_tree(1)),
    coupled(build_random_tree(4, 9)),
    coupled(build_mixed_tree(8, (Spherical, Revolute, Prismatic, Revolute, Spherical, Revolute, Prismatic))),
    *(shipped_robot(name) for name in PALLETISERS),
)


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_the_velocity_torque_of_coupled_joints_is_that_of_rne(robot: Robot) -> None:
    for q, qd, _ in random_states(robot, 2):
        torque = evaluate(robot, "coriolis", q, qd) @ qd
        parts = evaluate(robot, "gravload", q) + evaluate(robot, "friction", qd)
        expected = evaluate(robot, "rne", q, qd, np.zeros(robot.n))
        assert torque + parts == pytest.approx(expected, abs=1e-12 * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_the_rate_of_a_coupled_inertia_minus_twice_coriolis_is_skew(robot: Robot) -> None:
    inertia, rates = TRACES["inertia"](robot), TRACES["position_rates"](robot).casadi_function()
    q, qd = inertia.arguments[0], SX.sym("qd", robot.n)
    rate = Function("rate", [q, qd], [jtimes(inertia.results[0], q, rates(q, qd))])
    for position, speed, _ in random_states(robot, 2):
        change = np.asarray(rate(position, speed)).reshape(robot.n, robot.n)
        skew = change - 2 * evaluate(robot, "coriolis", position, speed)
        assert skew == pytest.approx(-skew.T, abs=1e-12 * max(1.0, np.abs(skew).max()))
