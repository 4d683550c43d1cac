"""The Python functions that a run calls, with their indices in the compiled system."""

from __future__ import annotations

from armblocks.diagram import Diagram, flat_diagram
from armblocks.diagram.conditional_equations import FIRE
from armblocks.diagram.model import diagram_model
from armblocks.diagram.sampling import own_clock
from armblocks.equations import Shape
from armblocks.errors import DiagramError
from armblocks.integration.system import CompiledSystem
from armblocks.simulation import CalledFunction


def called_functions(diagram: Diagram, compiled: CompiledSystem) -> tuple[CalledFunction, ...]:
    """The calls of Python in a run, in the order of a tick.

    Raises ``DiagramError`` for a called block without an explicit sample time, or in a triggered subsystem.
    """
    if not compiled.called:
        return ()
    flat, ranges = flat_diagram(diagram), compiled.discrete.ranges
    order = list(dict.fromkeys(node.block for node in diagram_model(diagram).tick_order.order))

    def range_and_shape(block: str, name: str) -> tuple[slice, Shape]:
        path = f"{block}/{name}?"
        return ranges[path], compiled.discrete[path].shape

    calls: list[CalledFunction] = []
    for name in sorted(compiled.called, key=order.index):
        block = flat.blocks[name]
        clock = own_clock(block)
        if clock is None or FIRE in flat.gates.get(name, {}):
            raise DiagramError(
                "a block that calls Python has no clock",
                where=f"block '{name}' ({block.title})",
                allowed="a sample_time > 0, outside of triggered subsystems",
                fix="give it a period, and move it out of the triggered subsystem",
            )
        calls.append(
            CalledFunction(
                block=name,
                clock=compiled.sizes.clocks.index((clock.period, clock.offset)),
                inputs={port.name: range_and_shape(name, port.name) for port in block.input_ports()},
                outputs={port.name: range_and_shape(name, port.name) for port in block.output_ports()},
                call=block.call,
            )
        )
    return tuple(calls)
