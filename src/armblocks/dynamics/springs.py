"""Torques and energy of the springs of a robot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from casadi import SX, sqrt

from armblocks.dynamics.constraint_equations import FramePair, attached_frame
from armblocks.dynamics.joint_motion import entries
from armblocks.dynamics.kinematics import Pose, body_poses, constant_pose, frame_pose
from armblocks.robot.constraints import Distance
from armblocks.robot.springs import JointSpring, LineSpring
from armblocks.robot.tree import KinematicTree
from armblocks.spatial import Transform
from armblocks.spatial.vectors import Scalar, Vector, dot, scale, subtract


def spring_torques(tree: KinematicTree, q: SX) -> list[Scalar]:
    """The torques that hold the springs (N m, N): the derivatives of their energy with respect to q.

    The torques have the sign of gravity loads and are added to ``tau``, in the order of qd. ``q`` (nq, 1):
    the coordinates of all joints of the tree.
    """
    torques: list[Scalar] = [0.0] * tree.n
    for spring, extension, speed in _joint_springs(tree, q):
        torques[speed] = torques[speed] + spring.stiffness * extension
    lines = _line_springs(tree)
    if lines:
        ground = constant_pose(Transform())
        bodies = body_poses(tree, entries(q), ground)
        for spring in lines:
            frames = FramePair.of(tree, spring.first, spring.second, bodies, ground)
            distance = sqrt(SX(dot(frames.displacement, frames.displacement)))
            # The row of this relation is the derivative of half the squared distance.
            _, row = frames.equation(Distance(1.0))
            factor = _tension(spring, distance) / distance
            torques = [total + factor * entry for total, entry in zip(torques, row)]
    return torques


def spring_energy(tree: KinematicTree, q: SX) -> Scalar:
    """The energy of the springs, J. The energy of a line spring is 0 at its ``length``."""
    energy: Scalar = 0.0
    for spring, extension, _ in _joint_springs(tree, q):
        energy = energy + 0.5 * spring.stiffness * (extension * extension)
    lines = _line_springs(tree)
    if lines:
        ground = constant_pose(Transform())
        bodies = body_poses(tree, entries(q), ground)
        for spring in lines:
            a, b = _points(tree, spring, bodies, ground)
            displacement = subtract(b, a)
            extension = sqrt(SX(dot(displacement, displacement))) - spring.length
            energy = energy + extension * (spring.preload + 0.5 * spring.stiffness * extension)
    return energy


class SpringForce(NamedTuple):
    """The force (N) of a line spring on its second link at the point ``at`` (m), in base axes."""

    spring: LineSpring
    force: Vector
    at: Vector


def spring_forces(tree: KinematicTree, bodies: Sequence[Pose], ground: Pose) -> Iterator[SpringForce]:
    """The forces of the line springs; the first link has the opposite force along the same line."""
    for spring in _line_springs(tree):
        a, b = _points(tree, spring, bodies, ground)
        displacement = subtract(b, a)
        distance = sqrt(SX(dot(displacement, displacement)))
        yield SpringForce(spring, scale(-_tension(spring, distance) / distance, displacement), b)


def _line_springs(tree: KinematicTree) -> list[LineSpring]:
    return [spring for spring in tree.robot.springs if isinstance(spring, LineSpring)]


def _joint_springs(tree: KinematicTree, q: SX) -> Iterator[tuple[JointSpring, Scalar, int]]:
    """The joint springs, with their extension (rad or m) and the index of the joint in qd."""
    bodies = {body.link: body for body in tree.bodies}
    for spring in tree.robot.springs:
        if isinstance(spring, JointSpring):
            body = bodies[spring.joint]
            extension = q[body.position] - spring.rest if spring.rest else q[body.position]
            yield spring, extension, body.speed


def _points(
    tree: KinematicTree, spring: LineSpring, bodies: Sequence[Pose], ground: Pose
) -> tuple[Vector, Vector]:
    ends = [attached_frame(tree, end) for end in (spring.first, spring.second)]
    a, b = (frame_pose(end, bodies, ground).p for end in ends)
    return a, b


def _tension(spring: LineSpring, distance: SX) -> SX:
    """The force with which the points attract each other, N."""
    return SX(spring.preload + spring.stiffness * (distance - spring.length))
