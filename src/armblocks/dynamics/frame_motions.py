"""Poses, velocities and accelerations of frames on bodies, and wrenches at frames, in base axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from casadi import SX

from armblocks.dynamics.joint_motion import JointMotion, joint_motions
from armblocks.dynamics.kinematics import Pose, body_poses, constant_pose, frame_pose
from armblocks.dynamics.rnea import BodyMotion, Wrench, body_motions
from armblocks.robot.tree import BASE, Frame, KinematicTree
from armblocks.spatial import Transform
from armblocks.spatial.vectors import ZERO, Scalar, Vector, add, cross, dot, rotate, scale


class Twist(NamedTuple):
    """The velocity of a body in its axes: angular (rad/s), and of the origin (m/s)."""

    angular: Vector
    linear: Vector


def body_twists(tree: KinematicTree, joints: Sequence[JointMotion], qd: Sequence[Scalar]) -> list[Twist]:
    """The velocities of all bodies relative to the base, each in the axes of the body."""
    twists: list[Twist] = []
    for body, joint in zip(tree.bodies, joints):
        w, v = ZERO, ZERO
        if body.parent != BASE:
            parent = twists[body.parent]
            w = joint.to_body(parent.angular)
            v = joint.to_body(add(parent.linear, cross(parent.angular, joint.p)))
        rate = qd[body.speed]
        twists.append(
            Twist((w[0], w[1], w[2] + body.angular * rate), (v[0], v[1], v[2] + body.linear * rate))
        )
    return twists


class FramesOfTree:
    """The motions of frames of a tree at one state, for symbols or numbers.

    ``q`` (nq, 1), ``qd``, ``qdd``: of all joints of the tree, rad or m; without ``qdd``, there are no
    accelerations. All results are in base axes.
    """

    def __init__(
        self, tree: KinematicTree, q: SX, qd: Sequence[Scalar], qdd: Sequence[Scalar] | None = None
    ) -> None:
        self._ground = constant_pose(Transform())
        joints = joint_motions(tree, q)
        self._poses = body_poses(tree, [q[i] for i in range(q.numel())], self._ground)
        self._twists = body_twists(tree, joints, qd)
        self._motions: list[BodyMotion] = [] if qdd is None else body_motions(tree, joints, qd, qdd, ZERO)

    def pose(self, frame: Frame) -> Pose:
        """The pose of a frame."""
        return frame_pose(frame, self._poses, self._ground)

    def velocity(self, frame: Frame) -> tuple[Vector, Vector]:
        """The velocity of the origin (m/s), and the angular velocity (rad/s)."""
        if frame.body == BASE:
            return ZERO, ZERO
        twist, pose = self._twists[frame.body], self._poses[frame.body]
        linear = add(twist.linear, cross(twist.angular, frame.pose.translation))
        return pose.rotate(linear), pose.rotate(twist.angular)

    def acceleration(self, frame: Frame) -> tuple[Vector, Vector]:
        """The acceleration of the origin (m/s2), and the angular acceleration (rad/s2)."""
        if frame.body == BASE:
            return ZERO, ZERO
        motion, pose = self._motions[frame.body + 1], self._poses[frame.body]
        at_origin = add(motion.acceleration, rotate(motion.U, frame.pose.translation))
        return pose.rotate(at_origin), pose.rotate(motion.alpha)

    def on_bodies(self, loads: Sequence[tuple[Frame, Vector, Vector]]) -> Mapping[int, Wrench]:
        """The wrenches that bodies exert on their surroundings, see :func:`armblocks.dynamics.rnea.rnea`.

        ``loads``: forces (N) and moments (N m) *on* the bodies, at the origins of frames, in base axes.
        Loads on the base have no effect.
        """
        wrenches: dict[int, Wrench] = {}
        for frame, force, moment in loads:
            if frame.body == BASE:
                continue
            pose = self._poses[frame.body]
            f, n = (_in_axes(pose, scale(-1.0, value)) for value in (force, moment))
            own = Wrench(f, add(n, cross(frame.pose.translation, f)))
            known = wrenches.get(frame.body)
            wrenches[frame.body] = own if known is None else Wrench(*(add(a, b) for a, b in zip(known, own)))
        return wrenches


def _in_axes(pose: Pose, a: Vector) -> Vector:
    return dot(pose.x, a), dot(pose.y, a), dot(pose.z, a)
