"""Meshes that are placed by a tree of nodes, each with a transform in its parent's frame."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armblocks.formats.meshes.polygons import check_number, invalid_mesh

MAX_LEVELS = 64
"""Maximum nesting of nodes. Nodes that refer to themselves exceed it."""
MAX_NODES = 20_000
"""Maximum number of placed nodes. A node that several others refer to counts several times."""


class MeshNode(NamedTuple):
    """``transform`` (4, 4) in the parent's frame; ``corners``: (F, 3, 3) each; ``children``: keys."""

    transform: NDArray[np.float64]
    corners: Sequence[NDArray[np.float64]]
    children: Sequence[Hashable]


def flattened(
    roots: Sequence[Hashable], node_of: Callable[[Hashable], MeshNode], name: str
) -> NDArray[np.float64]:
    """The corners (F, 3, 3) of all nodes below ``roots``, in the frame of the roots' parent.

    A mirrored mesh keeps its corners counter-clockwise seen from outside. ``name`` is the file in messages.
    Raises ``FormatError`` beyond the limits.
    """
    placed: list[NDArray[np.float64]] = []
    nodes: dict[Hashable, MeshNode] = {}
    waiting = [(key, np.eye(4), 1) for key in roots]
    visits = triangles = 0
    while waiting:
        key, parent, level = waiting.pop()
        visits += 1
        if level > MAX_LEVELS or visits > MAX_NODES:
            raise invalid_mesh(
                name,
                "the mesh has too many nodes, they are nested too deeply, or they refer to themselves",
                f"{MAX_NODES} nodes, {MAX_LEVELS} levels",
            )
        if key not in nodes:
            nodes[key] = node_of(key)
        node = nodes[key]
        transform = parent @ node.transform
        for corners in node.corners:
            triangles += len(corners)
            check_number(triangles, name)
            moved = corners @ transform[:3, :3].T + transform[:3, 3]
            placed.append(moved[:, ::-1] if np.linalg.det(transform[:3, :3]) < 0 else moved)
        if len(waiting) + len(node.children) > MAX_NODES:
            raise invalid_mesh(name, "the mesh has too many nodes", f"{MAX_NODES} nodes")
        waiting += [(child, transform, level + 1) for child in reversed(node.children)]
    return np.concatenate(placed) if placed else np.zeros((0, 3, 3))
