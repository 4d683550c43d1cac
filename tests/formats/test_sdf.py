"""The meaning of the elements of SDF, included files, and findings."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from test_sdf_semantics import INERTIAL, two

import armblocks as ab
from armblocks.errors import ArmblocksError, ArmblocksWarning, FormatError, UnknownNameError
from armblocks.formats import load_robot
from armblocks.formats.file_findings import FileContext
from armblocks.formats.sdf.reader import read_sdf
from armblocks.robot import Robot
from armblocks.robot.shapes import Box, Cylinder, Mesh, Sphere
from robots_for_tests import evaluate

Z = "<axis><xyz>0 0 1</xyz></axis>"


def read(text: str, context: FileContext | None = None) -> dict[str, Robot]:
    return dict(read_sdf(text.encode(), "r.sdf", context or FileContext()))


def one(text: str) -> Robot:
    return read(text)["r"]


def axis(limit: str = "", dynamics: str = "", more: str = "") -> str:
    parts = f"<limit>{limit}</limit><dynamics>{dynamics}</dynamics>{more}"
    return f"<axis><xyz>0 0 1</xyz>{parts}</axis>"


def test_limits_and_friction_are_those_of_the_axis() -> None:
    limit = "<lower>-1</lower><upper>2</upper><effort>30</effort><velocity>4</velocity>"
    robot = one(two(axis(limit, "<damping>0.5</damping><friction>3</friction>")))
    limits = robot.link("arm").joint.limits
    assert (limits.position, limits.speed, limits.torque) == ((-1.0, 2.0), 4.0, 30.0)
    assert_allclose(evaluate(robot, "friction", [2.0]), [4.0], rtol=1e-15)


@pytest.mark.parametrize(
    "limit",
    [
        "",
        "<lower>-1e16</lower><upper>1e16</upper><effort>-1</effort><velocity>-1</velocity>",
        "<lower>-inf</lower><upper>inf</upper><effort>inf</effort><velocity>INF</velocity>",
    ],
)
def test_unlimited_joints_have_no_limits(limit: str) -> None:
    limits = one(two(axis(limit))).link("arm").joint.limits
    assert (limits.position, limits.speed, limits.torque) == (None, None, None)
    assert one(two(axis("<lower>0</lower><upper>1</upper>"), kind="continuous")).qlim.tolist() == [
        [-math.inf, math.inf]
    ]


def test_shapes_of_visuals_are_drawn() -> None:
    shapes = (
        "<box><size>1 2 3</size></box>",
        "<sphere><radius>0.2</radius></sphere>",
        "<cylinder><radius>0.1</radius><length>2</length></cylinder>",
        "<capsule><radius>0.1</radius><length>2</length></capsule>",
        "<plane><normal>0 0 1</normal></plane>",
        "<empty/>",
    )
    visuals = "".join(
        f"<visual name='v{k}'><pose>0 0 {k} 0 0 0</pose><geometry>{s}</geometry></visual>"
        for k, s in enumerate(shapes)
    )
    context = FileContext()
    robot = read(two(Z).replace(INERTIAL, INERTIAL + visuals), context)["r"]
    assert context.findings == []
    box, sphere, cylinder, *capsule = robot.link("arm").geometry or ()
    assert isinstance(box, Box) and box.size == (1.0, 2.0, 3.0)
    assert isinstance(sphere, Sphere) and sphere.radius == 0.2 and sphere.pose[2][3] == 1.0
    assert isinstance(cylinder, Cylinder) and (cylinder.radius, cylinder.length) == (0.1, 2.0)
    assert [type(shape) for shape in capsule] == [Cylinder, Sphere, Sphere]
    assert one(two(Z)).link("arm").geometry is None


MESH = "<visual name='v'><geometry><mesh><uri>{}</uri><scale>.1 .1 .1</scale></mesh></geometry></visual>"
FOUND = [
    (two(""), "sdf-axis", "there is no <axis> with <xyz>; the z axis of the joint is used"),
    (
        two("<axis><xyz>0 0 2</xyz></axis>"),
        "sdf-axis",
        "the axis has the length 2; its direction is used",
    ),
    (
        two(axis("<lower>2</lower><upper>1</upper>")),
        "sdf-limit",
        "the lower limit 2 is above the upper limit 1; both are omitted",
    ),
    (
        two(axis("<effort>0</effort>")),
        "sdf-limit",
        "the effort limit is 0, with which the joint cannot move; it is omitted",
    ),
    (
        two(axis("", "<damping>-1</damping>")),
        "sdf-dynamics",
        "damping -1 and friction 0 would accelerate the joint; they are omitted",
    ),
    (
        two(axis("", "<spring_stiffness>-7</spring_stiffness>")),
        "sdf-spring",
        "the spring with the stiffness -7 is omitted",
    ),
    (
        two(axis(more="<mimic joint='k'/>")),
        "sdf-coupling",
        "it mimics joint 'k' with the multiplier 1; it stays independent",
    ),
    (
        two(
            Z,
            more='<joint name="g" type="gearbox"><parent>base</parent><child>arm</child></joint>',
        ),
        "sdf-coupling",
        "no revolute joint connects 'arm' with the reference body of the gearbox",
    ),
    (
        two(Z).replace(f"0 1.5707963267948966</pose>{INERTIAL}", "0 0</pose>"),
        "sdf-inertia-default",
        "the link has no <inertial>; the default of SDF, 1 kg and 1 kg m2, is used",
    ),
    (
        two(Z).replace("<inertial>", "<inertial auto='true'>", 1),
        "sdf-inertia-auto",
        "the inertia from the shapes is not computed; the numbers of the file or the defaults are used",
    ),
    (
        two(Z, more="").replace('<link name="arm">', '<link name="arm"><gravity>false</gravity>'),
        "sdf-gravity",
        "gravity is disabled for the link; in armblocks it acts on all links",
    ),
    (
        two(Z, more='<link name="ball"/>'),
        "sdf-free-link",
        "no joint connects the link with the others; it is fixed to the base",
    ),
    (
        two(Z, "1.6").replace("<pose>", '<pose frame="old">'),
        "sdf-frame",
        "there is no frame 'old'; the pose is read without it",
    ),
    (
        two(Z).replace("<pose>1 0 0 0 0 1.5707963267948966", "<pose>1 0 0 0 0 90"),
        "sdf-angle",
        "the pose is rotated by 0, 0, 90 rad, more than one turn; used as given",
    ),
    (two(Z + "<limits/>"), "sdf-unknown-element", "the element <limits> is not read"),
    (
        two(Z).replace(INERTIAL, INERTIAL + MESH.format("model://a/b.dae"), 1),
        "sdf-mesh",
        "the mesh 'model://a/b.dae' is not shown: the package 'a' is not found",
    ),
    (
        two(Z).replace(INERTIAL, INERTIAL + MESH.format("a.stl").replace("</mesh>", "<submesh/></mesh>"), 1),
        "sdf-mesh",
        "the mesh 'a.stl' is not shown: a part of a mesh file cannot be selected",
    ),
    (
        two(Z).replace(INERTIAL, f"{INERTIAL}<visual name='v'/>", 1),
        "sdf-shape",
        "it has no shape",
    ),
    (
        two(Z).replace(INERTIAL, f"{INERTIAL}<visual name='v'><geometry><cone/></geometry></visual>", 1),
        "sdf-shape",
        "the shape 'cone' is not supported",
    ),
    (
        two(Z).replace(
            INERTIAL,
            f"{INERTIAL}<visual name='v'><geometry><box><size>1 0 1</size></box></geometry></visual>",
            1,
        ),
        "sdf-shape",
        "the box has the size 0 m; it is omitted",
    ),
    (
        two(Z).replace(
            INERTIAL,
            f"{INERTIAL}<visual name='v'><geometry><box><size>1 1</size></box></geometry></visual>",
            1,
        ),
        "sdf-shape",
        "it is not shown: the element <size> has 2 values: '1 1'",
    ),
]


@pytest.mark.parametrize(("text", "code", "words"), FOUND, ids=[f"{f[1]}-{k}" for k, f in enumerate(FOUND)])
def test_what_is_not_read_as_written_is_a_finding_with_a_code(text: str, code: str, words: str) -> None:
    context = FileContext()
    read(text, context)
    (finding,) = context.findings
    assert (finding.rule.code, finding.what) == (code, words)
    assert finding.line >= 1 and finding.file == "r.sdf" and finding.element
    assert str(finding).endswith(f"[{code}]") and len(str(finding)) < 400


def test_every_model_of_a_world_is_a_robot_and_others_are_named() -> None:
    good = two(Z).partition(">")[2].removesuffix("</sdf>")
    wobble = good.replace('name="r"', 'name="b"').replace("revolute", "wobble")
    far = '<include><uri>model://far</uri></include><light name="sun"/>'
    context = FileContext()
    robots = read(f'<sdf version="1.9"><world name="w">{good}{wobble}{far}</world></sdf>', context)
    assert list(robots) == ["r"]
    assert [finding.rule.code for finding in context.findings] == ["sdf-model", "sdf-model"]
    assert [finding.element for finding in context.findings] == ["include", "model 'b'"]
    assert "the joint is of type 'wobble'" in context.findings[1].what
    two_models = f'<sdf version="1.9">{good}{good}</sdf>'
    with pytest.raises(FormatError, match="there is another element of this name in line 1"):
        read(two_models)


@pytest.fixture
def models(tmp_path: Path) -> Path:
    """A folder of models: an arm, and a hand of two versions, whose mesh is beside it."""
    (tmp_path / "hand" / "meshes").mkdir(parents=True)
    (tmp_path / "hand" / "meshes" / "a.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", encoding="utf-8"
    )
    (tmp_path / "hand" / "model.config").write_text(
        '<model><sdf version="1.4">old.sdf</sdf><sdf version="1.10">new.sdf</sdf></model>', encoding="utf-8"
    )
    visual = MESH.format("meshes/a.obj")
    (tmp_path / "hand" / "new.sdf").write_text(
        f'<sdf version="1.10"><model name="hand"><pose>9 9 9 0 0 0</pose>'
        f'<link name="palm">{INERTIAL}{visual}</link>'
        '<link name="finger"><pose relative_to="__model__">0 0 1 0 0 0</pose></link>'
        '<joint name="grip" type="prismatic"><parent>palm</parent><child>finger</child>'
        '<axis><xyz expressed_in="__model__">0 0 1</xyz></axis></joint></model></sdf>',
        encoding="utf-8",
    )
    (tmp_path / "arm").mkdir()
    return tmp_path


def arm_with_hand(attributes: str, palm: str) -> str:
    include = f"""<include{attributes}><uri>model://hand</uri><name>h</name>
    <pose relative_to="arm">0 0 3 {np.pi / 2!r} 0 0</pose></include>
    <joint name="wrist" type="fixed"><parent>arm</parent><child>{palm}</child></joint>"""
    return two(Z, more=include)


@pytest.mark.parametrize(
    ("attributes", "palm", "names"),
    [
        ("", "h::palm", ["base", "arm", "h::palm", "h::finger"]),
        (" merge='true'", "palm", ["base", "arm", "palm", "finger"]),
    ],
)
def test_included_models_are_nested_or_merged(
    models: Path, attributes: str, palm: str, names: list[str]
) -> None:
    file = models / "arm" / "model.sdf"
    file.write_text(arm_with_hand(attributes, palm), encoding="utf-8")
    with pytest.warns(ArmblocksWarning, match="sdf-inertia-default"):
        robot = load_robot(file)
    assert [link.name for link in robot.links] == names
    (mesh,) = robot.link(palm).geometry or ()
    assert isinstance(mesh, Mesh)
    # The frame of the arm is turned by 90 degrees about z, that of the hand in addition about x.
    assert_allclose(evaluate(robot, "fkine", [0.0, 0.5])[:3, 3], [1 + 1.5, 0, 3], atol=1e-15)


def test_models_that_include_themselves_and_missing_files_are_refused(models: Path) -> None:
    file = models / "arm" / "model.sdf"
    file.write_text(arm_with_hand("", "h::palm").replace("model://hand", "model://arm"), encoding="utf-8")
    with pytest.raises(FormatError, match="includes too many models, or they include themselves"):
        load_robot(file)
    file.write_text(arm_with_hand("", "h::palm").replace("model://hand", "model://foot"), encoding="utf-8")
    with pytest.raises(FormatError, match="'model://foot' is not read: the package 'foot' is not found"):
        load_robot(file)
    file.write_text(
        arm_with_hand("", "h::palm").replace("model://hand", "https://fuel/hand"), encoding="utf-8"
    )
    with pytest.raises(FormatError, match="files with 'https://' are not read"):
        load_robot(file)


def test_load_robot_selects_model_and_tip(tmp_path: Path) -> None:
    file = tmp_path / "r.sdf"
    model = two(Z).partition(">")[2].removesuffix("</sdf>")
    other = model.replace('name="r"', 'name="s"')
    file.write_text(f'<sdf version="1.9"><world name="w">{model}{other}</world></sdf>', encoding="utf-8")
    assert ab.load_robot(file, name="s").fkine([0.0])[0, 3] == 1.0
    assert ab.load_robot(file, name="s", tip="base").fkine([0.0])[0, 3] == 0.0
    with pytest.raises(ArmblocksError, match=r"the file defines 2 robots\. Allowed: r, s"):
        ab.load_robot(file)
    with pytest.raises(UnknownNameError):
        ab.load_robot(file, name="t")
