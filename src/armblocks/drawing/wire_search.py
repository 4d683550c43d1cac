"""The cheapest route of a wire on a grid of horizontal and vertical lines.

The grid has lines through all possible corners: beside blocks and beside other wires (Hanan 1966 shows that
such a grid contains a shortest rectilinear tree). Sweep *k* computes, for all nodes at once, the cost of the
cheapest route with *k* bends. A sweep is a running minimum along every grid line, so its time depends on the
size of the grid alone, not on the number of obstacles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
Booleans: TypeAlias = NDArray[np.bool_]
Point: TypeAlias = tuple[float, float]
Node: TypeAlias = tuple[int, int]

BEND = 34.0
"""Cost of a bend, as the equivalent detour in px."""
BLOCKED = 1e6
"""Cost of a blocked edge. A route that costs more than half of this value is not legal."""
_MAX_BENDS = 14


def grid_lines(exact: Sequence[float], candidates: Sequence[float], spacing: float) -> Floats:
    """All ``exact`` coordinates, and all ``candidates`` at least ``spacing`` from all others; sorted."""
    fixed = sorted(set(exact))
    lines, k = list(fixed), 0
    last = -np.inf
    for value in sorted(set(candidates)):
        while k < len(fixed) and fixed[k] < value:
            k += 1
        near_exact = (k < len(fixed) and fixed[k] - value < spacing) or (
            k > 0 and value - fixed[k - 1] < spacing
        )
        if near_exact or value - last < spacing:
            continue
        lines.append(value)
        last = value
    return np.array(sorted(lines))


def edge_weights(rectangles: Floats, weights: Floats, line: Floats, levels: Floats) -> Floats:
    """The sum of the weights of the open rectangles that each edge of parallel grid lines intersects.

    ``rectangles`` (n, 4): begin, end along the lines, begin, end across them. ``weights`` (n, kinds) are
    dyadic, so sums are exact. ``line`` has the coordinates of the nodes along each line, ``levels`` the
    coordinates of the lines. Returns (kinds, edges, lines). The weights are written to the corners of the
    rectangles; cumulative sums in both directions extend them to the interior (a summed-area table).
    """
    first = np.maximum(np.searchsorted(line, rectangles[:, 0], "right") - 1, 0)
    last = np.maximum(np.searchsorted(line, rectangles[:, 1], "left"), first)
    top = np.searchsorted(levels, rectangles[:, 2], "right")
    bottom = np.maximum(np.searchsorted(levels, rectangles[:, 3], "left"), top)
    width = len(levels) + 1
    size = (len(line) + 1) * width
    corners = np.concatenate(
        [first * width + top, first * width + bottom, last * width + top, last * width + bottom]
    )
    corner_weights = [
        np.bincount(corners, np.concatenate([weight, -weight, -weight, weight]), size) for weight in weights.T
    ]
    sums = np.array(corner_weights, dtype=np.float64).reshape(-1, len(line) + 1, width)
    return np.cumsum(np.cumsum(sums, axis=1), axis=2)[:, : len(line) - 1, : len(levels)]


@dataclass(frozen=True)
class Grid:
    """Grid lines, the cost of every edge, and the nodes at which a wire may bend.

    ``right`` (columns - 1, rows) and ``down`` (rows - 1, columns): costs of edges.
    ``may_bend`` (rows, columns).
    """

    xs: Floats
    ys: Floats
    right: Floats
    down: Floats
    may_bend: Booleans

    def node(self, point: Point) -> Node:
        """Row and column of a point at the intersection of two grid lines."""
        return int(np.searchsorted(self.ys, point[1])), int(np.searchsorted(self.xs, point[0]))

    def cheapest(
        self, rightwards: Floats, downwards: Floats, goal: Node, max_cost: float, *, flat: bool
    ) -> list[Point]:
        """The corners of the cheapest route to a goal; empty if there is none at a cost below ``max_cost``.

        ``rightwards`` and ``downwards`` (rows, columns): the cost of a start at a node along its row or along
        its column, infinite elsewhere. ``flat``: the route arrives along the row of the goal.
        """
        remaining = np.abs(self.ys - self.ys[goal[0]])[:, None] + np.abs(self.xs - self.xs[goal[1]])
        rows, columns = (
            _Sweeps(self.right, self.may_bend.T, remaining.T),
            _Sweeps(self.down, self.may_bend, remaining),
        )
        arriving, index = (rows, goal[::-1]) if flat else (columns, goal)
        improved = rows.sweep(rightwards.T), columns.sweep(downwards)
        best, bends = min(max_cost, BLOCKED / 2), -1
        for k in range(_MAX_BENDS):
            if (cost := float(arriving.costs[k][index])) < best:
                best, bends = cost, k
            if best <= min(rows.bound, columns.bound) + BEND:
                break
            improved = rows.bend(improved[1]), columns.bend(improved[0])
        return self._corners((rows, columns), bends, goal, 0 if flat else 1) if bends >= 0 else []

    def _corners(self, sides: tuple[_Sweeps, _Sweeps], bends: int, goal: Node, arrival: int) -> list[Point]:
        row, column, side = *goal, arrival
        points = [(float(self.xs[column]), float(self.ys[row]))]
        for k in range(bends, -1, -1):
            if side == 0:
                column = sides[0].origin(k, row, column)
            else:
                row = sides[1].origin(k, column, row)
            points.append((float(self.xs[column]), float(self.ys[row])))
            side = 1 - side
        return points[::-1]


class _Sweeps:
    """The sweeps along the rows of a grid, or along its columns. Arrays are (nodes along, lines)."""

    def __init__(self, edges: Floats, may_bend: Booleans, remaining: Floats) -> None:
        self._along = np.zeros((edges.shape[0] + 1, edges.shape[1]))
        np.cumsum(edges, axis=0, out=self._along[1:])
        self._bend_costs = np.where(may_bend, BEND, np.inf)
        self._remaining = remaining
        self._best = np.full(self._along.shape, BLOCKED / 2)
        self._start_costs: list[Floats] = []
        self.costs: list[Floats] = []
        """Cost of arriving at each node with each number of bends."""
        self.bound = np.inf
        """Lower bound of the cost of routes that continue from the latest sweep, without further bends."""

    def sweep(self, start_costs: Floats) -> Floats:
        """Sweep from these start costs; returns the costs that are new minima, infinity at all other
        nodes."""
        forwards = np.minimum.accumulate(start_costs - self._along, axis=0)
        forwards += self._along
        costs = np.minimum.accumulate((start_costs + self._along)[::-1], axis=0)[::-1] - self._along
        np.minimum(costs, forwards, out=costs)
        self._start_costs.append(start_costs)
        self.costs.append(costs)
        improved = np.where(costs < self._best, costs, np.inf)
        np.minimum(self._best, costs, out=self._best)
        self.bound = float(np.min(improved + self._remaining))
        return improved

    def bend(self, across: Floats) -> Floats:
        """Sweep after a bend from nodes with these costs in the other direction."""
        return self.sweep(across.T + self._bend_costs)

    def origin(self, k: int, line: int, node: int) -> int:
        """The node of a line at which the route with ``k`` bends to ``node`` has entered this line."""
        along = self._along[:, line]
        return int(np.argmin(self._start_costs[k][:, line] + np.abs(along - along[node])))
