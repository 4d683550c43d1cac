"""The structure of a network: the clock of each block, and the evaluation order of signals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from graphlib import TopologicalSorter
from typing import Any

import numpy as np
from reference_block import BlockNumbers, UnsupportedError

from armblocks.diagram import Diagram, PortRef

Node = tuple[str, str, str]
"""Unit of evaluation: ("out" | "rate" | "modes" | "xdot", block, port)."""


def assign_clocks(
    flat: Diagram, blocks: Mapping[str, Any], drivers: Mapping[tuple[str, str], PortRef]
) -> list[tuple[float, float]]:
    """Return periods and offsets; a block without a sample time inherits the fastest connected clock."""
    sampled = [n for n, b in flat.blocks.items() if b.sampled and "?fire" not in flat.gates.get(n, {})]
    clock_of: dict[str, tuple[float, float]] = {}
    for name in sampled:
        declared = np.atleast_1d(flat.blocks[name].parameter_value("sample_time"))
        if declared.tolist() != [-1.0]:
            clock_of[name] = (float(declared[0]), float(declared[1]) if declared.size > 1 else 0.0)
    sources: dict[str, set[str]] = {name: set() for name in flat.blocks}
    targets: dict[str, set[str]] = {name: set() for name in flat.blocks}
    for (name, _), ref in drivers.items():
        sources[name].add(ref.block)
        targets[ref.block].add(name)
    stated = dict(clock_of)
    for name in sampled:
        for step in (sources, targets):
            if name not in clock_of and (near := _reached_clocks(name, step, stated)):
                clock_of[name] = min(near)
        if name not in clock_of:
            raise UnsupportedError(f"'{name}' has no clock")
    clocks = sorted(set(clock_of.values()))
    for name, clock in clock_of.items():
        block = blocks[name]
        block.clock, block.period = clocks.index(clock), clock[0]
        block.arrays["p:T"][:] = clock[0]
    return clocks


def _reached_clocks(
    name: str, step: Mapping[str, Iterable[str]], stated: Mapping[str, tuple[float, float]]
) -> set[tuple[float, float]]:
    clocks: set[tuple[float, float]] = set()
    visited, pending = {name}, list(step[name])
    while pending:
        entry = pending.pop()
        if entry in visited:
            continue
        visited.add(entry)
        if entry in stated:
            clocks.add(stated[entry])
        else:
            pending.extend(step[entry])
    return clocks


class EvaluationOrder:
    """The evaluation order of the nodes of a network.

    ``groups``: nodes that are evaluated together, either a single node or all nodes of an algebraic loop.
    ``flowing``: the groups on which states, modes, guards, delays and gates depend, and all loops, whose
    solutions are tracked; only these are evaluated between instants. ``loops``: the groups that are algebraic
    loops. ``two_passes``: whether a mode is used before it is evaluated, so that a second pass is necessary.
    """

    def __init__(
        self,
        blocks: Mapping[str, Any],
        drivers: Mapping[tuple[str, str], PortRef],
        gates: Mapping[str, Mapping[str, PortRef]],
    ) -> None:
        self.blocks, self.drivers, self.gates = blocks, drivers, gates
        hard: dict[Node, set[Node]] = {}
        soft: dict[Node, set[Node]] = {}
        pending: list[Node] = [("out", n, port) for n, b in self.blocks.items() for port in b.outputs]
        pending += [("modes", n, "") for n, b in self.blocks.items() if b.modes]
        for name, block in self.blocks.items():
            for key in {k for entry in block.expressions for k in block.needs(*entry)}:
                if key.endswith("''"):
                    raise UnsupportedError(f"'{name}' reads a second derivative")
                if key.startswith("u:") and key.endswith("'"):
                    pending.append(self._rate_of(name, key[2:-1]))
        while pending:
            node = pending.pop()
            if node not in hard:
                hard[node], soft[node] = self.needs(node)
                pending += [*hard[node], *soft[node]]
        # A mode that depends on signals that it selects is evaluated in the next pass.
        both = {node: hard[node] | soft[node] for node in hard}
        reach = _closure(both)
        graph = {n: hard[n] | {m for m in soft[n] if n not in reach[m]} for n in hard}
        reach = _closure(graph)
        loops = {n: tuple(sorted(m for m in reach[n] if n in reach[m])) or (n,) for n in graph}
        groups = {loop: {loops[m] for n in loop for m in graph[n]} - {loop} for loop in loops.values()}
        order = list(TopologicalSorter(groups).static_order())
        self.loops = [loop for loop in order if len(loop) > 1 or loop[0] in graph[loop[0]]]
        evaluated: set[Node] = set()
        self.two_passes = False  # whether a mode is used before it is evaluated
        for loop in order:
            for node in loop:
                self.two_passes = (
                    self.two_passes
                    or bool(soft[node] - evaluated - set(loop))
                    or bool(soft[node] & set(loop))
                )
            evaluated |= set(loop)
        self.groups = order
        read = self._read_between_instants() | {node for loop in self.loops for node in loop}
        read |= {node for start in read for node in reached_from(start, both)}
        self.flowing = [loop for loop in order if not read.isdisjoint(loop)]

    def _read_between_instants(self) -> set[Node]:
        """Return the inputs of blocks with states, modes, guards or delays, and all gates."""
        nodes = {("out", ref.block, ref.port) for gate in self.gates.values() for ref in gate.values()}
        for block in self.blocks.values():
            if block.states or block.modes or block.guards or block.lines:
                ports = {*block.inputs_read, *(line.input for line in block.lines)}
                nodes |= self.inputs_of(block, {f"u:{port}" for port in ports})
        return nodes

    def needs(self, node: Node) -> tuple[set[Node], set[Node]]:
        """Return the required predecessors of a node, and the preferred ones (its modes, a restart)."""
        kind, name, port = node
        block = self.blocks[name]
        if kind == "modes":
            hard = set[Node]()
            for mode in block.modes:
                hard |= self.inputs_of(block, block.needs("mode", mode.name))
            gate = self.gates.get(name, {})
            return hard, {("out", ref.block, ref.port) for key, ref in gate.items() if key == "?on"}
        soft: set[Node] = {("modes", name, "")} if getattr(block, "modes", ()) else set()
        gate = self.gates.get(name, {})
        if block.clock is not None or block.block.sampled:
            soft |= {("out", ref.block, ref.port) for ref in gate.values()}
        if kind == "out":
            if port in block.block.time_derivatives:
                return {self._rate_of(name, block.block.time_derivatives[port])}, set()
            unknown = {node} if port in block.block.implicit_outputs else set[Node]()
            return self.inputs_of(block, block.needs("out", port)) | unknown, soft
        if kind == "rate":
            if port in block.block.time_derivatives:
                raise UnsupportedError(f"'{name}' is differentiated twice")
            if block.lines:
                raise UnsupportedError(f"the delayed signal '{name}' is differentiated")
            if block.block.sampled:
                return {("out", name, port)}, set()
            if not isinstance(block, BlockNumbers):
                if port == "elapsed":
                    raise UnsupportedError(f"the time since '{name}' is differentiated")
                rates = {self._rate_of(name, entry) for entry in block.inputs_followed(port)}
                return {("out", name, port)} | rates, soft
            keys = block.needs("out", port)
            hard = self.inputs_of(block, keys) | {("out", name, port)}
            for key in keys:
                letter, _, entry = key.partition(":")
                if letter == "u":
                    if entry.endswith("'"):
                        raise UnsupportedError(f"'{name}' reads a derivative that is differentiated")
                    hard.add(self._rate_of(name, entry))
                if letter == "x" and any(state.name == entry for state in block.states):
                    hard.add(("xdot", name, entry))
            return hard, soft
        return self.inputs_of(block, block.needs("xdot", port)), soft

    def _rate_of(self, name: str, port: str) -> Node:
        ref = self.drivers[name, port]
        return ("rate", ref.block, ref.port)

    def inputs_of(self, block: Any, keys: set[str]) -> set[Node]:
        nodes: set[Node] = set()
        for key in keys:
            letter, _, port = key.partition(":")
            if letter == "u" and port.endswith("'"):
                nodes.add(self._rate_of(block.name, port[:-1]))
            elif letter == "u":
                ref = self.drivers[block.name, port]
                nodes.add(("out", ref.block, ref.port))
        return nodes


def _closure(graph: Mapping[Node, set[Node]]) -> dict[Node, set[Node]]:
    """Return all nodes that are reachable from each node."""
    return {node: reached_from(node, graph) for node in graph}


def reached_from(node: Node, graph: Mapping[Node, set[Node]]) -> set[Node]:
    """Return all nodes that are reachable from a node."""
    closure: set[Node] = set()
    pending = list(graph[node])
    while pending:
        entry = pending.pop()
        if entry not in closure:
            closure.add(entry)
            pending += graph[entry]
    return closure
