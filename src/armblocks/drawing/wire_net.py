"""Routes one net between routed nets: user-drawn routes first, then targets by distance."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from armblocks.drawing.free_space import LEVELS, Extent, FreeSpace, Level, Surroundings, sorted_ends
from armblocks.drawing.wire_search import Floats, Point
from armblocks.drawing.wires import Net, RoutedNet, WireEnd, corners, drawn_path

_EXAMINED_DISTANCE = 12.0
"""The legality of a line depends on objects within this distance, px."""


@dataclass(frozen=True)
class NetRoute:
    """A routed net, its segments (n, 4), and the area on which its route depends."""

    net: Net
    routed: RoutedNet
    segments: Floats
    examined: Extent


class NetRouter:
    """Routes one net, target by target."""

    def __init__(self, space: FreeSpace, net: Net, number: int) -> None:
        self._space = space
        self._net = net
        self._number = number
        self._tree: list[tuple[Point, Point]] = []
        self._dots: list[Point] = []
        self._examined: Extent = (np.inf, np.inf, -np.inf, -np.inf)

    def route(self) -> NetRoute:
        """Route all targets: user-drawn routes first, then all other targets by distance from the source."""
        net = self._net
        paths: dict[int, tuple[Point, ...]] = {}
        for k, (target, bends) in enumerate(zip(net.targets, net.bends)):
            if (drawn := drawn_path(net.source, bends, target)) and (path := self._user_drawn(drawn, target)):
                paths[k] = path
        origin = net.source

        def distance(k: int) -> tuple[float, int]:
            return abs(net.targets[k].x - origin.x) + abs(net.targets[k].y - origin.y), k

        for k in sorted(set(range(len(net.targets))) - set(paths), key=distance):
            paths[k] = self._route(net.targets[k])
        routed = RoutedNet(tuple(paths[k] for k in range(len(net.targets))), tuple(sorted(self._dots)))
        segments = sorted_ends(np.array([(*a, *b) for a, b in self._tree]).reshape(-1, 4))
        return NetRoute(net, routed, segments, self._examined)

    def _route(self, target: WireEnd) -> tuple[Point, ...]:
        for level in LEVELS:
            path = self._route_at_level(target, level)
            if path:
                self._add(path)
                return path
        return ()

    def _route_at_level(self, target: WireEnd, level: Level) -> tuple[Point, ...]:
        source, end = self._net.source, (target.x, target.y)
        if not self._tree and _is_straight(source, target):
            line = (source.x, source.y, target.x, target.y)
            extent = _enlarged(_bounds([line[:2], line[2:]]), _EXAMINED_DISTANCE + level.clearance)
            self._examine(extent)
            ports = [((source.x, source.y), (source.dx, source.dy)), (end, (-target.dx, -target.dy))]
            if self._space.around(extent, self._number).is_free(line, level, ports):
                return (source.x, source.y), end
        start, goal = _source_stub_end(source, level.stub), _target_stub_start(target, level.stub)
        points = [
            start,
            goal,
            (source.x, source.y),
            end,
            *(point for segment in self._tree for point in segment),
        ]
        extent = _enlarged(_bounds(points), level.window)
        self._examine(extent)
        surroundings = self._space.around(extent, self._number)
        if not surroundings.is_legal_stub((*goal, *end), level, end, (-target.dx, -target.dy)):
            return ()
        route: list[Point]
        if self._tree:
            route = surroundings.branch(self._tree, self._ports(), self._dots, goal, target, level)
        else:
            port = (source.x, source.y)
            if not surroundings.is_legal_stub((*port, *start), level, port, (source.dx, source.dy)):
                return ()
            route = surroundings.path(source, start, goal, target, level)
            if route:
                route.insert(0, port)
        return self._without_loops(corners([*route, end]), surroundings, level) if route else ()

    def _without_loops(
        self, path: tuple[Point, ...], surroundings: Surroundings, level: Level
    ) -> tuple[Point, ...]:
        """A path that meets neither itself nor the tree after its start; empty if this is not legal."""
        direct = _cut_loops(path)
        if self._tree:
            direct = self._after_tree(direct)
        if direct == path:
            return path
        new_corners = [point for point in direct[:-1] if point not in path]
        if self._tree and direct[0] not in new_corners:
            new_corners.append(direct[0])
        is_legal = all(
            surroundings.may_bend(point, level)
            and point not in self._dots
            and all(_distance(point, port) >= level.stub for port in self._ports())
            for point in new_corners
        )
        return direct if is_legal else ()

    def _ports(self) -> list[Point]:
        return [(end.x, end.y) for end in (self._net.source, *self._net.targets)]

    def _user_drawn(self, path: tuple[Point, ...], target: WireEnd) -> tuple[Point, ...]:
        """Add a user-drawn path from its last point on the routed tree; empty if it is not legal."""
        extent = _enlarged(_bounds(path), _EXAMINED_DISTANCE)
        self._examine(extent)
        source, level = self._net.source, LEVELS[-1]
        if not (_is_along(path[0], path[1], source) and _is_along(path[-2], path[-1], target)):
            return ()
        if _meets_itself(path, level.gap):
            return ()
        surroundings = self._space.around(extent, self._number)
        for k, (a, b) in enumerate(pairwise(path)):
            ends: list[tuple[Point, tuple[int, int]]] = []
            if k == 0:
                ends.append((path[0], (source.dx, source.dy)))
            if k == len(path) - 2:
                ends.append((path[-1], (-target.dx, -target.dy)))
            if not surroundings.is_legal((*a, *b), level, ends):
                return ()
        path = self._after_tree(path)
        if len(path) < 2:
            return ()
        if self._tree and not (
            surroundings.may_bend(path[0], level) and self._is_apart_from_tree(path, level.gap)
        ):
            return ()
        self._add(path)
        return path

    def _after_tree(self, path: tuple[Point, ...]) -> tuple[Point, ...]:
        """The part of a path after it last touches the tree."""
        for k in range(len(path) - 2, -1, -1):
            touched = [
                point for segment in self._tree for point in _contacts((path[k], path[k + 1]), segment)
            ]
            if touched:
                last = min(touched, key=lambda point: _distance(point, path[k + 1]))
                return corners([last, *path[k + 1 :]])
        return path

    def _is_apart_from_tree(self, path: Sequence[Point], gap: float) -> bool:
        """Whether a path that starts on the tree has the distance ``gap`` to all other points of the tree."""
        return all(
            (k == 0 and path[0] in _contacts(segment, (path[0], path[0])))
            or _separation((a, b), segment) >= gap
            for k, (a, b) in enumerate(pairwise(path))
            for segment in self._tree
        )

    def _add(self, path: tuple[Point, ...]) -> None:
        if self._tree:
            self._dots.append(path[0])
        self._tree += pairwise(path)

    def _examine(self, extent: Extent) -> None:
        a, b = self._examined, extent
        self._examined = min(a[0], b[0]), min(a[1], b[1]), max(a[2], b[2]), max(a[3], b[3])


def _is_straight(source: WireEnd, target: WireEnd) -> bool:
    """Whether a straight line can connect a source and a target."""
    if (source.dx, source.dy) != (target.dx, target.dy):
        return False
    along = (target.x - source.x) * source.dx + (target.y - source.y) * source.dy
    across = (target.x - source.x) * source.dy + (target.y - source.y) * source.dx
    return across == 0 and along >= 2 * LEVELS[-1].gap


def _is_along(a: Point, b: Point, end: WireEnd) -> bool:
    """Whether a segment has the direction of the signal at an end, and at least the length of a stub."""
    return (b[0] - a[0]) * end.dx + (b[1] - a[1]) * end.dy >= LEVELS[-1].stub


def _meets_itself(path: Sequence[Point], gap: float) -> bool:
    """Whether segments of a path without a common corner are closer than ``gap``.

    A short step between two segments in the same direction is legal: the line does not run back.
    """
    segments = list(pairwise(path))
    return any(
        _separation(segments[i], segments[j]) < gap
        and not (j == i + 2 and _have_same_direction(segments[i], segments[j]))
        for j in range(len(segments))
        for i in range(j - 1)
    )


def _have_same_direction(one: tuple[Point, Point], other: tuple[Point, Point]) -> bool:
    (ax, ay), (bx, by) = one
    (cx, cy), (dx, dy) = other
    return (bx - ax) * (dx - cx) + (by - ay) * (dy - cy) > 0


def _separation(one: tuple[Point, Point], other: tuple[Point, Point]) -> float:
    """The maximum norm of the distance of two segments, each horizontal or vertical."""
    return max(
        max(min(one[0][k], one[1][k]), min(other[0][k], other[1][k]))
        - min(max(one[0][k], one[1][k]), max(other[0][k], other[1][k]))
        for k in (0, 1)
    )


def _cut_loops(path: tuple[Point, ...]) -> tuple[Point, ...]:
    """The path without the loops between two of its points at the same place."""
    for i in range(len(path) - 1):
        for j in range(len(path) - 2, i + 1, -1):
            touched = _contacts((path[i], path[i + 1]), (path[j], path[j + 1]))
            if touched:
                return _cut_loops(corners([*path[: i + 1], touched[0], *path[j + 1 :]]))
    return path


def _contacts(one: tuple[Point, Point], other: tuple[Point, Point]) -> list[Point]:
    """The ends of the intersection of two segments, each horizontal or vertical."""
    (ax, ay), (bx, by) = one
    (cx, cy), (dx, dy) = other
    left, right = max(min(ax, bx), min(cx, dx)), min(max(ax, bx), max(cx, dx))
    top, bottom = max(min(ay, by), min(cy, dy)), min(max(ay, by), max(cy, dy))
    return [(left, top), (right, bottom)] if left <= right and top <= bottom else []


def _distance(a: Point, b: Point) -> float:
    return abs(a[0] - b[0]) + abs(a[1] - b[1])


def _source_stub_end(end: WireEnd, stub: float) -> Point:
    """The end of the stub of a wire that leaves a port."""
    return end.x + stub * end.dx, end.y + stub * end.dy


def _target_stub_start(end: WireEnd, stub: float) -> Point:
    """The start of the stub of a wire that enters a port."""
    return end.x - stub * end.dx, end.y - stub * end.dy


def _bounds(points: Iterable[Point]) -> Extent:
    xs, ys = zip(*points)
    return min(xs), min(ys), max(xs), max(ys)


def _enlarged(extent: Extent, margin: float) -> Extent:
    return extent[0] - margin, extent[1] - margin, extent[2] + margin, extent[3] + margin
