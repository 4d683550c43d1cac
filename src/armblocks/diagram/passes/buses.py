"""Pass: Bus Creators, Bus Selectors and Bus Assignments are replaced by their contents.

Input: bus blocks.

Result: replacements of their outputs: buses, elements of buses, and buses with other elements.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from armblocks.diagram.bus import Bus, PortContent
from armblocks.diagram.passes.netlist import Netlist, Replacement, Replacements
from armblocks.diagram.port import PortRef
from armblocks.diagram.virtual_wiring import BusAssignment, BusCreator, BusSelector, listed
from armblocks.errors import DiagramError, UnknownNameError


def resolve_buses(net: Netlist) -> Netlist:
    """The netlist with replacements for all bus blocks.

    The contents of the replacements raise ``DiagramError`` for a single signal in place of a bus, and
    ``UnknownNameError`` for an element that the bus does not have.
    """
    replaced: dict[str, Replacements] = {}
    for path, block in net.blocks.items():
        match block:
            case BusCreator():
                contents = {"bus": _creation(block)}
            case BusSelector():
                where = net.label(path)
                names = (port.name for port in block.output_ports())
                contents = {
                    name: _selection(where, element) for name, element in zip(names, listed(block.elements))
                }
            case BusAssignment():
                contents = {"bus": _assignment(net.label(path), listed(block.elements))}
            case _:
                continue
        sources = tuple(net.drivers[PortRef(path, port.name)] for port in block.input_ports())
        replaced[path] = {port: Replacement(sources, content) for port, content in contents.items()}
    return net.with_replaced(replaced)


_Content = Callable[[Sequence[PortContent]], PortContent]


def _creation(block: BusCreator) -> _Content:
    names = listed(block.names)
    return lambda contents: Bus(dict(zip(names, contents)))


def _selection(where: str, path: str) -> _Content:
    return lambda contents: _element(_bus(contents[0], where), path, where)


def _assignment(where: str, paths: Sequence[str]) -> _Content:
    def content(contents: Sequence[PortContent]) -> Bus:
        bus = _bus(contents[0], where)
        for path, element in zip(paths, contents[1:]):
            _element(bus, path, where)
            bus = bus.replaced(path, element)
        return bus

    return content


def _bus(content: PortContent, where: str) -> Bus:
    if isinstance(content, Bus):
        return content
    raise DiagramError(
        f"the input 'bus' is the single signal '{content}'",
        where=where,
        allowed="a bus",
        fix="connect a Bus Creator",
    )


def _element(bus: Bus, element: str, where: str) -> PortContent:
    content = bus.element(element)
    if content is None:
        raise UnknownNameError("bus element", element, bus.paths(), where=where)
    return content
