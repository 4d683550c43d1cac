"""MSH meshes, the binary format of MuJoCo.

Four integers: the numbers of vertices, normals, texture coordinates and faces. Then the vertices (3 floats
each), normals (3), texture coordinates (2), and the faces (3 vertex numbers each). Source: MuJoCo
documentation, *Legacy MSH files*.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import FormatError

_HEADER = 16


def msh_corners(data: bytes, name: str) -> NDArray[np.float64]:
    """The corners of all triangles, (F, 3, 3). Raises ``FormatError``; ``name`` is the file in messages."""
    counts = [int.from_bytes(data[k : k + 4], "little", signed=True) for k in range(0, _HEADER, 4)]
    vertices, normals, textures, faces = counts
    words = 3 * vertices + 3 * normals + 2 * textures + 3 * faces
    if min(counts) < 0 or vertices < 1 or faces < 1 or len(data) != _HEADER + 4 * words:
        raise FormatError(
            f"this is not an MSH mesh with faces: it has {len(data)} bytes",
            where=name,
            allowed="the binary MSH format of MuJoCo, with vertices and faces",
            fix="convert the mesh to STL",
        )
    points = np.frombuffer(data, "<f4", 3 * vertices, _HEADER).reshape(-1, 3).astype(np.float64)
    rows = np.frombuffer(data, "<i4", 3 * faces, _HEADER + 4 * (words - 3 * faces)).reshape(-1, 3)
    if rows.min() < 0 or rows.max() >= vertices:
        wrong = int(rows.min()) if rows.min() < 0 else int(rows.max())
        raise FormatError(
            f"a face has the vertex number {wrong}",
            where=name,
            allowed=f"0 to {vertices - 1}",
            fix="convert the mesh to STL",
        )
    return points[rows]
