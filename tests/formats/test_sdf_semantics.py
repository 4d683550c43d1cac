"""Poses, axes and inertias of SDF: random trees against the same robots in URDF and against an oracle."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from sdf_trees import Conversion, Oracle
from urdf_trees import random_urdf

from armblocks.formats.file_findings import FileContext
from armblocks.formats.sdf.reader import read_sdf
from armblocks.formats.urdf.reader import read_urdf
from armblocks.robot import Robot, with_tip
from armblocks.spatial import Transform, trotz
from robots_for_tests import evaluate


def read(text: str) -> Robot:
    context = FileContext()
    (robot,) = read_sdf(text.encode(), "r.sdf", context).values()
    assert context.findings == []
    return robot


def close(actual: np.ndarray, expected: np.ndarray) -> None:
    assert_allclose(actual, expected, rtol=0, atol=1e-12 * max(1.0, float(np.abs(expected).max())))


@pytest.mark.parametrize("seed", range(10))
def test_the_same_robot_in_sdf_and_urdf_has_the_same_kinematics_and_dynamics(seed: int) -> None:
    text = random_urdf(seed, links=7)
    conversion = Conversion(text, seed)
    urdf = read_urdf(conversion_source(text), "r.urdf", FileContext())
    tip = urdf.links[-1].name
    sdf = with_tip(read(conversion.sdf), tip)
    urdf = replace(
        urdf,
        base=Transform.from_matrix(conversion.base),
        tool=Transform.from_matrix(conversion.offsets[tip]),
    )
    assert sdf.joint_names == urdf.joint_names
    assert_allclose(sdf.qlim, urdf.qlim)
    random = np.random.default_rng(seed)
    q, qd, qdd = random.uniform(-2, 2, (3, sdf.n))
    for name in ("fkine", "jacob0", "inertia", "gravload"):
        close(evaluate(sdf, name, q), evaluate(urdf, name, q))
    close(evaluate(sdf, "rne", q, qd, qdd), evaluate(urdf, "rne", q, qd, qdd))
    close(evaluate(sdf, "friction", qd), evaluate(urdf, "friction", qd))
    poses = dict(zip((link.name for link in urdf.links), evaluate(urdf, "link_poses", q)[1:]))
    for row, link in enumerate(sdf.links, start=1):
        close(evaluate(sdf, "link_poses", q)[row], poses[link.name] @ conversion.offsets[link.name])


def conversion_source(text: str) -> bytes:
    """The URDF without the transmissions, which SDF does not have."""
    return re.sub(r"<transmission.*?</transmission>", "", text).encode()


@pytest.mark.parametrize("seed", range(10, 18))
def test_links_have_the_poses_and_inertias_of_the_definitions(seed: int) -> None:
    conversion = Conversion(random_urdf(seed), seed)
    robot = read(conversion.sdf)
    q = np.random.default_rng(seed).uniform(-2, 2, robot.n)
    of_link = dict(zip(robot.joint_names, q))
    elements = conversion.root.findall("joint")
    by_joint = {e.get("name", ""): of_link.get(e.find("child").get("link"), 0.0) for e in elements}  # pyright: ignore
    oracle = Oracle(conversion.sdf, {"anchor": 0.0, **by_joint})
    poses = evaluate(robot, "link_poses", q)
    for row, link in enumerate(robot.links, start=1):
        close(poses[row], oracle.links[link.name])
        mass, centre, moment = oracle.body(link.name)
        R = poses[row][:3, :3]
        assert link.mass == mass
        close(R @ link.r + poses[row][:3, 3], centre)
        close(R @ link.I @ R.T, moment)


ANCHOR = '<joint name="a" type="fixed"><parent>world</parent><child>base</child></joint>'
INERTIAL = "<inertial><mass>2</mass><inertia><ixx>.1</ixx><iyy>.1</iyy><izz>.1</izz></inertia></inertial>"


def two(body: str, version: str = "1.9", kind: str = "revolute", more: str = "") -> str:
    """A base, and an arm at (1, 0, 0), turned by 90 degrees about z; a joint with this content."""
    return f"""<sdf version="{version}"><model name="r"><link name="base">{INERTIAL}</link>
    <link name="arm"><pose>1 0 0 0 0 {np.pi / 2!r}</pose>{INERTIAL}</link>{more}
    <joint name="j" type="{kind}"><parent>base</parent><child>arm</child>{body}</joint></model></sdf>"""


def axis(robot: Robot, name: str = "arm") -> np.ndarray:
    """The axis of a joint in the frame of the base, at q = 0."""
    link = robot.link(name)
    return link.before.R @ np.array(link.joint.axis)


def test_the_axis_is_in_the_frame_of_the_joint_and_before_sdf_1_5_in_that_of_the_model() -> None:
    x = "<axis><xyz>1 0 0</xyz></axis>"
    for version in ("1.5", "1.6", "1.7", "1.12"):
        assert_allclose(axis(read(two(x, version))), [0, 1, 0], atol=1e-15)
    assert_allclose(axis(read(two(x, "1.4"))), [1, 0, 0], atol=1e-15)
    in_model = "<axis><xyz>1 0 0</xyz><use_parent_model_frame>1</use_parent_model_frame></axis>"
    assert_allclose(axis(read(two(in_model, "1.6"))), [1, 0, 0], atol=1e-15)
    expressed = '<axis><xyz expressed_in="base">1 0 0</xyz></axis>'
    assert_allclose(axis(read(two(expressed, "1.7"))), [1, 0, 0], atol=1e-15)


def test_a_joint_turns_its_child_about_its_own_frame() -> None:
    robot = read(two("<pose>0 1 0 0 0 0</pose><axis><xyz>0 0 1</xyz></axis>"))  # at (0, 0, 0) in the base
    assert_allclose(evaluate(robot, "fkine", [np.pi / 2])[:3, 3], [0, 1, 0], atol=1e-15)
    arm = robot.link("arm")
    assert arm.after.inverse().translation == (0.0, 1.0, 0.0)
    assert read(two("<axis><xyz>0 0 1</xyz></axis>")).link("arm").after.is_identity


@pytest.mark.parametrize("kind", ["universal", "revolute2"])
def test_a_joint_with_two_axes_becomes_two_joints_in_series(kind: str) -> None:
    """The first axis moves with the parent, the second one with the child."""
    axes = "<axis><xyz>0 0 1</xyz></axis><axis2><xyz>1 0 0</xyz></axis2>"
    robot = read(two(axes, kind=kind))
    assert robot.joint_names == ("j", "arm")
    assert robot.link("j").mass == 0
    q1, q2 = 0.3, -0.7
    c, s, C, S = np.cos(q1), np.sin(q1), np.cos(q2), np.sin(q2)
    quarter = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    expected = (
        quarter @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, C, -S], [0, S, C]])
    )
    assert_allclose(evaluate(robot, "fkine", [q1, q2])[:3, :3], expected, atol=1e-15)
    ends = "<parent>base</parent><child>arm</child>"
    swapped = "<parent>arm</parent><child>base</child><pose relative_to='arm'/>"
    robot = read(two(axes, kind=kind, more=ANCHOR).replace(ends, swapped))
    # T_arm_base = R(q1) R(q2) quarter', in the frame of the arm.
    expected = (
        quarter @ np.array([[1, 0, 0], [0, C, S], [0, -S, C]]) @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    )
    assert robot.joint_names == ("j", "arm")
    assert_allclose(evaluate(robot, "fkine", [q2, q1])[:3, :3], expected, atol=1e-15)


def test_a_ball_joint_has_a_quaternion_about_the_joint_frame() -> None:
    robot = read(two("<pose>0 1 0 0 0 0</pose>", kind="ball"))
    assert (robot.nq, robot.n, robot.joint_letters) == (4, 3, "S")
    ball = robot.link("arm")
    assert_allclose(evaluate(robot, "fkine", robot.neutral), evaluate(robot, "fkine", [2.0, 0, 0, 0]))
    turned = evaluate(robot, "fkine", [1.0, 0.0, 0.0, 1.0])
    expected = ball.before.matrix @ trotz(np.pi / 2).matrix @ ball.after.matrix
    assert_allclose(turned, expected, atol=1e-15)


@pytest.mark.parametrize(
    ("thread", "pitch"),
    [
        ("<screw_thread_pitch>0.5</screw_thread_pitch><thread_pitch>9</thread_pitch>", 0.5),
        (f"<thread_pitch>{-4 * np.pi!r}</thread_pitch>", 0.5),
        ("", 1.0),
    ],
)
def test_a_screw_advances_by_its_pitch_in_each_turn(thread: str, pitch: float) -> None:
    robot = read(two(thread + "<axis><xyz>0 0 1</xyz></axis>", kind="screw"))
    start, turned = (evaluate(robot, "fkine", [q]) for q in (0.0, 2 * np.pi))
    assert_allclose(turned[:3, :3], start[:3, :3], atol=1e-14)
    assert_allclose(turned[:3, 3] - start[:3, 3], (0, 0, pitch), atol=1e-14)


def test_poses_of_models_and_worlds_place_the_base_and_gravity_is_that_of_the_world() -> None:
    model = two("<axis><xyz>0 0 1</xyz></axis>").partition(">")[2].removesuffix("</sdf>")
    model = model.replace('<model name="r">', '<model name="r"><pose relative_to="f">0 0 1 0 0 0</pose>')
    frame = f'<frame name="f"><pose>5 0 0 0 0 {np.pi / 2!r}</pose></frame>'
    robot = read(
        f'<sdf version="1.9"><world name="w"><gravity>0 0 -1.62</gravity>{frame}{model}</world></sdf>'
    )
    assert robot.gravity == (0.0, 0.0, -1.62)
    assert_allclose(evaluate(robot, "fkine", [0.0])[:3, 3], [5, 1, 1], atol=1e-15)


def test_nested_models_have_their_own_names_and_frames() -> None:
    inner = f"""<model name="hand" placement_frame="grip"><pose relative_to="arm">0 0 2 0 0 0</pose>
    <link name="palm"><pose>0 0 .5 0 0 0</pose>{INERTIAL}</link>
    <frame name="grip" attached_to="palm"><pose>0 0 1 0 0 0</pose></frame></model>
    <joint name="k" type="prismatic"><parent>arm</parent><child>hand::palm</child>
    <axis><xyz expressed_in="hand::grip">0 0 1</xyz></axis></joint>"""
    robot = read(two("<axis><xyz>0 0 1</xyz></axis>", more=inner))
    assert [link.name for link in robot.links] == ["base", "arm", "hand::palm"]
    # The grip is placed at z = 2, so that the palm is at z = 1.
    assert_allclose(evaluate(robot, "fkine", [0.0, 0.25])[:3, 3], [1, 0, 1.25], atol=1e-15)
    by_model = inner.replace("<child>hand::palm</child>", "<child>hand</child>")
    other = read(two("<axis><xyz>0 0 1</xyz></axis>", more=by_model))
    assert_allclose(evaluate(other, "fkine", [0.0, 0.25])[:3, 3], [1, 0, 1.25], atol=1e-15)


def test_the_links_of_a_static_model_are_fixed() -> None:
    text = two("<axis><xyz>0 0 1</xyz></axis>").replace("<link", "<static>true</static><link", 1)
    robot = read(text)
    assert robot.n == 0
    assert robot.link("arm").before.translation == (1.0, 0.0, 0.0)


def test_the_child_of_a_joint_may_be_the_world() -> None:
    joint = '<joint name="w" type="revolute"><parent>base</parent><child>world</child>'
    more = f"{joint}<axis><xyz>0 0 1</xyz></axis></joint>"
    robot = read(two("<axis><xyz>0 0 1</xyz></axis>", more=more))
    assert robot.joint_names == ("base", "arm")
    assert_allclose(evaluate(robot, "fkine", [np.pi / 2, 0.0])[:3, 3], [0, -1, 0], atol=1e-15)


def test_impossible_rotors_and_gears_are_left_out() -> None:
    for inside in ("<drake:rotor_inertia>-1</drake:rotor_inertia>", "<drake:gear_ratio>0</drake:gear_ratio>"):
        context = FileContext()
        text = (
            '<sdf version="1.9"><model name="m"><link name="a"/><joint name="j" type="revolute">'
            f"<parent>world</parent><child>a</child><axis><xyz>0 0 1</xyz></axis>{inside}</joint>"
            "</model></sdf>"
        )
        (robot,) = read_sdf(text.encode(), "m.sdf", context).values()
        assert robot.motors == (None,)
        assert "sdf-dynamics" in [finding.rule.code for finding in context.findings]
