"""Boxes of blocks: size, and ports along the edges."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

from armblocks.diagram import Block, Placement
from armblocks.diagram.signs import Outline
from armblocks.drawing.block_faces import bus_width, face_size, face_width, frame_labels, port_labels
from armblocks.drawing.structure_faces import CONTROL_HEIGHT, control_ports
from armblocks.pictures.text_width import text_width

NAME_SIZE = 11.0
"""Font size of the names under the blocks, px."""
NAME_HEIGHT = 20.0
"""Height of the name below a block, px."""
PORT_TEXT = 9.0
PORT_TEXT_HEIGHT = 13.0
"""Height of the port names at the upper or lower edge, px."""
MIN_PORT_DISTANCE = 5.0
"""Minimum distance of ports on one side, px, with which the wires at them can be distinguished."""


SIDES = ("left", "right")
_FRAME = "\0"
"""Precedes the name of a frame port among the ports of one side; names of ports are printable."""


@dataclass(frozen=True)
class BoxPort:
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
    name_side: str = "auto"
    """The chosen side of the name."""
    shown_name_side: str = "below"
    """The side where the name is drawn, see :func:`with_inputs`."""
    colour: str = "none"
    inputs: tuple[BoxPort, ...] = ()
    outputs: tuple[BoxPort, ...] = ()
    frames: tuple[BoxPort, ...] = ()
    """The frame ports; the direction of each leads away from the block."""

    @property
    def upright(self) -> bool:
        """Whether the signals of the block run horizontally."""
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
            frames=tuple(replace(p, x=p.x + dx, y=p.y + dy) for p in self.frames),
        )


def box_at_placement(name: str, block: Block, place: Placement) -> Box:
    """The box of a block at a placement, independent of its connections."""
    return replace(_placed_at_origin(block, replace(place, x=0.0, y=0.0)), name=name).at(place.x, place.y)


@lru_cache(maxsize=4096)
def _placed_at_origin(block: Block, place: Placement) -> Box:
    natural = box_at_origin("", block)
    width, height = natural.width, natural.height
    if place.rotation % 180:
        width, height = _rotated_size(natural)
    box = replace(
        natural,
        width=place.width or width,
        height=place.height or height,
        flipped=place.flipped,
        rotation=place.rotation,
        name_side=place.name_side,
        colour=place.colour,
    )
    return _with_separate_ports(_with_ports(box))


def _with_separate_ports(box: Box) -> Box:
    """The box, enlarged if its size is so small that wires to neighbouring ports would touch."""
    sizes = [box.width, box.height]
    for ports in (box.inputs, box.outputs):
        for axis, positions in ((0, [p.x for p in ports if p.dy]), (1, [p.y for p in ports if p.dx])):
            distances = [b - a for a, b in pairwise(sorted(positions)) if b > a]
            if distances and min(distances) < MIN_PORT_DISTANCE:
                sizes[axis] *= MIN_PORT_DISTANCE / min(distances)
    if sizes == [box.width, box.height]:
        return box
    return _with_ports(replace(box, width=math.ceil(sizes[0]), height=math.ceil(sizes[1])))


def _rotated_size(box: Box) -> tuple[float, float]:
    """Width and height of a block rotated by 90 degrees: its ports rotate, its drawing stays upright."""
    shape = face_size(box.block)[0]
    if shape is Outline.TAG:  # as wide as its text
        return box.width, box.height + 10
    if shape not in (Outline.CARD, Outline.BUS):
        return box.height, box.width
    labels = _side_labels(box.block)
    pitches = [max((text_width(text, PORT_TEXT) + 6 for text in side), default=0.0) for side in labels]
    frames = [sum(port.side == side for port in box.block.frame_ports()) for side in SIDES]
    ports = (len(box.block.input_ports()) + frames[0], len(box.block.output_ports()) + frames[1])
    wide = max(count * max(20.0, pitch) + 8 for count, pitch in zip(ports, pitches))
    if shape is Outline.BUS:
        return float(round(max(box.height, wide))), 30.0
    _, width, height = face_size(box.block)
    labelled_sides = sum(any(side) for side in labels)
    control_height = CONTROL_HEIGHT * bool(control_ports(box.block))
    return float(round(max(width, wide))), height + labelled_sides * PORT_TEXT_HEIGHT + control_height


def box_at_origin(name: str, block: Block) -> Box:
    """A box at the origin with the size of the block's face and with its ports along the edges."""
    shape, width, height = face_size(block)
    left_frames = sum(port.side == "left" for port in block.frame_ports())
    inputs = len(block.input_ports()) - len(control_ports(block)) + left_frames
    outputs = len(block.output_ports()) + len(block.frame_ports()) - left_frames
    if shape is Outline.CARD:
        labels = _side_labels(block)
        if any(label for side in labels for label in side):
            widest = [max((text_width(t, PORT_TEXT) + 5 for t in side if t), default=0.0) for side in labels]
            width = max(width, face_width(block) + sum(widest) + 4)
        height = max(height, 20.0 * max(inputs, outputs) + 8 + CONTROL_HEIGHT * bool(control_ports(block)))
    elif shape is Outline.BAR:
        height = max(height, 20.0 * max(inputs, outputs) + 4)
    elif shape is Outline.BUS:
        width, height = bus_width(block, PORT_TEXT), max(height, 20.0 * max(inputs, outputs) + 4)
    return _with_ports(Box(name=name, block=block, x=0.0, y=0.0, width=float(round(width)), height=height))


def _side_labels(block: Block) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The texts beside the ports of the left and of the right side, with those of frame ports."""
    into, out = port_labels(block)
    named = list(zip(block.frame_ports(), frame_labels(block)))
    left, right = (
        tuple(label for port, label in named if label and port.side == side) for side in ("left", "right")
    )
    return (*left, *into), (*right, *out)


def flipped_box(box: Box) -> Box:
    """The box with its inputs on the right."""
    return _with_ports(replace(box, flipped=True))


def with_inputs(box: Box, inputs: Sequence[BoxPort]) -> Box:
    """The box with other input ports, and with its name on a side without ports, where wires do not cross it.

    The side is below, above, left, right, hidden, or ``corner``: the upper right corner, for a block with
    ports above and below.
    """
    updated = replace(box, inputs=tuple(inputs))
    return replace(updated, shown_name_side=_free_name_side(updated))


def _free_name_side(box: Box) -> str:
    ports = (*box.inputs, *box.outputs, *box.frames)
    has_ports = {
        "left": any(port.x <= box.x for port in ports),
        "right": any(port.x >= box.x + box.width for port in ports),
        "above": any(port.y <= box.y for port in ports),
        "below": any(port.y >= box.y + box.height for port in ports),
        "auto": True,
    }
    if not has_ports.get(box.name_side):
        return box.name_side
    if not box.upright:
        return "right"
    return "corner" if has_ports["below"] else "below"


def _with_ports(box: Box) -> Box:
    """The box with its ports, which are rotated with the block."""
    width, height = (box.width, box.height) if box.upright else (box.height, box.width)
    upright = _with_upright_ports(replace(box, x=0.0, y=0.0, width=width, height=height))
    inputs, outputs, frames = upright.inputs, upright.outputs, upright.frames
    for _ in range(box.rotation // 90):
        inputs = tuple(_rotated_by_90(port, height) for port in inputs)
        outputs = tuple(_rotated_by_90(port, height) for port in outputs)
        frames = tuple(_rotated_by_90(port, height) for port in frames)
        width, height = height, width
    return with_inputs(replace(box, x=0.0, y=0.0, outputs=outputs, frames=frames), inputs).at(box.x, box.y)


def _rotated_by_90(port: BoxPort, height: float) -> BoxPort:
    return BoxPort(port.name, height - port.y, port.x, -port.dy, port.dx)


def _with_upright_ports(box: Box) -> Box:
    shape, _, _ = face_size(box.block)
    into, out = [p.name for p in box.block.input_ports()], [p.name for p in box.block.output_ports()]
    left, right = box.x, box.x + box.width
    entry, leave = (right, left) if box.flipped else (left, right)
    forwards = -1 if box.flipped else 1
    if shape is Outline.CIRCLE and len(into) in (2, 3):
        # Inputs of a round sum: the first from the left, the second from below, the third from above.
        cx, cy = box.x + box.width / 2, box.y + box.height / 2
        ports = [
            BoxPort(into[0], entry, cy, forwards, 0),
            BoxPort(into[1], cx, box.y + box.height, 0, -1),
            *(BoxPort(name, cx, box.y, 0, 1) for name in into[2:]),
        ]
        return replace(
            box, inputs=tuple(ports), outputs=tuple(BoxPort(n, leave, cy, forwards, 0) for n in out)
        )
    above = control_ports(box.block)
    side = [name for name in into if name not in above]
    top = CONTROL_HEIGHT if above else 0.0
    of_side = {s: [port.name for port in box.block.frame_ports() if port.side == s] for s in SIDES}
    entering = _evenly_spaced_ports(
        [*(f"{_FRAME}{name}" for name in of_side["left"]), *side],
        entry,
        box.y + top,
        box.height - top,
        forwards,
    )
    ports = {
        **entering,
        **{
            name: BoxPort(name, box.x + box.width * (k + 1) / (len(above) + 1), box.y, 0, 1)
            for k, name in enumerate(above)
        },
    }
    leaving = _evenly_spaced_ports(
        [*(f"{_FRAME}{name}" for name in of_side["right"]), *out],
        leave,
        box.y + top,
        box.height - top,
        forwards,
    )
    frames = {
        name: replace(placed[f"{_FRAME}{name}"], name=name, dx=outwards)
        for s, placed, outwards in (("left", entering, -forwards), ("right", leaving, forwards))
        for name in of_side[s]
    }
    return replace(
        box,
        inputs=tuple(ports[name] for name in into),
        outputs=tuple(leaving[name] for name in out),
        frames=tuple(frames[port.name] for port in box.block.frame_ports()),
    )


def _evenly_spaced_ports(
    names: Sequence[str], x: float, y: float, height: float, forwards: int
) -> dict[str, BoxPort]:
    """Ports at equal distances along an edge that begins at y."""
    return {
        name: BoxPort(name, x, y + height * (k + 0.5) / len(names), forwards, 0)
        for k, name in enumerate(names)
    }
