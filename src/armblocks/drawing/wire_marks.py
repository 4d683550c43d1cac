"""Drawing of wires: lines with round corners, arrow heads, dots, and labels of wires without a line."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum

from armblocks.drawing.wire_search import Point
from armblocks.drawing.wires import Net, RoutedNet, WireEnd
from armblocks.pictures.picture import Curve, Disc, Group, Mark, Polyline, Text
from armblocks.pictures.style import Tone
from armblocks.pictures.text_width import text_width

_ROUNDING = 5.0
LABEL_SIZE = 9.0
LABEL_STUB = 8.0
"""Font size of the labels of wires without a line, and length of the dashed stub before a label, px."""
_LABEL_HEIGHT = 13.0


class WireKind(IntEnum):
    """The content of a line."""

    SCALAR = 0
    VECTOR = 1
    MATRIX = 2
    BUS = 3


def wire_marks(net: RoutedNet, kind: WireKind, title: str, tone: Tone) -> list[Mark]:
    """The lines of a net: thin for a scalar, thick for a vector, double for a matrix, triple for a bus."""
    marks: list[Mark] = []
    weight = (1.2, 2.3, 3.8, 5.4)[kind]
    lines = [rounded_path(_shortened(path, 5.0), net.dots) for path in net.paths if path]
    marks += [Curve(line, stroke=tone, width=weight) for line in lines]
    if kind is WireKind.MATRIX:
        marks += [Curve(line, stroke=Tone.SURFACE, width=1.5) for line in lines]
    if kind is WireKind.BUS:
        marks += [Curve(line, stroke=Tone.SURFACE, width=3.2) for line in lines]
        marks += [Curve(line, stroke=tone, width=1.0) for line in lines]
    marks += [arrow_head(path, tone) for path in net.paths if path]
    marks += [Disc(x, y, 2.6 + 0.3 * kind, fill=tone) for x, y in net.dots]
    return [Group(tuple(marks), title=title)]


def frame_line_marks(net: Net, routed: RoutedNet, title: str, name: str, tone: Tone) -> list[Mark]:
    """The lines of a frame: of equal width, without an arrow head, because a frame has no direction."""
    lines = [rounded_path(path, routed.dots) for path in routed.paths if path]
    marks: list[Mark] = [Curve(line, stroke=tone, width=1.8) for line in lines]
    marks += [Disc(x, y, 2.6, fill=tone) for x, y in routed.dots]
    return [Group(tuple(marks), title=f"frame of {title}"), *label_marks(net, routed, name, tone)]


def _shortened(path: tuple[Point, ...], by: float) -> tuple[Point, ...]:
    """The path without its last ``by`` px, which the arrow head covers."""
    (ax, ay), (bx, by_) = path[-2], path[-1]
    length = abs(bx - ax) + abs(by_ - ay)
    fraction = max(length - by, 0.0) / length if length else 0.0
    return (*path[:-1], (ax + (bx - ax) * fraction, ay + (by_ - ay) * fraction))


def rounded_path(path: tuple[Point, ...], dots: Sequence[Point] = ()) -> tuple[tuple[str | float, ...], ...]:
    """The path commands of segments with small round corners; corners at dots are sharp."""
    commands: list[tuple[str | float, ...]] = [("M", *path[0])]
    for before, corner, after in zip(path, path[1:], path[2:]):
        if corner in dots:
            commands.append(("L", *corner))
            continue
        radius = min(_ROUNDING, _distance(before, corner) / 2, _distance(corner, after) / 2)
        commands.append(("L", *_point_toward(corner, before, radius)))
        commands.append(("Q", *corner, *_point_toward(corner, after, radius)))
    commands.append(("L", *path[-1]))
    return tuple(commands)


def _distance(a: Point, b: Point) -> float:
    return abs(a[0] - b[0]) + abs(a[1] - b[1])


def _point_toward(a: Point, b: Point, length: float) -> Point:
    total = _distance(a, b)
    fraction = length / total if total else 0.0
    return a[0] + (b[0] - a[0]) * fraction, a[1] + (b[1] - a[1]) * fraction


def arrow_head(path: tuple[Point, ...], tone: Tone = Tone.WIRE) -> Mark:
    """The arrow head at the end of a path."""
    (ax, ay), (bx, by) = path[-2], path[-1]
    length = _distance((ax, ay), (bx, by)) or 1.0
    dx, dy = (bx - ax) / length, (by - ay) / length
    back = (bx - 8 * dx, by - 8 * dy)
    corners = [(bx, by), (back[0] - 3.7 * dy, back[1] + 3.7 * dx), (back[0] + 3.7 * dy, back[1] - 3.7 * dx)]
    return Polyline(corners, stroke=None, fill=tone, closed=True)


def label_marks(net: Net, routed: RoutedNet, name: str, tone: Tone = Tone.WIRE) -> list[Mark]:
    """The labels at both ends of wires without a line; equal labels are connected."""
    ends = [end for end, path in zip(net.targets, routed.paths) if not path]
    if not ends:
        return []
    return [
        *_label(net.source, 1, name, tone),
        *(mark for end in ends for mark in _label(end, -1, name, tone)),
    ]


def _label(end: WireEnd, side: int, name: str, tone: Tone) -> Sequence[Mark]:
    """A dashed stub and a frame with the name; ``side`` is 1 at a source and -1 at a target."""
    dx, dy = side * end.dx, side * end.dy
    x, y = end.x + LABEL_STUB * dx, end.y + LABEL_STUB * dy
    width = text_width(name, LABEL_SIZE) + 8
    left = x - width / 2 + dx * width / 2
    top = y - _LABEL_HEIGHT / 2 + dy * _LABEL_HEIGHT / 2
    frame = [
        (left, top),
        (left + width, top),
        (left + width, top + _LABEL_HEIGHT),
        (left, top + _LABEL_HEIGHT),
    ]
    return (
        Polyline([(end.x, end.y), (x, y)], stroke=tone, width=1.2, dash=(2.5, 2.0), sharp=True),
        Polyline(frame, stroke=tone, width=1.0, dash=(3.0, 2.0), fill=Tone.SURFACE, closed=True),
        Text(left + width / 2, top + 9.7, name, LABEL_SIZE, Tone.INK, "middle"),
    )
