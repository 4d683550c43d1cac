"""COLLADA meshes (DAE, versions 1.4 and 1.5): polygons, placed by the nodes of the scene.

``<unit>`` is applied. ``<up_axis>`` is ignored, as in Gazebo, RViz and MoveIt, for which robot files are
written. Materials, textures, lines and joints are not used; a skin has the pose of its binding.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator
from typing import cast

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import FormatError, counted
from armblocks.formats.meshes.node_tree import MeshNode, flattened
from armblocks.formats.meshes.polygons import Integers, check_number, corners_at, fans, strip
from armblocks.formats.xml_elements import Element, read_elements, shortened
from armblocks.spatial import rotation_about

Floats = NDArray[np.float64]
_POLYGONS = ("triangles", "polylist", "polygons", "trifans", "tristrips")
_MAX_STRIDE = 64


def dae_corners(data: bytes, name: str) -> Floats:
    """The corners of all triangles, (F, 3, 3), in m. Raises ``FormatError``; ``name``: the file."""
    root = read_elements(data, name)
    if root.tag != "COLLADA":
        raise root.error(f"the root element is <{shortened(root.tag)}>", allowed="<COLLADA>")
    return _Dae(root).corners()


class _Dae:
    """One file: its elements by id, and the triangles of its geometries."""

    def __init__(self, root: Element) -> None:
        self.root = root
        self.by_id: dict[str, Element] = {}
        self.geometries: dict[Element, Floats] = {}
        for element in _all_elements(root):
            if "id" in element.attributes:
                self.by_id.setdefault(element.attributes["id"], element)

    def corners(self) -> Floats:
        """The triangles of the scene; of all geometries, if there is no scene."""
        asset = self.root.first("asset")
        unit = asset.first("unit") if asset is not None else None
        metres = unit.number("meter", 1.0) if unit is not None else 1.0
        scene = self.root.first("scene")
        instance = scene.first("instance_visual_scene") if scene is not None else None
        if instance is not None:
            roots = [*self.target(instance, "url", "visual_scene").all("node")]
        else:
            roots = [
                node
                for library in self.root.all("library_visual_scenes")
                for visual in library.all("visual_scene")
                for node in visual.all("node")
            ]
        if roots:
            corners = flattened(roots, self.node, self.root.file)
        else:
            libraries = self.root.all("library_geometries")
            geometries = [g for library in libraries for g in library.all("geometry")]
            corners = np.concatenate([np.zeros((0, 3, 3)), *(self.geometry(g) for g in geometries)])
        return corners * metres

    def target(self, element: Element, attribute: str, tag: str) -> Element:
        """The element with a tag to which a reference ``#id`` refers."""
        reference = element.required(attribute, "#id")
        target = self.by_id.get(reference.removeprefix("#"))
        if not reference.startswith("#") or target is None or target.tag != tag:
            raise element.error(
                f"there is no {tag} '{shortened(reference)}' in this file", allowed="#id of this file"
            )
        return target

    def node(self, key: Hashable) -> MeshNode:
        """A ``<node>``, or an ``<instance_node>`` with the node that it refers to."""
        node = cast("Element", key)
        transform = np.eye(4)
        corners: list[Floats] = []
        children: list[Element] = []
        for child in node.children:
            if child.tag == "node":
                children.append(child)
            elif child.tag == "instance_node":
                children.append(self.target(child, "url", "node"))
            elif child.tag == "instance_geometry":
                corners.append(self.geometry(self.target(child, "url", "geometry")))
            elif child.tag == "instance_controller":
                corners += self.skin(self.target(child, "url", "controller"))
            else:
                transform = transform @ _transform(child)
        return MeshNode(transform, corners, children)

    def skin(self, controller: Element) -> list[Floats]:
        """The triangles of a skin in the pose of its binding."""
        skin = controller.first("skin")
        if skin is None:
            return []
        source = self.by_id.get(skin.attributes.get("source", "").removeprefix("#"))
        if source is None or source.tag != "geometry":
            return []
        binding = skin.first("bind_shape_matrix")
        bound = np.eye(4) if binding is None else _floats(binding, 16).reshape(4, 4)
        return [self.geometry(source) @ bound[:3, :3].T + bound[:3, 3]]

    def geometry(self, geometry: Element) -> Floats:
        """The triangles of a ``<geometry>``, (F, 3, 3)."""
        if geometry not in self.geometries:
            mesh = geometry.first("mesh")
            polygons = [] if mesh is None else [child for child in mesh.children if child.tag in _POLYGONS]
            points: dict[Element, Floats] = {}
            parts = [np.zeros((0, 3, 3)), *(self.polygons(element, points) for element in polygons)]
            check_number(sum(map(len, parts)) + sum(map(len, self.geometries.values())), geometry.file)
            self.geometries[geometry] = np.concatenate(parts)
        return self.geometries[geometry]

    def polygons(self, element: Element, points_of_sources: dict[Element, Floats]) -> Floats:
        """The triangles of one list of polygons. ``points_of_sources``: the points that were read before."""
        inputs = [*element.all("input")]
        offsets = [_offset(entry) for entry in inputs]
        vertex = next((k for k, i in enumerate(inputs) if i.attributes.get("semantic") == "VERTEX"), None)
        if vertex is None:
            return np.zeros((0, 3, 3))
        source = self.source_of(inputs[vertex])
        if source not in points_of_sources:
            points_of_sources[source] = self.points(source)
        lists = [_indices(p) for p in element.all("p")]
        stride = max(offsets) + 1
        for p, indices in zip(element.all("p"), lists):
            if len(indices) % stride:
                raise p.error(
                    f"{counted(len(indices), 'index is', 'indices are')} given",
                    allowed=f"a multiple of {stride}",
                )
        corners = [indices[offsets[vertex] :: stride] for indices in lists]
        all_corners = np.concatenate([np.zeros(0, np.int64), *corners])
        return corners_at(points_of_sources[source], all_corners[_triangles(element, corners)], element.file)

    def source_of(self, entry: Element) -> Element:
        """The ``<source>`` of the positions of an input of the kind VERTEX."""
        vertices = self.target(entry, "source", "vertices")
        for described in vertices.all("input"):
            if described.attributes.get("semantic") == "POSITION":
                return self.target(described, "source", "source")
        raise vertices.error("the vertices have no positions", allowed='<input semantic="POSITION"/>')

    def points(self, source: Element) -> Floats:
        """The points (N, 3) of a source."""
        common = source.first("technique_common")
        accessor = common.first("accessor") if common is not None else None
        if accessor is None:
            raise source.error("the source has no accessor", allowed="<technique_common><accessor …/>")
        values = _floats(self.target(accessor, "source", "float_array"))
        stride = _whole(accessor, "stride", 1)
        offset, count = _whole(accessor, "offset", 0), _whole(accessor, "count", 0)
        names = [param.attributes.get("name", "").upper() for param in accessor.all("param")]
        columns = [names.index(axis) if axis in names else k for k, axis in enumerate("XYZ")]
        if not max(columns) < stride <= _MAX_STRIDE or offset + count * stride > len(values):
            raise accessor.error(
                f"{counted(count, 'point')} with {counted(stride, 'number')} each cannot be read "
                f"from {counted(len(values), 'number')}",
                allowed="three coordinates for each point",
            )
        return values[offset : offset + count * stride].reshape(count, stride)[:, columns]


def _triangles(element: Element, corners: list[Integers]) -> Integers:
    """Positions (F, 3) in the joined lists of corners."""
    lengths = np.array([len(part) for part in corners], np.int64)
    total = int(lengths.sum())
    if element.tag == "triangles":
        return np.arange(total - total % 3).reshape(-1, 3)
    if element.tag == "tristrips":
        begins = np.cumsum(lengths) - lengths
        parts = [begin + strip(int(n)) for begin, n in zip(begins, lengths)]
        return np.concatenate([np.zeros((0, 3), np.int64), *parts])
    if element.tag == "polylist":
        counts = element.first("vcount")
        lengths = np.zeros(0, np.int64) if counts is None else _indices(counts)
        if (lengths < 0).any() or lengths.sum(dtype=float) != total:
            raise element.error(f"<vcount> does not agree with the {total} corners in <p>")
    return fans(lengths, element.file)


def _transform(element: Element) -> Floats:
    """The transform (4, 4) of an element of a node; the identity for other elements."""
    if element.tag == "matrix":
        return _floats(element, 16).reshape(4, 4)
    T = np.eye(4)
    if element.tag == "translate":
        T[:3, 3] = _floats(element, 3)
    elif element.tag == "scale":
        T[:3, :3] = np.diag(_floats(element, 3))
    elif element.tag == "rotate":
        x, y, z, degrees = _floats(element, 4).tolist()
        length = math.hypot(x, y, z)
        if math.isfinite(length) and math.isfinite(degrees) and length > 0:
            T[:3, :3] = rotation_about((x / length, y / length, z / length), math.radians(degrees))
    elif element.tag in ("skew", "lookat"):
        raise element.error(
            f"<{element.tag}> is not supported",
            allowed="matrix, translate, rotate, scale",
            fix="export again",
        )
    return T


def _floats(element: Element, count: int | None = None) -> Floats:
    """The numbers in the text of an element."""
    words = element.text.split()
    if count is not None and len(words) != count:
        raise element.error(
            f"<{element.tag}> has {counted(len(words), 'number')}", allowed=counted(count, "number")
        )
    try:
        return np.fromiter(map(float, words), np.float64, len(words))
    except ValueError:
        raise _not_numbers(element) from None


def _indices(element: Element) -> Integers:
    """The whole numbers in the text of an element."""
    words = element.text.split()
    try:
        return np.fromiter(map(int, words), np.int64, len(words))
    except (ValueError, OverflowError):
        raise _not_numbers(element) from None


def _not_numbers(element: Element) -> FormatError:
    return element.error(
        f"<{element.tag}> contains something that is not a number", allowed="numbers with spaces between them"
    )


def _whole(element: Element, attribute: str, default: int) -> int:
    value = element.number(attribute, float(default))
    if value < 0 or value != int(value) or value > 2**53:
        raise element.error(
            f"the attribute '{attribute}' is {value:g}", allowed="whole numbers, zero or more"
        )
    return int(value)


def _offset(entry: Element) -> int:
    offset = _whole(entry, "offset", 0)
    if offset >= _MAX_STRIDE:
        raise entry.error(f"the offset is {offset}", allowed=f"less than {_MAX_STRIDE}")
    return offset


def _all_elements(root: Element) -> Iterator[Element]:
    waiting = [root]
    while waiting:
        element = waiting.pop()
        yield element
        waiting += reversed(element.children)
