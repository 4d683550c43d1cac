"""The numbered kinematic tree, and a joint type that is defined in this file."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
from numpy.testing import assert_allclose

from armblocks.robot import Fixed, Joint, Link, Motor, Prismatic, Revolute, Robot, Screw, serial_chain
from armblocks.robot.joints import AxisMotion, BallMotion, Motion
from armblocks.robot.tree import BASE, KinematicTree
from robots_for_tests import along, evaluate, random_inertia, random_states, random_transform


@dataclass(frozen=True, kw_only=True)
class Gimbal(Joint):
    """Rotates about x, then advances along z by 5 cm per radian, then about any axis: a user's joint type."""

    letter: ClassVar[str] = "G"
    parameters: ClassVar[tuple[str, ...]] = ("axis",)

    @property
    def motions(self) -> tuple[Motion, ...]:
        return (
            AxisMotion(axis=(1.0, 0.0, 0.0), angular=1.0, name="roll"),
            AxisMotion(axis=(0.0, 0.0, 1.0), angular=1.0, linear=0.05, offset=0.2, name="screw"),
            BallMotion(),
            AxisMotion(axis=self.axis, linear=1.0, name="stroke"),
        )


def test_bodies_are_numbered_parents_first_and_refer_to_their_joint():
    robot = Robot(
        name="r",
        links=(
            Link(name="hand", parent="arm", joint=Prismatic()),
            Link(name="stand", joint=Fixed(), mass=7.0),
            Link(name="arm", parent="stand", mass=1.0),
            Link(name="box", parent="arm", joint=Fixed(), mass=2.0),
        ),
    )
    tree = KinematicTree.of(robot)
    assert [body.link for body in tree.bodies] == ["arm", "hand"]
    assert [body.position for body in tree.bodies] == [body.speed for body in tree.bodies] == [1, 0]
    assert [body.parent for body in tree.bodies] == [BASE, 0]
    assert [frame.body for frame in tree.links] == [1, BASE, 0, 0]
    assert tree.bodies[0].inertia.mass == 3.0
    assert tree.grounded.mass == 7.0
    assert tree.ancestors(1) == (0,)
    assert tree.ancestors(BASE) == ()


@pytest.mark.parametrize(
    "axis", [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1), (0.6, 0, 0.8), (1, 2, 3)]
)
def test_joints_move_about_or_along_any_axis(axis: tuple[float, float, float]):
    joints = (Revolute(axis=axis, offset=0.3), Prismatic(axis=axis, offset=0.3), Screw(axis=axis, pitch=0.3))
    for joint in joints:
        arm = Robot(name="arm", links=(Link(name="l", joint=joint),))
        expected = arm.links[0].pose(0.5).matrix
        assert_allclose(evaluate(arm, "fkine", [0.5]), expected, rtol=0, atol=1e-15)


def test_a_new_joint_type_works_in_every_algorithm():
    random = np.random.default_rng(8)
    robot = Robot(
        name="gimbals",
        links=serial_chain(
            [
                Link(
                    name=f"l{i}",
                    joint=kind(axis=tuple(random.normal(size=3))),
                    before=random_transform(random),
                    mass=1.5,
                    centre_of_mass=random.uniform(-0.2, 0.2, 3),
                    inertia=random_inertia(random),
                    motor=Motor(inertia=1e-4, gear_ratio=30),
                )
                for i, kind in enumerate((Gimbal, Revolute, Gimbal))
            ]
        ),
    )
    assert (robot.nq, robot.n, robot.joint_letters) == (15, 13, "GRG")
    assert [entry.name for entry in robot.speeds[:7]] == [
        *("l0.roll", "l0.screw", "l0.wx", "l0.wy", "l0.wz", "l0.stroke", "l1"),
    ]
    for q, qd, qdd in random_states(robot, 2):
        tau = evaluate(robot, "rne", q, qd, qdd)
        M = evaluate(robot, "inertia", q)
        C = evaluate(robot, "coriolis", q, qd)
        assert_allclose(tau, M @ qdd + C @ qd + evaluate(robot, "gravload", q), rtol=0, atol=1e-12)
        assert_allclose(evaluate(robot, "accel", q, qd, tau), qdd, rtol=0, atol=1e-10)
        assert evaluate(robot, "kinetic_energy", q, qd) == pytest.approx(qd @ M @ qd / 2, rel=1e-13)
        step = 1e-6
        for j in range(robot.n):
            ahead, behind = (
                evaluate(robot, "fkine", along(robot, q, np.eye(robot.n)[j], s * step)) for s in (1, -1)
            )
            velocity = (ahead[:3, 3] - behind[:3, 3]) / (2 * step)
            assert_allclose(evaluate(robot, "jacob0", q)[:3, j], velocity, rtol=0, atol=1e-8)


def test_gravity_of_the_tree_is_in_base_axes(puma560: Robot):
    T = random_transform(np.random.default_rng(3))
    tree = KinematicTree.of(replace(puma560, base=T))
    assert_allclose(tree.gravity, T.R.T @ (0, 0, -9.81), rtol=0, atol=1e-15)
