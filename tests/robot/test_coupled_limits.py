"""The limits of coordinates include the limits of the joints that depend on them by couplings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import Constant, ForwardDynamics
from armblocks.errors import LimitWarning
from armblocks.robot import JointLimits, Link, Motor, Revolute, Robot, plausibility_findings
from armblocks.robot.constraints import Coupling
from armblocks.studio.robots.scene import scene_of

MOTOR = Motor(gear_ratio=10.0)


def link(name: str, parent: str | None, motor: Motor | None = None, **limits: object) -> Link:
    return Link(
        name=name,
        parent=parent,
        mass=1.0,
        centre_of_mass=(0.1, 0, 0),
        inertia=((0.1, 0.0, 0.0), (0.0, 0.1, 0.0), (0.0, 0.0, 0.1)),
        joint=Revolute(limits=JointLimits(**limits)),  # type: ignore[arg-type]
        motor=motor,
    )


def gripper(*links: Link, terms: tuple[tuple[str, float], ...] = (("b", 1.0), ("a", 2.0))) -> Robot:
    """Joint b depends on the others: without other terms, b = 0.2 - 2 a."""
    return Robot(name="gripper", links=links, constraints=(Coupling(name="gear", terms=terms, constant=0.2),))


FINGER = link("b", "a", MOTOR, position=(-0.5, 0.5), speed=1.0, torque=2.0)


def test_limits_of_a_dependent_joint_are_those_of_its_coordinate() -> None:
    robot = gripper(link("a", None, position=(-3, 3), speed=4.0), FINGER)
    assert robot.qlim == pytest.approx(np.array([[-0.15, 0.35]]))
    assert robot.speed_limits == pytest.approx([0.5])
    assert robot.torque_limits == pytest.approx([4.0])
    assert robot.limits[0].position == tuple(robot.qlim[0])
    assert scene_of(robot).joints[0].limits == robot.limits[0].position
    assert not plausibility_findings(robot)
    assert robot.uncoupled.limits[1] == FINGER.joint.limits


def test_every_position_within_the_limits_keeps_all_joints_in_their_ranges() -> None:
    random = np.random.default_rng(3)
    for _ in range(50):
        factors, constants = random.uniform(-3, 3, 2), random.uniform(-1, 1, 2)
        lows, highs = random.uniform(-3, -1, 3), random.uniform(1, 3, 3)
        a, b, c = (
            link(name, parent, position=(low, high))
            for name, parent, low, high in zip("abc", (None, "a", "b"), lows, highs)
        )
        couplings = (
            Coupling(name="one", terms=(("b", 1.0), ("a", -factors[0])), constant=constants[0]),
            Coupling(name="two", terms=(("c", 1.0), ("b", -factors[1])), constant=constants[1]),
        )
        robot = Robot(name="chain", links=(a, b, c), constraints=couplings)
        grid = np.linspace(-3.5, 3.5, 2001)
        of_b = factors[0] * grid + constants[0]
        values = np.array([grid, of_b, factors[1] * of_b + constants[1]]).T
        allowed = ((lows <= values) & (values <= highs)).all(axis=1)
        if not allowed.any():
            continue
        low, high = robot.qlim[0]
        assert np.array_equal(allowed, (low <= grid) & (grid <= high))


def test_own_limits_that_are_narrower_are_unchanged() -> None:
    own = JointLimits(position=(-0.1, 0.3), speed=0.1, torque=0.5)
    robot = gripper(link("a", None, position=own.position, speed=own.speed, torque=own.torque), FINGER)
    assert robot.limits == (own,)
    third = link("b", "a", position=(0.2 - 2 * 0.3, 0.2 + 2 * 0.1))
    assert gripper(link("a", None, position=own.position), third).limits[0].position == own.position


def test_torque_limits_of_several_motors_are_not_combined() -> None:
    assert gripper(link("a", None, MOTOR), FINGER).torque_limits.tolist() == [np.inf]
    assert gripper(link("a", None), replace(FINGER, motor=None)).torque_limits.tolist() == [np.inf]


def test_limits_of_a_joint_that_depends_on_several_coordinates_are_a_finding() -> None:
    links = link("a", None, position=(-1, 1)), link("c", "a"), replace(FINGER, parent="c")
    robot = gripper(*links, terms=(("b", 1.0), ("a", 2.0), ("c", 1.0)))
    assert robot.qlim.tolist() == [[-1, 1], [-np.inf, np.inf]]
    assert [str(finding) for finding in plausibility_findings(robot)] == [
        "robot 'gripper', link 'b': the limits of the joint are not checked, because it depends on several "
        "coordinates: a, c. Do their limits keep it in its range?"
    ]
    free = gripper(*links[:2], link("b", "c"), terms=(("b", 1.0), ("a", 2.0), ("c", 1.0)))
    assert not plausibility_findings(free)


def test_ranges_without_a_common_value_are_a_finding() -> None:
    robot = gripper(link("a", None, position=(1, 3)), FINGER)
    assert robot.qlim.tolist() == [[1, 3]]
    assert [str(finding) for finding in plausibility_findings(robot)] == [
        "robot 'gripper', link 'b': its range from -0.5 to 0.5 has no common value with the range of joint "
        "'a', on which it depends. Is a sign of the coupling or of the range wrong? The range is not checked."
    ]
    only_speed = gripper(link("a", None), link("b", "a", speed=1.0))
    assert not plausibility_findings(only_speed)
    assert only_speed.speed_limits.tolist() == [0.5]


def test_a_run_beyond_the_limit_of_a_dependent_joint_gives_a_warning() -> None:
    robot = gripper(link("a", None), FINGER)
    builder = ab.DiagramBuilder("gripper")
    plant = ForwardDynamics(robot=robot, q0=np.array([0.3]), qd0=np.array([0.4]))
    builder.add("plant", plant, builder.add("torque", Constant(value=(0.0,))))
    with pytest.warns(LimitWarning, match=r"joint 'a' leaves its range .*20.05 deg"):
        ab.simulate(builder.build(), stop_time=1.0)
