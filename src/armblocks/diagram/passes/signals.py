"""Pass: the contents of all ports.

Input: replacements for the output ports of all virtual blocks.

Result: the signal or bus at every output port (``Netlist.contents``). The driver of every input port with a
single signal is the block that computes the signal. The driver of an input port with a bus is the virtual
block that creates the bus.
"""

from __future__ import annotations

import dataclasses

from armblocks.diagram.passes.contents import ContentSearch
from armblocks.diagram.passes.netlist import Netlist
from armblocks.diagram.port import PortRef


def resolve_signals(net: Netlist) -> Netlist:
    """The netlist with the contents of all replacements.

    Raises ``DiagramError`` for connections in a cycle without a block that computes a signal, and the errors
    of replacements.
    """
    search = ContentSearch(net.replaced, net.where)
    contents = {ref: search.content(ref) for ref in net.outputs()}
    drivers: dict[PortRef, PortRef] = {}
    for target, source in net.drivers.items():
        content = search.content(source)
        drivers[target] = content if isinstance(content, PortRef) else source
    return dataclasses.replace(net, contents=contents, drivers=drivers)
