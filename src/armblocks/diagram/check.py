"""Checks of a diagram before tracing."""

from __future__ import annotations

from armblocks.diagram.comments import active_levels, check_connected
from armblocks.diagram.connection_port import ConnectionPort
from armblocks.diagram.diagram import Diagram
from armblocks.diagram.levels import levels_of
from armblocks.diagram.model import check_model
from armblocks.diagram.structure import Inport, Outport, port_blocks
from armblocks.diagram.virtual_wiring import From, Goto


def check_diagram(diagram: Diagram) -> None:
    """Raise ``DiagramError`` for a diagram that cannot be traced.

    Reasons are unconnected inputs, shapes or sample times that do not fit, and unsolvable algebraic loops.
    In a part of a larger diagram, only connections and port numbers are checked: its inputs are unknown.
    """
    if _is_part(diagram):
        port_blocks(diagram, Inport)
        port_blocks(diagram, Outport)
        check_connected(levels_of(diagram))
    else:
        check_model(diagram)


def _is_part(diagram: Diagram) -> bool:
    """Whether a signal or a frame comes from outside: by an In block or a Connection Port, or by a From tag
    without a Goto inside."""
    if any(isinstance(block, Inport | ConnectionPort) for block in diagram.blocks.values()):
        return True
    if not any(block.virtual for block in diagram.blocks.values()):
        return False
    blocks = [
        block
        for level in active_levels(levels_of(diagram)).values()
        for name, block in level.blocks.items()
        if name not in level.commented
    ]
    sent_tags = {block.tag for block in blocks if isinstance(block, Goto)}
    return any(isinstance(block, From) and block.tag not in sent_tags for block in blocks)
