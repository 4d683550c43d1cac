"""The order of the nodes in every column: few crossings, feedback below its loop.

Barycentre sweeps give a first order (Sugiyama, Tagawa, Toda 1981). Then every node is moved through its
column to the position of least cost (sifting, Matuszewski, Schönfeld, Molitor 1999). The cost counts the
crossings of all lines, including lines that reverse their direction.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from armblocks.drawing.arrangement.columns import Columns, Segment

_CROSSING_COST = 1.0
_PATH_CROSSING_COST = 4.0
"""Cost of a crossing of two paths from a source to a sink."""
_ENCLOSED_NODE_COST = 0.3
"""Cost of a node between the two ends of a line that reverses its direction."""
_SUM_CROSSING_COST = 0.2
"""Cost of a crossing of two lines into one sum with two inputs, whose ports can be exchanged."""
_FEEDBACK_ABOVE_COST = 0.9
"""Cost of a feedback line above its loop that could be below it."""
_SWEEPS = 8
_PASSES = 10
_MAX_CHAIN_NODES = 120
"""In a sheet with more nodes, lines are not moved as a whole."""
_MAX_WEIGHTED_LINES = 60
"""Between two columns with more lines, all crossings have the same cost."""
_MAX_NODES = 1000
"""In a sheet with more nodes, only one start order is tried."""
_MAX_SIFTED_NODES = 30
"""In a column with more nodes, a node is only exchanged with its neighbours."""


def node_order(columns: Columns) -> tuple[float, list[list[int]]]:
    """The nodes of every column from top to bottom, and the cost of this order."""
    return _Ordering(columns).best()


def _chains(columns: Columns, *, strict: bool) -> list[list[int]]:
    """Chains of connected nodes over several columns; ``strict``: only chains without branches."""
    main = {node for node, path in columns.path.items() if path == 0}
    neighbours: dict[tuple[int, bool], set[int]] = {}
    for segment in columns.segments:
        if not segment.is_reversal:
            neighbours.setdefault((segment.a.node, segment.a.right), set()).add(segment.b.node)
            neighbours.setdefault((segment.b.node, segment.b.right), set()).add(segment.a.node)
    chains: list[list[int]] = []
    visited: set[int] = set()
    for first in range(len(columns.column)):
        if first in visited or first in main:
            continue
        chain = [first]
        visited.add(first)
        for right in (True, False):
            node = first
            while others := sorted(
                neighbours.get((node, right), set()) - main - (set() if strict else visited)
            ):
                node = others[0]
                if node in visited or (strict and (len(others) > 1 or len(neighbours[node, not right]) > 1)):
                    break
                chain.append(node)
                visited.add(node)
        chains.append(chain)
    return chains


DrawnLine: TypeAlias = tuple[Segment, int, float, float]
"""A line, whether it reverses its direction at its left (1) or right (-1), and the heights of its ends."""


class _Ordering:
    def __init__(self, columns: Columns) -> None:
        self._segments = columns.segments
        self._main = {node for node, path in columns.path.items() if path == 0}
        self._path = columns.path
        self._columns: list[list[int]] = [[] for _ in range(max(columns.column) + 1)]
        for node, column in enumerate(columns.column):
            self._columns[column].append(node)
        self._column_of = columns.column
        self._position = [0.0] * len(columns.column)
        self._sides: list[dict[bool, list[Segment]]] = [{True: [], False: []} for _ in columns.column]
        """The segments at each node, by the side of the node on which they are."""
        self._reversals: list[list[Segment]] = [[] for _ in columns.column]
        self._blocks = columns.blocks
        self._two_input_sums = columns.two_input_sums
        self._on_path = {
            segment
            for segment in self._segments
            if self._path.get(segment.a.node, -1) == self._path.get(segment.b.node, -2)
        }
        self._gaps: dict[int, list[Segment]] = {}
        for segment in self._segments:
            self._gaps.setdefault(segment.gap, []).append(segment)
        self._chains = [*_chains(columns, strict=True), *_chains(columns, strict=False)]
        for segment in self._segments:
            for end in {segment.a.node, segment.b.node}:
                side = (
                    segment.a.right
                    if segment.is_reversal
                    else (segment.a.right if segment.a.node == end else segment.b.right)
                )
                self._sides[end][side].append(segment)
            if segment.is_reversal and segment.a.node != segment.b.node:
                self._reversals[segment.a.node].append(segment)
                self._reversals[segment.b.node].append(segment)

    def best(self) -> tuple[float, list[list[int]]]:
        """The cost and the order of the better result from two start orders."""
        results: list[tuple[float, int, list[list[int]]]] = []
        starts = (self._start_with_feedback_last, self._start_as_numbered)[
            : 1 if len(self._position) > _MAX_NODES else 2
        ]
        for k, start in enumerate(starts):
            start()
            self._sweep(feedback=k == 1)
            self._sift()
            for _ in range(_PASSES if len(self._position) <= _MAX_CHAIN_NODES else 0):
                if not self._move_chains():
                    break
                self._sift()
            results.append((self.cost(), k, [list(column) for column in self._columns]))
        cost, _, order = min(results)
        return cost, order

    # -- starts ----------------------------------------------------------------------------------------------

    def _start_with_feedback_last(self) -> None:
        for column in self._columns:
            column.sort(
                key=lambda node: (self._is_reversal(node), self._path.get(node, len(self._path)), node)
            )
        self._renumber()

    def _start_as_numbered(self) -> None:
        for column in self._columns:
            column.sort(key=lambda node: (self._path.get(node, len(self._path)), node))
        self._renumber()

    def _is_reversal(self, node: int) -> bool:
        """Whether a node is a dummy node at which a line reverses its direction."""
        return node >= self._blocks and bool(self._reversals[node])

    def _renumber(self) -> None:
        for column in self._columns:
            self._number(column)

    def _number(self, column: Sequence[int]) -> None:
        for k, node in enumerate(column):
            self._position[node] = float(k)

    # -- sweeps ----------------------------------------------------------------------------------------------

    def _sweep(self, *, feedback: bool) -> None:
        best, best_columns = self.cost(), [list(column) for column in self._columns]
        for sweep in range(_SWEEPS):
            to_right = sweep % 2 == 0
            for column in self._columns if to_right else self._columns[::-1]:
                barycentre = {node: self._barycentre(node, right=not to_right) for node in column}
                column.sort(key=lambda node: barycentre[node])
                self._number(column)
            cost = self.cost()
            if cost < best - 1e-9:
                best, best_columns = cost, [list(column) for column in self._columns]
        self._columns = best_columns
        self._renumber()

    def _barycentre(self, node: int, *, right: bool) -> float:
        """The mean position of the other ends of the node's lines on one side, relative to their column."""
        heights: list[float] = []
        for segment in self._sides[node][right]:
            for end, other in ((segment.a, segment.b), (segment.b, segment.a)):
                if end.node != node or other.node == node:
                    continue
                node_count = max(len(self._columns[self._column_of[other.node]]), 1)
                height = (
                    self._position[other.node] + 0.5 + other.relative_height - end.relative_height
                ) / node_count
                heights.append(height + 0.6 / node_count if segment.is_reversal else height)
        own_height = (self._position[node] + 0.5) / max(len(self._columns[self._column_of[node]]), 1)
        return sum(heights) / len(heights) if heights else own_height

    # -- sifting ---------------------------------------------------------------------------------------------

    def _sift(self) -> None:
        for _ in range(_PASSES if len(self._position) <= _MAX_NODES else 2):
            improved = False
            for column in [*self._columns, *self._columns[::-1]]:
                if len(column) < 2:
                    continue
                if len(column) > _MAX_SIFTED_NODES:
                    improved |= self._exchange(column)
                else:
                    for node in sorted(column):
                        improved |= self._sift_node(column, node)
            if not improved:
                return

    def _move_chains(self) -> bool:
        """Move whole lines to the top, the bottom or beside the main path; return whether this helps."""
        improved = False
        for chain in self._chains:
            columns = sorted({self._column_of[node] for node in chain})
            gaps = sorted({gap for k in columns for gap in (k - 1, k)})
            before = {k: list(self._columns[k]) for k in columns}
            cost = best = sum(self._gap_cost(gap) for gap in gaps)
            chosen = before
            for target in range(4):
                for k in columns:
                    self._columns[k] = list(before[k])
                for node in chain:
                    column = self._columns[self._column_of[node]]
                    column.remove(node)
                    main = next((k for k, other in enumerate(column) if other in self._main), None)
                    index = 0 if target == 0 or (main is None and target == 2) else len(column)
                    if main is not None and target >= 2:
                        index = main if target == 2 else main + 1
                    column.insert(index, node)
                for k in columns:
                    self._number(self._columns[k])
                if (moved_cost := sum(self._gap_cost(gap) for gap in gaps)) < best - 1e-9:
                    best, chosen = moved_cost, {k: list(self._columns[k]) for k in columns}
            for k in columns:
                self._columns[k] = list(chosen[k])
                self._number(self._columns[k])
            improved |= best < cost - 1e-9
        return improved

    def _exchange(self, column: list[int]) -> bool:
        improved = False
        for k in range(len(column) - 1):
            if self._exchange_cost(column[k], column[k + 1]) < -1e-9:
                self._swap(column, k)
                improved = True
        return improved

    def _sift_node(self, column: list[int], node: int) -> bool:
        """Move a node to the position of least cost in its column; return whether the cost is lower."""
        start = column.index(node)
        cost, best, goal = 0.0, 0.0, start
        for k in range(start, len(column) - 1):  # down to the end
            cost += self._exchange_cost(column[k], column[k + 1])
            self._swap(column, k)
            if cost < best - 1e-9:
                best, goal = cost, k + 1
        for k in range(len(column) - 1, 0, -1):  # up to the beginning
            cost += self._exchange_cost(column[k - 1], column[k])
            self._swap(column, k - 1)
            if cost < best - 1e-9:
                best, goal = cost, k - 1
        for k in range(goal):
            self._swap(column, k)
        return best < 0.0

    def _swap(self, column: list[int], k: int) -> None:
        a, b = column[k], column[k + 1]
        column[k], column[k + 1] = b, a
        self._position[a], self._position[b] = float(k + 1), float(k)

    def _exchange_cost(self, upper: int, lower: int) -> float:
        """The change of the cost if two neighbours of a column are exchanged."""
        before = self._pair_cost(upper, lower)
        positions = self._position
        positions[upper], positions[lower] = positions[lower], positions[upper]
        after = self._pair_cost(upper, lower)
        positions[upper], positions[lower] = positions[lower], positions[upper]
        return after - before

    def _pair_cost(self, one: int, other: int) -> float:
        """The part of the cost that depends on the order of two neighbours."""
        cost = 0.0
        for side in (True, False):
            ones, others = self._sides[one][side], self._sides[other][side]
            if ones and others:
                drawn_lines = [self._drawn_line(segment) for segment in others]
                for segment in ones:
                    a = self._drawn_line(segment)
                    for b in drawn_lines:
                        if _cross(a, b):
                            cost += self._crossing_cost(a[0], b[0])
        for node, passed in ((one, other), (other, one)):
            for segment in self._reversals[node]:
                partner = segment.b.node if segment.a.node == node else segment.a.node
                low, high = sorted((self._position[node], self._position[partner]))
                if low < self._position[passed] < high:
                    cost += _ENCLOSED_NODE_COST
                if partner == passed and node < passed:
                    cost += self._above(segment)
        return cost

    def _crossing_cost(self, a: Segment, b: Segment) -> float:
        """The cost of a crossing; low for lines into a sum with two inputs, whose ports follow the lines."""
        if a.is_reversal or b.is_reversal:
            return _CROSSING_COST
        if a.b.node == b.b.node and a.b.node in self._two_input_sums:
            return _SUM_CROSSING_COST
        return _PATH_CROSSING_COST if a in self._on_path and b in self._on_path else _CROSSING_COST

    def _above(self, segment: Segment) -> float:
        """The cost of a feedback line whose dummy node or mirrored block is above the other end."""
        block, dummy = (segment.a, segment.b) if segment.a.node < self._blocks else (segment.b, segment.a)
        if dummy.node < self._blocks and segment.a.right:
            block, dummy = segment.a, segment.b
        if block.relative_height < -0.2 and not block.can_be_straight:
            return 0.0
        return _FEEDBACK_ABOVE_COST if self._position[dummy.node] < self._position[block.node] else 0.0

    def _drawn_line(self, segment: Segment) -> DrawnLine:
        a, b = (
            self._position[segment.a.node] + segment.a.relative_height,
            self._position[segment.b.node] + segment.b.relative_height,
        )
        if segment.is_reversal:
            return segment, 1 if segment.a.right else -1, min(a, b), max(a, b)
        return segment, 0, a, b

    def cost(self) -> float:
        """The cost of the current order."""
        return sum(self._gap_cost(gap) for gap in self._gaps)

    def _gap_cost(self, gap: int) -> float:
        """The cost of the lines between two columns."""
        cost = 0.0
        drawn_lines = [self._drawn_line(segment) for segment in self._gaps.get(gap, ())]
        if len(drawn_lines) > _MAX_WEIGHTED_LINES:
            cost = _crossings(drawn_lines)
        else:
            for k, a in enumerate(drawn_lines):
                for b in drawn_lines[:k]:
                    if _cross(a, b):
                        cost += self._crossing_cost(a[0], b[0])
        for segment, turns, _, _ in drawn_lines:
            if turns and segment.a.node != segment.b.node:
                between = abs(self._position[segment.a.node] - self._position[segment.b.node]) - 1
                cost += _ENCLOSED_NODE_COST * between + self._above(segment)
        return cost


def _crossings(drawn_lines: Sequence[DrawnLine]) -> float:
    """The number of crossings between lines of different nets, for many lines."""
    net, turns = np.array([line[0].net for line in drawn_lines]), np.array([line[1] for line in drawn_lines])
    a, b = np.array([line[2] for line in drawn_lines]), np.array([line[3] for line in drawn_lines])
    foreign = net[:, None] != net
    through = turns == 0
    straight = (a[:, None] < a) & (b[:, None] > b) & through[:, None] & through & foreign
    count = int(np.count_nonzero(straight))
    inside_a, inside_b = [(a[:, None] < end) & (end < b[:, None]) for end in (a, b)]
    for side, inside in ((1, inside_a), (-1, inside_b)):
        reversal = turns == side
        count += int(np.count_nonzero(inside & reversal[:, None] & through & foreign))
        both = (inside_a != inside_b) & reversal[:, None] & reversal & foreign
        count += int(np.count_nonzero(both)) // 2
    return _CROSSING_COST * count


def _cross(one: DrawnLine, other: DrawnLine) -> bool:
    """Whether two lines of different nets between the same two columns cross."""
    if one[0].net == other[0].net:
        return False
    _, turns, a, b = one
    _, other_turns, c, d = other
    if not turns and not other_turns:
        return (a < c and b > d) or (a > c and b < d)
    if turns and other_turns:
        return turns == other_turns and (a < c < b) != (a < d < b)
    if other_turns:
        a, b, c, d, turns = c, d, a, b, other_turns
    return a < (c if turns > 0 else d) < b
