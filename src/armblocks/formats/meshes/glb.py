"""glTF 2.0 meshes in binary files (GLB), with the buffer inside the file.

The y axis of glTF points up, z is up in armblocks: (x, y, z) becomes (x, -z, y). Source: Khronos, *glTF 2.0
Specification*, sections 3.4 (coordinates), 3.6 (buffers, accessors), 3.7 (meshes), 4.4 (GLB).
"""

from __future__ import annotations

from collections.abc import Hashable
from typing import cast

import numpy as np
from numpy.typing import NDArray

from armblocks.formats.json_document import Node, read_document
from armblocks.formats.meshes.node_tree import MeshNode, flattened
from armblocks.formats.meshes.polygons import Integers, check_number, corners_at, fans, invalid_mesh, strip

MAX_JSON_BYTES = 8 * 2**20
_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
_NUMBERS = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_APPEARANCE = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_")
"""Prefixes of the names of extensions that do not change the triangles."""


def glb_corners(data: bytes, name: str) -> NDArray[np.float64]:
    """The corners of all triangles, (F, 3, 3), z up. Raises ``FormatError``; ``name``: the file in messages.

    The nodes of the file's scene are placed by their transforms; skins, morph targets, points and lines are
    not used.
    """
    return _Glb(data, name).corners()


class _Glb:
    """One file: its lists of nodes, meshes, accessors and views, and the bytes of its buffer."""

    def __init__(self, data: bytes, name: str) -> None:
        self.name = name
        if len(data) < 20 or data[:4] != b"glTF":
            raise invalid_mesh(name, "this is not a binary glTF file", "GLB, version 2")
        version, length, size = (int.from_bytes(data[k : k + 4], "little") for k in (4, 8, 12))
        if version != 2 or length > len(data) or data[16:20] != b"JSON" or 20 + size > length:
            raise invalid_mesh(
                name, f"the GLB file of version {version} is damaged or incomplete", "GLB, version 2"
            )
        root = read_document(data[20 : 20 + size].rstrip(b"\0 "), name, MAX_JSON_BYTES)
        self.root = root.members()
        begin = 20 + size
        binary = int.from_bytes(data[begin : begin + 4], "little")
        self.binary = b""
        if data[begin + 4 : begin + 8] == b"BIN\0":
            self.binary = data[begin + 8 : min(begin + 8 + binary, length)]
        for extension in self.list("extensionsRequired"):
            if not extension.text().startswith(_APPEARANCE):
                what = f"the file requires the extension '{extension.text()[:60]}', which is not supported"
                raise invalid_mesh(name, what, "glTF without extensions of the geometry", "export without it")
        self.nodes = self.list("nodes")
        self.meshes = self.list("meshes")
        self.accessors = self.list("accessors")
        self.views = self.list("bufferViews")
        self.buffers = self.list("buffers")

    def list(self, key: str) -> list[Node]:
        """The elements of a list of the file; none if it is absent."""
        return self.root[key].elements() if key in self.root else []

    def corners(self) -> NDArray[np.float64]:
        """The triangles of the default scene; of all nodes without a parent if there is no scene."""
        scenes = self.list("scenes")
        if scenes:
            default_scene = _at(scenes, self.root["scene"], "scene") if "scene" in self.root else scenes[0]
            scene = default_scene.members()
            roots = [_index(node, self.nodes, "node") for node in _elements(scene, "nodes")]
        else:
            inner = {
                _index(child, self.nodes, "node")
                for node in self.nodes
                for child in _elements(node.members(), "children")
            }
            roots = [k for k in range(len(self.nodes)) if k not in inner]
        return flattened(
            [-1], lambda key: MeshNode(_UP, (), roots) if key == -1 else self.node(key), self.name
        )

    def node(self, key: Hashable) -> MeshNode:
        """Node number ``key``."""
        node = self.nodes[cast("int", key)].members()
        meshes = [self.mesh(_at(self.meshes, node["mesh"], "mesh"))] if "mesh" in node else []
        children = [_index(child, self.nodes, "node") for child in _elements(node, "children")]
        return MeshNode(_transform(node), meshes, children)

    def mesh(self, mesh: Node) -> NDArray[np.float64]:
        """The corners of all primitives of a mesh that are triangles."""
        parts = [np.zeros((0, 3, 3))]
        for primitive in _elements(mesh.members(), "primitives"):
            members = primitive.members()
            mode = int(members["mode"].number()) if "mode" in members else _TRIANGLES
            attributes = members["attributes"].members() if "attributes" in members else {}
            if mode not in (_TRIANGLES, _STRIP, _FAN) or "POSITION" not in attributes:
                continue
            points = self.values(attributes["POSITION"], 3).astype(np.float64)
            indices = np.arange(len(points))
            if "indices" in members:
                indices = self.values(members["indices"], 1).astype(np.int64).ravel()
            parts.append(corners_at(points, indices[self.triangles(mode, len(indices))], self.name))
            check_number(sum(map(len, parts)), self.name)
        return np.concatenate(parts)

    def triangles(self, mode: int, count: int) -> Integers:
        """Positions of the triangles' corners in the list of ``count`` indices."""
        if mode == _FAN:
            return fans(np.array([count]), self.name)
        return strip(count) if mode == _STRIP else np.arange(count - count % 3).reshape(-1, 3)

    def values(self, reference: Node, width: int) -> NDArray[np.generic]:
        """The numbers (N, width) of an accessor."""
        accessor = _at(self.accessors, reference, "accessor")
        members = accessor.members()
        kind = members["type"].text() if "type" in members else ""
        number = _NUMBERS.get(_whole(members, "componentType"))
        if (kind, number == "<f4") != (("SCALAR", False) if width == 1 else ("VEC3", True)) or not number:
            allowed = "positions of 32-bit numbers, indices of unsigned integers"
            raise accessor.error(
                "the accessor has another type", allowed=allowed, fix="export the mesh again"
            )
        if "sparse" in members or "bufferView" not in members:
            what = "the accessor is sparse or compressed, which is not supported"
            raise accessor.error(
                what, allowed="accessors with a bufferView", fix="export without compression"
            )
        view = _at(self.views, members["bufferView"], "bufferView")
        described = view.members()
        if "buffer" not in described:
            raise view.error("the bufferView has no buffer", fix="export the mesh again")
        buffer = _at(self.buffers, described["buffer"], "buffer")
        if "uri" in buffer.members() or buffer is not self.buffers[0]:
            what = "the buffer is outside of the GLB file"
            raise buffer.error(what, allowed="one buffer, inside the file", fix="export as one GLB file")
        size = np.dtype(number).itemsize * width
        count, stride = _whole(members, "count"), _whole(described, "byteStride") or size
        begin = _whole(described, "byteOffset") + _whole(members, "byteOffset")
        end = begin + (count - 1) * stride + size
        limit = _whole(described, "byteOffset") + _whole(described, "byteLength")
        if stride < size or (count and end > min(limit, len(self.binary))):
            raise accessor.error(
                f"the accessor needs {end} bytes of a buffer that has {min(limit, len(self.binary))}",
                allowed="accessors inside the buffer",
                fix="export the mesh again",
            )
        rows = np.ndarray((count, width), number, self.binary, begin if count else 0, (stride, size // width))
        return rows.copy()


def _elements(members: dict[str, Node], key: str) -> list[Node]:
    return members[key].elements() if key in members else []


def _whole(members: dict[str, Node], key: str) -> int:
    """A whole number that is not negative; 0 if it is absent."""
    if key not in members:
        return 0
    value = members[key].value
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise members[key].error(
            "the value is not a whole number of zero or more", fix="export the mesh again"
        )
    return value


def _index(reference: Node, entries: list[Node], kind: str) -> int:
    """The index of an entry of a list of the file."""
    index = _whole({kind: reference}, kind)
    if index >= len(entries):
        what = f"there is no {kind} number {index}; the file has {len(entries)}"
        raise reference.error(what, fix="export the mesh again")
    return index


def _at(entries: list[Node], reference: Node, kind: str) -> Node:
    """The entry of a list of the file that a number refers to."""
    return entries[_index(reference, entries, kind)]


def _transform(node: dict[str, Node]) -> NDArray[np.float64]:
    """``matrix`` (by columns), or translation, rotation (quaternion x y z w) and scale of a node."""
    if "matrix" in node:
        return np.array(node["matrix"].numbers(16)).reshape(4, 4).T
    T = np.eye(4)
    if "rotation" in node:
        x, y, z, w = node["rotation"].numbers(4)
        norm = x * x + y * y + z * z + w * w
        if norm > 0:
            v = np.array([x, y, z])
            K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            T[:3, :3] = ((w * w - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * K) / norm
    if "scale" in node:
        T[:3, :3] *= np.array(node["scale"].numbers(3))
    if "translation" in node:
        T[:3, 3] = node["translation"].numbers(3)
    return T
