"""Reading and writing of the solid shapes of links as JSON objects."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

from armblocks.errors import counted
from armblocks.formats.json_document import Node, closed_members
from armblocks.robot.shapes import Box, Cylinder, Housing, Material, Mesh, Shape, Sphere


def _row(count: int) -> Callable[[Node], Any]:
    return lambda node: node.numbers(count)


def _rows(count: int, rows: int | None = None) -> Callable[[Node], Any]:
    def read(node: Node) -> tuple[tuple[float, ...], ...]:
        elements = node.elements()
        if rows is not None and len(elements) != rows:
            raise node.error(
                f"{counted(len(elements), 'row is', 'rows are')} given",
                allowed=f"{counted(rows, 'row')} of {counted(count, 'number')}",
            )
        return tuple(element.numbers(count) for element in elements)

    return read


def _faces(node: Node) -> tuple[tuple[int, ...], ...]:
    faces = _rows(3)(node)
    for face, element in zip(faces, node.elements()):
        if any(number < 0 or number != int(number) for number in face):
            raise element.error("a face is not a list of vertex numbers", allowed="3 whole numbers from 0")
    return tuple(tuple(int(number) for number in face) for face in faces)


_READERS: dict[str, Callable[[Node], Any]] = {
    "radius": Node.number,
    "length": Node.number,
    "bevel": Node.number,
    "roundness": Node.number,
    "start": _row(2),
    "end": _row(2),
    "size": _row(3),
    "vertices": _rows(3),
    "faces": _faces,
    "pose": _rows(4, 4),
    "material": lambda node: Material(node.choice([material.value for material in Material])),
}
_KINDS: dict[str, type[Shape]] = {
    kind.__name__.lower(): kind for kind in (Cylinder, Housing, Box, Sphere, Mesh)
}


def shape_from_json(node: Node) -> Shape:
    """The shape of a JSON object. Raises ``FormatError`` with file, line and path."""
    every_key = ["shape", *_READERS]
    word = closed_members(node, every_key, required=("shape",))["shape"].choice(_KINDS)
    kind = _KINDS[word]
    fields = {field.name: field for field in dataclasses.fields(kind)}
    required = [name for name, field in fields.items() if field.default is dataclasses.MISSING]
    members = closed_members(node, ["shape", *fields], required)
    del members["shape"]
    return kind(**{name: _READERS[name](member) for name, member in members.items()})


def shape_to_json(shape: Shape) -> dict[str, object]:
    """The JSON object that describes a shape."""
    entry: dict[str, object] = {"shape": type(shape).__name__.lower()}
    for field in dataclasses.fields(shape):
        value = getattr(shape, field.name)
        if value != field.default:
            entry[field.name] = value.value if isinstance(value, Material) else value
    return entry
