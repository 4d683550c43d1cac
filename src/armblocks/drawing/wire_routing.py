"""Orthogonal wires around blocks: a sparse grid, A* with a price for bends, nets that share their stem.

Grid lines run beside every block and through every port, so the search is small for every sheet size (Hanan
1966 shows that such a grid contains a shortest rectilinear tree). A wire of a net may branch anywhere from
its net, and never overlaps another net's wire.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

Point = tuple[float, float]
Node = tuple[int, int]

CLEARANCE = 8.0
"""Minimum distance of a wire from other blocks, px."""
_STUB = 13.0
_LANES = (13.0, 23.0, 33.0)
_BEND = 34.0
_BRANCH = 20.0
_CROSSING = 26.0
_NEAR = 7.0
_NEAR_PRICE = 3.0
_LABEL_PRICE = 9.0
_RESERVED = 46.0
_RESERVED_PRICE = 5.0


@dataclass(frozen=True)
class Obstacle:
    """A block (px) and the rectangle of its name, which wires avoid if they can: x, y, width, height."""

    x: float
    y: float
    width: float
    height: float
    label: tuple[float, float, float, float]

    @property
    def top(self) -> float:
        """Upper edge of block and name together."""
        return min(self.y, self.label[1])

    @property
    def bottom(self) -> float:
        """Lower edge of block and name together."""
        return max(self.y + self.height, self.label[1] + self.label[3])


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

    def drawn(self) -> dict[WireEnd, tuple[Point, ...]]:
        """The valid user-drawn routes."""
        found: dict[WireEnd, tuple[Point, ...]] = {}
        for target, bends in zip(self.targets, self.bends):
            if (path := bent(self.source, bends, target)) is not None:
                found[target] = path
        return found


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
    return _corners([*points, (target.x, target.y)])


@dataclass(frozen=True)
class RoutedNet:
    """Paths from stem or branch point to each target (corner points), and the dots where wires branch."""

    paths: tuple[tuple[Point, ...], ...]
    dots: tuple[Point, ...]


def route(obstacles: Sequence[Obstacle], nets: Sequence[Net]) -> list[RoutedNet]:
    """Wires for every net, in the order given; those that are drawn are laid first, then the short ones."""
    router = _Router(obstacles, nets)
    order = sorted(range(len(nets)), key=lambda k: (not nets[k].drawn(), _length(nets[k]), k))
    done: dict[int, RoutedNet] = {k: router.lay(k, nets[k]) for k in order}
    return [done[k] for k in range(len(nets))]


def _length(net: Net) -> float:
    return sum(abs(net.source.x - t.x) + abs(net.source.y - t.y) for t in net.targets)


class _Router:
    """The grid with the routes so far."""

    def __init__(self, obstacles: Sequence[Obstacle], nets: Sequence[Net]) -> None:
        ends = [end for net in nets for end in (net.source, *net.targets)]
        stubs = [
            *(_ahead(net.source) for net in nets),
            *(_behind(target) for net in nets for target in net.targets),
        ]
        xs = [x for x, _ in stubs]
        ys = [y for _, y in stubs]
        corners = [point for net in nets for path in net.drawn().values() for point in path[1:-1]]
        xs += [x for x, _ in corners]
        ys += [y for _, y in corners]
        side_x = [v for o in obstacles for lane in _LANES for v in (o.x - lane, o.x + o.width + lane)]
        side_y = [v for o in obstacles for lane in _LANES for v in (o.top - lane, o.bottom + lane - 5)]
        self.xs = _merged([*xs, *(e.x for e in ends if e.dx == 0)], side_x)
        self.ys = _merged([*ys, *(e.y for e in ends if e.dy == 0)], side_y)
        self.column = {x: k for k, x in enumerate(self.xs)}
        self.row = {y: k for k, y in enumerate(self.ys)}
        columns, rows = len(self.xs), len(self.ys)
        # Price per px of the edge right of, and below, every node; infinite inside blocks.
        self.right = np.ones((rows, columns))
        self.down = np.ones((rows, columns))
        self._block(obstacles)
        # The cells before every port are reserved for its net, so that others turn earlier: -1 free.
        self.right_reserved = np.full((rows, columns), -1)
        self._reserve(nets)
        # Which net lies on an edge: -1 none.
        self.right_net = np.full((rows, columns), -1)
        self.down_net = np.full((rows, columns), -1)

    def _block(self, obstacles: Sequence[Obstacle]) -> None:
        x, y = np.array(self.xs), np.array(self.ys)
        next_x, next_y = np.append(x[1:], np.inf), np.append(y[1:], np.inf)
        for o in obstacles:
            left, right = o.x - CLEARANCE, o.x + o.width + CLEARANCE
            top, bottom = o.y - CLEARANCE, o.y + o.height + CLEARANCE
            rows, columns = (y > top) & (y < bottom), (x > left) & (x < right)
            self.right[np.ix_(rows, (next_x > left) & (x < right))] = np.inf
            self.down[np.ix_((next_y > top) & (y < bottom), columns)] = np.inf
            lx, ly, lw, lh = o.label
            rows, columns = (y > ly) & (y < ly + lh), (x > lx - 3) & (x < lx + lw + 3)
            self.right[np.ix_(rows, (next_x > lx - 3) & (x < lx + lw + 3))] *= 1 + _LABEL_PRICE
            self.down[np.ix_((next_y > ly) & (y < ly + lh), columns)] *= 1 + _LABEL_PRICE

    def _reserve(self, nets: Sequence[Net]) -> None:
        x = np.array(self.xs)
        for number, net in enumerate(nets):
            for end, side in ((net.source, 1), *((target, -1) for target in net.targets)):
                if end.dx:
                    far = end.x + side * end.dx * _RESERVED
                    near, far = min(end.x, far), max(end.x, far)
                    self.right_reserved[self.row[end.y], (x >= near - 1) & (x < far)] = number

    def lay(self, number: int, net: Net) -> RoutedNet:
        """Route one net, target by target, the nearest first."""
        start = self._node(*_ahead(net.source))
        tree: dict[Node, set[Node]] = {start: set()}
        origin = (net.source.x, net.source.y)
        goals = sorted(net.targets, key=lambda t: (abs(t.x - origin[0]) + abs(t.y - origin[1]), t.y, t.x))
        heading = (net.source.dx, net.source.dy)
        stems: dict[WireEnd, list[Node]] = {}
        drawn = net.drawn()
        for path in drawn.values():
            begin = [_ahead(net.source)] if _is_ahead(net.source, path[1]) else []
            nodes = [self._node(*point) for point in (*begin, *path[1:-1])]
            for a, b in pairwise(node for corner in pairwise(nodes) for node in _between(*corner)):
                if a != b:
                    self._join(number, tree, a, b)
        for target in goals:
            if target in drawn:
                continue
            goal = self._node(*_behind(target))
            walked = self._search(number, tree, start, heading, goal, (target.dx, target.dy))
            if walked is None:
                stems[target] = []
                continue
            for a, b in pairwise(walked):
                self._join(number, tree, a, b)
            stems[target] = walked
        return self._drawn(net, start, tree, stems)

    def _join(self, number: int, tree: dict[Node, set[Node]], a: Node, b: Node) -> None:
        tree.setdefault(a, set()).add(b)
        tree.setdefault(b, set()).add(a)
        self._occupy(number, a, b)

    def _drawn(
        self, net: Net, start: Node, tree: dict[Node, set[Node]], stems: dict[WireEnd, list[Node]]
    ) -> RoutedNet:
        source = (net.source.x, net.source.y)
        paths: list[tuple[Point, ...]] = []
        drawn = net.drawn()
        ending = {self._node(*_behind(t)) for t in net.targets if stems.get(t)}
        for target in net.targets:
            if target in drawn:
                paths.append(drawn[target])
                continue
            walked = stems[target]
            points = [(self.xs[c], self.ys[r]) for r, c in walked]
            if not walked:
                # Blocks are too close for the grid: a simple step is better than no wire.
                a, b = _ahead(net.source), _behind(target)
                points = [a, ((a[0] + b[0]) / 2, a[1]), ((a[0] + b[0]) / 2, b[1]), b]
            if not walked or walked[0] == start:
                points.insert(0, source)
            points.append((target.x, target.y))
            paths.append(_corners(points))
        dots: list[Point] = []
        for node, others in tree.items():
            degree = len(others) + (node == start) + (node in ending)
            if degree > 2:
                dots.append((self.xs[node[1]], self.ys[node[0]]))
        return RoutedNet(tuple(paths), tuple(sorted(dots)))

    def _node(self, x: float, y: float) -> Node:
        return self.row[y], self.column[x]

    def _occupy(self, number: int, a: Node, b: Node) -> None:
        (r0, c0), (r1, _) = min(a, b), max(a, b)
        if r0 == r1:
            self.right_net[r0, c0] = number
            for r, y in enumerate(self.ys):
                if r != r0 and abs(y - self.ys[r0]) < _NEAR:
                    self.right[r, c0] *= _NEAR_PRICE
        else:
            self.down_net[r0, c0] = number
            for c, x in enumerate(self.xs):
                if c != c0 and abs(x - self.xs[c0]) < _NEAR:
                    self.down[r0, c] *= _NEAR_PRICE

    def _step(self, number: int, node: Node, dr: int, dc: int) -> tuple[Node, float] | None:
        """The neighbour in a direction and the price of going there, None where nothing may go."""
        r, c = node[0] + dr, node[1] + dc
        if not (0 <= r < len(self.ys) and 0 <= c < len(self.xs)):
            return None
        r0, c0 = min(node[0], r), min(node[1], c)
        if dr == 0:
            price, owner, length = self.right[r0, c0], self.right_net[r0, c0], self.xs[c0 + 1] - self.xs[c0]
        else:
            price, owner, length = self.down[r0, c0], self.down_net[r0, c0], self.ys[r0 + 1] - self.ys[r0]
        if price == np.inf or owner not in (-1, number):
            return None
        cost = float(price) * length
        if dr == 0 and self.right_reserved[r0, c0] not in (-1, number):
            cost *= _RESERVED_PRICE
        if dr == 0:
            crossed = self._foreign(number, self.down_net, r, c, 1, 0)
        else:
            crossed = self._foreign(number, self.right_net, r, c, 0, 1)
        return (r, c), cost + (_CROSSING if crossed else 0.0)

    @staticmethod
    def _foreign(number: int, nets: np.ndarray, r: int, c: int, dr: int, dc: int) -> bool:  # pyright: ignore
        """Whether another net's wire passes through a node across our direction."""
        here = int(nets[r, c])
        before = int(nets[r - dr, c - dc]) if r - dr >= 0 and c - dc >= 0 else -1
        return here not in (-1, number) or before not in (-1, number)

    def _search(
        self,
        number: int,
        tree: dict[Node, set[Node]],
        start: Node,
        heading: tuple[int, int],
        goal: Node,
        arriving: tuple[int, int],
    ) -> list[Node] | None:
        """The cheapest route from the net's tree to the goal, A* over nodes and directions."""
        gx, gy = self.xs[goal[1]], self.ys[goal[0]]
        directions = ((0, 1), (1, 0), (0, -1), (-1, 0))  # row, column

        def guess(node: Node) -> float:
            return abs(self.xs[node[1]] - gx) + abs(self.ys[node[0]] - gy)

        best: dict[tuple[Node, int], float] = {}
        came: dict[tuple[Node, int], tuple[Node, int] | None] = {}
        queue: list[tuple[float, float, Node, int]] = []
        first = directions.index((heading[1], heading[0]))
        for node in tree:
            for k in range(4):
                price = 0.0 if node == start and k == first else _BRANCH if node != start else _BEND
                best[node, k] = price
                came[node, k] = None
                heapq.heappush(queue, (price + guess(node), price, node, k))
        final = directions.index((arriving[1], arriving[0]))
        while queue:
            _, cost, node, k = heapq.heappop(queue)
            if cost > best[node, k]:
                continue
            if node == goal and k == final:
                return _walk(came, (node, k))
            for turn in (0, 1, 3):
                k2 = (k + turn) % 4
                if turn:
                    reached, price = node, cost + _BEND
                else:
                    step = self._step(number, node, *directions[k])
                    if step is None:
                        continue
                    reached, price = step[0], cost + step[1]
                if price < best.get((reached, k2), np.inf) - 1e-9:
                    best[reached, k2] = price
                    came[reached, k2] = (node, k)
                    heapq.heappush(queue, (price + guess(reached), price, reached, k2))
        return None


def _is_ahead(end: WireEnd, point: Point) -> bool:
    """Whether a wire that leaves a port is free to turn before it comes to a point."""
    return (point[0] - end.x) * end.dx + (point[1] - end.y) * end.dy >= _STUB


def _between(a: Node, b: Node) -> list[Node]:
    """The nodes on the straight way from one to another, both included."""
    (r0, c0), (r1, c1) = a, b
    if r0 == r1:
        return [(r0, c) for c in range(c0, c1 + (1 if c1 >= c0 else -1), 1 if c1 >= c0 else -1)]
    return [(r, c0) for r in range(r0, r1 + (1 if r1 >= r0 else -1), 1 if r1 >= r0 else -1)]


def _walk(came: dict[tuple[Node, int], tuple[Node, int] | None], end: tuple[Node, int]) -> list[Node]:
    nodes: list[Node] = []
    state: tuple[Node, int] | None = end
    while state is not None:
        if not nodes or nodes[-1] != state[0]:
            nodes.append(state[0])
        state = came[state]
    return nodes[::-1]


def _ahead(end: WireEnd) -> Point:
    """Where a wire that leaves a port is free to turn."""
    return end.x + _STUB * end.dx, end.y + _STUB * end.dy


def _behind(end: WireEnd) -> Point:
    """Where a wire that enters a port has its last corner."""
    return end.x - _STUB * end.dx, end.y - _STUB * end.dy


def _merged(exact: Sequence[float], wanted: Sequence[float]) -> list[float]:
    """All exact coordinates, and of the wanted ones those that are not almost there already."""
    kept = sorted(set(exact))
    for value in sorted(set(wanted)):
        if all(abs(value - other) >= 4.0 for other in kept):
            kept.append(value)
    return sorted(kept)


def _corners(points: Sequence[Point]) -> tuple[Point, ...]:
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
