"""The geometric Jacobian of the tool, and manipulability."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

from casadi import SX, fabs, fmax, horzcat, sqrt, vertcat

from armblocks.dynamics.joint_motion import joint_motions
from armblocks.dynamics.kinematics import Pose, body_poses, constant_pose, frame_pose
from armblocks.robot.tree import BASE, KinematicTree
from armblocks.spatial import Transform
from armblocks.spatial.vectors import (
    ZERO,
    Rotation,
    RotationZ,
    Scalar,
    Vector,
    add,
    cross,
    scale,
    subtract,
)

Column = tuple[Vector, Vector]
"""Linear and angular velocity of the tool per unit speed of one joint."""

MAX_COLUMNS_BY_MINORS = 8
"""Maximum number of joints for which all 6x6 minors are computed; for more, the Gram matrix is cheaper."""


def world_columns(tree: KinematicTree, q: Sequence[Scalar]) -> list[Column]:
    """Columns of ``jacob0``: velocities of the tool's origin in world axes."""
    ground = constant_pose(tree.base)
    bodies = body_poses(tree, q, ground)
    tool = frame_pose(tree.tool, bodies, ground)
    return columns_at(tree, bodies, tool.p)


def tool_columns(tree: KinematicTree, q: SX) -> list[Column]:
    """Columns of ``jacobe``: velocities of the tool's origin in tool axes.

    Poses are propagated from the tool towards the base, so that no rotation to world axes and back is needed.
    """
    columns: list[Column] = [(ZERO, ZERO)] * tree.n
    carrier = tree.tool.body
    joints = joint_motions(tree, q)
    pose = constant_pose(tree.tool.pose.inverse())
    for i in () if carrier == BASE else (carrier, *tree.ancestors(carrier)):
        body = tree.bodies[i]
        w = scale(body.angular, pose.z)
        # Here the tool's origin is the reference point: z x (0 - p) = p x z.
        v = add(cross(pose.p, w), scale(body.linear, pose.z))
        columns[body.speed] = (v, w)
        parent = _rotated_back(pose, joints[i].rotation).after(
            Transform(rotation=body.placement.inverse().rotation)
        )
        pose = parent._replace(p=subtract(pose.p, parent.rotate(joints[i].p)))
    return columns


def _rotated_back(pose: Pose, rotation: RotationZ | Rotation) -> Pose:
    """The pose of the frame before a rotation, from the pose of the frame after it."""
    if isinstance(rotation, Rotation):
        rows = [pose.rotate(row) for row in rotation.R]
        return Pose(rows[0], rows[1], rows[2], pose.p)
    c, s = rotation
    x = subtract(scale(c, pose.x), scale(s, pose.y))
    y = add(scale(s, pose.x), scale(c, pose.y))
    return Pose(x, y, pose.z, pose.p)


def columns_at(tree: KinematicTree, bodies: Sequence[Pose], tip: Vector) -> list[Column]:
    """The columns for the poses of all bodies and the position ``tip`` of the tool, in the world.

    They are zero for joints that are not between base and tool.

    ``v = angular z x (tip - p) + linear z`` and ``w = angular z``. Source: Siciliano, Sciavicco, Villani,
    Oriolo, *Robotics*, 3.1.3.
    """
    columns: list[Column] = [(ZERO, ZERO)] * tree.n
    carrier = tree.tool.body
    for i in () if carrier == BASE else (carrier, *tree.ancestors(carrier)):
        body, pose = tree.bodies[i], bodies[i]
        w = scale(body.angular, pose.z)
        v = cross(w, subtract(tip, pose.p)) if body.angular else ZERO
        columns[body.speed] = (add(v, scale(body.linear, pose.z)), w)
    return columns


def jacobian_matrix(columns: Sequence[Column]) -> SX:
    """The Jacobian (6, n): three linear rows, then three angular rows."""
    return SX(horzcat(*(vertcat(*v, *w) for v, w in columns)))


def yoshikawa(columns: Sequence[Column]) -> SX:
    """Yoshikawa's measure: the product of the min(6, n) singular values of the Jacobian."""
    return singular_value_product([list(v + w) for v, w in columns])


def singular_value_product(entries: Sequence[Sequence[Scalar]]) -> SX:
    """The product of the singular values of a Jacobian, or of some of its rows, given by its n columns.

    Of six rows it is ``sqrt(det(J J'))`` for six joints or more, and ``sqrt(det(J' J))`` for fewer, for which
    the toolbox's formula is zero. By the Cauchy-Binet formula it is the square root of the sum of all squared
    minors. This formula has no cancellation and no division, so it is accurate near a singularity. For more
    than eight joints there are too many minors, and ``det(J J')`` is computed directly. Source: Yoshikawa,
    *Manipulability of Robotic Mechanisms*, IJRR 1985.
    """
    n = len(entries)
    if n > MAX_COLUMNS_BY_MINORS:
        rows = list(zip(*entries))
        gram = [[_dot(a, b) for b in rows] for a in rows]
        return SX(sqrt(fmax(_minors(gram)[0], 0.0)))
    wide = entries if n <= len(entries[0]) else list(zip(*entries))
    minors = _minors(wide)
    if len(minors) == 1:
        return SX(fabs(minors[0]))
    return SX(sqrt(_dot(minors, minors)))


def _minors(rows: Sequence[Sequence[Scalar]]) -> list[SX]:
    """All minors of full height, by Laplace expansion row by row; every smaller minor is computed once."""
    width = len(rows[0])
    minors: dict[tuple[int, ...], Scalar] = {(): 1.0}
    for height, row in enumerate(rows, start=1):
        larger_minors: dict[tuple[int, ...], Scalar] = {}
        for chosen in combinations(range(width), height):
            total: Scalar = 0.0
            for index, column in enumerate(chosen):
                term = row[column] * minors[chosen[:index] + chosen[index + 1 :]]
                total = total + term if (height - 1 - index) % 2 == 0 else total - term
            larger_minors[chosen] = total
        minors = larger_minors
    assert len(minors) == math.comb(width, len(rows))
    return [SX(minor) for minor in minors.values()]


def _dot(a: Sequence[Scalar], b: Sequence[Scalar]) -> SX:
    total: Scalar = 0.0
    for x, y in zip(a, b):
        total = total + x * y
    return SX(total)
