"""Writing URDF: reading the file again gives the same kinematics and dynamics."""

from __future__ import annotations

import dataclasses
import warnings
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from numpy.testing import assert_allclose
from urdf_trees import random_urdf

import armblocks as ab
from armblocks.errors import ArmblocksWarning, FormatError
from armblocks.formats.file_findings import FileContext
from armblocks.formats.urdf.reader import read_urdf
from armblocks.formats.urdf.writer import write_urdf
from armblocks.robot import (
    Fixed,
    Free,
    Joint,
    Link,
    Motor,
    Planar,
    Prismatic,
    Revolute,
    Robot,
    standard_dh,
    with_tip,
)
from armblocks.robot.robot import STANDARD_GRAVITY
from armblocks.robot.shapes import Box, Cylinder, Housing, Sphere
from armblocks.spatial import transl, trotx
from robots_for_tests import RANDOM_ROBOTS, build_mixed_tree, evaluate, law_robots_of, random_states


def read(data: bytes) -> Robot:
    return read_urdf(data, "r.urdf", FileContext())


def written(robot: Robot) -> Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ArmblocksWarning)
        again = read(write_urdf(robot))
    last = robot.links[-1]
    tool = not (last.after @ robot.tool).is_identity
    return with_tip(again, "tool" if tool else last.name)


URDF_TYPES = (Revolute, Prismatic, Fixed, Planar, Free)
ROBOTS = [
    *law_robots_of(URDF_TYPES),
    build_mixed_tree(4, URDF_TYPES),
    *(read(random_urdf(seed).encode()) for seed in range(3)),
]


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_kinematics_and_dynamics_are_those_of_the_robot(robot: Robot) -> None:
    again = written(robot)
    order = [robot.speeds.index(entry) for entry in again.speeds]
    places = [robot.positions.index(entry) for entry in again.positions]
    assert_allclose(again.qlim, robot.qlim[places])
    assert_allclose(again.speed_limits, robot.speed_limits[order])
    assert_allclose(again.torque_limits, robot.torque_limits[order])
    original = dataclasses.replace(robot, gravity=(0.0, 0.0, -9.81)).nofriction()
    reread = again.nofriction()
    for state in random_states(robot, count=2):
        q, qd, qdd = state
        other = [q[places], qd[order], qdd[order]]

        def close(actual: np.ndarray, expected: np.ndarray) -> None:
            scale = max(1.0, float(np.abs(expected).max(initial=0.0)))
            assert_allclose(actual, expected, rtol=0, atol=1e-12 * scale)

        close(evaluate(reread, "fkine", other[0]), evaluate(original, "fkine", q))
        close(evaluate(reread, "jacob0", other[0]), evaluate(original, "jacob0", q)[:, order])
        close(evaluate(reread, "inertia", other[0]), evaluate(original, "inertia", q)[np.ix_(order, order)])
        close(evaluate(reread, "rne", *other), evaluate(original, "rne", q, qd, qdd)[order])


@pytest.mark.parametrize("robot", RANDOM_ROBOTS, ids=lambda robot: robot.name)
def test_pinocchio_agrees_with_the_written_file(robot: Robot) -> None:
    robot = dataclasses.replace(robot, gravity=STANDARD_GRAVITY)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ArmblocksWarning)
        model = pin.buildModelFromXML(write_urdf(robot).decode())
    joints = [model.joints[model.getJointId(f"{name}_joint")] for name in robot.joint_names]
    columns = [joint.idx_v for joint in joints]
    rotors = np.zeros(model.nv)
    rotors[columns] = [motor.reflected_inertia if motor else 0.0 for motor in robot.motors]
    model.armature = rotors
    data = model.createData()
    q, qd, qdd = random_states(robot, 1)[0]
    states = [pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)]
    for joint, value in zip(joints, q):
        # Joints without limits have the coordinates cos q and sin q.
        states[0][joint.idx_q : joint.idx_q + joint.nq] = (
            value if joint.nq == 1 else (np.cos(value), np.sin(value))
        )
    states[1][columns], states[2][columns] = qd, qdd
    expected = pin.rnea(model, data, *states)[columns]
    tau = evaluate(robot.nofriction(), "rne", q, qd, qdd)
    assert_allclose(tau, expected, rtol=0, atol=1e-10 * np.abs(expected).max())
    pin.framesForwardKinematics(model, data, states[0])
    pose = data.oMf[model.getFrameId("tool")].homogeneous
    assert_allclose(evaluate(robot, "fkine", q), pose, atol=1e-10)


def test_friction_of_every_formula_is_that_of_the_joint() -> None:
    motor = Motor(inertia=1e-4, gear_ratio=-50.0, viscous_friction=1e-3, coulomb_friction=(0.1, -0.1))
    for model in ("squared-gear", "absolute-gear", "release-6"):
        robot = ab.Arm(Robot(name="r", links=(Link(name="a", motor=motor),))).with_friction_model(model).robot
        again = read(write_urdf(robot))
        for qd in (-2.0, 0.5):
            assert_allclose(evaluate(again, "friction", [qd]), evaluate(robot, "friction", [qd]), rtol=1e-14)
        assert again.gear_ratios.tolist() == [-50.0]


def test_a_robot_that_was_read_is_written_and_read_unchanged() -> None:
    robot = read(random_urdf(5).encode())
    again = read(write_urdf(robot))
    assert [(link.name, link.parent) for link in again.links] == [
        (link.name, link.parent) for link in robot.links
    ]
    assert again.joint_names == robot.joint_names
    for before, after in zip(robot.links, again.links):
        assert_allclose(after.before.matrix, before.before.matrix, atol=1e-14)
        assert_allclose(after.I, before.I, atol=1e-14)
        assert after.joint.limits == before.joint.limits


def test_shapes_of_urdf_are_written_in_the_frame_of_the_joint() -> None:
    shapes = (Box(size=(1.0, 2.0, 3.0)), Cylinder(radius=0.1, length=1.0), Sphere(radius=0.2))
    housing = Housing(start=(0.1, 0.1), end=(0.1, 0.1), length=1.0)
    link = standard_dh("a", a=0.5, geometry=(*shapes, housing))
    with (
        pytest.warns(ArmblocksWarning, match="1 shape is not part of the URDF file: Housing"),
        pytest.warns(ArmblocksWarning, match="1 link frame is moved to the joint, as URDF requires: a"),
    ):
        data = write_urdf(Robot(name="r", links=(link,)))
    (_, again, _) = read(data).links
    assert [type(shape) for shape in again.geometry or ()] == [Box, Cylinder, Sphere]
    assert again.geometry is not None and again.geometry[0].pose[0][3] == 0.5


def test_data_that_urdf_does_not_have_give_warnings() -> None:
    robot = Robot(name="r", links=(Link(name="a"),), gravity=(0.0, -9.81, 0.0))
    with pytest.warns(ArmblocksWarning, match="is not part of a URDF file, which is read with -9.81 along z"):
        write_urdf(robot)
    motor = Motor(coulomb_friction=(0.2, -0.1))
    with pytest.warns(ArmblocksWarning, match="depends on the direction; the mean is written"):
        write_urdf(Robot(name="r", links=(Link(name="a", motor=motor),)))
    with pytest.warns(ArmblocksWarning, match="friction accelerates the joint"):
        robot = Robot(name="r", links=(Link(name="a", motor=Motor(viscous_friction=-1.0)),))
    with pytest.warns(
        ArmblocksWarning, match="friction that accelerates the joint is not part of URDF files"
    ):
        write_urdf(robot)


class Rail(Prismatic):
    """A joint type of a user."""


@pytest.mark.parametrize(
    ("parents", "text"),
    [
        (
            {"a": None, "b": None, "c": "a", "d": "b"},
            "coordinates of the file are in another order: a, c, b, d",
        ),
        ({"a": None, "c": "a", "e": "c", "b": None}, "load the file with tip='b'"),
    ],
)
def test_another_tip_or_order_of_coordinates_gives_a_warning(
    parents: dict[str, str | None], text: str, tmp_path: Path
) -> None:
    links = tuple(
        Link(name=name, parent=parent, mass=1.0, before=transl(0.1 * k, 0.2, 0.3))
        for k, (name, parent) in enumerate(parents.items())
    )
    arm = ab.Arm(Robot(name="tree", links=links))
    with pytest.warns(ArmblocksWarning, match=text):
        ab.save_robot(arm, tmp_path / "tree.urdf")
    copy = ab.load_robot(tmp_path / "tree.urdf", tip=links[-1].name)
    q = dict(zip(arm.robot.joint_names, np.linspace(0.1, 0.7, arm.robot.n)))
    other = [q[name] for name in copy.robot.joint_names]
    assert_allclose(copy.fkine(other), arm.fkine(list(q.values())), atol=1e-12)


def test_other_joint_types_and_names_that_xml_cannot_contain_are_refused() -> None:
    joint: Joint = Rail()
    with pytest.raises(FormatError, match="link 'a' is a Rail, which URDF does not have"):
        write_urdf(Robot(name="r", links=(Link(name="a", joint=joint),)))
    with pytest.raises(FormatError, match="has characters that XML cannot contain"):
        write_urdf(Robot(name="r", links=(Link(name="a\0"),)))
    assert read(write_urdf(Robot(name='<&">', links=(Link(name="'a' & \"b\""),)))).joint_names == (
        "'a' & \"b\"",
    )


def test_names_that_the_writer_adds_are_free() -> None:
    links = (Link(name="base_link"), Link(name="tool", parent="base_link", before=transl(0, 0, 1)))
    robot = Robot(name="r", links=links, tool=trotx(0.5), base=transl(1, 2, 3))
    again = read(write_urdf(robot))
    assert [link.name for link in again.links] == ["base_link_", "base_link", "tool", "tool_"]
    assert_allclose(evaluate(again, "fkine", [0.1, 0.2]), evaluate(robot, "fkine", [0.1, 0.2]), atol=1e-15)
