"""A checked diagram as one set of equations: the only thing that passes on to the numerics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from casadi import SX, vertcat, vertsplit

from armblocks.diagram.block import Signals
from armblocks.diagram.block_equations import (
    BlockEquations,
    BlockSlot,
    SlotKind,
    block_equations,
    natural,
    spread,
    tunable_slots,
)
from armblocks.diagram.diagram import Diagram
from armblocks.diagram.ordering import Network, Node, Value, evaluation_order
from armblocks.diagram.port import PortRef
from armblocks.diagram.shapes import DiagramShapes, infer_shapes
from armblocks.diagram.units import infer_units
from armblocks.equations import HybridSystem, Signature, Slot, TracedFunction, continuous_system, signature
from armblocks.errors import ArmblocksError, DiagramError


def diagram_equations(diagram: Diagram, shapes: DiagramShapes) -> Mapping[str, BlockEquations]:
    """The traced equations of every block, by block name.

    Raises ``DiagramError`` naming the block whose parameters allow no equations (a robot without mass).
    """
    equations: dict[str, BlockEquations] = {}
    for name, block in diagram.blocks.items():
        try:
            equations[name] = block_equations(block, shapes.inputs[name])
        except DiagramError:
            raise
        except ArmblocksError as error:
            where = ", ".join(filter(None, (f"block '{name}' ({block.title})", error.where)))
            raise DiagramError(error.what, where=where, allowed=error.allowed, fix=error.fix) from error
    return equations


def trace_diagram(diagram: Diagram) -> HybridSystem:
    """All equations of a diagram over ``t, x, p``: see :class:`armblocks.equations.HybridSystem`.

    One pass in evaluation order: each group of each block is worked out once, from values that are there
    already. A Derivative block's output is the exact time derivative of what feeds it, built up group by
    group by the chain rule (the derivative of a state being its equation); where its input jumps, the jump
    is ignored.

    Raises ``DiagramError`` or ``AlgebraicLoopError``; a diagram that a builder built raises nothing.
    """
    shapes = infer_shapes(diagram)
    network = Network(diagram, diagram_equations(diagram, shapes))
    order = evaluation_order(network)
    tracing = _Tracing(network)
    for node in order:
        tracing.work_out(node)

    signals = _signal_values(network, order, shapes)
    units = {str(ref): unit for ref, unit in infer_units(diagram).items()}
    layout = signature(*(Slot(path, shape, units.get(path, "")) for path, shape, _ in signals))
    derivatives = [
        tracing.value(network.state_rate(name, state.name, 1))
        for name, equations in network.equations.items()
        for state in equations.states
    ]
    parameters = signature(*tracing.parameter_slots)
    ends = (tracing.t, tracing.x, tracing.p)
    return continuous_system(
        name=diagram.name,
        states=signature(*tracing.state_slots),
        parameters=parameters,
        signals_layout=layout,
        parameter_values=parameters.pack(_parameter_values(diagram)),
        derivative=_flat_function("derivative", ("t", "x", "p"), ends, "xd", derivatives),
        signals=_flat_function(
            "signals", ("t", "x", "p"), ends, "y", [tracing.value(value) for _, _, value in signals]
        ),
        initial_states=_flat_function(
            "initial_states", ("p",), (tracing.p,), "x0", _initial_values(network, tracing)
        ),
        breakpoints=_flat_function(
            "breakpoints",
            ("p",),
            (tracing.p,),
            "times",
            [
                SX(time)
                for name, block in diagram.blocks.items()
                for time in block.breakpoints(tracing.parameters_of(name))
            ],
        ),
        aliases=_aliases(diagram, layout),
    )


class _Tracing:
    """The symbols of a diagram and the values worked out so far; lives only while it is traced."""

    def __init__(self, network: Network) -> None:
        self.network = network
        blocks = network.diagram.blocks
        self.tunables = {name: tunable_slots(block) for name, block in blocks.items()}
        self.parameter_slots = [
            Slot(f"{name}.{slot.name}", slot.shape, slot.unit)
            for name, slots in self.tunables.items()
            for slot in slots
        ]
        self.state_slots = [
            Slot(f"{name}/{state.name}", state.shape, state.unit)
            for name, equations in network.equations.items()
            for state in equations.states
        ]
        self.t = SX.sym("t")
        self.x, states = _symbols("x", [slot.size for slot in self.state_slots])
        self.states = {slot.name: part for slot, part in zip(self.state_slots, states)}
        sizes = [sum(slot.size for slot in slots) for slots in self.tunables.values()]
        self.p, parts = _symbols("p", sizes)
        self.parameters = dict(zip(self.tunables, parts))
        self._values: dict[Node, dict[tuple[SlotKind, str], SX]] = {}

    def parameters_of(self, block: str) -> Signals:
        """The symbols of a block's tunable parameters, in their natural shapes."""
        return natural(self.tunables[block], self.parameters[block])

    def work_out(self, node: Node) -> None:
        """Put the equations of one node over the values of the nodes that it needs."""
        group = self.network.equations[node.block].groups[node.group]
        columns: list[SX] = []
        for order in range(node.order + 1):
            states = [
                self.value(self.network.state_rate(node.block, state, order))
                if order
                else self.states[f"{node.block}/{state}"]
                for state in group.states
            ]
            inputs = [self.value(self.network.input(node.block, port, order)) for port in group.inputs]
            columns.append(vertcat(*states, *inputs, SX(0, 1)))
        (flat,) = group.rate(node.order).call([self.t, self.parameters[node.block], *columns], True, False)
        parts = _split(flat, [slot.size for slot in group.slots])
        self._values[node] = {(slot.kind, slot.name): part for slot, part in zip(group.slots, parts)}

    def value(self, value: Value) -> SX:
        """The flat column of a value that has been worked out."""
        return self._values[value.node][value.kind, value.name]


def _symbols(letter: str, sizes: Sequence[int]) -> tuple[SX, list[SX]]:
    """One flat symbol and its consecutive parts."""
    whole = SX.sym(letter, sum(sizes))
    return whole, _split(whole, sizes)


def _split(column: SX, sizes: Sequence[int]) -> list[SX]:
    if len(sizes) == 1:
        return [column]
    return vertsplit(column, [0, *np.cumsum(sizes).tolist()]) if sizes else []


def _flat_function(
    name: str, inputs: tuple[str, ...], symbols: tuple[SX, ...], output: str, values: Sequence[SX]
) -> TracedFunction:
    flat = vertcat(*values, SX(0, 1))
    ends = Signature(
        tuple(
            Slot(letter, () if letter == "t" else (symbol.numel(),))
            for letter, symbol in zip(inputs, symbols)
        )
    )
    return TracedFunction(name, ends, signature(Slot(output, (flat.numel(),))), symbols, (flat,))


def _signal_values(
    network: Network, order: Sequence[Node], shapes: DiagramShapes
) -> list[tuple[str, tuple[int, ...], Value]]:
    """Path, shape and place of every recorded signal, in evaluation order."""
    derived: dict[Node, list[PortRef]] = {}
    for name, block in network.diagram.blocks.items():
        for port in block.time_derivatives:
            ref = PortRef(name, port)
            derived.setdefault(network.output(ref).node, []).append(ref)

    def recorded(node: Node, slot: BlockSlot) -> bool:
        return node.order == 0 and slot.kind is not SlotKind.DERIVATIVE

    signals: list[tuple[str, tuple[int, ...], Value]] = []
    for node in order:
        for slot in network.equations[node.block].groups[node.group].slots:
            if recorded(node, slot):
                path = f"{node.block}/{slot.name}"
                signals.append((path, slot.shape, Value(node, slot.kind, slot.name)))
        signals.extend(
            (str(ref), shapes.outputs[ref.block][ref.port], network.output(ref))
            for ref in derived.get(node, [])
        )
    return signals


def _parameter_values(diagram: Diagram) -> dict[str, Any]:
    return {
        f"{name}.{rule.name}": block.parameter_value(rule.name)
        for name, block in diagram.blocks.items()
        for rule in block.parameters()
        if rule.tunable
    }


def _initial_values(network: Network, tracing: _Tracing) -> list[SX]:
    values: list[SX] = []
    for name, equations in network.equations.items():
        given = network.diagram.blocks[name].initial_states(tracing.parameters_of(name))
        values.extend(spread(SX(given[state.name]), state.shape) for state in equations.states)
    return values


def _aliases(diagram: Diagram, layout: Signature) -> dict[str, str]:
    """Other names of signals: a block's bare name, and the input ports."""
    aliases: dict[str, str] = {}
    for name, block in diagram.blocks.items():
        outputs = block.output_ports()
        if len(outputs) == 1:
            aliases[name] = f"{name}/{outputs[0].name}"
    taken = set(layout.names)
    for wire in diagram.connections:
        if str(wire.target) not in taken:
            aliases[str(wire.target)] = str(wire.source)
    return aliases
