"""Triangle meshes of files, reduced to a number of triangles that can be drawn quickly."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import PurePath

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.errors import FormatError
from armblocks.formats.meshes.dae import dae_corners
from armblocks.formats.meshes.glb import glb_corners
from armblocks.formats.meshes.msh import msh_corners
from armblocks.formats.meshes.obj import obj_corners
from armblocks.formats.meshes.stl import stl_corners
from armblocks.robot.shapes import Material, Mesh, Pose

MAX_BYTES = 64 * 2**20
"""Maximum size of a mesh file."""
MAX_LENGTH = 1e6
"""Maximum magnitude of the coordinates of a mesh, m."""
MAX_TRIANGLES = 2000
"""Maximum number of triangles of a mesh after reduction."""

Corners = NDArray[np.float64]
"""The corners of all triangles, (F, 3, 3), counter-clockwise seen from outside."""

READERS: Mapping[str, Callable[[bytes, str], Corners]] = {
    ".stl": stl_corners,
    ".obj": obj_corners,
    ".dae": dae_corners,
    ".glb": glb_corners,
    ".msh": msh_corners,
}
"""The readers of mesh files by suffix: functions of a file's bytes and its name in messages."""


def mesh_corners(data: bytes, name: str, scale: ArrayLike = (1.0, 1.0, 1.0)) -> Corners:
    """The corners of the triangles of a mesh file, multiplied by ``scale`` along x, y, z.

    ``name``: the file, whose suffix selects the reader. Raises ``FormatError``.
    """
    suffix = PurePath(name).suffix.lower()
    if suffix not in READERS:
        raise FormatError(
            f"'{suffix[:20]}' meshes are not supported",
            where=name,
            allowed=", ".join(READERS),
            fix="convert the mesh",
        )
    with np.errstate(all="ignore"):  # numbers that are not finite are refused below
        corners = scaled(READERS[suffix](data, name), np.asarray(scale))
    if not len(corners) or not np.isfinite(corners).all() or np.abs(corners).max() > MAX_LENGTH:
        raise FormatError(
            "the mesh has no triangles, or points that are not finite or too far away",
            where=name,
            allowed="triangles within 1000 km",
            fix="export the mesh again",
        )
    return corners


def scaled(corners: Corners, scale: NDArray[np.float64]) -> Corners:
    """The triangles multiplied by ``scale`` along x, y, z; a reflection reverses the corners."""
    return (corners * scale)[:, ::-1] if scale.prod() < 0 else corners * scale


def drawn_mesh(corners: Corners, material: Material, pose: Pose) -> Mesh:
    """The mesh with at most ``MAX_TRIANGLES`` triangles."""
    points, faces = _reduced(corners)
    return Mesh(
        vertices=tuple((float(x), float(y), float(z)) for x, y, z in points),
        faces=tuple((int(a), int(b), int(c)) for a, b, c in faces),
        material=material,
        pose=pose,
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
