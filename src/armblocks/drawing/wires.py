"""Data types of the wires of a sheet: obstacles, wire ends, nets, and routed nets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armblocks.drawing.wire_search import Point

Area = tuple[float, float, float, float]
"""Left, upper, right and lower edge of a rectangle, px."""


@dataclass(frozen=True)
class Obstacle:
    """A block (px) and the rectangle of its name, which wires avoid if possible: x, y, width, height."""

    x: float
    y: float
    width: float
    height: float
    label: tuple[float, float, float, float]

    @property
    def areas(self) -> tuple[Area, Area]:
        """The areas of the block and of its name."""
        x, y, width, height = self.label
        return (
            (self.x, self.y, self.x + self.width, self.y + self.height),
            (x, y, x + width, y + height),
        )


@dataclass(frozen=True)
class WireEnd:
    """The end of a wire at a block: position (px) and direction of the signal."""

    x: float
    y: float
    dx: int
    dy: int


@dataclass(frozen=True)
class Net:
    """One source and all its targets."""

    source: WireEnd
    targets: tuple[WireEnd, ...]
    bends: tuple[tuple[float, ...], ...] = ()
    """The user-drawn route for each target, see :func:`drawn_path`; empty for automatic routing."""


def moved_bends(bends: Sequence[float], flat: bool, shift: tuple[float, float]) -> tuple[float, ...]:
    """A user-drawn route after a shift of its blocks; ``flat``: it leaves its source horizontally."""
    return tuple(value + shift[(k + flat + 1) % 2] for k, value in enumerate(bends))


@dataclass(frozen=True)
class RoutedNet:
    """The route of a net.

    ``paths``: for each target the corner points from the source or a branch point to the target. An empty
    path means that no legal route exists: labels at the source and at this target replace the line. ``dots``:
    where lines branch.
    """

    paths: tuple[tuple[Point, ...], ...]
    dots: tuple[Point, ...]


def drawn_path(source: WireEnd, bends: Sequence[float], target: WireEnd) -> tuple[Point, ...] | None:
    """The corner points of the user-drawn route with these ``bends``; ``None`` if there is no such route.

    ``bends`` has the coordinate (px) of each inner segment: x, y, x … for a wire that leaves its source
    horizontally. The first and the last segment follow their ports, so that the route stays connected when
    blocks move. The result is ``None`` without bends, and where the last segment would not have the direction
    of its port, after the rotation of a block.
    """
    x, y, flat = source.x, source.y, source.dx != 0
    points: list[Point] = [(x, y)]
    for value in bends:
        x, y = (value, y) if flat else (x, value)
        points.append((x, y))
        flat = not flat
    if not bends or flat != (target.dx == 0):
        return None
    points.append((target.x, y) if flat else (x, target.y))
    return corners([*points, (target.x, target.y)])


def corners(points: Sequence[Point]) -> tuple[Point, ...]:
    """The points without repetitions and without points on a straight line between their neighbours."""
    result: list[Point] = []
    for point in points:
        if result and point == result[-1]:
            continue
        if len(result) > 1:
            (ax, ay), (bx, by) = result[-2], result[-1]
            if (ax == bx == point[0]) or (ay == by == point[1]):
                result[-1] = point
                continue
        result.append(point)
    return tuple(result)
