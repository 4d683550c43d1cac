"""Heights of the nodes: the main path in one row, straight lines, and short distances elsewhere.

Nodes that are joined by straight lines move together, as in Brandes and Köpf, *Fast and simple horizontal
coordinate assignment*, 2002. The rows are placed one by one, the main path first. Each row is placed where
its lines are shortest, between the rows that already have a height.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from itertools import pairwise

from armblocks.drawing.arrangement.columns import Columns, End, Segment

BLOCK_GAP = 24.0
"""Distance between the name of a block and the next block below, px."""
_LINE_GAP = 14.0
_SUM_GAP = 48.0
"""Distance between the middle of a round sum and the level of a line from above or below, px."""
_ROUNDS = 12


def heights(
    columns: Columns, order: Sequence[Sequence[int]], size: Sequence[float], name: float
) -> list[float]:
    """The upper edges of all nodes; ``size``: heights of the blocks, ``name``: height of a name below."""
    rows = _Rows(columns, order, size, name)
    rows.place()
    return rows.tops()


class _Rows:
    def __init__(
        self, columns: Columns, order: Sequence[Sequence[int]], size: Sequence[float], name: float
    ) -> None:
        self._blocks, self._segments = columns.blocks, columns.segments
        self._path = columns.path
        self._nets = columns.nets
        self._order = order
        self._position = {node: k for column in order for k, node in enumerate(column)}
        count = len(columns.column)
        self._leader = list(range(count))
        self._offset = [0.0] * count
        self._members: list[list[int]] = [[node] for node in range(count)]
        self._weight = [0.0] * count
        self._size, self._name = size, name
        self._two_input_sums = columns.two_input_sums
        self._straight: dict[tuple[int, bool], int] = {}
        """The node at the other end of a straight line, by node and side."""
        self._align()
        rows = sorted({self._leader[node] for node in range(count)})
        self._above: dict[int, dict[int, float]] = {row: {} for row in rows}
        self._below: dict[int, dict[int, float]] = {row: {} for row in rows}
        for column in order:
            for upper, lower in pairwise(column):
                min_distance = (
                    self._minimum_distance(upper, lower) + self._offset[upper] - self._offset[lower]
                )
                a, b = self._leader[upper], self._leader[lower]
                self._above[b][a] = max(self._above[b].get(a, min_distance), min_distance)
                self._below[a][b] = self._above[b][a]
        self._lines: dict[int, list[tuple[int, float, float]]] = {row: [] for row in rows}
        """For every row: a connected row, the distance below it for a straight line, and a weight."""
        for segment in self._segments:
            self._add_line(segment)
        self._y: dict[int, float] = {}

    # -- rows of straight lines ------------------------------------------------------------------------------

    def _align(self) -> None:
        aligned: set[tuple[int, bool]] = set()
        straight_pairs: dict[int, list[tuple[int, int]]] = {}
        for segment in sorted((p for p in self._segments if not p.is_reversal), key=self._rank):
            left, right = (segment.a, segment.b) if segment.a.right else (segment.b, segment.a)
            if not (left.can_be_straight and right.can_be_straight):
                continue
            if (left.node, True) in aligned or (right.node, False) in aligned:
                continue
            pair = self._position[left.node], self._position[right.node]
            straight = straight_pairs.setdefault(segment.gap, [])
            if any((pair[0] - a) * (pair[1] - b) < 0 for a, b in straight):
                continue
            straight.append(pair)
            aligned |= {(left.node, True), (right.node, False)}
            self._straight[right.node, False], self._straight[left.node, True] = left.node, right.node
            self._unite(left.node, right.node, left.port - right.port, self._strength(segment))

    def _unite(self, left: int, right: int, shift: float, strength: float) -> None:
        """Make the right node, and its row, ``shift`` lower than the left node."""
        a, b = self._leader[left], self._leader[right]
        move = self._offset[left] + shift - self._offset[right]
        for node in self._members[b]:
            self._leader[node] = a
            self._offset[node] += move
        self._members[a] += self._members[b]
        self._weight[a] = max(self._weight[a], self._weight[b], strength)

    def _strength(self, segment: Segment) -> float:
        ends = segment.a.node, segment.b.node
        dummies = sum(node >= self._blocks for node in ends)
        paths = {self._path.get(node) for node in ends}
        if len(paths) == 1 and (path := paths.pop()) is not None:
            return max(100.0 - path, 10.0)
        return (3.0, 2.0, 8.0)[dummies]

    def _rank(self, segment: Segment) -> tuple[float, ...]:
        left, right = (segment.a, segment.b) if segment.a.right else (segment.b, segment.a)
        steps = abs(self._position[left.node] - self._position[right.node])
        return -self._strength(segment), steps, segment.gap, left.node, right.node, left.port, right.port

    def _minimum_distance(self, upper: int, lower: int) -> float:
        """The minimum distance of the upper edges of two neighbours in a column."""
        if upper < self._blocks:
            gap = BLOCK_GAP if lower < self._blocks else _LINE_GAP
            return self._size[upper] + self._name + gap
        one_net = min(upper, lower) >= self._blocks and (
            self._nets[upper - self._blocks] == self._nets[lower - self._blocks]
        )
        return 0.0 if one_net else _LINE_GAP

    # -- placing ---------------------------------------------------------------------------------------------

    def _add_line(self, segment: Segment) -> None:
        shift = segment.a.port - segment.b.port + self._offset[segment.a.node] - self._offset[segment.b.node]
        for end, other, direction in ((segment.a, segment.b, -1.0), (segment.b, segment.a, 1.0)):
            if not end.can_be_straight:  # from above or below
                shift -= direction * (_SUM_GAP if self._from_below(end, other) else -_SUM_GAP)
        a, b = self._leader[segment.a.node], self._leader[segment.b.node]
        if a == b:
            return
        weight = 0.5 if segment.is_reversal else 1.0
        self._lines[b].append((a, shift, weight))
        self._lines[a].append((b, -shift, weight))

    def _from_below(self, end: End, other: End) -> bool:
        """Whether a line meets a round sum from below; a sum with two inputs adapts its ports."""
        straight = self._straight.get((end.node, end.right))
        if end.node in self._two_input_sums and end.right != other.right and straight is not None:
            return self._position[other.node] > self._position[straight]
        return end.relative_height > 0

    def place(self) -> None:
        """Place all rows, then move each row between its neighbours to the height with the shortest lines."""
        rank = {row: (-self._weight[row], -len(self._members[row]), row) for row in self._lines}
        unplaced = set(self._lines)
        queue: list[tuple[tuple[float, int, int], int]] = []
        while unplaced:
            while queue and queue[0][1] not in unplaced:
                heapq.heappop(queue)
            row = heapq.heappop(queue)[1] if queue else min(unplaced, key=lambda row: rank[row])
            unplaced.discard(row)
            low, high = self._bound(row, self._above, 1.0), self._bound(row, self._below, -1.0)
            self._y[row] = min(max(self._median_height(row), low), high)
            for other, _, _ in self._lines[row]:
                if other in unplaced:
                    heapq.heappush(queue, (rank[other], other))
        order = sorted(self._lines, key=lambda row: (self._y[row], row))
        for k in range(_ROUNDS):
            moved = False
            for row in order if k % 2 else order[::-1]:
                low = max((self._y[a] + d for a, d in self._above[row].items()), default=float("-inf"))
                high = min((self._y[b] - d for b, d in self._below[row].items()), default=float("inf"))
                y = min(max(self._median_height(row), low), high)
                if abs(y - self._y[row]) > 0.5:
                    self._y[row] = y
                    moved = True
            if not moved:
                break

    def _median_height(self, row: int) -> float:
        """The weighted median of the heights at which single lines of a row are straight."""
        heights = sorted(
            (self._y[other] + shift, weight) for other, shift, weight in self._lines[row] if other in self._y
        )
        if not heights:
            return self._y.get(row, 0.0)
        half, total = sum(weight for _, weight in heights) / 2, 0.0
        for k, (y, weight) in enumerate(heights):
            total += weight
            if total > half + 1e-9:
                return y
            if total > half - 1e-9:
                following = heights[min(k + 1, len(heights) - 1)][0]
                return min(max(self._y.get(row, (y + following) / 2), y), following)
        return heights[-1][0]

    def _bound(self, row: int, neighbours: dict[int, dict[int, float]], direction: float) -> float:
        """The bound on a row's height from the placed rows on one side, also through unplaced rows."""
        # Longest paths through rows without a height, in the order of a depth-first search.
        order: list[int] = []
        visited = {row}
        stack = [(row, iter(neighbours[row]))]
        while stack:
            node, others = stack[-1]
            other = next((o for o in others if o not in visited and o not in self._y), None)
            if other is None:
                stack.pop()
                order.append(node)
            else:
                visited.add(other)
                stack.append((other, iter(neighbours[other])))
        distance = {row: 0.0}
        bound = -direction * float("inf")
        for node in reversed(order):
            for other, min_distance in neighbours[node].items():
                total = distance[node] + min_distance
                if other in self._y:
                    bound = (
                        max(bound, self._y[other] + total)
                        if direction > 0
                        else min(bound, self._y[other] - total)
                    )
                else:
                    distance[other] = max(distance.get(other, total), total)
        return bound

    def tops(self) -> list[float]:
        """The upper edges of the nodes, the first at 0."""
        return [self._y[self._leader[node]] + self._offset[node] for node in range(len(self._leader))]
