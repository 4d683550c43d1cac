"""Writes diagrams as plain values; see :mod:`armblocks.formats.diagram_json`."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import cast

from armblocks.diagram import Block, Diagram, Parameter
from armblocks.equations import SimulationOptions
from armblocks.formats.layout_json import layout_to
from armblocks.formats.mask_json import mask_parameter_to
from armblocks.formats.parameter_json import is_diagram, parameter_to, plain_parameter
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
        # Open choices, and the recording of jumps as usual, are not written.
        settings = {
            name: value for name, value in settings.items() if value is not None and value is not True
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
                key: {**members_of(block_extras.get(key)), **self._block(block), **_commented(key, diagram)}
                for key, block in diagram.blocks.items()
            },
            "connections": [str(wire) for wire in diagram.connections],
            **({"logged": [str(ref) for ref in diagram.logged]} if diagram.logged else {}),
            **(
                {"signal_names": {str(ref): name for ref, name in diagram.signal_names.items()}}
                if diagram.signal_names
                else {}
            ),
            **({"parameter_sets": _parameter_sets(diagram)} if diagram.parameter_sets else {}),
            "layout": layout_to(diagram, layout_extras),
            "settings": {**extras.get("settings", {}), **settings},
        }

    def _block(self, block: Block) -> dict[str, object]:
        """A block; an inner diagram is beside the parameters, which limits the nesting depth."""
        formulas = dict(block.formulas)
        values = {rule: block.parameter_value(rule.name) for rule in block.own_parameters()}
        plain = {
            rule.name: self._value(rule, value)
            for rule, value in values.items()
            if not is_diagram(rule) and rule.name not in formulas
        }
        inside: dict[str, object] = {}
        for rule, value in values.items():
            if is_diagram(rule):
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
        return parameter_to(rule, value, self.robots)


def _parameter_sets(diagram: Diagram) -> dict[str, object]:
    return {
        name: {path: plain_parameter(value) for path, value in values.items()}
        for name, values in diagram.parameter_sets.items()
    }


def _commented(name: str, diagram: Diagram) -> dict[str, object]:
    return {"commented": diagram.commented[name]} if name in diagram.commented else {}
