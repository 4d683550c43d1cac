"""The robot of a network of bodies and joints: a spanning tree from the World Frame, closures for the rest.

A joint of the tree carries a link with the name of the joint's block; the bodies of the rigid group beyond it
are one link with the sum of their inertias. A joint that closes a loop is a closure of its type. If it must
have coordinates, or has no type of closure, the group beyond it is cut instead: the joint carries a second
link with half of the group's inertia, and a weld closure joins both halves.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from armblocks.diagram.passes.netlist import Netlist
from armblocks.errors import DiagramError, RobotError
from armblocks.multibody.couplings import (
    Combination,
    Relation,
    check_motion_inputs,
    coupling_relations,
    eliminated,
    independence,
    robot_couplings,
)
from armblocks.multibody.frames import Frames, Groups, rigid_groups, spanning_joints
from armblocks.multibody.motion_sequence import reversed_motions, robot_joint
from armblocks.multibody.parts import (
    BASE,
    FOLLOWER,
    REFERENCE,
    WORLD,
    BodyPart,
    ForcePart,
    JointPart,
    Part,
    SettingsPart,
    WorldPart,
)
from armblocks.robot import Attachment, Constraint, Fixed, Link, Robot, WeldClosure
from armblocks.robot.checks import MAX_LINKS
from armblocks.robot.shapes import Shape
from armblocks.spatial import Matrix3, Transform, Vector3
from armblocks.spatial.inertia import RigidInertia
from armblocks.spatial.vectors import Symmetric


@dataclass(frozen=True, kw_only=True)
class PlacedJoint:
    """A joint of the tree: its first entries in q and qd of the robot.

    ``reversed``: the link of the joint carries the base of the drawn joint, not its follower.
    """

    path: str
    part: JointPart
    reversed: bool
    position: int
    speed: int


@dataclass(frozen=True, kw_only=True)
class DependentJoint:
    """A joint of the tree with one coordinate, which couplings determine from q and qd of the robot.

    ``factors``: for each term the index in q, the index in qd, and the factor. ``offset`` (rad or m) is added
    to the sum of the terms of q.
    """

    path: str
    part: JointPart
    factors: tuple[tuple[int, int, float], ...]
    offset: float


@dataclass(frozen=True, kw_only=True)
class PlacedElement:
    """A force element or a sensor, with the places of its frames."""

    path: str
    part: ForcePart
    frames: tuple[tuple[str, Attachment], ...]


@dataclass(frozen=True, kw_only=True)
class PlacedBody:
    """A body that moves, with its frame R on a link. ``fraction`` of a cut body is on each of its links."""

    path: str
    at: Attachment
    fraction: float


@dataclass(frozen=True, kw_only=True)
class DrawnMechanism:
    """A network of bodies and joints as a robot.

    ``robot``: its masses are those of ``bodies`` at the start of a run. ``closed``: the paths of the joints
    that are closures, without coordinates. ``animated``: whether the run records the poses of the bodies.
    ``dependents``: the joints that couplings determine, which are not entries of q; ``relations``: the
    couplings.
    """

    robot: Robot
    bodies: tuple[PlacedBody, ...]
    joints: tuple[PlacedJoint, ...]
    elements: tuple[PlacedElement, ...]
    closed: tuple[str, ...]
    animated: bool
    dependents: tuple[DependentJoint, ...] = ()
    relations: tuple[Relation, ...] = ()

    @property
    def constrained(self) -> bool:
        """Whether closures or couplings make the joints depend on each other."""
        return bool(self.robot.closures or self.robot.couplings)


def drawn_mechanism(
    net: Netlist, parts: Mapping[str, Part], frames: Frames, network: Sequence[str]
) -> DrawnMechanism | None:
    """The mechanism of the blocks of one network; ``None`` if nothing in it can move and nothing reads it.

    Raises ``DiagramError`` that names the block: a network without a World Frame, a body that no joint
    connects, joints inside a rigid group, rigid loops that do not close.
    """
    own = {path: parts[path] for path in network}
    worlds = [path for path, part in own.items() if isinstance(part, WorldPart)]
    if not worlds:
        _refuse_network_without_world(net, own)
    return _Assembly(net, own, frames, worlds).mechanism()


def world_block(parts: Mapping[str, Part], network: Sequence[str]) -> str:
    """The path of the first World Frame of a network."""
    return next(path for path in network if isinstance(parts[path], WorldPart))


@dataclass(frozen=True)
class _Edge:
    """A joint of the tree, from a group that is in the tree already to another group."""

    path: str
    part: JointPart
    near: int
    """The frame of the joint in the reached group."""
    far: int
    reversed: bool


class _Assembly:
    """The assembly of one network."""

    def __init__(
        self, net: Netlist, parts: Mapping[str, Part], frames: Frames, worlds: Sequence[str]
    ) -> None:
        self.net, self.parts, self.frames = net, parts, frames
        used = [frames.at(path, port.name) for path in parts for port in net.blocks[path].frame_ports()]
        self.groups: Groups = rigid_groups(net, parts, frames, used)
        self.world = frames.at(worlds[0], WORLD)
        self.world_path = worlds[0]
        for path in worlds[1:]:
            self._check_same_world(path)
        self.joints = {path: part for path, part in parts.items() if isinstance(part, JointPart)}
        self.link_of: dict[int, tuple[str | None, Transform]] = {
            self._group(self.world): (None, self.groups.pose[self.world])
        }
        """The link of each group, and the pose of the link's frame in the group."""
        self.cuts: list[_Edge] = []
        self.relations = coupling_relations(net, parts, frames, self.groups)
        for joint in dict.fromkeys(joint for relation in self.relations for joint in relation.joints):
            self.joints[joint] = dataclasses.replace(self.joints[joint], needs_coordinate=True)
        self.dependent: Mapping[str, Combination] = (
            eliminated(self.relations, independence(parts), net.label) if self.relations else {}
        )
        check_motion_inputs(net, parts, self.dependent)

    def mechanism(self) -> DrawnMechanism | None:
        tree, chords = self._tree()
        elements = self._elements()
        if not tree:
            if elements:
                self._refuse_fixed_element(elements[0].path)
            return None
        closures = [self._closure(edge) for edge in chords if edge not in self.cuts]
        welds = [self._weld(edge) for edge in self.cuts]
        links = [*self._world_link(), *(self._link(edge) for edge in (*tree, *self.cuts))]
        if len(links) > MAX_LINKS:
            raise DiagramError(
                f"the mechanism has {len(links)} bodies",
                where=self.net.label(self.world_path),
                allowed=f"at most {MAX_LINKS}",
                fix="join bodies by Weld Joints or Rigid Transforms, which make one body of them",
            )
        robot = self._robot(links, (*closures, *welds, *robot_couplings(self.dependent)))
        joints = tuple(self._placed(robot, (*tree, *self.cuts)))
        return DrawnMechanism(
            robot=robot,
            bodies=tuple(body for edge in (*tree, *self.cuts) for body in self._placed_bodies(edge)),
            joints=joints,
            elements=elements,
            closed=tuple(edge.path for edge in chords if edge not in self.cuts),
            animated=self._settings().animated,
            dependents=tuple(self._dependents(joints)),
            relations=self.relations,
        )

    # -- the tree

    def _tree(self) -> tuple[list[_Edge], list[_Edge]]:
        """The joints of the tree, depth first from the World Frame, and the joints that close loops."""
        ends = {path: (self._at(path, BASE), self._at(path, FOLLOWER)) for path in self.joints}
        for path, (base, follower) in ends.items():
            if base == follower:
                self._refuse_rigid_joint(path)
        in_tree = spanning_joints(
            [
                (path, *ends[path], part.needs_coordinate or part.closure is None)
                for path, part in self.joints.items()
            ]
        )
        around: dict[int, list[str]] = {}
        for path in sorted(in_tree, reverse=True):
            for group in ends[path]:
                around.setdefault(group, []).append(path)
        edges: list[_Edge] = []
        root = self._group(self.world)
        waiting = [(root, path) for path in around.get(root, ())]
        while waiting:
            group, path = waiting.pop()
            edge = self._edge(path, reverse=ends[path][1] == group)
            far = self._group(edge.far)
            if far in self.link_of:
                continue
            edges.append(edge)
            self.link_of[far] = (path, self.groups.pose[edge.far])
            waiting += [(far, other) for other in around[far] if other != path]
        self._check_all_connected()
        chords = [self._chord(path, ends[path]) for path in sorted(self.joints) if path not in in_tree]
        return edges, chords

    def _edge(self, path: str, *, reverse: bool) -> _Edge:
        base, follower = self.frames.at(path, BASE), self.frames.at(path, FOLLOWER)
        near, far = (follower, base) if reverse else (base, follower)
        return _Edge(path, self.joints[path], near, far, reverse)

    def _chord(self, path: str, ends: tuple[int, int]) -> _Edge:
        """A joint that closes a loop. A joint that must have coordinates is added to the cuts."""
        part = self.joints[path]
        edge = self._edge(path, reverse=False)
        if not part.needs_coordinate and part.closure is not None:
            return edge
        if not self._has_mass(ends[1]):
            if not self._has_mass(ends[0]):
                raise DiagramError(
                    "the joint closes a loop between two frames without mass; it can have no coordinate",
                    where=self.net.label(path),
                    allowed="a body with mass at one of its frames at least, or a joint without actuation, "
                    "sensing, spring, limits and targets",
                    fix="add a solid to one of the frames, or actuate and measure another joint of the loop",
                )
            edge = self._edge(path, reverse=True)
        self.cuts.append(edge)
        return edge

    def _at(self, path: str, port: str) -> int:
        return self._group(self.frames.at(path, port))

    def _group(self, frame: int) -> int:
        return self.groups.of_frame[frame]

    def _has_mass(self, group: int) -> bool:
        return group != self._group(self.world) and any(body.mass > 0.0 for _, body in self._bodies(group))

    def _bodies(self, group: int) -> Sequence[tuple[str, BodyPart]]:
        """The bodies of a rigid group, with their paths."""
        return self._bodies_of_groups.get(group, ())

    @cached_property
    def _bodies_of_groups(self) -> Mapping[int, list[tuple[str, BodyPart]]]:
        bodies: dict[int, list[tuple[str, BodyPart]]] = {}
        for path, part in self.parts.items():
            if isinstance(part, BodyPart):
                bodies.setdefault(self._at(path, REFERENCE), []).append((path, part))
        return bodies

    # -- links and constraints

    def attachment(self, frame: int) -> Attachment:
        """The place of a frame on its link, or on the base."""
        link, origin = self.link_of[self._group(frame)]
        return Attachment(link=link, pose=origin.inverse() @ self.groups.pose[frame])

    def _link(self, edge: _Edge) -> Link:
        at, group = self.attachment(edge.near), self._group(edge.far)
        motions = reversed_motions(edge.part.motions) if edge.reversed else edge.part.motions
        mass, centre, inertia = _summed(
            [
                _inertia_of(part).moved(self._pose_in_link(path, edge.far))
                for path, part in self._bodies(group)
            ],
            self._fraction(group),
        )
        is_cut = edge in self.cuts
        return Link(
            name=edge.path,
            parent=at.link,
            joint=robot_joint(motions),
            before=at.pose,
            mass=mass,
            centre_of_mass=centre,
            inertia=inertia,
            geometry=() if is_cut else self._shapes(group, edge.far),
        )

    def _fraction(self, group: int) -> float:
        """The fraction of the bodies of a group on each of its links."""
        return 1.0 / (sum(self._group(cut.far) == group for cut in self.cuts) + 1)

    def _placed_bodies(self, edge: _Edge) -> Iterator[PlacedBody]:
        """The bodies on the link of a joint."""
        group = self._group(edge.far)
        for path, _ in self._bodies(group):
            at = Attachment(link=edge.path, pose=self._pose_in_link(path, edge.far))
            yield PlacedBody(path=path, at=at, fraction=self._fraction(group))

    def _world_link(self) -> list[Link]:
        """A link with the shapes of the bodies that do not move; none without such bodies."""
        shapes = self._shapes(self._group(self.world), self.world)
        return [Link(name=self.world_path, joint=Fixed(), geometry=shapes)] if shapes else []

    def _pose_in_link(self, path: str, origin: int) -> Transform:
        pose = self.groups.pose
        return pose[origin].inverse() @ pose[self.frames.at(path, REFERENCE)]

    def _shapes(self, group: int, origin: int) -> tuple[Shape, ...]:
        return tuple(
            dataclasses.replace(
                shape, pose=(self._pose_in_link(path, origin) @ Transform.from_matrix(shape.pose)).matrix
            )
            for path, part in self._bodies(group)
            for shape in part.shapes
        )

    def _closure(self, edge: _Edge) -> Constraint:
        assert edge.part.closure is not None
        first, second = edge.part.closure_frames
        base, follower = self.attachment(edge.near), self.attachment(edge.far)
        return edge.part.closure(
            name=edge.path,
            first=dataclasses.replace(base, pose=base.pose @ first),
            second=dataclasses.replace(follower, pose=follower.pose @ second),
        )

    def _weld(self, edge: _Edge) -> Constraint:
        """The weld between a cut group and the link of the joint that cuts it."""
        return WeldClosure(name=edge.path, first=self.attachment(edge.far), second=Attachment(link=edge.path))

    def _robot(self, links: Sequence[Link], constraints: Sequence[Constraint]) -> Robot:
        if all(not link.geometry for link in links):
            links = [dataclasses.replace(link, geometry=None) for link in links]
        try:
            return Robot(
                name=self.net.top.name,
                links=tuple(links),
                gravity=self._settings().gravity,
                constraints=tuple(constraints),
            )
        except RobotError as error:
            raise DiagramError(
                error.what,
                where=", ".join(filter(None, (self.net.label(self.world_path), error.where))),
                allowed=error.allowed,
                fix=error.fix,
            ) from error

    def _settings(self) -> SettingsPart:
        """The settings of the network; without a Mechanism Configuration there is no gravity."""
        found = [path for path, part in self.parts.items() if isinstance(part, SettingsPart)]
        if len(found) > 1:
            raise DiagramError(
                f"the mechanism has {len(found)} Mechanism Configurations: {', '.join(found)}",
                where=self.net.label(found[1]),
                allowed="one for each mechanism",
                fix="remove the others",
            )
        part = self.parts[found[0]] if found else SettingsPart(gravity=(0.0, 0.0, 0.0))
        assert isinstance(part, SettingsPart)
        return part

    def _placed(self, robot: Robot, edges: Sequence[_Edge]) -> Iterator[PlacedJoint]:
        """The joints that have coordinates, in the order of q."""
        by_path = {edge.path: edge for edge in edges}
        position = speed = 0
        for link in robot.moving_links:
            edge = by_path[link.name]
            yield PlacedJoint(
                path=edge.path, part=edge.part, reversed=edge.reversed, position=position, speed=speed
            )
            position, speed = position + link.joint.nq, speed + link.joint.nv

    def _dependents(self, joints: Sequence[PlacedJoint]) -> Iterator[DependentJoint]:
        """The joints that couplings determine."""
        places = {joint.path: (joint.position, joint.speed) for joint in joints}
        for path, combination in self.dependent.items():
            factors = tuple((*places[other], factor) for other, factor in combination.factors.items())
            yield DependentJoint(
                path=path, part=self.joints[path], factors=factors, offset=combination.constant
            )

    def _elements(self) -> tuple[PlacedElement, ...]:
        return tuple(
            PlacedElement(
                path=path,
                part=part,
                frames=tuple((port, self.attachment(self.frames.at(path, port))) for port in part.frames),
            )
            for path, part in self.parts.items()
            if isinstance(part, ForcePart)
        )

    # -- errors

    def _check_same_world(self, path: str) -> None:
        frame = self.frames.at(path, WORLD)
        is_world = self._group(frame) == self._group(self.world)
        if not is_world or self.groups.pose[frame] != self.groups.pose[self.world]:
            raise DiagramError(
                f"the frame differs from the World Frame '{self.world_path}' of the same mechanism",
                where=self.net.label(path),
                allowed="World Frame blocks of one mechanism that are one frame",
                fix=f"draw a line from the block to '{self.world_path}', or replace it by a Reference Frame",
            )

    def _check_all_connected(self) -> None:
        """Raise ``DiagramError`` for a body or joint that no chain of joints connects with the world."""
        for path, part in self.parts.items():
            ports = [port.name for port in self.net.blocks[path].frame_ports()]
            if isinstance(part, SettingsPart) or all(self._at(path, port) in self.link_of for port in ports):
                continue
            raise DiagramError(
                "no chain of joints and rigid connections leads from the frame to the World Frame "
                f"'{self.world_path}'",
                where=self.net.label(path),
                allowed="frames that joints connect with the World Frame; a force element does not connect",
                fix="connect the frame by a joint; with a 6-DOF Joint it moves freely",
            )

    def _refuse_rigid_joint(self, path: str) -> None:
        raise DiagramError(
            "the base and the follower of the joint are on the same rigid body, so that it cannot move",
            where=self.net.label(path),
            allowed="a joint between two bodies",
            fix="remove the rigid connection between its frames, or the joint",
        )

    def _refuse_fixed_element(self, path: str) -> None:
        raise DiagramError(
            "no joint of the mechanism can move",
            where=self.net.label(path),
            allowed="force elements and sensors of mechanisms with a joint",
            fix="add a joint, such as a 6-DOF Joint",
        )


def _refuse_network_without_world(net: Netlist, parts: Mapping[str, Part]) -> None:
    joints = [path for path, part in parts.items() if isinstance(part, JointPart)]
    path = next(iter(joints or parts))
    blocks = ", ".join(f"'{other}'" for other in list(parts)[:5])
    raise DiagramError(
        f"the mechanism of {blocks}{' …' if len(parts) > 5 else ''} has no World Frame"
        if joints or len(parts) > 1
        else "the block has no frame line",
        where=net.label(path),
        allowed="mechanisms that are connected with a World Frame",
        fix="add a World Frame and connect it, by a 6-DOF Joint for a body that moves freely",
    )


def _inertia_of(part: BodyPart) -> RigidInertia:
    return RigidInertia.about_centre(part.mass, part.centre, part.inertia)


def _summed(inertias: Sequence[RigidInertia], fraction: float) -> tuple[float, Vector3, Matrix3]:
    """Mass, centre of mass, and inertia about it, of a fraction of several bodies."""
    total = RigidInertia()
    for inertia in inertias:
        total = total.plus(inertia)
    mass = float(total.mass)
    x, y, z = (float(entry) / mass if mass else 0.0 for entry in total.first)
    second = total.shifted((-x, -y, -z)).second if mass else total.second
    xx, yy, zz, xy, yz, xz = (fraction * float(entry) for entry in Symmetric(*second))
    return fraction * mass, (x, y, z), ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
