"""Frame lines in the studio: shown and edited as wires between frame ports.

Each frame is shown as wires from its first port to each of its other ports. Such a wire need not be a line
of the diagram. The removal of a wire removes its second port from the frame.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from armblocks.diagram import Diagram, FrameLine, PortRef, lines_without
from armblocks.drawing.diagram_layout import boxes
from armblocks.drawing.frame_lines import drawn_frames
from armblocks.errors import DiagramError
from armblocks.studio.protocol.messages.sheet_edits import Wire


def shown_lines(diagram: Diagram) -> list[Wire]:
    """Return the wires that show the frame lines of a sheet whose blocks have positions."""
    if not diagram.frame_lines:
        return []
    return [
        Wire(source=str(first), target=str(other), bends=())
        for first, *others in drawn_frames(diagram, boxes(diagram))
        for other in others
    ]


def split_wires(wires: Sequence[Wire], diagram: Diagram) -> tuple[list[Wire], list[FrameLine]]:
    """Return the wires of signals, and the frame lines that the other wires represent.

    Raises ``DiagramError`` for a wire between a frame port and a port of signals.
    """
    signals: list[Wire] = []
    lines: list[FrameLine] = []
    for wire in wires:
        ends = [PortRef(*end.rpartition("/")[::2]) for end in (wire.source, wire.target)]
        frames = [end for end in ends if _is_frame(end, diagram)]
        if len(frames) == 2:
            lines.append(FrameLine(*ends))
            continue
        if frames:
            raise DiagramError(
                f"the frame port '{frames[0]}' cannot be connected with an input or output of signals",
                where=f"diagram '{diagram.name}'",
                allowed="lines between two frame ports, and wires from an output to an input",
                fix="choose a frame port at both ends; parameters of joints and sensors add inputs "
                "and outputs of signals",
            )
        signals.append(wire)
    return signals, lines


def with_lines(diagram: Diagram, lines: Sequence[FrameLine]) -> Diagram:
    """Return the diagram with further frame lines."""
    if not lines:
        return diagram
    return dataclasses.replace(diagram, frame_lines=(*diagram.frame_lines, *lines))


def without_lines(diagram: Diagram, lines: Sequence[FrameLine]) -> Diagram:
    """Return the diagram without shown lines.

    Of the two ports of a line, the one that is not the first port of the frame is removed from the frame. The
    other ports remain one frame.
    """
    for line in lines:
        first = next((refs[0] for refs in drawn_frames(diagram, boxes(diagram)) if line.first in refs), None)
        removed = line.second if line.first == first else line.first
        kept = lines_without(diagram.frame_lines, lambda end, removed=removed: end == removed)
        diagram = dataclasses.replace(diagram, frame_lines=kept)
    return diagram


def _is_frame(ref: PortRef, diagram: Diagram) -> bool:
    block = diagram.blocks.get(ref.block)
    return block is not None and any(port.name == ref.port for port in block.frame_ports())
