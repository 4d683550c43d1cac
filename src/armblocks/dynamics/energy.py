"""Energies and the centre of mass."""

from __future__ import annotations

from collections.abc import Sequence

from armblocks.dynamics.joint_motion import JointMotion
from armblocks.robot.tree import BASE, KinematicTree
from armblocks.spatial.vectors import (
    ZERO,
    Scalar,
    Vector,
    add,
    cross,
    dot,
    multiply_symmetric,
    rotate,
    scale,
)


def kinetic_energy(tree: KinematicTree, joints: Sequence[JointMotion], qd: Sequence[Scalar]) -> Scalar:
    """Kinetic energy of all bodies and rotors, J.

    This energy is the sum of ``(m v.v + 2 v.(w x h) + w.I w) / 2`` and ``G^2 Jm qd^2 / 2``.
    """
    omegas: list[Vector] = []
    velocities: list[Vector] = []
    doubled_energy: Scalar = 0.0
    for body, joint in zip(tree.bodies, joints):
        w, v = ZERO, ZERO
        if body.parent != BASE:
            w_parent = omegas[body.parent]
            w = joint.to_body(w_parent)
            v = joint.to_body(add(velocities[body.parent], cross(w_parent, joint.p)))
        rate = qd[body.speed]
        w = (w[0], w[1], w[2] + body.angular * rate)
        v = (v[0], v[1], v[2] + body.linear * rate)
        omegas.append(w)
        velocities.append(v)
        m, h, S = body.inertia
        momentum = add(scale(m, v), scale(2.0, cross(w, h)))
        doubled_energy = doubled_energy + dot(v, momentum) + dot(w, multiply_symmetric(S, w))
        doubled_energy = doubled_energy + body.reflected_inertia * (rate * rate)
    return 0.5 * doubled_energy


def first_moment(tree: KinematicTree, joints: Sequence[JointMotion]) -> tuple[Scalar, Vector]:
    """Total mass (kg), and ``sum m c`` of the whole robot in the base frame (kg m)."""
    moments: list[Vector] = [body.inertia.first for body in tree.bodies]
    masses: list[Scalar] = [body.inertia.mass for body in tree.bodies]
    total, moment = tree.grounded.mass, tree.grounded.first
    for i in reversed(range(tree.n)):
        parent = tree.bodies[i].parent
        carried = add(joints[i].to_parent(moments[i]), scale(masses[i], joints[i].p))
        if parent == BASE:
            total, moment = total + masses[i], add(moment, carried)
        else:
            moments[parent] = add(moments[parent], carried)
            masses[parent] = masses[parent] + masses[i]
    return total, moment


def potential_energy(tree: KinematicTree, joints: Sequence[JointMotion]) -> Scalar:
    """Potential energy in gravity, J: ``-g . sum m c``, zero with the centre of mass at the world origin."""
    mass, moment = first_moment(tree, joints)
    in_base = dot(tree.gravity, moment)
    to_base = tree.base.translation
    world_gravity = rotate(tree.base.rotation, tree.gravity)
    return -(in_base + mass * dot(world_gravity, to_base))
