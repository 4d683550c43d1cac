"""Shapes of SDF links from ``<visual>``, or from ``<collision>`` where no visual can be shown."""

from __future__ import annotations

from dataclasses import replace

from armblocks.errors import FormatError
from armblocks.formats.file_findings import FileContext
from armblocks.formats.link_shapes import PRIMITIVES, mesh_shape, primitive
from armblocks.formats.sdf.frames import Frame, Frames
from armblocks.formats.sdf.rules import MESH, SHAPE
from armblocks.formats.sdf.values import number_in, text_in
from armblocks.formats.xml_elements import Element, note, shortened
from armblocks.robot.shapes import Material, Shape
from armblocks.spatial import Transform, Vector3

_NOT_DRAWN = ("empty", "plane")
"""Shapes that have no size."""


def shapes_of(link: Frame, frames: Frames, material: Material) -> tuple[Shape, ...] | None:
    """The shapes of a link; ``None`` if it has shapes, but none of them can be shown.

    Materials and textures are not used, infinite planes are not drawn.
    """
    elements = [*link.element.all("visual")] or [*link.element.all("collision")]
    if not elements:
        return ()
    context = frames.context
    before = len(context.findings)
    shapes = [shape for element in elements for shape in _readable(element, link, frames, context, material)]
    if shapes:
        return tuple(shapes)
    collisions = [*link.element.all("collision")] if elements[0].tag == "visual" else []
    unreported = replace(context, findings=[])
    shapes = [
        shape for element in collisions for shape in _readable(element, link, frames, unreported, material)
    ]
    return tuple(shapes) if shapes else (None if len(context.findings) > before else ())


def _readable(
    element: Element, link: Frame, frames: Frames, context: FileContext, material: Material
) -> list[Shape]:
    """The shapes of a visual or collision; a finding where its numbers cannot be read."""
    try:
        return _shapes(element, link, frames, context, material)
    except FormatError as error:
        note(context, SHAPE, element, f"it is not shown: {error.what}", link.element.label)
        return []


def _shapes(
    element: Element, link: Frame, frames: Frames, context: FileContext, material: Material
) -> list[Shape]:
    geometry = element.first("geometry")
    kind = geometry.children[0] if geometry is not None and geometry.children else None
    if kind is None:
        note(context, SHAPE, element, "it has no shape", link.element.label)
        return []
    if kind.tag in _NOT_DRAWN:
        return []
    pose = frames.inside(link, element.first("pose") or element.first("origin"))
    if kind.tag == "mesh":
        return _mesh(kind, link, context, pose, material)
    if kind.tag not in PRIMITIVES:
        what = f"the shape '{shortened(kind.tag)}' is not supported"
        note(context, SHAPE, kind, what, link.element.label)
        return []
    if kind.tag == "box":
        sizes = _vector(kind, "size", (1.0, 1.0, 1.0))
    else:
        sizes = (number_in(kind, "radius", 1.0), number_in(kind, "length", 1.0), 1.0)
    if min(sizes) <= 0:
        what = f"the {kind.tag} has the size {min(sizes):g} m; it is omitted"
        note(context, SHAPE, kind, what, link.element.label)
        return []
    return primitive(kind.tag, sizes, material, pose)


def _mesh(
    kind: Element, link: Frame, context: FileContext, pose: Transform, material: Material
) -> list[Shape]:
    """The mesh of a file; a finding states why it is not shown, if so."""
    file = text_in(kind, "uri") or text_in(kind, "filename") or kind.attributes.get("filename", "")
    shape: Shape | str = "a part of a mesh file cannot be selected"
    if kind.first("submesh") is None:
        scale = _vector(kind, "scale", (1.0, 1.0, 1.0))
        shape = mesh_shape(file, scale, material, pose, context, link.source.folder)
    if not isinstance(shape, str):
        return [shape]
    note(context, MESH, kind, f"the mesh '{shortened(file)}' is not shown: {shape}", link.element.label)
    return []


def _vector(parent: Element, tag: str, default: Vector3) -> Vector3:
    child = parent.first(tag)
    if child is None:
        return parent.vector(tag, default)
    x, y, z = child.text_numbers(3)
    return x, y, z
