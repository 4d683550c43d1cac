"""Pass: the names of signals in the hierarchy, and the shapes that In and Out blocks declare.

Input: the contents of all ports.

Result: other names of signals (``Netlist.aliases``): input ports, ports of virtual blocks, elements of buses;
and the signals at In and Out blocks with a declared shape (``Netlist.declared_shapes``).
"""

from __future__ import annotations

import dataclasses

from armblocks.diagram.bus import PortContent
from armblocks.diagram.levels import level_of, name_of
from armblocks.diagram.passes.netlist import Netlist
from armblocks.diagram.port import PortRef
from armblocks.diagram.structure import Inport, Outport, declared_shape
from armblocks.equations import Shape


def resolve_names(net: Netlist) -> Netlist:
    """The netlist with the names and declared shapes of signals.

    Raises ``DiagramError`` for a bus at an In or Out block with a declared shape.
    """
    return dataclasses.replace(net, aliases=_aliases(net), declared_shapes=_declared_shapes(net))


def _aliases(net: Netlist) -> dict[str, PortRef]:
    aliases: dict[str, PortRef] = {}

    def add(name: str, content: PortContent) -> None:
        if isinstance(content, PortRef):
            aliases[name] = content
        else:
            aliases.update({f"{name}.{path}": source for path, source in content.leaves()})

    for path, block in net.blocks.items():
        for port in block.input_ports():
            add(f"{path}/{port.name}", net.at(path, port.name))
        outputs = block.output_ports()
        if path not in net.replaced:
            continue
        for port in outputs:
            add(f"{path}/{port.name}", net.contents[PortRef(path, port.name)])
        if len(outputs) == 1:
            add(path, net.contents[PortRef(path, outputs[0].name)])
    for path, block in net.blocks.items():
        if isinstance(block, Outport):
            add(path, net.at(path, "u"))
    return aliases


def _declared_shapes(net: Netlist) -> dict[PortRef, tuple[PortRef, Shape]]:
    declared: dict[PortRef, tuple[PortRef, Shape]] = {}
    for path, block in net.blocks.items():
        if path not in net.replaced or not isinstance(block, Inport | Outport):
            continue
        shape = declared_shape(block)
        if shape is not None:
            inside = isinstance(block, Inport)
            target = PortRef(level_of(path), name_of(path)) if inside else PortRef(path, "u")
            declared[target] = (net.one_signal(target.block, target.port), shape)
    return declared
