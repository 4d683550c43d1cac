"""The order of events at one instant: the events of a block follow those of all blocks that it reads.

The rank of a block is the largest number of blocks with events on a path of direct feedthrough to it. Blocks
that depend on each other in a loop have one rank. At an instant the events of the lowest rank are processed
first; then all signals are evaluated again. Events on which no sampled block acts have lower ranks than all
others and come before the ticks.
"""

from __future__ import annotations

from collections.abc import Mapping
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


def event_ranks(order: EvaluationOrder) -> tuple[Mapping[str, int], int]:
    """The rank of each block, and the highest rank before the ticks (-1: none)."""
    blocks = order.blocks
    graph: dict[Node, set[Node]] = {}
    pending: list[Node] = [("events", name, "") for name in blocks]
    while pending:
        node = pending.pop()
        if node not in graph:
            graph[node] = _needs(order, node)
            pending += graph[node]
    for control, block in blocks.items():
        if isinstance(block, Enable | Trigger):
            inside = control.rpartition("/")[0] + "/"
            read = {
                needed
                for node in list(graph)
                if node[0] in ("events", "out") and node[1].startswith(inside)
                for needed in graph[node]
            }
            graph["events", control, ""] |= {node for node in read if not node[1].startswith(inside)}
    counted = {name for name, block in blocks.items() if has_own_events(block)}
    ranks = _ranks(graph, counted)
    sampled = {("out", name, port) for name, b in blocks.items() if b.clock is not None for port in b.outputs}
    upstream = {name: reached_from(("events", name, ""), graph) for name in blocks}
    after = {name for name in blocks if sampled & upstream[name]}
    last = max((ranks[name] for name in counted - after), default=-1)
    return {name: rank + (last + 1) * (name in after) for name, rank in ranks.items()}, last


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
    if kind == "out" and block.clock is not None:
        return {("events", name, "")}
    hard, soft = order.needs(node)
    needed = {("events", entry[1], "") if entry[0] == "modes" else entry for entry in hard | soft}
    return {("events", name, ""), *(entry for entry in needed if not _before_events(order, entry))}


def _before_events(order: EvaluationOrder, node: Node) -> bool:
    return node[0] == "out" and (type(order.blocks[node[1]].block).__name__, node[2]) in STATE_PORTS


def _ranks(graph: Mapping[Node, set[Node]], counted: set[str]) -> dict[str, int]:
    """Longest paths by repeated improvement; nodes of a loop have one rank."""
    reach = {node: reached_from(node, graph) for node in graph}
    loops = {node: frozenset({m for m in reach[node] if node in reach[m]} | {node}) for node in graph}
    ranks: dict[frozenset[Node], int] = {}

    def rank(loop: frozenset[Node]) -> int:
        return ranks.get(loop, 0)

    counts = {
        loop: any(node[0] == "events" and node[1] in counted for node in loop) for loop in loops.values()
    }
    changed = True
    while changed:
        changed = False
        for loop in set(loops.values()):
            others = {loops[needed] for node in loop for needed in graph[node]} - {loop}
            best = max((rank(other) + counts[other] for other in others), default=0)
            if best != rank(loop):
                ranks[loop], changed = best, True
    return {node[1]: rank(loop) for node, loop in loops.items() if node[0] == "events"}
