"""Robot files: round trip, agreement with the schema, and refused errors."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from armblocks.errors import ArmblocksError, ArmblocksWarning, FormatError, InertiaWarning, UnknownNameError
from armblocks.formats import load_robot, read_robot, robot_files, write_robot
from armblocks.formats.shipped import shipped_folder
from armblocks.robot import (
    JOINT_TYPES,
    DhConvention,
    DhRow,
    FrictionModel,
    Joint,
    JointLimits,
    Link,
    Motor,
    Prismatic,
    Robot,
    link_from_dh,
)
from armblocks.robot.shapes import Box, Cylinder, Housing, Material, Mesh, Sphere
from armblocks.spatial import Transform, transl, trotx, troty, trotz

SCHEMAS = Path(robot_files.__file__).parent / "schema"


@cache
def validator(kind: str) -> jsonschema.Draft202012Validator:
    schema = json.loads((SCHEMAS / f"{kind}.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


NUMBERS = st.floats(-1e3, 1e3)
POSITIVE = st.floats(1e-6, 1e3)
ANGLES = NUMBERS | st.integers(-360, 360).map(math.radians)
VECTORS = st.tuples(NUMBERS, NUMBERS, NUMBERS)
POSES = st.builds(
    lambda p, a, b, c: transl(*p) @ trotz(a) @ troty(b) @ trotx(c), VECTORS, ANGLES, ANGLES, ANGLES
)
LIMITS = st.builds(
    JointLimits,
    position=st.none() | st.tuples(ANGLES, ANGLES).map(lambda ends: (min(ends), max(ends))),
    speed=st.none() | POSITIVE,
    torque=st.none() | POSITIVE,
)
MOTORS = st.builds(
    Motor,
    inertia=st.floats(0, 1),
    gear_ratio=NUMBERS.filter(bool),
    viscous_friction=st.floats(0, 1),
    coulomb_friction=st.tuples(st.floats(0, 1), st.floats(-1, 0)),
)
SHAPES = st.sampled_from(
    [
        Cylinder(radius=0.1, length=0.5, bevel=0.01, material=Material.JOINT),
        Housing(start=(0.1, 0.2), end=(0.05, 0.05), length=0.4, roundness=0.3),
        Box(size=(1, 2, 3)),
        Sphere(radius=0.2, material=Material.FLANGE),
        Mesh(vertices=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), faces=((0, 1, 2),)),
    ]
)
BODY: dict[str, Any] = {
    "mass": st.floats(0, 100),
    "centre_of_mass": VECTORS,
    "inertia": st.tuples(*[NUMBERS] * 6),
    "motor": st.none() | MOTORS,
    "geometry": st.none() | st.lists(SHAPES, max_size=2).map(tuple),
}


@st.composite
def joints(draw: st.DrawFn) -> Joint:
    """Joints of all types with all their parameters; limits for each coordinate, or one for all."""
    kind = draw(st.sampled_from(JOINT_TYPES))
    axes = VECTORS.filter(any)
    values = {"axis": axes, "second_axis": axes, "offset": ANGLES, "pitch": NUMBERS.filter(bool)}
    joint = kind(**{name: draw(values[name]) for name in kind.parameters})
    if any(len(motion.positions) != len(motion.speeds) for motion in joint.motions):
        limits = LIMITS.map(lambda limit: replace(limit, position=None))
    else:
        limits = LIMITS
    several = st.tuples(*[limits] * joint.nv) if joint.nv else limits
    return replace(joint, limits=draw(limits | several))


@st.composite
def robots(draw: st.DrawFn) -> Robot:
    """Trees of all joint types, with and without D-H rows."""
    links: list[Link] = []
    for i in range(draw(st.integers(1, 4))):
        parent = draw(st.sampled_from([None, *(link.name for link in links)]))
        body = {key: draw(strategy) for key, strategy in BODY.items()}
        if draw(st.booleans()):
            dh = DhRow(
                alpha=draw(ANGLES),
                a=draw(NUMBERS),
                d=draw(NUMBERS),
                theta=draw(ANGLES),
                sigma=draw(st.integers(0, 1)),
                offset=draw(ANGLES),
                convention=draw(st.sampled_from(DhConvention)),
            )
            links.append(link_from_dh(f"l{i}", dh, parent=parent, limits=draw(LIMITS), **body))
        else:
            joint = draw(joints())
            body["inertia"] = link_from_dh("x", DhRow(), inertia=body["inertia"]).inertia
            links.append(
                Link(name=f"l{i}", parent=parent, joint=joint, before=draw(POSES), after=draw(POSES), **body)
            )
    return Robot(
        name=draw(st.text(st.characters(exclude_categories=["Cs"]), max_size=5)),
        manufacturer=draw(st.sampled_from(["", "KUKA"])),
        comment=draw(st.sampled_from(["", "čćž"])),
        links=tuple(links),
        base=draw(st.just(Transform()) | POSES),
        tool=draw(st.just(Transform()) | POSES),
        gravity=draw(VECTORS),
        friction_model=draw(st.sampled_from(FrictionModel)),
    )


@settings(max_examples=60, deadline=None, derandomize=True)
@given(robots())
def test_reading_a_written_robot_gives_the_same_robot(robot: Robot) -> None:
    data = write_robot(robot)
    reread = read_robot(data, "robot.json")
    assert reread == robot
    assert write_robot(reread) == data
    validator("robot").validate(json.loads(data))


def test_angles_are_written_in_degrees_if_the_conversion_is_exact() -> None:
    row = DhRow(alpha=math.pi / 2, offset=math.radians(-12.5), theta=0.1)
    robot = Robot(name="r", links=(link_from_dh("a", row),))
    dh = json.loads(write_robot(robot))["links"][0]["dh"]
    assert (dh["alpha"], dh["offset"], dh["theta"]) == ("90 deg", "-12.5 deg", 0.1)


def test_limits_of_a_prismatic_joint_are_in_metres() -> None:
    slider = Prismatic(limits=JointLimits(position=(0.0, math.pi), speed=math.pi), offset=math.pi)
    entry = json.loads(write_robot(Robot(name="r", links=(Link(name="a", joint=slider),))))["links"][0]
    assert entry["limits"] == {"position": [0, math.pi], "speed": math.pi}
    assert entry["joint"]["offset"] == math.pi


ROBOT: dict[str, Any] = {
    "format": 1,
    "name": "r",
    "links": [{"name": "a", "dh": {"convention": "standard", "a": 1}, "mass": 1}],
}
EXACT = object()


def with_change(*path: str | int, value: object = EXACT) -> bytes:
    """The robot above with one value replaced, or removed."""
    document = json.loads(json.dumps(ROBOT))
    node = document
    for step in path[:-1]:
        node = node[step]
    if value is EXACT:
        del node[path[-1]]
    else:
        node[path[-1]] = value
    return json.dumps(document, indent=1).encode()


LINK = ("links", 0)
INVALID_DOCUMENTS = [
    (with_change("format"), "the key 'format' is missing"),
    (with_change("format", value=2), r"the format version is 2. Allowed: 1. Fix: update armblocks"),
    (with_change("format", value=True), "the format version is True"),
    (with_change("name", value=3), "name: the value is the number 3"),
    (with_change("nmae", value="x"), "the key 'nmae' is not known here.*did you mean 'name'"),
    (with_change("links", value=[]), "robot 'r': the robot has no links"),
    (with_change("links", value=[ROBOT["links"][0]] * 2), "two links are named 'a'"),
    (with_change(*LINK, "parent", value="b"), "link 'a' has the parent 'b', which does not exist"),
    (with_change(*LINK, "mass", value=-1), "robot 'r', link 'a': the mass is -1 kg"),
    (with_change(*LINK, "mass", value="1,5"), "the value is the text '1,5'"),
    (
        with_change(*LINK, "mas", value=1),
        r"links\[0\].mas: the key 'mas' is not known here.*did you mean 'mass'",
    ),
    (with_change(*LINK, "joint", value={"type": "revolute"}), "the link has both 'dh' and 'joint'"),
    (with_change(*LINK, "dh", value={}), "the key 'convention' is missing"),
    (with_change(*LINK, "dh", "convention", value="craig"), "'craig' is not known here"),
    (with_change(*LINK, "dh", "joint", value="ball"), "'ball' is not known here"),
    (with_change(*LINK, "dh", "alpha", value="90"), "'90' is not an angle"),
    (with_change(*LINK, "dh", "alpha", value="90 deg/s"), "'90 deg/s' is not an angle"),
    (with_change(*LINK, "dh", "alpha", value="\u0669 deg"), "is not an angle"),
    (with_change(*LINK, "dh", "alpha", value="9" * 400 + " deg"), "is not an angle"),
    (with_change(*LINK, "limits", value={"position": [1]}), "1 limit is given"),
    (with_change("links", 0, value={"name": "a", "joint": {"type": "ball"}}), "'ball' is not known here"),
    (
        with_change("links", 0, value={"name": "a", "joint": {"type": "free", "axis": [1, 0, 0]}}),
        "'axis' is not known",
    ),
    (
        with_change("links", 0, value={"name": "a", "joint": {"type": "screw"}}),
        "the pitch of a screw joint is 0 m",
    ),
    (
        with_change("links", 0, value={"name": "a", "joint": {"type": "planar"}, "limits": [{}]}),
        "1 limit is given. Allowed: 3, one for each speed",
    ),
    (with_change(*LINK, "limits", value={"position": [1, 0]}), "the position limits are reversed"),
    (with_change(*LINK, "limits", value={"speed": "3 deg"}), "'3 deg' is not an angle"),
    (with_change(*LINK, "centre_of_mass", value=[1, 2]), "2 numbers are given"),
    (with_change(*LINK, "inertia", value={"ixx": 1}), "the key 'ixx' is not known here"),
    (with_change(*LINK, "motor", value={"gear_ratio": 0}), "the gear ratio is 0"),
    (with_change(*LINK, "geometry", value=[{"shape": "cone"}]), "'cone' is not known here"),
    (with_change(*LINK, "geometry", value=[{"shape": "box"}]), "the key 'size' is missing"),
    (
        with_change(*LINK, "geometry", value=[{"shape": "box", "radius": 1}]),
        "the key 'radius' is not known here",
    ),
    (
        with_change(*LINK, "geometry", value=[{"shape": "sphere", "radius": 1, "pose": [[1, 0, 0, 0]]}]),
        "1 row is given",
    ),
    (
        with_change(*LINK, "geometry", value=[{"shape": "mesh", "vertices": [], "faces": [[0, 1, 0.5]]}]),
        "a face is not a list of vertex numbers",
    ),
    (with_change("base", value={"rotation": [[1, 0, 0]]}), "1 row is given"),
    (
        with_change("base", value={"rotation": [[2, 0, 0], [0, 1, 0], [0, 0, 1]]}),
        "is not orthonormal",
    ),
    (with_change("friction_model", value="none"), "'none' is not known here. Allowed: squared-gear"),
    (with_change("links", value=[{"name": "a", "joint": {"type": "ball"}}]), "'ball' is not known here"),
    (
        with_change("links", value=[{"name": "a", "joint": {"type": "revolute", "axis": [0, 0, 0]}}]),
        "axis is zero",
    ),
]


@pytest.mark.parametrize(
    ("data", "message"), INVALID_DOCUMENTS, ids=[str(i) for i in range(len(INVALID_DOCUMENTS))]
)
def test_errors_name_file_line_and_key(data: bytes, message: str) -> None:
    with pytest.raises(FormatError, match=message) as caught:
        read_robot(data, "arm.json")
    assert caught.value.where.startswith("arm.json:")


def test_the_schema_refuses_most_invalid_files() -> None:
    """The rest are rules that compare values with each other or depend on more than a shape's type."""
    passed = [message for data, message in INVALID_DOCUMENTS if validator("robot").is_valid(json.loads(data))]
    assert len(passed) <= 12, passed


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.data())
def test_a_mutated_document_is_read_or_refused_with_a_package_error(data: st.DataObject) -> None:
    document = json.loads(write_robot(load_robot("puma560")))
    for _ in range(data.draw(st.integers(1, 3))):
        node: Any = document
        while True:
            keys = list(node) if isinstance(node, dict) else list(range(len(node)))
            if not keys:
                break
            key = data.draw(st.sampled_from(keys))
            if isinstance(node[key], dict | list) and data.draw(st.booleans()):
                node = node[key]
                continue
            node[key] = data.draw(
                st.sampled_from([None, True, -1, 1e300, 0, "", "x", [], {}, [1, 2, 3], "5 deg"])
            )
            break
    try:
        read_robot(json.dumps(document).encode(), "fuzz.json")
    except FormatError as error:
        assert error.where.startswith("fuzz.json")
    except ArmblocksWarning:
        pass  # warning about driving friction
    except ArmblocksError as error:
        pytest.fail(f"not located: {error}")


# -- names and paths ---------------------------------------------------------------------------------------


def test_user_files_warn_of_impossible_inertias_but_shipped_robots_do_not(tmp_path: Path) -> None:
    path = tmp_path / "mine.json"
    robot = load_robot("puma560")
    path.write_bytes(write_robot(robot))
    with pytest.warns(InertiaWarning) as caught:
        loaded = load_robot(path)
    assert "robot 'Puma 560', link 'link1': the link has inertia but no mass" in str(caught[0].message)
    assert len(caught) == 2
    assert loaded == robot
    assert (loaded.source, robot.source) == (str(path), "puma560")


def test_friction_model_of_a_file_can_be_replaced(tmp_path: Path) -> None:
    path = tmp_path / "r.JSON"
    path.write_bytes(write_robot(replace(load_robot("twolink"), friction_model=FrictionModel.RELEASE_6)))
    assert load_robot(str(path)).friction_model is FrictionModel.RELEASE_6
    assert (
        load_robot(path, friction_model=FrictionModel.SIGNED_GEAR).friction_model is FrictionModel.SIGNED_GEAR
    )


def test_the_error_for_an_unknown_name_suggests_the_nearest() -> None:
    with pytest.raises(
        UnknownNameError, match=r"there is no shipped robot named 'puma56'.*did you mean 'puma560'"
    ):
        load_robot("puma56")
    with pytest.raises(UnknownNameError, match="there is no robot named 'x'"):
        load_robot("kr180", name="x")
    assert load_robot("kr180", name="KR180") == load_robot("kr180")


def test_a_missing_file_raises_an_error_with_its_path() -> None:
    with pytest.raises(FormatError, match=r"nowhere/arm\.json: there is no such file"):
        load_robot("nowhere/arm.json")


def test_a_folder_is_refused_with_the_allowed_file_types(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"this is a folder.*Allowed: a robot file: \.json, \.m"):
        load_robot(tmp_path)


def test_unknown_suffix_is_refused() -> None:
    with pytest.raises(FormatError, match=r"'\.step' is not a suffix of a robot file.*MATLAB robot script"):
        load_robot("arms/ur5.step")


def test_oversized_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "big.m"
    path.write_bytes(b" " * (2**20 + 1))
    with pytest.raises(FormatError, match=r"the file has 1048577 bytes. Allowed: at most 1048576"):
        load_robot(path)


def test_an_incomplete_installation_raises_an_error() -> None:
    with pytest.raises(FormatError, match=r"the shipped songs are missing.*install armblocks again"):
        shipped_folder("songs")
