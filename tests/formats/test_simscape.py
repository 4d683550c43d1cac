"""CAD exports of Simscape Multibody: random robots as joints, as mates and as data files."""

from __future__ import annotations

import dataclasses
import time
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from simscape_files import Export

from armblocks.errors import ArmblocksError, ArmblocksWarning, FormatError
from armblocks.formats import load_robot
from armblocks.formats.file_findings import FileContext
from armblocks.formats.simscape.reader import read_import_xml, read_smi_data
from armblocks.robot import Robot, with_tip
from armblocks.robot.robot import STANDARD_GRAVITY
from armblocks.spatial import Transform
from robots_for_tests import build_random_tree, evaluate, random_states


def robot_of(seed: int) -> Robot:
    tree = build_random_tree(seed, 8, chain=seed % 3 == 0)
    links = tuple(dataclasses.replace(link, motor=None) for link in tree.links)
    return dataclasses.replace(tree, links=links, gravity=STANDARD_GRAVITY, tool=Transform())


def plain(name: str) -> str:
    """The name of the link without subassembly and number of the instance."""
    return name.rpartition("/")[2].removesuffix("-1")


def compare(
    robot: Robot, again: Robot, signs: dict[str, float], start: dict[str, float], tolerance: float
) -> None:
    """The equations at coordinates that are counted from ``start``, in the direction of ``signs``."""
    tip = robot.links[-1].name
    again = with_tip(again, next(link.name for link in again.links if plain(link.name) == tip))
    names = [plain(name) for name in again.joint_names]
    order = [robot.joint_names.index(name) for name in names]
    assert sorted(order) == list(range(robot.n))
    sign = np.array([signs[name] for name in names])
    q, qd, qdd = random_states(robot, 1)[0]
    theirs = (
        sign * (q[order] - np.array([start[name] for name in names])),
        sign * qd[order],
        sign * qdd[order],
    )

    def close(actual: np.ndarray, expected: np.ndarray) -> None:
        scale = max(1.0, float(np.abs(expected).max(initial=0.0)))
        assert_allclose(actual, expected, rtol=0, atol=tolerance * scale)

    close(evaluate(again, "fkine", theirs[0]), evaluate(robot, "fkine", q))
    close(evaluate(again, "rne", *theirs), sign * evaluate(robot, "rne", q, qd, qdd)[order])
    M = evaluate(robot, "inertia", q)[np.ix_(order, order)]
    close(evaluate(again, "inertia", theirs[0]), np.outer(sign, sign) * M)


@pytest.mark.parametrize("seed", range(6))
def test_joints_give_the_equations_of_the_robot(seed: int) -> None:
    robot = robot_of(seed)
    export = Export(robot, random_states(robot, 1)[0][0])
    context = FileContext()
    again = read_import_xml(export.xml().encode(), "arm.xml", context)
    assert {finding.rule.code for finding in context.findings} == {"simscape-geometry"}
    signs = {name: -1.0 if name in export.swapped else 1.0 for name in robot.joint_names}
    compare(robot, again, signs, dict.fromkeys(robot.joint_names, 0.0), 1e-11)


@pytest.mark.parametrize("seed", range(6))
def test_mates_give_the_equations_of_the_robot_from_the_assembled_position(seed: int) -> None:
    robot = robot_of(seed)
    q0 = random_states(robot, 1)[0][0]
    export = Export(robot, q0, mates=True)
    again = read_import_xml(export.xml().encode(), "arm.xml", FileContext())
    signs: dict[str, float] = {}
    for link in again.moving_links:
        name = link.name.rpartition("/")[2]
        parent = robot.link(name).parent or ""
        axis = (export.poses[parent] @ export.frames(name)[0])[:3, 2]
        # The axis of the file is in world axes; its largest component is positive.
        signs[name] = float(np.sign(axis[int(np.argmax(np.abs(axis)))]))
    compare(robot, again, signs, dict(zip(robot.joint_names, q0)), 1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_data_files_give_the_equations_of_the_robot(seed: int, tmp_path: Path) -> None:
    robot = robot_of(seed)
    export = Export(robot, np.zeros(robot.n))
    text = export.data_file()
    context = FileContext()
    again = read_smi_data(text.encode(), "arm_DataFile.m", context)
    assert not context.findings and again.name == "arm"
    signs = {name: -1.0 if name in export.swapped else 1.0 for name in robot.joint_names}
    compare(robot, again, signs, dict.fromkeys(robot.joint_names, 0.0), 1e-11)


def test_the_content_decides_between_formats_of_one_suffix(tmp_path: Path) -> None:
    robot = robot_of(0)
    export = Export(robot, np.zeros(robot.n))
    (tmp_path / "arm.xml").write_text(export.xml().replace("utf-8", "utf-16"), encoding="utf-16")
    (tmp_path / "arm_DataFile.m").write_text(export.data_file(), encoding="utf-8")
    assert load_robot(tmp_path / "arm_DataFile.m").n == robot.n
    with pytest.warns(ArmblocksWarning, match="8 geometry files are not shown"):
        assert load_robot(tmp_path / "arm.xml").n == robot.n


def part(uid: str, mass: str = "1") -> str:
    return (
        f'<Part name="{uid}" uid="{uid}"><MassProperties><Mass>{mass}</Mass>'
        "<CenterOfMass>0 0 0</CenterOfMass><Inertia>1 1 1 0 0 0</Inertia></MassProperties></Part>"
    )


PARTS = f"<Parts>{part('p')}{part('r')}</Parts>"
TWO = '<Instance name="a" uid="a" entityUid="p" grounded="true"/><Instance name="b" uid="b" entityUid="r"/>'


def assembly(
    inside: str = "", *, instances: str = TWO, parts: str = PARTS, units: str = 'mass="kg" length="m"'
) -> str:
    return (
        f'<SimMechanicsImportXML version="1.0"><DataUnits {units}/><RootAssembly name="x" uid="x">'
        f"<InstanceTree>{instances}</InstanceTree>{inside}</RootAssembly>{parts}</SimMechanicsImportXML>"
    )


def joint(kind: str, base: str = "a", follower: str = "b", frame: str = "") -> str:
    ends = "".join(
        f"<{tag}><InstancePath><Uid>{uid}</Uid></InstancePath>{frame if tag == 'BaseFrame' else ''}</{tag}>"
        for tag, uid in (("BaseFrame", base), ("FollowerFrame", follower))
    )
    return f'<Joints><{kind} name="j">{ends}</{kind}></Joints>'


def mate(kind: str, first: str, second: str, axes: tuple[str, str] = ("0 0 1", "0 0 1")) -> str:
    ends = "".join(
        f'<ConstraintGeometry geomType="{geometry}"><InstancePath><Uid>{uid}</Uid></InstancePath>'
        f"<Position>0 0 0</Position><Axis>{axis}</Axis></ConstraintGeometry>"
        for geometry, uid, axis in zip((first, second), "ab", axes)
    )
    return f'<{kind} name="m">{ends}</{kind}>'


def mates(*texts: str) -> str:
    return assembly(f"<Constraints>{''.join(texts)}</Constraints>")


PLANE = ("plane", "plane")
REFUSED = [
    ("<a>", "not well-formed XML"),
    ("<mujoco/>", "the root element is <mujoco>"),
    ("<PhysicalModelingXMLFile/>", "the first generation of SimMechanics Link"),
    ('<!DOCTYPE a [<!ENTITY b "c">]><SimMechanicsImportXML/>', "a document type or entities"),
    ("<SimMechanicsImportXML/>", "there is no <RootAssembly>"),
    (assembly(units='mass="stone" length="m"'), "the unit of mass is 'stone'"),
    (assembly(instances=""), "the assembly has no parts"),
    (assembly(instances='<Instance uid="a" entityUid="q"/>'), "there is no part 'q'"),
    (
        assembly(instances=TWO + '<Instance uid="a" entityUid="p"/>'),
        "there is another instance with this uid",
    ),
    (assembly(parts=f"<Parts>{part('p', '-1')}{part('r')}</Parts>"), "the mass is -1 kg"),
    (assembly(parts=f"<Parts>{part('p', 'nan')}{part('r')}</Parts>"), "'nan', which is not a number"),
    (assembly(joint("Spherical")), "is of type 'Spherical', which is not supported [simscape-joint]"),
    (assembly(joint("PinSlot")), "is of type 'PinSlot', which is not supported [simscape-joint]"),
    (assembly(joint("Revolute", "a", "c")), "there is no instance 'c'"),
    (assembly("<Joints><Revolute/></Joints>"), "the joint has no <BaseFrame>"),
    (assembly(joint("Revolute") + joint("Revolute", "b", "a")), "close a loop [simscape-loop]"),
    (assembly(joint("Revolute") + joint("Weld")), "close a loop [simscape-loop]"),
    (
        assembly(joint("Weld", frame="<Transform><Rotation>1 1 0 0 1 0 0 0 1</Rotation></Transform>")),
        "the nine numbers are not a rotation",
    ),
    (
        mates(mate("Coincident", *PLANE)),
        "leave 3 degrees of freedom, which is not supported [simscape-joint]",
    ),
    (mates(mate("Concentric", "line", "line")), "leave 2 degrees of freedom"),
    (mates(mate("Coincident", "point", "point")), "leave 3 degrees of freedom"),
    (mates(mate("Coincident", "plane", "plane", ("0 0 0", "0 0 1"))), "the axis is zero"),
]


@pytest.mark.parametrize(("text", "words"), REFUSED, ids=[words[:50] for _, words in REFUSED])
def test_invalid_exports_are_refused_with_file_line_and_reason(text: str, words: str) -> None:
    with pytest.raises(ArmblocksError) as refused:
        read_import_xml(text.encode(), "x.xml", FileContext())
    message = str(refused.value)
    assert words in message and message.startswith("x.xml") and "Fix: " in message and len(message) < 400


def found(text: str) -> tuple[Robot, list[str]]:
    context = FileContext()
    robot = read_import_xml(text.encode(), "x.xml", context)
    return robot, [finding.rule.code for finding in context.findings]


def test_parts_without_connection_mass_or_agreeing_frames_are_found() -> None:
    robot, codes = found(assembly())
    assert codes == ["simscape-free"] and robot.n == 0
    assert [link.name for link in robot.links] == ["a", "b"]
    shifted = "<Transform><Translation>0 0 1</Translation></Transform>"
    robot, codes = found(assembly(joint("Revolute", frame=shifted)))
    assert codes == ["simscape-frames"] and robot.joint_names == ("b",)
    # The assembled position is kept: b stays at the origin, and turns about the axis of the base frame.
    assert_allclose(evaluate(robot, "fkine", [0.0]), np.eye(4), atol=1e-15)
    assert found(assembly(joint("Prismatic", frame=shifted)))[1] == []
    assert "simscape-mass" in found(assembly(parts='<Parts><Part uid="p"/><Part uid="r"/></Parts>'))[1]
    assert "simscape-units" in found(assembly().replace('<DataUnits mass="kg" length="m"/>', ""))[1]


@pytest.mark.parametrize(
    ("texts", "letters"),
    [
        ((mate("Concentric", "cylinder", "circle"), mate("Distance", *PLANE)), "R"),
        ((mate("Concentric", "line", "line"), mate("Angle", *PLANE, ("1 0 0", "0 1 0"))), "P"),
        ((mate("Coincident", *PLANE), mate("Coincident", *PLANE, ("0 1 0", "0 1 0"))), "P"),
        (
            (mate("Coincident", "point", "line"), mate("Parallel", "line", "line"), mate("Distance", *PLANE)),
            "R",
        ),
        ((mate("Coincident", "point", "point"), mate("Perpendicular", "line", "plane")), "R"),
        ((mate("Coincident", "point", "point"), mate("Parallel", "line", "plane", ("1 0 0", "0 0 1"))), ""),
        ((mate("Lock", *PLANE),), ""),
        (tuple(mate("Coincident", *PLANE, (axis, axis)) for axis in ("1 0 0", "0 1 0", "0 0 1")), ""),
    ],
)
def test_combinations_of_mates_leave_their_joint(texts: tuple[str, ...], letters: str) -> None:
    if letters == "" and "Parallel" in texts[-1]:
        with pytest.raises(FormatError, match="leave 2 degrees of freedom"):
            found(mates(*texts))
        return
    robot, codes = found(mates(*texts))
    assert robot.joint_letters == letters and codes == []


def test_mates_that_are_not_known_are_found() -> None:
    known = (mate("Concentric", "line", "line"), mate("Coincident", *PLANE))
    for text in (
        mate("Tangent", *PLANE),
        mate("Coincident", "spline", "line"),
        mate("Distance", "line", "line"),
    ):
        robot, codes = found(mates(*known, text))
        assert codes == ["simscape-mate"] and robot.joint_letters == "R"


def test_welds_inside_a_group_may_be_redundant_and_rigid_subassemblies_are_one_body() -> None:
    inner = '<Instance uid="c" entityUid="p"/><Instance uid="d" entityUid="r"/>'
    instances = f'<Instance uid="s" entityUid="q" rigid="true" grounded="true">{inner}</Instance>'
    assemblies = '<Assemblies><Assembly uid="q"/></Assemblies>'
    weld = (
        joint("Weld")
        .replace("<Uid>a</Uid>", "<Uid>s</Uid><Uid>c</Uid>")
        .replace("<Uid>b</Uid>", "<Uid>s</Uid><Uid>d</Uid>")
    )
    robot, codes = found(assembly(weld, instances=instances, parts=PARTS + assemblies))
    assert codes == [] and [link.name for link in robot.links] == ["s/c", "s/d"]
    grouped = TWO.replace('uid="a"', 'uid="a" rigidGroup="g"').replace('uid="b"', 'uid="b" rigidGroup="g"')
    assert found(assembly(instances=grouped))[1] == []


DATA = "smiData.RigidTransform(1).translation = [0 0 0]; % mm\nsmiData.RigidTransform(1).angle = 0; % rad\n"
DATA += "smiData.RigidTransform(1).axis = [0 0 0];\nsmiData.RigidTransform(1).ID = 'B[a-1:-:b-1]';\n"
BOTH = DATA + DATA.replace("(1)", "(2)").replace("'B[", "'F[")
REFUSED_DATA = [
    (DATA, "has only one of its transforms"),
    (DATA.replace("mm", "furlong"), "the unit is 'furlong'"),
    (DATA.replace("[0 0 0]; %", "[0 nan 0]; %"), "'[0 nan 0]' is not 3 numbers"),
    (DATA.replace("[0 0 0]; %", "[0 1e999 0]; %"), "is too large"),
    (DATA.replace(".angle = 0", ".angle = system('rm')"), "is not 1 number"),
    (DATA.replace(".axis", ".other"), "the entry has no field 'axis'"),
    (DATA.replace("(1)", "(999999)"), "the table has an entry 999999"),
    (
        BOTH + "smiData.SphericalJoint(1).ID = '[a-1:-:b-1]';\n",
        "is a SphericalJoint, not supported [simscape-joint]",
    ),
    (
        BOTH
        + BOTH.replace("a-1:-:b-1", "b-1:-:a-1").replace("(1)", "(3)").replace("(2)", "(4)")
        + "smiData.RevoluteJoint(1).ID = '[a-1:-:b-1]';\n",
        "close a loop [simscape-loop]",
    ),
    ("smiData.RigidTransform(1).ID = '';", "the assembly has no parts"),
]


@pytest.mark.parametrize(("text", "words"), REFUSED_DATA, ids=[words[:50] for _, words in REFUSED_DATA])
def test_invalid_data_files_are_refused(text: str, words: str) -> None:
    with pytest.raises(FormatError) as refused:
        read_smi_data(text.encode(), "x_DataFile.m", FileContext())
    message = str(refused.value)
    assert (
        words in message and message.startswith("x_DataFile.m") and "Fix: " in message and len(message) < 400
    )


def test_parts_whose_solid_is_not_known_are_found() -> None:
    context = FileContext()
    text = (
        BOTH
        + "smiData.RigidTransform(3).translation = [0 0 5]; % cm\n"
        + "smiData.RigidTransform(3).angle = 0; % rad\n"
    )
    text += "smiData.RigidTransform(3).axis = [0 0 1];\nsmiData.RigidTransform(3).ID = 'RootGround[a-1]';\n"
    text += "smiData.RevoluteJoint(1).ID = '[a-1:-:b-1]';\n"
    robot = read_smi_data(text.encode(), "x_DataFile.m", context)
    assert [finding.rule.code for finding in context.findings] == ["simscape-mass"] * 2
    assert robot.joint_names == ("b-1",)
    assert_allclose(evaluate(robot, "fkine", [0.0])[:3, 3], [0, 0, 0.05], atol=1e-15)


def test_parts_that_move_freely_are_fixed_at_their_pose() -> None:
    context = FileContext()
    text = DATA.replace("B[a-1:-:b-1]", "SixDofRigidTransform[a-1]").replace(
        "[0 0 0]; % mm", "[0 20 0]; % mm"
    )
    robot = read_smi_data(text.encode(), "x_DataFile.m", context)
    assert [finding.rule.code for finding in context.findings] == ["simscape-mass", "simscape-free"]
    assert_allclose(robot.link("a-1").before.translation, [0, 0.02, 0], atol=1e-15)


def test_a_path_may_begin_with_the_assembly_itself() -> None:
    text = assembly(joint("Revolute", "x")).replace(
        'uid="a" entityUid="p" grounded="true"', 'uid="a" entityUid="p"'
    )
    robot, codes = found(text)
    assert robot.joint_names == ("b",) and robot.link("b").parent is None and codes == ["simscape-free"]


def test_many_redundant_mates_are_read_in_bounded_time() -> None:
    began = time.process_time()
    pair = (mate("Concentric", "line", "line"), mate("Coincident", *PLANE))
    robot, codes = found(mates(*(pair * 3000)))
    assert robot.joint_letters == "R" and codes == []
    with pytest.raises(FormatError, match="the assembly has too many mates"):
        found(mates(*(pair * 5001)))
    assert time.process_time() - began < 60
