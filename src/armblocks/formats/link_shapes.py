"""Shapes of links that the readers of robot files share: boxes, cylinders, spheres, capsules, meshes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path, PurePath

from armblocks.errors import FormatError
from armblocks.files import read_bounded
from armblocks.formats.file_findings import FileContext
from armblocks.formats.meshes.mesh_file import MAX_BYTES, READERS, drawn_mesh, mesh_corners
from armblocks.formats.referenced_files import resolved
from armblocks.formats.xml_elements import shortened
from armblocks.robot.shapes import Box, Cylinder, Material, Pose, Shape, Sphere
from armblocks.spatial import Transform, Vector3, transl

PRIMITIVES = ("box", "cylinder", "sphere", "capsule")
"""The kinds of :func:`primitive`."""


def primitive(kind: str, sizes: Vector3, material: Material, pose: Transform) -> list[Shape]:
    """The shapes of a primitive.

    ``sizes``, m: the lengths of a box along x, y, z; else radius and length along z (of a capsule without its
    ends, of a sphere any), and a third number that is not used.
    """
    if kind == "box":
        return [Box(size=sizes, material=material, pose=pose_rows(pose))]
    radius, length, _ = sizes
    ball = Sphere(radius=radius, material=material, pose=pose_rows(pose))
    if kind == "sphere":
        return [ball]
    body = Cylinder(radius=radius, length=length, material=material, pose=pose_rows(pose))
    if kind == "cylinder":
        return [body]
    ends = (transl(0.0, 0.0, side * length / 2) for side in (-1.0, 1.0))
    return [body, *(replace(ball, pose=pose_rows(pose @ end)) for end in ends)]


def mesh_shape(
    file: str,
    scale: Vector3,
    material: Material,
    pose: Transform,
    context: FileContext,
    folder: Path | None = None,
) -> Shape | str:
    """The mesh of a file, or the reason why it is not shown.

    ``folder``: relative paths start there; by default in the folder of the context.
    """
    suffix = PurePath(file).suffix.lower()
    if suffix not in READERS:
        return f"'{shortened(suffix)}' meshes are not supported"
    path = resolved(file, context, folder)
    if isinstance(path, str):
        return path
    try:
        corners = mesh_corners(read_bounded(path, MAX_BYTES), file, scale)
    except FormatError as error:
        return error.what
    return drawn_mesh(corners, material, pose_rows(pose))


def pose_rows(pose: Transform) -> Pose:
    """The pose of a shape as rows of numbers."""
    a, b, c, d = (tuple(row) for row in pose.matrix.tolist())
    return (a, b, c, d)
