"""Diagrams of robots whose joints have quaternions as coordinates."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from running import run

from armblocks.blocks import (
    ArmPlant,
    ComputedTorque,
    Constant,
    Derivative,
    ForwardDynamics,
    GravityCompensation,
    JointSensor,
    RobotPlot,
    Scope,
)
from armblocks.diagram import Diagram, DiagramBuilder
from armblocks.errors import InputError
from armblocks.report.motion import motions
from armblocks.report.motion_summary import summarise
from armblocks.robot import Free, JointLimits, Link, Prismatic, Robot, Spherical, Universal
from armblocks.spatial import transl
from robots_for_tests import evaluate

INERTIA = {"mass": 1.5, "inertia": (0.3, 0.4, 0.55)}
BODY = Robot(name="body", links=(Link(name="b", joint=Free(), **INERTIA),))
PENDULUM = Robot(
    name="pendulum",
    links=(
        Link(name="upper", joint=Spherical(), centre_of_mass=(0, 0, -0.5), **INERTIA),
        Link(
            name="lower",
            parent="upper",
            joint=Universal(),
            before=transl(0, 0, -1),
            centre_of_mass=(0, 0, -0.4),
            **INERTIA,
        ),
    ),
)


def falling(robot: Robot, block: type[ForwardDynamics] | type[ArmPlant], **values: object) -> Diagram:
    builder = DiagramBuilder("falling")
    tau = builder.add("no torque", Constant(value=(0.0,) * robot.n))
    arm = builder.add("arm", block(robot=robot, **values), tau)
    builder.add("rates", Scope(), builder.add("derivative", Derivative(), arm["q"]))
    builder.add("plot", RobotPlot(robot=robot), arm["q"])
    return builder.build()


def test_a_free_body_falls_on_a_parabola_and_keeps_its_rotation_about_a_principal_axis() -> None:
    start, speed = (1.0, 2.0, 3.0, 2.0, 0.0, 0.0, 0.0), (0.5, 0.0, 1.0, 0.0, 0.0, 1.7)
    result = run(falling(BODY, ForwardDynamics, q0=start, qd0=speed), 2.0)
    t, q = result.time, result["arm/q"]
    assert_allclose(q[:, :3].T, (1 + 0.5 * t, 2 + 0 * t, 3 + t - 9.81 * t**2 / 2), atol=1e-9)
    # The quaternion of the parameter has the length 2; the output has the length 1.
    zeros = 0 * t
    assert_allclose(q[:, 3:].T, (np.cos(0.85 * t), zeros, zeros, np.sin(0.85 * t)), atol=1e-6)
    assert_allclose(np.linalg.norm(q[:, 3:], axis=1), 1.0, rtol=1e-15)
    assert_allclose(result["plot/poses"][:, -1, :3, 3], q[:, :3], atol=1e-15)


@pytest.mark.parametrize("block", [ForwardDynamics, ArmPlant])
def test_the_derivative_of_the_coordinates_is_that_of_the_quaternion(block: type[ForwardDynamics]) -> None:
    speed = (0.4, -1.0, 2.0, 0.5, -0.5)
    result = run(falling(PENDULUM, block, qd0=speed), 1.0)
    for k in (0, len(result.time) // 2, -1):
        rates = evaluate(PENDULUM, "position_rates", result["arm/q"][k], result["arm/qd"][k])
        assert_allclose(result["rates/u"][k], rates.ravel(), rtol=0, atol=1e-12)
    energies = [
        evaluate(PENDULUM, "kinetic_energy", q, qd) + evaluate(PENDULUM, "potential_energy", q)
        for q, qd in zip(result["arm/q"][::20], result["arm/qd"][::20])
    ]
    assert np.ptp(energies) < 1e-4
    assert result["arm/q"][0].tolist() == PENDULUM.neutral.tolist()


def test_both_plants_have_the_same_motion() -> None:
    one, two = (run(falling(PENDULUM, block, qd0=1.0), 1.0) for block in (ForwardDynamics, ArmPlant))
    assert_allclose(one["arm/q"][-1], two["arm/q"][-1], rtol=0, atol=1e-5)


@pytest.mark.parametrize("stops", ["hard", "elastic"])
def test_a_slide_on_a_ball_joint_stops_at_its_limit(stops: str) -> None:
    limits = JointLimits(position=(-0.3, 0.2))
    slide = Link(name="slide", parent="upper", joint=Prismatic(axis=(0, 0, -1), limits=limits), **INERTIA)
    robot = Robot(name="r", links=(PENDULUM.links[0], slide))
    result = run(falling(robot, ArmPlant, stops=stops, stiffness=1e5, damping=1e3), 1.0)
    q = result["arm/q"]
    assert q[-1, 4] == pytest.approx(0.2, abs=0.0 if stops == "hard" else 1e-3)
    assert_allclose(q[:, :4], np.tile((1.0, 0, 0, 0), (len(q), 1)), atol=1e-9)
    with pytest.raises(InputError, match=r"joint .slide. starts at 0\.5, beyond its stop"):
        ArmPlant(robot=robot, stops="hard", q0=(1, 0, 0, 0, 0.5))


@pytest.mark.parametrize("block", [ForwardDynamics, ArmPlant])
@pytest.mark.parametrize(
    ("q0", "text"),
    [
        (0.1, r"q0 is 0\.1 for all"),
        ((0.0,) * 6, "q0 has a quaternion of zeros"),
        ((1.0,) * 5, r"q0 has 5 coordinates\. Allowed: 6, one for each coordinate, or 0 for all"),
    ],
)
def test_coordinates_that_are_no_rotation_are_refused(
    block: type[ForwardDynamics], q0: float | tuple[float, ...], text: str
) -> None:
    with pytest.raises(InputError, match=text):
        block(robot=PENDULUM, q0=q0)


@pytest.mark.parametrize("block", [ComputedTorque, GravityCompensation, JointSensor])
def test_blocks_that_subtract_or_add_coordinates_refuse_quaternions(block: type[ComputedTorque]) -> None:
    with pytest.raises(InputError, match="joint 'upper' of robot 'pendulum' has a quaternion as coordinates"):
        block(robot=PENDULUM)


def test_a_report_has_the_speeds_of_a_ball_joint_and_no_range() -> None:
    diagram = falling(BODY, ForwardDynamics, qd0=(0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
    result = run(diagram, 1.0)
    (motion,) = motions(diagram, result)
    summary = summarise(BODY, motion.time, motion.q, motion.qd, motion.qdd, motion.tau, motion.tool)
    assert [joint.name for joint in summary.joints] == ["b.x", "b.y", "b.z", "b.wx", "b.wy", "b.wz"]
    assert summary.joints[2].position_min == pytest.approx(-9.81 / 2, rel=1e-6)
    assert summary.joints[5].position_min is None
    assert summary.joints[5].speed_peak == pytest.approx(1.0, rel=1e-9)
