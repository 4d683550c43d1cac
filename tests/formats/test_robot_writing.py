"""Writing SDF and MJCF: reading the file gives the same equations, and MuJoCo agrees with the file."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Callable

import mujoco
import numpy as np
import pytest
from numpy.testing import assert_allclose

from armblocks.errors import ArmblocksWarning, FormatError
from armblocks.formats.file_findings import FileContext
from armblocks.formats.mjcf.equality_writing import quaternion_of
from armblocks.formats.mjcf.reader import read_mjcf
from armblocks.formats.mjcf.writer import write_mjcf
from armblocks.formats.sdf.reader import read_sdf
from armblocks.formats.sdf.writer import write_sdf
from armblocks.robot import (
    Fixed,
    Free,
    Joint,
    JointLimits,
    Link,
    Motor,
    Prismatic,
    Revolute,
    Robot,
    Screw,
    Spherical,
    with_tip,
)
from armblocks.robot.shapes import Box, Cylinder, Housing, Mesh, Shape, Sphere
from armblocks.spatial import Transform, transl, trotx
from robots_for_tests import (
    build_mixed_tree,
    build_random_tree,
    evaluate,
    law_robots_of,
    random_inertia,
    random_rotation,
    random_states,
)


def read(data: bytes, format: str, context: FileContext | None = None) -> Robot:
    context = context or FileContext()
    if format == "MJCF":
        return read_mjcf(data, "r.xml", context)
    (robot,) = read_sdf(data, "r.sdf", context).values()
    return robot


WRITERS: dict[str, Callable[[Robot], bytes]] = {"SDF": write_sdf, "MJCF": write_mjcf}
FORMATS = pytest.mark.parametrize("format", WRITERS)


def written(robot: Robot, format: str, tip: str = "") -> Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ArmblocksWarning)
        again = read(WRITERS[format](robot), format)
    return with_tip(again, tip or ("tool" if not robot.tool.is_identity else robot.links[-1].name))


def detailed_robot(seed: int) -> Robot:
    """A random tree with limits, friction equal in both directions, and links that only carry a joint."""
    random = np.random.default_rng(seed)
    links: list[Link] = []
    for link in build_random_tree(seed + 20, 8, chain=seed % 2 == 0).links:
        low = random.uniform(-3, 0)
        limits = JointLimits(
            position=(low, low + random.uniform(1, 4)) if random.random() < 0.6 else None,
            torque=random.uniform(1, 50) if random.random() < 0.6 else None,
        )
        bare = random.random() < 0.4 and link.joint.moves
        rotor = Motor(
            inertia=random.uniform(0, 0.1),
            gear_ratio=random.uniform(-20, -1) if random.random() < 0.5 else 1.0,
            viscous_friction=random.uniform(0, 1),
            coulomb_friction=random.uniform(0, 0.5),
        )
        joint = dataclasses.replace(link.joint, limits=limits) if link.joint.moves else link.joint
        changes = {"mass": 0.0, "inertia": (0.0,) * 6, "centre_of_mass": (0.0,) * 3} if bare else {}
        motor = rotor if random.random() < 0.7 else None
        links.append(dataclasses.replace(link, joint=joint, motor=motor, **changes))
    tip = links[-1]
    links[-1] = dataclasses.replace(tip, mass=1.0, inertia=random_inertia(random))
    tree = build_random_tree(seed + 20, 8, chain=seed % 2 == 0)
    return dataclasses.replace(tree, name=f"detailed{seed}", links=tuple(links))


DETAILED = [detailed_robot(seed) for seed in range(6)]
ROBOTS = [*law_robots_of((Revolute, Prismatic, Fixed)), *DETAILED]


def with_quaternions(seed: int, kinds: tuple[type[Joint], ...]) -> Robot:
    """A random tree without motors; the frames of links with quaternions are those of their joints."""
    robot = build_mixed_tree(seed, kinds)
    links: list[Link] = []
    for link in robot.links:
        has_quaternion = link.joint.nq != link.joint.nv
        after = Transform() if has_quaternion else link.after
        links.append(dataclasses.replace(link, motor=None, after=after))
    return dataclasses.replace(robot, links=tuple(links))


FLOATING = with_quaternions(11, (Spherical, Revolute, Prismatic, Spherical, Revolute))
"""The first link is free, which MuJoCo supports at the base only."""
FLOATING = dataclasses.replace(
    FLOATING,
    base=Transform(),
    links=(dataclasses.replace(FLOATING.links[0], joint=Free(), after=Transform()), *FLOATING.links[1:]),
)
GENERAL_ROBOTS = [
    ("SDF", with_quaternions(10, (Revolute, Screw, Spherical, Prismatic, Fixed, Screw))),
    ("MJCF", with_quaternions(12, (Revolute, Spherical, Prismatic, Spherical, Fixed))),
    ("MJCF", FLOATING),
]


@FORMATS
@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_reading_what_was_written_gives_the_same_equations(robot: Robot, format: str) -> None:
    compare_with_the_written_file(robot, format)


@pytest.mark.parametrize(("format", "robot"), GENERAL_ROBOTS)
def test_joints_with_quaternions_and_screws_have_the_same_coordinates(robot: Robot, format: str) -> None:
    compare_with_the_written_file(robot, format)


def compare_with_the_written_file(robot: Robot, format: str) -> None:
    again = written(robot, format)
    order = [robot.speeds.index(entry) for entry in again.speeds]
    places = [robot.positions.index(entry) for entry in again.positions]
    assert sorted(order) == list(range(robot.n))
    assert sorted(places) == list(range(robot.nq))
    assert_allclose(again.qlim, robot.qlim[places])
    assert_allclose(again.torque_limits, robot.torque_limits[order])
    if format == "SDF":
        assert_allclose(again.speed_limits, robot.speed_limits[order])
        assert_allclose(again.gear_ratios, robot.gear_ratios[order])
    ours, theirs = robot.nofriction(), again.nofriction()
    q, qd, qdd = random_states(robot, count=1)[0]
    other = [q[places], qd[order], qdd[order]]

    def close(actual: np.ndarray, expected: np.ndarray) -> None:
        scale = max(1.0, float(np.abs(expected).max(initial=0.0)))
        assert_allclose(actual, expected, rtol=0, atol=1e-12 * scale)

    close(evaluate(theirs, "fkine", other[0]), evaluate(ours, "fkine", q))
    close(evaluate(theirs, "jacob0", other[0]), evaluate(ours, "jacob0", q)[:, order])
    close(evaluate(theirs, "inertia", other[0]), evaluate(ours, "inertia", q)[np.ix_(order, order)])
    close(evaluate(theirs, "rne", *other), evaluate(ours, "rne", q, qd, qdd)[order])
    if robot in DETAILED:  # friction that depends on the direction is not written
        close(evaluate(again, "friction", other[1]), evaluate(robot, "friction", qd)[order])


@pytest.mark.parametrize(
    "robot", [robot for robot in ROBOTS if not robot.source], ids=lambda robot: robot.name
)
def test_mujoco_agrees_with_the_written_file(robot: Robot) -> None:
    """MuJoCo refuses moving bodies without mass, so a small mass is added to those that remain."""
    heavy = {link.name for link in robot.links if link.mass}
    light = tuple(
        link if link.name in heavy else dataclasses.replace(link, mass=1e-3, inertia=(1e-4,) * 3)
        for link in robot.links
    )
    for model_of in (robot, dataclasses.replace(robot, links=light)):
        compare_with_mujoco(model_of, may_be_refused=model_of.links != light)


def compare_with_mujoco(robot: Robot, *, may_be_refused: bool) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ArmblocksWarning)
        text = write_mjcf(robot).decode()
    try:
        model = mujoco.MjModel.from_xml_string(text)
    except ValueError as error:
        assert "mass and inertia of moving bodies" in str(error) and may_be_refused
        return
    data = mujoco.MjData(model)
    columns = np.array([model.joint(name).dofadr[0] for name in robot.joint_names])
    q, qd, qdd = random_states(robot, 1)[0]
    data.qpos[columns], data.qvel[columns], data.qacc[columns] = q, qd, qdd
    mujoco.mj_inverse(model, data)
    smooth = robot.nofriction()
    tau = np.zeros(model.nv)
    mujoco.mj_rne(model, data, 1, tau)
    tau += model.dof_armature * data.qacc
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    tip = data.body("tool" if not robot.tool.is_identity else robot.links[-1].name)
    pose = evaluate(smooth, "fkine", q)
    assert_allclose(tip.xpos, pose[:3, 3], atol=1e-10)
    assert_allclose(tip.xmat.reshape(3, 3), pose[:3, :3], atol=1e-10)
    expected = evaluate(smooth, "rne", q, qd, qdd)
    assert_allclose(tau[columns], expected, rtol=0, atol=1e-10 * max(1.0, np.abs(expected).max()))
    expected = evaluate(smooth, "inertia", q)
    assert_allclose(M[np.ix_(columns, columns)], expected, rtol=0, atol=1e-10 * np.abs(expected).max())
    lossy = [link.motor for link in robot.moving_links]
    damping = [0.0 if motor is None else motor.gear_ratio**2 * motor.viscous_friction for motor in lossy]
    assert_allclose(model.dof_damping[columns], damping, rtol=1e-12)


TRIANGLES = Mesh(
    vertices=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    faces=((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)),
)
SOLIDS: tuple[Shape, ...] = (Box(size=(1.0, 2.0, 3.0)), Cylinder(radius=0.1, length=1.0), Sphere(radius=0.2))
HOUSING = Housing(start=(0.1, 0.1), end=(0.1, 0.1), length=1.0)


@FORMATS
def test_shapes_are_written_and_others_are_named(format: str) -> None:
    pose = ((0.0, -1.0, 0.0, 1.0), (1.0, 0.0, 0.0, 2.0), (0.0, 0.0, 1.0, 3.0), (0.0, 0.0, 0.0, 1.0))
    shapes = (*(dataclasses.replace(solid, pose=pose) for solid in SOLIDS), TRIANGLES, HOUSING)
    link = Link(name="a", geometry=shapes, mass=1.0, inertia=np.eye(3), after=transl(0.1, 0, 0))
    robot = Robot(name="r", links=(link,))
    lost = ("1 shape is", "Housing") if format == "MJCF" else ("2 shapes are", "Housing, Mesh")
    with pytest.warns(ArmblocksWarning, match=f"{lost[0]} not part of the {format} file: {lost[1]}"):
        data = WRITERS[format](robot)
    geometry = read(data, format).links[-1].geometry
    assert geometry is not None and len(geometry) == (4 if format == "MJCF" else 3)
    for shape, solid in zip(geometry, shapes):
        assert type(shape) is type(solid)
    for shape in geometry[:3]:
        assert_allclose(np.array(shape.pose), np.array(pose), atol=1e-15)
    assert geometry[0] == dataclasses.replace(shapes[0], pose=geometry[0].pose)
    if format == "MJCF":
        assert isinstance(geometry[3], Mesh) and len(geometry[3].faces) == 4
        mujoco.MjModel.from_xml_string(data.decode())
    assert read(WRITERS[format](Robot(name="r", links=(Link(name="a"),))), format).links[0].geometry is None


@FORMATS
def test_data_that_a_format_does_not_have_give_warnings(format: str) -> None:
    def warned(text: str, **changes: object) -> None:
        robot = Robot(name="r", links=(Link(**{"name": "a", **changes}),))  # pyright: ignore[reportArgumentType]
        with pytest.warns(ArmblocksWarning, match=text):
            WRITERS[format](robot)

    warned("depends on the direction; the mean is written", motor=Motor(coulomb_friction=(0.2, -0.1)))
    with pytest.warns(ArmblocksWarning, match="friction accelerates the joint"):
        warned(f"is not part of {format} files", motor=Motor(viscous_friction=-1.0))
    warned(f"the name of link 'world' becomes 'world_', as {format} requires", name="world")
    if format == "SDF":
        warned("the name of link 'a::b' becomes 'a_b_'", name="a::b")
        return
    warned("gear ratios are not part of an MJCF file", motor=Motor(gear_ratio=5.0))
    warned("speed limits are not part of an MJCF file", joint=Revolute(limits=JointLimits(speed=1.0)))
    zero = Revolute(limits=JointLimits(position=(1.0, 1.0)))
    warned("a range of zero width, 1, is not part of an MJCF file", joint=zero)


@FORMATS
def test_another_tip_or_order_of_coordinates_gives_a_warning(format: str) -> None:
    for parents, text in (
        ({"a": None, "b": None, "c": "a", "d": "b"}, "the file are in another order: a, c, b, d"),
        ({"a": None, "c": "a", "e": "c", "b": None}, "load the file with tip='b'"),
    ):
        links = tuple(
            Link(name=name, parent=parent, mass=1.0, inertia=np.eye(3)) for name, parent in parents.items()
        )
        with pytest.warns(ArmblocksWarning, match=text):
            WRITERS[format](Robot(name="tree", links=links))


class Rail(Prismatic):
    """A joint type of a user."""


def test_data_of_joints_with_quaternions_that_a_format_does_not_have_are_named() -> None:
    limits = JointLimits(torque=3.0)
    ball = Link(
        name="b", joint=Spherical(limits=limits), mass=1.0, motor=Motor(inertia=1.0), after=trotx(0.2)
    )
    robot = Robot(name="r", links=(ball,))
    limits_left_out = "link 'b': the limits of its spherical joint are not part of the"
    with (
        pytest.warns(ArmblocksWarning, match=limits_left_out),
        pytest.warns(ArmblocksWarning, match="friction and rotor inertia of its ball joint are not part"),
    ):
        write_sdf(robot)
    with (
        pytest.warns(ArmblocksWarning, match=limits_left_out),
        pytest.warns(ArmblocksWarning, match="the coordinates of its joint are relative to the axes of the"),
    ):
        write_mjcf(robot)
    inner = Robot(name="r", links=(Link(name="a"), Link(name="b", parent="a", joint=Free(), mass=1.0)))
    with pytest.raises(FormatError, match="link 'b': the free joint is not at the base"):
        write_mjcf(inner)


@FORMATS
def test_robots_that_cannot_be_written_are_refused(format: str) -> None:
    write = WRITERS[format]
    with pytest.raises(FormatError, match=f"link 'a' is a Rail, which {format} does not have"):
        write(Robot(name="r", links=(Link(name="a", joint=Rail()),)))
    with pytest.raises(FormatError, match="has characters that XML cannot contain"):
        write(Robot(name="r", links=(Link(name="a\0"),)))
    name = "'a' & \"b\" <é>"
    assert read(write(Robot(name='<&">', links=(Link(name=name),))), format).joint_names == (name,)


def test_chains_that_are_deeper_than_xml_files_may_be_are_refused_as_mjcf() -> None:
    def chain(count: int) -> Robot:
        links = [
            Link(name=f"l{k}", parent=f"l{k - 1}" if k else None, mass=1.0, before=transl(0, 0, 0.1))
            for k in range(count)
        ]
        return Robot(name="snake", links=tuple(links), tool=trotx(0.1))

    assert written(chain(61), "MJCF").n == 61
    with pytest.raises(FormatError, match="the chain of links up to 'l61' has more than 61 bodies"):
        write_mjcf(chain(62))
    assert written(chain(200), "SDF").n == 200


def test_quaternions_of_all_rotations_are_exact() -> None:
    random = np.random.default_rng(0)
    turns = [np.diag(signs) for signs in ([1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1])]
    for R in [*turns, *(random_rotation(random) for _ in range(50))]:
        result = np.zeros(9)
        mujoco.mju_quat2Mat(result, np.array(quaternion_of(Transform(rotation=R).rotation)))
        assert_allclose(result.reshape(3, 3), R, atol=1e-15)
