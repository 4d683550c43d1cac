"""Inverse dynamics: the recursive Newton-Euler algorithm, in link frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from armblocks.dynamics.ball_joints import axis_accelerations
from armblocks.dynamics.joint_motion import JointMotion
from armblocks.robot.tree import BASE, KinematicTree
from armblocks.spatial.inertia import RigidInertia
from armblocks.spatial.vectors import ZERO, Matrix, Scalar, Vector, add, cross, rotate, scale


class Wrench(NamedTuple):
    """A force (N) and a moment (N m) about the origin of its frame."""

    force: Vector
    moment: Vector


NO_WRENCH = Wrench(ZERO, ZERO)


class BodyMotion(NamedTuple):
    """The motion of one body, in the axes of the body.

    ``omega`` is the angular velocity (rad/s), ``alpha`` the angular acceleration (rad/s2), ``acceleration``
    the acceleration of the origin (m/s2). ``U = [alpha]x + [omega]x [omega]x`` maps a point to its
    acceleration relative to the origin.
    """

    omega: Vector
    alpha: Vector
    acceleration: Vector
    U: Matrix


def rnea(
    tree: KinematicTree,
    joints: Sequence[JointMotion],
    qd: Sequence[Scalar],
    qdd: Sequence[Scalar],
    gravity: Vector,
    on_bodies: Mapping[int, Wrench] | None = None,
) -> list[Scalar]:
    """Joint torques of the rigid bodies (no motor, no friction), in the order of qd.

    ``gravity``: m/s2 in base axes. ``on_bodies``: wrenches that bodies exert on the surroundings, each in its
    body's frame. Source: Luh, Walker, Paul 1980 in the form of Khalil and Dombre, *Modeling, Identification
    and Control of Robots*, 9.5, which numbers the passes in the same way, with three-vectors in link frames.
    """
    bodies = tree.bodies
    qdd = axis_accelerations(tree, qd, qdd)
    motions: list[BodyMotion] = []
    wrenches: list[Wrench] = []
    ground = BodyMotion(ZERO, ZERO, scale(-1.0, gravity), _rotation_accelerations(ZERO, ZERO))
    for i, (body, joint) in enumerate(zip(bodies, joints)):
        # 1. Outward: velocities and accelerations. Gravity is treated as an acceleration of the base.
        motion = _body_motion(ground if body.parent == BASE else motions[body.parent], joint, qd, qdd)
        motions.append(motion)
        # 2. The net wrench on each body.
        wrench = inertial_wrench(body.inertia, motion)
        if on_bodies and i in on_bodies:
            wrench = Wrench(*(add(a, b) for a, b in zip(wrench, on_bodies[i])))
        wrenches.append(wrench)
    tau: list[Scalar] = [0.0] * len(bodies)
    # 3. Inward: every joint transmits the wrench of its body and of all distal bodies.
    for i in reversed(range(len(bodies))):
        body = bodies[i]
        force, moment = wrenches[i]
        tau[body.speed] = body.angular * moment[2] + body.linear * force[2]
        if body.parent != BASE:
            wrenches[body.parent] = _with_child_wrench(wrenches[body.parent], wrenches[i], joints[i])
    return tau


def body_motions(
    tree: KinematicTree,
    joints: Sequence[JointMotion],
    qd: Sequence[Scalar],
    qdd: Sequence[Scalar],
    gravity: Vector,
) -> list[BodyMotion]:
    """The motions of the base and of all bodies, with gravity as an acceleration of the base."""
    qdd = axis_accelerations(tree, qd, qdd)
    motions = [BodyMotion(ZERO, ZERO, scale(-1.0, gravity), _rotation_accelerations(ZERO, ZERO))]
    for body, joint in zip(tree.bodies, joints):
        motions.append(_body_motion(motions[body.parent + 1], joint, qd, qdd))
    return motions


def _body_motion(
    parent: BodyMotion, joint: JointMotion, qd: Sequence[Scalar], qdd: Sequence[Scalar]
) -> BodyMotion:
    """The motion of a body, from the motion of its parent."""
    body = joint.body
    j = body.speed
    w = joint.to_body(parent.omega)
    alpha = joint.to_body(parent.alpha)
    acceleration = joint.to_body(add(parent.acceleration, rotate(parent.U, joint.p)))
    spin, spin_acceleration = body.angular * qd[j], body.angular * qdd[j]
    if body.linear:
        linear_speed, linear_acceleration = body.linear * qd[j], body.linear * qdd[j]
        # 2 w x (linear_speed z) + linear_acceleration z. The joint's own rotation is along z and adds
        # nothing.
        acceleration = (
            acceleration[0] + 2.0 * linear_speed * w[1],
            acceleration[1] - 2.0 * linear_speed * w[0],
            acceleration[2] + linear_acceleration,
        )
    alpha = (alpha[0] + w[1] * spin, alpha[1] - w[0] * spin, alpha[2] + spin_acceleration)
    w = (w[0], w[1], w[2] + spin)
    return BodyMotion(w, alpha, acceleration, _rotation_accelerations(w, alpha))


def _rotation_accelerations(w: Vector, alpha: Vector) -> Matrix:
    """``U = [alpha]x + [w]x [w]x``."""
    xx, yy, zz = w[0] * w[0], w[1] * w[1], w[2] * w[2]
    xy, yz, xz = w[0] * w[1], w[1] * w[2], w[0] * w[2]
    return (
        (-(yy + zz), xy - alpha[2], xz + alpha[1]),
        (xy + alpha[2], -(xx + zz), yz - alpha[0]),
        (xz - alpha[1], yz + alpha[0], -(xx + yy)),
    )


def inertial_wrench(inertia: RigidInertia, motion: BodyMotion) -> Wrench:
    """The Newton-Euler equations about the body's origin.

    The force is ``m a + U h``, the moment ``I alpha + w x I w + h x a``.
    """
    w, alpha, a, U = motion
    m, h, S = inertia
    force = add(scale(m, a), rotate(U, h))
    # I alpha + w x I w, arranged so that the products in U are reused.
    gyroscopic = (
        S.xx * alpha[0]
        + (S.zz - S.yy) * (w[1] * w[2])
        + S.xz * U[1][0]
        - S.xy * U[2][0]
        + S.yz * (U[1][1] - U[2][2]),
        S.yy * alpha[1]
        + (S.xx - S.zz) * (w[0] * w[2])
        + S.xy * U[2][1]
        - S.yz * U[0][1]
        + S.xz * (U[2][2] - U[0][0]),
        S.zz * alpha[2]
        + (S.yy - S.xx) * (w[0] * w[1])
        + S.yz * U[0][2]
        - S.xz * U[1][2]
        + S.xy * (U[0][0] - U[1][1]),
    )
    return Wrench(force, add(gyroscopic, cross(h, a)))


def _with_child_wrench(parent: Wrench, child: Wrench, joint: JointMotion) -> Wrench:
    """The parent's wrench plus the wrench of a child, about the parent's origin."""
    force = joint.to_parent(child.force)
    moment = add(joint.to_parent(child.moment), cross(joint.p, force))
    return Wrench(add(parent.force, force), add(parent.moment, moment))
