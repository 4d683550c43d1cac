"""Robots in diagrams: the paper's Figure 9, a pendulum, and computed-torque control of the Puma 560."""

from __future__ import annotations

import numpy as np
import pytest
from running import run
from scipy.special import ellipj, ellipk

from armblocks.blocks import (
    Constant,
    Derivative,
    Display,
    Fkine,
    ForwardDynamics,
    Gain,
    JTraj,
    Rne,
    RobotPlot,
    Scope,
    Sum,
    T2xyz,
    XYGraph,
)
from armblocks.diagram import Diagram, DiagramBuilder
from armblocks.robot import Robot, serial_chain, standard_dh


def figure_9(robot: Robot) -> Diagram:
    """The model of the paper: jtraj, fkine, plot, three projections, a display, and rne after two du/dt."""
    builder = DiagramBuilder("kr180model")
    q = builder.add("jtraj", JTraj(q0=[0, 0, 0, 0], qf=[3.14, 0, 1.57, 0], tmax=10))["q"]
    builder.add("plot", RobotPlot(robot=robot), q)
    tool = builder.add("T2xyz", T2xyz(), builder.add("fkine", Fkine(robot=robot), q))
    for one, two in ("xy", "xz", "yz"):
        builder.add(f"{one}{two}", XYGraph(), tool[one], tool[two])
    builder.add("position", Display(inputs=3), tool["x"], tool["y"], tool["z"])
    qd = builder.add("du_dt", Derivative(), q)
    qdd = builder.add("du_dt1", Derivative(), qd)
    tau = builder.add("rne", Rne(robot=robot), q, qd, qdd)
    for name, signal in (("angles", q), ("speeds", qd), ("accelerations", qdd), ("torques", tau)):
        builder.add(name, Scope(), signal)
    return builder.build()


def test_the_model_of_the_paper_gives_its_published_numbers(kr180: Robot) -> None:
    result = run(figure_9(kr180.nofriction()), 10.0)
    reference = {
        0.0: (1.95, -1.25, -1.85),
        2.0: (2.36963237462, -0.835183999087, -1.693963015984),
        5.0: (1.252643063297, 3.318570240624, 0.041710789934),
        10.0: (-2.949278739196, 1.254698768685, 2.347929043243),
    }
    for t, position in reference.items():
        row = int(np.argmin(np.abs(result.time - t)))
        actual = [result[f"T2xyz/{axis}"][row] for axis in "xyz"]
        assert actual == pytest.approx(position, abs=1e-9)  # the paper prints twelve decimals
        assert result["plot/poses"][row][-1][:3, 3] == pytest.approx(position, abs=1e-9)
    peaks = np.degrees(np.abs(result["speeds/u"]).max(axis=0))
    assert peaks == pytest.approx([33.73, 0, 16.87, 0], abs=5e-3)  # the paper prints two decimals
    assert result["rne/tau"][0] == pytest.approx([0, 2305.35, 2452.5, 0], abs=1e-9)


def test_friction_is_zero_while_the_robot_is_at_rest(kr180: Robot) -> None:
    result = run(figure_9(kr180), 10.0)
    without_friction = run(figure_9(kr180.nofriction()), 10.0)
    for row in (0, -1):
        assert np.array_equal(result["torques/u"][row], without_friction["torques/u"][row])
    assert not np.array_equal(result["torques/u"][50], without_friction["torques/u"][50])


def pendulum() -> Robot:
    """A point mass of 2 kg, 0.8 m from a horizontal axis, on the x axis at q = 0; y points up."""
    return Robot(
        name="pendulum",
        gravity=(0, -9.81, 0),
        links=serial_chain([standard_dh("rod", a=0.8, mass=2.0)]),
    )


def test_a_falling_pendulum_agrees_with_the_elliptic_function() -> None:
    """Released at 90 degrees: sin(angle / 2) = k sn(K - w t), k = sin(45 deg), w = sqrt(g / l)."""
    builder = DiagramBuilder("pendulum")
    builder.add("arm", ForwardDynamics(robot=pendulum()), builder.add("tau", Constant(value=0.0)))
    result = run(builder.build(), 5.0)
    w, m = np.sqrt(9.81 / 0.8), 0.5
    sn, cn, dn, _ = ellipj(ellipk(m) - w * result.time, m)
    from_below = result["arm/q"][:, 0] + np.pi / 2
    # error of some hundred steps of 1e-10
    assert from_below == pytest.approx(2 * np.arcsin(np.sqrt(m) * sn), abs=1e-7)
    assert cn.shape == dn.shape


def test_the_error_of_computed_torque_control_is_critically_damped(puma560: Robot) -> None:
    """tau = rne(q, qd, qdd_r + KP e + KD e') gives e'' + 20 e' + 100 e = 0: e = e0 (1 + 10 t) exp(-10 t)."""
    robot = puma560.nofriction()
    qf = np.array([0.5, 0.9, -0.8, 0.6, -0.4, 1.0])
    builder = DiagramBuilder("computed torque")
    goal = builder.add("goal", JTraj(q0=[0.0] * 6, qf=qf, tmax=10))
    arm = builder.add("arm", ForwardDynamics(robot=robot, q0=0.1))
    e = builder.add("e", Sum(signs="+-"), goal["q"], arm["q"])
    ed = builder.add("ed", Sum(signs="+-"), goal["qd"], arm["qd"])
    kp, kd = builder.add("KP", Gain(gain=100.0), e), builder.add("KD", Gain(gain=20.0), ed)
    aim = builder.add("aim", Sum(signs="+++"), goal["qdd"], kp, kd)
    builder.connect(builder.add("rne", Rne(robot=robot), arm["q"], arm["qd"], aim), arm)
    result = run(builder.build(), 10.0)
    expected = -0.1 * (1 + 10 * result.time) * np.exp(-10 * result.time)
    assert result["e/y"] == pytest.approx(np.tile(expected, (6, 1)).T, abs=1e-8)
