"""The robot in a form for algorithms: bodies with one degree of freedom each, every joint axis is z.

A joint with several degrees of freedom becomes a series of bodies; only the last body has mass.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from armblocks.robot.joints import AxisMotion
from armblocks.robot.link import Link, Motor
from armblocks.robot.robot import Robot
from armblocks.rounded_functions import hypot
from armblocks.spatial import Transform, Vector3, rotation_x, rotation_y
from armblocks.spatial.inertia import RigidInertia

BASE = -1
"""The index of the robot's base."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Body:
    """A body that moves relative to its parent with one degree of freedom, with all links fixed to it.

    ``T_parent_body(q) = placement displacement(q)``, and the velocity relative to the parent is a rotation by
    ``angular qd`` about the z axis of the body and a translation by ``linear qd`` along it, with
    ``qd = qd[speed]``. The displacement of

    - a body on an axis (``ball`` is None) is ``Rz(angular (q + offset)) Tz(linear (q + offset))``, with
      ``q = q[position]``;
    - the first body of a ball joint (``ball`` is 0) is the rotation by the quaternion ``q[position … + 3]``;
    - the second and the third body of a ball joint (``ball`` is 1 or 2) is none.

    The z axes of the three bodies of a ball joint are the x, y and z axes of the joint's distal frame. These
    axes rotate with the joint; the axis of a second or third body is therefore not fixed in the body before
    it (:mod:`armblocks.dynamics.ball_joints`).

    ``parent``: index of another body, or BASE. ``inertia``: of all lumped links, in the body frame.
    ``motor``: the motor of this degree of freedom.
    """

    link: str
    parent: int
    position: int
    speed: int
    placement: Transform
    angular: float
    linear: float
    offset: float = 0.0
    ball: int | None = None
    inertia: RigidInertia = field(default_factory=RigidInertia)
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

    ``robot``: without couplings, so that every joint has coordinates.
    ``bodies``: parents before children. ``links``: the frame of each link, in the robot's order. ``tip``: the
    frame of the last link. ``tool``: the tool frame, or the frame ``end`` if given. ``base``: pose of
    the base in the world. ``gravity``: m/s2, in *base* axes. ``grounded``: the inertia of the links fixed to
    the base.
    """

    robot: Robot
    bodies: tuple[Body, ...]
    links: tuple[Frame, ...]
    base: Transform
    gravity: Vector3
    grounded: RigidInertia
    end: Frame | None = None

    @classmethod
    def of(cls, robot: Robot) -> KinematicTree:
        """Number the robot's joints, merge fixed links, and rotate every joint axis to z."""
        robot = robot.uncoupled
        first_of: dict[str, tuple[int, int]] = {}
        position = speed = 0
        for link in robot.moving_links:
            first_of[link.name] = position, speed
            position, speed = position + link.joint.nq, speed + link.joint.nv
        frames: dict[str | None, Frame] = {None: Frame(body=BASE, pose=Transform())}
        bodies: list[Body] = []
        grounded = RigidInertia()
        for link in _parents_first(robot.links):
            frame = frames[link.parent]
            frame = Frame(body=frame.body, pose=frame.pose @ link.before)
            for body, to_joint in _bodies(link, *first_of.get(link.name, (0, 0))):
                placement = frame.pose @ body.placement
                bodies.append(replace(body, parent=frame.body, placement=placement))
                frame = Frame(body=len(bodies) - 1, pose=to_joint)
            frame = Frame(body=frame.body, pose=frame.pose @ link.after)
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
        """Number of degrees of freedom, which is the number of bodies."""
        return len(self.bodies)

    @property
    def tip(self) -> Frame:
        """The last link's frame."""
        return self.links[-1]

    @property
    def tool(self) -> Frame:
        """The frame of the tool or of another end effector."""
        if self.end is not None:
            return self.end
        return Frame(body=self.tip.body, pose=self.tip.pose @ self.robot.tool)

    def attached(self, link: str | None, pose: Transform) -> Frame:
        """The frame with a constant ``pose`` in the frame of a link, or of the base (None)."""
        if link is None:
            return Frame(body=BASE, pose=pose)
        frame = self.links[[entry.name for entry in self.robot.links].index(link)]
        return Frame(body=frame.body, pose=frame.pose @ pose)

    def with_tool_at(self, name: str | None) -> KinematicTree:
        """The tree whose tool frame is the frame ``name`` of the robot (None: the tool itself).

        Raises UnknownNameError.
        """
        if name is None:
            return self
        frame = self.robot.frame(name)
        return replace(self, end=self.attached(frame.link, frame.pose))

    def ancestors(self, body: int) -> tuple[int, ...]:
        """The ancestors of ``body``, from its parent towards the base."""
        path: list[int] = []
        body = self.bodies[body].parent if body != BASE else BASE
        while body != BASE:
            path.append(body)
            body = self.bodies[body].parent
        return tuple(path)


_CYCLE = Transform(rotation=((0, 0, 1), (1, 0, 0), (0, 1, 0)))
"""The rotation of x to y, y to z, and z to x."""


def _bodies(link: Link, position: int, speed: int) -> Iterator[tuple[Body, Transform]]:
    """The bodies of a link's joint, placed in the frame before them, and the pose of the joint frame in each.

    ``position`` and ``speed``: the indices of the joint's first entries in q and qd.
    """
    for motion in link.joint.motions:
        if isinstance(motion, AxisMotion):
            align, sign = _axis_to_z(motion.axis)
            yield (
                Body(
                    link=link.name,
                    parent=BASE,
                    position=position,
                    speed=speed,
                    placement=align,
                    angular=sign * motion.angular,
                    linear=sign * motion.linear,
                    offset=motion.offset,
                    motor=link.motor,
                ),
                align.inverse(),
            )
        else:
            for k in range(3):
                body = Body(
                    link=link.name,
                    parent=BASE,
                    position=position,
                    speed=speed + k,
                    placement=_CYCLE,
                    angular=1.0,
                    linear=0.0,
                    ball=k,
                    motor=link.motor,
                )
                # Three cycles are the identity: the last body has the axes of the distal frame.
                yield body, Transform()
        position, speed = position + len(motion.positions), speed + len(motion.speeds)


def _parents_first(links: Sequence[Link]) -> list[Link]:
    """The links sorted so that every parent precedes its children; otherwise the given order is kept."""
    placed: set[str | None] = {None}
    ordered: list[Link] = []
    remaining = list(links)
    while remaining:
        ready = [link for link in remaining if link.parent in placed]
        # Links are placed one at a time, so that a valid given order is preserved.
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
