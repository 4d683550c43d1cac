"""Ground blocks at unconnected inputs and Terminator blocks at unconnected outputs."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterator, Mapping, Sequence

from armblocks.blocks import Ground, Terminator
from armblocks.diagram import (
    Block,
    BusAssignment,
    BusSelector,
    Connection,
    Diagram,
    Merge,
    Placement,
    PortRef,
    open_inputs,
)
from armblocks.diagram.names import FreeNames
from armblocks.drawing.block_boxes import NAME_HEIGHT, Box, BoxPort
from armblocks.drawing.diagram_drawing import obstacle
from armblocks.drawing.diagram_layout import boxes
from armblocks.drawing.wires import Area
from armblocks.errors import DiagramError

_WIDTH, _HEIGHT = 30.0, 20.0
"""Size of a new block, px."""
_MIN_DISTANCE = 50.0
"""Minimum distance between a port and the new block, px."""
_SHIFTS = sorted(
    ((distance, across) for distance in range(40) for across in range(-15, 16)),
    key=lambda step: (step[0] + 1.5 * abs(step[1]), step),
)
"""Shifts away from the port and across its direction, nearest first, in units of ``_STEP``."""
_STEP = 20.0
"""Grid spacing of the search for a free position, px."""
_GAP = 6.0
"""Minimum distance to other blocks, px."""


def grounded(diagram: Diagram, names: Collection[str]) -> Diagram:
    """Return the diagram with a Ground or Terminator at every unconnected port of the named blocks.

    A Ground has the shape that its input declares. Inputs that take a bus, and inputs of Merge blocks, remain
    unconnected, as do the ports of commented blocks. Raises ``DiagramError`` if nothing can be added.
    """
    placed = boxes(diagram)
    new = _NewBlocks(diagram, placed)
    commented = diagram.commented
    for ref in sorted(open_inputs({"": diagram})):
        if ref.block in names and _can_be_grounded(diagram.blocks[ref.block], ref.port):
            new.add(ref, placed[ref.block].inputs, _ground(diagram.blocks[ref.block], ref.port))
    driving = {wire.source for wire in diagram.connections}
    for ref in sorted(_outputs(diagram)):
        if ref.block in names and ref.block not in commented and ref not in driving:
            new.add(ref, placed[ref.block].outputs, Terminator())
    if not new.blocks:
        raise DiagramError(
            "no unconnected port can be grounded or terminated",
            where=f"diagram '{diagram.name}'",
            allowed="unconnected ports, except bus inputs and inputs of Merge blocks",
            fix="connect a bus or a conditional subsystem to these",
        )
    return dataclasses.replace(
        diagram,
        blocks={**diagram.blocks, **new.blocks},
        layout={**diagram.layout, **new.layout},
        connections=(*diagram.connections, *new.connections),
    )


def _outputs(diagram: Diagram) -> Iterator[PortRef]:
    for name, block in diagram.blocks.items():
        yield from (PortRef(name, port.name) for port in block.output_ports())


def _can_be_grounded(block: Block, port: str) -> bool:
    return not isinstance(block, Merge) and not (
        isinstance(block, BusSelector | BusAssignment) and port == "bus"
    )


def _ground(block: Block, name: str) -> Block:
    """A Ground with the shape that an input declares; without one, a scalar."""
    shape = next(port.shape for port in block.input_ports() if port.name == name)
    return Ground(dimensions=tuple(float(size) for size in shape)) if shape else Ground()


class _NewBlocks:
    """The new blocks with their positions and connections."""

    def __init__(self, diagram: Diagram, placed: Mapping[str, Box]) -> None:
        self.blocks: dict[str, Block] = {}
        self.layout: dict[str, Placement] = {}
        self.connections: list[Connection] = []
        self._names = FreeNames((*diagram.blocks, *diagram.signal_names.values()))
        self._used_areas: list[Area] = [area for box in placed.values() for area in obstacle(box).areas]

    def add(self, ref: PortRef, ports: Sequence[BoxPort], block: Block) -> None:
        """Add a block that drives an input, or is driven by an output."""
        port = next(port for port in ports if port.name == ref.port)
        drives = isinstance(block, Ground)
        name = self._names.take(block.title)
        self.blocks[name] = block
        self.layout[name] = self._place(port, -1 if drives else 1)
        new_port = PortRef(name, "y" if drives else "u")
        self.connections.append(Connection(new_port, ref) if drives else Connection(ref, new_port))

    def _place(self, port: BoxPort, side: int) -> Placement:
        """The nearest free position in the direction of a port; ``side`` is 1 behind an output."""
        is_horizontal = port.dy == 0
        width, height = (_WIDTH, _HEIGHT) if is_horizontal else (_HEIGHT, _WIDTH)
        dx, dy = side * port.dx, side * port.dy

        def corner(step: tuple[int, int]) -> tuple[float, float]:
            distance, across = _MIN_DISTANCE + _STEP * step[0], _STEP * step[1]
            return (
                round(port.x + dx * (distance + width / 2) + dy * across - width / 2),
                round(port.y + dy * (distance + height / 2) + dx * across - height / 2),
            )

        free = (step for step in _SHIFTS if self._is_free(_new_area(corner(step), width, height)))
        x, y = corner(next(free, _SHIFTS[0]))
        self._used_areas.append(_new_area((x, y), width, height))
        return Placement(
            x=x,
            y=y,
            width=width,
            height=height,
            flipped=is_horizontal and port.dx < 0,
            rotation=0 if is_horizontal else 90 if port.dy > 0 else 270,
        )

    def _is_free(self, area: Area) -> bool:
        left, top, right, bottom = area
        return not any(
            left < other_right and other_left < right and top < other_bottom and other_top < bottom
            for other_left, other_top, other_right, other_bottom in self._used_areas
        )


def _new_area(corner: tuple[float, float], width: float, height: float) -> Area:
    """The area of a new block with its name below and a gap around them."""
    x, y = corner
    half_name = 40.0  # px
    middle = x + width / 2
    return middle - half_name, y - _GAP, middle + half_name, y + height + NAME_HEIGHT + _GAP
