"""Robot blocks: agreement with the dynamics functions, units, and errors about unsuitable robots."""

from __future__ import annotations

import numpy as np
import pytest
from block_evaluation import evaluate

from armblocks import dynamics
from armblocks.blocks import (
    Constant,
    Coriolis,
    Fkine,
    ForwardDynamics,
    Gravload,
    Inertia,
    Jacob0,
    Jacobe,
    JTraj,
    Rne,
    RobotPlot,
)
from armblocks.diagram import Block, DiagramBuilder, ViewKind
from armblocks.errors import DiagramError, InputError
from armblocks.robot import Robot, serial_chain, standard_dh

RANDOM = np.random.default_rng(11)


@pytest.mark.parametrize(
    ("kind", "quantity", "count"),
    [
        (Fkine, "fkine", 1),
        (Jacob0, "jacob0", 1),
        (Jacobe, "jacobe", 1),
        (Rne, "rne", 3),
        (Gravload, "gravload", 1),
        (Inertia, "inertia", 1),
        (Coriolis, "coriolis", 2),
        (RobotPlot, "link_poses", 1),
    ],
)
def test_a_robot_block_agrees_with_the_dynamics_function(
    kind: type[Block], quantity: str, count: int, puma560: Robot
) -> None:
    inputs = RANDOM.uniform(-1, 1, (count, puma560.n))
    (result,) = evaluate(kind(robot=puma560), *inputs).values()
    (expected,) = dynamics.TRACES[quantity](puma560)(*inputs)
    assert result.shape == expected.shape
    # same operations; common subexpressions may be evaluated in another order
    assert result == pytest.approx(expected, rel=1e-13, abs=1e-12)


def test_forward_dynamics_outputs_states_and_acceleration(puma560: Robot) -> None:
    q, qd, tau = RANDOM.uniform(-1, 1, (3, 6))
    block = ForwardDynamics(robot=puma560, q0=0.1)
    actual = evaluate(block, tau, x=np.concatenate([q, qd]))
    assert np.array_equal(actual["q"], q)
    assert np.array_equal(actual["qd"], qd)
    (expected,) = dynamics.trace_accel(puma560)(q, qd, tau)
    assert actual["qdd"] == pytest.approx(expected, rel=1e-12)


def test_a_trajectory_is_the_polynomial_of_the_paper() -> None:
    q0, qf = np.array([0.1, 0.2]), np.array([3.14, -1.0])
    for t in (0.0, 2.5, 10.0):
        s = t / 10
        result = evaluate(JTraj(q0=q0, qf=qf, tmax=10), t=t)
        assert result["q"] == pytest.approx(q0 + (qf - q0) * (10 * s**3 - 15 * s**4 + 6 * s**5), rel=1e-14)
        speed = (qf - q0) * (30 * s**2 - 60 * s**3 + 30 * s**4) / 10
        assert result["qd"] == pytest.approx(speed, rel=1e-14, abs=1e-15)


def test_a_trajectory_is_at_rest_after_its_end() -> None:
    result = evaluate(JTraj(q0=[0.0], qf=[1.0], tmax=2.0), t=2.5)
    assert [float(result[name][0]) for name in ("q", "qd", "qdd")] == [1.0, 0.0, 0.0]


def test_units_depend_on_the_joint_types(puma560: Robot) -> None:
    assert [port.unit for port in Rne(robot=puma560).input_ports()] == ["rad", "rad/s", "rad/s2"]
    assert Rne(robot=puma560).output_ports()[0].unit == "N m"
    slide = Robot(name="slide", links=serial_chain([standard_dh("rail", sigma=1, mass=1.0)]))
    assert [port.unit for port in Rne(robot=slide).input_ports()] == ["m", "m/s", "m/s2"]
    assert Rne(robot=slide).output_ports()[0].unit == "N"
    both = Robot(
        name="both",
        links=serial_chain([standard_dh("turn", mass=1.0), standard_dh("rail", sigma=1, mass=1.0)]),
    )
    assert Rne(robot=both).output_ports()[0].unit == ""


def test_a_robot_plot_shows_its_robot(puma560: Robot) -> None:
    (view,) = RobotPlot(robot=puma560).views()
    assert view.kind is ViewKind.ROBOT
    assert view.subject is puma560


def test_start_values_of_the_wrong_length_are_refused(puma560: Robot) -> None:
    with pytest.raises(
        InputError, match=r"ForwardDynamics.q0: q0 has 2 joints. Allowed: 6, one for each joint of 'puma560'"
    ):
        ForwardDynamics(robot=puma560, q0=[0.0, 0.0])


def test_a_robot_of_another_size_is_refused_with_both_ports_of_the_connection(puma560: Robot) -> None:
    builder = DiagramBuilder("d")
    builder.add("fkine", Fkine(robot=puma560), builder.add("traj", JTraj(q0=[0] * 4, qf=[1] * 4))["q"])
    with pytest.raises(DiagramError, match=r"'traj/q' gives shape \(4,\) but 'fkine/q' takes shape \(6,\)"):
        builder.build()


def test_a_robot_without_mass_is_refused_with_the_name_of_the_block() -> None:
    ghost = Robot(name="ghost", links=serial_chain([standard_dh("nothing", a=1.0)]))
    builder = DiagramBuilder("d")
    builder.add("arm", ForwardDynamics(robot=ghost), builder.add("tau", Constant(value=[0.0])))
    with pytest.raises(DiagramError, match=r"block 'arm' \(Robot\), .*ghost"):
        builder.build()
