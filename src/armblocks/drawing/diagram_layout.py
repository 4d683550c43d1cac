"""Positions of blocks and ports: from the diagram's layout, or automatic ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

from armblocks.diagram import Block, Diagram, Inport, Outport, Placement
from armblocks.diagram.signs import Outline
from armblocks.drawing.arrangement import arranged_boxes
from armblocks.drawing.block_boxes import Box, BoxPort, box_at_origin, box_at_placement, with_inputs
from armblocks.drawing.block_faces import face_size

SumSides: TypeAlias = tuple[str, str, str]
"""Inputs of a round sum: at the rear, opposite to the output; above; and below. ``""`` for none."""
_ORIGIN = Placement(x=0.0, y=0.0)


def boxes(diagram: Diagram) -> dict[str, Box]:
    """Every block's box: from the layout if it names all blocks, else from :func:`arranged_boxes`."""
    if not diagram.layout or set(diagram.layout) < set(diagram.blocks):
        unplaced = {name: box_at_origin(name, block) for name, block in drawn_blocks(diagram).items()}
        placed_boxes = arranged_boxes(diagram, unplaced)
        sides = _sum_sides(diagram, placed_boxes)
    else:
        placed_boxes, sides = _boxes_from_layout(diagram), sum_sides(diagram)
    return {
        name: sum_with_sides(box, sides[name]) if name in sides else box for name, box in placed_boxes.items()
    }


def arranged_layout(diagram: Diagram) -> dict[str, Placement]:
    """Automatic positions of all blocks, which become upright; their sizes and appearance are unchanged."""
    unplaced: dict[str, Box] = {}
    for name, block in drawn_blocks(diagram).items():
        place = diagram.layout.get(name, _ORIGIN)
        if place.rotation % 180:
            place = _ORIGIN
        unplaced[name] = box_at_placement(
            name, block, replace(_ORIGIN, width=place.width, height=place.height)
        )
    return {
        name: replace(
            diagram.layout.get(name, _ORIGIN),
            x=round(box.x),
            y=round(box.y),
            width=None if box.width == default_box.width else box.width,
            height=None if box.height == default_box.height else box.height,
            flipped=box.flipped,
            rotation=0,
        )
        for name, box in arranged_boxes(diagram, unplaced).items()
        for default_box in [box_at_origin(name, box.block)]
    }


def _boxes_from_layout(diagram: Diagram) -> Mapping[str, Box]:
    """The boxes of all blocks at their positions in the layout; the inputs of round sums are not adapted."""
    drawn = drawn_blocks(diagram)
    return diagram.cached(
        "placed boxes",
        lambda: {name: box_at_placement(name, block, diagram.layout[name]) for name, block in drawn.items()},
    )


def drawn_blocks(diagram: Diagram) -> Mapping[str, Block]:
    """The blocks for drawing: In and Out blocks without a stated number show their actual number."""
    return diagram.cached("drawn blocks", lambda: _numbered(diagram))


def _numbered(diagram: Diagram) -> dict[str, Block]:
    drawn = dict(diagram.blocks)
    for kind in (Inport, Outport):
        ports = [(name, block) for name, block in diagram.blocks.items() if isinstance(block, kind)]
        ports.sort(key=lambda entry: (entry[1].port or len(drawn) + 1, entry[0]))
        for number, (name, block) in enumerate(ports, start=1):
            if not block.port:
                drawn[name] = replace(block, port=number)
    return drawn


def sum_with_sides(box: Box, sides: SumSides) -> Box:
    """A round sum with each input on the side from which its wire comes; signs follow their ports."""
    rear, above, below = sides
    x, first = box.x + box.width / 2, box.inputs[0]
    ports = {
        rear: BoxPort(rear, first.x, box.y + box.height / 2, first.dx, 0),
        above: BoxPort(above, x, box.y, 0, 1),
        below: BoxPort(below, x, box.y + box.height, 0, -1),
    }
    return with_inputs(box, [ports[port.name] for port in box.inputs])


def sum_sides(diagram: Diagram) -> Mapping[str, SumSides]:
    """The rear, upper and lower inputs of each round sum whose ports follow its wires."""
    return diagram.cached("sum sides", lambda: _sum_sides(diagram, _boxes_from_layout(diagram)))


def _sum_sides(diagram: Diagram, placed_boxes: Mapping[str, Box]) -> dict[str, SumSides]:
    sums = {
        name: box
        for name, box in placed_boxes.items()
        if len(box.inputs) in (2, 3) and not box.rotation and face_size(box.block)[0] is Outline.CIRCLE
    }
    sources: dict[str, dict[str, tuple[float, float, bool]]] = {name: {} for name in sums}
    for wire in diagram.connections:
        if wire.target.block in sums:
            source, box = placed_boxes[wire.source.block], sums[wire.target.block]
            height = _port_y(source.outputs, wire.source.port)
            sources[wire.target.block][wire.target.port] = source.x, height, source.flipped != box.flipped
    sides: dict[str, SumSides] = {}
    for name, box in sums.items():
        if len(sources[name]) < len(box.inputs):
            continue  # an incomplete diagram: the direction of an unconnected input is unknown
        ports = [port.name for port in box.inputs]
        # The straightest wire enters from the left, except the feedback wire of a loop.
        rear = {port: x > box.x if box.flipped else x < box.x for port, (x, _, _) in sources[name].items()}
        heights = {port: y - box.y - box.height / 2 for port, (_, y, _) in sources[name].items()}
        straight = min(ports, key=lambda port: (not rear[port], abs(heights[port]), port))
        others = sorted((port for port in ports if port != straight), key=lambda port: (heights[port], port))
        if len(others) == 2:
            sides[name] = straight, others[0], others[1]
        else:
            (other,) = others
            above = (rear[other] or sources[name][other][2]) and heights[other] < -box.height
            sides[name] = (straight, other, "") if above else (straight, "", other)
    return sides


def _port_y(ports: Sequence[BoxPort], name: str) -> float:
    return next(port.y for port in ports if port.name == name)
