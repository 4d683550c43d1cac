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
from armblocks.diagram.names import folded
from armblocks.drawing.block_boxes import NAME_ROOM, Box, PortSpot
from armblocks.drawing.diagram_drawing import obstacle
from armblocks.drawing.diagram_layout import boxes
from armblocks.errors import DiagramError

_WIDTH, _HEIGHT = 30.0, 20.0
"""Size of a new block, px."""
_AWAY = 50.0
"""Least distance between a port and the new block, px."""
_STEPS = sorted(
    ((away, across) for away in range(40) for across in range(-15, 16)),
    key=lambda step: (step[0] + 1.5 * abs(step[1]), step),
)
"""Shifts away from the port and across its direction, nearest first, in units of ``_STEP``."""
_STEP = 20.0
_GAP = 6.0

_Area = tuple[float, float, float, float]
"""Left, top, right and lower edge, px."""


def grounded(diagram: Diagram, names: Collection[str]) -> Diagram:
    """Return the diagram with a Ground or Terminator at every unconnected port of the named blocks.

    A Ground has the shape that its input declares. Inputs that take a bus, and those of Merge blocks, remain
    unconnected, as do the ports of commented blocks. Raises ``DiagramError`` if nothing can be added.
    """
    placed = boxes(diagram)
    adding = _Adding(diagram, placed)
    commented = diagram.commented
    for ref in sorted(open_inputs({"": diagram})):
        if ref.block in names and _takes_zeros(diagram.blocks[ref.block], ref.port):
            adding.add(ref, placed[ref.block].inputs, _ground(diagram.blocks[ref.block], ref.port))
    driving = {wire.source for wire in diagram.connections}
    for ref in sorted(_outputs(diagram)):
        if ref.block in names and ref.block not in commented and ref not in driving:
            adding.add(ref, placed[ref.block].outputs, Terminator())
    if not adding.blocks:
        raise DiagramError(
            "no unconnected port can be grounded or terminated",
            where=f"diagram '{diagram.name}'",
            allowed="unconnected ports, except bus inputs and inputs of Merge blocks",
            fix="connect a bus or a conditional subsystem to these",
        )
    return dataclasses.replace(
        diagram,
        blocks={**diagram.blocks, **adding.blocks},
        layout={**diagram.layout, **adding.layout},
        connections=(*diagram.connections, *adding.connections),
    )


def _outputs(diagram: Diagram) -> Iterator[PortRef]:
    for name, block in diagram.blocks.items():
        yield from (PortRef(name, port.name) for port in block.output_ports())


def _takes_zeros(block: Block, port: str) -> bool:
    return not isinstance(block, Merge) and not (
        isinstance(block, BusSelector | BusAssignment) and port == "bus"
    )


def _ground(block: Block, name: str) -> Block:
    """A Ground with the shape that an input declares; without one, a scalar."""
    shape = next(port.shape for port in block.input_ports() if port.name == name)
    return Ground(dimensions=tuple(float(size) for size in shape)) if shape else Ground()


class _Adding:
    """New blocks with their positions and connections."""

    def __init__(self, diagram: Diagram, placed: Mapping[str, Box]) -> None:
        self.blocks: dict[str, Block] = {}
        self.layout: dict[str, Placement] = {}
        self.connections: list[Connection] = []
        self._taken = {folded(name) for name in diagram.blocks}
        self._used: list[_Area] = [area for box in placed.values() for area in _areas(box)]

    def add(self, ref: PortRef, spots: Sequence[PortSpot], block: Block) -> None:
        """Add a block that drives an input, or is driven by an output."""
        spot = next(spot for spot in spots if spot.name == ref.port)
        drives = isinstance(block, Ground)
        name = self._free_name(block.title)
        self.blocks[name] = block
        self.layout[name] = self._place(spot, -1 if drives else 1)
        own = PortRef(name, "y" if drives else "u")
        self.connections.append(Connection(own, ref) if drives else Connection(ref, own))

    def _free_name(self, title: str) -> str:
        name, number = title, 2
        while folded(name) in self._taken:
            name, number = f"{title} {number}", number + 1
        self._taken.add(folded(name))
        return name

    def _place(self, spot: PortSpot, side: int) -> Placement:
        """The nearest free position in the direction of a port; ``side`` is 1 behind an output."""
        upright = spot.dy == 0
        width, height = (_WIDTH, _HEIGHT) if upright else (_HEIGHT, _WIDTH)
        dx, dy = side * spot.dx, side * spot.dy

        def corner(step: tuple[int, int]) -> tuple[float, float]:
            away, across = _AWAY + _STEP * step[0], _STEP * step[1]
            return (
                round(spot.x + dx * (away + width / 2) + dy * across - width / 2),
                round(spot.y + dy * (away + height / 2) + dx * across - height / 2),
            )

        free = (step for step in _STEPS if self._is_free(_taken(corner(step), width, height)))
        x, y = corner(next(free, _STEPS[0]))
        self._used.append(_taken((x, y), width, height))
        return Placement(
            x=x,
            y=y,
            width=width,
            height=height,
            flipped=upright and spot.dx < 0,
            rotation=0 if upright else 90 if spot.dy > 0 else 270,
        )

    def _is_free(self, area: _Area) -> bool:
        left, top, right, low = area
        return not any(
            left < other_right and other_left < right and top < other_low and other_top < low
            for other_left, other_top, other_right, other_low in self._used
        )


def _taken(corner: tuple[float, float], width: float, height: float) -> _Area:
    """The area of a new block with its name below."""
    x, y = corner
    half_name = 40.0
    middle = x + width / 2
    return middle - half_name, y - _GAP, middle + half_name, y + height + NAME_ROOM


def _areas(box: Box) -> tuple[_Area, _Area]:
    x, y, width, height = obstacle(box).label
    return (
        (box.x - _GAP, box.y - _GAP, box.x + box.width + _GAP, box.y + box.height + _GAP),
        (x, y, x + width, y + height),
    )
