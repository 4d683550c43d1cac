"""MJCF files: random models compared with MuJoCo, and elements that the reader omits."""

from __future__ import annotations

import itertools
import warnings
from pathlib import Path

import mujoco
import numpy as np
import pytest
from mjcf_models import RandomModel

import armblocks as ab
from armblocks.errors import ArmblocksWarning, FormatError
from armblocks.formats.file_findings import FileContext
from armblocks.formats.meshes.mesh_file import mesh_corners
from armblocks.formats.mjcf.reader import read_mjcf
from armblocks.formats.mjcf.solids import solid_of_mesh
from armblocks.robot import Robot
from armblocks.robot.geometry import link_frames
from robots_for_tests import evaluate


def read(text: str, context: FileContext | None = None) -> Robot:
    return read_mjcf(text.encode(), "model.xml", context or FileContext())


def body(inside: str, more: str = "") -> str:
    return f"<mujoco>{more}<worldbody><body name='a'>{inside}</body></worldbody></mujoco>"


HINGE = '<joint name="j"/><geom size="0.1"/>'


def columns_of(robot: Robot, model: mujoco.MjModel) -> list[int]:
    """For each coordinate of the robot, the index of the joint of the model."""
    joints = {model.joint(j).name: j for j in range(model.njnt)}
    last_joint = {
        model.body(b).name: model.body_jntadr[b] + model.body_jntnum[b] - 1 for b in range(model.nbody)
    }
    return [int(joints.get(link.name, last_joint.get(link.name, -1))) for link in robot.moving_links]


def test_free_and_ball_joints_have_the_equations_of_mujoco() -> None:
    """The free body is at its initial pose at neutral coordinates, so that q is relative to this pose."""
    inner = "<joint name='k' type='ball' pos='0.1 0 0.2' armature='0.1' damping='0.2'/><geom size='0.1'/>"
    inside = f"<freejoint/><geom size='0.2' pos='0.1 0 0'/><body name='b' pos='0 0.3 0'>{inner}</body>"
    text = body(inside).replace("<body name='a'>", "<body name='a' pos='1 2 3'>")
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    robot = read(text)
    assert (robot.nq, robot.n, robot.joint_letters) == (11, 9, "6S")
    np.testing.assert_allclose(evaluate(robot, "link_poses", robot.neutral)[1, :3, 3], model.qpos0[:3])
    random = np.random.default_rng(4)
    q, (qd, qdd) = random.normal(size=robot.nq), random.normal(size=(2, robot.n))
    data.qpos[:], data.qvel[:], data.qacc[:] = q, qd, qdd
    data.qpos[:3] += (1, 2, 3)
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    mujoco.mj_inverse(model, data)
    poses = evaluate(robot, "link_poses", q)
    np.testing.assert_allclose(poses[1:3, :3, 3], data.xpos[1:], atol=1e-13)
    np.testing.assert_allclose(poses[1:3, :3, :3].reshape(2, 9), data.xmat[1:], atol=1e-13)
    np.testing.assert_allclose(evaluate(robot, "rne", q, qd, qdd), data.qfrc_inverse, atol=1e-10)


# -- against MuJoCo ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(12))
def test_random_models_have_the_poses_masses_limits_and_equations_of_mujoco(seed: int) -> None:
    text = RandomModel(seed).text()
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    robot = read(text)
    columns = columns_of(robot, model)
    assert sorted(columns) == list(range(model.nq))
    random = np.random.default_rng(seed)
    q, qd, qdd = random.uniform(-2, 2, (3, robot.n))
    data.qpos[columns], data.qvel[columns], data.qacc[columns] = q, qd, qdd
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)

    poses = dict(zip((link.name for link in robot.links), link_frames(robot, q)[1:]))
    masses = {link.name: link.mass for link in robot.links}
    for b in range(1, model.nbody):
        name = model.body(b).name
        np.testing.assert_allclose(poses[name][:3, 3], data.xpos[b], atol=1e-12)
        np.testing.assert_allclose(poses[name][:3, :3], data.xmat[b].reshape(3, 3), atol=1e-12)
        assert masses[name] == pytest.approx(model.body_mass[b], rel=1e-12)

    for low_high, j in zip(robot.qlim, columns):
        expected = model.jnt_range[j] if model.jnt_limited[j] else (-np.inf, np.inf)
        np.testing.assert_allclose(low_high, expected, rtol=1e-14)
    damping = [motor.viscous_friction if motor else 0.0 for motor in robot.motors]
    np.testing.assert_array_equal(damping, np.ravel(model.dof_damping.reshape(model.nv, -1)[:, 0])[columns])

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        arm = ab.Arm(robot.nofriction())
    mass_matrix = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass_matrix)
    expected = mass_matrix[np.ix_(columns, columns)]
    np.testing.assert_allclose(arm.inertia(q), expected, atol=1e-11 * np.abs(expected).max())
    torques = np.zeros(model.nv)
    mujoco.mj_rne(model, data, 1, torques)
    torques = (torques + model.dof_armature * data.qacc)[columns]
    np.testing.assert_allclose(arm.rne(q, qd, qdd), torques, atol=1e-11 * np.abs(torques).max())


def test_the_inertia_of_a_mesh_is_that_of_mujoco(tmp_path: Path) -> None:
    """A block with a notch: the default rule counts all tetrahedra as positive, ``exact`` does not."""
    points = np.array(list(itertools.product((0.0, 1.0), (0.0, 2.0), (0.0, 3.0))))
    points[7] = (0.3, 0.4, 0.5)  # one corner is pushed in
    faces = "0 1 3 0 3 2 4 6 7 4 7 5 0 4 5 0 5 1 2 3 7 2 7 6 0 2 6 0 6 4 1 5 7 1 7 3"
    vertex = " ".join(map(str, points.ravel()))
    for rule in ("legacy", "exact"):
        asset = (
            f'<asset><mesh name="m" inertia="{rule}" vertex="{vertex}" face="{faces}" '
            'scale="1 -2 0.5" refpos="0.1 0.2 0.3" refquat="1 0.3 0 0"/></asset>'
        )
        text = body('<joint pos="1 0 0"/><geom type="mesh" mesh="m" pos="0.2 0 1" euler="10 20 30"/>', asset)
        model = mujoco.MjModel.from_xml_string(text)
        robot = read(text)
        assert robot.links[0].mass == pytest.approx(model.body_mass[1], rel=1e-6)
        data = mujoco.MjData(model)
        mujoco.mj_fwdPosition(model, data)
        np.testing.assert_allclose(robot.links[0].centre_of_mass, data.xipos[1], rtol=1e-5)
        axes = data.ximat[1].reshape(3, 3)
        np.testing.assert_allclose(
            robot.links[0].I, axes @ np.diag(model.body_inertia[1]) @ axes.T, rtol=1e-5
        )


def test_a_mesh_file_of_mujoco_is_read(tmp_path: Path) -> None:
    """A tetrahedron with a normal and a texture coordinate, which are not used."""
    points = np.vstack([np.zeros(3), np.eye(3)]).astype("<f4")
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], dtype="<i4")
    header = np.array([4, 1, 1, 4], dtype="<i4")
    unused = np.zeros(5, dtype="<f4")
    data = b"".join(part.tobytes() for part in (header, points, unused, faces))
    np.testing.assert_array_equal(mesh_corners(data, "m.msh"), points[faces])
    for damaged in (data[:-4], data[:3], b"", data[:-4] + b"\x09\0\0\0"):
        with pytest.raises(FormatError, match=r"m\.msh"):
            mesh_corners(damaged, "m.msh")
    (tmp_path / "m.msh").write_bytes(data)
    file = tmp_path / "model.xml"
    file.write_text(body("<joint/><geom type='mesh' mesh='m'/>", "<asset><mesh file='m.msh'/></asset>"))
    assert ab.load_robot(file).robot.links[0].mass == pytest.approx(1000 / 6)


def test_the_mass_properties_of_a_mesh_are_exact_for_a_tetrahedron() -> None:
    """Closed form: volume 1/6, centre 1/4, moments 1/40 and products 1/480 about the centre."""
    o, x, y, z = np.vstack([np.zeros(3), np.eye(3)])
    corners = np.array([[o, y, x], [o, x, z], [o, z, y], [x, y, z]])
    for legacy in (True, False):
        solid = solid_of_mesh(corners + 5.0, legacy=legacy)
        assert solid.volume == pytest.approx(1 / 6)
        np.testing.assert_allclose(solid.centre, [5.25] * 3)
        expected = np.full((3, 3), 1 / 480) + np.eye(3) * (1 / 80 - 1 / 480)
        np.testing.assert_allclose(solid.inertia, expected, atol=1e-12)


# -- structure ---------------------------------------------------------------------------------------------


def test_a_body_with_several_joints_is_a_series_of_links() -> None:
    joints = '<joint name="x" type="slide" axis="1 0 0"/><joint name="turn"/><geom size="0.1"/>'
    robot = read(body(joints + '<body name="b"/>'))
    assert [(link.name, link.parent, link.joint.letter) for link in robot.links] == [
        ("x", None, "P"),
        ("a", "x", "R"),
        ("b", "a", "F"),
    ]
    assert robot.links[0].mass == 0.0 < robot.links[1].mass


def test_names_that_are_missing_or_taken_are_replaced() -> None:
    text = "<mujoco><worldbody><body><joint/><joint/></body><body/><body name='body'/></worldbody></mujoco>"
    assert [link.name for link in read(text).links] == ["body 2 joint", "body 3", "body", "body 2"]


def test_included_files_are_part_of_the_model(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "arm.xml").write_text(
        f"<mujocoinclude><body name='arm'>{HINGE}</body></mujocoinclude>"
    )
    (tmp_path / "defaults.xml").write_text(
        "<mujoco><default><joint axis='1 0 0'/></default><compiler angle='radian'/></mujoco>"
    )
    main = tmp_path / "main.xml"
    main.write_text(
        "<mujoco model='m'><include file='defaults.xml'/>"
        "<worldbody><include file='parts/arm.xml'/></worldbody></mujoco>"
    )
    robot = ab.load_robot(main).robot
    assert (robot.name, robot.links[0].name, robot.links[0].joint.axis) == ("m", "arm", (1.0, 0.0, 0.0))


def test_actuators_give_the_torque_limits_of_their_joints() -> None:
    actuators = (
        "<actuator><motor joint='j' gear='-20' ctrlrange='-1 2'/><position joint='k' forcerange='-5 5'/>"
        "<motor tendon='t'/></actuator>"
    )
    inside = HINGE + '<body><joint name="k" actuatorfrcrange="-9 9"/></body>'
    inside += '<body><joint actuatorfrcrange="-8 8"/></body>'
    context = FileContext()
    robot = read(body(inside, actuators), context)
    assert robot.torque_limits.tolist() == [40.0, 5.0, 8.0]
    assert [finding.rule.code for finding in context.findings] == ["mjcf-tendon"]


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (body("<joint type='ball' range='0 1'/><geom size='0.1'/>"), "mjcf-limit"),
        (body("<joint stiffness='3 1'/><geom size='0.1'/>"), "mjcf-stiffness"),
        (body(HINGE, "<equality><connect body1='a' body2='z' anchor='0 0 0'/></equality>"), "mjcf-equality"),
        (
            body(HINGE, "<tendon><fixed stiffness='2'><joint joint='j' coef='1'/></fixed></tendon>"),
            "mjcf-tendon",
        ),
        (body("<joint range='2 1'/><geom size='0.1'/>"), "mjcf-limit"),
        (body("<joint damping='-1'/><geom size='0.1'/>"), "mjcf-friction"),
        (
            body("<joint/><geom type='mesh' mesh='m'/>", "<asset><mesh name='m' file='m.stl'/></asset>"),
            "mjcf-inertia",
        ),
        (body("<joint/><geom type='sdf' mass='0'/>"), "mjcf-shape"),
        (body(HINGE + "<replicate count='3'><geom size='1'/></replicate>"), "mjcf-not-read"),
        (body(HINGE, "<option density='1.2'/>"), "mjcf-stiffness"),
        (body(HINGE, "<option><flag equality='disable' limit='enable'/></option>"), "mjcf-not-read"),
        (body("<joint damping='3 1 2'/><geom size='0.1'/>"), "mjcf-friction"),
        (body(HINGE + "<body gravcomp='1'><geom size='0.1'/></body>"), "mjcf-stiffness"),
    ],
)
def test_what_is_left_out_is_a_finding_with_a_code_and_a_line(text: str, code: str) -> None:
    context = FileContext()
    read(text, context)
    assert code in [finding.rule.code for finding in context.findings]
    assert all(finding.line == 1 for finding in context.findings)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<robot name='r'/>", "the root element is <robot>"),
        ("<mujoco/>", "the model has no bodies"),
        ("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>", "the model has no bodies"),
        (body("<joint type='wheel'/>"), "of type 'wheel', which MJCF does not have"),
        (body(HINGE + "<body><freejoint/></body>"), "a body inside another body has a free joint"),
        (body("<joint axis='0 0 0'/>"), "the axis of the joint is zero"),
        (body("<joint axis='0 0'/>"), "has 2 values"),
        (body("<joint axis='0 nan 0'/>"), "which is not a number"),
        (body("<joint class='none'/>"), "the default class 'none' does not exist"),
        (body("<inertial pos='0 0 0' mass='-1'/>"), "the mass is -1 kg"),
        (body("<geom type='box' size='1 1 1' quat='0 0 0 0'/>"), "the quaternion is zero"),
        (body("<geom type='capsule' size='1' fromto='0 0 0 0 0 0'/>"), "the ends of 'fromto' coincide"),
        (body("<include file='other.xml'/>"), "the included file 'other.xml' is not read"),
        (body("", "<compiler coordinate='global'/>"), "the coordinates are 'global'"),
        (body("", "<compiler eulerseq='xyw'/>"), "the order of Euler angles is 'xyw'"),
        (body("<body>" * 100 + "</body>" * 100), "nested too deeply"),
    ],
    ids=range(16),
)
def test_invalid_files_are_refused_with_file_line_and_reason(text: str, words: str) -> None:
    with pytest.raises(FormatError) as caught:
        read(text)
    assert words in str(caught.value)
    assert "model.xml" in str(caught.value)


def test_files_that_include_each_other_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.xml").write_text("<mujoco><include file='b.xml'/></mujoco>")
    (tmp_path / "b.xml").write_text("<mujoco><include file='b.xml'/></mujoco>")
    with pytest.raises(FormatError, match="includes itself"):
        ab.load_robot(tmp_path / "a.xml")


def test_load_robot_warns_once_for_each_kind_of_finding(tmp_path: Path) -> None:
    file = tmp_path / "floating.xml"
    spring = "<joint stiffness='2 1'/><geom size='1'/>"
    file.write_text(body(f"{spring}<body>{spring}</body>"))
    with pytest.warns(ArmblocksWarning, match="nonlinear part of the stiffness") as caught:
        ab.load_robot(file)
    assert len([entry for entry in caught if "mjcf-stiffness" in str(entry.message)]) == 1


@pytest.mark.parametrize("seed", range(30))
def test_damaged_files_are_read_or_refused(seed: int) -> None:
    random = np.random.default_rng(seed)
    data = bytearray(RandomModel(seed, bodies=3).text().encode())
    for _ in range(int(random.integers(1, 6))):
        start = int(random.integers(len(data)))
        data[start : start + int(random.integers(0, 12))] = bytes(
            random.choice(list(b'<>/"= -1e9xyz\x00'), int(random.integers(0, 6))).tolist()
        )
    try:
        read_mjcf(bytes(data), "damaged.xml", FileContext())
    except FormatError as error:
        assert "damaged.xml" in str(error)


def test_backslashes_in_paths_are_read_as_slashes(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "arm.xml").write_text("<mujocoinclude><body name='a'/></mujocoinclude>")
    (tmp_path / "model.xml").write_text(
        r"<mujoco><worldbody><include file='parts\arm.xml'/></worldbody></mujoco>"
    )
    assert [link.name for link in ab.load_robot(tmp_path / "model.xml").robot.links] == ["a"]
