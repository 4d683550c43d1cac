"""Pass: replaced blocks are removed.

Input: replacements for all virtual blocks, and input ports that are driven by the blocks that compute their
signals.

Result: a netlist of blocks with equations and direct connections, which is a flat diagram.
"""

from __future__ import annotations

import dataclasses

from armblocks.diagram.passes.netlist import Netlist
from armblocks.diagram.port import PortRef


def remove_virtual_blocks(net: Netlist) -> Netlist:
    """The netlist without replaced blocks. Raises ``DiagramError`` for a bus at one of their inputs."""
    blocks = net.remaining()
    drivers = {
        PortRef(path, port.name): net.one_signal(path, port.name)
        for path, block in blocks.items()
        for port in block.input_ports()
    }
    gates = {path: net.gates[path] for path in blocks if path in net.gates}
    return dataclasses.replace(net, blocks=blocks, drivers=drivers, replaced={}, gates=gates)
