"""The links of a diagram that run against the signal flow.

Every loop is cut at the links that are conventionally drawn backwards: into the minus of a sum, or out of an
integrator.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from armblocks.drawing.arrangement.links import Link, Network

_START_WEIGHT = 2.0
_MIRRORED_STATE_WEIGHT = 1.5
"""Weight of a block that only backward links feed, and of a plant that feeds only backward links."""
_ENTRY_WEIGHT = 0.2
"""Weight of a block before the one at which signals enter a loop from outside."""
_PASSES = 8
_MAX_EXHAUSTIVE_BLOCKS = 40
"""A search starts from every block of a loop with at most this number of blocks."""
_MAX_FULL_PASS_BLOCKS = 150
"""A loop with more blocks is improved in fewer passes."""


def cut_links(network: Network) -> frozenset[int]:
    """The numbers of the backward links; the other links form no loop."""
    links, count = network.links, len(network.names)
    rank = [0] * count
    for members in _strong_components(count, links):
        if len(members) > 1:
            for k, member in enumerate(_cheapest_order(members, network)):
                rank[member] = k
    loops = {member: k for k, members in enumerate(_strong_components(count, links)) for member in members}
    cut = {
        k
        for k, link in enumerate(links)
        if loops[link.source] == loops[link.target] and rank[link.source] >= rank[link.target]
    }
    # A link is cut only if it closes a loop of links that are not cut.
    for k in sorted(cut, key=lambda k: (-links[k].weight, k)):
        link = links[k]
        if link.source == link.target:
            continue
        if not _reaches(link.target, link.source, count, [a for j, a in enumerate(links) if j not in cut]):
            cut.discard(k)
    return frozenset(cut)


def _strong_components(count: int, links: Sequence[Link]) -> list[list[int]]:
    """The strongly connected components (Tarjan 1972)."""
    after: list[list[int]] = [[] for _ in range(count)]
    for link in links:
        after[link.source].append(link.target)
    components: list[list[int]] = []
    index, low, on_stack, path = [-1] * count, [0] * count, [False] * count, list[int]()
    number = 0
    for root in range(count):
        if index[root] >= 0:
            continue
        stack = [(root, 0)]
        while stack:
            node, k = stack.pop()
            if k == 0:
                index[node] = low[node] = number
                number += 1
                path.append(node)
                on_stack[node] = True
            elif on_stack[after[node][k - 1]]:
                low[node] = min(low[node], low[after[node][k - 1]])
            if k < len(after[node]):
                stack.append((node, k + 1))
                if index[after[node][k]] < 0:
                    stack.append((after[node][k], 0))
                continue
            if low[node] == index[node]:
                members: list[int] = []
                while not members or members[-1] != node:
                    members.append(path.pop())
                    on_stack[members[-1]] = False
                components.append(sorted(members))
    return components


def _cheapest_order(members: Sequence[int], network: Network) -> list[int]:
    """The blocks of a loop in the order with the lowest weight of backward links.

    The order comes from a depth-first search and is improved by moving single blocks. For a small loop it is
    the best result of searches from every block.
    """
    links = network.links
    inside = set(members)
    weight: dict[int, dict[int, float]] = {member: {} for member in members}
    entries: list[int] = []
    for link in links:
        if link.target not in inside or link.source == link.target:
            continue
        if link.source in inside:
            weights = weight[link.source]
            weights[link.target] = weights.get(link.target, 0.0) + link.weight
        elif link.target not in entries and not network.is_constant(link.source):
            entries.append(link.target)
    _protect_inputs(weight, network)
    after = {member: list(weights) for member, weights in weight.items()}
    if len(members) <= _MAX_FULL_PASS_BLOCKS:
        for entry in entries:
            for member in members:
                if member != entry:
                    weight[entry][member] = weight[entry].get(member, 0.0) + _ENTRY_WEIGHT
    before: dict[int, dict[int, float]] = {member: {} for member in members}
    for source, weights in weight.items():
        for target, value in weights.items():
            before[target][source] = value
    fed_from_outside = frozenset(
        link.target for link in links if link.target in inside and link.source not in inside
    )
    best: list[int] = []
    lowest_cost = float("inf")
    for start in ([], *([member] for member in members if len(members) <= _MAX_EXHAUSTIVE_BLOCKS)):
        order = _depth_first([*start, *sorted(entries), *members], after)
        for _ in range(_PASSES if len(members) <= _MAX_FULL_PASS_BLOCKS else 2):
            moved = False
            for member in list(order):
                moved |= _move_block(order, member, weight[member], before[member])
            if not moved:
                break
        cost = _cost(order, weight, network, fed_from_outside)
        if cost < lowest_cost - 1e-6:
            best, lowest_cost = order, cost
    return best


def _protect_inputs(weight: Mapping[int, dict[int, float]], network: Network) -> None:
    """Make the weight of a cut before a function higher than the weight of a cut after it."""
    sources: dict[int, list[int]] = {member: [] for member in weight}
    for source, weights in weight.items():
        for target in weights:
            sources[target].append(source)
    for member, feeding in sources.items():
        if len(feeding) == 1 == len(network.boxes[member].inputs) and not network.is_state(member):
            output_weight = sum(weight[member].values()) + _ENTRY_WEIGHT
            weight[feeding[0]][member] = max(weight[feeding[0]][member], output_weight)


def _cost(
    order: Sequence[int],
    weight: Mapping[int, Mapping[int, float]],
    network: Network,
    fed_from_outside: frozenset[int],
) -> float:
    """The weight of the backward links, and of blocks with no other input or no other output.

    ``fed_from_outside``: the blocks with an input from outside the loop.
    """
    rank = {member: k for k, member in enumerate(order)}
    fed: set[int] = set(fed_from_outside)
    feeding: set[int] = set()
    cost = 0.0
    for source, weights in weight.items():
        for target, value in weights.items():
            if rank[target] < rank[source]:
                cost += value
            elif value > _ENTRY_WEIGHT:
                fed.add(target)
                feeding.add(source)
    outside = {link.source for link in network.links if link.target not in rank}
    cost += _START_WEIGHT * sum(member not in fed for member in order)
    states = {member for member in order if network.is_state(member)}
    return cost + _MIRRORED_STATE_WEIGHT * len(states - feeding - outside)


def _depth_first(roots: Sequence[int], after: Mapping[int, Sequence[int]]) -> list[int]:
    """The blocks in the reverse postorder of a depth-first search."""
    visited: set[int] = set()
    order: list[int] = []
    for root in roots:
        if root in visited:
            continue
        visited.add(root)
        stack = [(root, iter(after[root]))]
        while stack:
            node, targets = stack[-1]
            target = next((t for t in targets if t not in visited), None)
            if target is None:
                stack.pop()
                order.append(node)
            else:
                visited.add(target)
                stack.append((target, iter(after[target])))
        # Blocks of later roots precede blocks of earlier roots, unless a link requires the opposite order.
    return order[::-1]


def _move_block(order: list[int], member: int, after: dict[int, float], before: dict[int, float]) -> bool:
    """Move one block to the index where its backward links are cheapest; return whether it has moved."""
    old_index = order.index(member)
    others = [other for other in order if other != member]
    cost = sum(before.values())  # at the beginning, all links into the block run backwards
    costs = [cost]
    for other in others:
        cost += after.get(other, 0.0) - before.get(other, 0.0)
        costs.append(cost)
    best = min(range(len(costs)), key=lambda k: (round(costs[k], 6), abs(k - old_index)))
    if costs[best] > costs[old_index] - 1e-6:
        return False
    order[:] = [*others[:best], member, *others[best:]]
    return True


def _reaches(start: int, goal: int, count: int, links: Sequence[Link]) -> bool:
    after: list[list[int]] = [[] for _ in range(count)]
    for link in links:
        after[link.source].append(link.target)
    visited, stack = {start}, [start]
    while stack:
        node = stack.pop()
        if node == goal:
            return True
        for target in after[node]:
            if target not in visited:
                visited.add(target)
                stack.append(target)
    return False
