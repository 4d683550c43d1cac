"""Search for the signals of a run that describe the motion of a robot."""

from dataclasses import replace

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import Constant, Fkine, ForwardDynamics, Gravload, JTraj, Rne, RobotPlot, SineWave
from armblocks.diagram import DiagramBuilder
from armblocks.equations import SimulationOptions
from armblocks.report.motion import motions, robot_of
from armblocks.robot import Robot
from armblocks.spatial import transl

SHORT = SimulationOptions(stop_time=1.0, sample_time=0.01)


def run(builder: DiagramBuilder) -> tuple[ab.Diagram, ab.SimulationResult]:
    diagram = builder.build()
    return diagram, ab.simulate(diagram)


def test_the_papers_model_has_one_motion_with_exact_rates() -> None:
    diagram = ab.load_diagram("kr180model")
    (motion,) = motions(diagram, ab.simulate(diagram))
    assert motion.notes == ()
    assert motion.tau is not None
    assert np.degrees(np.abs(motion.qd).max(axis=0)) == pytest.approx([33.73, 0, 16.87, 0], abs=5e-3)
    assert motion.tau[0] == pytest.approx((0, 2305.35, 2452.5, 0), abs=25)  # torques of gravity
    assert motion.tool[-1] == pytest.approx((-2.949278739196, 1.254698768685, 2.347929043243), abs=1e-9)


def test_commanded_signals_of_a_controller_are_not_the_motion() -> None:
    """The controller passes the commanded acceleration to rne, not the acceleration of the arm."""
    diagram = ab.load_diagram("puma560_computed_torque")
    result = ab.simulate(diagram)
    (motion,) = motions(diagram, result)
    owner = next(name for name, block in diagram.blocks.items() if isinstance(block, ForwardDynamics))
    assert (motion.qdd == result[f"{owner}/qdd"]).all()
    assert motion.tau is not None and (motion.tau == result[f"{owner}/tau"]).all()


def test_missing_rates_are_computed_from_differences_with_a_note(puma560: Robot) -> None:
    builder = DiagramBuilder("swing", settings=SHORT)
    q = builder.add("swing", SineWave(amplitude=(1.0, 0.5, 0.2, 0.1, 0.1, 0.1)))
    builder.add("hand", Fkine(robot=puma560), q)
    builder.add("weight", Gravload(robot=puma560), q)
    diagram, result = run(builder)
    (motion,) = motions(diagram, result)
    assert len(motion.notes) == 2 and "differences between samples" in motion.notes[0]
    # Central differences of a sine over 10 ms steps: error below h^2 / 6 inside, h / 2 at the ends.
    assert motion.qd[1:-1, 0] == pytest.approx(np.cos(result.time[1:-1]), abs=2e-5)
    assert motion.tau is None  # the gravity torque alone is not the joint torque
    assert motion.poses.shape == (len(result.time), 8, 4, 4)


def test_two_arms_have_two_motions(puma560: Robot, kr180: Robot) -> None:
    builder = DiagramBuilder("two", settings=SHORT)
    for robot in (puma560, kr180):
        n = robot.n
        plan = builder.add(f"plan {robot.name}", JTraj(q0=(0.0,) * n, qf=(0.3,) * n, tmax=1.0))
        builder.add(f"plot {robot.name}", RobotPlot(robot=robot), plan["q"])
        builder.add(f"rne {robot.name}", Rne(robot=robot), plan["q"], plan["qd"], plan["qdd"])
    diagram, result = run(builder)
    arm_motions = motions(diagram, result)
    assert {motion.robot.name for motion in arm_motions} == {puma560.name, kr180.name}
    assert all(motion.tau is not None for motion in arm_motions)


def test_a_controllers_model_with_other_masses_is_not_a_second_motion() -> None:
    """A model with another tool is a second motion, because its pictures differ."""
    link = ab.Link(name="link", mass=2.0, centre_of_mass=(0.5, 0, 0), motor=ab.Motor(inertia=0.1))
    robot = Robot(name="pendulum", links=(link,), gravity=(0, -9.81, 0))
    model = replace(robot, name="model", links=(replace(link, mass=1.0, motor=None),), gravity=(0, -1.62, 0))
    tool = replace(robot, tool=transl(0, 0, 0.1))
    builder = DiagramBuilder("model", settings=SHORT)
    weight = builder.add("a weight", Gravload(robot=model))
    plant = builder.add("plant", ForwardDynamics(robot=robot), weight)
    builder.connect(plant["q"], weight["q"])
    builder.add("hand", Fkine(robot=tool), plant["q"])
    arms = motions(*run(builder))
    assert [arm.robot for arm in arms] == [robot, tool]
    assert arms[0].blocks == ("plant", "a weight") and arms[0].notes == ()


def test_a_diagram_without_a_robot_has_no_motion(puma560: Robot) -> None:
    assert robot_of(Constant()) is None
    assert robot_of(Fkine(robot=puma560)) == puma560
