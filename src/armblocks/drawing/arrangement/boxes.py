"""Boxes of an arranged sheet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from armblocks.diagram import Diagram
from armblocks.drawing.arrangement.columns import Columns, assign_columns
from armblocks.drawing.arrangement.feedback import Flow, signal_flow
from armblocks.drawing.arrangement.links import Network, with_frames, without_frames
from armblocks.drawing.arrangement.order import node_order
from armblocks.drawing.arrangement.rows import heights
from armblocks.drawing.block_boxes import NAME_HEIGHT, Box, flipped_box

_GAP = 42.0
"""Width of the gap between two columns without vertical lines, px."""
_LANE = 11.0
"""Additional width of the gap for each vertical line in it, px."""
_PART_GAP = 44.0
_MAX_EXCHANGE_NODES = 120
"""A part with more nodes is ordered only once, without exchanged lines at sums."""
_MAX_WIDTH = 900.0
"""Maximum width of a row of unconnected blocks, px."""


def arranged_boxes(diagram: Diagram, unplaced: Mapping[str, Box]) -> dict[str, Box]:
    """The boxes of a sheet at their automatic positions; ``unplaced``: their boxes, at any position."""
    network = Network.of(diagram, unplaced)
    placed_boxes: dict[str, Box] = {}
    y, unconnected = 0.0, list[int]()
    for members in network.components():
        if len(members) == 1 and not network.subnetwork(members).links:
            unconnected += members
            continue
        part = _arranged_part(network.subnetwork(members))
        for box in part:
            placed_boxes[box.name] = box.at(box.x, box.y + y)
        y += max(box.y + box.height for box in part) + NAME_HEIGHT + _PART_GAP
    x = row_height = 0.0
    for box in (network.boxes[k] for k in unconnected):
        width = max(box.width, box.name_width)
        if x and x + width > _MAX_WIDTH:
            x, y, row_height = 0.0, y + row_height, 0.0
        placed_boxes[box.name] = box.at(round(x + (width - box.width) / 2), y)
        x, row_height = x + width + _GAP, max(row_height, box.height + NAME_HEIGHT + _GAP / 2)
    return {name: without_frames(placed_boxes[name]) for name in diagram.blocks}


def _arranged_part(network: Network) -> list[Box]:
    """The boxes of a connected part, whose upper left corner is (0, 0)."""
    flow = signal_flow(network)
    boxes = [
        with_frames(flipped_box(box)) if k in flow.mirrored else box for k, box in enumerate(network.boxes)
    ]
    network = Network(network.names, tuple(boxes), network.links)
    columns, order = _best_order(network, flow)
    tops = heights(columns, order, [box.height for box in boxes], NAME_HEIGHT)
    top = min(tops[: len(boxes)])
    tops = [y - top for y in tops]
    placed_boxes: list[Box] = list(boxes)
    x = 0.0
    for column, members in enumerate(order):
        width = max(
            (max(boxes[k].width, boxes[k].name_width) for k in members if k < len(boxes)), default=0.0
        )
        for k in members:
            if k < len(boxes):
                placed_boxes[k] = boxes[k].at(round(x + (width - boxes[k].width) / 2), round(tops[k]))
        x += width + _GAP + _LANE * _lanes(columns, tops, column)
    return placed_boxes


def _best_order(network: Network, flow: Flow) -> tuple[Columns, list[list[int]]]:
    """The columns and the order of their nodes.

    At a round sum with three inputs, the lines from above and below are exchanged if that costs less.
    """
    columns = assign_columns(network, flow)
    cost, order = node_order(columns)
    if len(columns.column) > _MAX_EXCHANGE_NODES:
        return columns, order
    exchanged: frozenset[int] = frozenset()
    sums = [k for k, box in enumerate(network.boxes) if network.is_round(k) and len(box.inputs) == 3]
    for node in [k for k in sums if sum(link.target == k for link in network.links) == 3]:
        other = assign_columns(network, flow, exchanged | {node})
        other_cost, other_order = node_order(other)
        if other_cost < cost - 1e-9:
            exchanged |= {node}
            columns, cost, order = other, other_cost, other_order
    return columns, order


def _lanes(columns: Columns, tops: Sequence[float], gap: int) -> int:
    """The maximum number of vertical lines side by side in the gap to the right of a column."""
    spans: dict[int, tuple[float, float]] = {}
    for segment in columns.segments:
        if segment.gap != gap or not (segment.a.can_be_straight and segment.b.can_be_straight):
            continue
        ends = tops[segment.a.node] + segment.a.port, tops[segment.b.node] + segment.b.port
        if abs(ends[0] - ends[1]) > 1.5:
            low, high = spans.get(segment.net, (ends[0], ends[0]))
            spans[segment.net] = min(low, *ends), max(high, *ends)
    events = sorted(
        [(low, 1) for low, _ in spans.values()] + [(high + 1.0, -1) for _, high in spans.values()]
    )
    maximum = depth = 0
    for _, change in events:
        depth += change
        maximum = max(maximum, depth)
    return maximum
