"""Robots from URDF: laws over random trees against an oracle in NumPy, and the meaning of each element."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from urdf_trees import Oracle, random_urdf

import armblocks as ab
from armblocks.dynamics import trace_fkine
from armblocks.errors import ArmblocksWarning, InertiaWarning, UnknownNameError
from armblocks.formats import load_robot, read_robots
from armblocks.formats.file_findings import FileContext
from armblocks.formats.urdf.reader import read_urdf
from armblocks.formats.urdf.writer import write_urdf
from armblocks.robot import Robot, deepest_tip, with_tip
from armblocks.robot.shapes import Box, Cylinder, Material, Sphere
from robots_for_tests import evaluate

LIMIT = '<limit lower="-1" upper="2" effort="30" velocity="4"/>'
INERTIAL = '<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'


def joint(body: str, kind: str = "revolute") -> str:
    """A robot with two links and one joint with this content."""
    ends = '<parent link="base"/><child link="arm"/>'
    return (
        f'<robot name="r"><link name="base"/>\n<joint name="j" type="{kind}">{ends}{body}</joint>\n'
        f'<link name="arm">{INERTIAL}</link></robot>'
    )


def read(text: str) -> tuple[Robot, FileContext]:
    context = FileContext()
    return read_urdf(text.encode(), "r.urdf", context), context


def findings(text: str) -> list[str]:
    return [str(finding) for finding in read(text)[1].findings]


@pytest.mark.parametrize("seed", range(8))
def test_kinematics_and_dynamics_equal_those_of_an_independent_oracle(seed: int) -> None:
    text = random_urdf(seed)
    robot, context = read(text)
    assert [finding.rule.code for finding in context.findings if finding.rule.code != "urdf-axis"] == []
    random = np.random.default_rng(seed)
    q, qd, qdd = random.uniform(-2, 2, (3, robot.n))
    oracle = Oracle(text, list(robot.joint_names), q, qd, qdd)
    tip = robot.links[-1].name

    def close(actual: np.ndarray, expected: np.ndarray) -> None:
        assert_allclose(actual, expected, rtol=0, atol=1e-12 * max(1.0, float(np.abs(expected).max())))

    close(evaluate(robot, "fkine", q), oracle.pose(tip))
    poses = evaluate(robot, "link_poses", q)
    for row, link in enumerate(robot.links, start=1):
        close(poses[row], oracle.pose(link.name))
    close(evaluate(robot, "jacob0", q), oracle.jacobian(tip))
    M, tau = oracle.dynamics()
    close(evaluate(robot, "inertia", q), M)
    close(evaluate(robot.nofriction(), "rne", q, qd, qdd), tau)
    close(evaluate(robot, "rne", q, qd, qdd), tau + oracle.friction())
    close(evaluate(robot, "friction", qd), oracle.friction())


def test_a_joint_has_the_limits_axis_and_origin_of_its_element() -> None:
    robot, context = read(joint(f'<origin xyz="1 2 3" rpy="0 0 1.5"/><axis xyz="0 0 1"/>{LIMIT}'))
    assert context.findings == []
    arm = robot.link("arm")
    assert arm.joint.axis == (0.0, 0.0, 1.0)
    assert arm.joint.limits.position == (-1.0, 2.0)
    assert (arm.joint.limits.speed, arm.joint.limits.torque) == (4.0, 30.0)
    assert arm.before.translation == (1.0, 2.0, 3.0)
    assert arm.before.rpy == pytest.approx((0.0, 0.0, 1.5))
    assert arm.after.is_identity
    assert arm.motor is None
    assert robot.links[0].name == "base" and robot.joint_names == ("arm",)


def test_the_default_axis_is_x_and_a_continuous_joint_has_no_position_limits() -> None:
    robot, _ = read(joint(LIMIT, "continuous"))
    assert robot.link("arm").joint.axis == (1.0, 0.0, 0.0)
    assert robot.link("arm").joint.limits.position is None
    assert robot.link("arm").joint.limits.speed == 4.0


def test_infinite_limits_are_unknown_limits() -> None:
    limit = '<limit lower="-inf" upper="inf" effort="inf" velocity="Infinity"/>'
    limits = read(joint(limit))[0].link("arm").joint.limits
    assert (limits.position, limits.speed, limits.torque) == (None, None, None)


def test_friction_is_that_of_the_joint_behind_any_gear() -> None:
    gear = (
        '<transmission name="t"><joint name="j"/><actuator name="m">'
        "<mechanicalReduction>-50</mechanicalReduction><rotorInertia>2e-4</rotorInertia></actuator></transmission>"
    )
    text = joint(f'{LIMIT}<dynamics damping="0.5" friction="3"/>')
    for urdf in (text, text.replace("</robot>", f"{gear}</robot>")):
        robot, _ = read(urdf)
        assert_allclose(evaluate(robot, "friction", [2.0]), [4.0], rtol=1e-15)
        assert_allclose(evaluate(robot, "friction", [-2.0]), [-4.0], rtol=1e-15)
    motor = robot.link("arm").motor
    assert motor is not None and motor.gear_ratio == -50.0
    assert motor.reflected_inertia == pytest.approx(0.5)


@pytest.mark.parametrize(
    "transmission",
    [
        '<joint name="j"/><actuator name="m"/><mechanicalReduction>20</mechanicalReduction>',
        '<joint name="j"><mechanicalReduction>20</mechanicalReduction></joint><actuator name="m"/>',
        '<joint name="j"/><actuator name="m"><drake:gear_ratio value="20"/></actuator>',
    ],
)
def test_reductions_are_read_from_every_place_where_files_have_them(transmission: str) -> None:
    text = joint(LIMIT).replace("</robot>", f"<transmission>{transmission}</transmission></robot>")
    assert read(text)[0].gear_ratios.tolist() == [20.0]


def test_links_are_in_depth_first_order_and_the_tip_is_the_end_of_the_longest_chain() -> None:
    links = "".join(f'<link name="{name}"/>' for name in ("camera", "tool", "b", "a", "base", "finger"))
    ends = [("base", "a"), ("a", "camera"), ("a", "b"), ("b", "finger"), ("b", "tool")]
    kinds = ["revolute", "fixed", "continuous", "fixed", "fixed"]
    joints = "".join(
        f'<joint name="{child}_joint" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f"{LIMIT}</joint>"
        for (parent, child), kind in zip(ends, kinds)
    )
    text = f'<robot name="r">{links}{joints}</robot>'
    robot, _ = read(text)
    assert [link.name for link in robot.links] == ["base", "a", "camera", "b", "finger", "tool"]
    assert robot.joint_names == ("a", "b")
    assert deepest_tip(robot.links) == "tool"
    moved = with_tip(robot, "camera")
    assert [link.name for link in moved.links] == ["base", "a", "b", "finger", "tool", "camera"]
    assert moved.joint_names == ("a", "b")
    with pytest.raises(UnknownNameError, match="there is no link named 'hand'"):
        with_tip(robot, "hand")


def test_load_robot_selects_the_tip_for_every_format(tmp_path: Path) -> None:
    file = tmp_path / "r.urdf"
    file.write_text(joint(f'<origin xyz="1 0 0"/>{LIMIT}'), encoding="utf-8")
    assert ab.load_robot(file).fkine([0.0])[0, 3] == 1.0
    assert ab.load_robot(file, tip="base").fkine([0.0])[0, 3] == 0.0
    assert ab.load_robot("puma560", tip="link3").robot.links[-1].name == "link3"
    with pytest.raises(UnknownNameError, match="there is no link named 'flange'"):
        ab.load_robot(file, tip="flange")


def test_shapes_of_visuals_are_drawn_and_links_without_visuals_are_not() -> None:
    visual = (
        '<visual><origin xyz="0 0 1"/><geometry><box size="1 2 3"/></geometry></visual>'
        '<visual><geometry><cylinder radius="0.1" length="2"/></geometry></visual>'
        '<visual><geometry><sphere radius="0.2"/></geometry></visual>'
        '<visual><geometry><capsule radius="0.1" length="2"/></geometry></visual>'
    )
    robot, context = read(joint(LIMIT).replace(INERTIAL, f"{INERTIAL}{visual}"))
    assert context.findings == []
    box, cylinder, sphere, *capsule = robot.link("arm").geometry or ()
    assert isinstance(box, Box) and box.size == (1.0, 2.0, 3.0) and box.pose[2] == (0.0, 0.0, 1.0, 1.0)
    assert isinstance(cylinder, Cylinder) and (cylinder.radius, cylinder.length) == (0.1, 2.0)
    assert isinstance(sphere, Sphere) and sphere.radius == 0.2 and sphere.material is Material.PAINT
    assert [type(shape) for shape in capsule] == [Cylinder, Sphere, Sphere]
    assert robot.link("base").geometry == ()
    assert [link.geometry for link in read(joint(LIMIT))[0].links] == [None, None]


def test_collision_shapes_replace_meshes_that_are_not_shown() -> None:
    mesh = '<visual><geometry><mesh filename="package://p/arm.dae"/></geometry></visual>'
    box = '<collision><geometry><box size="1 1 1"/></geometry></collision>'
    robot, context = read(joint(LIMIT).replace(INERTIAL, mesh + box))
    assert [type(shape) for shape in robot.link("arm").geometry or ()] == [Box]
    assert [finding.rule.code for finding in context.findings] == ["urdf-mesh"]
    assert read(joint(LIMIT).replace(INERTIAL, mesh))[0].link("arm").geometry is None


FOUND = [
    (joint(""), "urdf-limit-missing", "the revolute joint has no limits; it is unlimited here"),
    (
        joint('<limit lower="2" upper="1" effort="1" velocity="1"/>'),
        "urdf-limit",
        "the lower limit 2 is above the upper limit 1; both are omitted",
    ),
    (
        joint('<limit lower="0" upper="1" effort="0" velocity="1"/>'),
        "urdf-limit",
        "the effort limit is 0, with which the joint cannot move; it is omitted",
    ),
    (joint(f'<axis xyz="0 0 2"/>{LIMIT}'), "urdf-axis", "the axis has the length 2; its direction is used"),
    (
        joint(f'<origin rpy="90 0 0"/>{LIMIT}'),
        "urdf-angle",
        "the origin is rotated by 90, 0, 0 rad, more than one turn; used as given",
    ),
    (
        joint(f'{LIMIT}<dynamics damping="-1"/>'),
        "urdf-dynamics",
        "damping -1 and friction 0 would accelerate the joint; they are omitted",
    ),
    (
        joint(f'{LIMIT}<mimic joint="other"/>'),
        "urdf-mimic",
        "it mimics joint 'other' with the multiplier 1; its coordinate is independent here",
    ),
    (joint(f"{LIMIT}<limits/>"), "urdf-unknown-element", "the element <limits> is not read"),
    (
        joint(LIMIT).replace(
            "</robot>", "<transmission><mechanicalReduction>0</mechanicalReduction></transmission></robot>"
        ),
        "urdf-transmission",
        "it is not read: 0 joints, 0 actuators, reduction 0, rotor inertia 0",
    ),
    (
        joint(LIMIT).replace(
            "</robot>", "<transmission><mechanicalReduction>n</mechanicalReduction></transmission></robot>"
        ),
        "urdf-transmission",
        "it is not read: the attribute 'value' contains 'n', which is not a number",
    ),
    (joint(LIMIT).replace(INERTIAL, "<visual/>"), "urdf-shape", "it has no shape"),
    (
        joint(LIMIT).replace(INERTIAL, '<visual><geometry><box size="1 0 1"/></geometry></visual>'),
        "urdf-shape",
        "the box has the size 0 m; it is omitted",
    ),
    (
        joint(LIMIT).replace(INERTIAL, "<visual><geometry><cone/></geometry></visual>"),
        "urdf-shape",
        "the shape 'cone' is not known",
    ),
    (
        joint(LIMIT).replace(INERTIAL, '<visual><geometry><mesh filename="a.ply"/></geometry></visual>'),
        "urdf-mesh",
        "the mesh 'a.ply' is not shown: '.ply' meshes are not supported",
    ),
]


def test_a_joint_that_mimics_another_has_no_coordinate_of_its_own() -> None:
    finger = (
        f'<link name="finger">{INERTIAL}</link><joint name="k" type="prismatic"><parent link="arm"/>'
        f'<child link="finger"/>{LIMIT}<mimic joint="j" multiplier="-2" offset="0.5"/></joint></robot>'
    )
    robot, context = read(joint(LIMIT).replace("</robot>", finger))
    assert not context.findings
    assert robot.joint_names == ("arm",)
    assert robot.couplings[0].terms == (("finger", 1.0), ("arm", 2.0))
    assert robot.couplings[0].constant == 0.5
    again = read_urdf(write_urdf(robot), "again.urdf", FileContext())
    assert again.couplings[0].terms == robot.couplings[0].terms
    (pose,), (expected,) = trace_fkine(again)([0.3]), trace_fkine(robot.uncoupled)([0.3, -0.6])
    assert pose == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize(
    ("text", "code", "words"), FOUND, ids=[f"{code}-{k}" for k, (_, code, _) in enumerate(FOUND)]
)
def test_what_is_not_read_as_written_is_a_finding_with_a_code(text: str, code: str, words: str) -> None:
    (finding,) = read(text)[1].findings
    assert finding.rule.code == code
    assert finding.what == words
    assert finding.line >= 1 and finding.file == "r.urdf" and finding.element
    assert str(finding).endswith(f"[{code}]") and len(str(finding)) < 400


def test_findings_are_warnings_of_load_robot_one_for_each_kind(tmp_path: Path) -> None:
    file = tmp_path / "two.urdf"
    text = joint('<limit lower="0" upper="1" effort="0" velocity="0"/>')
    file.write_text(text, encoding="utf-8")
    with pytest.warns(
        ArmblocksWarning, match="the velocity limit is 0.* 1 more of this kind; armblocks lint"
    ):
        load_robot(file)


def test_an_impossible_inertia_is_a_warning_and_kinematics_work(tmp_path: Path) -> None:
    file = tmp_path / "r.urdf"
    file.write_text(joint(LIMIT).replace('izz="1"', 'izz="5"'), encoding="utf-8")
    with pytest.warns(InertiaWarning, match="link 'arm': .* principal moment"):
        arm = ab.load_robot(file)
    assert arm.fkine([0.0]).shape == (4, 4)


def test_common_deviations_from_xml_are_read() -> None:
    text = joint(f'<origin xyz="1, 2, 3"/>{LIMIT}')
    assert read(text)[0].link("arm").before.translation == (1.0, 2.0, 3.0)
    assert read(text + "\n\0")[0].n == 1
    assert read(f'<!-- first -->\n<?xml version="1.0"?>{text}')[0].n == 1


def test_names_may_have_any_characters_and_encodings() -> None:
    text = joint(LIMIT).replace('"arm"', '"Ärmel 腕"')
    robot = read_urdf(text.encode("utf-16"), "r.urdf", FileContext())
    assert robot.joint_names == ("Ärmel 腕",)


def test_the_name_of_the_robot_is_that_of_the_file_if_it_has_none() -> None:
    ((name, robot),) = read_robots(
        joint(LIMIT).replace(' name="r"', "", 1).encode(), "arms/mine.urdf"
    ).items()
    assert name == robot.name == "mine"


@pytest.mark.parametrize("axis", ["0 0 1", "0 0 -1", "1 0 0", "0.6 0 0.8"])
def test_a_planar_joint_moves_in_the_plane_normal_to_its_axis(axis: str) -> None:
    text = joint(f'<origin xyz="1 2 3" rpy="0.1 0.2 0.3"/><axis xyz="{axis}"/>').replace("revolute", "planar")
    robot = read(text)[0]
    assert (robot.nq, robot.n, robot.joint_letters) == (3, 3, "E")
    start, moved = evaluate(robot, "fkine", [0, 0, 0]), evaluate(robot, "fkine", [0.3, -0.2, 0.7])
    assert_allclose(start, robot.link("arm").pose().matrix, atol=1e-15)
    normal = start[:3, :3] @ np.array([float(part) for part in axis.split()])
    assert abs(normal @ (moved - start)[:3, 3]) < 1e-15
    assert_allclose(np.linalg.norm((moved - start)[:3, 3]), np.hypot(0.3, 0.2))
    turn = moved[:3, :3] @ start[:3, :3].T
    assert_allclose(turn @ normal, normal, atol=1e-15)
    assert np.trace(turn) == pytest.approx(1 + 2 * np.cos(0.7))


def test_a_floating_joint_is_free() -> None:
    robot = read(joint('<origin xyz="1 2 3"/>').replace("revolute", "floating"))[0]
    assert (robot.nq, robot.n, robot.joint_letters) == (7, 6, "6")
    T = evaluate(robot, "fkine", [0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 1.0])
    assert_allclose(T[:3, 3], (1.1, 2.2, 3.3))
    assert_allclose(T[:3, :3], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)


def test_valid_files_give_no_warnings(tmp_path: Path) -> None:
    file = tmp_path / "r.urdf"
    file.write_text(joint(LIMIT), encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert load_robot(file).source == str(file)
