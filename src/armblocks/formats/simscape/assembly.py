"""Assemblies of parts with welds, revolute and prismatic joints, and their conversion to robots.

Parts that are connected by welds form a group. Every group moves as one body: its first part is a link with
the joint, the other parts are links that are fixed to it. The groups must form a tree whose root is the
ground.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple, NoReturn

from armblocks.errors import FormatError, RobotError
from armblocks.formats.file_findings import FileContext, FileFinding
from armblocks.formats.simscape.rules import FREE, LOOP_CODE
from armblocks.robot import Fixed, Joint, Link, Prismatic, Revolute, Robot, deepest_tip, with_tip
from armblocks.robot.checks import MAX_LINKS
from armblocks.spatial import Matrix3, Transform, Vector3

GROUND = ""
"""The name of the node of the world."""
ZERO3: Matrix3 = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


class Kind(Enum):
    """The kind of a connection."""

    WELD = "weld"
    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"


@dataclass(frozen=True, kw_only=True)
class Part:
    """A part: ``label`` for its link, mass kg, centre of mass m and inertia kg m2 about it, in its frame."""

    label: str
    line: int = 0
    mass: float = 0.0
    centre: Vector3 = (0.0, 0.0, 0.0)
    inertia: Matrix3 = ZERO3


class Connection(NamedTuple):
    """``T_base_follower = before motion(q) after``, the motion along or about ``axis``; a weld has no motion.

    ``base`` and ``follower`` are nodes; ``where`` and ``name`` are for messages.
    """

    name: str
    where: str
    kind: Kind
    base: str
    follower: str
    before: Transform
    after: Transform
    axis: Vector3 = (0.0, 0.0, 1.0)


@dataclass(kw_only=True)
class Assembly:
    """``parts`` by node. A node that is not a part is a frame, such as the frame of a subassembly.

    ``loose``: the poses of nodes that may be unconnected; ``where``: the place of the assembly in the file.
    """

    name: str
    where: str
    parts: dict[str, Part] = field(default_factory=dict[str, Part])
    connections: list[Connection] = field(default_factory=list[Connection])
    poses: Mapping[str, Transform] = field(default_factory=dict[str, Transform])


class _Edge(NamedTuple):
    connection: Connection
    node: str
    reverse: bool


class _Waiting(NamedTuple):
    """A node to visit: ``at``: the link that carries it, ``pose`` of the node in this link (or in the base).

    ``edge``: the joint in between, at the pose ``pose`` in the link.
    """

    node: str
    at: str | None
    pose: Transform
    edge: _Edge | None


def robot_of(assembly: Assembly, file: str, context: FileContext) -> Robot:
    """The robot of an assembly. Raises ``FormatError`` for closed loops and for too many parts."""
    if not assembly.parts:
        raise FormatError(
            "the assembly has no parts",
            where=assembly.where,
            allowed="parts with instances",
            fix="export it again",
        )
    if len(assembly.parts) > MAX_LINKS:
        raise FormatError(
            f"the assembly has {len(assembly.parts)} parts",
            where=assembly.where,
            allowed=f"at most {MAX_LINKS}",
            fix="export subassemblies as rigid",
        )
    links = _Tree(assembly, file, context).links()
    try:
        return with_tip(Robot(name=assembly.name, links=tuple(links)), deepest_tip(links))
    except RobotError as error:
        raise FormatError(
            f"{error.where}: {error.what}", where=assembly.where, allowed=error.allowed, fix=error.fix
        ) from error


class _Tree:
    def __init__(self, assembly: Assembly, file: str, context: FileContext) -> None:
        self._assembly = assembly
        self._file = file
        self._context = context
        self._edges: dict[str, list[_Edge]] = {}
        for connection in assembly.connections:
            base, follower = connection.base, connection.follower
            self._edges.setdefault(base, []).append(_Edge(connection, follower, False))
            self._edges.setdefault(follower, []).append(_Edge(connection, base, True))
        self._names = _link_names(assembly.parts)
        self._reached: set[str] = set()
        self._used: set[int] = set()

    def links(self) -> list[Link]:
        """The links of all parts, depth first; parts that nothing connects are fixed to the base."""
        found = self._from(GROUND, Transform(), GROUND in self._edges)
        # A node that is the follower of a joint is not a root while there are others.
        followers = {connection.follower for connection in self._assembly.connections}
        nodes = [*self._assembly.parts]
        for node in [*(node for node in nodes if node not in followers), *nodes]:
            if node not in self._reached:
                pose = self._assembly.poses.get(node, Transform())
                what = "it is not connected with the ground; it is fixed to the base"
                part = self._assembly.parts[node]
                self._context.findings.append(
                    FileFinding(
                        rule=FREE,
                        file=self._file,
                        line=part.line,
                        element=f"part '{part.label[:60]}'",
                        what=what,
                    )
                )
                found += self._from(node, pose, True)
        return found

    def _from(self, root: str, pose: Transform, exists: bool) -> list[Link]:
        """The links that can be reached from a node, group by group."""
        links: list[Link] = []
        waiting = [_Waiting(root, None, pose, None)] if exists else []
        while waiting:
            step = waiting.pop()
            if step.node in self._reached:
                self._refuse_loop(step)
            group, joints = self._group(step)
            links += group
            waiting += reversed(joints)
        return links

    def _group(self, first: _Waiting) -> tuple[list[Link], list[_Waiting]]:
        """The links of the nodes that welds connect with the first node, and the joints at them."""
        links: list[Link] = []
        joints: list[_Waiting] = []
        welded = [first]
        while welded:
            step = welded.pop()
            if step.node in self._reached:
                continue  # another weld inside the group
            self._reached.add(step.node)
            link = self._link(step)
            at, inside = step.at, step.pose
            if link is not None:
                links.append(link)
                at, inside = link.name, Transform()
            onward: list[_Waiting] = []
            for edge in self._edges.get(step.node, []):
                if id(edge.connection) not in self._used:
                    self._used.add(id(edge.connection))
                    onward.append(_onward(edge, at, inside))
            joints += [entry for entry in onward if entry.edge is not None]
            welded += reversed([entry for entry in onward if entry.edge is None])
        return links, joints

    def _refuse_loop(self, step: _Waiting) -> NoReturn:
        """Raise the error for a connection to a node that was reached before."""
        name = self._assembly.parts[step.node].label if step.node in self._assembly.parts else step.node
        raise FormatError(
            f"the joints or mates at '{(name or 'ground')[:60]}' close a loop [{LOOP_CODE}]",
            where=self._assembly.where,
            allowed="a tree of parts: closed loops are not supported",
            fix="suppress one of the joints or mates of the loop in the CAD assembly",
        )

    def _link(self, step: _Waiting) -> Link | None:
        """The link of a part, or of a frame that a joint moves; ``None`` for a frame that is welded."""
        part = self._assembly.parts.get(step.node)
        joint: Joint = Fixed()
        after = Transform()
        name = self._names.get(step.node, "")
        if step.edge is not None:
            connection, _, reverse = step.edge
            x, y, z = connection.axis
            axis = (-x, -y, -z) if reverse else connection.axis
            joint = (Revolute if connection.kind is Kind.REVOLUTE else Prismatic)(axis=axis)
            after = connection.before.inverse() if reverse else connection.after
            name = name or _free_name(connection.name, set(self._names.values()))
            self._names[step.node] = name
        elif part is None:
            return None
        if part is not None:
            self._context.lines[name] = part.line
        part = part or Part(label=name)
        return Link(
            name=name,
            parent=step.at,
            joint=joint,
            before=step.pose,
            after=after,
            mass=part.mass,
            centre_of_mass=part.centre,
            inertia=part.inertia,
        )


def _onward(edge: _Edge, at: str | None, inside: Transform) -> _Waiting:
    """The node at the other end of an edge. ``inside``: the pose of this node in the link ``at``."""
    connection, node, reverse = edge
    if connection.kind is Kind.WELD:
        T = connection.before @ connection.after
        return _Waiting(node, at, inside @ (T.inverse() if reverse else T), None)
    before = connection.after.inverse() if reverse else connection.before
    return _Waiting(node, at, inside @ before, edge)


def _link_names(parts: Mapping[str, Part]) -> dict[str, str]:
    """Unique names of the links by node."""
    used: set[str] = set()
    names: dict[str, str] = {}
    for node, part in parts.items():
        names[node] = _free_name(part.label.strip()[:200] or "part", used)
        used.add(names[node])
    return names


def _free_name(name: str, used: set[str]) -> str:
    free, number = name, 2
    while free in used:
        free, number = f"{name} {number}", number + 1
    return free
