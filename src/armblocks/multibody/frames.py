"""Frames of a diagram of mechanics: which frame ports are one frame, and which frames are rigidly connected.

All frame ports that lines connect are one *frame*. Frames that rigid connections join are one *group*, which
moves as one body; each frame has a constant pose in its group. Frames that any block of mechanics connects
belong to one *network*, which becomes one mechanism.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from armblocks.diagram import DiagramBlock, PortRef
from armblocks.diagram.connection_port import FRAME, ConnectionPort
from armblocks.diagram.levels import joined
from armblocks.diagram.passes.netlist import Netlist
from armblocks.errors import DiagramError
from armblocks.multibody.parts import BASE, FOLLOWER, Part, RigidPart
from armblocks.spatial import Transform

RIGID_LOOP_TOLERANCE = 1e-9
"""Largest difference (m, or entries of a rotation matrix) of two rigid paths between the same frames."""


class DisjointSets:
    """Disjoint sets of ports or numbers (union-find)."""

    def __init__(self) -> None:
        self._parent: dict[object, object] = {}

    def representative(self, member: object) -> object:
        """The representative of the set of a member."""
        root = member
        while root in self._parent:
            root = self._parent[root]
        while member != root:
            self._parent[member], member = root, self._parent[member]
        return root

    def join(self, one: object, other: object) -> bool:
        """Merge the sets of two members; false if they are in one set already."""
        first, second = self.representative(one), self.representative(other)
        if first == second:
            return False
        self._parent[second] = first
        return True


@dataclass(frozen=True)
class Frames:
    """The frame of each frame port of the blocks of mechanics, as a number from 0."""

    of_port: Mapping[PortRef, int]

    def at(self, path: str, port: str) -> int:
        """The frame at a frame port of a block."""
        return self.of_port[PortRef(path, port)]


def frames_of_parts(net: Netlist, parts: Mapping[str, Part]) -> Frames:
    """The frames of the blocks of mechanics; lines pass through the frame ports of subsystems.

    The numbers follow the sorted paths of the blocks, so that they do not depend on the order of lines.
    """
    sets = DisjointSets()
    for line in net.frame_lines:
        sets.join(*line.ends)
    for path, block in net.blocks.items():
        if isinstance(block, DiagramBlock):
            for port in block.frame_ports():
                inner = joined(path, port.name)
                if isinstance(net.blocks.get(inner), ConnectionPort):
                    sets.join(PortRef(path, port.name), PortRef(inner, FRAME))
    numbers: dict[object, int] = {}
    of_port: dict[PortRef, int] = {}
    for path in sorted(parts):
        for port in net.blocks[path].frame_ports():
            ref = PortRef(path, port.name)
            of_port[ref] = numbers.setdefault(sets.representative(ref), len(numbers))
    return Frames(of_port)


def networks(net: Netlist, parts: Mapping[str, Part], frames: Frames) -> list[tuple[str, ...]]:
    """The paths of the blocks of each network, sorted."""
    sets = DisjointSets()
    for path in parts:
        own = [frames.at(path, port.name) for port in net.blocks[path].frame_ports()]
        for other in own[1:]:
            sets.join(own[0], other)
    members: dict[object, list[str]] = {}
    for path in sorted(parts):
        ports = net.blocks[path].frame_ports()
        members.setdefault(sets.representative(frames.at(path, ports[0].name)), []).append(path)
    return [tuple(paths) for paths in members.values()]


@dataclass(frozen=True)
class Groups:
    """The group of each frame, as a number, and the pose of the frame in its group."""

    of_frame: Mapping[int, int]
    pose: Mapping[int, Transform]


def rigid_groups(net: Netlist, parts: Mapping[str, Part], frames: Frames, used: Iterable[int]) -> Groups:
    """The groups of the frames ``used``; raises ``DiagramError`` for rigid loops that do not close."""
    edges: dict[int, list[tuple[int, Transform, str]]] = {}
    for path, part in sorted(parts.items()):
        if isinstance(part, RigidPart):
            base, follower = frames.at(path, BASE), frames.at(path, FOLLOWER)
            edges.setdefault(base, []).append((follower, part.pose, path))
            edges.setdefault(follower, []).append((base, part.pose.inverse(), path))
    group: dict[int, int] = {}
    pose: dict[int, Transform] = {}
    for root in sorted(set(used)):
        if root in group:
            continue
        group[root], pose[root] = root, Transform()
        waiting = [root]
        while waiting:
            frame = waiting.pop()
            for other, T, path in edges.get(frame, ()):
                reached = pose[frame] @ T
                if other not in group:
                    group[other], pose[other] = root, reached
                    waiting.append(other)
                else:
                    _check_rigid_loop(net, path, pose[other], reached)
    return Groups(group, pose)


def _check_rigid_loop(net: Netlist, path: str, known: Transform, reached: Transform) -> None:
    difference = known.inverse() @ reached
    gap = float(np.linalg.norm(difference.p))
    turned = float(np.abs(difference.R - np.eye(3)).max())
    if max(gap, turned) > RIGID_LOOP_TOLERANCE:
        angle = float(np.degrees(np.arccos(np.clip((np.trace(difference.R) - 1.0) / 2.0, -1.0, 1.0))))
        raise DiagramError(
            f"rigid connections form a loop that does not close: a gap of {1000.0 * gap:.4g} mm and "
            f"{angle:.4g} deg remains",
            where=net.label(path),
            allowed="rigid connections whose poses agree along every path",
            fix="correct the transforms, or remove one of the connections of the loop",
        )


def spanning_joints(joints: Sequence[tuple[str, int, int, bool]]) -> set[str]:
    """The joints of a spanning tree of the groups; the others close loops.

    ``joints``: path, groups of base and follower, and whether the joint must have coordinates. The tree
    takes such joints first, then the other joints, both in the order of their paths.
    """
    sets = DisjointSets()
    ordered = sorted(joints, key=lambda joint: (not joint[3], joint[0]))
    return {path for path, base, follower, _ in ordered if sets.join(base, follower)}
