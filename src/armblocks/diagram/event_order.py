"""The order of events and ticks at one instant: each block follows all blocks that it reads.

An event changes a signal. Before the change, another block that reads the signal may detect a false event. An
example is a trigger on the sum of a step and the output of a subsystem that the step enables. Events at one
instant are therefore processed by *rank*. The rank of a block is the largest number of blocks with events on
a path of direct feedthrough to it. Blocks with events that depend on each other in a loop have one rank;
their events are processed together.

Ticks have *levels*. The outputs of level 0 read events on which no sampled signal acts; these events come
before the ticks. Then follow the events on which outputs of level 0 act, then the ticks of level 1, which
read these events, and so on. In a loop of ticks and events the ticks come first. The discrete states of a
block are updated after all its outputs, at the level of the signals that its updates read.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from armblocks.diagram.components import strongly_connected
from armblocks.diagram.controls import EnableControl, TriggerControl
from armblocks.diagram.features import AT_TICKS, SlotKind
from armblocks.diagram.ordering import HELD, Network, Node

_EVENT_KINDS = {SlotKind.MODE, SlotKind.CONTRADICTION, SlotKind.GUARD, SlotKind.RESET}
"""The roles of equations that determine the modes and events of a block at an instant."""


@dataclass(frozen=True)
class EventOrder:
    """The order at one instant.

    ``rank_of``: the rank of the events and modes of each block. ``level_of``: the level at which the outputs
    (``SlotKind.OUTPUT``) and the discrete states (``SlotKind.UPDATE``) of each sampled block are computed.
    ``before_ticks``: for each level, the highest rank before its ticks (-1: none).
    """

    rank_of: Mapping[str, int]
    level_of: Mapping[tuple[str, SlotKind], int]
    before_ticks: tuple[int, ...]


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
    graph = _Graph(network)
    for name in network.equations:
        graph.number(name)
    ticks = {(name, kind): graph.number(_Tick(name, kind)) for name in clocked for kind in AT_TICKS}
    graph.complete()
    called = {ticks[name, SlotKind.OUTPUT] for name in clocked if network.diagram.blocks[name].called}
    places = _Places(graph.needs, {graph.vertices[name] for name in eventful}, set(ticks.values()), called)
    level_of = {tick: places.level[vertex] for tick, vertex in ticks.items()}
    position_of = {name: places.event[graph.vertices[name]] for name in network.equations}
    if not any(places.reads_events[vertex] for vertex in ticks.values()):
        # No sampled block reads an event: all events come after the ticks, in the order of their paths.
        position_of = {name: (1, places.rank[graph.vertices[name]]) for name in network.equations}
    phases = range(max(level_of.values(), default=-1) + 3)
    highest = {
        phase: max((position_of[name][1] for name in eventful if position_of[name][0] == phase), default=-1)
        for phase in phases
    }
    first_rank = [sum(highest[before] + 1 for before in range(phase)) for phase in phases]
    ranks = {name: first_rank[phase] + rank for name, (phase, rank) in position_of.items()}
    before_ticks = tuple(first_rank[level + 1] - 1 for level in range(max(level_of.values(), default=0) + 1))
    if before_ticks == (-1,) and len({ranks[name] for name in eventful}) == 1:
        return None
    return EventOrder(ranks, level_of, before_ticks)


class _Tick(NamedTuple):
    """The outputs or the discrete states of a sampled block at a tick."""

    block: str
    kind: SlotKind


_Vertex = Node | _Tick | str
"""A node of the network, a tick, or the name of a block for its events and modes."""


class _Graph:
    """The dependencies of events, ticks and signals at one instant: ``needs`` by the number of a vertex."""

    def __init__(self, network: Network) -> None:
        self.network = network
        self.vertices: dict[_Vertex, int] = {}
        self.needs: list[list[int]] = []
        self._pending: list[_Vertex] = []
        self._excluded = _outputs_before_events(network)
        self._read_inside = _read_inside_subsystems(network, self._excluded)

    def number(self, vertex: _Vertex) -> int:
        """The number of a vertex; a new vertex is added."""
        if vertex not in self.vertices:
            self.vertices[vertex] = len(self.needs)
            self.needs.append([])
            self._pending.append(vertex)
        return self.vertices[vertex]

    def complete(self) -> None:
        """Add everything on which the vertices depend."""
        while self._pending:
            vertex = self._pending.pop()
            self.needs[self.vertices[vertex]] += [self.number(needed) for needed in self._needed(vertex)]

    def _needed(self, vertex: _Vertex) -> list[_Vertex]:
        network, excluded = self.network, self._excluded
        if isinstance(vertex, str):
            own = _read_by_groups(network, vertex, _EVENT_KINDS, excluded)
            return [*own, *self._read_inside.get(vertex, ())]
        if isinstance(vertex, _Tick):
            read: list[_Vertex] = [
                *_read_by_groups(network, vertex.block, {vertex.kind}, excluded),
                vertex.block,
            ]
            return read if vertex.kind is SlotKind.OUTPUT else [*read, _Tick(vertex.block, SlotKind.OUTPUT)]
        if vertex.group == HELD:
            return [_Tick(vertex.block, SlotKind.OUTPUT)]
        return [*_needed(network, vertex, excluded), vertex.block]


def _read_inside_subsystems(network: Network, excluded: set[str]) -> dict[str, list[Node]]:
    """For each control of a conditional subsystem, the nodes outside that the blocks inside read.

    A control acts on all blocks inside. Its events therefore follow the events of all blocks that they read.
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


class _Places:
    """The places of vertices in the order of an instant, from all paths to them.

    ``rank``: the largest number of counted vertices on a path; loops count once. ``level``: the level of a
    tick. ``event``: the place of an event, the number of levels of ticks before it and its rank among the
    events after them. ``reads_events``: whether a counted vertex is on a path. The ticks ``early`` have level
    0.
    """

    def __init__(
        self, needs: Sequence[Sequence[int]], counted: set[int], ticks: set[int], early: set[int]
    ) -> None:
        count = len(needs)
        self.rank, after = [0] * count, [0] * count
        self.level, self.event = [-1] * count, [(0, 0)] * count
        self.reads_events = [False] * count
        ticked, passed = [-1] * count, [(0, 0)] * count
        for component in strongly_connected(needs):
            inside = set(component)
            others = {other for k in component for other in needs[k]} - inside
            rank = max((after[other] for other in others), default=0)
            counts = not inside.isdisjoint(counted)
            reads = counts or any(self.reads_events[other] for other in others)
            latest = max((passed[other] for other in others), default=(0, 0))
            level = max((ticked[other] for other in others), default=-1)
            if not inside.isdisjoint(ticks):
                level = max(level, 0 if inside & early else latest[0])
            event = max(latest, (level + 1, 0))
            for k in component:
                self.rank[k], after[k] = rank, rank + counts
                self.level[k], self.event[k], self.reads_events[k] = level, event, reads
                ticked[k], passed[k] = level, (event[0], event[1] + 1) if counts else latest
