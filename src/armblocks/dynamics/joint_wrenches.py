"""Reaction wrenches: the forces and moments that joints and the closures of loops transmit.

The wrench of a joint balances the inertia forces, weights and external wrenches of all links beyond it, and
the wrenches of closures that act on them. Source: Featherstone, *Rigid Body Dynamics Algorithms*, 5.3 and
8.12.
"""

from __future__ import annotations

from collections.abc import Sequence

from casadi import SX, vertcat

from armblocks.dynamics.constraint_equations import attached_frame
from armblocks.dynamics.joint_motion import joint_motions
from armblocks.dynamics.kinematics import Pose, body_poses, constant_pose, frame_pose
from armblocks.dynamics.rnea import NO_WRENCH, Wrench, body_motions, inertial_wrench
from armblocks.dynamics.springs import spring_forces
from armblocks.robot.constraints import Closure, Distance, NoDisplacement, Perpendicular
from armblocks.robot.link import Link
from armblocks.robot.springs import LineSpring
from armblocks.robot.tree import BASE, Frame, KinematicTree
from armblocks.spatial import Transform
from armblocks.spatial.inertia import RigidInertia
from armblocks.spatial.vectors import Scalar, Vector, add, cross, dot, scale, subtract


def reaction_wrenches(
    tree: KinematicTree,
    q: SX,
    qd: Sequence[Scalar],
    qdd: Sequence[Scalar],
    multipliers: Sequence[Scalar],
    loads: tuple[Wrench, RigidInertia],
) -> SX:
    """The wrenches (L + K, 6) of the joints of L links and of K closures, in the robot's order.

    ``q`` (nq, 1), ``qd``, ``qdd``: of all joints of the tree. ``multipliers``: of all relations of the
    closures. ``loads``: the wrench of the tip on its surroundings in the frame of the last link, and the
    inertia of the payload there. The parent exerts the wrench of a joint on the link, about the origin and in
    the axes of the distal frame of the joint. The wrench of a closure acts on its second frame and is given
    in this frame.
    """
    ground = constant_pose(Transform())
    bodies = body_poses(tree, [q[i] for i in range(q.numel())], ground)
    frames = {link.name: frame for link, frame in zip(tree.robot.links, tree.links)}
    carried = _carried_wrenches(tree, q, qd, qdd, bodies, ground, loads)
    closures: list[Wrench] = []
    for closure, own in zip(tree.robot.closures, _by_closure(tree.robot.closures, multipliers)):
        ends = [attached_frame(tree, end) for end in (closure.first, closure.second)]
        a, b = (frame_pose(end, bodies, ground) for end in ends)
        wrench = _closure_wrench(closure, own, a, b)  # on the second frame, about its origin, in base axes
        closures.append(_in_frame(wrench, b))
        _transmit(carried, closure, _about_base(wrench, b.p))
    for spring, force, at in spring_forces(tree, bodies, ground):
        _transmit(carried, spring, _about_base(Wrench(force, NO_WRENCH.moment), at))
    rows: dict[str, Wrench] = {}
    for link in _inward(tree.robot.links):
        total = carried[link.name]
        if link.parent is not None:
            carried[link.parent] = _sum(carried[link.parent], total)
        frame = frames[link.name]
        joint = frame_pose(Frame(body=frame.body, pose=frame.pose @ link.after.inverse()), bodies, ground)
        about_joint = Wrench(total.force, subtract(total.moment, cross(joint.p, total.force)))
        rows[link.name] = _in_frame(about_joint, joint)
    wrenches = [*(rows[link.name] for link in tree.robot.links), *closures]
    return SX(vertcat(*(vertcat(*wrench.force, *wrench.moment).T for wrench in wrenches)))


def _transmit(carried: dict[str, Wrench], between: Closure | LineSpring, wrench: Wrench) -> None:
    """Add a wrench on the second link of a closure or spring, and the opposite one on the first link.

    ``wrench``: about the origin and in the axes of the base.
    """
    for link, sign in ((between.first.link, 1.0), (between.second.link, -1.0)):
        if link is not None:
            carried[link] = _sum(carried[link], _scaled(sign, wrench))


def _inward(links: Sequence[Link]) -> list[Link]:
    """The links, children before their parents."""
    parents = {link.name: link.parent for link in links}

    def depth(link: Link) -> int:
        count, parent = 0, link.parent
        while parent is not None:
            count, parent = count + 1, parents[parent]
        return count

    return sorted(links, key=depth, reverse=True)


def _carried_wrenches(
    tree: KinematicTree,
    q: SX,
    qd: Sequence[Scalar],
    qdd: Sequence[Scalar],
    bodies: Sequence[Pose],
    ground: Pose,
    loads: tuple[Wrench, RigidInertia],
) -> dict[str, Wrench]:
    """The wrench that each link alone needs for its motion, about the origin and in the axes of the base."""
    motions = body_motions(tree, joint_motions(tree, q), qd, qdd, tree.gravity)
    result: dict[str, Wrench] = {}
    last = tree.robot.links[-1]
    for link, frame in zip(tree.robot.links, tree.links):
        inertia = RigidInertia.about_centre(link.mass, link.centre_of_mass, link.inertia)
        exerted = NO_WRENCH
        if link is last:
            exerted, payload = loads
            inertia = inertia.plus(payload)
        motion = motions[frame.body + 1]
        carrier = ground if frame.body == BASE else bodies[frame.body]
        needed = inertial_wrench(inertia.moved(frame.pose), motion)
        at_link = carrier.after(frame.pose)
        external = Wrench(at_link.rotate(exerted.force), at_link.rotate(exerted.moment))
        total = _sum(
            _about_base(Wrench(carrier.rotate(needed.force), carrier.rotate(needed.moment)), carrier.p),
            _about_base(external, at_link.p),
        )
        result[link.name] = total
    return result


def _closure_wrench(closure: Closure, multipliers: Sequence[Scalar], a: Pose, b: Pose) -> Wrench:
    """The wrench on the second frame of a closure, about its origin, in base axes.

    Each multiplier does the work ``multiplier d/dt residual``.
    """
    total = NO_WRENCH
    displacement = subtract(b.p, a.p)
    for relation, multiplier in zip(closure.relations, multipliers):
        match relation:
            case NoDisplacement(axis):
                part = Wrench(scale(multiplier, _axis(a, axis)), NO_WRENCH.moment)
            case Perpendicular(first, second):
                moment = cross(_axis(b, second), _axis(a, first))
                part = Wrench(NO_WRENCH.force, scale(multiplier, moment))
            case Distance(length):
                part = Wrench(scale(multiplier * (1.0 / length), displacement), NO_WRENCH.moment)
        total = _sum(total, part)
    return total


def _by_closure(closures: Sequence[Closure], multipliers: Sequence[Scalar]) -> list[list[Scalar]]:
    """The multipliers of each closure."""
    rest = list(multipliers)
    parts: list[list[Scalar]] = []
    for closure in closures:
        count = len(closure.relations)
        parts.append(rest[:count])
        rest = rest[count:]
    return parts


def _axis(pose: Pose, index: int) -> Vector:
    return (pose.x, pose.y, pose.z)[index]


def _sum(a: Wrench, b: Wrench) -> Wrench:
    return Wrench(add(a.force, b.force), add(a.moment, b.moment))


def _scaled(factor: float, a: Wrench) -> Wrench:
    return Wrench(scale(factor, a.force), scale(factor, a.moment))


def _about_base(wrench: Wrench, p: Vector) -> Wrench:
    """A wrench about the point ``p``, about the origin of the base."""
    return Wrench(wrench.force, add(wrench.moment, cross(p, wrench.force)))


def _in_frame(wrench: Wrench, pose: Pose) -> Wrench:
    """A wrench about the origin of a frame, transformed from base axes to axes of the frame."""
    axes = (pose.x, pose.y, pose.z)
    force, moment = (tuple(dot(axis, value) for axis in axes) for value in wrench)
    return Wrench((force[0], force[1], force[2]), (moment[0], moment[1], moment[2]))
