"""Wavefront OBJ meshes: vertices and faces; materials, texture coordinates and normals are not used."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from armblocks.formats.meshes.polygons import MAX_READ, check_number, corners_at, fans, invalid_mesh

_MAX_POINTS = 3 * MAX_READ


def obj_corners(data: bytes, name: str) -> NDArray[np.float64]:
    """The corners of all triangles, (F, 3, 3). Raises ``FormatError``; ``name`` is the file in messages.

    Polygons become fans of triangles. A negative index counts backwards from the last vertex before the face.
    """
    points: list[float] = []
    corners: list[int] = []
    counts: list[int] = []
    text = data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ")
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.split()
        if not words or words[0] not in (b"v", b"f"):
            continue
        try:
            if words[0] == b"v":
                x, y, z = words[1:4]  # behind them may be a weight or a colour
                points += (float(x), float(y), float(z))
            else:
                before = len(points) // 3
                indices = (int(word.partition(b"/")[0]) for word in words[1:])
                corners += [index - 1 if index > 0 else before + index if index else -1 for index in indices]
                counts.append(len(words) - 1)
        except ValueError:
            words_text = line[:40].decode("utf-8", "replace")
            raise invalid_mesh(
                f"{name}:{number}", f"'{words_text}' is not a vertex or face", "v x y z, f i j k"
            ) from None
        if len(corners) > _MAX_POINTS:
            check_number(len(corners) - 2 * len(counts), name)
    if not points:
        raise invalid_mesh(name, "this is not an OBJ mesh: it has no vertices", "lines such as v 0 0 1")
    # An index that 64 bits cannot hold is out of range in any case.
    limited = np.fromiter((min(max(index, -1), 2**62) for index in corners), np.int64, len(corners))
    triangles = fans(np.array(counts, np.int64), name)
    return corners_at(np.array(points).reshape(-1, 3), limited[triangles], name)
