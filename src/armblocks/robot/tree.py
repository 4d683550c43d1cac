"""The robot in a form for algorithms: only moving bodies, parents before children, every joint axis is z."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from armblocks.robot.link import Link, Motor
from armblocks.robot.robot import Robot
from armblocks.rounded_functions import hypot
from armblocks.spatial import Transform, Vector3, rotation_x, rotation_y
from armblocks.spatial.inertia import RigidInertia

BASE = -1
"""The index of the robot's base."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Body:
    """A link that moves relative to its parent, with all links that are fixed to it.

    ``T_parent_body(q) = placement Rz(angular (q + offset)) Tz(linear (q + offset))``: the z axis of the body
    frame is the joint axis. ``parent``: index of another body, or BASE. ``joint``: index in q. ``inertia``:
    of all lumped links, in the body frame. ``motor``: the motor of the joint.
    """

    link: str
    parent: int
    joint: int
    placement: Transform
    angular: float
    linear: float
    offset: float
    inertia: RigidInertia
    motor: Motor | None

    @property
    def reflected_inertia(self) -> float:
        """Motor inertia at the joint, ``G^2 Jm``."""
        return self.motor.reflected_inertia if self.motor else 0.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Frame:
    """A frame that is fixed to a body (or to the base): ``T_body_frame`` is constant."""

    body: int
    pose: Transform


@dataclass(frozen=True, kw_only=True, eq=False)
class KinematicTree:
    """The bodies of a robot and its frames.

    ``bodies``: parents before children. ``links``: the frame of each link, in the robot's order. ``tip``: the
    frame of the last link. ``tool``: the tool frame. ``base``: pose of the base in the world. ``gravity``:
    m/s2, in *base* axes. ``grounded``: the inertia of the links fixed to the base.
    """

    robot: Robot
    bodies: tuple[Body, ...]
    links: tuple[Frame, ...]
    base: Transform
    gravity: Vector3
    grounded: RigidInertia

    @classmethod
    def of(cls, robot: Robot) -> KinematicTree:
        """Number the robot's joints, merge fixed links, and rotate every joint axis to z."""
        joint_of = {link.name: index for index, link in enumerate(robot.moving_links)}
        frames: dict[str | None, Frame] = {None: Frame(body=BASE, pose=Transform())}
        bodies: list[Body] = []
        grounded = RigidInertia()
        for link in _parents_first(robot.links):
            parent = frames[link.parent]
            at_joint = parent.pose @ link.before
            if link.joint.moves:
                align, sign = _axis_to_z(link.joint.axis)
                body = Body(
                    link=link.name,
                    parent=parent.body,
                    joint=joint_of[link.name],
                    placement=at_joint @ align,
                    angular=sign * link.joint.angular,
                    linear=sign * link.joint.linear,
                    offset=link.joint.offset,
                    inertia=RigidInertia(),
                    motor=link.motor,
                )
                frame = Frame(body=len(bodies), pose=align.inverse() @ link.after)
                bodies.append(body)
            else:
                frame = Frame(body=parent.body, pose=at_joint @ link.after)
            frames[link.name] = frame
            inertia = RigidInertia.about_centre(link.mass, link.centre_of_mass, link.inertia)
            inertia = inertia.moved(frame.pose)
            if frame.body == BASE:
                grounded = grounded.plus(inertia)
            else:
                carrier = bodies[frame.body]
                bodies[frame.body] = replace(carrier, inertia=carrier.inertia.plus(inertia))
        gravity = Transform(rotation=robot.base.inverse().rotation).apply(robot.gravity)
        return cls(
            robot=robot,
            bodies=tuple(bodies),
            links=tuple(frames[link.name] for link in robot.links),
            base=robot.base,
            gravity=gravity,
            grounded=grounded,
        )

    @property
    def n(self) -> int:
        """Number of joint coordinates, which is the number of bodies."""
        return len(self.bodies)

    @property
    def tip(self) -> Frame:
        """The last link's frame."""
        return self.links[-1]

    @property
    def tool(self) -> Frame:
        """The tool's frame."""
        return Frame(body=self.tip.body, pose=self.tip.pose @ self.robot.tool)

    def ancestors(self, body: int) -> tuple[int, ...]:
        """The ancestors of ``body``, from its parent towards the base."""
        path: list[int] = []
        body = self.bodies[body].parent if body != BASE else BASE
        while body != BASE:
            path.append(body)
            body = self.bodies[body].parent
        return tuple(path)


def _parents_first(links: Sequence[Link]) -> list[Link]:
    """The links sorted so that every parent precedes its children; otherwise the given order is kept."""
    placed: set[str | None] = {None}
    ordered: list[Link] = []
    remaining = list(links)
    while remaining:
        ready = [link for link in remaining if link.parent in placed]
        # One link at a time, so that links already in a valid order keep it.
        link = ready[0]
        ordered.append(link)
        placed.add(link.name)
        remaining.remove(link)
    return ordered


def _axis_to_z(axis: Vector3) -> tuple[Transform, float]:
    """A rotation A and a sign with ``A z = sign axis``; exact for the six coordinate directions."""
    x, y, z = axis
    if x == y == 0:
        return Transform(), 1.0 if z > 0 else -1.0
    if y == z == 0:
        return Transform(rotation=rotation_y(np.pi / 2)), 1.0 if x > 0 else -1.0
    if x == z == 0:
        return Transform(rotation=rotation_x(-np.pi / 2)), 1.0 if y > 0 else -1.0
    k = np.array(axis)
    normal = np.cross(k, np.eye(3)[int(np.argmin(np.abs(k)))])
    normal /= hypot(*normal.tolist())
    return Transform(rotation=np.column_stack((normal, np.cross(k, normal), k))), 1.0
