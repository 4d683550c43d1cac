"""Frame ports and frame lines in drawings: nets without direction, squares at the ports."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from armblocks.diagram import Diagram, PortRef, frames_of
from armblocks.drawing.block_boxes import Box, BoxPort
from armblocks.drawing.wires import Net, WireEnd
from armblocks.pictures.picture import Mark, Rectangle
from armblocks.pictures.style import Tone

FRAME_TONE = Tone.TRACE_2
"""The colour of frame lines and frame ports."""
_HALF_SIZE = 3.0
"""Half the side of the square at a frame port, px."""


def drawn_frames(diagram: Diagram, placed_boxes: Mapping[str, Box]) -> list[tuple[PortRef, ...]]:
    """The ports of each frame of a sheet that has a line; lines are drawn from the first port to the others.

    The first port is the leftmost one that leads to the right, as if the line were a signal.
    """
    frames: list[tuple[PortRef, ...]] = []
    for members in frames_of(diagram.frame_lines):
        ports = {ref: port for ref in members if (port := _frame_port(placed_boxes, ref)) is not None}
        if len(ports) > 1:
            order = {ref: (-port.dx, port.x, ref) for ref, port in ports.items()}
            frames.append(tuple(sorted(ports, key=order.__getitem__)))
    return frames


def frame_nets(
    frames: Iterable[tuple[PortRef, ...]], placed_boxes: Mapping[str, Box]
) -> list[tuple[tuple[PortRef, ...], Net]]:
    """The nets of frames: the ports of each, and the net from the first port to the others."""
    nets: list[tuple[tuple[PortRef, ...], Net]] = []
    for refs in frames:
        found = [_frame_port(placed_boxes, ref) for ref in refs]
        source, *others = [port for port in found if port is not None]
        ends = tuple(WireEnd(port.x, port.y, -port.dx, -port.dy) for port in others)
        net = Net(WireEnd(source.x, source.y, source.dx, source.dy), ends, ((),) * len(ends))
        nets.append((refs, net))
    return nets


def frame_port_marks(box: Box) -> list[Mark]:
    """Small squares at the frame ports."""
    side = 2.0 * _HALF_SIZE
    return [
        Rectangle(port.x - _HALF_SIZE, port.y - _HALF_SIZE, side, side, 1.0, Tone.SURFACE, FRAME_TONE, 1.2)
        for port in box.frames
    ]


def _frame_port(placed_boxes: Mapping[str, Box], ref: PortRef) -> BoxPort | None:
    """A frame port; ``None`` if it does not exist in an incomplete diagram."""
    box = placed_boxes.get(ref.block)
    return None if box is None else next((port for port in box.frames if port.name == ref.port), None)
