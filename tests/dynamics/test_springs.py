"""Springs: derivatives of their energy, mechanisms in maximal coordinates, files, MuJoCo."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import jsonschema
import mujoco
import numpy as np
import pytest
from casadi import DM, SX
from numpy.testing import assert_allclose

import armblocks as ab
from armblocks import formats
from armblocks.dynamics import trace_constrained_motion, trace_joint_wrenches, trace_rne
from armblocks.dynamics.lockable_joints import JointEquations
from armblocks.dynamics.mechanism import Mechanism
from armblocks.errors import ArmblocksWarning, FormatError, RobotError, UnknownNameError
from armblocks.formats.file_findings import FileContext
from armblocks.formats.mjcf.reader import read_mjcf
from armblocks.formats.mjcf.writer import write_mjcf
from armblocks.formats.robot_json import read_robot, write_robot
from armblocks.formats.sdf.reader import read_sdf
from armblocks.formats.sdf.writer import write_sdf
from armblocks.formats.urdf.writer import write_urdf
from armblocks.robot import Attachment, Coupling, JointSpring, LineSpring, Robot, Spring
from maximal_coordinates import accelerations, body_states
from mechanisms_for_tests import four_bar, random_mechanism, random_transform
from robots_for_tests import MIXED_ROBOTS, along, build_random_tree, evaluate, random_states

SCHEMA = json.loads((Path(formats.__file__).parent / "schema" / "robot.schema.json").read_bytes())


def with_springs(robot: Robot, seed: int, lines: int = 2) -> Robot:
    """The robot with springs at some joints and between random points of random links and the base."""
    random = np.random.default_rng(seed)
    single = [link.name for link in robot.tree_links if link.joint.nv == 1]
    springs: list[Spring] = [
        JointSpring(name=f"at {k}", joint=name, stiffness=random.uniform(1, 30), rest=random.normal())
        for k, name in enumerate([*single[::2], *single[:1]])
    ]
    names = [None, *(link.name for link in robot.links)]
    for k in range(lines):
        first, second = random.choice(len(names), 2, replace=False)
        springs.append(
            LineSpring(
                name=f"line {k}",
                first=Attachment(link=names[first], pose=random_transform(random)),
                second=Attachment(link=names[second], pose=random_transform(random)),
                stiffness=random.uniform(0, 100),
                length=random.uniform(0.2, 0.8),
                preload=random.normal(scale=30),
            )
        )
    return replace(robot, springs=tuple(springs))


@pytest.mark.parametrize("robot", [*MIXED_ROBOTS[:4], build_random_tree(3)], ids=lambda robot: robot.name)
def test_gravity_and_spring_torques_are_derivatives_of_the_energy(robot: Robot) -> None:
    sprung = with_springs(robot, 1)
    h = 1e-6
    for q, qd, qdd in random_states(sprung, 2):
        q = evaluate(sprung, "normalised", q).ravel()
        slopes = [
            (
                evaluate(sprung, "potential_energy", along(sprung, q, e, h))
                - evaluate(sprung, "potential_energy", along(sprung, q, e, -h))
            )
            / (2 * h)
            for e in np.eye(sprung.n)
        ]
        assert_allclose(evaluate(sprung, "gravload", q), np.ravel(slopes), rtol=1e-6, atol=1e-6)
        # Springs are independent of speeds; accelerations are those of rne.
        added = evaluate(sprung, "rne", q, qd, qdd) - evaluate(robot, "rne", q, qd, qdd)
        held = evaluate(sprung, "gravload", q) - evaluate(robot, "gravload", q)
        assert_allclose(added, held, rtol=1e-9, atol=1e-9)
        tau = evaluate(sprung, "rne", q, qd, qdd)
        assert_allclose(evaluate(sprung, "accel", q, qd, tau), qdd, rtol=1e-7, atol=1e-7)


def test_springs_of_coupled_joints_have_the_coordinates_of_these_joints() -> None:
    """The energy of the robot without the coupling, at coordinates that satisfy it."""
    free = with_springs(build_random_tree(5, count=4, chain=True), 2)
    names = [link.name for link in free.tree_links]
    coupling = Coupling(name="gear", terms=((names[1], 1.0), (names[0], -2.0)), constant=0.4)
    sprung = replace(free, constraints=(coupling,))
    q = np.random.default_rng(3).normal(size=sprung.nq)
    all_q = np.insert(q, 1, 2.0 * q[0] + 0.4)
    for name in ("potential_energy", "gravload"):
        of_tree = evaluate(free, name, all_q)
        expected = of_tree if name == "potential_energy" else np.delete(of_tree, 1)
        if name == "gravload":
            expected[0] += 2.0 * of_tree[1]
        assert_allclose(evaluate(sprung, name, q), expected, rtol=1e-12)
    rest = SX.zeros(free.nq)
    bias = np.asarray(DM(JointEquations(free, rest, rest).bias).full())[:, 0]
    assert_allclose(bias, evaluate(free, "gravload", np.zeros(free.nq)), rtol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_mechanisms_with_springs_agree_with_maximal_coordinates(seed: int) -> None:
    """The spring forces are external forces of the bodies there, by a formula of their own."""
    robot, q = random_mechanism(seed)
    sprung = with_springs(robot, seed + 10)
    mechanism = Mechanism(robot)
    random = np.random.default_rng(seed)
    qd = mechanism.consistent_speeds(q, random.normal(size=robot.n))
    tau = random.normal(size=robot.n)
    qdd = trace_constrained_motion(sprung, near=q)(q, qd, tau)[2]
    assert_allclose(qdd, accelerations(robot, q, qd, tau + spring_forces(sprung, q)), rtol=1e-8, atol=1e-8)


def spring_forces(robot: Robot, q: np.ndarray) -> np.ndarray:
    """The generalised forces of the springs (n,), by virtual work with unit speeds."""
    index = {link.name: k for k, link in enumerate(robot.tree_links)}
    total = np.zeros(robot.n)
    for spring in robot.springs:
        if isinstance(spring, JointSpring):
            k = index[spring.joint]
            total[k] -= spring.stiffness * (q[k] - spring.rest)
            continue
        assert isinstance(spring, LineSpring)
        for k, unit in enumerate(np.eye(robot.n)):
            bodies = body_states(robot, q, unit)
            points, speeds = [], []
            for end in (spring.first, spring.second):
                body = bodies[end.link]
                arm = body.R @ np.asarray(end.pose.translation)
                points.append(body.p + arm)
                speeds.append(body.v + np.cross(body.w, arm))
            d = points[1] - points[0]
            L = np.linalg.norm(d)
            tension = spring.preload + spring.stiffness * (L - spring.length)
            total[k] -= tension * (d / L) @ (speeds[1] - speeds[0])
    return total


def test_joints_transmit_the_forces_of_line_springs() -> None:
    """A constant force between two links: the wrenches of their joints differ by it."""
    loop = four_bar()
    joints = {name: ab.Motor() if name == "crank" else None for name in ("crank", "coupler", "rocker")}
    loop = replace(loop, links=tuple(replace(link, motor=joints[link.name]) for link in loop.links))
    spring = LineSpring(
        name="s",
        first=Attachment(link="crank", pose=ab.Transform(translation=(0.15, 0.1, 0))),
        second=Attachment(link="rocker", pose=ab.Transform(translation=(0.3, -0.1, 0))),
        stiffness=40.0,
        length=0.3,
        preload=25.0,
    )
    sprung = replace(loop, springs=(spring,))
    q = loop.neutral
    mechanism = Mechanism(loop)
    qd = mechanism.consistent_speeds(q, np.array((0.8, 0.0, 0.0)))
    qdd = trace_constrained_motion(sprung)(q, qd, np.array((3.0, 0, 0)))[2]
    assert_allclose(trace_rne(sprung)(q, qd, qdd)[0], (3.0, 0, 0), atol=1e-10)
    wrenches = trace_joint_wrenches(sprung)(q, qd, qdd)[0]
    # The sum of the forces on all bodies is that of their accelerations and weights: springs are internal.
    T = {
        name: evaluate(loop, "link_poses", q)[k + 1] for k, name in enumerate(("crank", "coupler", "rocker"))
    }
    ground = T["crank"][:3, :3] @ wrenches[0, :3] + T["rocker"][:3, :3] @ wrenches[2, :3]
    without = trace_joint_wrenches(loop)(q, qd, qdd)[0]
    assert_allclose(
        ground, T["crank"][:3, :3] @ without[0, :3] + T["rocker"][:3, :3] @ without[2, :3], atol=1e-10
    )
    # The moments about the origin as well; those of the pins on the ground are there or at x = 0.8.
    moment = T["crank"][:3, :3] @ wrenches[0, 3:] + T["rocker"][:3, :3] @ wrenches[2, 3:]
    moment += np.cross(T["rocker"][:3, 3], T["rocker"][:3, :3] @ wrenches[2, :3])
    other = T["crank"][:3, :3] @ without[0, 3:] + T["rocker"][:3, :3] @ without[2, 3:]
    other += np.cross(T["rocker"][:3, 3], T["rocker"][:3, :3] @ without[2, :3])
    assert_allclose(moment, other, atol=1e-10)
    # The rocker alone: its pin on the ground, the closure, its weight and the spring cause its motion.
    tip, pin = T["rocker"], wrenches[3, :3]
    along_spring = T["rocker"] @ (0.3, -0.1, 0, 1) - T["crank"] @ (0.15, 0.1, 0, 1)
    L = np.linalg.norm(along_spring)
    force = -(25.0 + 40.0 * (L - 0.3)) * along_spring[:3] / L
    body = body_states(loop, q, qd)["rocker"]
    arm = body.R @ np.array((0.35, 0, 0))
    accelerated = np.cross((0, 0, qdd[2]), arm) - qd[2] ** 2 * arm
    closure = tip[:3, :3] @ pin
    assert_allclose(
        tip[:3, :3] @ wrenches[2, :3] + closure + force + 1.5 * np.array(loop.gravity),
        1.5 * accelerated,
        atol=1e-9,
    )


def test_a_robot_on_a_spring_oscillates_with_its_frequency() -> None:
    """A mass on a slide: q = cos(w t) with w^2 = k / m."""
    slide = ab.Link(name="cart", joint=ab.Prismatic(axis=(1, 0, 0)), mass=2.0)
    robot = Robot(name="cart", links=(slide,), springs=(JointSpring(name="k", joint="cart", stiffness=50.0),))
    builder = ab.DiagramBuilder("oscillator")
    zero = builder.add("zero", ab.blocks.Constant(value=(0.0,)))
    builder.add("plant", ab.blocks.ForwardDynamics(robot=robot, q0=(1.0,)), zero)
    builder.add("sticking", ab.blocks.ArmPlant(robot=robot, q0=(1.0,)), zero)
    result = ab.simulate(builder.build(), stop_time=3.0, rtol=1e-9, atol=1e-9)
    for block in ("plant", "sticking"):
        assert_allclose(result[f"{block}/q"][:, 0], np.cos(5.0 * result.time), atol=1e-7)


MJCF = """<mujoco><compiler eulerseq="zyx"/><default><motor armature="0.02" damping="0.3 0"/>
<tendon stiffness="40"/><geom contype="0"/></default><worldbody><site name="w" pos="0.1 0.2 1.3"/>
<body pos="0 0 1"><joint name="j" axis="0 1 0" ref="10" stiffness="3" springref="40"/>
<joint name="s" type="slide" axis="1 0 0" springdamper="0.1 1.2" damping="7" armature="0.4"/>
<geom size="0.1" pos="0.3 0 0"/><site name="b" pos="0.5 0.1 0"/>
<body pos="0.4 0 0"><joint name="k" axis="0 0.6 0.8" ref="-20" springdamper="0.3 0.7"/>
<joint name="l" axis="1 0 0" ref="30"/><geom size="0.1" pos="0 0.2 0"/>
<site name="c" pos="0 0.1 0.2"/></body></body></worldbody>
<tendon><spatial name="t"><site site="w"/><site site="b"/></spatial>
<spatial name="u"><site site="w"/><site site="c"/></spatial>
<spatial springlength="0.3"><site site="w"/><site site="c"/></spatial></tendon>
<actuator><motor joint="s" gear="-3" armature="2"/><motor joint="s"/><general jointinparent="j" gear="2"/>
<general joint="k" damping="0.2"/></actuator></mujoco>"""


def test_springs_and_actuators_of_mjcf_have_the_equations_of_mujoco() -> None:
    context = FileContext()
    robot = read_mjcf(MJCF.encode(), "m.xml", context)
    assert not context.findings
    agree_with_mujoco(robot, MJCF)


def agree_with_mujoco(robot: Robot, text: str) -> None:
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    random = np.random.default_rng(4)
    for _ in range(4):
        q, qd, tau = random.normal(size=(3, robot.n))
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = q, qd, tau
        mujoco.mj_forward(model, data)
        assert_allclose(evaluate(robot, "accel", q, qd, tau), data.qacc, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("format", ["MJCF", "SDF"])
def test_springs_written_and_read_have_the_same_equations(format: str) -> None:
    robot = with_springs(build_random_tree(8, count=5, chain=True), 6, lines=2 if format == "MJCF" else 0)
    frames = (ab.NamedFrame(name="line 0_site", link=robot.links[0].name),)
    robot = replace(robot, frames=frames)
    robot = replace(
        robot,
        springs=tuple(replace(s, preload=-1.0) if isinstance(s, LineSpring) else s for s in robot.springs),
        links=tuple(replace(link, geometry=(), motor=None) for link in robot.links),
    )
    if format == "MJCF":
        copy = read_mjcf(write_mjcf(robot), "r.xml", FileContext())
        agree_with_mujoco(copy, write_mjcf(robot).decode())
    else:
        (copy,) = read_sdf(write_sdf(robot), "r.sdf", FileContext()).values()
    assert len(copy.springs) == len(robot.springs) - 1  # two springs at one joint are one
    for q, qd, qdd in random_states(robot, 2):
        expected = evaluate(robot, "rne", q, qd, qdd)
        assert_allclose(evaluate(copy, "rne", q, qd, qdd), expected, rtol=1e-9, atol=1e-9)


def test_robot_files_keep_springs() -> None:
    robot = with_springs(build_random_tree(8, count=5), 6)
    data = write_robot(robot)
    jsonschema.Draft202012Validator(SCHEMA).validate(json.loads(data))
    assert read_robot(data, "robot.json") == robot
    document = json.loads(data)
    document["springs"] = [{"type": "joint_spring", "name": "s", "joint": "nowhere", "stiffness": 1.0}]
    with pytest.raises(FormatError, match="no joint named 'nowhere'"):
        read_robot(json.dumps(document).encode(), "robot.json")
    del document["springs"][0]["stiffness"]
    with pytest.raises(FormatError, match="the spring has no stiffness"):
        read_robot(json.dumps(document).encode(), "robot.json")


def test_springs_that_a_format_does_not_have_are_named() -> None:
    robot = Robot(
        name="r",
        links=(ab.Link(name="a"),),
        springs=(
            JointSpring(name="torsion", joint="a", stiffness=1.0),
            LineSpring(
                name="gas",
                first=Attachment(),
                second=Attachment(link="a"),
                stiffness=0.0,
                length=0.1,
                preload=-9.0,
            ),
        ),
    )
    for write, names in ((write_urdf, "'a', 'gas'"), (write_sdf, "'gas'"), (write_mjcf, "'gas'")):
        with pytest.warns(ArmblocksWarning, match=f"springs that are not part of the .* file.*{names}"):
            write(robot)


@pytest.mark.parametrize(
    ("joint", "reason"),
    [
        ('type="ball" stiffness="2"', "the spring of the ball joint is omitted"),
        ('stiffness="2 1"', "the nonlinear part of the stiffness is omitted"),
        ('springdamper="0.1 0"', "springdamper 0.1 0 is omitted"),
        ('stiffness="-2"', "the stiffness -2 is omitted"),
        ('name="j" type="ball"', "armature and damping of the actuators of the ball joint are omitted"),
        ('name="j"', "damping -1, armature 0: negative values are omitted"),
    ],
)
def test_other_springs_and_actuators_of_mjcf_are_findings(joint: str, reason: str) -> None:
    damping = "-1" if "negative" in reason else "1 2"
    text = (
        f'<mujoco><worldbody><body><joint {joint}/><geom size="1"/></body></worldbody>'
        f'<actuator><motor joint="j" damping="{damping}"/></actuator></mujoco>'
    )
    context = FileContext()
    read_mjcf(text.encode(), "m.xml", context)
    assert reason in [finding.what for finding in context.findings]
    if "ball" in joint and "actuators" in reason:
        high = "the nonlinear part of the damping is omitted"
        assert high in [finding.what for finding in context.findings]


@pytest.mark.parametrize(
    ("spring", "error", "message"),
    [
        (lambda: JointSpring(name="", joint="a", stiffness=1.0), RobotError, "a joint spring has no name"),
        (lambda: JointSpring(name="s", joint="a", stiffness=-1.0), RobotError, "the stiffness is -1"),
        (lambda: JointSpring(name="s", joint="a", stiffness=np.inf), RobotError, "the stiffness is inf"),
        (lambda: JointSpring(name="s", joint="b", stiffness=1.0), UnknownNameError, "no joint named 'b'"),
        (
            lambda: LineSpring(name="s", first=Attachment(), second=Attachment(), stiffness=1.0, length=1.0),
            RobotError,
            "both points are on the same link",
        ),
        (
            lambda: LineSpring(
                name="s", first=Attachment(), second=Attachment(link="b"), stiffness=1.0, length=1.0
            ),
            UnknownNameError,
            "no link named 'b'",
        ),
        (
            lambda: LineSpring(
                name="s", first=Attachment(), second=Attachment(link="a"), stiffness=1.0, length=-1.0
            ),
            RobotError,
            "the length is -1",
        ),
    ],
)
def test_impossible_springs_are_refused(
    spring: Callable[[], Spring], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        Robot(name="r", links=(ab.Link(name="a"),), springs=(spring(),))


def test_springs_are_single_and_at_joints_with_one_coordinate() -> None:
    spring = JointSpring(name="s", joint="a", stiffness=1.0)
    with pytest.raises(RobotError, match="two springs are named 's'"):
        Robot(name="r", links=(ab.Link(name="a"),), springs=(spring, spring))
    with pytest.raises(RobotError, match="joint 'a' is Spherical and has 3 degrees of freedom"):
        Robot(name="r", links=(ab.Link(name="a", joint=ab.Spherical()),), springs=(spring,))
    many = tuple(replace(spring, name=f"s{k}") for k in range(301))
    with pytest.raises(RobotError, match="the robot has 301 springs"):
        Robot(name="r", links=(ab.Link(name="a"),), springs=many)
