"""Descriptions are values: equal and hashable by content; arrays are converted to tuples."""

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

from armblocks.errors import RobotError, UnknownNameError
from armblocks.robot import (
    Fixed,
    FrictionModel,
    JointLimits,
    Link,
    Motor,
    Prismatic,
    Revolute,
    Robot,
    inertia_matrix,
    serial_chain,
    standard_dh,
)
from armblocks.spatial import Transform, transl
from robots_for_tests import build_puma560


def test_equal_content_is_equal_and_has_equal_hashes():
    one, two = build_puma560(), build_puma560()
    assert one == two
    assert hash(one) == hash(two)
    heavier = one.with_link("link3", mass=5.0)
    assert heavier != one
    assert heavier.link("link3").mass == 5.0
    assert replace(one, source="elsewhere") == one
    assert one.with_friction_model(FrictionModel.SIGNED_GEAR) != one


def test_descriptions_cannot_be_changed(puma560: Robot):
    with pytest.raises(FrozenInstanceError):
        puma560.name = "other"


def test_arrays_become_tuples():
    link = Link(
        name="l",
        centre_of_mass=np.array((1, 2, 3)),
        inertia=np.diag((1, 2, 3)),
        motor=Motor(coulomb_friction=np.float64(0.4)),
        joint=Revolute(axis=np.array((0, 0, 2)), limits=JointLimits(position=[-1, 1], speed=2)),
        geometry=[],
    )
    assert link.centre_of_mass == (1.0, 2.0, 3.0)
    assert link.inertia == ((1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 3.0))
    assert link.motor.coulomb_friction == (0.4, -0.4)
    assert link.joint.axis == (0.0, 0.0, 1.0)
    assert link.joint.limits == JointLimits(position=(-1.0, 1.0), speed=2.0)
    assert link.geometry == ()
    assert hash(link) == hash(replace(link))
    np.testing.assert_array_equal(link.I, np.diag((1, 2, 3)))
    np.testing.assert_array_equal(link.r, (1, 2, 3))


def test_inertia_is_accepted_in_three_forms():
    assert inertia_matrix((1, 2, 3)) == inertia_matrix(np.diag((1, 2, 3)))
    assert inertia_matrix((1, 2, 3, 4, 5, 6)) == ((1, 4, 6), (4, 2, 5), (6, 5, 3))
    with pytest.raises(
        RobotError, match=r"inertia of link 'l': the shape is \(2,\)\. Allowed: \(3, 3\), or 3"
    ):
        inertia_matrix((0, 0.35), link="l")
    with pytest.raises(RobotError, match="inertia of link 'l': the matrix is not symmetric"):
        inertia_matrix([[1, 2, 0], [0, 1, 0], [0, 0, 1]], link="l")


def test_a_motor_has_one_or_two_coulomb_friction_values():
    assert Motor(coulomb_friction=(0.3, -0.2)).coulomb_friction == (0.3, -0.2)
    assert Motor(inertia=2e-3, gear_ratio=-10).reflected_inertia == pytest.approx(0.2)
    with pytest.raises(RobotError, match="the Coulomb friction of a motor has 3 numbers"):
        Motor(coulomb_friction=(1, 2, 3))


def test_joints_are_listed_in_the_order_of_q():
    robot = Robot(
        name="r",
        links=serial_chain(
            [
                Link(name="stand", joint=Fixed()),
                Link(name="arm", joint=Revolute(limits=JointLimits(position=(-1, 2), speed=3, torque=4))),
                Link(name="lift", joint=Prismatic(), motor=Motor(gear_ratio=-5)),
            ]
        ),
    )
    assert robot.n == 2
    assert robot.joint_names == ("arm", "lift")
    assert robot.joint_letters == "RP"
    assert robot.positions == robot.speeds == (("arm", "rad"), ("lift", "m"))
    assert [link.parent for link in robot.links] == [None, "stand", "arm"]
    np.testing.assert_array_equal(robot.qlim, [[-1, 2], [-np.inf, np.inf]])
    np.testing.assert_array_equal(robot.speed_limits, [3, np.inf])
    np.testing.assert_array_equal(robot.torque_limits, [4, np.inf])
    np.testing.assert_array_equal(robot.gear_ratios, [1, -5])
    with pytest.raises(
        UnknownNameError, match=r"robot 'r': there is no link named 'Arm'.*did you mean 'arm'"
    ):
        robot.link("Arm")


def test_a_robot_whose_links_are_all_fixed_has_no_joints():
    pole = Robot(name="pole", links=(Link(name="pole", joint=Fixed()),))
    assert pole.n == 0
    assert pole.qlim.shape == (0, 2)


def test_nofriction_keeps_the_rotors(puma560: Robot):
    smooth = puma560.nofriction()
    assert [motor.inertia for motor in smooth.motors] == [motor.inertia for motor in puma560.motors]
    assert all(motor.viscous_friction == 0 == motor.coulomb_friction[0] for motor in smooth.motors)
    viscous = puma560.nofriction(viscous=False)
    assert viscous.motors[0].viscous_friction == 1.48e-3
    assert viscous.motors[0].coulomb_friction == (0, 0)
    assert puma560.nofriction(coulomb=False).motors[0].coulomb_friction == (0.395, -0.435)


def test_the_pose_of_a_link_is_the_product_before_motion_after():
    link = standard_dh("l", alpha=np.pi / 2, a=0.3, d=0.2, offset=0.1)
    expected = link.before @ link.joint.motion([0.5]) @ link.after
    assert link.pose(0.5) == expected
    assert Link(name="l", joint=Fixed(offset=3.0), before=transl(1, 0, 0)).pose() == transl(1, 0, 0)
    slide = Prismatic(axis=(0, 1, 0)).motion([0.4])
    assert slide == Transform(translation=(0, 0.4, 0))
