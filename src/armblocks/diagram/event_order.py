"""The order of events at one instant: the events of a block follow those of all blocks that it reads.

Where an event changes a signal, another block may seem to have an event because the signal has not changed
yet. An example is a trigger on the sum of a step and the output of a subsystem that the step enables. Events
at one instant are therefore processed by *rank*. The rank of a block is the largest number of blocks with
events on a path of direct feedthrough to it. Blocks with events that depend on each other in a loop have one
rank; their events are processed together.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from armblocks.diagram.components import strongly_connected
from armblocks.diagram.controls import EnableControl, TriggerControl
from armblocks.diagram.features import SlotKind
from armblocks.diagram.ordering import Network, Node

_EVENT_KINDS = {SlotKind.MODE, SlotKind.CONTRADICTION, SlotKind.GUARD, SlotKind.RESET}
"""The roles of equations that determine the modes and events of a block at an instant."""
_Vertex = Node | str
"""A node of the network, or the name of a block for its events and modes."""


def event_ranks(network: Network) -> Mapping[str, int]:
    """The rank of the events and modes of each block; empty if all events have one rank."""
    eventful = {
        name
        for name, equations in network.equations.items()
        if any(not guard.locates for guard in equations.guards)
    }
    if len(eventful) < 2:
        return {}
    excluded = _outputs_before_events(network)
    controls = _control_of_each_subsystem(network)
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
    while pending:
        vertex = pending.pop()
        if isinstance(vertex, str):
            found: list[_Vertex] = [*_read_by_groups(network, vertex, _EVENT_KINDS, excluded)]
        else:
            found = [*_needed(network, vertex, excluded), vertex.block]
        needs[vertices[vertex]] += [number(needed) for needed in found]
    for name in network.equations:
        for subsystem, control in controls.items():
            if name.startswith(subsystem):
                read = _read_by_groups(network, name, {SlotKind.OUTPUT, *_EVENT_KINDS}, excluded)
                outside = [node for node in read if not node.block.startswith(subsystem)]
                needs[vertices[control]] += [vertices[node] for node in outside if node in vertices]
    ranks = _longest_paths(needs, {vertices[name] for name in eventful})
    if len({ranks[vertices[name]] for name in eventful}) == 1:
        return {}
    return {name: ranks[vertices[name]] for name in network.equations}


def _control_of_each_subsystem(network: Network) -> dict[str, str]:
    """The control blocks of conditional subsystems, by the beginning of the names of the blocks inside.

    A control acts on all blocks inside. Its events therefore follow those of all blocks that they read.
    """
    return {
        name.rpartition("/")[0] + "/": name
        for name, block in network.diagram.blocks.items()
        if isinstance(block, EnableControl | TriggerControl)
    }


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


def _longest_paths(needs: list[list[int]], counted: set[int]) -> list[int]:
    """For each vertex the largest number of counted vertices on a path to it; loops count once."""
    ranks, after = [0] * len(needs), [0] * len(needs)
    for component in strongly_connected(needs):
        inside = set(component)
        rank = max((after[other] for k in component for other in needs[k] if other not in inside), default=0)
        for k in component:
            ranks[k] = rank
            after[k] = rank + (not inside.isdisjoint(counted))
    return ranks
