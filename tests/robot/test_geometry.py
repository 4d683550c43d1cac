"""The geometry of robots: closed, correctly oriented surfaces that follow the kinematics."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from armblocks.errors import RobotError
from armblocks.formats import load_robot
from armblocks.robot import (
    Attachment,
    Fixed,
    JointLimits,
    Link,
    Prismatic,
    Revolute,
    RevoluteClosure,
    Robot,
    Rod,
    serial_chain,
    standard_dh,
)
from armblocks.robot.geometry import link_frames, reach, robot_bodies, robot_shapes
from armblocks.robot.linkage_points import rod_points
from armblocks.robot.rod_bars import rod_bars, with_bars
from armblocks.robot.shapes import IDENTITY, Box, Cylinder, Housing, Material, Mesh, Shape, Sphere
from armblocks.robot.triangles import SIDES, TriangleMesh, triangles
from armblocks.spatial import Transform, transl
from mechanisms_for_tests import four_bar

_TETRAHEDRON = Mesh(
    vertices=((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)), faces=((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
)
SHAPES: dict[str, tuple[Shape, float]] = {
    # A regular polygon of SIDES corners approximates each circle.
    "cylinder": (Cylinder(radius=0.5, length=2.0), 2.0 * SIDES / 2 * 0.25 * math.sin(2 * math.pi / SIDES)),
    "box": (Box(size=(1.0, 2.0, 3.0)), 6.0),
    "box as housing": (Housing(start=(1, 2), end=(1, 2), length=0.5, roundness=1.0), math.pi),
    "tetrahedron": (_TETRAHEDRON, 1 / 6),
    "ball": (Sphere(radius=1.0), 4 / 3 * math.pi),
}


def volume(mesh: TriangleMesh) -> float:
    """The volume of a closed surface, by the divergence theorem."""
    a, b, c = (mesh.corners[:, k] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6


@pytest.mark.parametrize("name", SHAPES)
def test_a_surface_encloses_its_volume_with_outward_faces(name: str) -> None:
    shape, expected = SHAPES[name]
    # Facets reduce the area of a circle by 1 % and the volume of a ball by 2 %.
    assert volume(triangles(shape)) == pytest.approx(expected, rel=0.025)


def test_links_with_shapes_have_no_foot_on_the_base() -> None:
    """The base then has no shapes, unless a fixed link, such as the base link of a URDF file, carries all
    others: this link is on a foot."""
    pin = RevoluteClosure(name="pin", first=Attachment(), second=Attachment(link="coupler"))
    robot = replace(four_bar(), constraints=(pin,))
    shape = (Box(size=(0.1, 0.1, 0.1)),)
    given = replace(robot, links=tuple(replace(link, geometry=shape) for link in robot.links))
    ground = Link(name="ground", joint=Fixed(), geometry=shape)
    on_ground = [replace(link, parent=link.parent or "ground") for link in given.links]
    assert robot_shapes(robot)[0]
    assert not robot_shapes(given)[0]
    assert not robot_shapes(replace(given, links=(ground, *given.links)))[0]
    assert robot_shapes(replace(given, links=(ground, *on_ground)))[0]


@pytest.mark.parametrize("name", SHAPES)
def test_normals_are_outward_unit_vectors(name: str) -> None:
    mesh = triangles(SHAPES[name][0])
    assert np.linalg.norm(mesh.normals, axis=2) == pytest.approx(1.0)
    flat = np.cross(mesh.corners[:, 1] - mesh.corners[:, 0], mesh.corners[:, 2] - mesh.corners[:, 0])
    assert (np.einsum("ik,ijk->ij", flat, mesh.normals) > 0).all()


def test_a_bevel_reduces_the_volume() -> None:
    plain, bevelled = Cylinder(radius=1.0, length=1.0), Cylinder(radius=1.0, length=1.0, bevel=0.2)
    assert volume(triangles(bevelled)) < volume(triangles(plain))


def test_a_shape_is_placed_by_its_pose() -> None:
    pose = ((0.0, -1.0, 0.0, 5.0), (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    corners = triangles(Box(size=(2.0, 4.0, 6.0), pose=pose)).corners.reshape(-1, 3)
    assert corners.min(axis=0) == pytest.approx([3.0, -1.0, -3.0])
    assert corners.max(axis=0) == pytest.approx([7.0, 1.0, 3.0])
    assert triangles(Box(size=(2.0, 4.0, 6.0), pose=IDENTITY)).corners.max() == 3.0


def test_every_robot_has_bodies_of_finite_size_in_every_frame(robot: Robot) -> None:
    shapes = robot_shapes(robot)
    assert len(shapes) == len(robot.links) + 2
    size = reach(robot)
    for body in robot_bodies(robot):
        assert np.isfinite(body.mesh.corners).all()
        assert np.linalg.norm(body.mesh.corners, axis=2).max() < 2.5 * size
    materials = {shape.material for row in shapes for shape in row}
    assert {Material.PAINT, Material.JOINT, Material.FLANGE, Material.BASE} <= materials


def test_frames_equal_the_traced_link_poses(robot: Robot) -> None:
    from armblocks.dynamics import trace_link_poses

    q = np.random.default_rng(3).uniform(-1, 1, robot.nq)
    (traced,) = trace_link_poses(robot)(q)
    # Frames and link poses are products of the same few rotations.
    assert link_frames(robot, q.tolist()) == pytest.approx(traced, abs=1e-12)


def test_bodies_lie_along_a_and_d(kr180: Robot) -> None:
    """The third link extends 1.6 m along x from the previous joint, the fourth 2.6 m along z."""
    for row, axis, length in ((3, 0, 1.6), (4, 2, 2.6)):
        corners = np.concatenate([b.mesh.corners.reshape(-1, 3) for b in robot_bodies(kr180) if b.row == row])
        assert corners[:, axis].min() == pytest.approx(-length, abs=0.35)
        assert corners[:, axis].max() == pytest.approx(0.0, abs=0.35)
        others = np.delete(corners, axis, axis=1)
        assert np.abs(others).max() < 0.6


def test_the_geometry_of_a_link_replaces_the_default_bodies() -> None:
    own = (Box(size=(0.1, 0.1, 0.1)),)
    robot = Robot(
        name="own", links=(Link(name="a", joint=Revolute(), after=transl(1, 0, 0), mass=1.0, geometry=own),)
    )
    assert robot_shapes(robot)[1] == own


def test_a_prismatic_joint_has_a_rail_as_long_as_its_range() -> None:
    links = [
        standard_dh("column", d=0.5),
        standard_dh("slide", sigma=1, limits=JointLimits(position=(0.0, 2.0))),
    ]
    robot = Robot(name="lift", links=serial_chain(links))
    rail = next(shape for shape in robot_shapes(robot)[1] if isinstance(shape, Box))
    assert rail.size[2] > 2.0
    assert rail.material is Material.JOINT


def test_a_robot_on_a_column_stands_in_its_base_frame(puma560: Robot) -> None:
    tall = Robot(name="tall", links=serial_chain([standard_dh("a", d=1.0, a=0.2), standard_dh("b", a=0.5)]))
    for robot, bottom in ((tall, 0.0), (puma560, None)):
        feet = [b.mesh.corners[..., 2].min() for b in robot_bodies(robot) if b.row == 0]
        assert min(feet) <= 0.0
        if bottom is not None:
            assert min(feet) == pytest.approx(bottom)


@pytest.mark.parametrize(
    "pose",
    [
        Transform(translation=(0.1, 0.2, 0.3)),
        Transform(translation=(0.1, 0.2, 0.3)).matrix,
        Transform(translation=(0.1, 0.2, 0.3)).matrix.tolist(),
        tuple(Transform(translation=(0.1, 0.2, 0.3)).matrix.tolist()),
    ],
)
def test_shapes_with_lists_and_arrays_are_stored_as_tuples(pose: Any) -> None:
    box = Box(size=[1.0, 2.0, 3.0], pose=pose)  # pyright: ignore[reportArgumentType]
    assert box == Box(size=(1.0, 2.0, 3.0), pose=Transform(translation=(0.1, 0.2, 0.3)))  # pyright: ignore[reportArgumentType]
    mesh = Mesh(vertices=np.eye(3), faces=[[0, 1, 2]], pose=pose)  # pyright: ignore[reportArgumentType]
    robot = Robot(name="boxes", links=(Link(name="link", geometry=(box, mesh)),))
    assert hash(robot) == hash(Robot(name="boxes", links=(Link(name="link", geometry=(box, mesh)),)))
    assert mesh.faces == ((0, 1, 2),)
    assert robot_shapes(robot)


def test_a_shape_with_an_invalid_pose_is_refused_by_name() -> None:
    with pytest.raises(RobotError, match="pose of a Sphere: the pose is neither a Transform"):
        Sphere(radius=1.0, pose=[[1.0]])  # pyright: ignore[reportArgumentType]


def corners_near(robot: Robot, link: str, point: Any, distance: float) -> bool:
    """Whether the drawing of a link has surface points near a point of its frame."""
    row = 1 + [one.name for one in robot.links].index(link)
    corners = [body.mesh.corners.reshape(-1, 3) for body in robot_bodies(robot) if body.row == row]
    return bool((np.linalg.norm(np.concatenate(corners) - point, axis=1) < distance).any())


def test_links_that_end_at_a_closure_are_drawn_up_to_it() -> None:
    robot = four_bar()
    for link, end in (("coupler", (0.9, 0.0, 0.0)), ("rocker", (0.7, 0.0, 0.0))):
        assert corners_near(robot, link, end, 0.1)
        assert corners_near(robot, link, (end[0] / 2 - 0.3, 0.0, 0.0), 0.4)


@pytest.mark.parametrize("name", ["irb460", "kr180_2_pa", "m410ic_185"])
def test_the_rods_of_palletisers_end_at_a_drawn_bracket(name: str) -> None:
    robot = load_robot(name)
    row_of = {link.name: row for row, link in enumerate(robot.links, start=1)}
    size = reach(robot)
    rng = np.random.default_rng(2)
    frames = [
        link_frames(robot, q.tolist()) for q in robot.neutral + 0.2 * rng.standard_normal((3, robot.nq))
    ]
    for rod, carrier in (
        ("drive_rod", "upper_arm"),
        ("lower_level_rod", "triangle"),
        ("upper_level_rod", "wrist"),
    ):
        found = rod_points(robot, frames, size)[carrier]
        for point, axis in found:
            assert corners_near(robot, carrier, point, 0.1 * size)
            assert abs(np.linalg.norm(axis) - 1.0) < 1e-9
        shape = robot.link(rod).geometry
        assert shape is not None
        pose = np.array(shape[0].pose)
        assert isinstance(shape[0], Cylinder)
        ends = [pose @ (0.0, 0.0, side * shape[0].length / 2, 1.0) for side in (-1, 1)]
        for T in frames:
            carried = [(T[row_of[carrier]] @ np.append(point, 1.0))[:3] for point, _ in found]
            gaps = [np.linalg.norm((T[row_of[rod]] @ end)[:3] - p) for end in ends for p in carried]
            assert min(gaps) < 1e-9 * size


def test_the_bar_of_a_rod_is_drawn_from_point_to_point() -> None:
    """A crank of 0.3 m and a rod of 0.5 m to a slider: the bar has the pins at its ends."""
    crank = Link(name="crank", joint=Revolute(axis=(0, 0, 1)))
    slider = Link(name="slider", joint=Prismatic(axis=(1, 0, 0)))
    ends = Attachment(link="crank", pose=transl(0.3, 0, 0)), Attachment(link="slider", pose=transl(0, 0, 0.1))
    rod = Rod(name="rod", first=ends[0], second=ends[1], length=0.5)
    robot = Robot(name="slider-crank", links=(crank, slider), constraints=(rod,))
    q = [0.4, 0.3 * np.cos(0.4) + np.sqrt(0.25 - 0.01 - (0.3 * np.sin(0.4)) ** 2)]
    poses = with_bars(rod_bars(robot), link_frames(robot, q))
    (body,) = (body for body in robot_bodies(robot) if body.row == len(robot.links) + 2)
    z = body.mesh.corners[..., 2]
    assert (z.min(), z.max()) == pytest.approx((0.0, 0.5), abs=1e-12)
    assert poses.shape == (5, 4, 4)
    assert poses[4, :3, :3] @ poses[4, :3, :3].T == pytest.approx(np.eye(3), abs=1e-12)
    for distance, end in ((0.0, (0.3 * np.cos(0.4), 0.3 * np.sin(0.4), 0)), (0.5, (q[1], 0, 0.1))):
        assert poses[4] @ [0, 0, distance, 1] == pytest.approx([*end, 1], abs=1e-12)
    assert with_bars((), poses) is poses
