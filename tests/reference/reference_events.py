"""The order of events and ticks at one instant: each block follows all blocks that it reads.

The rank of a block is the largest number of blocks with events on a path of direct feedthrough to it. Blocks
that depend on each other in a loop have one rank. At an instant the events of the lowest rank are processed
first; then all signals are evaluated again. Events and levels of ticks alternate: level 0 follows the events
on which no sampled block acts, level 1 those on which level 0 acts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from reference_block import BlockNumbers
from reference_controls import Enable, Trigger
from reference_order import EvaluationOrder, Node, reached_from

EVENT_KINDS = ("mode", "quantity", "guard", "reset")
STATE_PORTS = {("ResettableIntegrator", "state"), ("DiscreteIntegrator", "state")}
"""Outputs that have the value before the events of their block."""


def has_own_events(block: Any) -> bool:
    """Whether a block has events that do more than to locate changes of modes."""
    if not isinstance(block, BlockNumbers):
        return isinstance(block, Enable | Trigger)
    return not block.block.following_modes and any(not guard.locates for guard in block.guards)


@dataclass(frozen=True)
class InstantOrder:
    """The order of events and ticks at one instant.

    ``ranks``: the rank of the events of each block. ``output_level``, ``update_level``: the levels of the
    outputs and of the discrete states of each sampled block. ``ranks_before_level``: for each level, the
    highest rank of the events before it (-1: none).
    """

    ranks: Mapping[str, int]
    output_level: Mapping[str, int]
    update_level: Mapping[str, int]
    ranks_before_level: tuple[int, ...]

    def last_rank_after(self, level: int) -> float:
        """The highest rank of the events before the next level of ticks."""
        return (*self.ranks_before_level, math.inf)[level + 1]


def instant_order(order: EvaluationOrder) -> InstantOrder:
    """The order of events and ticks, by repeated improvement.

    Every node has a place ``(level, rank)``. An event that reads ticks of level ``k`` has at least the place
    ``(k + 1, 0)``; a tick that reads events at ``(k, rank)`` has at least the level ``k``.
    """
    graph = _graph(order)
    loops = _loops(graph)
    counted = {("events", name, "") for name, block in order.blocks.items() if has_own_events(block)}
    ticks = {node for node in graph if node[0] in ("tick", "update")}
    place: dict[frozenset[Node], tuple[int, int]] = dict.fromkeys(loops.values(), (0, 0))
    level: dict[frozenset[Node], int] = dict.fromkeys(loops.values(), -1)

    def passed(loop: frozenset[Node]) -> tuple[int, int]:
        """The place behind the events of a loop of nodes and of all that it reads."""
        own = (place[loop][0], place[loop][1] + 1) if loop & counted else (0, 0)
        return max((own, *(behind[other] for other in read[loop])))

    read = {loop: {loops[m] for node in loop for m in graph[node]} - {loop} for loop in set(loops.values())}
    behind = dict.fromkeys(read, (0, 0))
    changed = True
    while changed:
        changed = False
        for loop, others in read.items():
            latest = max((behind[other] for other in others), default=(0, 0))
            ticked = max((level[other] for other in others), default=-1)
            if loop & ticks:
                ticked = max(ticked, latest[0])
            new = max(latest, (ticked + 1, 0))
            if (ticked, new) != (level[loop], place[loop]):
                level[loop], place[loop], changed = ticked, new, True
            if passed(loop) != behind[loop]:
                behind[loop], changed = passed(loop), True
    places = {name: place[loops["events", name, ""]] for name in order.blocks}
    steps = sorted(set(places.values()))
    levels = range(max((level[loops[node]] for node in ticks), default=-1) + 1)
    eventful = {places[name] for _, name, _ in counted}
    return InstantOrder(
        ranks={name: steps.index(step) for name, step in places.items()},
        output_level={node[1]: level[loops[node]] for node in ticks if node[0] == "tick"},
        update_level={node[1]: level[loops[node]] for node in ticks if node[0] == "update"},
        ranks_before_level=tuple(
            max((steps.index(step) for step in eventful if step[0] <= k), default=-1) for k in levels
        ),
    )


def _graph(order: EvaluationOrder) -> dict[Node, set[Node]]:
    """The nodes that each node reads: events, outputs and states of blocks, and the ticks of outputs."""
    graph: dict[Node, set[Node]] = {}
    pending: list[Node] = [("events", name, "") for name in order.blocks]
    pending += [("update", name, "") for name, block in order.blocks.items() if block.clock is not None]
    while pending:
        node = pending.pop()
        if node not in graph:
            graph[node] = _needs(order, node)
            pending += graph[node]
    for control, block in order.blocks.items():
        if isinstance(block, Enable | Trigger):
            inside = control.rpartition("/")[0] + "/"
            read = {
                needed
                for node in list(graph)
                if node[0] in ("events", "out", "tick") and node[1].startswith(inside)
                for needed in graph[node]
            }
            graph["events", control, ""] |= {node for node in read if not node[1].startswith(inside)}
    return graph


def _needs(order: EvaluationOrder, node: Node) -> set[Node]:
    kind, name, _ = node
    block = order.blocks[name]
    if kind == "events":
        if isinstance(block, BlockNumbers):
            keys = {
                key for entry in block.expressions if entry[0] in EVENT_KINDS for key in block.needs(*entry)
            }
        else:
            keys = {f"u:{entry}" for entry in block.inputs_read}
        gates = {("out", ref.block, ref.port) for ref in order.gates.get(name, {}).values()}
        return {entry for entry in order.inputs_of(block, keys) | gates if not _before_events(order, entry)}
    if kind in ("tick", "update"):
        role = "out" if kind == "tick" else "update"
        gates = {("out", ref.block, ref.port) for ref in order.gates.get(name, {}).values()}
        keys = {key for entry in block.expressions if entry[0] == role for key in block.needs(*entry)}
        needed = {entry for entry in order.inputs_of(block, keys) | gates if not _before_events(order, entry)}
        return {("events", name, ""), *needed} | ({("tick", name, "")} if kind == "update" else set())
    if kind == "out" and block.clock is not None:
        return {("tick", name, "")}
    hard, soft = order.needs(node)
    needed = {("events", entry[1], "") if entry[0] == "modes" else entry for entry in hard | soft}
    return {("events", name, ""), *(entry for entry in needed if not _before_events(order, entry))}


def _before_events(order: EvaluationOrder, node: Node) -> bool:
    return node[0] == "out" and (type(order.blocks[node[1]].block).__name__, node[2]) in STATE_PORTS


def _loops(graph: Mapping[Node, set[Node]]) -> dict[Node, frozenset[Node]]:
    """For each node the nodes that depend on it and on which it depends, and itself."""
    reach = {node: reached_from(node, graph) for node in graph}
    return {node: frozenset({m for m in reach[node] if node in reach[m]} | {node}) for node in graph}
