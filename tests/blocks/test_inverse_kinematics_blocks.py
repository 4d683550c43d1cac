"""Blocks of inverse kinematics follow moving poses, with bounded speeds at singular configurations."""

from __future__ import annotations

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import (
    Constant,
    DifferentialIkine,
    Fkine,
    Ikine,
    Integrator,
    Jacob0,
    JTraj,
    ResolvedRate,
)
from armblocks.errors import InputError, RobotError

NO_VELOCITY = (0.0,) * 6


def run(arm: ab.Arm, q0: object, qf: object, *, through: object, stop: float = 2.0) -> ab.SimulationResult:
    """Run a block with the moving pose of a joint motion as its input T."""
    builder = ab.DiagramBuilder("motion")
    motion = builder.add("motion", JTraj(q0=q0, qf=qf, tmax=stop))
    inputs = [builder.add("fkine", Fkine(robot=arm), motion["q"])]
    if isinstance(through, DifferentialIkine):
        inputs.append(builder.add("velocity", Constant(value=NO_VELOCITY)))
    builder.add("ikine", through, *inputs)
    return ab.simulate(builder.build(), stop_time=stop, sample_time=0.05, rtol=1e-8, atol=1e-10)


def test_ikine_follows_a_branch() -> None:
    arm = ab.load_robot("puma560")
    q0, qf = np.array([0.1, 0.2, -1.0, 0.3, 0.6, 0.2]), np.array([0.9, 0.6, -0.6, 0.8, 0.9, 3.0])
    branches = arm.ikine_all(arm.fkine(q0), limits=False)
    branch = 1 + int(np.abs(branches.q - q0).max(axis=1).argmin())
    result = run(arm, q0, qf, through=Ikine(robot=arm, branch=branch, q0=q0))
    assert np.abs(result["ikine/q"] - result["motion/q"]).max() < 1e-7


def test_differential_ikine_follows_a_pose_and_keeps_redundant_joints_within_limits() -> None:
    arm = ab.load_robot("panda")
    q0 = np.array([0.1, 0.3, -0.2, -1.9, 0.2, 2.0, 0.4])
    result = run(
        arm,
        q0,
        q0 + 0.3,
        through=DifferentialIkine(robot=arm, q0=q0 + 0.1, gain=20.0, avoidance=0.5, max_speed=2.0),
    )
    T, found = arm.fkine(result["motion/q"]), arm.fkine(result["ikine/q"])
    assert np.abs(T[-1] - found[-1]).max() < 2e-2 and np.abs(T[0] - found[0]).max() > 0.05
    low, high = arm.robot.qlim.T
    assert ((result["ikine/q"] > low) & (result["ikine/q"] < high)).all()
    assert np.abs(result["ikine/q"][-1] - result["motion/q"][-1]).max() > 0.05  # another posture


def test_speeds_stay_bounded_through_a_singular_configuration_and_out_of_reach() -> None:
    arm = ab.load_robot("puma560")
    straight = -np.pi / 2 + np.arctan2(0.0203, 0.4318)
    q0 = np.array([0.1, 0.3, straight - 0.4, 0.3, 0.02, 0.2])
    qf = np.array([0.1, 0.3, straight + 0.4, 0.3, -0.02, 0.2])
    result = run(arm, q0, qf, through=DifferentialIkine(robot=arm, q0=q0, max_speed=2.0))
    assert np.abs(result["ikine/qd"]).max() <= 2.0 + 1e-9
    builder = ab.DiagramBuilder("far")
    far = np.eye(4)
    far[:3, 3] = 3.0, 0.0, 0.5
    inputs = [builder.add("T", Constant(value=far)), builder.add("v", Constant(value=NO_VELOCITY))]
    builder.add("ikine", DifferentialIkine(robot=arm, q0=q0), *inputs)
    away = ab.simulate(builder.build(), stop_time=20.0)
    reached = np.linalg.norm(arm.fkine(away["ikine/q"][-1])[:3, 3])
    assert reached > 0.7 and np.isfinite(away["ikine/q"]).all()


@pytest.mark.parametrize("name", ["puma560", "panda", "planar3r"])
def test_resolved_rate_is_the_least_squares_solution_at_regular_configurations(name: str) -> None:
    arm = ab.load_robot(name)
    q = np.linspace(0.3, 1.0, arm.n) * np.array([1, 1, -1, -1, 1, 1, 1])[: arm.n]
    v = 0.3 * np.array([0.1, -0.05, 0.02, 0.1, 0.2, -0.1])
    builder = ab.DiagramBuilder("rates")
    position = builder.add("q", Constant(value=q))
    velocity = builder.add("v", Constant(value=v))
    block = ResolvedRate(robot=arm, region=1e-9, max_speed=100.0)
    builder.add("rate", block, position, velocity)
    qd = ab.simulate(builder.build(), stop_time=0.1)["rate/qd"][0]
    J = arm.jacob0(q)
    if arm.n >= 6:
        expected = np.linalg.pinv(J) @ v
        assert np.abs(J @ qd - v).max() < 1e-8
    if arm.n == 6:
        assert np.abs(qd - expected).max() < 1e-8
    elif arm.n < 6:
        # The rows of the position are divided by the size of the arm.
        assert np.linalg.norm(J[:2] @ qd - v[:2]) < np.linalg.norm(v[:2])


def test_null_space_motion_does_not_move_the_tool() -> None:
    arm = ab.load_robot("panda")
    q0 = [0.1, 0.3, -1.0, -1.9, 0.2, 2.0, 0.4]
    builder = ab.DiagramBuilder("posture")
    speeds = Integrator(initial=q0)
    handle = builder.add("q", speeds)
    velocity = builder.add("v", Constant(value=NO_VELOCITY))
    rate = builder.add("rate", ResolvedRate(robot=arm, avoidance=1.0), handle, velocity)
    builder.connect(rate, handle)
    builder.add("jacob0", Jacob0(robot=arm), handle)
    result = ab.simulate(builder.build(), stop_time=3.0, rtol=1e-9, atol=1e-11)
    first, last = result["q/y"][0], result["q/y"][-1]
    assert np.abs(arm.fkine(first) - arm.fkine(last)).max() < 1e-5
    middle = arm.robot.qlim.mean(axis=1)
    assert np.linalg.norm(last - middle) < np.linalg.norm(first - middle) - 0.1


def test_branches_and_robots_are_checked() -> None:
    with pytest.raises(InputError, match="1 to 8, the branches of 'Puma 560'"):
        ab.DiagramBuilder("d").add("ikine", Ikine(robot=ab.load_robot("puma560"), branch=9))
    with pytest.raises(RobotError, match="have no closed form"):
        ab.DiagramBuilder("d").add("ikine", Ikine(robot=ab.load_robot("panda")))
