"""Named configurations: values, checks, edits of joints, files, and an arm's view of them."""

from __future__ import annotations

import pickle
import warnings
from dataclasses import FrozenInstanceError, replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import armblocks as ab
from armblocks.errors import ArmblocksWarning, FormatError, RobotError, UnknownNameError
from armblocks.formats import load_robot, read_robots, read_script, robot_bytes, write_robot
from armblocks.robot import (
    Configurations,
    Coupling,
    Free,
    Link,
    Prismatic,
    Revolute,
    Robot,
    Spherical,
    plausibility_findings,
    with_tip,
)
from armblocks.robot.configurations import MAX_NAME
from armblocks.spatial import Transform, transl, trotx, trotz

PI = np.pi


def tree(**configurations: Any) -> Robot:
    """A tree with a ball, a slide, a coupled joint, and q in another order than depth first."""
    turned = Transform(rotation=trotx(0.3).rotation)
    solid: Any = {"mass": 1.0, "inertia": np.eye(3) * 0.1}
    links = (
        Link(name="trunk", joint=Prismatic(), **solid),
        Link(name="left", parent="trunk", joint=Revolute(offset=0.2), before=transl(0.0, 0.3, 0.1), **solid),
        Link(name="ball", parent="trunk", joint=Spherical(), before=trotz(0.4), after=turned, **solid),
        Link(name="finger", parent="left", joint=Revolute(axis=(0, 1, 0)), after=transl(0.2, 0, 0), **solid),
        Link(name="hand", parent="left", joint=Revolute(axis=(1, 0, 0)), **solid),
    )
    coupling = Coupling(name="follows", terms=(("finger", 1.0), ("left", -0.5)), constant=0.1)
    return Robot(name="tree", links=links, constraints=(coupling,), configurations=configurations)  # pyright: ignore[reportArgumentType]


HAND = (0.1, 0.5, 0.5, 0.5, -0.5, 0.5, -0.7)  # trunk, left, ball (4), hand


def test_configurations_are_an_immutable_mapping_with_an_order() -> None:
    robot = load_robot("puma560")
    arm = ab.Arm(robot)
    assert list(arm.q) == ["qz", "qr", "qs", "qn"]
    assert len(arm.q) == 4 and "qr" in arm.q and "qx" not in arm.q and arm.q.get("qx") is None
    assert_array_equal(arm.q["qn"], [0, PI / 4, PI, 0, PI / 4, 0])
    arm.q["qn"][0] = 5.0
    assert_array_equal(arm.q["qn"][0], 0.0)
    with pytest.raises(UnknownNameError, match=r"robot 'Puma 560': there is no configuration named 'qm'"):
        arm.q["qm"]
    other = arm.with_configuration("home", np.ones(6)).with_configuration("qz", [0.5] * 6)
    assert list(other.q) == ["qz", "qr", "qs", "qn", "home"]
    assert other.q["qz"][0] == 0.5 and other.robot != robot
    again = pickle.loads(pickle.dumps(other))
    assert again.q == other.q and hash(again.q) == hash(other.q)
    with pytest.raises(FrozenInstanceError, match="cannot assign to field 'entries'"):
        arm.q.entries = ()
    with pytest.raises(FrozenInstanceError, match="cannot delete field 'entries'"):
        delattr(arm.q, "entries")
    assert len(arm.q) == 4
    first = Configurations({"a": (1.0,), "b": (2.0,)})
    assert first != Configurations({"b": (2.0,), "a": (1.0,)}), "the order is that of a motion"
    assert repr(first) == "Configurations({'a': [1.0], 'b': [2.0]})"
    assert "qr  0°  90°  -90°  0°   0°  0°" in str(arm)
    assert "<td>qr</td>" in arm._repr_html_()
    assert_allclose(arm.fkine(arm.q["qn"])[:3, 3], [0.5963031486, -0.15005, 0.6574757323], atol=1e-9)


@pytest.mark.parametrize(
    ("configurations", "words"),
    [
        ({"a": [0.0]}, r"robot 'tree', configuration 'a': the configuration has 1 coordinate\. Allowed: 7"),
        ({"a": [np.nan] * 7}, "configuration 'a': coordinate 1 is nan. Allowed: finite numbers"),
        ({"a": np.zeros((7, 1))}, r"the coordinates have the shape \(7, 1\)"),
        ({"a": np.zeros(7)}, "all entries of a quaternion are 0"),
        ({"a": ["x"] * 7}, "is not an array of numbers"),
        ({" a": HAND}, "' a' is not a name of a configuration"),
        ({"": HAND}, "'' is not a name of a configuration"),
        ([("a", HAND), ("a", HAND)], "two configurations are named 'a'"),
        (5, "5 is not a mapping of names to coordinates"),
    ],
)
def test_configurations_that_do_not_fit_are_refused(configurations: Any, words: str) -> None:
    with pytest.raises(RobotError, match=words):
        replace(tree(), configurations=configurations)


def test_configurations_follow_the_joints_of_a_copy() -> None:
    robot = tree(hand=HAND)
    for name in robot.joint_names:
        # Another order of q: the same pose of every link.
        moved = with_tip(robot, name)
        poses = {link.name: row for link, row in zip(robot.links, ab.Arm(robot).link_poses(HAND)[1:])}
        rows = ab.Arm(moved).link_poses(moved.configurations["hand"])[1:]
        for link, row in zip(moved.links, rows):
            assert_allclose(row, poses[link.name], atol=1e-12)
    uncoupled = robot.uncoupled
    assert_allclose(
        ab.Arm(uncoupled).link_poses(uncoupled.configurations["hand"]),
        ab.Arm(robot).link_poses(HAND),
        atol=1e-12,
    )
    assert replace(robot, links=robot.links[:4]).configurations["hand"].tolist() == list(HAND[:6])
    floating = tuple(
        replace(link, joint=Free()) if link.name == "hand" else link
        for link in robot.links
        if link.name in ("trunk", "left", "hand")
    )
    with_ball = replace(robot, links=floating, constraints=())
    assert with_ball.configurations["hand"].tolist() == [0.1, 0.5, 0, 0, 0, 1, 0, 0, 0]
    named = replace(robot, name="other")
    with pytest.raises(UnknownNameError, match="robot 'other'"):
        named.configurations["x"]


def test_json_files_have_the_configurations_and_older_files_open() -> None:
    robot = tree(hand=HAND, other=(1.0, PI / 2, 1, 0, 0, 0, 1 / 3))
    data = write_robot(robot)
    assert read_robots(data, "a.json")["tree"] == robot
    assert b'[1, "90 deg", 1, 0, 0, 0, 0.3333333333333333]' in data
    assert read_robots(data.replace(b'"configurations"', b'"poses"'), "a.json")["tree"] == robot
    both = data.replace(b'  "constraints"', b'  "poses": [],\n  "constraints"')
    with pytest.raises(FormatError, match="both 'configurations' and 'poses'"):
        read_robots(both, "a.json")
    for wrong, words in ((b'"q": [0.1]', "the configuration has 1 coordinate"), (b'"q": ["1 m"]', "number")):
        broken = data[: data.index(b'"q": [')] + wrong + data[data.index(b"]", data.index(b'"q": [')) + 1 :]
        with pytest.raises(FormatError, match=words):
            read_robots(broken, "arm.json")


def test_key_frames_of_mjcf_are_read_and_written() -> None:
    mujoco = pytest.importorskip("mujoco")
    robot = tree(hand=HAND, zero=tree().neutral)
    with pytest.warns(ArmblocksWarning):  # order of the coordinates, axes of the ball
        data = robot_bytes(robot, "a.xml")
    model = mujoco.MjModel.from_xml_string(data.decode())
    state = mujoco.MjData(model)
    for k, name in enumerate(robot.configurations):
        assert model.key(k).name == name
        mujoco.mj_resetDataKeyframe(model, state, k)
        mujoco.mj_kinematics(model, state)
        poses = ab.Arm(robot).link_poses(robot.configurations[name])[1:]
        for link, pose in zip(robot.links, poses):
            body = state.body(link.name)
            assert_allclose(body.xpos, pose[:3, 3], atol=1e-9)
            assert_allclose(body.xmat.reshape(3, 3), pose[:3, :3], atol=1e-9)
    copy = with_tip(read_robots(data, "a.xml")["tree"], "hand")
    for name in robot.configurations:
        rows = ab.Arm(copy).link_poses(copy.configurations[name])[1:]
        by_name = dict(zip((link.name for link in copy.links), rows))
        for link, pose in zip(robot.links, ab.Arm(robot).link_poses(robot.configurations[name])[1:]):
            assert_allclose(by_name[link.name], pose, atol=1e-9)


FREE = """<mujoco model="m"><compiler angle="degree" eulerseq="XYZ"/><worldbody>
<body name="box" pos="1 2 3" euler="10 20 30"><freejoint/><geom size="0.1"/>
  <body name="arm" pos="0.1 0 0"><joint name="j" axis="0 0 1" ref="30" pos="0 0.1 0"/><geom size="0.1"/>
    <body name="b" quat="1 1 0 0"><joint name="k" type="ball" pos="0.05 0 0"/><geom size="0.1"/>
</body></body></body></worldbody><keyframe>
<key name="up" qpos="0.5 -1 2 0.5 0.5 -0.5 0.5 0.7 2 0 0 0.4"/>
<key qpos="1 2 3 1 0 0 0 0 0 0 0 0"/><key name="short" qpos="1 2"/><key name="speed" qvel="0 0"/>
</keyframe></mujoco>"""


def test_key_frames_of_free_and_ball_joints_have_mujocos_poses() -> None:
    mujoco = pytest.importorskip("mujoco")
    with pytest.warns(ArmblocksWarning, match="its qpos has 2 numbers, and the joints that are read have 12"):
        robot = read_robots(FREE.encode(), "free.xml")["m"]
    assert list(robot.configurations) == ["up", "key 2"]
    model = mujoco.MjModel.from_xml_string(FREE.replace('<key name="short" qpos="1 2"/>', ""))
    state = mujoco.MjData(model)
    for k, name in enumerate(robot.configurations):
        mujoco.mj_resetDataKeyframe(model, state, k)
        mujoco.mj_kinematics(model, state)
        for link, pose in zip(robot.links, ab.Arm(robot).link_poses(robot.configurations[name])[1:]):
            assert_allclose(state.body(link.name).xpos, pose[:3, 3], atol=1e-9)
            assert_allclose(state.body(link.name).xmat.reshape(3, 3), pose[:3, :3], atol=1e-9)


def test_key_frames_that_contradict_equality_constraints_are_reported() -> None:
    text = """<mujoco model="g"><compiler angle="radian"/><worldbody>
    <body name="a"><joint name="a"/><geom size="0.1"/></body>
    <body name="b"><joint name="b"/><geom size="0.1"/></body></worldbody>
    <equality><joint joint1="b" joint2="a" polycoef="0.1 2 0 0 0"/></equality>
    <keyframe><key name="right" qpos="0.5 1.1"/><key name="wrong" qpos="0.5 1.2"/></keyframe></mujoco>"""
    text = text.replace("right", long := "a" * (MAX_NAME - 21) + " b")
    with pytest.warns(ArmblocksWarning, match="do not satisfy the equality constraints of joints") as caught:
        robot = read_robots(text.encode(), "g.xml")["g"]
    assert len(caught) == 1 and "wrong" in str(caught[0].message)
    assert {name: q.tolist() for name, q in robot.configurations.items()} == {
        long[:-2]: [0.5],
        "wrong": [0.5],
    }, "a long name ends before its space"


def test_formats_without_configurations_warn() -> None:
    robot = replace(load_robot("twolink"), base=Transform())
    for suffix in ("urdf", "sdf"):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            robot_bytes(robot, f"a.{suffix}")
        words = f"2 named configurations are not part of the {suffix.upper()} file: qz, qn"
        assert any(words in str(warning.message) for warning in caught)


def test_scripts_define_configurations_by_vectors() -> None:
    script = b"""
    deg = pi/180; L(1) = Link([0 0.1 1 0]); L(2) = Link([0 0 1 0]);
    qz = [0 0]; qn = [30; -30]*deg; qd = [1 2]; q = [5 6]; qlim = [-1 1]; q_deg = [30 40];
    qd0 = [1 2]; qdd_0 = [1 2]; qdot = [1 2]; qddmax = [1 2]; quat = [1 0]; qdown = [1 2];
    q3 = [1 2 3]; Q = [7 8]; qpath = [0 0; 1 1];
    p2 = SerialLink(L, 'name', 'two');
    """
    robot = read_script(script, "two.m").robots["p2"]
    assert {name: q.round(6).tolist() for name, q in robot.configurations.items()} == {
        "qz": [0.0, 0.0],
        "qn": [0.523599, -0.523599],
        "qdown": [1.0, 2.0],
    }


def test_configurations_outside_the_limits_are_findings_and_shipped_ones_are_those_of_their_sources() -> None:
    for name in ("puma560", "panda", "ur5", "twolink"):
        findings = plausibility_findings(load_robot(name))
        assert not [finding for finding in findings if "configuration" in finding.what], name
    robot = load_robot("puma560").with_configuration("degrees", [0, 90, 0, 0, -2 * PI, 2 * PI + 1])
    texts = [str(finding) for finding in plausibility_findings(robot) if "configuration" in finding.what]
    assert texts == [
        "robot 'Puma 560': coordinate 'link2' of the configuration 'degrees' is 5156.6°, outside its limits "
        "from -45° to 225°. Is this in degrees, or are the limits too narrow? It is used as given."
    ]
    ready = load_robot("panda").configurations["ready"]
    assert_allclose(ready, [0, -PI / 4, 0, -3 * PI / 4, 0, PI / 2, PI / 4], rtol=1e-15)
    assert_allclose(ab.load_robot("panda").fkine(ready)[:3, 3], [0.306890567, 0.0, 0.590282052], atol=1e-9)
    stretched = ab.load_robot("puma560_akb")
    assert_allclose(stretched.fkine(stretched.q["qr"])[:3, 3], [-0.0203, 0.1501, 0.8649], atol=1e-12)
