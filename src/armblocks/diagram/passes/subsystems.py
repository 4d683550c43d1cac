"""Pass: subsystems and their In and Out blocks are replaced by connections.

Input: subsystems, In and Out blocks; conditional subsystems have held outputs in place of their Out blocks.

Result: replacements. An In block has the contents of the driver of the subsystem's input. An output of a
subsystem has the contents of its Out block's input, or of the held output.
"""

from __future__ import annotations

from armblocks.diagram.connection_port import ConnectionPort
from armblocks.diagram.levels import joined, level_of, name_of
from armblocks.diagram.passes.netlist import Netlist, Replacement, Replacements
from armblocks.diagram.port import PortRef
from armblocks.diagram.structure import DiagramBlock, Inport, Outport


def resolve_subsystems(net: Netlist) -> Netlist:
    """The netlist with replacements for subsystems and for In and Out blocks below the top level."""
    replaced: dict[str, Replacements] = {}
    for path, block in net.blocks.items():
        level = level_of(path)
        if isinstance(block, DiagramBlock):
            replaced[path] = {port.name: _output(net, path, port.name) for port in block.output_ports()}
        elif level and isinstance(block, Inport):
            replaced[path] = {"y": Replacement((net.drivers[PortRef(level, name_of(path))],))}
        elif isinstance(block, ConnectionPort) or (level and isinstance(block, Outport)):
            replaced[path] = {}
    return net.with_replaced(replaced)


def _output(net: Netlist, subsystem: str, port: str) -> Replacement:
    inner_block = joined(subsystem, port)
    if isinstance(net.blocks[inner_block], Outport):
        return Replacement((net.drivers[PortRef(inner_block, "u")],))
    return Replacement((PortRef(inner_block, "y"),))
