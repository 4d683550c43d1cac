"""The order of the nodes in every column: few crossings, feedback below its loop.

Barycentre sweeps give a first order (Sugiyama, Tagawa, Toda 1981). Then every node is moved through its
column to the place of least cost (sifting, Matuszewski, Schönfeld, Molitor 1999), where the cost counts
crossings of all lines, lines that turn round included.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from armblocks.drawing.arrangement.columns import Columns, Piece

_CROSSING = 1.0
_PATHS_CROSS = 4.0
"""Price of a crossing of two paths from a source to a sink."""
_BETWEEN = 0.3
"""Price of a node between the two ends of a line that turns round."""
_TURNED_SUM = 0.2
"""Price of a line that comes from below to a sum, where others come from above."""
_FEEDBACK_ABOVE = 0.9
"""Price of a line that turns upwards to run back, where it could run below."""
_SWEEPS = 8
_PASSES = 10
_MANY_NODES = 120
"""Nodes of a sheet from which on lines are not moved as a whole."""
_FEW_LINES = 60
"""Lines between two columns up to which crossings have different prices."""
_MOST_NODES = 1000
"""Nodes of a sheet from which on one order is tried."""
_MANY = 30
"""Nodes of a column from which on a node is only exchanged with its neighbours."""


def ordered(columns: Columns) -> tuple[float, list[list[int]]]:
    """The nodes of every column from top to bottom, and the cost of this order."""
    return _Ordering(columns).best()


def _threads(columns: Columns, *, strict: bool) -> list[list[int]]:
    """Lines over several columns: knots and blocks that are joined, only one to one if ``strict``."""
    main = {node for node, path in columns.path.items() if path == 0}
    beside: dict[tuple[int, bool], set[int]] = {}
    for piece in columns.pieces:
        if not piece.turns:
            beside.setdefault((piece.a.node, piece.a.right), set()).add(piece.b.node)
            beside.setdefault((piece.b.node, piece.b.right), set()).add(piece.a.node)
    found: list[list[int]] = []
    seen: set[int] = set()
    for first in range(len(columns.column)):
        if first in seen or first in main:
            continue
        thread = [first]
        seen.add(first)
        for right in (True, False):
            node = first
            while others := sorted(beside.get((node, right), set()) - main - (set() if strict else seen)):
                node = others[0]
                if node in seen or (strict and (len(others) > 1 or len(beside[node, not right]) > 1)):
                    break
                thread.append(node)
                seen.add(node)
        found.append(thread)
    return found


Drawn: TypeAlias = tuple[Piece, int, float, float]
"""A line, whether it turns round at its left (1) or its right (-1), and the heights of its ends."""


class _Ordering:
    def __init__(self, columns: Columns) -> None:
        self._pieces = columns.pieces
        self._main = {node for node, path in columns.path.items() if path == 0}
        self._path = columns.path
        self._columns: list[list[int]] = [[] for _ in range(max(columns.column) + 1)]
        for node, at in enumerate(columns.column):
            self._columns[at].append(node)
        self._at = columns.column
        self._place = [0.0] * len(columns.column)
        self._sides: list[dict[bool, list[Piece]]] = [{True: [], False: []} for _ in columns.column]
        """The pieces at each node, by the side of the node at whose gap they run."""
        self._turning: list[list[Piece]] = [[] for _ in columns.column]
        self._knots = columns.blocks
        self._turned = columns.turned
        self._on_path = {
            piece
            for piece in self._pieces
            if self._path.get(piece.a.node, -1) == self._path.get(piece.b.node, -2)
        }
        self._gaps: dict[int, list[Piece]] = {}
        for piece in self._pieces:
            self._gaps.setdefault(piece.gap, []).append(piece)
        self._threads = [*_threads(columns, strict=True), *_threads(columns, strict=False)]
        for piece in self._pieces:
            for end in {piece.a.node, piece.b.node}:
                side = (
                    piece.a.right
                    if piece.turns
                    else (piece.a.right if piece.a.node == end else piece.b.right)
                )
                self._sides[end][side].append(piece)
            if piece.turns and piece.a.node != piece.b.node:
                self._turning[piece.a.node].append(piece)
                self._turning[piece.b.node].append(piece)

    def best(self) -> tuple[float, list[list[int]]]:
        """The better of the orders from two starts."""
        found: list[tuple[float, int, list[list[int]]]] = []
        starts = (self._with_feedback_last, self._as_numbered)[: 1 if len(self._place) > _MOST_NODES else 2]
        for k, start in enumerate(starts):
            start()
            self._sweep(feedback=k == 1)
            self._sift()
            for _ in range(_PASSES if len(self._place) <= _MANY_NODES else 0):
                if not self._move_threads():
                    break
                self._sift()
            found.append((self.cost(), k, [list(column) for column in self._columns]))
        cost, _, order = min(found)
        return cost, order

    # -- starts ----------------------------------------------------------------------------------------------

    def _with_feedback_last(self) -> None:
        for column in self._columns:
            column.sort(key=lambda node: (self._is_back(node), self._path.get(node, len(self._path)), node))
        self._renumber()

    def _as_numbered(self) -> None:
        for column in self._columns:
            column.sort(key=lambda node: (self._path.get(node, len(self._path)), node))
        self._renumber()

    def _is_back(self, node: int) -> bool:
        """Whether a node is a knot at which a line turns round."""
        return node >= self._knots and bool(self._turning[node])

    def _renumber(self) -> None:
        for column in self._columns:
            self._number(column)

    def _number(self, column: Sequence[int]) -> None:
        for k, node in enumerate(column):
            self._place[node] = float(k)

    # -- sweeps ----------------------------------------------------------------------------------------------

    def _sweep(self, *, feedback: bool) -> None:
        best, kept = self.cost(), [list(column) for column in self._columns]
        for sweep in range(_SWEEPS):
            to_right = sweep % 2 == 0
            for column in self._columns if to_right else self._columns[::-1]:
                wish = {node: self._wish(node, right=not to_right) for node in column}
                column.sort(key=lambda node: wish[node])
                self._number(column)
            cost = self.cost()
            if cost < best - 1e-9:
                best, kept = cost, [list(column) for column in self._columns]
        self._columns = kept
        self._renumber()

    def _wish(self, node: int, *, right: bool) -> float:
        """The mean place of the ends of the node's lines on one side, as a share of their column."""
        heights: list[float] = []
        for piece in self._sides[node][right]:
            for end, other in ((piece.a, piece.b), (piece.b, piece.a)):
                if end.node != node or other.node == node:
                    continue
                many = max(len(self._columns[self._at[other.node]]), 1)
                height = (self._place[other.node] + 0.5 + other.share - end.share) / many
                heights.append(height + 0.6 / many if piece.turns else height)
        here = (self._place[node] + 0.5) / max(len(self._columns[self._at[node]]), 1)
        return sum(heights) / len(heights) if heights else here

    # -- sifting ---------------------------------------------------------------------------------------------

    def _sift(self) -> None:
        for _ in range(_PASSES if len(self._place) <= _MOST_NODES else 2):
            improved = False
            for column in [*self._columns, *self._columns[::-1]]:
                if len(column) < 2:
                    continue
                if len(column) > _MANY:
                    improved |= self._exchange(column)
                else:
                    for node in sorted(column):
                        improved |= self._sift_one(column, node)
            if not improved:
                return

    def _move_threads(self) -> bool:
        """Move whole lines to the top, to the bottom and beside the main path; says whether any is better."""
        improved = False
        for thread in self._threads:
            touched = sorted({self._at[node] for node in thread})
            gaps = sorted({gap for at in touched for gap in (at - 1, at)})
            kept = {at: list(self._columns[at]) for at in touched}
            cost = best = sum(self._gap_cost(gap) for gap in gaps)
            chosen = kept
            for way in range(4):
                for at in touched:
                    self._columns[at] = list(kept[at])
                for node in thread:
                    column = self._columns[self._at[node]]
                    column.remove(node)
                    main = next((k for k, other in enumerate(column) if other in self._main), None)
                    here = 0 if way == 0 or (main is None and way == 2) else len(column)
                    if main is not None and way >= 2:
                        here = main if way == 2 else main + 1
                    column.insert(here, node)
                for at in touched:
                    self._number(self._columns[at])
                if (found := sum(self._gap_cost(gap) for gap in gaps)) < best - 1e-9:
                    best, chosen = found, {at: list(self._columns[at]) for at in touched}
            for at in touched:
                self._columns[at] = list(chosen[at])
                self._number(self._columns[at])
            improved |= best < cost - 1e-9
        return improved

    def _exchange(self, column: list[int]) -> bool:
        improved = False
        for k in range(len(column) - 1):
            if self._gain(column[k], column[k + 1]) < -1e-9:
                self._swap(column, k)
                improved = True
        return improved

    def _sift_one(self, column: list[int], node: int) -> bool:
        """Move a node to the place of least cost in its column; says whether the cost is lower."""
        start = column.index(node)
        cost, best, goal = 0.0, 0.0, start
        for k in range(start, len(column) - 1):  # down to the end
            cost += self._gain(column[k], column[k + 1])
            self._swap(column, k)
            if cost < best - 1e-9:
                best, goal = cost, k + 1
        for k in range(len(column) - 1, 0, -1):  # up to the beginning
            cost += self._gain(column[k - 1], column[k])
            self._swap(column, k - 1)
            if cost < best - 1e-9:
                best, goal = cost, k - 1
        for k in range(goal):
            self._swap(column, k)
        return best < 0.0

    def _swap(self, column: list[int], k: int) -> None:
        a, b = column[k], column[k + 1]
        column[k], column[k + 1] = b, a
        self._place[a], self._place[b] = float(k + 1), float(k)

    def _gain(self, upper: int, lower: int) -> float:
        """By how much the cost changes if two neighbours of a column change places."""
        before = self._pair_cost(upper, lower)
        places = self._place
        places[upper], places[lower] = places[lower], places[upper]
        after = self._pair_cost(upper, lower)
        places[upper], places[lower] = places[lower], places[upper]
        return after - before

    def _pair_cost(self, one: int, other: int) -> float:
        """The part of the cost that depends on the order of two neighbours."""
        cost = 0.0
        for side in (True, False):
            ones, others = self._sides[one][side], self._sides[other][side]
            if ones and others:
                drawn = [self._drawn(piece) for piece in others]
                for piece in ones:
                    a = self._drawn(piece)
                    for b in drawn:
                        if _cross(a, b):
                            cost += self._price(a[0], b[0])
        for node, passed in ((one, other), (other, one)):
            for piece in self._turning[node]:
                partner = piece.b.node if piece.a.node == node else piece.a.node
                low, high = sorted((self._place[node], self._place[partner]))
                if low < self._place[passed] < high:
                    cost += _BETWEEN
                if partner == passed and node < passed:
                    cost += self._above(piece)
        return cost

    def _price(self, a: Piece, b: Piece) -> float:
        """The price of a crossing. Lines into a sum with two inputs do not cross: it is turned to them."""
        if a.turns or b.turns:
            return _CROSSING
        if a.b.node == b.b.node and a.b.node in self._turned:
            return _TURNED_SUM
        return _PATHS_CROSS if a in self._on_path and b in self._on_path else _CROSSING

    def _above(self, piece: Piece) -> float:
        """The price of a line that turns upwards: its knot, or its mirrored block, is above the other end."""
        block, knot = (piece.a, piece.b) if piece.a.node < self._knots else (piece.b, piece.a)
        if knot.node < self._knots and piece.a.right:
            block, knot = piece.a, piece.b
        if block.share < -0.2 and not block.level:
            return 0.0
        return _FEEDBACK_ABOVE if self._place[knot.node] < self._place[block.node] else 0.0

    def _drawn(self, piece: Piece) -> Drawn:
        a, b = self._place[piece.a.node] + piece.a.share, self._place[piece.b.node] + piece.b.share
        if piece.turns:
            return piece, 1 if piece.a.right else -1, min(a, b), max(a, b)
        return piece, 0, a, b

    def cost(self) -> float:
        """The cost of the present order."""
        return sum(self._gap_cost(gap) for gap in self._gaps)

    def _gap_cost(self, gap: int) -> float:
        """The cost of the lines between two columns."""
        cost = 0.0
        drawn = [self._drawn(piece) for piece in self._gaps.get(gap, ())]
        if len(drawn) > _FEW_LINES:
            cost = _crossings(drawn)
        else:
            for k, a in enumerate(drawn):
                for b in drawn[:k]:
                    if _cross(a, b):
                        cost += self._price(a[0], b[0])
        for piece, turns, _, _ in drawn:
            if turns and piece.a.node != piece.b.node:
                between = abs(self._place[piece.a.node] - self._place[piece.b.node]) - 1
                cost += _BETWEEN * between + self._above(piece)
        return cost


def _crossings(drawn: Sequence[Drawn]) -> float:
    """The number of crossings between lines of different nets, for many lines."""
    net, turns = np.array([line[0].net for line in drawn]), np.array([line[1] for line in drawn])
    a, b = np.array([line[2] for line in drawn]), np.array([line[3] for line in drawn])
    foreign = net[:, None] != net
    through = turns == 0
    straight = (a[:, None] < a) & (b[:, None] > b) & through[:, None] & through & foreign
    found = int(np.count_nonzero(straight))
    inside_a, inside_b = [(a[:, None] < end) & (end < b[:, None]) for end in (a, b)]
    for way, inside in ((1, inside_a), (-1, inside_b)):
        round_ = turns == way
        found += int(np.count_nonzero(inside & round_[:, None] & through & foreign))
        both = (inside_a != inside_b) & round_[:, None] & round_ & foreign
        found += int(np.count_nonzero(both)) // 2
    return _CROSSING * found


def _cross(one: Drawn, other: Drawn) -> bool:
    """Whether two lines between the same two columns cross, if they are of two nets."""
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
