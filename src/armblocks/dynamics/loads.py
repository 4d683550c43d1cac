"""Loads and bodies whose values are known only at run time: a wrench at the tip, a payload on the tool."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from casadi import SX

from armblocks.dynamics.joint_motion import entries
from armblocks.dynamics.rnea import Wrench
from armblocks.equations import Slot
from armblocks.robot.robot import Robot
from armblocks.robot.tree import BASE, Frame, KinematicTree
from armblocks.spatial.inertia import RigidInertia
from armblocks.spatial.vectors import Symmetric, Vector, add, cross, rotate

WRENCH_SLOT = Slot("wrench", (6,), "N, N m")
"""Force, then moment, of the tip on the environment, about the last link's origin in its axes."""
PAYLOAD_SLOT = Slot("payload", (10,), "kg, m, kg m2")
"""Mass, centre x y z, inertia xx yy zz xy yz xz about that centre, all in the tool frame."""


def with_payload(tree: KinematicTree, payload: SX) -> KinematicTree:
    """The tree with a payload on its tool; unchanged if the tool is fixed to the base."""
    tool = tree.tool
    if tool.body == BASE:
        return tree
    mass, x, y, z, *second = entries(payload)
    return with_inertias(tree, [(tool, RigidInertia.at_centre(mass, Symmetric(*second)).shifted((x, y, z)))])


def with_inertias(tree: KinematicTree, added: Iterable[tuple[Frame, RigidInertia]]) -> KinematicTree:
    """The tree with more bodies that are fixed to frames; their inertias are in the axes of these frames."""
    bodies, grounded = list(tree.bodies), tree.grounded
    for frame, inertia in added:
        load = inertia.moved(frame.pose)
        if frame.body == BASE:
            grounded = grounded.plus(load)
        else:
            carrier = bodies[frame.body]
            bodies[frame.body] = replace(carrier, inertia=carrier.inertia.plus(load))
    return replace(tree, bodies=tuple(bodies), grounded=grounded)


def tip_loads(robot: Robot, wrench: SX, payload: SX) -> tuple[Wrench, RigidInertia]:
    """A wrench at the frame of the last link, and the inertia of a payload at the tool in this frame."""
    fx, fy, fz, nx, ny, nz = entries(wrench)
    mass, x, y, z, *second = entries(payload)
    load = RigidInertia.at_centre(mass, Symmetric(*second)).shifted((x, y, z)).moved(robot.tool)
    return Wrench((fx, fy, fz), (nx, ny, nz)), load


def tip_wrench(tree: KinematicTree, wrench: SX) -> dict[int, Wrench]:
    """A wrench at the frame of the last link, by the index and in the frame of the body of this link."""
    tip = tree.tip
    if tip.body == BASE:
        return {}
    fx, fy, fz, nx, ny, nz = entries(wrench)
    R, p = tip.pose.rotation, tip.pose.translation
    force = rotate(R, (fx, fy, fz))
    moment: Vector = add(rotate(R, (nx, ny, nz)), cross(p, force))
    return {tip.body: Wrench(force, moment)}
