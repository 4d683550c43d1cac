"""Everything that is asked of a diagram before it may be traced."""

from __future__ import annotations

from armblocks.diagram.diagram import Diagram
from armblocks.diagram.port import PortRef
from armblocks.diagram.trace import diagram_model
from armblocks.errors import DiagramError

MOST_LISTED = 20
"""How many offenders one message lists."""


def check_diagram(diagram: Diagram) -> None:
    """Raise ``DiagramError`` for a diagram that cannot be traced.

    That is: unconnected inputs, widths or sample times that do not fit, loops that no order solves.
    """
    check_connected(diagram)
    diagram_model(diagram)


def check_connected(diagram: Diagram) -> None:
    """Raise ``DiagramError`` that lists the inputs that nothing drives."""
    drivers = diagram.drivers
    open_inputs = [
        str(PortRef(name, port.name))
        for name, block in diagram.blocks.items()
        for port in block.input_ports()
        if PortRef(name, port.name) not in drivers
    ]
    if open_inputs:
        listed = ", ".join(open_inputs[:MOST_LISTED])
        rest = len(open_inputs) - MOST_LISTED
        raise DiagramError(
            f"{len(open_inputs)} unconnected input{'s' * (len(open_inputs) > 1)}: {listed}"
            + (f" and {rest} more" if rest > 0 else ""),
            where=f"diagram '{diagram.name}'",
            allowed="every input has a driver",
            fix="connect an output or a Constant to each",
        )
