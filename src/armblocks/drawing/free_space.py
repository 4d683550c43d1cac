"""The free space for wires between blocks and other nets, and the cost of routes in it.

Hard rules keep a drawing unambiguous: a distance to blocks, and a distance between a line and the corners,
ports, dots and parallel lines of other nets. ``LEVELS`` lists these distances from wide to narrow; with the
narrowest ones lines can still be distinguished. Costs prefer short lines with few bends and few crossings,
away from block names.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, TypeAlias

import numpy as np

from armblocks.drawing.wire_search import (
    BEND,
    BLOCKED,
    Booleans,
    Floats,
    Grid,
    Point,
    edge_weights,
    grid_lines,
)

Extent: TypeAlias = tuple[float, float, float, float]
Segment: TypeAlias = tuple[Point, Point]

RESERVED = 5.0
"""Distance before a port that is reserved for its net, px."""
_CROSSING = 26.0
_BRANCH = 20.0
_NEAR = 9.5
_NEAR_COST = 2.0
_LABEL_COST = 9.0
_BLOCK_MARGIN = 18.0
_BLOCK_MARGIN_COST = 0.25
_APPROACH = 46.0
_APPROACH_COST = 4.0
"""Distance before a port that other nets avoid, px, and the additional cost per px there."""
_MIDDLE_COST = 1 / 16
_ACCEPTED_DETOUR = 64.0
"""Detour that is accepted without a search in a wider window, px: about a bend and a crossing."""
_ON_EDGE = 1e-6


@dataclass(frozen=True)
class Level:
    """Distances in px: length of stubs, distances to blocks and to other nets, lanes beside blocks and
    wires."""

    stub: float
    clearance: float
    gap: float
    block_lanes: tuple[float, ...]
    wire_lane: float
    line_spacing: float
    """Minimum distance of grid lines."""
    window: float
    """Margin of the search window around the ends of a wire."""
    detour: float
    """Accepted relative excess over the lower bound of the cost; beyond it, the next window is searched."""

    def max_cost(self, lower_bound: float) -> float:
        """The maximum accepted cost of a route whose lower bound is ``lower_bound``."""
        return lower_bound + _ACCEPTED_DETOUR + self.detour * (lower_bound + 200.0)


LEVELS = (
    Level(13.0, 8.0, 7.5, (13.0, 23.0), 10.0, 4.0, 12.0, 0.0),
    Level(13.0, 8.0, 7.5, (13.0, 23.0), 10.0, 4.0, 70.0, 1.0),
    Level(13.0, 8.0, 7.5, (13.0, 23.0), 10.0, 4.0, 260.0, np.inf),
    Level(9.0, 6.0, 5.0, (8.0, 15.0), 7.0, 2.0, 260.0, np.inf),
    Level(5.0, 4.0, 4.0, (5.0, 11.0), 5.0, 2.0, 260.0, np.inf),
)


class End(Protocol):
    """A port, and the direction of the signal there."""

    @property
    def x(self) -> float: ...
    @property
    def y(self) -> float: ...
    @property
    def dx(self) -> int: ...
    @property
    def dy(self) -> int: ...


def areas_overlap(a: Extent, b: Extent) -> bool:
    """Whether two areas have a point in common."""
    return a[0] <= b[2] and b[0] <= a[2] and a[1] <= b[3] and b[1] <= a[3]


def extents(segments: Floats, *, at_ports: bool = False) -> list[Extent]:
    """The areas in which segments influence other nets; ``at_ports``: the segments are reserved for ports."""
    x0, y0, x1, y1 = _enlarged(segments, _APPROACH if at_ports else _NEAR).T.tolist()
    return list(zip(x0, y0, x1, y1))


def sorted_ends(segments: Floats) -> Floats:
    """Segments (n, 4) from the upper left to the lower right end."""
    return np.hstack(
        [np.minimum(segments[:, :2], segments[:, 2:]), np.maximum(segments[:, :2], segments[:, 2:])]
    )


class FreeSpace:
    """The blocks of a sheet, and the lines of routed nets."""

    def __init__(self, sides: Sequence[Sequence[float]]) -> None:
        rectangles = np.array(sides, dtype=np.float64).reshape(-1, 8)
        self._blocks, self._names = rectangles[:, :4], rectangles[:, 4:]
        low = np.minimum(self._blocks[:, :2], self._names[:, :2]) - _BLOCK_MARGIN
        high = np.maximum(self._blocks[:, 2:], self._names[:, 2:]) + _BLOCK_MARGIN
        self._extents = np.hstack([low, high])
        self._segments = np.empty((0, 4))
        self._owners = np.empty(0, dtype=np.int64)
        self._count = 0

    def extent(self, k: int) -> Extent:
        """The area around a block in which it influences routes."""
        x0, y0, x1, y1 = self._extents[k].tolist()
        return x0, y0, x1, y1

    def reserve(self, ends: Sequence[tuple[Floats, int]]) -> None:
        """Remove all lines, and reserve the space before the ports of every net."""
        self._segments = np.vstack([np.empty((0, 4)), *(segments for segments, _ in ends)])
        owners = [number for segments, number in ends for _ in range(len(segments))]
        self._owners = np.array(owners, dtype=np.int64)
        self._approaches = self._count = len(self._segments)

    def add_net(self, segments: Floats, number: int) -> None:
        """Add the segments (n, 4) of a net, see :func:`sorted_ends`."""
        begin, end = self._count, self._count + len(segments)
        while end > len(self._segments):  # double the capacity
            self._segments = np.vstack([self._segments, np.empty_like(self._segments)])
            self._owners = np.hstack([self._owners, np.empty_like(self._owners)])
        self._segments[begin:end] = segments
        self._owners[begin:end] = number
        self._count = end

    def around(self, extent: Extent, number: int) -> Surroundings:
        """The blocks in an area, and the lines in it of all nets but one (``number``)."""
        segments = self._segments[: self._count]
        foreign = _inside(segments, extent, _NEAR) & (self._owners[: self._count] != number)
        blocks = _inside(self._extents, extent, 0.0)
        ahead = _inside(segments[: self._approaches], extent, _APPROACH)
        ahead &= self._owners[: self._approaches] != number
        return Surroundings(
            extent,
            self._blocks[blocks],
            self._names[blocks],
            segments[foreign],
            segments[: self._approaches][ahead],
        )


def _inside(areas: Floats, extent: Extent, margin: float) -> Booleans:
    return (
        (areas[:, 0] <= extent[2] + margin)
        & (areas[:, 2] >= extent[0] - margin)
        & (areas[:, 1] <= extent[3] + margin)
        & (areas[:, 3] >= extent[1] - margin)
    )


def _enlarged(areas: Floats, margin: float) -> Floats:
    return areas + np.array([-margin, -margin, margin, margin])


def _intersects_any(areas: Floats, line: Floats) -> bool:
    """Whether a line, from its upper left to its lower right end, intersects one of these open areas."""
    return bool(
        np.any(
            (areas[:, 0] < line[2])
            & (areas[:, 2] > line[0])
            & (areas[:, 1] < line[3])
            & (areas[:, 3] > line[1])
        )
    )


def _sorted_line(line: Sequence[float]) -> Floats:
    x0, y0, x1, y1 = line
    return np.array([min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1)])


class Surroundings:
    """The blocks and the lines of other nets in an area, and the search for routes of one net in it."""

    def __init__(self, extent: Extent, blocks: Floats, names: Floats, segments: Floats, ends: Floats) -> None:
        self._extent = extent
        self._blocks = blocks
        self._names = names
        self._segments = segments
        level = segments[:, 1] == segments[:, 3]
        self._level, self._upright = segments[level], segments[~level]
        self._ends = ends
        self._corners = np.vstack([segments[:, [0, 1, 0, 1]], segments[:, [2, 3, 2, 3]]])

    def is_legal_stub(self, line: Sequence[float], level: Level, port: Point, out: tuple[int, int]) -> bool:
        """Whether a stub at a port is legal; the block of the port is ignored, and lines may cross the other
        end."""
        return self._is_clear(line, level, [(port, out)]) and self.may_bend(port, level)

    def is_legal(
        self, line: Sequence[float], level: Level, ports: Sequence[tuple[Point, tuple[int, int]]]
    ) -> bool:
        """Whether a segment is legal; the blocks of the ports at its ends are ignored."""
        ends = (line[0], line[1]), (line[2], line[3])
        return self._is_clear(line, level, ports) and all(self.may_bend(end, level) for end in ends)

    def _is_clear(
        self, line: Sequence[float], level: Level, ports: Sequence[tuple[Point, tuple[int, int]]]
    ) -> bool:
        """Whether a segment crosses other lines only at right angles and away from their corners."""
        segment = _sorted_line(line)
        blocks = self._blocks
        for port, out in ports:
            blocks = blocks[~_owns(blocks, port, out)]
        along = self._level if line[1] == line[3] else self._upright
        return not (
            _intersects_any(_enlarged(blocks, level.clearance), segment)
            or _intersects_any(_enlarged(along, level.gap), segment)
            or _intersects_any(_enlarged(self._corners, level.gap), segment)
        )

    def is_free(
        self, line: Sequence[float], level: Level, ports: Sequence[tuple[Point, tuple[int, int]]]
    ) -> bool:
        """Whether a straight line is legal and intersects nothing, so that no other route is better."""
        segment = _sorted_line(line)
        if _intersects_any(_enlarged(self._names, 3.0), segment) or _intersects_any(
            _enlarged(self._segments, _NEAR), segment
        ):
            return False
        return self.is_legal(line, level, ports)

    def may_bend(self, point: Point, level: Level) -> bool:
        """Whether a corner or a dot at this point is legal."""
        return not _intersects_any(_enlarged(self._segments, level.gap), np.array([*point, *point]))

    def path(self, source: End, start: Point, goal: Point, target: End, level: Level) -> list[Point]:
        """The corners of the cheapest route between the stubs of the source and the target."""
        own_segments: list[Segment] = [((source.x, source.y), start), (goal, (target.x, target.y))]
        grid = self._grid(own_segments, [], level, (start, goal) if source.dx else None)
        start_costs = np.full(grid.may_bend.shape, np.inf)
        start_costs[grid.node(start)] = 0.0
        infinite = np.full(grid.may_bend.shape, np.inf)
        rightwards, downwards = (start_costs, infinite) if source.dx else (infinite, start_costs)
        max_cost = level.max_cost(_cost_bound(source, start, goal, target))
        return grid.cheapest(rightwards, downwards, grid.node(goal), max_cost, flat=target.dx != 0)

    def branch(
        self,
        tree: Sequence[Segment],
        closed: Sequence[Point],
        dots: Sequence[Point],
        goal: Point,
        target: End,
        level: Level,
    ) -> list[Point]:
        """The corners of the cheapest route from the lines of the net itself to a target's stub.

        No route starts at one of the ``dots``, or near one of the ``closed`` points.
        """
        grid = self._grid([(goal, (target.x, target.y))], tree, level, None)
        on_tree = np.zeros(grid.may_bend.shape, dtype=np.bool_)
        for a, b in tree:
            (top, left), (bottom, right) = sorted((grid.node(a), grid.node(b)))
            on_tree[top : bottom + 1, left : right + 1] = True
        rows, columns = np.nonzero(on_tree & grid.may_bend)

        def distances(points: Sequence[Point]) -> Floats:
            xs, ys = np.array(points).reshape(-1, 2).T
            return np.abs(grid.xs[columns][:, None] - xs) + np.abs(grid.ys[rows][:, None] - ys)

        away = distances([point for segment in tree for point in segment])
        free = np.all(distances(closed) >= level.stub, axis=1) & np.all(distances(dots) > 0.0, axis=1)
        free &= np.all((away == 0.0) | (away >= level.gap), axis=1)
        if not np.any(free):
            return []
        start_costs = np.full(grid.may_bend.shape, np.inf)
        start_costs[rows[free], columns[free]] = _BRANCH
        max_cost = level.max_cost(_BRANCH + float(np.min(distances([goal])[free])))
        return grid.cheapest(start_costs, start_costs, grid.node(goal), max_cost, flat=target.dx != 0)

    # -- the grid --------------------------------------------------------------------------------------------

    def _grid(
        self,
        stubs: Sequence[Segment],
        tree: Sequence[Segment],
        level: Level,
        middle: tuple[Point, Point] | None,
    ) -> Grid:
        """The grid of an area. Routes of the net avoid its own ``stubs`` and start on its ``tree``."""
        xs, ys = self._lines([*stubs, *tree], level, middle)
        own_segments = np.array([_sorted_line((*a, *b)) for a, b in (*stubs, *tree)]).reshape(-1, 4)
        solid = np.array([_sorted_line((*a, *b)) for a, b in stubs]).reshape(-1, 4)
        flat = own_segments[:, 1] == own_segments[:, 3]
        unchanged, transposed = [0, 2, 1, 3], [1, 3, 0, 2]
        right, down = (
            self._edges(order, lines, across, own_segments[along], solid, level)
            for order, lines, across, along in ((unchanged, xs, ys, flat), (transposed, ys, xs, ~flat))
        )
        if middle is not None:
            (ax, _), (bx, _) = middle
            half = max(abs(bx - ax) / 2, 1.0)
            off = np.minimum(np.abs(xs - (ax + bx) / 2) / half, 1.0)
            down += np.diff(ys)[:, None] * (off * _MIDDLE_COST)
        near = _enlarged(self._segments, level.gap)
        rows = (ys[:, None] > near[:, 1]) & (ys[:, None] < near[:, 3])
        columns = (xs > near[:, 0, None]) & (xs < near[:, 2, None])
        may_bend = rows.astype(np.float64) @ columns.astype(np.float64) == 0.0
        return Grid(xs, ys, right, down, may_bend)

    def _lines(
        self, own_segments: Sequence[Segment], level: Level, middle: tuple[Point, Point] | None
    ) -> tuple[Floats, Floats]:
        x0, y0, x1, y1 = self._extent
        exact_x = [x for segment in own_segments for x, _ in segment]
        exact_y = [y for segment in own_segments for _, y in segment]
        lanes = np.array(level.block_lanes)[:, None]
        tops = np.minimum(self._blocks[:, 1], self._names[:, 1])
        bottoms = np.maximum(self._blocks[:, 3], self._names[:, 3])
        below = lanes - 5.0 if level is not LEVELS[-1] else lanes
        candidates_x = [self._blocks[:, 0] - lanes, self._blocks[:, 2] + lanes]
        candidates_y = [tops - lanes, bottoms + below]
        if level is LEVELS[-1]:
            candidates_y += [self._blocks[:, 1] - lanes, self._blocks[:, 3] + lanes]
        for segments, candidates, k in ((self._upright, candidates_x, 0), (self._level, candidates_y, 1)):
            candidates += [segments[:, k] - level.wire_lane, segments[:, k] + level.wire_lane]
        if middle is not None:
            candidates_x.append(np.array([round((middle[0][0] + middle[1][0]) / 2)]))
        lanes_x = np.concatenate([part.ravel() for part in candidates_x])
        lanes_y = np.concatenate([part.ravel() for part in candidates_y])
        return (
            grid_lines(exact_x, lanes_x[(lanes_x >= x0) & (lanes_x <= x1)].tolist(), level.line_spacing),
            grid_lines(exact_y, lanes_y[(lanes_y >= y0) & (lanes_y <= y1)].tolist(), level.line_spacing),
        )

    def _edges(
        self,
        order: list[int],
        line: Floats,
        levels: Floats,
        own_segments: Floats,
        solid: Floats,
        level: Level,
    ) -> Floats:
        """Costs of the edges of parallel grid lines; ``order`` permutes rectangles to (along, across)."""
        begin, _, low, high = order
        along = self._level if begin == 0 else self._upright
        across = self._upright if begin == 0 else self._level
        ends = self._ends[self._ends[:, low] == self._ends[:, high]]
        areas = (
            (_enlarged(self._blocks, level.clearance), BLOCKED, 0.0),
            (_enlarged(along, level.gap), BLOCKED, 0.0),
            (_enlarged(self._corners, level.gap), BLOCKED, 0.0),
            (_enlarged_along(own_segments, level.gap, low), BLOCKED, 0.0),
            (_enlarged_along(solid, _ON_EDGE, begin), BLOCKED, 0.0),
            (_enlarged_along(across, _ON_EDGE, begin, 0.0), _CROSSING, 0.0),
            (_enlarged(self._blocks, _BLOCK_MARGIN), 0.0, _BLOCK_MARGIN_COST),
            (_enlarged(self._names, 3.0), 0.0, _LABEL_COST),
            (_enlarged(along, _NEAR), 0.0, _NEAR_COST),
            (_enlarged_along(_enlarged_along(ends, _APPROACH, begin), 6.0, low), 0.0, _APPROACH_COST),
        )
        weights = np.repeat([area[1:] for area in areas], [len(area[0]) for area in areas], axis=0)
        rectangles = np.vstack([area[0] for area in areas])[:, order]
        fixed, per_px = edge_weights(rectangles, weights, line, levels)
        return np.diff(line)[:, None] * (1.0 + per_px) + fixed


def _enlarged_along(areas: Floats, margin: float, axis: int, other: float | None = None) -> Floats:
    """Areas enlarged along one axis: by ``margin`` below, by ``other`` (by default ``margin``) above."""
    enlarged = areas.copy()
    enlarged[:, axis] -= margin
    enlarged[:, axis + 2] += margin if other is None else other
    return enlarged


def _cost_bound(source: End, start: Point, goal: Point, target: End) -> float:
    """The lower bound of the cost of a route: its cost without obstacles."""
    across, down = abs(goal[0] - start[0]), abs(goal[1] - start[1])
    if (source.dx != 0) != (target.dx != 0):
        return across + down + BEND
    return across + down + (2 * BEND if (down if source.dx else across) else 0.0)


def _owns(blocks: Floats, port: Point, out: tuple[int, int]) -> Booleans:
    """The block that has a port on its side; no block if several overlap there."""
    (x, y), (dx, dy) = port, out
    edge = blocks[:, (0 if dx < 0 else 2) if dx else (1 if dy < 0 else 3)]
    beside = (blocks[:, 1] <= y) & (y <= blocks[:, 3]) if dx else (blocks[:, 0] <= x) & (x <= blocks[:, 2])
    owners = beside & (np.abs(edge - (x if dx else y)) < _ON_EDGE)
    return owners if np.count_nonzero(owners) == 1 else np.zeros(len(blocks), dtype=np.bool_)
