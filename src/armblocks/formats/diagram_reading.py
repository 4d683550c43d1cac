"""Builds diagrams from the objects of a document; see :mod:`armblocks.formats.diagram_json`."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import cast

from armblocks.diagram import (
    Block,
    BlockLibrary,
    Comment,
    Diagram,
    DiagramBuilder,
    Parameter,
    PortRef,
    check_block_count,
    formula,
)
from armblocks.diagram.parameter_sets import check_value_count, settable_parameter
from armblocks.equations import SimulationOptions
from armblocks.errors import ArmblocksError, UnknownNameError
from armblocks.formats.json_document import Node
from armblocks.formats.layout_json import (
    Layout,
    bookmark_from_json,
    connection_from_json,
    line_from_json,
    scope_trigger_from_json,
)
from armblocks.formats.located_errors import located
from armblocks.formats.mask_json import mask_parameter_from_json
from armblocks.formats.parameter_json import is_diagram, parameter_from_json, plain_value, with_infinities
from armblocks.formats.robot_references import RobotReader
from armblocks.formats.subsystem_libraries import Libraries
from armblocks.formats.unknown_members import Extras, split_extras

INNER_KEYS = (
    "name",
    "description",
    "mask",
    "blocks",
    "connections",
    "frame_lines",
    "logged",
    "signal_names",
    "parameter_sets",
    "layout",
    "bookmarks",
    "scope_trigger",
    "settings",
)
"""The keys of a diagram inside another diagram."""
_SETTINGS = {field.name: field.default for field in dataclasses.fields(SimulationOptions)}


class DiagramReader:
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
        members = split_extras(node, known, extras, "")
        settings = _settings(members["settings"], extras) if "settings" in members else SimulationOptions()
        block_nodes = members["blocks"].members() if "blocks" in members else {}
        with located(node):
            check_block_count(len(block_nodes), "")  # checked first, because reading many blocks takes long
        blocks = {key: self._block(key, entry, extras) for key, entry in block_nodes.items()}
        layout = Layout()
        for key, entry in (members["layout"].members() if "layout" in members else {}).items():
            layout.read(key, entry, set(blocks), extras)
        builder = DiagramBuilder(
            members["name"].text() if "name" in members else name,
            settings=settings,
            extras=extras,
            description=members["description"].text() if "description" in members else "",
        )
        values = members["parameters"].members() if "parameters" in members else {}
        self._declare(builder, members["mask"].elements() if "mask" in members else [], values)
        for key, block in blocks.items():
            with located(block_nodes[key]):
                builder.add(key, block)
                if "commented" in block_nodes[key].members():
                    builder.comment(key, _comment(block_nodes[key].members()["commented"]))
        for entry in members["connections"].elements() if "connections" in members else []:
            source, target = connection_from_json(entry)
            with located(entry):
                builder.connect(source, target)
        for entry in members["frame_lines"].elements() if "frame_lines" in members else []:
            first, second = line_from_json(entry)
            with located(entry):
                builder.draw_line(first, second)
        for entry in members["logged"].elements() if "logged" in members else []:
            with located(entry):
                builder.log(_port(entry, entry.text()))
        for key, entry in (members["signal_names"].members() if "signal_names" in members else {}).items():
            with located(entry):
                builder.name_signal(_port(entry, key), entry.text())
        for key, placement in layout.placements.items():
            builder.place(key, **dataclasses.asdict(placement))
        for wire, bends in layout.bends.items():
            builder.bend(wire, bends)
        for key, note in layout.notes.items():
            builder.note(key, note)
        for key, entry in (members["bookmarks"].members() if "bookmarks" in members else {}).items():
            with located(entry):
                builder.bookmark(key, bookmark_from_json(entry))
        if "scope_trigger" in members:
            with located(members["scope_trigger"]):
                builder.trigger_scopes(scope_trigger_from_json(members["scope_trigger"]))
        if "parameter_sets" in members:
            self._add_parameter_sets(builder, members["parameter_sets"])
        with located(node):
            return builder.draft() if self.draft else builder.build()

    def _add_parameter_sets(self, builder: DiagramBuilder, node: Node) -> None:
        """The parameter sets of a diagram. The sets of a draft may have parameters that do not exist."""
        diagram = builder.draft()
        for name, entry in node.members().items():
            with located(entry):
                check_value_count(len(entry.members()), "")
            values = {path: self._set_value(diagram, path, value) for path, value in entry.members().items()}
            with located(entry):
                builder.parameter_set(name, values)

    def _set_value(self, diagram: Diagram, path: str, node: Node) -> object:
        """The checked value of one entry of a parameter set; in a draft it may violate the rules."""
        if not self.draft:
            with located(node):
                rule, _ = settable_parameter(diagram, path)
            return parameter_from_json(rule, node, self.robots)
        value = plain_value(node)
        try:  # without the location of the entry, whose computation takes long for many entries
            rule, _ = settable_parameter(diagram, path)
            return rule.check(with_infinities(rule, value), "")
        except ArmblocksError:
            return value

    def _block(self, key: str, node: Node, extras: Extras) -> Block:
        if "type" not in node.members():
            raise node.error("the key 'type' is missing", allowed="a block type", fix='add "type": "Gain"')
        with located(node.members()["type"]):
            kind = self.library[node.members()["type"].text()]
        rules = {rule.name: rule for rule in kind.parameters()}
        inside = [name for name, rule in rules.items() if is_diagram(rule)]
        linked = ("library",) if inside else ()
        members = split_extras(
            node, ("type", "parameters", "formulas", "commented", *inside, *linked), extras, "blocks", key
        )
        values: dict[str, object] = {
            name: self.diagram(members[name], INNER_KEYS, key) for name in inside if name in members
        }
        if linked and "library" in members:
            if values:
                raise members["library"].error(
                    "the block has a diagram and a library", allowed="one of the two", fix="remove one"
                )
            values[inside[0]] = self.libraries.linked(members["library"])
        mask = {rule.name: rule for value in values.values() for rule in cast("Diagram", value).mask}
        all_rules = {**mask, **{name: rule for name, rule in rules.items() if name not in inside}}
        masked: dict[str, object] = {}
        for name, parameter_value in self._parameter_values(members, all_rules, kind).items():
            (masked if name in mask else values)[name] = parameter_value
        missing = [name for name, rule in rules.items() if rule.required and name not in values]
        if missing:
            raise node.error(
                f"a {kind.type_name()} needs the parameter '{missing[0]}'",
                allowed=rules[missing[0]].describe(),
                fix=f"add '{missing[0]}': {rules[missing[0]].doc}",
            )
        with located(node):
            return kind(**values).with_parameters(**masked)  # pyright: ignore[reportArgumentType]

    def _parameter_values(
        self, members: Mapping[str, Node], rules: Mapping[str, Parameter], kind: type[Block]
    ) -> dict[str, object]:
        """The values and formulas of a block's parameters."""
        values: dict[str, object] = {}
        for key in ("parameters", "formulas"):
            for name, member in (members[key].members() if key in members else {}).items():
                if name not in rules:
                    noun = f"parameter of {kind.type_name()}"
                    raise UnknownNameError(noun, name, rules, where=member.where)
                if name in values:
                    raise member.error(f"'{name}' has a value and a formula", allowed="one of the two")
                if key == "parameters":
                    values[name] = parameter_from_json(rules[name], member, self.robots)
                else:
                    with located(member):
                        values[name] = formula(member.text())
        return values

    def _default(self, rule: Parameter, node: Node) -> object:
        return parameter_from_json(rule, node, self.robots)

    def _declare(self, builder: DiagramBuilder, mask: Sequence[Node], values: Mapping[str, Node]) -> None:
        """The declared parameters of a diagram, and for the outermost diagram their values."""
        rules: list[Parameter] = []
        for node in mask:
            with located(node):
                rules.append(mask_parameter_from_json(node, self._default))
        for name, member in values.items():
            if name not in [rule.name for rule in rules]:
                parameter_names = [rule.name for rule in rules]
                raise UnknownNameError("mask parameter", name, parameter_names, where=member.where)
        for rule, node in zip(rules, mask):
            value = parameter_from_json(rule, values[rule.name], self.robots) if rule.name in values else None
            with located(node):
                builder.declare(rule, value)


def _settings(node: Node, extras: Extras) -> SimulationOptions:
    values: dict[str, object] = {}
    for name, member in split_extras(node, tuple(_SETTINGS), extras, "settings").items():
        default = _SETTINGS[name]
        if isinstance(default, str):
            values[name] = member.text()
        elif isinstance(default, bool):
            values[name] = member.boolean()
        else:
            values[name] = None if member.value is None and default is None else member.number()
    return dataclasses.replace(SimulationOptions(), **values)  # pyright: ignore[reportArgumentType]


def _comment(node: Node) -> Comment:
    match node.text():
        case "out" | "through" as comment:
            return comment
        case other:
            raise node.error(f"'{other[:80]}' is not a comment", allowed='"out" or "through"')


def _port(node: Node, text: str) -> PortRef:
    block, _, port = text.rpartition("/")
    if not block or not port:
        raise node.error(f"'{text[:80]}' is not an output", allowed='"block/output"')
    return PortRef(block, port)
