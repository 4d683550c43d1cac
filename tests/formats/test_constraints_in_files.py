"""Constraints in MJCF and SDF files: reading and writing them; MuJoCo's own equations of the same file."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace

import mujoco
import numpy as np
import pytest

import armblocks as ab
from armblocks.dynamics import trace_constrained_motion
from armblocks.dynamics.mechanism import Mechanism
from armblocks.errors import ArmblocksWarning, FormatError
from armblocks.formats.file_findings import FileContext
from armblocks.formats.mjcf.reader import read_mjcf
from armblocks.formats.mjcf.writer import write_mjcf
from armblocks.formats.sdf.reader import read_sdf
from armblocks.formats.sdf.writer import write_sdf
from armblocks.robot import (
    Attachment,
    Closure,
    Coupling,
    PrismaticClosure,
    RevoluteClosure,
    Robot,
    Rod,
    SphericalClosure,
    UniversalClosure,
    WeldClosure,
)
from armblocks.spatial import Transform, rotation_about, transl
from mechanisms_for_tests import bricard, four_bar, parallelograms, slider_crank

LEG = """<body name="{n}" pos="{x} 0 0" euler="0 10 0">
  <joint name="{n}1" axis="0 1 0" ref="5"/><geom size="0.1"/>
  <body name="{n}b" pos="0 0 0.5"><joint name="{n}2" axis="0 1 0.1"/><joint name="{n}3" axis="1 0 0"/>
  <geom size="0.1"/><body name="{n}c" pos="0 0 0.2"><joint name="{n}4" axis="0 0 1"/>
  <geom size="0.1 0.1 0.2" type="box"/>
  <site name="{n}s" pos="0.1 0 0.3" euler="0 0 20"/></body></body></body>"""
MJCF = """<mujoco><compiler autolimits="true"/><worldbody>{legs}</worldbody>
  <actuator><motor joint="a1"/></actuator>
  <equality>{equality}</equality></mujoco>"""
EQUALITIES = {
    "connect by bodies": "<connect body1='ab' body2='bb' anchor='0.1 0.2 0.4'/>",
    "connect to the world": "<connect body1='ab' anchor='0.3 0.1 0.3'/>",
    "connect by sites": "<connect site1='as' site2='bs'/>",
    "weld by bodies": "<weld body1='ab' body2='bb'/>",
    "weld with a pose": "<weld body1='ac' body2='bc' relpose='0.4 0.05 0.1 1 0.1 0.1 0.2'/>",
    "weld with a pose and an anchor": (
        "<weld body1='ac' body2='bc' relpose='0.4 0.05 0.1 1 0.1 0.1 0.2' anchor='0.1 0.05 0.1'/>"
    ),
    "weld with an anchor": "<weld body1='ab' body2='bb' anchor='0.1 0.2 0.4'/>",
    "weld without moments": (
        "<weld body1='ab' body2='bb' relpose='0.4 0 0 1 0 0 0' anchor='0 0 0.1' torquescale='0'/>"
    ),
    "weld by sites": "<weld site1='as' site2='bs'/>",
    "joint": "<joint joint1='a1' joint2='b1' polycoef='0.1 -2 0 0 0'/>",
    "fixed joint": "<joint joint1='b2' polycoef='0.2 0 0 0 0'/>",
    "of two dependent joints": (
        "<joint joint1='a1' joint2='a2' polycoef='0.1 2 0 0 0'/><joint joint1='b1' joint2='b2'/>"
        "<joint joint1='a1' joint2='b1' polycoef='0.2 -1 0 0 0'/>"
    ),
    "opposite signs": (
        "<joint joint1='a1' joint2='b1'/><joint joint1='b1' joint2='a1' polycoef='0.3 -1 0 0 0'/>"
    ),
    "both ways": "<joint joint1='a1' joint2='b1'/><joint joint1='a1' joint2='b2' polycoef='0 3 0 0 0'/>",
}


def mjcf(equality: str) -> str:
    legs = "".join(LEG.format(n=name, x=x) for name, x in (("a", 0), ("b", 0.6)))
    return MJCF.format(legs=legs, equality=equality)


@pytest.mark.parametrize("equality", EQUALITIES.values(), ids=EQUALITIES)
def test_equality_constraints_are_those_of_mujoco(equality: str) -> None:
    """At a state that satisfies the constraints of the robot, MuJoCo's are satisfied, and the motions agree.

    The reference: MuJoCo's mass matrix, bias and Jacobian, with exact constraints by least squares.
    """
    context = FileContext()
    robot = read_mjcf(mjcf(equality).encode(), "robot.xml", context)
    assert not context.findings and len(robot.constraints) == equality.count("<")
    mechanism, random = Mechanism(robot), np.random.default_rng(1)
    q = mechanism.assembled(random.uniform(-0.3, 0.3, robot.n))
    qd = mechanism.consistent_speeds(q, random.normal(size=robot.n))
    C = robot.coordinate_map.speeds
    offsets = [robot.coordinate_map.offsets.get(link.name, 0.0) for link in robot.tree_links]
    tree_q = robot.coordinate_map.positions @ q + offsets
    model = mujoco.MjModel.from_xml_string(mjcf(equality))
    data = mujoco.MjData(model)
    # The links of the robot are in the order of MuJoCo's joints, except for the tip.
    order = [model.joint(name).qposadr[0] for name in _joints(robot)]
    data.qpos[order], data.qvel[order] = tree_q, C @ qd
    mujoco.mj_forward(model, data)
    rows = data.efc_type[: data.nefc] == mujoco.mjtConstraint.mjCNSTR_EQUALITY
    J = data.efc_J.reshape(data.nefc, model.nv)[rows]
    assert np.abs(data.efc_pos[: data.nefc][rows]).max() < 1e-10
    assert np.abs(J @ data.qvel).max() < 1e-9
    tau = random.normal(size=robot.n)
    (qdd,) = trace_constrained_motion(robot, near=q)(q, qd, tau)[2:3]
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    step = 1e-6
    ahead, behind = (_jacobian(model, tree_q + s * step * (C @ qd), order)[: len(J)] for s in (1, -1))
    drift = (ahead - behind) @ data.qvel / (2 * step)
    force = np.zeros(model.nv)
    force[order] = np.linalg.pinv(C).T @ tau
    system = np.block([[M, J.T], [J, np.zeros((len(J), len(J)))]])
    right = np.concatenate((force - data.qfrc_bias, -drift))
    expected = np.linalg.lstsq(system, right, rcond=1e-9)[0][: model.nv][order]
    assert C @ qdd == pytest.approx(expected, abs=1e-5 * max(1.0, np.abs(expected).max()))


def _joints(robot: Robot) -> list[str]:
    """The names of MuJoCo's joints in the order of the robot's links."""
    of_link = {
        "a": "a1",
        "ab joint": "a2",
        "ab": "a3",
        "ac": "a4",
        "b": "b1",
        "bb joint": "b2",
        "bb": "b3",
        "bc": "b4",
    }
    return [of_link.get(link.name, link.name) for link in robot.tree_links]


def _jacobian(model: mujoco.MjModel, tree_q: np.ndarray, order: list[int]) -> np.ndarray:
    data = mujoco.MjData(model)
    data.qpos[order] = tree_q
    mujoco.mj_forward(model, data)
    return data.efc_J.reshape(data.nefc, model.nv).copy()


@pytest.mark.parametrize(
    ("equality", "reason"),
    [
        ("<joint joint1='a1' joint2='b1' polycoef='0 1 2 0 0'/>", "its polynomial is not linear"),
        ("<joint joint1='a1' joint2='zz'/>", "there is no hinge or slide named 'zz'"),
        ("<joint joint1='a1' joint2='a1'/>", "both joints are the same"),
        ("<connect body1='ab' body2='zz' anchor='0 0 0'/>", "a body does not exist"),
        ("<weld site1='as' site2='zz'/>", "a site does not exist"),
        ("<weld body1='ab' body2='ab'/>", "both frames are on the same body"),
        ("<tendon tendon1='t'/>", "only constraints of bodies and of two joints are supported"),
        (
            "<joint joint1='a1'/><joint joint1='a1'/>",
            "the coupling follows from other constraints; it is omitted",
        ),
        (
            "<joint joint1='a1' joint2='b1'/><joint joint1='b1' joint2='a1' polycoef='0.3 1 0 0 0'/>",
            "the coupling contradicts other constraints, by 0.3 rad or m; it is omitted",
        ),
        (
            "<joint joint1='a1'/><joint joint1='a1' polycoef='0.25 0 0 0 0'/>",
            "the coupling contradicts other constraints, by 0.25 rad or m; it is omitted",
        ),
    ],
)
def test_other_equality_constraints_are_findings(equality: str, reason: str) -> None:
    context = FileContext()
    robot = read_mjcf(mjcf(equality).encode(), "robot.xml", context)
    (finding,) = context.findings
    assert finding.rule.code == "mjcf-equality" and reason in finding.what
    assert len(robot.constraints) == equality.count("<") - 1


def test_inactive_and_mocap_constraints_do_not_hold_the_robot() -> None:
    context = FileContext()
    text = mjcf("<weld body1='hand' body2='ab'/><connect active='false' body1='ab' anchor='0 0 0'/>")
    text = text.replace("</worldbody>", "<body name='hand' mocap='true'/></worldbody>")
    robot = read_mjcf(text.encode(), "robot.xml", context)
    assert robot.constraints == () and [finding.rule.code for finding in context.findings] == [
        "mjcf-equality"
    ]
    assert "moved by the user" in context.findings[0].what
    default = "<default><equality active='false'/></default><worldbody>"
    inactive = mjcf("<weld body1='ab'/>").replace("<worldbody>", default)
    assert read_mjcf(inactive.encode(), "robot.xml", FileContext()).constraints == ()


def test_joints_of_actuators_have_the_motors_of_a_mechanism() -> None:
    """The joints of actuators have motors only if they are as many as the degrees of freedom."""
    robot = read_mjcf(mjcf(EQUALITIES["connect by bodies"]).encode(), "robot.xml", FileContext())
    assert [link.name for link in robot.links if link.motor is not None] == ["a"]
    tree = read_mjcf(mjcf("").encode(), "robot.xml", FileContext())
    assert all(link.motor is None for link in tree.links)


def same_motion(first: Robot, second: Robot, q: np.ndarray) -> None:
    """Both have the same accelerations at states that satisfy the constraints."""
    random = np.random.default_rng(2)
    order = [second.joint_names.index(name) for name in first.joint_names]
    qd = Mechanism(first).consistent_speeds(q, random.normal(size=first.n))
    tau = random.normal(size=first.n)
    back = np.argsort(order)
    expected = trace_constrained_motion(first, near=q)(q, qd, tau)[2]
    found = trace_constrained_motion(second, near=q[back])(q[back], qd[back], tau[back])[2]
    assert found[order] == pytest.approx(expected, abs=1e-8 * max(1.0, np.abs(expected).max()))


def written(robot: Robot, format: str) -> Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ArmblocksWarning)
        if format == "MJCF":
            return read_mjcf(write_mjcf(robot), "r.xml", FileContext())
        (copy,) = read_sdf(write_sdf(robot), "r.sdf", FileContext()).values()
        return copy


@pytest.mark.parametrize("format", ["MJCF", "SDF"])
@pytest.mark.parametrize("build", [four_bar, slider_crank, bricard, lambda: parallelograms(2)])
def test_loops_written_and_read_have_the_same_motion(build, format: str) -> None:  # type: ignore[no-untyped-def]
    robot = replace(build(), base=transl(0.1, 0.2, 0.3))
    q = Mechanism(robot).assembled(np.zeros(robot.n))
    same_motion(robot, written(robot, format), q)


@pytest.mark.parametrize("format", ["MJCF", "SDF"])
def test_palletisers_written_and_read_have_the_same_equations(format: str) -> None:
    """Mimic joints of one leader; the couplings of two joints in a palletiser are not in these formats."""
    robot = ab.load_robot("irb660").robot
    with pytest.raises(FormatError, match="'parallel upper arm', a coupling, is not part of"):
        written(robot, format)
    pairs = tuple(coupling for coupling in robot.couplings if len(coupling.terms) == 2)
    robot = replace(robot, constraints=pairs)
    copy = written(robot, format)
    assert set(copy.joint_names) == set(robot.joint_names)
    same_motion(robot, copy, np.full(robot.n, 0.2))
    assert ab.Arm(copy).fkine(np.full(robot.n, 0.2)) == pytest.approx(
        ab.Arm(robot).fkine(np.full(robot.n, 0.2))
    )


def two_rods(kind: type[Closure]) -> Robot:
    """The four-bar linkage with three more joints; the closure is closed with all joints at zero."""
    robot = four_bar()
    links = list(robot.links)
    for k, (axis, joint) in enumerate(
        (((1, 0, 0), ab.Revolute), ((0, 1, 0), ab.Revolute), ((0, 0, 1), ab.Prismatic))
    ):
        links.append(
            ab.Link(
                name=f"more{k}", parent=links[-1].name, joint=joint(axis=axis), mass=0.5, inertia=(0.02,) * 3
            )
        )
    chain = Robot(name="chain", links=tuple(links))
    poses = chain_poses(chain)
    frame = Transform(rotation=rotation_about((0.6, 0.8, 0.0), 0.7), translation=(0.2, 0.1, 0.0))
    first = poses["coupler"].inverse() @ poses["more2"] @ frame
    closure = kind(
        name="loop", first=Attachment(link="coupler", pose=first), second=Attachment(link="more2", pose=frame)
    )
    return replace(chain, constraints=(closure,))


def chain_poses(robot: Robot) -> dict[str, Transform]:
    poses: dict[str | None, Transform] = {None: Transform()}
    for link in robot.links:
        poses[link.name] = poses[link.parent] @ link.pose()
    return {name: pose for name, pose in poses.items() if name is not None}


@pytest.mark.parametrize(
    ("format", "kind"),
    [
        *(("MJCF", kind) for kind in (WeldClosure, SphericalClosure, RevoluteClosure)),
        *(("SDF", kind) for kind in (WeldClosure, SphericalClosure, RevoluteClosure, PrismaticClosure)),
    ],
)
def test_every_closure_of_a_format_is_written(format: str, kind: type[Closure]) -> None:
    robot = two_rods(kind)
    same_motion(robot, written(robot, format), np.zeros(robot.n))


def test_a_cardan_joint_closes_a_loop_of_sdf() -> None:
    robot = two_rods(UniversalClosure)
    (loop,) = robot.closures
    across = Transform(rotation=rotation_about((1, 0, 0), 0.0))
    robot = replace(
        robot, constraints=(replace(loop, second=replace(loop.second, pose=loop.second.pose @ across)),)
    )
    same_motion(robot, written(robot, "SDF"), np.zeros(robot.n))


def test_other_closures_are_refused_with_those_of_the_format() -> None:
    (pin,) = four_bar().closures
    rod = replace(four_bar(), constraints=(Rod(name="rod", first=pin.first, second=pin.second, length=0.1),))
    with pytest.raises(FormatError, match="'rod', a rod closure, is not part of MJCF"):
        write_mjcf(rod)
    with pytest.raises(FormatError, match="not part of SDF") as caught:
        write_sdf(rod)
    assert "revolute, prismatic, spherical, weld, universal" in str(caught.value)


def test_sdf_requires_loops_that_are_closed_at_zero() -> None:
    robot = four_bar()
    moved = robot.with_link("crank", joint=robot.link("crank").joint.with_offset(0.3))
    with pytest.raises(FormatError, match="constraint 'pin' is not satisfied with all joints at zero"):
        write_sdf(moved)
    same_motion(moved, written(moved, "MJCF"), np.array([-0.3, 0.0, 0.0]))


LINK = "<link name='{0}'><inertial><mass>1</mass></inertial></link>"
JOINT = "<joint name='{0}' type='{1}'><parent>{2}</parent><child>{3}</child>{4}</joint>"
AXIS = "<axis><xyz>{0}</xyz>{1}</axis>"


def sdf(*parts: str) -> Robot:
    context = FileContext()
    text = f"<sdf version='1.11'><model name='m'>{''.join(parts)}</model></sdf>"
    (robot,) = read_sdf(text.encode(), "r.sdf", context).values()
    assert not [finding for finding in context.findings if "coupling" in finding.rule.code]
    return robot


def test_mimic_joints_of_sdf_have_no_coordinate() -> None:
    """q = multiplier (q_leader - reference) + offset, also for a leader with two axes."""
    numbers = "<multiplier>-2</multiplier><offset>0.5</offset><reference>0.1</reference>"
    mimic = f"<mimic joint='j' axis='{{0}}'>{numbers}</mimic>"
    for axis, kind in (("axis", "revolute"), ("axis2", "universal")):
        second = "<axis2><xyz>1 0 0</xyz></axis2>" if kind == "universal" else ""
        robot = sdf(
            *(LINK.format(name) for name in "abc"),
            JOINT.format("j", kind, "a", "b", AXIS.format("0 0 1", "") + second),
            JOINT.format("k", "revolute", "b", "c", AXIS.format("0 1 0", mimic.format(axis))),
        )
        (coupling,) = robot.couplings
        assert coupling.terms == (("c", 1.0), ("b", 2.0)) and coupling.constant == pytest.approx(0.7)


def test_gearboxes_of_sdf_couple_the_joints_of_their_bodies() -> None:
    """theta2 = -ratio theta1, about the axes of the gearbox; those of the joints may be opposite."""
    gear = JOINT.format(
        "g", "gearbox", "b", "c", AXIS.format("0 0 1", "") + "<axis2><xyz>0 0 -1</xyz></axis2>"
    )
    gear = re.sub("</joint>", "<gearbox_ratio>3</gearbox_ratio>{0}</joint>", gear)
    reference = "<gearbox_reference_body>a</gearbox_reference_body>"
    parts = [
        *(LINK.format(name) for name in "abc"),
        JOINT.format("j", "revolute", "a", "b", AXIS.format("0 0 1", "")),
        JOINT.format("k", "revolute", "a", "c", AXIS.format("0 0 1", "")),
    ]
    (coupling,) = sdf(*parts, gear.format(reference)).couplings
    assert coupling == Coupling(name="g", terms=(("c", -1.0), ("b", 3.0)))
    context = FileContext()
    turned = gear.format(reference).replace("0 0 -1", "0 1 0")
    text = f"<sdf version='1.11'><model name='m'>{''.join(parts)}{turned}</model></sdf>"
    read_sdf(text.encode(), "r.sdf", context)
    assert "the axis of the gearbox differs from the axis of the joint of 'c'" in [
        finding.what for finding in context.findings
    ]


def test_contradicting_couplings_and_limits_of_closing_joints_are_findings() -> None:
    context = FileContext()
    limit = "<limit><lower>-1</lower><upper>1</upper></limit>"
    joints = [
        JOINT.format("j", "revolute", "a", "b", AXIS.format("0 0 1", "<mimic joint='k'/>")),
        JOINT.format("k", "revolute", "b", "c", AXIS.format("0 0 1", "<mimic joint='j'/>")),
        JOINT.format("l", "revolute", "a", "c", AXIS.format("0 0 1", limit)),
    ]
    parts = "".join([*map(LINK.format, "abc"), *joints])
    text = f"<sdf version='1.11'><model name='m'>{parts}</model></sdf>"
    (robot,) = read_sdf(text.encode(), "r.sdf", context).values()
    found = {finding.rule.code: finding.what for finding in context.findings}
    assert found["sdf-coupling"] == "the coupling follows from other constraints; it is omitted"
    assert found["sdf-closure"] == "its limits, friction and springs are omitted"
    assert len(robot.couplings) == 1 and [closure.title for closure in robot.closures] == ["revolute"]


def test_a_joint_that_closes_no_loop_is_refused() -> None:
    parts = [*map(LINK.format, "ab"), JOINT.format("j", "fixed", "a", "b", "")]
    screw = JOINT.format("s", "screw", "a", "b", AXIS.format("0 0 1", ""))
    with pytest.raises(FormatError, match="a joint of type screw closes a loop"):
        sdf(*parts, screw)
    with pytest.raises(FormatError, match="the joint connects a link with itself"):
        sdf(*parts, JOINT.format("s", "revolute", "a", "a", AXIS.format("0 0 1", "")))
