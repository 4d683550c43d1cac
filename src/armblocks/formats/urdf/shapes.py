"""Shapes of URDF links from ``<visual>``, or from ``<collision>`` where no visual can be shown."""

from __future__ import annotations

from dataclasses import replace

from armblocks.errors import FormatError
from armblocks.formats.file_findings import FileContext
from armblocks.formats.link_shapes import PRIMITIVES, mesh_shape, primitive
from armblocks.formats.urdf.origins import origin_of
from armblocks.formats.urdf.rules import MESH, SHAPE
from armblocks.formats.xml_elements import Element, note, shortened
from armblocks.robot.shapes import Material, Shape
from armblocks.spatial import Transform


def shapes_of(link: Element, context: FileContext, material: Material) -> tuple[Shape, ...] | None:
    """The shapes of a link; ``None`` if it has shapes, but none of them can be shown.

    Colours and textures are not used.
    """
    elements = [*link.all("visual")] or [*link.all("collision")]
    if not elements:
        return ()
    before = len(context.findings)
    shapes = [shape for element in elements for shape in _readable(element, link, context, material)]
    if shapes:
        return tuple(shapes)
    collisions = [*link.all("collision")] if elements[0].tag == "visual" else []
    unreported = replace(context, findings=[])
    shapes = [shape for element in collisions for shape in _readable(element, link, unreported, material)]
    return tuple(shapes) if shapes else (None if len(context.findings) > before else ())


def _readable(element: Element, link: Element, context: FileContext, material: Material) -> list[Shape]:
    """The shapes of a visual or collision; a finding where its numbers cannot be read."""
    try:
        return _shapes(element, link, context, material)
    except FormatError as error:
        note(context, SHAPE, element, f"it is not shown: {error.what}", link.label)
        return []


def _shapes(element: Element, link: Element, context: FileContext, material: Material) -> list[Shape]:
    geometry = element.first("geometry")
    kind = geometry.children[0] if geometry is not None and geometry.children else None
    if kind is None:
        note(context, SHAPE, element, "it has no shape", link.label)
        return []
    pose = origin_of(element, context)
    if kind.tag == "mesh":
        return _mesh(kind, link, context, pose, material)
    if kind.tag not in PRIMITIVES:
        note(context, SHAPE, kind, f"the shape '{shortened(kind.tag)}' is not known", link.label)
        return []
    sizes = kind.vector("size", (1.0, 1.0, 1.0)) if kind.tag == "box" else _round_sizes(kind)
    if min(sizes) <= 0:
        note(context, SHAPE, kind, f"the {kind.tag} has the size {min(sizes):g} m; it is omitted", link.label)
        return []
    return primitive(kind.tag, (sizes[0], sizes[1], sizes[2]), material, pose)


def _mesh(
    kind: Element, link: Element, context: FileContext, pose: Transform, material: Material
) -> list[Shape]:
    """The mesh of a file; a finding states why it is not shown, if so."""
    file = kind.attributes.get("filename", "").strip()
    scale = kind.vector("scale", (1.0, 1.0, 1.0))
    shape = mesh_shape(file, scale, material, pose, context)
    if not isinstance(shape, str):
        return [shape]
    note(context, MESH, kind, f"the mesh '{shortened(file)}' is not shown: {shape}", link.label)
    return []


def _round_sizes(kind: Element) -> tuple[float, float, float]:
    return kind.number("radius"), kind.number("length") if kind.tag != "sphere" else 1.0, 1.0
