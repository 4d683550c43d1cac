"""Wires of a sheet as data: blocks in the way, ends, nets, and the lines that are drawn of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armblocks.drawing.wire_search import Point


@dataclass(frozen=True)
class Obstacle:
    """A block (px) and the rectangle of its name, which wires avoid if they can: x, y, width, height."""

    x: float
    y: float
    width: float
    height: float
    label: tuple[float, float, float, float]


@dataclass(frozen=True)
class WireEnd:
    """Where a wire meets a block, and the direction of the signal there."""

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
    """The user-drawn route for each target, see :func:`bent`; empty for automatic routing."""


def moved_bends(bends: Sequence[float], flat: bool, shift: tuple[float, float]) -> tuple[float, ...]:
    """A user-drawn route whose blocks have moved by ``shift``; ``flat``: it leaves its source sideways."""
    return tuple(value + shift[(k + flat + 1) % 2] for k, value in enumerate(bends))


@dataclass(frozen=True)
class RoutedNet:
    """The drawn lines of a net.

    ``paths``: for each target the corner points from the source or a branch point to the target. A path
    without points means that there is no room for a line: the source and this target carry labels instead.
    ``dots``: where lines branch.
    """

    paths: tuple[tuple[Point, ...], ...]
    dots: tuple[Point, ...]


def bent(source: WireEnd, bends: Sequence[float], target: WireEnd) -> tuple[Point, ...] | None:
    """The corner points of a way along ``bends``, the coordinates of its straight pieces in turn (px).

    Of a wire that leaves to the side these are x, y, x …; the first and the last piece go with their ports,
    so the way holds together wherever blocks are moved. ``None`` where there are no bends, or where the last
    piece would not run in the direction of its port (a block was turned).
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
    """The points without repetitions and without those on a straight line between their neighbours."""
    kept: list[Point] = []
    for point in points:
        if kept and point == kept[-1]:
            continue
        if len(kept) > 1:
            (ax, ay), (bx, by) = kept[-2], kept[-1]
            if (ax == bx == point[0]) or (ay == by == point[1]):
                kept[-1] = point
                continue
        kept.append(point)
    return tuple(kept)
