"""The evaluation order of the groups of a diagram's blocks, and the algebraic loops."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from armblocks.diagram.block_equations import BlockEquations
from armblocks.diagram.diagram import Diagram
from armblocks.diagram.features import AT_TICKS, SlotKind
from armblocks.diagram.port import PortRef
from armblocks.errors import AlgebraicLoopError

HELD = -1
"""The group of held outputs of a sampled block: these values are known between ticks without evaluation."""


class Node(NamedTuple):
    """The ``order``-th time derivative of one group of one block; order 0 is the value itself."""

    block: str
    group: int
    order: int


class Value(NamedTuple):
    """The location of a signal's value: a slot of a node."""

    node: Node
    kind: SlotKind
    name: str


@dataclass(frozen=True)
class Network:
    """The dependency graph of a diagram with the equations of its blocks.

    Between ticks sampled blocks hold their outputs; at a tick (``ticking``) they compute them.
    """

    diagram: Diagram
    equations: Mapping[str, BlockEquations]
    ticking: bool = False

    def route(self, ref: PortRef) -> tuple[PortRef, ...]:
        """Follow derivative ports back to the port whose equations are differentiated."""
        route = {ref: None}
        while ref.port in self.diagram.blocks[ref.block].time_derivatives:
            source = self.diagram.blocks[ref.block].time_derivatives[ref.port]
            ref = self.diagram.drivers[PortRef(ref.block, source)]
            if ref in route:
                loop = [str(entry) for entry in route][::-1]
                raise AlgebraicLoopError(loop, where=f"diagram '{self.diagram.name}'")
            route[ref] = None
        return tuple(route)

    def output(self, ref: PortRef, order: int = 0) -> Value:
        """The location of an output port's value. A derivative port adds one derivative order."""
        route = self.route(ref)
        ref, order = route[-1], order + len(route) - 1
        block, port = self.diagram.blocks[ref.block], ref.port
        while order and (rate := block.output_rate(port)):
            port, order = rate, order - 1
        if self.diagram.clocked(ref.block) and (order or not self.ticking):
            return Value(Node(ref.block, HELD, order), SlotKind.OUTPUT, port)
        return self.slot(ref.block, SlotKind.OUTPUT, port, order)

    def input(self, block: str, port: str, order: int = 0) -> Value:
        """The location of an input port's value; ``u'`` is the derivative of the input ``u``."""
        if port.endswith("'"):
            return self.input(block, port[:-1], order + 1)
        return self.output(self.diagram.source(block, port), order)

    def state_rate(self, block: str, state: str, order: int) -> Value:
        """The location of the ``order``-th (at least first) derivative of a state."""
        return self.slot(block, SlotKind.DERIVATIVE, state, order - 1)

    def needs(self, node: Node) -> Iterator[tuple[Node, tuple[str, ...]]]:
        """The nodes on which a node depends, each with the paths of the signals to it."""
        if node.group == HELD:
            return
        group = self.equations[node.block].groups[node.group]
        for order in range(node.order + 1):
            for port in group.inputs:
                ref = self.diagram.source(node.block, port.rstrip("'"))
                yield self.input(node.block, port, order).node, tuple(str(entry) for entry in self.route(ref))
            if order:
                for state in group.states:
                    yield self.state_rate(node.block, state, order).node, (f"{node.block}/{state}'",)

    def roots(self) -> Iterator[Node]:
        """The required nodes: all groups and derivative ports, at a tick only of sampled blocks."""
        for name, block in self.diagram.blocks.items():
            clocked = self.diagram.clocked(name)
            if clocked and not self.ticking:
                yield Node(name, HELD, 0)
                # Equations of a sampled block between its ticks, such as those of its modes and guards.
                for (kind, _), index in self.equations[name].group_of.items():
                    if kind not in AT_TICKS:
                        yield Node(name, index, 0)
            if clocked is not self.ticking:
                continue
            for index in range(len(self.equations[name].groups)):
                yield Node(name, index, 0)
            for port in block.time_derivatives:
                yield self.output(PortRef(name, port)).node

    def slot(self, block: str, kind: SlotKind, name: str, order: int = 0) -> Value:
        """The location of the value of a slot of a block, or of its ``order``-th time derivative."""
        return Value(Node(block, self.equations[block].group_of[kind, name], order), kind, name)


@dataclass(frozen=True)
class Evaluation:
    """All nodes in dependency order, and the loops among them.

    A loop is a node that depends on itself, with the signals around the loop in signal-flow order. Nodes that
    are evaluated before it read an unknown instead of its value.
    """

    order: tuple[Node, ...]
    loops: Mapping[Node, tuple[str, ...]]
    sums: frozenset[Node] = frozenset()
    """Loop nodes whose outputs are unknowns for all readers."""


def evaluation_order(network: Network, sums: Mapping[Node, tuple[str, ...]] | None = None) -> Evaluation:
    """The evaluation order of the nodes. It does not depend on the order in which a diagram was built.

    ``sums`` are nodes at which loops are cut first, each with its loop; remaining loops are cut where they
    close.

    The search is depth-first and iterative, so that chains may be long.

    Raises ``AlgebraicLoopError`` for a loop with unbounded orders of differentiation: a group depends on
    itself in a higher order. At a tick, also raises it for a loop through a sampled block without delay.
    """
    order: list[Node] = []
    loops: dict[Node, tuple[str, ...]] = {}
    done: set[Node] = set()
    where = f"diagram '{network.diagram.name}'"
    sums = sums or {}
    for root in (*network.roots(), *sums):
        if root in done:
            continue
        path: list[tuple[Node, tuple[str, ...]]] = [(root, ())]
        pending = [network.needs(root)]
        open_orders: dict[tuple[str, int], list[int]] = {(root.block, root.group): [root.order]}
        while path:
            step = next(pending[-1], None)
            if step is None:
                node, _ = path.pop()
                pending.pop()
                open_orders[node.block, node.group].pop()
                done.add(node)
                order.append(node)
                continue
            node, _ = step
            if node in done or node in sums:
                continue
            orders = open_orders.setdefault((node.block, node.group), [])
            if orders and node.order > min(orders):
                raise AlgebraicLoopError(_loop(path, step), where=where)
            if node.order in orders:
                loop = _loop(path, step)
                if network.ticking and any(
                    network.diagram.clocked(entry.rsplit("/", 1)[0]) for entry in loop
                ):
                    raise AlgebraicLoopError(
                        loop,
                        where=where,
                        allowed="each loop through sampled blocks contains a delay",
                        fix="put a Unit Delay into the loop",
                    )
                loops.setdefault(node, tuple(loop))
                continue
            orders.append(node.order)
            path.append(step)
            pending.append(network.needs(node))
    return Evaluation(tuple(order), {**loops, **sums}, frozenset(sums))


def _loop(path: list[tuple[Node, tuple[str, ...]]], closing: tuple[Node, tuple[str, ...]]) -> list[str]:
    """The signals of the loop, from the last visit of the closing node's group, in signal-flow order."""
    node = closing[0]
    start = max(
        index
        for index, (entry, _) in enumerate(path)
        if (entry.block, entry.group) == (node.block, node.group) and entry.order <= node.order
    )
    signals = [entry for _, labels in (*path[start + 1 :], closing) for entry in labels]
    return signals[::-1]
