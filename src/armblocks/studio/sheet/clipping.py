"""Copy and paste: the clipboard contains the text of a diagram file.

A copy thus contains everything that a file contains: the diagrams of subsystems, links to libraries,
formulas, robots, user-drawn routes of wires, notes.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Mapping
from pathlib import Path

from armblocks import formats
from armblocks.blocks import BLOCKS
from armblocks.diagram import Block, Connection, Diagram, PortRef, lines_without
from armblocks.diagram.mask import formula_names
from armblocks.diagram.names import FreeNames, folded
from armblocks.drawing.block_boxes import box_at_placement
from armblocks.drawing.wires import moved_bends
from armblocks.errors import DiagramError
from armblocks.studio.sheet.nesting import check_free
from armblocks.studio.sheet.parameter_values import ResolveRobot
from armblocks.studio.sheet.placing import placed

ReadDiagram = Callable[[str, str], Diagram]
"""Reads a diagram, possibly incomplete, from the text of a diagram file and a name for messages."""


def reader(resolve_robot: ResolveRobot) -> ReadDiagram:
    """Return a reader for incomplete diagrams whose only external files are robots."""

    def read(text: str, where: str) -> Diagram:
        return formats.diagram_from_bytes(text.encode(), where, BLOCKS, resolve_robot, draft=True)

    return read


def clipped(
    diagram: Diagram,
    names: Collection[str],
    notes: Collection[str],
    resolve_robot: ResolveRobot,
    folder: Path | None = None,
) -> str:
    """Return some blocks of a sheet, the wires between them and some notes, as the text of a diagram file."""
    copied_blocks = {name: diagram.block(name) for name in names}
    part = Diagram(
        name=diagram.name,
        blocks=copied_blocks,
        connections=tuple(
            wire
            for wire in diagram.connections
            if wire.source.block in copied_blocks and wire.target.block in copied_blocks
        ),
        frame_lines=lines_without(diagram.frame_lines, lambda end: end.block not in copied_blocks),
        layout={name: place for name, place in diagram.layout.items() if name in copied_blocks},
        bends=diagram.bends,
        notes={name: note for name, note in diagram.notes.items() if name in notes},
        logged=tuple(ref for ref in diagram.logged if ref.block in copied_blocks),
        commented=diagram.commented,
        signal_names=diagram.signal_names,
        mask=diagram.mask,
        mask_values=diagram.mask_values,
    )
    return formats.diagram_to_bytes(part, resolve_robot, folder=folder, project=folder).decode()


def pasted(
    diagram: Diagram, copied: Diagram, names: Mapping[str, str], shift: tuple[float, float]
) -> Diagram:
    """Return the diagram with the copied blocks and notes, renamed according to ``names``.

    A formula remains if the sheet declares all its names; otherwise it is replaced by its value. Raises
    ``DiagramError`` if a name is in use.
    """
    where = f"diagram '{diagram.name}'"
    copied, (dx, dy) = placed(copied), shift
    used_names = {folded(name): name for name in diagram.blocks}
    for name in copied.blocks:
        check_free(names.get(name, name), used_names, where)
        used_names[folded(names.get(name, name))] = names.get(name, name)
    notes = {names.get(name, name): note for name, note in copied.notes.items()}
    if any(name in diagram.notes for name in notes):
        raise DiagramError(
            "a note with this name already exists",
            where=where,
            allowed="unique names",
            fix="give the pasted note another name",
        )

    def moved(ref: PortRef) -> PortRef:
        return PortRef(names.get(ref.block, ref.block), ref.port)

    wires = {wire: Connection(moved(wire.source), moved(wire.target)) for wire in copied.connections}
    layout = {
        names.get(name, name): dataclasses.replace(place, x=place.x + dx, y=place.y + dy)
        for name, place in copied.layout.items()
    }
    bends = {
        wires[wire]: moved_bends(values, leaves_horizontally(wire, copied), shift)
        for wire, values in copied.bends.items()
    }
    shifted = {name: dataclasses.replace(note, x=note.x + dx, y=note.y + dy) for name, note in notes.items()}
    blocks = {
        names.get(name, name): _with_known_names(block, diagram) for name, block in copied.blocks.items()
    }
    return dataclasses.replace(
        diagram,
        blocks={**diagram.blocks, **blocks},
        connections=(*diagram.connections, *wires.values()),
        frame_lines=(*diagram.frame_lines, *(line.renamed(names) for line in copied.frame_lines)),
        layout={**diagram.layout, **layout},
        bends={**diagram.bends, **bends},
        notes={**diagram.notes, **shifted},
        logged=(*diagram.logged, *(moved(ref) for ref in copied.logged)),
        signal_names={**diagram.signal_names, **_unused_names(diagram, copied, blocks, moved)},
        commented={
            **diagram.commented,
            **{names.get(name, name): comment for name, comment in copied.commented.items()},
        },
    )


def _unused_names(
    diagram: Diagram, copied: Diagram, blocks: Collection[str], moved: Callable[[PortRef], PortRef]
) -> dict[PortRef, str]:
    """The names of the copied signals, numbered where a block or another signal of the sheet has the name."""
    names = FreeNames((*diagram.blocks, *blocks, *diagram.signal_names.values()))
    return {moved(ref): names.take(name) for ref, name in copied.signal_names.items()}


def leaves_horizontally(wire: Connection, diagram: Diagram) -> bool:
    """Whether a wire leaves its block horizontally."""
    block, place = diagram.blocks[wire.source.block], diagram.layout[wire.source.block]
    ports = box_at_placement(wire.source.block, block, place).outputs
    return any(port.name == wire.source.port and port.dx != 0 for port in ports)


def _with_known_names(block: Block, diagram: Diagram) -> Block:
    """Replace the formulas of a block that contain undeclared names by their values."""
    parameter_names = set(diagram.mask_values)
    foreign = [name for name, text in block.formulas if not formula_names(text) <= parameter_names]
    return block.with_parameters(**{name: block.parameter_value(name) for name in foreign})
