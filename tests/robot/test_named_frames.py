"""Named frames: end effectors, sensors and mounts of chains, trees and files."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import mujoco
import numpy as np
import pytest

import armblocks as ab
from armblocks import formats
from armblocks.errors import FormatError, RobotError, UnknownNameError
from armblocks.formats.file_findings import FileContext
from armblocks.formats.mjcf.reader import read_mjcf
from armblocks.formats.mjcf.writer import write_mjcf
from armblocks.formats.robot_json import read_robot, robot_to_json, write_robot
from armblocks.formats.sdf.reader import read_sdf
from armblocks.formats.sdf.writer import write_sdf
from armblocks.formats.urdf.writer import write_urdf
from armblocks.robot import DhConvention, Link, NamedFrame
from armblocks.robot.dh_conversion import converted
from armblocks.spatial import Transform, rotation_about, transl

TURNED = Transform(rotation=rotation_about((0, 0, 1), 0.4), translation=(0.1, -0.2, 0.3))


def two_armed() -> ab.Robot:
    """A torso with two arms of two joints; each arm carries a tool, the torso a camera."""
    links = [ab.Link(name="torso", mass=5.0, inertia=(0.2,) * 3)]
    frames = [NamedFrame(name="camera", link="torso", pose=TURNED), NamedFrame(name="mount", pose=TURNED)]
    for side, y in (("left", 0.3), ("right", -0.3)):
        for parent, name, at in (("torso", "upper", (0, y, 0.5)), (f"{side}_upper", "lower", (0.4, 0, 0))):
            joint = ab.Revolute(axis=(0, 1, 0.2 * y))
            link = ab.Link(
                name=f"{side}_{name}",
                parent=parent,
                joint=joint,
                before=transl(*at),
                mass=1.0,
                inertia=(0.01,) * 3,
            )
            links.append(link)
        frames.append(NamedFrame(name=f"{side}_tool", link=f"{side}_lower", pose=transl(0.35, 0, 0) @ TURNED))
    return ab.Robot(name="two-armed", links=tuple(links), frames=tuple(frames), base=transl(0, 0, 0.2))


@pytest.mark.parametrize("name", two_armed().frame_names)
def test_a_frame_moves_with_its_link(name: str) -> None:
    """Its pose is that of the link times the constant pose; its Jacobian is the derivative of the pose."""
    robot = two_armed()
    arm, frame = ab.Arm(robot), robot.frame(name)
    q, qd = np.random.default_rng(1).uniform(-1, 1, (2, robot.n))
    row = 0 if frame.link is None else 1 + [link.name for link in robot.links].index(frame.link)
    T = arm.fkine(q, frame=name)
    assert pytest.approx(arm.link_poses(q)[row] @ frame.pose.matrix, abs=1e-15) == T
    step = 1e-6
    ahead, behind = (arm.fkine(q + sign * step * qd, frame=name) for sign in (1, -1))
    rates = (ahead - behind) / (2 * step)
    spin = rates[:3, :3] @ T[:3, :3].T
    velocity = [*rates[:3, 3], spin[2, 1], spin[0, 2], spin[1, 0]]
    assert arm.jacob0(q, frame=name) @ qd == pytest.approx(velocity, abs=1e-9)
    local = np.kron(np.eye(2), T[:3, :3].T)
    assert arm.jacobe(q, frame=name) == pytest.approx(local @ arm.jacob0(q, frame=name), abs=1e-14)


def test_frames_take_batches_and_named_arguments_as_the_tool_does() -> None:
    arm = ab.Arm(two_armed())
    q = np.random.default_rng(2).uniform(-1, 1, (5, arm.n))
    batch, out = arm.fkine(q, frame="left_tool"), np.empty((5, 4, 4))
    assert (batch[3] == arm.fkine(q=q[3], frame="left_tool")).all()
    assert arm.fkine(q, frame="left_tool", out=out, threads=2) is out and (out == batch).all()
    assert (arm.fkine(q, frame=None) == arm.fkine(q)).all()
    assert (arm.fkine(q) == arm.fkine(q, frame="right_lower")).all()  # the tip without a tool


def test_unknown_frames_are_named_with_the_known_ones() -> None:
    with pytest.raises(UnknownNameError, match="no frame named 'left_tol'") as caught:
        ab.Arm(two_armed()).jacob0(np.zeros(5), frame="left_tol")
    assert "left_tool" in str(caught.value) and "two-armed" in str(caught.value)


@pytest.mark.parametrize(
    ("frames", "message"),
    [
        ((NamedFrame(name=""),), "a frame has no name"),
        ((NamedFrame(name="a"), NamedFrame(name="a")), "two frames are named 'a'"),
        ((NamedFrame(name="torso"),), "a frame and a link are named 'torso'"),
        ((NamedFrame(name="a", link="tors"),), "no link named 'tors'"),
        (("a",), "NamedFrame"),
        ([NamedFrame(name=f"f{k}") for k in range(5001)], "the robot has 5001 named frames"),
    ],
)
def test_wrong_frames_are_refused(frames: tuple[NamedFrame, ...], message: str) -> None:
    with pytest.raises((RobotError, UnknownNameError), match=message):
        replace(two_armed(), frames=frames)


def test_robot_files_keep_frames() -> None:
    robot = two_armed()
    assert read_robot(write_robot(robot), "robot.json") == robot
    schema = json.loads((Path(formats.__file__).parent / "schema" / "robot.schema.json").read_bytes())
    jsonschema.Draft202012Validator(schema).validate(json.loads(write_robot(robot)))
    document = robot_to_json(robot)
    document["frames"] = [{"name": "a", "link": "nowhere"}]
    with pytest.raises(FormatError, match="no link named 'nowhere'"):
        read_robot(json.dumps(document).encode(), "robot.json")


def test_other_formats_keep_frames() -> None:
    """MJCF has sites, SDF has frames on links; in URDF fixed links take their place."""
    robot = two_armed()
    q = np.random.default_rng(3).uniform(-1, 1, robot.n)
    expected = {name: ab.Arm(robot).fkine(q, frame=name) for name in robot.frame_names}
    in_mjcf = read_mjcf(write_mjcf(robot), "robot.xml", FileContext())
    with pytest.warns(ab.errors.ArmblocksWarning, match="frames on the base are not part of the SDF file"):
        (in_sdf,) = read_sdf(write_sdf(robot), "robot.sdf", FileContext()).values()
    assert set(in_mjcf.frame_names) == set(robot.frame_names)
    assert set(in_sdf.frame_names) == set(robot.frame_names) - {"mount"}
    for copy in (in_mjcf, in_sdf):
        for name in copy.frame_names:
            assert ab.Arm(copy).fkine(q, frame=name) == pytest.approx(expected[name], abs=1e-12), name
    with pytest.warns(ab.errors.ArmblocksWarning, match="named frames are not part of the URDF file"):
        write_urdf(robot)


SITES = """<mujoco><default><site size="0.02"/></default><worldbody>
  <site name="ground" pos="1 2 3"/>
  <body name="a"><joint name="a1" axis="0 0 1"/><geom size="0.1"/>
    <frame pos="0.1 0 0" euler="0 30 0"><site name="inner" euler="10 20 30"/></frame>
    <site name="along" type="capsule" size="0.01" fromto="0 0 0 0.3 0.4 0"/><site/>
    <body name="b" pos="0.5 0 0"><joint axis="0 1 0"/><geom size="0.1"/><site name="a" quat="1 1 0 0"/></body>
  </body></worldbody></mujoco>"""


def test_sites_of_mjcf_are_those_of_mujoco() -> None:
    """Poses and Jacobians; a site with the name of a body gets another name."""
    robot = read_mjcf(SITES.encode(), "robot.xml", FileContext())
    assert [frame.name for frame in robot.frames] == ["ground", "inner", "along", "a_"]
    model = mujoco.MjModel.from_xml_string(SITES)
    data = mujoco.MjData(model)
    q = np.array([0.4, -0.7])
    data.qpos[:] = q
    mujoco.mj_forward(model, data)
    arm = ab.Arm(robot)
    for name, of_mujoco in (("ground", "ground"), ("inner", "inner"), ("along", "along"), ("a_", "a")):
        site = model.site(of_mujoco).id
        T = arm.fkine(q, frame=name)
        assert T[:3, 3] == pytest.approx(data.site_xpos[site], abs=1e-12)
        assert T[:3, :3].ravel() == pytest.approx(data.site_xmat[site], abs=1e-12)
        J = np.zeros((6, 2))
        mujoco.mj_jacSite(model, data, J[:3], J[3:], site)
        assert arm.jacob0(q, frame=name) == pytest.approx(J, abs=1e-12)


@pytest.mark.parametrize("suffix", ["xml", "sdf"])
def test_frames_keep_their_names_beside_the_names_that_a_writer_adds(tmp_path: Path, suffix: str) -> None:
    names = ("tool", "l1_joint", "tool_joint")
    links = (
        Link(name="l0", mass=1.0, inertia=(0.1, 0.1, 0.1)),
        Link(name="l1", parent="l0", before=transl(0.3, 0.1, 0.2), mass=1.0, inertia=(0.1, 0.1, 0.1)),
    )
    frames = tuple(NamedFrame(name=name, link="l1", pose=transl(0.7, k, 0.9)) for k, name in enumerate(names))
    robot = ab.Robot(name="named", links=links, tool=transl(0.2, 0.0, 0.4), frames=frames)
    ab.save_robot(robot, tmp_path / f"robot.{suffix}")
    arm, again = ab.Arm(robot), ab.load_robot(tmp_path / f"robot.{suffix}")
    q = [0.4, -0.7]
    for name in (None, *names):
        np.testing.assert_allclose(again.fkine(q, frame=name), arm.fkine(q, frame=name), atol=1e-12)


def test_a_frame_with_a_reserved_name_is_renamed_with_a_warning(tmp_path: Path) -> None:
    frame = NamedFrame(name="world", link="l0", pose=transl(0.7, 0.0, 0.0))
    link = Link(name="l0", mass=1.0, inertia=(0.1, 0.1, 0.1))
    robot = ab.Robot(name="named", links=(link,), frames=(frame,))
    with pytest.warns(ab.errors.ArmblocksWarning, match="the name of frame 'world' becomes 'world_', as SDF"):
        ab.save_robot(robot, tmp_path / "robot.sdf")
    assert ab.load_robot(tmp_path / "robot.sdf").robot.frames[0].name == "world_"


def test_frames_of_sdf_follow_their_links() -> None:
    """Frames that refer to other frames; a frame that cannot be placed is a finding."""
    text = """<sdf version="1.9"><model name="m">
      <link name="a"/><link name="b"><pose>0 0 1 0 0 0</pose></link>
      <joint name="j" type="revolute"><parent>a</parent><child>b</child><axis><xyz>0 1 0</xyz></axis></joint>
      <frame name="camera" attached_to="b"><pose>0.1 0 0 0 0 0</pose></frame>
      <frame name="lens" attached_to="camera"><pose>0 0 0.2 0 0.5 0</pose></frame>
      <frame name="wrong" attached_to="nothing"/></model></sdf>"""
    context = FileContext()
    (robot,) = read_sdf(text.encode(), "robot.sdf", context).values()
    assert [(frame.name, frame.link) for frame in robot.frames] == [("camera", "b"), ("lens", "b")]
    assert [finding.rule.code for finding in context.findings].count("sdf-frame") == 1
    T = ab.Arm(robot).fkine([0.3], frame="lens")
    expected = np.array([0.1 * np.cos(0.3) + 0.2 * np.sin(0.3), 0, 1 + 0.2 * np.cos(0.3) - 0.1 * np.sin(0.3)])
    assert T[:3, 3] == pytest.approx(expected, abs=1e-12)
    assert T[:3, :3] == pytest.approx(np.array(rotation_about((0, 1, 0), 0.8)), abs=1e-12)


def test_frames_keep_their_place_in_other_conventions() -> None:
    puma = ab.load_robot("puma560").robot
    frames = (
        NamedFrame(name="elbow", link=puma.links[2].name, pose=TURNED),
        NamedFrame(name="bench", pose=TURNED),
    )
    robot = replace(puma, frames=frames)
    changed = converted(robot, DhConvention.MODIFIED)
    q = np.random.default_rng(4).uniform(-1, 1, 6)
    for name in ("elbow", "bench"):
        expected = ab.Arm(robot).fkine(q, frame=name)
        assert ab.Arm(changed).fkine(q, frame=name) == pytest.approx(expected, abs=1e-12)
    again = converted(changed, DhConvention.STANDARD)
    assert ab.Arm(again).fkine(q, frame="bench") == pytest.approx(
        ab.Arm(robot).fkine(q, frame="bench"), abs=1e-12
    )


def test_frames_follow_a_renamed_link() -> None:
    frame = NamedFrame(name="camera", link="torso")
    assert frame.with_renamed_link("torso", "trunk").link == "trunk"
    assert frame.with_renamed_link("other", "trunk") is frame


def test_blocks_compute_the_pose_and_the_jacobian_of_a_frame() -> None:
    robot = two_armed()
    q = np.random.default_rng(5).uniform(-1, 1, robot.n)
    name = robot.frames[0].name
    arm = ab.Arm(robot)
    builder = ab.DiagramBuilder("frames")
    constant = builder.add("q", ab.blocks.Constant(value=q))
    for kind in (ab.blocks.Fkine, ab.blocks.Jacob0, ab.blocks.Jacobe):
        builder.add(kind.__name__, kind(robot=robot, frame=name), constant)
    builder.add("tool", ab.blocks.Fkine(robot=robot), constant)
    result = ab.simulate(builder.build(), stop_time=0.01)
    np.testing.assert_allclose(result["tool/T"][0], arm.fkine(q), atol=1e-14)
    np.testing.assert_allclose(result["Fkine/T"][0], arm.fkine(q, frame=name), atol=1e-14)
    np.testing.assert_allclose(result["Jacob0/J"][0], arm.jacob0(q, frame=name), atol=1e-14)
    np.testing.assert_allclose(result["Jacobe/J"][0], arm.jacobe(q, frame=name), atol=1e-14)
    with pytest.raises(UnknownNameError, match="no frame named 'nowhere'"):
        ab.blocks.Fkine(robot=robot, frame="nowhere")
