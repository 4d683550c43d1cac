"""The signal flow of a diagram: the links that run backwards, and the blocks that are mirrored.

A block is in the feedback path under two conditions: all its output paths lead to backward links, and its
inputs come from the loop that these links close. Blocks in feedback paths are mirrored: their inputs are on
the right.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armblocks.drawing.arrangement.links import Link, Network
from armblocks.drawing.arrangement.loops import cut_links


@dataclass(frozen=True)
class Flow:
    """The links that run against the flow, and the blocks in feedback paths, by number."""

    cut: frozenset[int]
    mirrored: frozenset[int]


def signal_flow(network: Network) -> Flow:
    """The links at which the loops of a network are cut, and the blocks that are mirrored."""
    cut = cut_links(network)
    return Flow(cut, _FeedbackBlocks(network, cut).blocks())


def forward_order(count: int, links: Sequence[Link]) -> list[int]:
    """The blocks in an order in which every link runs forward; the links have no loops."""
    after: list[list[int]] = [[] for _ in range(count)]
    open_inputs = [0] * count
    for link in links:
        after[link.source].append(link.target)
        open_inputs[link.target] += 1
    ready = [k for k in range(count) if not open_inputs[k]]
    order: list[int] = []
    for node in ready:
        order.append(node)
        for target in after[node]:
            open_inputs[target] -= 1
            if not open_inputs[target]:
                ready.append(target)
    return order


class _FeedbackBlocks:
    def __init__(self, network: Network, cut: frozenset[int]) -> None:
        self._network, self._links, self._cut = network, network.links, cut
        count = len(network.names)
        self._order = forward_order(count, [link for k, link in enumerate(network.links) if k not in cut])
        self._leaving: list[list[int]] = [[] for _ in range(count)]
        self._entering: list[list[int]] = [[] for _ in range(count)]
        for k, link in enumerate(network.links):
            self._leaving[link.source].append(k)
            self._entering[link.target].append(k)
        self._reachable = [0] * count
        """For each block the set of blocks that forward links lead to, as the bits of an integer."""
        for node in reversed(self._order):
            for k in self._leaving[node]:
                if k not in cut:
                    target = network.links[k].target
                    self._reachable[node] |= self._reachable[target] | 1 << target

    def blocks(self) -> frozenset[int]:
        """The blocks in feedback paths."""
        ends = sum(1 << end for end in self._ends())
        candidates = {
            node
            for node in self._order
            if not (self._reachable[node] | 1 << node) & ends
            and (self._entering[node] or self._network.may_be_mirrored(node))
        }
        while True:
            goals = self._goals(candidates)
            remaining = {node for node in candidates if self._belongs(node, goals)}
            if remaining == candidates:
                remaining = candidates - self._parallel_models(candidates)
            if remaining == candidates:
                return frozenset(candidates)
            candidates = remaining

    def _ends(self) -> list[int]:
        """The blocks to which the forward path leads: sinks, else integrators at the end of the path."""
        sinks = [node for node, links in enumerate(self._leaving) if not links]
        if sinks:
            return sinks
        last = [node for node, links in enumerate(self._leaving) if all(k in self._cut for k in links)]
        memory = self._network.memory()
        return [node for node in last if memory[node]] or last

    def _goals(self, candidates: set[int]) -> dict[int, frozenset[int]]:
        """For every candidate, the targets of the backward links to which its paths lead.

        -1: a block that is not a candidate.
        """
        goals: dict[int, frozenset[int]] = {}
        for node in reversed(self._order):
            if node in candidates:
                targets: set[int] = set()
                for k in self._leaving[node]:
                    target = self._links[k].target
                    targets |= {target} if k in self._cut else goals.get(target, {-1})
                goals[node] = frozenset(targets)
        return goals

    def _belongs(self, node: int, goals: dict[int, frozenset[int]]) -> bool:
        """Whether the inputs of a block come from the loops that its outputs close."""
        if -1 in goals[node] or node in goals[node]:
            return False
        for k in self._entering[node]:
            source = self._links[k].source
            if k in self._cut:
                return False
            if source in goals:
                continue
            is_local = len(self._entering[node]) == 1 and goals[node] == frozenset([source])
            if is_local and all(link in self._cut for link in self._leaving[node]):
                continue
            if not all(self._reachable[goal] >> source & 1 for goal in goals[node]):
                return False
        return True

    def _parallel_models(self, candidates: set[int]) -> set[int]:
        """Models parallel to the forward path, and the blocks that compare their outputs with the path."""
        memory = self._network.memory()
        parallel: set[int] = set()
        for node in sorted(candidates):
            sources = [self._links[k].source for k in self._entering[node]]
            outside = [source for source in sources if source not in candidates]
            for source in sources:
                chain: list[int] = []
                while source in candidates and len(self._entering[source]) == 1:
                    chain.append(source)
                    source = self._links[self._entering[source][0]].source
                has_state = any(memory[k] for k in chain)
                if has_state and any(self._reachable[source] >> other & 1 for other in outside):
                    parallel |= {node, *chain}
        return parallel
