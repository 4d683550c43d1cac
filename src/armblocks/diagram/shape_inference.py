"""The fixpoint of shape inference on a flat diagram, and the signals of a model without its comments."""

from __future__ import annotations

import dataclasses
from collections import deque
from collections.abc import Mapping

from armblocks.diagram.block import Block, Shapes
from armblocks.diagram.comments import is_inside
from armblocks.diagram.diagram import Diagram
from armblocks.diagram.flat_form import flat_form
from armblocks.diagram.grounded import Grounded
from armblocks.diagram.levels import joined
from armblocks.diagram.passes.netlist import KnownSignals, Netlist, netlist
from armblocks.diagram.port import PortRef
from armblocks.equations import Shape
from armblocks.errors import ArmblocksError, DiagramError

_GROUND = "?open"
"""The block that drives the unconnected inputs of a model without comments."""


def known_shapes(diagram: Diagram) -> dict[PortRef, Shape]:
    """The shapes of the signals of a flat diagram, as far as the rules of the blocks determine them.

    Raises ``DiagramError`` for a shape that grows along a loop.
    """
    known: dict[PortRef, Shape] = {}
    consumers: dict[str, list[str]] = {name: [] for name in diagram.blocks}
    for wire in diagram.connections:
        consumers[wire.source.block].append(wire.target.block)
    drivers = diagram.drivers
    changes: dict[PortRef, int] = {}
    queue: deque[str] = deque(diagram.blocks)
    queued = set(queue)

    def learn(ref: PortRef, shape: Shape) -> None:
        if known.get(ref) == shape:
            return
        # Each assumed shape can be widened once. More changes mean a shape that grows along a loop.
        changes[ref] = changes.get(ref, -1) + 1
        if changes[ref] > len(diagram.blocks):
            raise DiagramError(
                f"the shape of '{ref}' is inconsistent: it was {known[ref]} and becomes {shape}",
                where=f"block '{ref.block}'",
                allowed="loops with the same width at all signals",
                fix="give the integrators of the loop initial values of the intended size",
            )
        known[ref] = shape
        for consumer in consumers[ref.block]:
            if consumer not in queued:
                queued.add(consumer)
                queue.append(consumer)

    def propagate() -> None:
        while queue:
            name = queue.popleft()
            queued.discard(name)
            block = diagram.blocks[name]
            inputs = input_shapes(name, block, drivers, known)
            if inputs is None:
                continue
            try:
                shapes = block.output_shapes(inputs)
            except ArmblocksError:
                continue  # raised at the end, if the error persists when all shapes are known
            for port, shape in shapes.items():
                learn(PortRef(name, port), shape)

    for name, block in diagram.blocks.items():
        for port in block.output_ports():
            if port.shape is not None:
                known[PortRef(name, port.name)] = port.shape
    propagate()
    for name, block in diagram.blocks.items():
        for port, shape in block.assumed_output_shapes().items():
            if PortRef(name, port) not in known:
                learn(PortRef(name, port), shape)
    propagate()
    # The remaining signals are in loops without state, or depend on them: scalars are assumed one by one.
    # Errors of blocks are raised first.
    open_outputs = [
        (name, PortRef(name, port.name))
        for name, block in diagram.blocks.items()
        for port in block.output_ports()
        if PortRef(name, port.name) not in known
    ]
    if all(input_shapes(name, diagram.blocks[name], drivers, known) is None for name, _ in open_outputs):
        for _, ref in open_outputs:
            if ref not in known:
                learn(ref, ())
                propagate()
    return known


def input_shapes(
    name: str, block: Block, drivers: Mapping[PortRef, PortRef], known: Mapping[PortRef, Shape]
) -> Shapes | None:
    """Shapes of all inputs, or ``None`` while one is unknown."""
    shapes: dict[str, Shape] = {}
    for port in block.input_ports():
        shape = port.shape if port.shape is not None else known.get(drivers[PortRef(name, port.name)])
        if shape is None:
            return None
        shapes[port.name] = shape
    return shapes


def signals_without_comments(levels: Mapping[str, Diagram]) -> KnownSignals:
    """The signals of a hierarchy without its comments, with zeros at unconnected inputs.

    Commented blocks without outputs are removed. All signals are unknown if the hierarchy has an error that
    prevents flattening.
    """
    net = _grounded(netlist(levels))
    sinks = {
        joined(path, name)
        for path, level in levels.items()
        for name in level.commented
        if not level.blocks[name].output_ports()
    }
    active_blocks = {path: block for path, block in net.blocks.items() if not is_inside(path, sinks)}
    active_levels = {path: level for path, level in levels.items() if not is_inside(path, sinks)}
    try:
        form = flat_form(dataclasses.replace(net, blocks=active_blocks, levels=active_levels))
        return KnownSignals(contents=form.contents, shapes=known_shapes(form.diagram))
    except ArmblocksError:
        return KnownSignals()


def _grounded(net: Netlist) -> Netlist:
    """A netlist with a scalar zero at every unconnected input."""
    targets = (PortRef(path, port.name) for path, block in net.blocks.items() for port in block.input_ports())
    missing = {target: PortRef(_GROUND, "y") for target in targets if target not in net.drivers}
    if not missing:
        return net
    return dataclasses.replace(
        net,
        blocks={**net.blocks, _GROUND: Grounded.of({"y": ()})},
        drivers={**net.drivers, **missing},
    )
