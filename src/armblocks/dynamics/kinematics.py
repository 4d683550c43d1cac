"""Poses of all bodies, links and the tool, in symbols."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from casadi import SX, horzcat, vertcat

from armblocks.dynamics.ball_joints import ball_rotation
from armblocks.dynamics.joint_motion import cos_sin
from armblocks.robot.tree import BASE, Body, Frame, KinematicTree
from armblocks.spatial import IDENTITY3, Transform
from armblocks.spatial.vectors import ZERO, RotationZ, Scalar, Vector, add, scale, transpose


class Pose(NamedTuple):
    """Rotation and position (m) of a frame; its columns are x, y, z."""

    x: Vector
    y: Vector
    z: Vector
    p: Vector

    def rotate(self, a: Vector) -> Vector:
        """The rotated vector ``R a``."""
        return add(add(scale(a[0], self.x), scale(a[1], self.y)), scale(a[2], self.z))

    def point(self, a: Vector) -> Vector:
        """The transformed point ``T a``."""
        return add(self.p, self.rotate(a))

    def after(self, T: Transform) -> Pose:
        """The product of this pose and the constant transform ``T``."""
        R = T.rotation
        x, y, z = (self.rotate((R[0][j], R[1][j], R[2][j])) for j in range(3))
        return Pose(x, y, z, self.point(T.translation))

    def matrix(self) -> SX:
        """The homogeneous matrix, (4, 4)."""
        columns = [vertcat(*column, 0.0) for column in (self.x, self.y, self.z)]
        return SX(horzcat(*columns, vertcat(*self.p, 1.0)))


class _RotatedPose(NamedTuple):
    """A pose in the form ``start Rz(variable + constant)``.

    For joints with parallel axes, angles are then added instead of multiplying matrices.
    """

    start: Pose
    variable: Scalar
    constant: float
    rotation: RotationZ
    pose: Pose


def constant_pose(T: Transform) -> Pose:
    """The pose of a constant transform."""
    R = T.rotation
    x, y, z = ((R[0][j], R[1][j], R[2][j]) for j in range(3))
    return Pose(x, y, z, T.translation)


def body_poses(tree: KinematicTree, q: Sequence[Scalar], ground: Pose) -> list[Pose]:
    """Poses of all bodies with the base at ``ground``; q in the robot's order, rad or m."""
    base = _RotatedPose(ground, 0.0, 0.0, RotationZ(1.0, 0.0), ground)
    rotated: list[_RotatedPose] = []
    for body in tree.bodies:
        parent = base if body.parent == BASE else rotated[body.parent]
        rotated.append(_body_pose(parent, body, q) if body.ball is None else _ball_pose(parent, body, q))
    return [entry.pose for entry in rotated]


def _ball_pose(parent: _RotatedPose, body: Body, q: Sequence[Scalar]) -> _RotatedPose:
    """The pose of a body of a ball joint, from the pose of its parent."""
    before = parent.pose.after(body.placement)
    rotation = ball_rotation(body, q)
    x, y, z = (before.rotate(column) for column in transpose(rotation.matrix()))
    pose = Pose(x, y, z, before.p)
    return _RotatedPose(pose, 0.0, 0.0, RotationZ(1.0, 0.0), pose)


def _body_pose(parent: _RotatedPose, body: Body, coordinates: Sequence[Scalar]) -> _RotatedPose:
    """The pose of a body on an axis, from the pose of its parent."""
    q = coordinates[body.position]
    p = parent.start.rotate(parent.rotation.rotate(body.placement.translation))
    p = add(parent.pose.p, p)
    if body.placement.rotation == IDENTITY3:
        start, variable, constant = parent.start, parent.variable, parent.constant
    else:
        start = parent.pose.after(Transform(rotation=body.placement.rotation))
        variable, constant = 0.0, 0.0
    if body.linear:
        p = add(p, scale(body.linear * q + body.linear * body.offset, start.z))
    if body.angular:
        variable = variable + body.angular * q
        constant = constant + body.angular * body.offset
    rotation = cos_sin(variable, constant) if isinstance(variable, SX) else RotationZ(1.0, 0.0)
    x = add(scale(rotation.c, start.x), scale(rotation.s, start.y))
    y = add(scale(rotation.c, start.y), scale(-rotation.s, start.x))
    start = Pose(start.x, start.y, start.z, ZERO)
    return _RotatedPose(start, variable, constant, rotation, Pose(x, y, start.z, p))


def frame_pose(frame: Frame, bodies: Sequence[Pose], ground: Pose) -> Pose:
    """The pose of a frame that is fixed to a body or to the base."""
    carrier = ground if frame.body == BASE else bodies[frame.body]
    return carrier.after(frame.pose)
