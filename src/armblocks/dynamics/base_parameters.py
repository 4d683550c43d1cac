"""Regrouped inertial parameters, with which inverse dynamics has fewer terms and the same result."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

from armblocks.dynamics.coupled_parameters import regrouped_by_couplings
from armblocks.robot.robot import Robot
from armblocks.robot.tree import BASE, Body, KinematicTree
from armblocks.spatial import Transform, transl
from armblocks.spatial.inertia import NO_INERTIA, RigidInertia
from armblocks.spatial.vectors import ZERO, Symmetric


def base_parameter_tree(robot: Robot) -> KinematicTree:
    """The tree of a robot with regrouped parameters, for functions of its independent coordinates."""
    if not robot.couplings:
        return regrouped(KinematicTree.of(robot))
    # Robots that compare equal may differ in the sign of a zero. The text of the links distinguishes them in
    # the cache.
    return _coupled_tree(robot, repr([replace(link, geometry=None) for link in robot.links]))


@lru_cache(maxsize=64)
def _coupled_tree(robot: Robot, links: str) -> KinematicTree:
    """The tree of a robot with couplings; ``links``: their numbers as text."""
    return regrouped_by_couplings(regrouped(KinematicTree.of(robot)), robot)


def regrouped(tree: KinematicTree) -> KinematicTree:
    """A tree with the same equations of motion and the minimum number of inertial parameters.

    Some parameters of a body have the same effect as parameters of its parent and are added to these. For a
    revolute joint they are the mass, the first moment along the axis, and an inertia that is equal about all
    directions normal to the axis; for a prismatic joint the whole inertia matrix; for a ball joint the mass.
    Before that, each body's origin is shifted along its joint axis to the foot of the common normal with the
    next axis. This removes products with the distance between them.

    Joint torques, mass matrix and kinetic energy are unchanged; the inertia of a single body changes.
    Source: Khalil, Dombre, *Modeling, Identification and Control of Robots*, 9.4 (base inertial parameters).
    """
    tree = _origins_on_common_normals(tree)
    inertias = [body.inertia for body in tree.bodies]
    for i in reversed(range(tree.n)):
        body = tree.bodies[i]
        shared = _shared_with_parent(inertias[i], body)
        inertias[i] = _without(inertias[i], shared)
        if body.parent != BASE:
            inertias[body.parent] = inertias[body.parent].plus(shared.moved(body.placement))
    bodies = tuple(replace(body, inertia=inertia) for body, inertia in zip(tree.bodies, inertias))
    return replace(tree, bodies=bodies)


def _shared_with_parent(inertia: RigidInertia, body: Body) -> RigidInertia:
    """The part of the inertia that can be assigned to either side of the body's joint."""
    if body.ball is not None:
        # Only the centre of a ball joint is fixed to both sides.
        return RigidInertia(inertia.mass, ZERO, NO_INERTIA)
    second = inertia.second
    if body.angular:
        # Equal normal to the axis and zero about it: a rotation about the axis changes neither this inertia
        # nor its momentum.
        second = Symmetric(second.yy, second.yy, 0.0, 0.0, 0.0, 0.0)
    if body.linear:
        # Without mass a translation causes no momentum; without first moment it does not change the inertia.
        return RigidInertia(0.0, ZERO, second)
    return RigidInertia(inertia.mass, (0.0, 0.0, inertia.first[2]), second)


def _without(inertia: RigidInertia, part: RigidInertia) -> RigidInertia:
    """``inertia`` minus ``part``, exactly zero in the entries that are equal."""
    mass, first, second = inertia
    return RigidInertia(
        mass - part.mass,
        (first[0] - part.first[0], first[1] - part.first[1], first[2] - part.first[2]),
        Symmetric(*(a - b for a, b in zip(second, part.second))),
    )


def _origins_on_common_normals(tree: KinematicTree) -> KinematicTree:
    """Shift each body's origin along its axis so that the origin of its first child has z = 0.

    The origins of the bodies of a ball joint stay at its centre.
    """
    bodies = list(tree.bodies)
    links = list(tree.links)
    for i in reversed(range(tree.n)):
        children = [k for k, body in enumerate(bodies) if body.parent == i]
        if not children or bodies[i].ball is not None:
            continue
        shift = bodies[children[0]].placement.translation[2]
        to_new_origin, to_old_origin = transl(0.0, 0.0, shift), transl(0.0, 0.0, -shift)
        bodies[i] = replace(
            bodies[i],
            placement=bodies[i].placement @ to_new_origin,
            inertia=bodies[i].inertia.moved(to_old_origin),
        )
        for k in children:
            bodies[k] = replace(
                bodies[k], placement=_shifted_placement(to_old_origin @ bodies[k].placement, k == children[0])
            )
        links = [
            replace(frame, pose=to_old_origin @ frame.pose) if frame.body == i else frame for frame in links
        ]
    return replace(tree, bodies=tuple(bodies), links=tuple(links))


def _shifted_placement(placement: Transform, z_is_zero: bool) -> Transform:
    """The placement, with z exactly zero if ``z_is_zero``."""
    x, y, z = placement.translation
    return Transform(rotation=placement.rotation, translation=(x, y, 0.0 if z_is_zero else z))
