"""Positions of blocks and ports: from the diagram's layout, or automatic ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

from armblocks.diagram import Block, Diagram, Inport, Outport, Placement
from armblocks.diagram.signs import Outline
from armblocks.drawing.arrangement import arranged_boxes
from armblocks.drawing.block_boxes import Box, BoxPort, sized_box, standing_box, with_inputs
from armblocks.drawing.block_faces import face_size

SumSides: TypeAlias = tuple[str, str, str]
"""Inputs of a round sum: behind, above, below; ``""`` for none."""
_ORIGIN = Placement(x=0.0, y=0.0)


def boxes(diagram: Diagram) -> dict[str, Box]:
    """Every block's box: from the layout if it names all blocks, else from :func:`arranged_boxes`."""
    if not diagram.layout or set(diagram.layout) < set(diagram.blocks):
        sized = {name: sized_box(name, block) for name, block in drawn_blocks(diagram).items()}
        placed = arranged_boxes(diagram, sized)
        sides = _sum_sides(diagram, placed)
    else:
        placed, sides = _placed(diagram), sum_sides(diagram)
    return {name: turned_sum(box, sides[name]) if name in sides else box for name, box in placed.items()}


def arranged_layout(diagram: Diagram) -> dict[str, Placement]:
    """Automatic positions of all blocks, which become upright; their sizes and appearance are unchanged."""
    sized: dict[str, Box] = {}
    for name, block in drawn_blocks(diagram).items():
        place = diagram.layout.get(name, _ORIGIN)
        if place.rotation % 180:
            place = _ORIGIN
        sized[name] = standing_box(name, block, replace(_ORIGIN, width=place.width, height=place.height))
    return {
        name: replace(
            diagram.layout.get(name, _ORIGIN),
            x=round(box.x),
            y=round(box.y),
            width=None if box.width == own.width else box.width,
            height=None if box.height == own.height else box.height,
            flipped=box.flipped,
            rotation=0,
        )
        for name, box in arranged_boxes(diagram, sized).items()
        for own in [sized_box(name, box.block)]
    }


def _placed(diagram: Diagram) -> Mapping[str, Box]:
    """The boxes of all blocks at their positions in the layout; round sums are not turned."""
    drawn = drawn_blocks(diagram)
    return diagram.keep(
        "placed boxes",
        lambda: {name: standing_box(name, block, diagram.layout[name]) for name, block in drawn.items()},
    )


def drawn_blocks(diagram: Diagram) -> Mapping[str, Block]:
    """The blocks for drawing: In and Out blocks without a stated number show their actual number."""
    return diagram.keep("drawn blocks", lambda: _numbered(diagram))


def _numbered(diagram: Diagram) -> dict[str, Block]:
    drawn = dict(diagram.blocks)
    for kind in (Inport, Outport):
        ports = [(name, block) for name, block in diagram.blocks.items() if isinstance(block, kind)]
        ports.sort(key=lambda entry: (entry[1].port or len(drawn) + 1, entry[0]))
        for number, (name, block) in enumerate(ports, start=1):
            if not block.port:
                drawn[name] = replace(block, port=number)
    return drawn


def turned_sum(box: Box, sides: SumSides) -> Box:
    """A round sum with each input on the side from which its wire comes; the signs move with the ports."""
    behind, above, below = sides
    x, first = box.x + box.width / 2, box.inputs[0]
    ports = {
        behind: BoxPort(behind, first.x, box.y + box.height / 2, first.dx, 0),
        above: BoxPort(above, x, box.y, 0, 1),
        below: BoxPort(below, x, box.y + box.height, 0, -1),
    }
    return with_inputs(box, [ports[port.name] for port in box.inputs])


def sum_sides(diagram: Diagram) -> Mapping[str, SumSides]:
    """The inputs behind, above and below of each round sum whose ports follow its wires."""
    return diagram.keep("sum sides", lambda: _sum_sides(diagram, _placed(diagram)))


def _sum_sides(diagram: Diagram, placed: Mapping[str, Box]) -> dict[str, SumSides]:
    sums = {
        name: box
        for name, box in placed.items()
        if len(box.inputs) in (2, 3) and not box.rotation and face_size(box.block)[0] is Outline.CIRCLE
    }
    sources: dict[str, dict[str, tuple[float, float, bool]]] = {name: {} for name in sums}
    for wire in diagram.connections:
        if wire.target.block in sums:
            source, box = placed[wire.source.block], sums[wire.target.block]
            height = _port_y(source.outputs, wire.source.port)
            sources[wire.target.block][wire.target.port] = source.x, height, source.flipped != box.flipped
    sides: dict[str, SumSides] = {}
    for name, box in sums.items():
        if len(sources[name]) < len(box.inputs):
            continue  # an incomplete diagram: the direction of an open input is unknown
        ports = [port.name for port in box.inputs]
        # The straightest wire enters from the left, except the feedback wire of a loop.
        behind = {port: x > box.x if box.flipped else x < box.x for port, (x, _, _) in sources[name].items()}
        heights = {port: y - box.y - box.height / 2 for port, (_, y, _) in sources[name].items()}
        west = min(ports, key=lambda port: (not behind[port], abs(heights[port]), port))
        others = sorted((port for port in ports if port != west), key=lambda port: (heights[port], port))
        if len(others) == 2:
            sides[name] = west, others[0], others[1]
        else:
            (other,) = others
            above = (behind[other] or sources[name][other][2]) and heights[other] < -box.height
            sides[name] = (west, other, "") if above else (west, "", other)
    return sides


def _port_y(ports: Sequence[BoxPort], name: str) -> float:
    return next(port.y for port in ports if port.name == name)
