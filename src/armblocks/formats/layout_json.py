"""The layout of a diagram as JSON: positions of blocks, routes, notes, bookmarks, the trigger of scopes.

The key of an entry is the name of the block, the text of the connection, or for notes a name that begins with
``/``. Entries of other programs are preserved among the extras. Bookmarks and the trigger are
separate objects.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping

from armblocks.diagram import (
    BLOCK_COLOURS,
    NAME_SIDES,
    ROTATIONS,
    Bookmark,
    Connection,
    Diagram,
    Note,
    Placement,
    PortRef,
    ScopeTrigger,
)
from armblocks.formats.json_document import Node, closed_members
from armblocks.formats.unknown_members import Extras, members_of, split_extras

_BOOKMARK = tuple(field.name for field in dataclasses.fields(Bookmark))
_TRIGGER = {field.name: field.default for field in dataclasses.fields(ScopeTrigger)}
_PLACEMENT = {field.name: field.default for field in dataclasses.fields(Placement)}
_LINE = re.compile(r"([^/]+)/([^/]+?) -- ([^/]+)/([^/]+)")
_CONNECTION = re.compile(r"([^/]+)/([^/]+?) -> ([^/]+)/([^/]+)")


def connection_from_json(node: Node) -> tuple[PortRef, PortRef]:
    """The two ends of a connection from its text."""
    match = _CONNECTION.fullmatch(node.text())
    if match is None:
        raise node.error(f"'{node.text()[:80]}' is not a connection", allowed='"block/output -> block/input"')
    return PortRef(match[1], match[2]), PortRef(match[3], match[4])


def line_from_json(node: Node) -> tuple[PortRef, PortRef]:
    """The two ends of a frame line from its text."""
    match = _LINE.fullmatch(node.text())
    if match is None:
        raise node.error(f"'{node.text()[:80]}' is not a frame line", allowed='"block/port -- block/port"')
    return PortRef(match[1], match[2]), PortRef(match[3], match[4])


def bookmark_from_json(node: Node) -> Bookmark:
    """The part of the sheet of a bookmark; raises ``FormatError`` and ``DiagramError``."""
    members = closed_members(node, _BOOKMARK, _BOOKMARK)
    return Bookmark(**{name: member.number() for name, member in members.items()})


def _index(node: Node) -> int:
    number = node.number()
    if number != int(number):
        raise node.error(f"the value is {number:g}", allowed="an integer")
    return int(number)


def scope_trigger_from_json(node: Node) -> ScopeTrigger:
    """The trigger of the scopes; raises ``FormatError`` and ``DiagramError``."""
    values: dict[str, object] = {}
    for name, member in closed_members(node, _TRIGGER).items():
        match _TRIGGER[name]:
            case bool():
                values[name] = member.boolean()
            case str():
                values[name] = member.text()
            case int():
                values[name] = _index(member)
            case _:
                values[name] = member.number()
    return ScopeTrigger(**values)  # pyright: ignore[reportArgumentType]


def bookmarks_to_json(diagram: Diagram) -> dict[str, object]:
    """The bookmarks of a diagram as plain values."""
    return {name: dataclasses.asdict(part) for name, part in diagram.bookmarks.items()}


class Layout:
    """The layout of an object: positions of blocks, routes of wires, and notes."""

    def __init__(self) -> None:
        self.placements: dict[str, Placement] = {}
        self.bends: dict[Connection, list[float]] = {}
        self.notes: dict[str, Note] = {}

    def read(self, key: str, node: Node, blocks: set[str], extras: Extras) -> None:
        """Add one entry. An entry that is not a block, wire or note belongs to another program and is
        preserved."""
        entry_members = _members_or_empty(node)
        if key in blocks:
            self.placements[key] = _placement(key, node, extras)
        elif "bends" in entry_members and (match := _CONNECTION.fullmatch(key)):
            members = split_extras(node, ("bends",), extras, "layout", key)
            wire = Connection(PortRef(match[1], match[2]), PortRef(match[3], match[4]))
            self.bends[wire] = [entry.number() for entry in members["bends"].elements()]
        elif key.startswith("/") and {"x", "y", "text"} <= entry_members.keys():
            members = split_extras(node, ("x", "y", "text"), extras, "layout", key)
            x, y = members["x"].number(), members["y"].number()
            self.notes[key] = Note(x=x, y=y, text=members["text"].text())
        else:
            extras.setdefault("layout", {})[key] = node.value


def layout_to_json(diagram: Diagram, extras: Mapping[str, object]) -> dict[str, object]:
    """The layout of a diagram as plain values; ``extras`` are the unknown members of its entries."""
    layout = dict(extras)
    for key, placement in diagram.layout.items():
        entry_members = {
            name: value
            for name, default in _PLACEMENT.items()
            if (value := getattr(placement, name)) != default
        }
        layout[key] = {**members_of(extras.get(key)), **entry_members}
    for wire, bends in diagram.bends.items():
        layout[str(wire)] = {**members_of(extras.get(str(wire))), "bends": list(bends)}
    for key, note in diagram.notes.items():
        layout[key] = {**members_of(extras.get(key)), **dataclasses.asdict(note)}
    return layout


def _placement(key: str, node: Node, extras: Extras) -> Placement:
    members = split_extras(node, tuple(_PLACEMENT), extras, "layout", key)
    if not {"x", "y"} <= members.keys():
        raise node.error(f"block '{key}' is placed without x or y", allowed="x and y in pixels")
    rotation = members["rotation"].number() if "rotation" in members else 0
    if rotation not in ROTATIONS:
        allowed = ", ".join(map(str, ROTATIONS))
        raise members["rotation"].error(f"block '{key}' is turned by {rotation:g} degrees", allowed=allowed)
    extents = {name: members[name].number() for name in ("width", "height") if name in members}
    return Placement(
        x=members["x"].number(),
        y=members["y"].number(),
        width=extents.get("width"),
        height=extents.get("height"),
        flipped="flipped" in members and members["flipped"].boolean(),
        rotation=int(rotation),
        name_side=_choice(members.get("name_side"), f"the name of block '{key}'", "auto", NAME_SIDES),
        colour=_choice(members.get("colour"), f"the colour of block '{key}'", "none", BLOCK_COLOURS),
    )


def _choice(node: Node | None, subject: str, default: str, choices: tuple[str, ...]) -> str:
    if node is None:
        return default
    if node.text() not in choices:
        raise node.error(f"{subject} is '{node.text()[:80]}'", allowed=", ".join(choices))
    return node.text()


def _members_or_empty(node: Node) -> Mapping[str, Node]:
    value: object = node.value
    return node.members() if isinstance(value, dict) else {}
