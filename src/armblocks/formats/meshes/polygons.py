"""Triangles from polygons, strips and points with indices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import FormatError, counted

MAX_READ = 2_000_000
"""Maximum number of triangles of a mesh file before reduction."""

Integers = NDArray[np.int64]


def fans(counts: Integers, name: str) -> Integers:
    """The triangles (F, 3) of polygons: positions in the list of all their corners, by polygons.

    ``counts``: the number of corners of each polygon, in order. Each triangle has the first corner of its
    polygon, so that the triangles of a convex polygon cover it. Polygons with fewer than three corners have
    no triangles. Raises ``FormatError`` for more than ``MAX_READ`` triangles; ``name``: the file in
    messages.
    """
    if counts.size and counts.min() < 0:
        raise invalid_mesh(name, f"a polygon has {int(counts.min())} corners")
    triangles = np.maximum(counts - 2, 0)
    check_number(float(triangles.sum(dtype=float)), name)
    polygon = np.repeat(np.arange(len(counts)), triangles)
    number = np.arange(len(polygon)) - (np.cumsum(triangles) - triangles)[polygon]
    first = (np.cumsum(counts) - counts)[polygon]
    return np.stack([first, first + number + 1, first + number + 2], axis=-1)


def strip(count: int) -> Integers:
    """The triangles (F, 3) of a strip of ``count`` corners, all with the same orientation."""
    first = np.arange(max(count - 2, 0))
    odd = first % 2
    return np.stack([first, first + 1 + odd, first + 2 - odd], axis=-1)


def corners_at(points: NDArray[np.float64], indices: Integers, name: str) -> NDArray[np.float64]:
    """The corners (F, 3, 3) of triangles, from points (N, 3) and indices (F, 3)."""
    if indices.size and (indices.min() < 0 or indices.max() >= len(points)):
        worst = int(indices.max() if indices.max() >= len(points) else indices.min())
        raise invalid_mesh(
            name, f"a triangle refers to point {worst}; the mesh has {counted(len(points), 'point')}"
        )
    return points[indices].reshape(-1, 3, 3)


def check_number(triangles: float, name: str) -> None:
    """Raise ``FormatError`` for more than ``MAX_READ`` triangles."""
    if triangles > MAX_READ:
        raise invalid_mesh(
            name, f"the mesh has {triangles:.0f} triangles", f"at most {MAX_READ}", "simplify the mesh"
        )


def invalid_mesh(name: str, what: str, allowed: str = "", fix: str = "export the mesh again") -> FormatError:
    """The error for a mesh file, which the caller raises."""
    return FormatError(what, where=name, allowed=allowed, fix=fix)
