"""A wobble-plate pump and Goldberg's linkage: closed-form poses, and Lagrange's equation of one angle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from armblocks.dynamics import trace_hybrid_dynamics, trace_link_poses
from armblocks.dynamics.mechanism import Mechanism
from armblocks.robot import (
    Attachment,
    Link,
    PointOnPlane,
    PrescribedMotion,
    Prismatic,
    Revolute,
    RevoluteClosure,
    Robot,
    Rod,
)
from armblocks.spatial import Transform, rotation_about, transl

Array = np.ndarray
Poses = Callable[[float], Array]
"""Poses (L, 4, 4) of all links at the value of one coordinate."""

TILT, RADIUS, ROD, PISTONS = 0.35, 0.05, 0.08, 2
"""Of the plate, rad; of the rods on the plate and the cylinders, m; of the rods, m."""
PLACES = [
    (RADIUS * np.cos(a), RADIUS * np.sin(a), 0.0) for a in 2 * np.pi / PISTONS * np.arange(PISTONS) + 0.3
]


def turned(axis: tuple[int, int, int], angle: float) -> Transform:
    return Transform(rotation=rotation_about(axis, angle))


def wobble_poses(shaft: float) -> Array:
    """The plate's pin stays in the plane y = 0: tan(plate) = -cos(tilt) tan(shaft)."""
    plate = -np.arctan2(np.sin(shaft) * np.cos(TILT), np.cos(shaft))
    first = turned((0, 0, 1), shaft)
    second = first @ turned((0, 1, 0), TILT) @ turned((0, 0, 1), plate)
    poses = [first.matrix, second.matrix]
    for place in PLACES:
        x, y, z = np.subtract(second.apply(place), place)
        poses.append(transl(place[0], place[1], z + np.sqrt(ROD**2 - x**2 - y**2)).matrix)
    return np.array(poses)


def wobble_plate() -> Robot:
    """A shaft with an inclined plate, which a pin keeps from rotating, and pistons on rods."""
    plate = replace(body("plate", "shaft", turned((0, 1, 0), TILT)), centre_of_mass=(0, 0, 0.004))
    pistons = [
        Link(name=f"piston{k}", joint=Prismatic(), before=Transform.from_matrix(pose), mass=0.15)
        for k, pose in enumerate(wobble_poses(0.0)[2:])
    ]
    rods = [
        Rod(
            name=f"rod{k}",
            first=Attachment(link="plate", pose=transl(*place)),
            second=Attachment(link=f"piston{k}"),
            length=ROD,
        )
        for k, place in enumerate(PLACES)
    ]
    pin = PointOnPlane(
        name="pin",
        first=Attachment(pose=turned((1, 0, 0), -np.pi / 2)),
        second=Attachment(link="plate", pose=transl(0.06, 0, 0)),
    )
    return Robot(name="wobble plate", links=(body("shaft"), plate, *pistons), constraints=(pin, *rods))


def body(
    name: str, parent: str | None = None, before: Transform | None = None, *, after: Transform | None = None
) -> Link:
    return Link(
        name=name,
        parent=parent,
        joint=Revolute(),
        before=before or Transform(),
        after=after or Transform(),
        mass=0.8,
        centre_of_mass=(0.02, 0.01, 0.03),
        inertia=np.diag((0.01, 0.02, 0.025)),
    )


A, ALPHA, BEND = 0.5, 0.6, 0.9
"""Length and twist of the common link, and the angle between the two links that are joined, m and rad."""
LENGTHS = {"first": 0.75, "second": 0.62}


def twist(length: float) -> float:
    """Bennett's condition."""
    return float(np.arcsin(length / A * np.sin(ALPHA)))


def opposite(length: float, angle: float) -> float:
    """The angle of a Bennett linkage at the other end of the common link."""
    product = np.sin((twist(length) + ALPHA) / 2) / np.sin((twist(length) - ALPHA) / 2)
    return float(2 * np.arctan(product / np.tan(angle / 2)))


def bar(length: float, angle: float) -> Transform:
    return Transform(rotation=rotation_about((1, 0, 0), angle), translation=(length, 0, 0))


def bennett_frames(length: float, angle: float) -> tuple[Transform, Transform, Transform]:
    """The frames of the three other links of a Bennett linkage, relative to the end of the common link."""
    near = turned((0, 0, 1), angle)
    far = near @ bar(length, twist(length)) @ turned((0, 0, 1), -opposite(length, angle))
    return near, far, far @ bar(A, ALPHA) @ turned((0, 0, 1), -angle)


def goldberg_poses(angle: float) -> Array:
    """M. Goldberg 1943: two Bennett linkages, joined at a link, without the link that both have."""
    near, *chain = bennett_frames(LENGTHS["first"], angle)
    _, *other = bennett_frames(LENGTHS["second"], angle + BEND)
    return np.array([(near.inverse() @ T).matrix for T in (*chain, *reversed(other))])


def goldberg(angle: float) -> Robot:
    first, second, third, fourth = (Transform.from_matrix(T) for T in goldberg_poses(angle))
    near, _, _ = bennett_frames(LENGTHS["first"], angle)
    other, _, _ = bennett_frames(LENGTHS["second"], angle + BEND)
    common, far = bar(LENGTHS["second"], twist(LENGTHS["second"])), bar(A, ALPHA)
    links = (
        body("l1", None, first),
        body("l2", "l1", first.inverse() @ second),
        body("l3", "l2", second.inverse() @ third @ common, after=common.inverse()),
        body("l4", "l3", third.inverse() @ fourth @ far, after=far.inverse()),
    )
    last = RevoluteClosure(
        name="last",
        first=Attachment(pose=near.inverse() @ other @ common),
        second=Attachment(link="l4"),
    )
    return Robot(name="Goldberg", links=links, constraints=(last,))


def acceleration(robot: Robot, poses: Poses, s: float, rate: float, force: float) -> float:
    """The second derivative of s by Lagrange's equation; ``force`` is the generalised force of s."""
    h = 1e-3

    def derivative(f: Callable[[float], Array | float], at: float) -> Array | float:
        return (8 * (f(at + h) - f(at - h)) - (f(at + 2 * h) - f(at - 2 * h))) / (12 * h)

    def inertia(at: float) -> float:
        total, rates, now = 0.0, derivative(poses, at), poses(at)
        for link, T, dT in zip(robot.links, now, rates):
            v, W = dT[:3, 3] + dT[:3, :3] @ link.r, T[:3, :3].T @ dT[:3, :3]
            w = np.array([W[2, 1], W[0, 2], W[1, 0]])
            total += link.mass * v @ v + w @ link.I @ w
        return total

    def potential(at: float) -> float:
        heights = [T[:3, 3] + T[:3, :3] @ link.r for link, T in zip(robot.links, poses(at))]
        return -sum(link.mass * np.dot(robot.gravity, p) for link, p in zip(robot.links, heights))

    rest = force - derivative(inertia, s) * rate**2 / 2 - derivative(potential, s)
    return float(rest / inertia(s))


def angle_of(T: Array, start: Array) -> float:
    R = start[:3, :3].T @ T[:3, :3]
    return float(np.arctan2(R[1, 0], R[0, 0]))


@pytest.mark.parametrize(
    ("robot", "poses", "values", "redundant"),
    [
        (wobble_plate(), wobble_poses, np.linspace(0.0, 6.5, 14), {}),
        (goldberg(1.1), goldberg_poses, np.linspace(1.1, 1.9, 4), {"last": 2}),
    ],
    ids=("wobble plate", "Goldberg"),
)
def test_poses_and_accelerations_equal_closed_forms(
    robot: Robot, poses: Poses, values: Array, redundant: dict[str, int]
) -> None:
    mechanism, q = Mechanism(robot), robot.neutral
    mobility = mechanism.mobility(q)
    assert (mobility.degrees_of_freedom, len(mobility.redundant)) == (1, sum(redundant.values()))
    joint, first = robot.joint_names[:1], np.eye(robot.n)[0]
    start, placed = poses(float(values[0]))[0], trace_link_poses(robot)

    def crank(s: float) -> float:
        return angle_of(poses(s)[0], start)

    for k, s in enumerate(values.tolist()):
        guess = q.copy()
        guess[0] += (crank(s) - q[0] + np.pi) % (2 * np.pi) - np.pi
        q = mechanism.assembled(guess, joint)
        assert placed(q)[0][1:-1] == pytest.approx(poses(s), abs=1e-10)
        if k not in (2, 9):
            continue
        h, rate, torque = 1e-4, 1.3, 0.7
        slope = (crank(s + h) - crank(s - h)) / (2 * h)
        bend = (crank(s + h) - 2 * crank(s) + crank(s - h)) / h**2
        qd = mechanism.consistent_speeds(q, slope * rate * first, joint)
        second = slope * acceleration(robot, poses, s, rate, torque * slope) + bend * rate**2
        driven = replace(
            robot, constraints=(*robot.constraints, PrescribedMotion(name="drive", joint=joint[0]))
        )
        _, tau = trace_hybrid_dynamics(driven, near=q)(q, qd, np.zeros(robot.n), second * first)
        # Differences of the closed form with steps of 1e-4 and 1e-3.
        assert tau[0] == pytest.approx(torque, abs=1e-5)
