"""Strongly connected components of a graph."""

from __future__ import annotations

from collections.abc import Sequence


def strongly_connected(needs: Sequence[Sequence[int]]) -> list[list[int]]:
    """The strongly connected components of a dependency graph, dependencies first (Tarjan, iterative)."""
    count = len(needs)
    number: dict[int, int] = {}
    lowest: dict[int, int] = {}
    stack: list[int] = []
    closed: set[int] = set()
    components: list[list[int]] = []
    for root in range(count):
        if root in number:
            continue
        path = [(root, iter(needs[root]))]
        number[root] = lowest[root] = len(number)
        stack.append(root)
        while path:
            node, rest = path[-1]
            following = next(rest, None)
            if following is None:
                path.pop()
                if path:
                    lowest[path[-1][0]] = min(lowest[path[-1][0]], lowest[node])
                if lowest[node] == number[node]:
                    index = stack.index(node)
                    components.append(sorted(stack[index:]))
                    closed.update(stack[index:])
                    del stack[index:]
            elif following not in number:
                number[following] = lowest[following] = len(number)
                stack.append(following)
                path.append((following, iter(needs[following])))
            elif following not in closed:
                lowest[node] = min(lowest[node], number[following])
    return components
