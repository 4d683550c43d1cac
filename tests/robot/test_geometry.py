"""The geometry of robots: closed, correctly oriented surfaces that follow the kinematics."""

import math

import numpy as np
import pytest

from armblocks.robot import JointLimits, Link, Revolute, Robot, serial_chain, standard_dh
from armblocks.robot.geometry import link_frames, reach, robot_bodies, robot_shapes
from armblocks.robot.shapes import IDENTITY, Box, Cylinder, Housing, Material, Mesh, Shape, Sphere
from armblocks.robot.triangles import SIDES, TriangleMesh, triangles
from armblocks.spatial import transl

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
