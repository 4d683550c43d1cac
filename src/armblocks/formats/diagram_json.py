"""Diagrams as canonical JSON: small differences in a diagram are small differences in its file.

Blocks are keyed by name and sorted, connections are sorted texts (``"jtraj/q -> fkine/q"``), the layout is
separate from the content, and no derived values, ids or times are written. A changed parameter is one line, a
moved block is one line of the layout, and additions of different blocks do not conflict in version control.
The layout also has user-drawn routes, under the text of the connection, and notes, under names that begin
with ``/``, which block names cannot::

    {
      "blocks": {"sine": {"parameters": {"frequency": 2, …}, "type": "SineWave"}, …},
      "connections": ["sine/y -> scope/u1"],
      "format": 1,
      "layout": {"/1": {"text": "…", "x": 40, "y": 0}, "sine": {"x": 40, "y": 40},
                 "sine/y -> scope/u1": {"bends": [120]}, …},
      "name": "model",
      "settings": {"stop_time": 10, …}
    }

A diagram may declare parameters, its ``mask``; a block's ``formulas`` of them are beside its parameters, and
their values are not written. The values of mask parameters are among the parameters of the subsystem block,
for the outermost diagram under ``parameters`` of the document.

A block that is linked to an entry of a library has ``library`` instead of ``diagram``: see
:mod:`armblocks.formats.subsystem_libraries`.

A subsystem block has its inner diagram under ``diagram``, with the same keys, except ``format`` and
``robots``, which occur once, and without empty settings and layout.

Unknown keys (of another program, or a newer armblocks) are stored in ``Diagram.extras`` and written again. A
key similar to a known one, and an unknown parameter, are errors. Infinite parameters are the texts ``"inf"``
and ``"-inf"``; NaN is an error. References to robots: see :mod:`armblocks.formats.robot_references`. The JSON
Schema is ``formats/schema/diagram.schema.json``.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import cast

from armblocks.diagram import (
    ROTATIONS,
    Block,
    BlockLibrary,
    Connection,
    Diagram,
    DiagramBuilder,
    Note,
    Parameter,
    ParameterKind,
    Placement,
    PortRef,
    TimeTable,
    UserFunction,
    check_block_count,
    formula,
)
from armblocks.equations import SimulationOptions
from armblocks.errors import AlgebraicLoopError, ArmblocksError, DiagramError, FormatError, UnknownNameError
from armblocks.formats.canonical_json import canonical_bytes
from armblocks.formats.json_document import (
    KeyPath,
    Node,
    read_document,
    split_members,
)
from armblocks.formats.mask_json import mask_parameter_from, mask_parameter_to
from armblocks.formats.robot_references import ResolveRobot, RobotReader, RobotWriter
from armblocks.formats.subsystem_libraries import (
    Libraries,
    ReadEntry,
    ReadFile,
    read_library_file,
    shortest_link,
)
from armblocks.robot import Robot

FORMAT_VERSION = 1
MOST_BYTES = 16 * 2**20
DEEPEST = 320
"""Maximum nesting of objects and arrays: a hundred subsystems, and the content of the innermost."""

_INNER_KEYS = ("name", "description", "mask", "blocks", "connections", "logged", "layout", "settings")
_DOCUMENT_KEYS = ("format", *_INNER_KEYS, "parameters", "robots")
_LIBRARY_KEYS = ("format", "library", "robots")
_SETTINGS = {field.name: field.default for field in dataclasses.fields(SimulationOptions)}
_PLACEMENT = {field.name: field.default for field in dataclasses.fields(Placement)}
_WIRE = re.compile(r"([^/]+)/([^/]+?) -> ([^/]+)/([^/]+)")
_INFINITIES = {"inf": math.inf, "-inf": -math.inf}
_NUMERIC = (ParameterKind.NUMBER, ParameterKind.ARRAY)

Extras = dict[str, dict[str, object]]
"""Unknown members by location: ``""``, ``"blocks"``, ``"layout"``, ``"settings"``."""


def diagram_from_bytes(
    data: bytes,
    name: str,
    library: BlockLibrary,
    resolve_robot: ResolveRobot,
    *,
    folder: Path | None = None,
    trust: bool = False,
    draft: bool = False,
    read_library: ReadFile = read_library_file,
) -> Diagram:
    """The checked diagram of a document; ``library`` holds the block types that it may use.

    ``name`` is the name of the file in messages. The path of a robot is relative to ``folder``, and
    ``resolve_robot`` returns the robot of a shipped name or a path. The diagram's Python functions are
    loaded, which runs their files, only with ``trust``. With ``draft`` the diagram need not be able to run:
    inputs may be unconnected and shapes may not fit. ``read_library`` opens the libraries that blocks are
    linked to.

    Raises ``FormatError`` for violations of the format, ``UnknownNameError`` for unknown types, parameters,
    blocks, ports and robots, and ``DiagramError`` for a diagram that cannot be built. All name the file, and
    the line if known.
    """
    root = read_document(data, name, MOST_BYTES, DEEPEST)
    members, _ = split_members(root, _DOCUMENT_KEYS)
    _check_version(root, members)
    robots = RobotReader(members.get("robots"), folder, resolve_robot, trust=trust)
    libraries = Libraries(folder, _entry_reader(library, resolve_robot, trust=trust), read_library)
    reader = _Reader(library, robots, libraries, draft=draft)
    return reader.diagram(root, _DOCUMENT_KEYS, Path(name).stem)


def diagram_to_bytes(diagram: Diagram, resolve_robot: ResolveRobot, *, folder: Path | None = None) -> bytes:
    """The canonical document of a diagram. Reading it gives an equal diagram.

    A robot is written as the shortest reference that gives an equal robot; paths are relative to ``folder``.
    Raises ``FormatError`` if JSON cannot represent a value.
    """
    writer = _Writer(RobotWriter(folder, resolve_robot), folder)
    document = {"format": FORMAT_VERSION, **writer.diagram(diagram)}
    if diagram.mask:
        document["parameters"] = writer.values(diagram)
    if writer.robots.table:
        document["robots"] = writer.robots.table
    return canonical_bytes(document, one_line=_is_placement, deepest=DEEPEST)


def read_library(
    path: Path,
    library: BlockLibrary,
    resolve_robot: ResolveRobot,
    *,
    trust: bool = False,
) -> Mapping[str, Diagram]:
    """All diagrams of a library file, each linked to it. Raises the errors of :func:`diagram_from_bytes`."""
    return Libraries(None, _entry_reader(library, resolve_robot, trust=trust)).entries(path)


def library_to_bytes(
    entries: Mapping[str, Diagram], resolve_robot: ResolveRobot, *, folder: Path | None = None
) -> bytes:
    """The canonical document of a library of diagrams by name."""
    writer = _Writer(RobotWriter(folder, resolve_robot), folder)
    document: dict[str, object] = {
        "format": FORMAT_VERSION,
        "library": {name: writer.inside(diagram) for name, diagram in entries.items()},
    }
    if writer.robots.table:
        document["robots"] = writer.robots.table
    return canonical_bytes(document, one_line=_is_placement, deepest=DEEPEST)


class _Writer:
    """Writes the diagrams of one document as plain values."""

    def __init__(self, robots: RobotWriter, folder: Path | None) -> None:
        self.robots = robots
        self.folder = folder

    def diagram(self, diagram: Diagram) -> dict[str, object]:
        """A diagram with all diagrams inside it."""
        extras = cast("Mapping[str, Mapping[str, object]]", diagram.extras)
        block_extras, layout_extras = extras.get("blocks", {}), extras.get("layout", {})
        layout = dict(layout_extras)
        for key, place in diagram.layout.items():
            stated = {
                name: value
                for name, default in _PLACEMENT.items()
                if (value := getattr(place, name)) != default
            }
            layout[key] = {**_members(layout_extras.get(key)), **stated}
        for wire, bends in diagram.bends.items():
            layout[str(wire)] = {**_members(layout_extras.get(str(wire))), "bends": list(bends)}
        for key, note in diagram.notes.items():
            layout[key] = {**_members(layout_extras.get(key)), **dataclasses.asdict(note)}
        settings = {
            name: value for name in _SETTINGS if (value := getattr(diagram.settings, name)) is not None
        }
        return {
            **extras.get("", {}),
            "name": diagram.name,
            **({"description": diagram.description} if diagram.description else {}),
            **(
                {"mask": [mask_parameter_to(rule, self._value) for rule in diagram.mask]}
                if diagram.mask
                else {}
            ),
            "blocks": {
                key: {**_members(block_extras.get(key)), **self._block(block)}
                for key, block in diagram.blocks.items()
            },
            "connections": [str(wire) for wire in diagram.connections],
            **({"logged": [str(ref) for ref in diagram.logged]} if diagram.logged else {}),
            "layout": layout,
            "settings": {**extras.get("settings", {}), **settings},
        }

    def _block(self, block: Block) -> dict[str, object]:
        """A block; an inner diagram is beside the parameters, which limits the nesting depth."""
        formulas = dict(block.formulas)
        values = {rule: block.parameter_value(rule.name) for rule in block.own_parameters()}
        plain = {
            rule.name: self._value(rule, value)
            for rule, value in values.items()
            if not _is_diagram(rule) and rule.name not in formulas
        }
        inside: dict[str, object] = {}
        for rule, value in values.items():
            if _is_diagram(rule):
                diagram = cast("Diagram", value)
                if diagram.link:
                    inside["library"] = shortest_link(diagram.link, self.folder)
                else:
                    inside[rule.name] = self.inside(diagram)
        stated = {"formulas": formulas} if formulas else {}
        return {"type": block.type_name(), "parameters": plain, **stated, **inside}

    def values(self, diagram: Diagram) -> dict[str, object]:
        """The values of the mask parameters of the outermost diagram."""
        return {rule.name: self._value(rule, diagram.mask_values[rule.name]) for rule in diagram.mask}

    def inside(self, diagram: Diagram) -> dict[str, object]:
        """An inner diagram; empty members are omitted."""
        document = self.diagram(diagram)
        if diagram.settings == SimulationOptions() and "settings" not in diagram.extras:
            del document["settings"]
        if not document["layout"]:
            del document["layout"]
        return document

    def _value(self, rule: Parameter, value: object) -> object:
        if isinstance(value, Robot):
            return self.robots.reference(value)
        if isinstance(value, UserFunction):
            return "" if value == rule.check(rule.default, "") else self.robots.function_reference(value)
        if isinstance(value, TimeTable):
            return self.robots.table_reference(value)
        return _with_texts_for_infinities(value) if rule.kind in _NUMERIC else value


def _is_diagram(rule: Parameter) -> bool:
    return rule.kind is ParameterKind.DIAGRAM


def _is_placement(path: KeyPath) -> bool:
    if len(path) > 2 and path[0] == "library":
        path = path[2:]
    while len(path) > 3 and path[0] == "blocks" and path[2] == "diagram":
        path = path[3:]
    return len(path) == 2 and path[0] == "layout"


def _members(extra: object) -> Mapping[str, object]:
    return cast("Mapping[str, object]", extra or {})


def _with_texts_for_infinities(value: object) -> object:
    if isinstance(value, tuple):
        return [_with_texts_for_infinities(entry) for entry in cast("tuple[object, ...]", value)]
    if isinstance(value, float) and math.isinf(value):
        return "inf" if value > 0 else "-inf"
    return value


# -- reading -----------------------------------------------------------------------------------------------


@contextmanager
def _located(node: Node) -> Generator[None]:
    """Add the file and line of a node to errors that are raised inside the ``with`` block."""
    try:
        yield
    except AlgebraicLoopError as error:
        raise AlgebraicLoopError(
            error.loop, where=_joined(node, error), why=error.why, allowed=error.allowed, fix=error.fix
        ) from error
    except UnknownNameError as error:
        raise UnknownNameError(error.kind, error.name, error.known, where=_joined(node, error)) from error
    except DiagramError as error:
        raise DiagramError(
            error.what, where=_joined(node, error), allowed=error.allowed, fix=error.fix
        ) from error
    except ArmblocksError as error:
        raise FormatError(
            error.what, where=_joined(node, error), allowed=error.allowed, fix=error.fix
        ) from error


def _joined(node: Node, error: ArmblocksError) -> str:
    if error.where.startswith(node.where):  # an inner node has added its position
        return error.where
    return f"{node.where}: {error.where}" if error.where else node.where


class _Reader:
    """Builds the diagrams of one document."""

    def __init__(
        self, library: BlockLibrary, robots: RobotReader, libraries: Libraries, *, draft: bool
    ) -> None:
        self.library = library
        self.robots = robots
        self.libraries = libraries
        self.draft = draft

    def diagram(self, node: Node, known: tuple[str, ...], name: str) -> Diagram:
        """The diagram of an object, checked unless it is a draft; ``name`` is used if the object has none."""
        extras: Extras = {}
        members = _split(node, known, extras, "")
        settings = _settings(members["settings"], extras) if "settings" in members else SimulationOptions()
        block_nodes = members["blocks"].members() if "blocks" in members else {}
        with _located(node):
            check_block_count(len(block_nodes), "")  # checked first, because reading many blocks takes long
        blocks = {key: self._block(key, entry, extras) for key, entry in block_nodes.items()}
        layout = _Layout()
        for key, entry in (members["layout"].members() if "layout" in members else {}).items():
            layout.read(key, entry, set(blocks), extras)
        builder = DiagramBuilder(
            members["name"].text() if "name" in members else name,
            settings=settings,
            extras=extras,
            description=members["description"].text() if "description" in members else "",
        )
        given = members["parameters"].members() if "parameters" in members else {}
        self._declare(builder, members["mask"].elements() if "mask" in members else [], given)
        for key, block in blocks.items():
            with _located(block_nodes[key]):
                builder.add(key, block)
        for entry in members["connections"].elements() if "connections" in members else []:
            source, target = _wire(entry)
            with _located(entry):
                builder.connect(source, target)
        for entry in members["logged"].elements() if "logged" in members else []:
            with _located(entry):
                builder.log(_port(entry))
        for key, place in layout.places.items():
            builder.place(key, **dataclasses.asdict(place))
        for wire, bends in layout.bends.items():
            builder.bend(wire, bends)
        for key, note in layout.notes.items():
            builder.note(key, note)
        with _located(node):
            return builder.draft() if self.draft else builder.build()

    def _block(self, key: str, node: Node, extras: Extras) -> Block:
        if "type" not in node.members():
            raise node.error("the key 'type' is missing", allowed="a block type", fix='add "type": "Gain"')
        with _located(node.members()["type"]):
            kind = self.library[node.members()["type"].text()]
        rules = {rule.name: rule for rule in kind.parameters()}
        inside = [name for name, rule in rules.items() if _is_diagram(rule)]
        linked = ("library",) if inside else ()
        members = _split(node, ("type", "parameters", "formulas", *inside, *linked), extras, "blocks", key)
        values: dict[str, object] = {
            name: self.diagram(members[name], _INNER_KEYS, key) for name in inside if name in members
        }
        if linked and "library" in members:
            if values:
                raise members["library"].error(
                    "the block has a diagram and a library", allowed="one of the two", fix="remove one"
                )
            values[inside[0]] = self.libraries.linked(members["library"])
        mask = {rule.name: rule for value in values.values() for rule in cast("Diagram", value).mask}
        known = {**mask, **{name: rule for name, rule in rules.items() if name not in inside}}
        masked: dict[str, object] = {}
        for name, given in self._given(members, known, kind).items():
            (masked if name in mask else values)[name] = given
        missing = [name for name, rule in rules.items() if rule.required and name not in values]
        if missing:
            raise node.error(
                f"a {kind.type_name()} needs the parameter '{missing[0]}'",
                allowed=rules[missing[0]].describe(),
                fix=f"add '{missing[0]}': {rules[missing[0]].doc}",
            )
        with _located(node):
            return kind(**values).with_parameters(**masked)  # pyright: ignore[reportArgumentType]

    def _given(
        self, members: Mapping[str, Node], rules: Mapping[str, Parameter], kind: type[Block]
    ) -> dict[str, object]:
        """The values and formulas of a block's parameters."""
        found: dict[str, object] = {}
        for key in ("parameters", "formulas"):
            for name, member in (members[key].members() if key in members else {}).items():
                if name not in rules:
                    what = f"parameter of {kind.type_name()}"
                    raise UnknownNameError(what, name, rules, where=member.where)
                if name in found:
                    raise member.error(f"'{name}' has a value and a formula", allowed="one of the two")
                if key == "parameters":
                    found[name] = _parameter(rules[name], member, self.robots)
                else:
                    with _located(member):
                        found[name] = formula(member.text())
        return found

    def _default(self, rule: Parameter, node: Node) -> object:
        return _parameter(rule, node, self.robots)

    def _declare(self, builder: DiagramBuilder, mask: Sequence[Node], given: Mapping[str, Node]) -> None:
        """The declared parameters of a diagram, and for the outermost diagram their values."""
        rules: list[Parameter] = []
        for node in mask:
            with _located(node):
                rules.append(mask_parameter_from(node, self._default))
        for name, member in given.items():
            if name not in [rule.name for rule in rules]:
                known = [rule.name for rule in rules]
                raise UnknownNameError("mask parameter", name, known, where=member.where)
        for rule, node in zip(rules, mask):
            value = _parameter(rule, given[rule.name], self.robots) if rule.name in given else None
            with _located(node):
                builder.declare(rule, value)


def _entry_reader(library: BlockLibrary, resolve_robot: ResolveRobot, *, trust: bool) -> ReadEntry:
    """Builds the diagrams of library entries, as for any document."""

    def read(root: Node, entry: Node, name: str, folder: Path, libraries: Libraries) -> Diagram:
        members, _ = split_members(root, _LIBRARY_KEYS)
        _check_version(root, members)
        robots = RobotReader(members.get("robots"), folder, resolve_robot, trust=trust)
        return _Reader(library, robots, libraries, draft=False).diagram(entry, _INNER_KEYS, name)

    return read


def _split(node: Node, known: tuple[str, ...], extras: Extras, place: str, key: str = "") -> dict[str, Node]:
    """The known members; the others are stored in ``extras[place]``, under ``key`` if it is given."""
    members, unknown = split_members(node, known)
    if unknown:
        extras.setdefault(place, {}).update({key: unknown} if key else unknown)
    return members


def _check_version(root: Node, members: Mapping[str, Node]) -> None:
    if "format" not in members:
        fix = f'add "format": {FORMAT_VERSION}'
        raise root.error(
            "the key 'format' is missing", allowed=f"the format version {FORMAT_VERSION}", fix=fix
        )
    version = members["format"].value
    if version != FORMAT_VERSION or isinstance(version, bool):
        raise members["format"].error(
            f"the format version is {version!r}",
            allowed=str(FORMAT_VERSION),
            fix="update armblocks, if the file is newer than it",
        )


def _settings(node: Node, extras: Extras) -> SimulationOptions:
    values: dict[str, object] = {}
    for name, member in _split(node, tuple(_SETTINGS), extras, "settings").items():
        default = _SETTINGS[name]
        if isinstance(default, str):
            values[name] = member.text()
        else:
            values[name] = None if member.value is None and default is None else member.number()
    return dataclasses.replace(SimulationOptions(), **values)  # pyright: ignore[reportArgumentType]


def _parameter(rule: Parameter, node: Node, robots: RobotReader) -> object:
    """The checked value of one parameter; errors have its line."""
    if rule.kind is ParameterKind.ROBOT:
        return robots.robot(node)
    if rule.kind is ParameterKind.FUNCTION:
        return robots.function(node) if node.value else rule.default
    if rule.kind is ParameterKind.TABLE and isinstance(node.value, str):
        return robots.table(node)
    value = _with_infinities(node.value) if rule.kind in _NUMERIC else node.value
    with _located(node):
        return rule.check(value, "")


def _with_infinities(value: object) -> object:
    if isinstance(value, list):
        return [_with_infinities(entry) for entry in cast("list[object]", value)]
    return _INFINITIES.get(value, value) if isinstance(value, str) else value


def _wire(node: Node) -> tuple[PortRef, PortRef]:
    found = _WIRE.fullmatch(node.text())
    if found is None:
        raise node.error(f"'{node.text()[:80]}' is not a connection", allowed='"block/output -> block/input"')
    return PortRef(found[1], found[2]), PortRef(found[3], found[4])


def _port(node: Node) -> PortRef:
    block, _, port = node.text().rpartition("/")
    if not block or not port:
        raise node.error(f"'{node.text()[:80]}' is not an output", allowed='"block/output"')
    return PortRef(block, port)


def _members_if_any(node: Node) -> Mapping[str, Node]:
    value: object = node.value
    return node.members() if isinstance(value, dict) else {}


class _Layout:
    """The layout of an object: positions of blocks, routes of wires, and notes."""

    def __init__(self) -> None:
        self.places: dict[str, Placement] = {}
        self.bends: dict[Connection, list[float]] = {}
        self.notes: dict[str, Note] = {}

    def read(self, key: str, node: Node, blocks: set[str], extras: Extras) -> None:
        """Add one entry. An entry that is not a block, wire or note belongs to another program and is
        preserved."""
        stated = _members_if_any(node)
        if key in blocks:
            self.places[key] = _placement(key, node, extras)
        elif "bends" in stated and (found := _WIRE.fullmatch(key)):
            members = _split(node, ("bends",), extras, "layout", key)
            wire = Connection(PortRef(found[1], found[2]), PortRef(found[3], found[4]))
            self.bends[wire] = [entry.number() for entry in members["bends"].elements()]
        elif key.startswith("/") and {"x", "y", "text"} <= stated.keys():
            members = _split(node, ("x", "y", "text"), extras, "layout", key)
            x, y = members["x"].number(), members["y"].number()
            self.notes[key] = Note(x=x, y=y, text=members["text"].text())
        else:
            extras.setdefault("layout", {})[key] = node.value


def _placement(key: str, node: Node, extras: Extras) -> Placement:
    members = _split(node, tuple(_PLACEMENT), extras, "layout", key)
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
    )
