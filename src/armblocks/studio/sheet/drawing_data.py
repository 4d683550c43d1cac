"""The drawing data of a diagram for the front end: boxes, ports, faces, wires; and their differences."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping, Sequence
from functools import lru_cache
from types import MappingProxyType
from typing import Any, Literal, cast

from armblocks.blocks import BLOCKS
from armblocks.diagram import Block, Connection, Diagram, DiagramBlock, Parameter, ParameterKind, Placement
from armblocks.diagram.signs import Outline
from armblocks.drawing.block_boxes import Box, box_at_placement
from armblocks.drawing.block_faces import face_size, frame_labels, port_labels
from armblocks.drawing.diagram_drawing import block_marks
from armblocks.drawing.diagram_layout import SumSides, drawn_blocks, sum_sides, sum_with_sides
from armblocks.errors import ArmblocksError
from armblocks.formats import load_robot
from armblocks.pictures.picture import Picture
from armblocks.pictures.svg import svg_marks
from armblocks.studio.protocol.messages.sheet_edits import Place, SheetNote, Wire
from armblocks.studio.protocol.messages.sheets import (
    BlockType,
    OuterComment,
    ParameterRule,
    Sheet,
    SheetBlock,
    SheetChange,
    SheetPort,
    WireLines,
)
from armblocks.studio.sheet.edits import DEFAULT_ROBOT
from armblocks.studio.sheet.frame_lines import shown_lines
from armblocks.studio.sheet.nesting import inside
from armblocks.studio.sheet.parameter_values import parameter_json


def sheet(diagram: Diagram, lines: Mapping[str, WireLines] = MappingProxyType({})) -> Sheet:
    """Return the drawing of a diagram whose blocks all have a position."""
    return Sheet(
        linked=[],
        link="",
        name=diagram.name,
        description=diagram.description,
        blocks={name: _sheet_block(name, block, diagram) for name, block in diagram.blocks.items()},
        wires=[*(_wire(wire, diagram) for wire in diagram.connections), *shown_lines(diagram)],
        lines=dict(lines),
        notes=_notes(diagram),
        logged=[str(ref) for ref in diagram.logged],
    )


def sheet_change(
    before: Diagram, after: Diagram, lines: Mapping[str, WireLines | None] = MappingProxyType({})
) -> SheetChange:
    """Return the difference between two sheets; blocks that are the same objects are skipped."""
    blocks: dict[str, SheetBlock | None] = {name: None for name in before.blocks if name not in after.blocks}
    drawn_before, drawn_after = drawn_blocks(before), drawn_blocks(after)
    sides_before, sides_after = sum_sides(before), sum_sides(after)
    for name, block in after.blocks.items():
        same = before.blocks.get(name) is block
        same = same and (drawn_before[name] is drawn_after[name] or drawn_before[name] == drawn_after[name])
        same = same and sides_before.get(name) == sides_after.get(name)
        same = same and before.commented.get(name) == after.commented.get(name)
        if not same or before.layout.get(name) != after.layout.get(name):
            blocks[name] = _sheet_block(name, block, after)
    old, new = (
        {(wire, diagram.bends.get(wire, ())) for wire in diagram.connections} for diagram in (before, after)
    )
    return SheetChange(
        blocks=blocks,
        wires_added=[*(_wire(wire, after) for wire, _ in sorted(new - old)), *_only(after, before)],
        wires_removed=[*(_wire(wire, before) for wire, _ in sorted(old - new)), *_only(before, after)],
        lines=dict(lines),
        notes=_notes(after) if after.notes != before.notes else None,
        description=after.description if after.description != before.description else None,
        logged=[str(ref) for ref in after.logged] if after.logged != before.logged else None,
    )


def _only(diagram: Diagram, other: Diagram) -> list[Wire]:
    """The shown frame lines of a diagram that another one does not show."""
    if not diagram.frame_lines:
        return []
    known = {(wire.source, wire.target) for wire in shown_lines(other)}
    return [wire for wire in shown_lines(diagram) if (wire.source, wire.target) not in known]


def outer_comment(diagram: Diagram, path: Sequence[str]) -> OuterComment | None:
    """Return the outermost commented subsystem on the path of a sheet."""
    for depth, name in enumerate(path):
        comment = inside(diagram, path[:depth]).commented.get(name)
        if comment == "out" or comment == "through":
            return OuterComment(path=list(path[: depth + 1]), comment=comment)
    return None


@lru_cache(maxsize=1)
def library() -> tuple[BlockType, ...]:
    """Return all block types, for the palette and the dialogs."""
    return tuple(_block_type(kind) for kind in BLOCKS.values())


def _plain(text: str) -> str:
    """Documentation without marks of code, and with points before the entries of lists."""
    return re.sub("^- ", "• ", text.replace("``", ""), flags=re.MULTILINE)


def _block_type(kind: type[Block]) -> BlockType:
    block = _default(kind)
    box = box_at_placement("", block, Placement(x=0.0, y=0.0))
    return BlockType(
        type=kind.type_name(),
        title=kind.title,
        family=BLOCKS.family_of(kind),
        summary=kind.summary(),
        documentation=_plain("\n\n".join(kind.documentation())),
        width=box.width,
        height=box.height,
        face=_face(box),
        inputs=[port.name for port in block.input_ports()],
        input_y=[port.y for port in box.inputs],
        outputs=[port.name for port in block.output_ports()],
        frames=[port.name for port in block.frame_ports()],
        parameters=[
            _rule(rule, block) for rule in kind.parameters() if rule.kind is not ParameterKind.DIAGRAM
        ],
    )


def _rule(rule: Parameter, block: Block) -> ParameterRule:
    return ParameterRule(
        name=rule.name,
        kind=rule.kind.value,
        doc=rule.doc,
        unit=rule.unit,
        default=parameter_json(block.parameter_value(rule.name)),
        tunable=rule.tunable,
        choices=list(rule.choices),
        allowed=rule.describe(),
    )


def _default(kind: type[Block]) -> Block:
    robots: dict[str, Any] = {
        rule.name: load_robot(DEFAULT_ROBOT)
        for rule in kind.parameters()
        if rule.required and rule.kind is ParameterKind.ROBOT
    }
    return kind(**robots)


def _sheet_block(name: str, block: Block, diagram: Diagram) -> SheetBlock:
    place = diagram.layout[name]
    shown_block = drawn_blocks(diagram)[name]
    at_origin = dataclasses.replace(place, x=0.0, y=0.0)
    comment = cast("Literal['out', 'through', '']", diagram.commented.get(name, ""))
    drawn_block = _drawn(shown_block, at_origin, sum_sides(diagram).get(name), comment)
    changes: dict[str, Any] = {"name": name, "place": Place(**dataclasses.asdict(place))}
    if shown_block is not block or _names_files(type(block)):
        changes["parameters"] = _parameters(block)  # equal tables may come from different files
    return drawn_block.model_copy(update=changes)


@lru_cache(maxsize=1024)
def _names_files(kind: type[Block]) -> bool:
    return any(rule.kind is ParameterKind.TABLE for rule in kind.parameters())


@lru_cache(maxsize=4096)
def _drawn(
    block: Block, place: Placement, sides: SumSides | None, comment: Literal["out", "through", ""]
) -> SheetBlock:
    """Draw a block at the origin; the result is cached, so that equal blocks are drawn once."""
    box = box_at_placement("", block, place)
    if sides is not None:
        box = sum_with_sides(box, sides)
    into, out = port_labels(block)
    return SheetBlock(
        name="",
        type=block.type_name(),
        title=block.title,
        place=Place(x=0.0, y=0.0),
        width=box.width,
        height=box.height,
        face=_face(box, comment),
        comment=comment,
        inputs=_sheet_ports(box, into, inputs=True),
        outputs=_sheet_ports(box, out, inputs=False),
        opens=isinstance(block, DiagramBlock),
        shown_name_side=cast("Any", box.shown_name_side),
        formulas=dict(block.formulas),
        mask=[_rule(rule, block) for rule in block.diagram.mask] if isinstance(block, DiagramBlock) else [],
        link=block.diagram.link if isinstance(block, DiagramBlock) else "",
        parameters=_parameters(block),
    )


def _parameters(block: Block) -> dict[str, Any]:
    return {
        rule.name: parameter_json(block.parameter_value(rule.name))
        for rule in block.parameters()
        if rule.kind is not ParameterKind.DIAGRAM
    }


def _face(box: Box, comment: str = "") -> str:
    try:
        marks = block_marks(box, comment=comment)
    except ArmblocksError:
        # An error in the drawing of a face (a robot without links) must not prevent the display of the sheet.
        marks = block_marks(dataclasses.replace(box, block=BLOCKS["Ground"]()))
    return svg_marks(Picture(width=box.width, height=box.height, title="", marks=marks))


def _sheet_ports(box: Box, labels: tuple[str, ...], *, inputs: bool) -> list[SheetPort]:
    ports = box.block.input_ports() if inputs else box.block.output_ports()
    drawn_ports = {port.name: port for port in (box.inputs if inputs else box.outputs)}
    shown_labels = labels if len(labels) == len(ports) else ("",) * len(ports)
    if face_size(box.block)[0] is Outline.CIRCLE:
        shown_labels = ("",) * len(ports)
    frames = [
        SheetPort(
            name=port.name,
            doc=port.doc,
            label=label if (port.side == "left") is inputs else "",
            unit="",
            x=place.x,
            y=place.y,
            dx=-place.dx if inputs else place.dx,
            dy=-place.dy if inputs else place.dy,
            frame=True,
        )
        for port, place, label in zip(box.block.frame_ports(), box.frames, frame_labels(box.block))
    ]
    signals = [
        SheetPort(
            name=port.name,
            doc=port.doc,
            label=label,
            unit=port.unit,
            x=drawn_ports[port.name].x,
            y=drawn_ports[port.name].y,
            dx=drawn_ports[port.name].dx,
            dy=drawn_ports[port.name].dy,
        )
        for port, label in zip(ports, shown_labels)
    ]
    return [*frames, *signals]


def _wire(wire: Connection, diagram: Diagram) -> Wire:
    bends = diagram.bends.get(wire, ())
    return Wire(source=str(wire.source), target=str(wire.target), bends=bends)


def _notes(diagram: Diagram) -> dict[str, SheetNote]:
    return {name: SheetNote(**dataclasses.asdict(note)) for name, note in diagram.notes.items()}
