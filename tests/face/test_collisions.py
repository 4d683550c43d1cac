"""Collisions along motions: closed forms of times and distances, excluded pairs, obstacles, errors."""

from __future__ import annotations

import numpy as np
import pytest

import armblocks as ab
from armblocks.errors import InputError, UnknownNameError
from armblocks.robot import Link, shapes


def slider(shape: shapes.Shape, unit: str = "x") -> ab.Arm:
    """A shape on a slide along x with the range -5 to 5 m."""
    joint = ab.Prismatic(axis=(1.0, 0.0, 0.0), limits=ab.JointLimits(position=(-5.0, 5.0)))
    return ab.Arm(ab.Robot(name="slider", links=(Link(name=unit, joint=joint, geometry=(shape,)),)))


def at(x: float, y: float = 0.0, z: float = 0.0) -> ab.Transform:
    return ab.Transform(translation=(x, y, z))


OBSTACLES = {
    "box": (ab.Box(size=(1.0, 2.0, 2.0), pose=at(2.0)), 1.5),
    "sphere": (ab.Sphere(radius=0.5, centre=(2.0, 0.0, 0.0)), 1.5),
    "cylinder": (ab.Cylinder(radius=0.5, length=1.0, pose=at(2.0)), 1.5),
    "plane": (ab.Plane(normal=(-2.0, 0.0, 0.0), point=(1.5, 0.0, 0.0)), 1.5),
}


@pytest.mark.parametrize("kind", OBSTACLES)
@pytest.mark.parametrize("shape", [shapes.Sphere(radius=0.3), shapes.Box(size=(0.6, 0.4, 0.4))], ids=str)
def test_the_first_contact_is_at_the_time_of_the_closed_form(kind: str, shape: shapes.Shape) -> None:
    obstacle, face = OBSTACLES[kind]
    arm = slider(shape)
    path = ab.point_to_point(0.0, 1.25, speed=1.0, acceleration=4.0)
    report = ab.collisions(arm, path, [obstacle])
    (pair,) = report.pairs
    assert (pair.first, pair.second) == ("x", kind) and report.first_contact is pair and report.collides
    assert pair.contact is not None
    touching = float(path(pair.contact)[0][0])
    assert touching == pytest.approx(face - 0.3, abs=5e-3 if kind == "cylinder" else 1e-8)
    assert pair.distance == 0.0 and report.clearance == 0.0
    assert f"first contact of x and {kind} at" in str(report)
    near = ab.collisions(arm, path, [obstacle], margin=0.1).first_contact
    assert near is not None and near.contact is not None
    assert float(path(near.contact)[0][0]) == pytest.approx(
        face - 0.4, abs=5e-3 if kind == "cylinder" else 1e-8
    )
    free = ab.collisions(arm, ab.point_to_point(0.0, 1.0, speed=1.0, acceleration=4.0), [obstacle])
    assert not free.collides and free.clearance == pytest.approx(
        0.2, abs=5e-3 if kind == "cylinder" else 1e-8
    )
    assert "no contact, minimum distance" in str(free)


def test_a_thin_obstacle_between_samples_is_found() -> None:
    path = ab.point_to_point(-4.0, 4.0, speed=50.0, acceleration=1000.0)
    wall = ab.Box(size=(0.001, 1.0, 1.0), name="wall")
    report = ab.collisions(slider(shapes.Sphere(radius=0.02)), path, [wall])
    assert report.first_contact is not None and report.first_contact.contact is not None
    assert float(path(report.first_contact.contact)[0][0]) == pytest.approx(-0.0205, abs=1e-6)


@pytest.mark.parametrize("samples", [401, 201])
def test_fast_motions_there_and_back_are_no_rest(samples: int) -> None:
    """100 periods in 100 s: the samples 401 and 201 are at every quarter, and at every zero crossing."""
    t, w = np.linspace(0.0, 100.0, samples), 2.0 * np.pi
    q, qd = np.sin(w * t)[:, None], w * np.cos(w * t)[:, None]
    path = ab.JointTrajectory(t=t, q=q, qd=qd, qdd=-w * w * q)
    wall = ab.Box(size=(0.2, 1.0, 1.0), pose=at(1.0), name="wall")
    report = ab.collisions(slider(shapes.Sphere(radius=0.1)), path, [wall], resolution=0.05)
    assert report.first_contact is not None and report.first_contact.contact is not None
    assert report.first_contact.contact == pytest.approx(np.arcsin(0.8) / w, abs=0.005)
    assert float(path(report.first_contact.contact)[0][0]) == pytest.approx(0.8, abs=1e-6)


def three_links() -> ab.Arm:
    """Parallel axes in a plane with thin links of 1 m: the last one can touch the base and the first link."""
    bar = shapes.Box(size=(0.9, 0.02, 0.02), pose=tuple(map(tuple, at(0.5).matrix.tolist())))
    foot = Link(name="foot", joint=ab.Fixed(), geometry=(shapes.Sphere(radius=0.05),))
    links = [
        Link(
            name=f"l{k}",
            parent=f"l{k - 1}" if k > 1 else "foot",
            joint=ab.Revolute(),
            before=at(1.0 if k > 1 else 0.0),
            geometry=(bar,),
        )
        for k in (1, 2, 3)
    ]
    return ab.Arm(ab.Robot(name="three", links=(foot, *links)))


def test_links_that_a_joint_connects_are_not_compared() -> None:
    arm = three_links()
    report = ab.collisions(arm, [[0.0, 0.0, 0.0], [0.0, 2.0, 2.0]])
    names = {(pair.first, pair.second) for pair in report.pairs}
    assert names == {("foot", "l2"), ("foot", "l3"), ("l1", "l3")} and report.unit == ""
    straight = {(pair.first, pair.second): pair.distance for pair in ab.collisions(arm, np.zeros(3)).pairs}
    assert straight["foot", "l2"] == pytest.approx(1.0)  # 1.05 m to the bar, less the radius
    assert straight["l1", "l3"] == pytest.approx(1.1)
    ignored = ab.collisions(arm, np.zeros(3), ignore=[("l3", "l1")])
    assert ignored.excluded == ("l1 and l3: ignored",) and len(ignored.pairs) == 2


def test_the_least_distance_is_that_of_dense_samples() -> None:
    arm = three_links()
    path = ab.jtraj([0.0, 0.5, 0.5], [0.3, 2.3, 1.9], np.linspace(0, 1, 40))
    report = ab.collisions(arm, path, [ab.Sphere(radius=0.1, centre=(0.3, 0.7, 0.0), name="ball")])
    time = np.linspace(0, 1, 2001)
    dense = ab.collisions(arm, path(time)[0], [ab.Sphere(radius=0.1, centre=(0.3, 0.7, 0.0), name="ball")])
    expected = {(pair.first, pair.second): pair for pair in dense.pairs}
    touching = 0
    for pair in report.pairs:
        other = expected[pair.first, pair.second]
        assert pair.distance == pytest.approx(other.distance, abs=5e-3)
        assert (pair.contact is None) == (other.contact is None)
        if pair.contact is not None and other.contact is not None:
            touching += 1
            assert pair.contact == pytest.approx(time[int(other.contact)], abs=1.1e-3)
    assert touching >= 1


def test_a_folded_arm_touches_its_base_and_pairs_of_the_wrist_are_excluded() -> None:
    arm = ab.load_robot("puma560")
    folded = ab.collisions(arm, [0.0, np.pi * 0.85, -np.pi * 0.95, 0.0, 0.0, 0.0])
    assert "link4 and link6: they touch in almost all configurations" in folded.excluded
    assert set(folded.drawn) == {link.name for link in arm.robot.links}
    low = [0.0, 3.9, 0.0, 0.0, 0.0, 0.0]  # the tool is 5 cm above the floor, and the flange is wider
    floor = ab.collisions(arm, low, [ab.Plane()])
    assert {pair.first for pair in floor.pairs if pair.second == "plane" and pair.distance < 0.05}
    assert ab.collisions(arm, low, [ab.Plane(point=(0, 0, 0.06))]).collides
    assert "link1 and plane: they touch in almost all configurations" in floor.excluded
    assert "bodies from the default drawing: link1" in str(floor)


def test_a_box_in_the_first_link_counts() -> None:
    arm = ab.load_robot("puma560")
    report = ab.collisions(arm, np.zeros(6), [ab.Box(size=(0.1, 0.1, 2.0), name="post")])
    assert report.collides and ("link1", "post") in {(pair.first, pair.second) for pair in report.pairs}


def test_equal_names_of_obstacles_get_numbers() -> None:
    boxes = [ab.Box(size=(1, 1, 1), pose=at(3.0 + k)) for k in range(2)]
    report = ab.collisions(slider(shapes.Sphere(radius=0.1)), [0.0], boxes)
    assert [(pair.second, round(pair.distance, 6)) for pair in report.pairs] == [("box", 2.4), ("box 2", 3.4)]
    assert "in configuration 0" in str(ab.collisions(slider(shapes.Sphere(radius=3.0)), [0.0], boxes))


def test_wrong_arguments_are_named() -> None:
    arm = slider(shapes.Sphere(radius=0.1))
    cases = [
        (lambda: ab.collisions(arm, [0.0, 1.0]), r"the motion has the shape \(1, 2\)"),
        (lambda: ab.collisions(arm, ab.jtraj([0, 0], [1, 1], 5)), "the trajectory has 2 joints"),
        (lambda: ab.collisions(arm, [0.0], margin=-1.0), "margin = -1.0"),
        (lambda: ab.collisions(arm, [0.0], resolution=0.0), "resolution = 0.0"),
        (lambda: ab.collisions(arm, [0.0], [shapes.Sphere(radius=1.0)]), "a Box, Sphere, Cylinder or Plane"),
        (
            lambda: ab.collisions(
                arm, ab.point_to_point(0.0, 4.0, speed=1.0, acceleration=1.0), resolution=1e-5
            ),
            "a resolution of 1e-05 m needs",
        ),
        (lambda: ab.Box(size=(1, 1)), "size is"),
        (lambda: ab.Sphere(radius=-1.0), "radius is"),
        (lambda: ab.Cylinder(radius=1.0, length=np.inf), "length is"),
        (lambda: ab.Plane(normal=(0, 0, 0)), "the normal of the plane is zero"),
    ]
    for call, message in cases:
        with pytest.raises(InputError, match=message):
            call()
    with pytest.raises(UnknownNameError, match="body named 'y'"):
        ab.collisions(arm, [0.0], ignore=[("x", "y")])
