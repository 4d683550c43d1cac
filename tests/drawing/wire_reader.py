"""Infers the connections of a sheet from the geometry of its lines, or reports why they are ambiguous.

The input has blocks, ports, anonymous lines, dots and labels, but neither nets nor routes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

Point = tuple[float, float]
NEAR = 2.0
"""Minimum distance of elements that can be distinguished, px."""
AT_PORT = 1.5
"""Maximum distance from the middle of a port of a line that ends at the port, px."""


@dataclass(frozen=True)
class Block:
    """A rectangle on the sheet."""

    x: float
    y: float
    width: float
    height: float

    def meets(self, a: Point, b: Point, margin: float) -> bool:
        """Whether a segment intersects the rectangle enlarged by ``margin``."""
        return (
            max(a[0], b[0]) > self.x - margin
            and min(a[0], b[0]) < self.x + self.width + margin
            and max(a[1], b[1]) > self.y - margin
            and min(a[1], b[1]) < self.y + self.height + margin
        )


@dataclass(frozen=True)
class Port:
    """A port: its block, its position, and the outward direction of its side."""

    block: str
    x: float
    y: float
    out: tuple[int, int]
    is_output: bool


@dataclass(frozen=True)
class Drawing:
    """The visible elements of a sheet; ``labels``: texts by port."""

    blocks: Mapping[str, Block]
    ports: Mapping[str, Port]
    lines: Sequence[Sequence[Point]]
    dots: Sequence[Point]
    labels: Mapping[str, str]


class AmbiguousError(AssertionError):
    """The connections cannot be inferred."""


def read(drawing: Drawing) -> dict[str, str]:
    """The output that drives each input, by port; raises ``AmbiguousError``."""
    for line in drawing.lines:
        _check_shape(line)
        _check_blocks(line, drawing)
    groups = _Groups([f"line {k}" for k in range(len(drawing.lines))] + list(drawing.ports))
    begins = _contacts(drawing, groups)
    for k, line in enumerate(drawing.lines):
        if (source := _port_at(line[0], drawing.ports)) is not None:
            groups.join(f"line {k}", source)
        elif k not in begins:
            raise AmbiguousError(f"line {k} begins nowhere: {line}")
        target = _port_at(line[-1], drawing.ports)
        if target is None:
            raise AmbiguousError(f"line {k} ends nowhere: {line}")
        groups.join(f"line {k}", target)
    _check_dots(drawing)
    for first, second in pairwise(sorted(drawing.labels, key=lambda port: drawing.labels[port])):
        if drawing.labels[first] == drawing.labels[second]:
            groups.join(first, second)
    return _drivers(drawing, groups)


def _drivers(drawing: Drawing, groups: _Groups) -> dict[str, str]:
    found: dict[str, str] = {}
    for members in groups.members():
        ports = [name for name in members if name in drawing.ports]
        sources = [name for name in ports if drawing.ports[name].is_output]
        targets = [name for name in ports if not drawing.ports[name].is_output]
        if targets and len(members) > 1:
            if len(sources) != 1:
                raise AmbiguousError(f"{targets} are driven by {sources}")
            found |= dict.fromkeys(targets, sources[0])
    return found


def _check_shape(line: Sequence[Point]) -> None:
    if len(line) < 2:
        raise AmbiguousError(f"no line: {line}")
    for a, b in pairwise(line):
        if (a[0] == b[0]) == (a[1] == b[1]):
            raise AmbiguousError(f"a segment is neither horizontal nor vertical: {a} {b}")
    segments = list(pairwise(line))
    for i, one in enumerate(segments):
        for j in range(i + 2, len(segments)):
            step = j == i + 2 and _same_direction(one, segments[j])
            if _gap(one, segments[j]) < NEAR and not step:
                raise AmbiguousError(f"a line meets itself: {line}")
        if i and _backwards(segments[i - 1], one):
            raise AmbiguousError(f"a line runs back on itself: {line}")


def _backwards(one: tuple[Point, Point], other: tuple[Point, Point]) -> bool:
    return (one[0][0] == one[1][0]) == (other[0][0] == other[1][0])


def _same_direction(one: tuple[Point, Point], other: tuple[Point, Point]) -> bool:
    return all((one[1][k] - one[0][k]) * (other[1][k] - other[0][k]) >= 0 for k in (0, 1))


def _check_blocks(line: Sequence[Point], drawing: Drawing) -> None:
    """Check the distance to other ports and blocks, and that the outer segments leave their blocks
    outwards."""
    segments = list(pairwise(line))
    for name, port in _nearby(line, drawing.ports).items():
        position = (port.x, port.y)
        for k, (a, b) in enumerate(segments):
            if (k == 0 and _is_at(port, a) and port.is_output) or (
                k == len(segments) - 1 and _is_at(port, b) and not port.is_output
            ):
                other = b if port.is_output else a
                along = (other[0] - port.x) * port.out[0] + (other[1] - port.y) * port.out[1]
                if along < NEAR:
                    raise AmbiguousError(f"a line does not leave {name} outwards: {line}")
            elif _gap((a, b), (position, position)) < NEAR:
                raise AmbiguousError(f"a line touches {name}: {line}")
    hull = [(f(p[0] for p in line), f(p[1] for p in line)) for f in (min, max)]
    for name, block in drawing.blocks.items():
        if not block.meets(hull[0], hull[1], NEAR):
            continue
        for k, (a, b) in enumerate(segments):
            at_own_port = (k == 0 and _is_of(name, a, drawing, is_output=True)) or (
                k == len(segments) - 1 and _is_of(name, b, drawing, is_output=False)
            )
            if block.meets(a, b, 0.0 if at_own_port else NEAR):
                raise AmbiguousError(f"a line runs under {name}: {line}")


def _nearby(line: Sequence[Point], ports: Mapping[str, Port]) -> dict[str, Port]:
    left, right = min(x for x, _ in line) - NEAR, max(x for x, _ in line) + NEAR
    top, bottom = min(y for _, y in line) - NEAR, max(y for _, y in line) + NEAR
    return {name: p for name, p in ports.items() if left < p.x < right and top < p.y < bottom}


def _is_of(block: str, point: Point, drawing: Drawing, *, is_output: bool) -> bool:
    return any(
        port.block == block and port.is_output == is_output and _is_at(port, point)
        for port in drawing.ports.values()
    )


def _port_at(point: Point, ports: Mapping[str, Port]) -> str | None:
    return next((name for name, port in ports.items() if _is_at(port, point)), None)


def _is_at(port: Port, point: Point) -> bool:
    """Whether a point is at a port, on the side of its block."""
    across, along = (point[1] - port.y, point[0] - port.x)[:: 1 if port.out[0] else -1]
    return along == 0.0 and abs(across) <= AT_PORT


def _contacts(drawing: Drawing, groups: _Groups) -> set[int]:
    """Join the lines that meet at dots; returns the lines that start on another line."""
    begins: set[int] = set()
    for (i, one), (j, other) in _close_segments(drawing.lines):
        first, second = drawing.lines[i], drawing.lines[j]
        for number, line, whole in ((i, first, other), (j, second, one)):
            if _gap(whole, (line[0], line[0])) == 0.0 and _dot_at(line[0], drawing.dots):
                groups.join(f"line {i}", f"line {j}")
                begins.add(number)
                break
        else:
            if not _crosses(one, other):
                raise AmbiguousError(f"lines touch: {one} of {first} and {other} of {second}")
            crossing = _crossing(one, other)
            if any(abs(x - crossing[0]) + abs(y - crossing[1]) < 2 * NEAR for x, y in drawing.dots):
                raise AmbiguousError(f"a dot is at a crossing: {crossing}")
    return begins


def _close_segments(
    lines: Sequence[Sequence[Point]],
) -> Iterator[tuple[tuple[int, tuple[Point, Point]], tuple[int, tuple[Point, Point]]]]:
    """Pairs of near segments of two different lines."""
    segments = [(k, segment) for k, line in enumerate(lines) for segment in pairwise(line)]
    if not segments:
        return
    boxes = np.array(
        [(min(a[0], b[0]), min(a[1], b[1]), max(a[0], b[0]), max(a[1], b[1])) for _, (a, b) in segments]
    )
    owner = np.array([k for k, _ in segments])
    near = (
        (boxes[:, None, 0] < boxes[None, :, 2] + NEAR)
        & (boxes[None, :, 0] < boxes[:, None, 2] + NEAR)
        & (boxes[:, None, 1] < boxes[None, :, 3] + NEAR)
        & (boxes[None, :, 1] < boxes[:, None, 3] + NEAR)
        & (owner[:, None] < owner[None, :])
    )
    for i, j in np.argwhere(near).tolist():
        yield segments[i], segments[j]


def _dot_at(point: Point, dots: Sequence[Point]) -> bool:
    return point in dots


def _crosses(one: tuple[Point, Point], other: tuple[Point, Point]) -> bool:
    """Whether two segments cross at a right angle, away from the ends of both."""
    if (one[0][0] == one[1][0]) == (other[0][0] == other[1][0]):
        return False
    point = _crossing(one, other)
    return all(
        min(abs(point[axis] - end[axis]) for end in segment) >= NEAR
        and min(end[axis] for end in segment) < point[axis] < max(end[axis] for end in segment)
        for segment in (one, other)
        for axis in (int(segment[0][0] == segment[1][0]),)
    )


def _crossing(one: tuple[Point, Point], other: tuple[Point, Point]) -> Point:
    upright, level = (one, other) if one[0][0] == one[1][0] else (other, one)
    return upright[0][0], level[0][1]


def _check_dots(drawing: Drawing) -> None:
    for x, y in drawing.dots:
        directions: set[tuple[bool, bool, bool, bool]] = set()
        for line in drawing.lines:
            for a, b in pairwise(line):
                if _gap((a, b), ((x, y), (x, y))) > 0.0:
                    continue
                for end in (a, b):
                    if end != (x, y):
                        directions.add((end[0] > x, end[0] < x, end[1] > y, end[1] < y))
        if len(directions) < 3:
            raise AmbiguousError(f"a dot at {(x, y)} joins {len(directions)} lines")


def _gap(one: tuple[Point, Point], other: tuple[Point, Point]) -> float:
    """The maximum norm of the distance of two segments, each horizontal, vertical or a point."""
    along = [
        max(min(one[0][k], one[1][k]), min(other[0][k], other[1][k]))
        - min(max(one[0][k], one[1][k]), max(other[0][k], other[1][k]))
        for k in (0, 1)
    ]
    return max(along[0], along[1], 0.0)


class _Groups:
    """Disjoint sets of names (union-find)."""

    def __init__(self, names: Iterable[str]) -> None:
        self._leader = {name: name for name in names}

    def join(self, one: str, other: str) -> None:
        """Put two names into one group."""
        self._leader[self._find(one)] = self._find(other)

    def _find(self, name: str) -> str:
        while self._leader[name] != name:
            name = self._leader[name]
        return name

    def members(self) -> list[list[str]]:
        """The groups."""
        drawn_wires: dict[str, list[str]] = {}
        for name in self._leader:
            drawn_wires.setdefault(self._find(name), []).append(name)
        return list(drawn_wires.values())
