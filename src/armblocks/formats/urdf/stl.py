"""STL meshes, binary and ASCII, reduced to a number of triangles that can be drawn quickly."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import FormatError
from armblocks.robot.shapes import Material, Mesh, Pose

MAX_BYTES = 64 * 2**20
"""Maximum size of a mesh file."""
MAX_TRIANGLES = 2000
"""Maximum number of triangles of a mesh after reduction."""

_HEADER = 84
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_VERTEX = re.compile(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)")


def stl_mesh(data: bytes, name: str, scale: NDArray[np.float64], material: Material, pose: Pose) -> Mesh:
    """The mesh of an STL file with at most ``MAX_TRIANGLES`` triangles. Raises ``FormatError``.

    ``scale``: factors along x, y, z.
    """
    corners = _corners(data, name).astype(np.float64) * scale
    if not len(corners) or not np.isfinite(corners).all() or np.abs(corners).max() > 1e6:
        raise FormatError(
            "the mesh has no triangles, or points that are not finite",
            where=name,
            allowed="triangles within 1000 km",
            fix="export the mesh again",
        )
    if scale.prod() < 0:  # a mirror image: keep the corners counter-clockwise seen from outside
        corners = corners[:, ::-1]
    points, faces = _reduced(corners)
    return Mesh(
        vertices=tuple((float(x), float(y), float(z)) for x, y, z in points),
        faces=tuple((int(a), int(b), int(c)) for a, b, c in faces),
        material=material,
        pose=pose,
    )


def _corners(data: bytes, name: str) -> NDArray[np.float32] | NDArray[np.float64]:
    """The corners of all triangles, (F, 3, 3)."""
    count = int.from_bytes(data[80:_HEADER], "little") if len(data) >= _HEADER else -1
    if count >= 0 and len(data) >= _HEADER + count * _RECORD.itemsize and count > 0:
        return np.frombuffer(data, _RECORD, count, _HEADER)["corners"]
    if data.lstrip()[:5].lower() == b"solid":
        try:
            numbers = np.array([[float(word) for word in row] for row in _VERTEX.findall(data)])
            return numbers.reshape(-1, 3, 3)
        except ValueError:
            pass
    raise FormatError(
        "this is not an STL mesh", where=name, allowed="binary or ASCII STL", fix="export the mesh as STL"
    )


def _reduced(corners: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Points and faces. Points are merged in cells of a grid that grow until there are few enough triangles.

    Source: Rossignac and Borrel, *Multi-resolution 3D approximations for rendering complex scenes*, 1993.
    """
    points = corners.reshape(-1, 3)
    low = points.min(axis=0)
    size = max(float((points.max(axis=0) - low).max()), 1e-9)
    cells = 4096.0
    while True:
        keys: NDArray[np.int64] = np.rint((points - low) * (cells / size)).astype(np.int64)
        packed = (keys[:, 0] << 42) | (keys[:, 1] << 21) | keys[:, 2]
        _, first, index = np.unique(packed, return_index=True, return_inverse=True)
        faces = index.reshape(-1, 3)
        solid = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
        faces = faces[solid]
        if len(faces) <= MAX_TRIANGLES or cells <= 4:
            return points[first], faces[:MAX_TRIANGLES]
        cells /= 1.6
