"""Positions of blocks and ports: from the diagram's layout, or in layers from left to right."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypeAlias

from armblocks.diagram import Block, Diagram, Inport, Outport, Placement
from armblocks.diagram.signs import Outline
from armblocks.drawing.block_faces import bus_width, face_size, face_width, port_labels
from armblocks.drawing.structure_faces import CONTROL_ROOM, control_ports
from armblocks.pictures.text_width import text_width

NAME_SIZE = 11.0
"""Font size of the names under the blocks, px."""
NAME_ROOM = 20.0
"""Height of the name below a block, px."""
PORT_TEXT = 9.0
PORT_TEXT_ROOM = 13.0
"""Height of the port names at the upper or lower edge, px."""
_ROW_GAP = 26.0
_COLUMN_GAP = 52.0
_LANE = 11.0
_STRAIGHTEN = 13.0
"""Maximum shift of a block to straighten a line, px."""


SumSides: TypeAlias = tuple[str, str, str]
"""Inputs of a round sum: behind, above, below; ``""`` for none."""


@dataclass(frozen=True)
class PortSpot:
    """A port on the edge of its block, and the direction in which its wire leaves or enters (dx, dy)."""

    name: str
    x: float
    y: float
    dx: int
    dy: int


@dataclass(frozen=True, eq=False, kw_only=True)
class Box:
    """A block on the sheet: top left corner, size, ports in order."""

    name: str
    block: Block
    x: float
    y: float
    width: float
    height: float
    flipped: bool = False
    rotation: int = 0
    """Degrees clockwise."""
    inputs: tuple[PortSpot, ...] = ()
    outputs: tuple[PortSpot, ...] = ()

    @property
    def upright(self) -> bool:
        """Whether its signals run horizontally."""
        return self.rotation % 180 == 0

    @property
    def name_width(self) -> float:
        """Maximum width of the block's name, px."""
        return min(text_width(self.name, NAME_SIZE), 168.0)

    def at(self, x: float, y: float) -> Box:
        """The box at another position."""
        dx, dy = x - self.x, y - self.y
        return replace(
            self,
            x=x,
            y=y,
            inputs=tuple(replace(p, x=p.x + dx, y=p.y + dy) for p in self.inputs),
            outputs=tuple(replace(p, x=p.x + dx, y=p.y + dy) for p in self.outputs),
        )


def boxes(diagram: Diagram) -> dict[str, Box]:
    """Every block's box: from the diagram's layout if it names all blocks, else from :func:`layered`."""
    drawn = drawn_blocks(diagram)
    if not diagram.layout or set(diagram.layout) < set(diagram.blocks):
        sized = {name: sized_box(name, block) for name, block in drawn.items()}
        placed = _straightened(diagram, layered(diagram, sized))
        sides = _sum_sides(diagram, placed)
    else:
        placed, sides = _placed(diagram), sum_sides(diagram)
    return {name: turned_sum(box, sides[name]) if name in sides else box for name, box in placed.items()}


def _placed(diagram: Diagram) -> Mapping[str, Box]:
    """The boxes of all blocks where the layout has them, sums upright."""
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
        found = [(name, block) for name, block in diagram.blocks.items() if isinstance(block, kind)]
        found.sort(key=lambda entry: (entry[1].port or len(drawn) + 1, entry[0]))
        for number, (name, block) in enumerate(found, start=1):
            if not block.port:
                drawn[name] = replace(block, port=number)
    return drawn


def standing_box(name: str, block: Block, place: Placement) -> Box:
    """The box of a block at ``place``, independent of its connections."""
    return replace(_at_origin(block, replace(place, x=0.0, y=0.0)), name=name).at(place.x, place.y)


@lru_cache(maxsize=4096)
def _at_origin(block: Block, place: Placement) -> Box:
    sized = sized_box("", block)
    width, height = sized.width, sized.height
    if place.rotation % 180:
        width, height = _standing(sized)
    return _with_ports(
        replace(
            sized,
            width=place.width or width,
            height=place.height or height,
            flipped=place.flipped,
            rotation=place.rotation,
        )
    )


def _standing(box: Box) -> tuple[float, float]:
    """Width and height of a block rotated by 90 degrees: its ports rotate, its drawing stays upright."""
    shape = face_size(box.block)[0]
    if shape is Outline.TAG:  # as wide as its text
        return box.width, box.height + 10
    if shape not in (Outline.CARD, Outline.BUS):
        return box.height, box.width
    labels = port_labels(box.block)
    pitches = [max((text_width(text, PORT_TEXT) + 6 for text in side), default=0.0) for side in labels]
    ports = (len(box.block.input_ports()), len(box.block.output_ports()))
    wide = max(count * max(20.0, pitch) + 8 for count, pitch in zip(ports, pitches))
    if shape is Outline.BUS:
        return float(round(max(box.height, wide))), 30.0
    _, width, height = face_size(box.block)
    named = sum(any(side) for side in labels)
    room = CONTROL_ROOM * bool(control_ports(box.block))
    return float(round(max(width, wide))), height + named * PORT_TEXT_ROOM + room


def _straightened(diagram: Diagram, placed: dict[str, Box]) -> dict[str, Box]:
    """Blocks shifted vertically by a few px to straighten lines without crowding."""
    moved = dict(placed)
    for name in sorted(placed, key=lambda n: (placed[n].x, placed[n].y, n)):
        box = moved[name]
        gaps = [
            _port_y(moved[wire.source.block].outputs, wire.source.port)
            - _port_y(box.inputs, wire.target.port)
            for wire in diagram.connections
            if wire.target.block == name and moved[wire.source.block].x < box.x
        ]
        small = [gap for gap in gaps if abs(gap) <= _STRAIGHTEN]
        if not small or 0.0 in gaps:
            continue
        there = box.at(box.x, box.y + min(small, key=abs))
        if all(_apart(there, other) for key, other in moved.items() if key != name):
            moved[name] = there
    return moved


def _apart(a: Box, b: Box) -> bool:
    return (
        a.x + a.width + 10 < b.x
        or b.x + b.width + 10 < a.x
        or a.y + a.height + NAME_ROOM + 4 < b.y
        or b.y + b.height + NAME_ROOM + 4 < a.y
    )


def turned_sum(box: Box, sides: SumSides) -> Box:
    """A round sum with each input on the side from which its wire comes; the signs move with the ports."""
    behind, above, below = sides
    x, first = box.x + box.width / 2, box.inputs[0]
    spots = {
        behind: PortSpot(behind, first.x, box.y + box.height / 2, first.dx, 0),
        above: PortSpot(above, x, box.y, 0, 1),
        below: PortSpot(below, x, box.y + box.height, 0, -1),
    }
    return replace(box, inputs=tuple(spots[spot.name] for spot in box.inputs))


def sum_sides(diagram: Diagram) -> Mapping[str, SumSides]:
    """The inputs of round sums that are behind, above and below, for those that are turned by their wires."""
    return diagram.keep("sum sides", lambda: _sum_sides(diagram, _placed(diagram)))


def _sum_sides(diagram: Diagram, placed: Mapping[str, Box]) -> dict[str, SumSides]:
    sums = {
        name: box
        for name, box in placed.items()
        if len(box.inputs) in (2, 3) and not box.rotation and face_size(box.block)[0] is Outline.CIRCLE
    }
    sources: dict[str, dict[str, tuple[float, float]]] = {name: {} for name in sums}
    for wire in diagram.connections:
        if wire.target.block in sums:
            source = placed[wire.source.block]
            height = _port_y(source.outputs, wire.source.port)
            sources[wire.target.block][wire.target.port] = source.x, height
    found: dict[str, SumSides] = {}
    for name, box in sums.items():
        if len(sources[name]) < len(box.inputs):
            continue  # an incomplete diagram: the direction of an open input is unknown
        ports = [spot.name for spot in box.inputs]
        # The straightest wire enters from the left, except the feedback wire of a loop.
        behind = {port: x < box.x for port, (x, _) in sources[name].items()}
        heights = {port: y - box.y - box.height / 2 for port, (_, y) in sources[name].items()}
        west = min(ports, key=lambda port: (not behind[port], abs(heights[port]), port))
        others = sorted((port for port in ports if port != west), key=lambda port: (heights[port], port))
        if len(others) == 2:
            found[name] = west, others[0], others[1]
        else:
            (other,) = others
            above = behind[other] and heights[other] < -box.height
            found[name] = (west, other, "") if above else (west, "", other)
    return found


def layered(diagram: Diagram, sized: Mapping[str, Box]) -> dict[str, Box]:
    """Blocks in columns so that wires run to the right, except those that close a loop.

    1. Columns from the longest path from a source, with loops cut at the back edges of a depth-first search.
    2. Order within a column from the mean position of the neighbours, in sweeps. 3. Heights from the
    neighbours' ports. Source: Sugiyama, Tagawa, Toda, *Methods for visual understanding of hierarchical
    system structures*, 1981.
    """
    successors: dict[str, list[str]] = {name: [] for name in diagram.blocks}
    for wire in diagram.connections:
        if wire.target.block not in successors[wire.source.block]:
            successors[wire.source.block].append(wire.target.block)
    forward = _without_loops(successors)
    layer = _layers(forward)
    columns: list[list[str]] = [[] for _ in range(max(layer.values(), default=0) + 1)]
    for name in diagram.blocks:
        columns[layer[name]].append(name)
    predecessors: dict[str, list[str]] = {name: [] for name in diagram.blocks}
    for name, targets in forward.items():
        for target in targets:
            predecessors[target].append(name)
    _order_columns(columns, predecessors, forward)
    return _assign(diagram, columns, predecessors, sized)


def _without_loops(successors: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
    """The edges without the back edges of a depth-first search."""
    forward: dict[str, list[str]] = {name: [] for name in successors}
    entered = {target for targets in successors.values() for target in targets}
    colour: dict[str, int] = {}
    # The search starts with blocks without inputs, so that it follows the signals.
    for root in sorted(successors, key=lambda name: (name in entered, name)):
        if root in colour:
            continue
        colour[root] = 1
        stack: list[tuple[str, int]] = [(root, 0)]
        while stack:
            name, k = stack.pop()
            if k == len(successors[name]):
                colour[name] = 2
                continue
            stack.append((name, k + 1))
            target = successors[name][k]
            if colour.get(target) == 1:
                continue
            forward[name].append(target)
            if target not in colour:
                colour[target] = 1
                stack.append((target, 0))
    return forward


def _layers(forward: Mapping[str, Sequence[str]]) -> dict[str, int]:
    waiting = dict.fromkeys(forward, 0)
    for targets in forward.values():
        for target in targets:
            waiting[target] += 1
    layer = dict.fromkeys(forward, 0)
    ready = [name for name, count in waiting.items() if count == 0]
    while ready:
        name = ready.pop()
        for target in forward[name]:
            layer[target] = max(layer[target], layer[name] + 1)
            waiting[target] -= 1
            if waiting[target] == 0:
                ready.append(target)
    # A source is placed directly before its first target, not at the far left.
    for name, targets in forward.items():
        if targets and not any(name in others for others in forward.values()):
            layer[name] = min(layer[target] for target in targets) - 1
    return layer


def _order_columns(
    columns: list[list[str]], predecessors: Mapping[str, list[str]], successors: Mapping[str, list[str]]
) -> None:
    place = {name: float(k) for column in columns for k, name in enumerate(column)}
    for sweep in range(6):
        neighbours = predecessors if sweep % 2 == 0 else successors
        for column in columns if sweep % 2 == 0 else reversed(columns):
            wish = {
                name: sum(place[other] for other in neighbours[name]) / len(neighbours[name])
                if neighbours[name]
                else place[name]
                for name in column
            }
            column.sort(key=lambda name: (wish[name], name))
            middle = (len(column) - 1) / 2
            for k, name in enumerate(column):
                place[name] = k - middle


def _assign(
    diagram: Diagram,
    columns: Sequence[Sequence[str]],
    predecessors: Mapping[str, list[str]],
    sized: Mapping[str, Box],
) -> dict[str, Box]:
    placed: dict[str, Box] = {}
    x = 0.0
    for column in columns:
        if not column:
            continue
        width = max(max(sized[name].width, sized[name].name_width) for name in column)
        wishes: list[float] = []
        for name in column:
            box = sized[name]
            aligned = [
                _port_y(placed[wire.source.block].outputs, wire.source.port)
                - _port_y(box.inputs, wire.target.port)
                for wire in diagram.connections
                if wire.target.block == name and wire.source.block in placed
            ]
            wishes.append(sum(aligned) / len(aligned) if aligned else 0.0)
        heights = [sized[name].height + NAME_ROOM + _ROW_GAP for name in column]
        for name, y in zip(column, _stacked(wishes, heights)):
            placed[name] = sized[name].at(x + (width - sized[name].width) / 2, y)
        leaving = {wire.source for wire in diagram.connections if wire.source.block in column}
        x += width + _COLUMN_GAP + _LANE * len(leaving)
    top = min((box.y for box in placed.values()), default=0.0)
    return {name: placed[name].at(placed[name].x, placed[name].y - top) for name in diagram.blocks}


def _stacked(wishes: Sequence[float], heights: Sequence[float]) -> list[float]:
    """Upper edges in the given order, as close to the wanted ones as the heights allow (pool adjacent
    violators)."""
    before = [sum(heights[:k]) for k in range(len(heights))]
    groups: list[tuple[float, int]] = []
    for wish, offset in zip(wishes, before):
        mean, count = wish - offset, 1
        while groups and groups[-1][0] > mean:
            other, size = groups.pop()
            mean = (mean * count + other * size) / (count + size)
            count += size
        groups.append((mean, count))
    flat = [mean for mean, count in groups for _ in range(count)]
    return [float(round(mean + offset)) for mean, offset in zip(flat, before)]


def _port_y(spots: Sequence[PortSpot], port: str) -> float:
    return next(spot.y for spot in spots if spot.name == port)


def sized_box(name: str, block: Block) -> Box:
    """A box at the origin with the size of the block's face and with its ports along the edges."""
    shape, width, height = face_size(block)
    inputs, outputs = len(block.input_ports()) - len(control_ports(block)), len(block.output_ports())
    if shape is Outline.CARD:
        labels = port_labels(block)
        if any(label for side in labels for label in side):
            widest = [max((text_width(t, PORT_TEXT) + 5 for t in side if t), default=0.0) for side in labels]
            width = max(width, face_width(block) + sum(widest) + 4)
        height = max(height, 20.0 * max(inputs, outputs) + 8 + CONTROL_ROOM * bool(control_ports(block)))
    elif shape is Outline.BAR:
        height = max(height, 20.0 * max(inputs, outputs) + 4)
    elif shape is Outline.BUS:
        width, height = bus_width(block, PORT_TEXT), max(height, 20.0 * max(inputs, outputs) + 4)
    return _with_ports(Box(name=name, block=block, x=0.0, y=0.0, width=float(round(width)), height=height))


def _with_ports(box: Box) -> Box:
    """The box with its ports, which are rotated with the block."""
    width, height = (box.width, box.height) if box.upright else (box.height, box.width)
    upright = _with_upright_ports(replace(box, x=0.0, y=0.0, width=width, height=height))
    inputs, outputs = upright.inputs, upright.outputs
    for _ in range(box.rotation // 90):
        inputs = tuple(_gone_round(spot, height) for spot in inputs)
        outputs = tuple(_gone_round(spot, height) for spot in outputs)
        width, height = height, width
    return replace(box, x=0.0, y=0.0, inputs=inputs, outputs=outputs).at(box.x, box.y)


def _gone_round(spot: PortSpot, height: float) -> PortSpot:
    return PortSpot(spot.name, height - spot.y, spot.x, -spot.dy, spot.dx)


def _with_upright_ports(box: Box) -> Box:
    shape, _, _ = face_size(box.block)
    into, out = [p.name for p in box.block.input_ports()], [p.name for p in box.block.output_ports()]
    left, right = box.x, box.x + box.width
    entry, leave = (right, left) if box.flipped else (left, right)
    forwards = -1 if box.flipped else 1
    if shape is Outline.CIRCLE and len(into) in (2, 3):
        # Inputs of a round sum: the first from the left, the second from below, the third from above.
        cx, cy = box.x + box.width / 2, box.y + box.height / 2
        spots = [
            PortSpot(into[0], entry, cy, forwards, 0),
            PortSpot(into[1], cx, box.y + box.height, 0, -1),
            *(PortSpot(name, cx, box.y, 0, 1) for name in into[2:]),
        ]
        return replace(
            box, inputs=tuple(spots), outputs=tuple(PortSpot(n, leave, cy, forwards, 0) for n in out)
        )
    above = control_ports(box.block)
    side = [name for name in into if name not in above]
    top = CONTROL_ROOM if above else 0.0
    spots = {
        **_spread(side, entry, box.y + top, box.height - top, forwards),
        **{
            name: PortSpot(name, box.x + box.width * (k + 1) / (len(above) + 1), box.y, 0, 1)
            for k, name in enumerate(above)
        },
    }
    leaving = _spread(out, leave, box.y + top, box.height - top, forwards)
    return replace(box, inputs=tuple(spots[name] for name in into), outputs=tuple(leaving.values()))


def _spread(names: Sequence[str], x: float, y: float, height: float, forwards: int) -> dict[str, PortSpot]:
    """Ports at equal distances along an edge that begins at y."""
    return {
        name: PortSpot(name, x, y + height * (k + 0.5) / len(names), forwards, 0)
        for k, name in enumerate(names)
    }
