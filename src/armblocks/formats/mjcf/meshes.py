"""Mesh assets of MJCF: triangles from files, in the frame in which the file places them."""

from __future__ import annotations

from pathlib import PurePath

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import FormatError
from armblocks.files import read_bounded
from armblocks.formats.file_findings import FileContext
from armblocks.formats.meshes.mesh_file import MAX_BYTES, MAX_LENGTH, drawn_mesh, mesh_corners, scaled
from armblocks.formats.mjcf.poses import of_quaternion
from armblocks.formats.mjcf.settings import Defaults, Settings, sections
from armblocks.formats.referenced_files import resolved
from armblocks.formats.xml_elements import Element, shortened
from armblocks.robot.shapes import IDENTITY, Material, Mesh

Corners = NDArray[np.float64]


class MeshAssets:
    """The mesh assets of a file by name, read at their first use."""

    def __init__(self, root: Element, defaults: Defaults, settings: Settings, context: FileContext) -> None:
        self._settings = settings
        self._context = context
        self._elements: dict[str, Element] = {}
        self._read: dict[str, Corners | str] = {}
        self._drawings: dict[str, Mesh] = {}
        for element in sections(root, "asset"):
            if element.tag == "mesh":
                mesh = defaults.applied(element)
                name = mesh.attributes.get("name") or PurePath(mesh.attributes.get("file", "")).stem
                self._elements[name] = mesh

    def triangles(self, name: str) -> Corners | str:
        """The corners of the triangles of a mesh, (F, 3, 3), m; or the reason why there are none."""
        if name not in self._read:
            element = self._elements.get(name)
            self._read[name] = (
                f"there is no mesh '{shortened(name)}'" if element is None else self._of(element)
            )
        return self._read[name]

    def drawing(self, name: str, corners: Corners) -> Mesh:
        """The mesh for drawings, reduced once for all shapes that use it."""
        if name not in self._drawings:
            self._drawings[name] = drawn_mesh(corners, Material.PAINT, IDENTITY)
        return self._drawings[name]

    def mass_rule(self, name: str) -> str:
        """How the mass of the mesh is computed: ``legacy`` (the default of MuJoCo), ``exact``, or another."""
        element = self._elements.get(name)
        return "legacy" if element is None else element.attributes.get("inertia", "legacy").strip()

    def _of(self, element: Element) -> Corners | str:
        try:
            corners = self._corners(element)
        except FormatError as error:
            return error.what
        if isinstance(corners, str):
            return corners
        origin = np.array(element.vector("refpos", (0.0, 0.0, 0.0)))
        rotation = np.eye(3)
        if "refquat" in element.attributes:
            rotation = of_quaternion(element, element.numbers("refquat", (4,)))
        scale = np.array(element.vector("scale", (1.0, 1.0, 1.0)))
        placed = scaled((corners - origin) @ rotation, scale)
        return placed if np.abs(placed).max() <= MAX_LENGTH else "its points are too far away"

    def _corners(self, element: Element) -> Corners | str:
        if "vertex" in element.attributes:
            return self._inline(element)
        file = element.attributes.get("file", "").strip()
        if not file:
            return "it names no file"
        if self._settings.only_file_names:
            file = PurePath(file).name
        path = resolved(str(PurePath(self._settings.mesh_folder) / file), self._context)
        return path if isinstance(path, str) else mesh_corners(read_bounded(path, MAX_BYTES), file)

    def _inline(self, element: Element) -> Corners | str:
        counts = range(3, 3 * 100_000)
        if "face" not in element.attributes:
            return "it has vertices without faces, whose convex hull is not computed"
        vertices, faces = element.numbers("vertex", counts), element.numbers("face", counts)
        points = np.array(vertices[: len(vertices) // 3 * 3]).reshape(-1, 3)
        rows = np.array(faces[: len(faces) // 3 * 3]).reshape(-1, 3).astype(np.int64)
        if rows.min() < 0 or rows.max() >= len(points):
            raise element.error(
                "a face names a vertex that does not exist", allowed=f"0 to {len(points) - 1}"
            )
        return points[rows]
