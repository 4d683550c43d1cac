"""Symbolic analysis of a sparse Gaussian elimination: pivot order and fill-in, without numbers or LLVM.

The matrix ``diagonal - h J`` of a stiff step has the same sparsity pattern at every step, so the analysis is
done once. Pivots are on the diagonal. Every step checks the accuracy of the solution numerically.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class JacobianPattern:
    """The sparsity pattern of the derivatives of ``(f, g)`` with respect to ``(x, w)``: entry k at rows[k],
    columns[k].

    The first ``states`` rows and columns belong to the flow, all others to the implicit equations.
    """

    states: int
    size: int
    rows: tuple[int, ...]
    columns: tuple[int, ...]


@dataclass(frozen=True, kw_only=True)
class Elimination:
    """``A = L U`` with the unknowns in the order ``columns[0], columns[1], …``. A place is an
    index in this order.

    Row ``i`` is equation ``equations[i]``. ``entries[i]`` are pairs of an entry of J and its place in row i.
    ``lower[i]`` and ``upper[i]`` are the places of the entries of L and U in row i without the diagonal, in
    ascending order.
    """

    columns: tuple[int, ...]
    equations: tuple[int, ...]
    entries: tuple[tuple[tuple[int, int], ...], ...]
    lower: tuple[tuple[int, ...], ...]
    upper: tuple[tuple[int, ...], ...]

    @property
    def filled(self) -> int:
        """Number of entries of L and U together."""
        return len(self.columns) + sum(map(len, self.lower)) + sum(map(len, self.upper))


def plan_elimination(pattern: JacobianPattern) -> Elimination:
    """The elimination in minimum-degree order, which limits the fill-in (George, Liu, *Computer
    Solution of Large Sparse Positive Definite Systems*, chapter 5).

    An implicit equation is assigned to an unknown by bipartite matching, because its diagonal entry may be
    zero.
    """
    equation_of = _match_equations(pattern)
    place_of = {equation: place for place, equation in enumerate(equation_of)}
    neighbours: list[set[int]] = [set() for _ in range(pattern.size)]
    by_row: list[list[tuple[int, int]]] = [[] for _ in range(pattern.size)]
    for entry, (row, column) in enumerate(zip(pattern.rows, pattern.columns)):
        place = place_of[row]
        by_row[place].append((entry, column))
        if place != column:
            neighbours[place].add(column)
            neighbours[column].add(place)
    order = _minimum_degree_order(neighbours)
    position = {place: i for i, place in enumerate(order)}
    entries = [tuple((entry, position[column]) for entry, column in by_row[place]) for place in order]
    lower: list[tuple[int, ...]] = []
    upper: list[tuple[int, ...]] = []
    for i, row in enumerate(entries):
        filled = {place for _, place in row}
        pending = [place for place in filled if place < i]
        heapq.heapify(pending)
        eliminated: list[int] = []
        while pending:
            k = heapq.heappop(pending)
            eliminated.append(k)
            for place in upper[k]:
                if place not in filled:
                    filled.add(place)
                    if place < i:
                        heapq.heappush(pending, place)
        lower.append(tuple(eliminated))
        upper.append(tuple(sorted(place for place in filled if place > i)))
    return Elimination(
        columns=tuple(order),
        equations=tuple(equation_of[place] for place in order),
        entries=tuple(entries),
        lower=tuple(lower),
        upper=tuple(upper),
    )


def _match_equations(pattern: JacobianPattern) -> list[int]:
    """The equation of every unknown: the derivative of a state, or an implicit equation by augmenting paths.

    Where no complete matching exists, the remaining unknowns get arbitrary equations. The matrix is then
    singular, which the numerical check detects.
    """
    n, size = pattern.states, pattern.size
    equation_of = list(range(n)) + [-1] * (size - n)
    unknowns: list[list[int]] = [[] for _ in range(size)]
    for row, column in zip(pattern.rows, pattern.columns):
        if row >= n and column >= n:
            unknowns[row].append(column)
    for start in range(n, size):
        reached: dict[int, int] = {}  # each unknown with the equation from which it was reached
        queue = [start]
        free = -1
        while queue and free < 0:
            equation = queue.pop()
            for unknown in unknowns[equation]:
                if unknown in reached:
                    continue
                reached[unknown] = equation
                if equation_of[unknown] < 0:
                    free = unknown
                    break
                queue.append(equation_of[unknown])
        while free >= 0:
            equation = reached[free]
            before = next((place for place in range(n, size) if equation_of[place] == equation), -1)
            equation_of[free] = equation
            free = before
    left = sorted(set(range(size)) - set(equation_of))
    return [left.pop() if equation < 0 else equation for equation in equation_of]


def _minimum_degree_order(neighbours: Sequence[set[int]]) -> list[int]:
    """Repeatedly eliminate an unknown with the fewest neighbours, and connect its neighbours to each
    other."""
    adjacency = [set(adjacent) for adjacent in neighbours]
    heap = [(len(adjacent), place) for place, adjacent in enumerate(adjacency)]
    heapq.heapify(heap)
    order: list[int] = []
    done = [False] * len(adjacency)
    remaining = len(adjacency)
    while heap:
        degree, place = heapq.heappop(heap)
        if done[place] or degree != len(adjacency[place]):
            continue
        done[place] = True
        order.append(place)
        adjacent = adjacency[place]
        remaining -= 1
        if len(adjacent) == remaining:
            # The remaining unknowns are fully connected: all orders have the same fill-in.
            order.extend(sorted(adjacent))
            break
        for other in adjacent:
            adjacency[other] |= adjacent
            adjacency[other] -= {other, place}
            heapq.heappush(heap, (len(adjacency[other]), other))
        adjacency[place] = set()
    return order
