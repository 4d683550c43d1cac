"""The order of events at one instant: the events of a block follow those of all blocks that it reads.

Where an event changes a signal, another block may seem to have an event because the signal has not changed
yet. An example is a trigger on the sum of a step and the output of a subsystem that the step enables. Events
at one instant are therefore processed by *rank*. The rank of a block is the largest number of blocks with
events on a path of direct feedthrough to it. Blocks with events that depend on each other in a loop have one
rank; their events are processed together.

Events on which no sampled signal acts come before the ticks of the same instant, so that sampled blocks read
the values after them. All other events come after the ticks, and have higher ranks.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from armblocks.diagram.components import strongly_connected
from armblocks.diagram.controls import EnableControl, TriggerControl
from armblocks.diagram.features import AT_TICKS, SlotKind
from armblocks.diagram.ordering import HELD, Network, Node

_EVENT_KINDS = {SlotKind.MODE, SlotKind.CONTRADICTION, SlotKind.GUARD, SlotKind.RESET}
"""The roles of equations that determine the modes and events of a block at an instant."""
_Vertex = Node | str
"""A node of the network, or the name of a block for its events and modes."""


@dataclass(frozen=True)
class EventOrder:
    """The rank of the events and modes of each block, and the highest rank before the ticks (-1: none)."""

    rank_of: Mapping[str, int]
    before_ticks: int


def event_order(network: Network) -> EventOrder | None:
    """The order of events; ``None`` if all events have one rank and come after the ticks."""
    eventful = {
        name
        for name, equations in network.equations.items()
        if any(not guard.locates for guard in equations.guards)
    }
    clocked = [name for name in network.equations if network.diagram.clocked(name)]
    if len(eventful) < (1 if clocked else 2):
        return None
    excluded = _outputs_before_events(network)
    read_inside = _read_inside_subsystems(network, excluded)
    vertices: dict[_Vertex, int] = {}
    needs: list[list[int]] = []
    pending: list[_Vertex] = []

    def number(vertex: _Vertex) -> int:
        if vertex not in vertices:
            vertices[vertex] = len(needs)
            needs.append([])
            pending.append(vertex)
        return vertices[vertex]

    for name in network.equations:
        number(name)
    readers = [
        number(node) for name in clocked for node in _read_by_groups(network, name, set(AT_TICKS), excluded)
    ]
    while pending:
        vertex = pending.pop()
        if isinstance(vertex, str):
            own = _read_by_groups(network, vertex, _EVENT_KINDS, excluded)
            found: list[_Vertex] = [*own, *read_inside.get(vertex, ())]
        else:
            found = [*_needed(network, vertex, excluded), vertex.block]
        needs[vertices[vertex]] += [number(needed) for needed in found]
    sampled = {
        index for vertex, index in vertices.items() if isinstance(vertex, Node) and vertex.group == HELD
    }
    counted = {vertices[name] for name in eventful}
    paths = _Paths(needs, counted, sampled)
    before_ticks = -1
    if any(paths.reads_free[index] for index in readers):
        before_ticks = max(paths.rank[k] for k in counted if not paths.is_sampled[k])
    ranks = {
        name: paths.rank[vertices[name]] + (before_ticks + 1) * paths.is_sampled[vertices[name]]
        for name in network.equations
    }
    if before_ticks < 0 and len({ranks[name] for name in eventful}) == 1:
        return None
    return EventOrder(ranks, before_ticks)


def _read_inside_subsystems(network: Network, excluded: set[str]) -> dict[str, list[Node]]:
    """For each control of a conditional subsystem, the nodes outside that the blocks inside read.

    A control acts on all blocks inside. Its events therefore follow those of all blocks that they read.
    """
    read_by_control: dict[str, list[Node]] = {}
    for control, block in network.diagram.blocks.items():
        if isinstance(block, EnableControl | TriggerControl):
            subsystem = control.rpartition("/")[0] + "/"
            read_by_control[control] = [
                node
                for name in network.equations
                if name.startswith(subsystem)
                for node in _read_by_groups(network, name, {SlotKind.OUTPUT, *_EVENT_KINDS}, excluded)
                if not node.block.startswith(subsystem)
            ]
    return read_by_control


def _outputs_before_events(network: Network) -> set[str]:
    """The outputs that have their values before the events of an instant."""
    return {
        f"{name}/{port.name}"
        for name, block in network.diagram.blocks.items()
        for port in block.output_ports()
        if port.before_events
    }


def _needed(network: Network, node: Node, excluded: set[str]) -> Iterator[Node]:
    """The nodes that a node reads, without these outputs."""
    return (needed for needed, path in network.needs(node) if path[-1] not in excluded)


def _read_by_groups(network: Network, name: str, kinds: set[SlotKind], excluded: set[str]) -> Iterator[Node]:
    """The nodes that the equations of these roles of a block read, without these outputs."""
    for index, group in enumerate(network.equations[name].groups):
        if any(slot.kind in kinds for slot in group.slots):
            yield from _needed(network, Node(name, index, 0), excluded)


class _Paths:
    """Properties of all paths to each vertex.

    ``rank``: the largest number of counted vertices on a path to it; loops count once. ``is_sampled``:
    whether a path begins at a sampled vertex. ``reads_free``: whether a path contains a counted vertex
    without a sampled one before it.
    """

    def __init__(self, needs: list[list[int]], counted: set[int], sampled: set[int]) -> None:
        self.rank, after = [0] * len(needs), [0] * len(needs)
        self.is_sampled, self.reads_free = [False] * len(needs), [False] * len(needs)
        for component in strongly_connected(needs):
            inside = set(component)
            others = {other for k in component for other in needs[k]} - inside
            rank = max((after[other] for other in others), default=0)
            counts = not inside.isdisjoint(counted)
            is_sampled = not inside.isdisjoint(sampled) or any(self.is_sampled[other] for other in others)
            reads_free = (counts and not is_sampled) or any(self.reads_free[other] for other in others)
            for k in component:
                self.rank[k], after[k] = rank, rank + counts
                self.is_sampled[k], self.reads_free[k] = is_sampled, reads_free
