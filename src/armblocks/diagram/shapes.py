"""Shape inference: shapes of all signals, from declared port shapes and the rules of the blocks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from armblocks.diagram.block import Shapes
from armblocks.diagram.diagram import Diagram
from armblocks.diagram.hierarchy import FlatForm, flatten_hierarchy
from armblocks.diagram.port import PortRef
from armblocks.diagram.shape_inference import known_shapes
from armblocks.diagram.shape_rules import shapes_agree
from armblocks.equations import Shape
from armblocks.errors import DiagramError, InputError


@dataclass(frozen=True)
class DiagramShapes:
    """The shape at every port of a diagram, by block and port name."""

    inputs: Mapping[str, Shapes]
    outputs: Mapping[str, Shapes]


def check_declared_shapes(form: FlatForm, shapes: DiagramShapes) -> None:
    """Raise ``DiagramError`` where a signal at an In or Out block differs from its declared shape."""
    for target, (source, declared) in form.declared_shapes.items():
        shape = shapes.outputs[source.block][source.port]
        if not shapes_agree(shape, declared):
            raise DiagramError(
                f"'{source}' gives shape {shape} but '{target}' takes shape {declared}",
                where=f"block '{target.block}'",
                allowed="the dimensions of the subsystem's In and Out blocks",
                fix="change the dimensions of the block or the width of the signal",
            )


def infer_shapes(diagram: Diagram) -> DiagramShapes:
    """Find the shape of every signal of the flat form of a diagram; every input must be connected.

    Shapes propagate from the ports that declare one. A loop without declared shapes starts from the shapes of
    its integrators' initial values, which are widened if the loop requires it. A loop without integrators
    starts from a scalar.

    Raises ``DiagramError`` where the two ends of a connection, or the inputs of a block, do not agree.
    """
    form = flatten_hierarchy(diagram)
    known = known_shapes(form.diagram)
    return _checked(form, known)


def _checked(form: FlatForm, known: Mapping[PortRef, Shape]) -> DiagramShapes:
    """All shapes by block; raises the errors that were deferred until all shapes were known."""
    diagram, drivers = form.diagram, form.diagram.drivers
    port_shapes = {
        PortRef(name, port.name): port.shape
        for name, block in diagram.blocks.items()
        for port in block.input_ports()
    }
    for wire in diagram.connections:
        signal_shape, port_shape = known.get(wire.source), port_shapes[wire.target]
        if signal_shape is not None and port_shape is not None and not shapes_agree(signal_shape, port_shape):
            target = form.original_port(wire.target)
            raise DiagramError(
                f"'{wire.source}' gives shape {signal_shape} but '{target}' takes shape {port_shape}",
                where=f"block '{target.block}'",
                allowed="both ends of a connection have the same shape",
                fix="change the width of one end, or put a Mux, Demux or Matrix Gain in between",
            )
    inputs: dict[str, Shapes] = {}
    outputs: dict[str, Shapes] = {}
    for name, block in diagram.blocks.items():
        # A shape that is still unknown depends on a block whose error is raised below; () is a placeholder.
        input_shapes: dict[str, Shape] = {}
        complete = True
        for port in block.input_ports():
            shape = port.shape if port.shape is not None else known.get(drivers[PortRef(name, port.name)])
            complete = complete and shape is not None
            input_shapes[port.name] = shape or ()
        try:
            if complete:
                block.output_shapes(input_shapes)
        except InputError as error:
            drivers_text = ", ".join(
                f"'{port}' from '{drivers[PortRef(name, port)]}'" for port in input_shapes
            )
            raise DiagramError(
                error.what,
                where=f"block '{name}' ({block.title}), inputs {drivers_text}",
                allowed=error.allowed,
                fix=error.fix,
            ) from None
        inputs[name] = input_shapes
        outputs[name] = {port.name: known.get(PortRef(name, port.name), ()) for port in block.output_ports()}
    return DiagramShapes(inputs=inputs, outputs=outputs)
