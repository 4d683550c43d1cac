"""Writes diagrams as plain values; see :mod:`armblocks.formats.diagram_json`."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import cast

from armblocks.diagram import Block, Diagram, Parameter
from armblocks.equations import SimulationOptions
from armblocks.formats.layout_json import bookmarks_to_json, layout_to_json
from armblocks.formats.mask_json import mask_parameter_to_json
from armblocks.formats.parameter_json import is_diagram, parameter_to_json, plain_parameter
from armblocks.formats.robot_references import RobotWriter
from armblocks.formats.subsystem_libraries import shortest_link
from armblocks.formats.unknown_members import members_of

_SETTINGS = tuple(field.name for field in dataclasses.fields(SimulationOptions))


class DiagramWriter:
    """Writes the diagrams of one document as plain values."""

    def __init__(self, robots: RobotWriter, folder: Path | None) -> None:
        self.robots = robots
        self.folder = folder

    def diagram(self, diagram: Diagram) -> dict[str, object]:
        """A diagram with all diagrams inside it."""
        extras = cast("Mapping[str, Mapping[str, object]]", diagram.extras)
        block_extras, layout_extras = extras.get("blocks", {}), extras.get("layout", {})
        settings = {name: getattr(diagram.settings, name) for name in _SETTINGS}
        # Settings without a value, and record_jumps with its default True, are not written.
        settings = {
            name: value for name, value in settings.items() if value is not None and value is not True
        }
        return {
            **extras.get("", {}),
            "name": diagram.name,
            **({"description": diagram.description} if diagram.description else {}),
            **(
                {"mask": [mask_parameter_to_json(rule, self._value) for rule in diagram.mask]}
                if diagram.mask
                else {}
            ),
            "blocks": {
                key: {**members_of(block_extras.get(key)), **self._block(block), **_commented(key, diagram)}
                for key, block in diagram.blocks.items()
            },
            "connections": [str(connection) for connection in diagram.connections],
            **({"frame_lines": [str(line) for line in diagram.frame_lines]} if diagram.frame_lines else {}),
            **({"logged": [str(ref) for ref in diagram.logged]} if diagram.logged else {}),
            **(
                {"signal_names": {str(ref): name for ref, name in diagram.signal_names.items()}}
                if diagram.signal_names
                else {}
            ),
            **({"parameter_sets": _parameter_sets(diagram)} if diagram.parameter_sets else {}),
            **({"bookmarks": bookmarks_to_json(diagram)} if diagram.bookmarks else {}),
            **({"scope_trigger": dataclasses.asdict(diagram.scope_trigger)} if diagram.scope_trigger else {}),
            "layout": layout_to_json(diagram, layout_extras),
            "settings": {**extras.get("settings", {}), **settings},
        }

    def _block(self, block: Block) -> dict[str, object]:
        """A block. An inner diagram is a member beside ``parameters``, which saves a level of nesting."""
        formulas = dict(block.formulas)
        values = {rule: block.parameter_value(rule.name) for rule in block.own_parameters()}
        parameter_values = {
            rule.name: self._value(rule, value)
            for rule, value in values.items()
            if not is_diagram(rule) and rule.name not in formulas
        }
        inner: dict[str, object] = {}
        for rule, value in values.items():
            if is_diagram(rule):
                diagram = cast("Diagram", value)
                if diagram.link:
                    inner["library"] = shortest_link(diagram.link, self.folder)
                else:
                    inner[rule.name] = self.inner_diagram(diagram)
        formulas_member = {"formulas": formulas} if formulas else {}
        return {"type": block.type_name(), "parameters": parameter_values, **formulas_member, **inner}

    def values(self, diagram: Diagram) -> dict[str, object]:
        """The values of the mask parameters of the outermost diagram."""
        return {rule.name: self._value(rule, diagram.mask_values[rule.name]) for rule in diagram.mask}

    def inner_diagram(self, diagram: Diagram) -> dict[str, object]:
        """An inner diagram; empty members are omitted."""
        document = self.diagram(diagram)
        if diagram.settings == SimulationOptions() and "settings" not in diagram.extras:
            del document["settings"]
        if not document["layout"]:
            del document["layout"]
        return document

    def _value(self, rule: Parameter, value: object) -> object:
        return parameter_to_json(rule, value, self.robots)


def _parameter_sets(diagram: Diagram) -> dict[str, object]:
    return {
        name: {path: plain_parameter(value) for path, value in values.items()}
        for name, values in diagram.parameter_sets.items()
    }


def _commented(name: str, diagram: Diagram) -> dict[str, object]:
    return {"commented": diagram.commented[name]} if name in diagram.commented else {}
