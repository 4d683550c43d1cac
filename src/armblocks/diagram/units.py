"""Unit inference: SI units of all signals, from ports and blocks."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping

from armblocks.diagram.diagram import Diagram
from armblocks.diagram.hierarchy import flat_diagram
from armblocks.diagram.port import PortRef


def infer_units(diagram: Diagram) -> Mapping[PortRef, str]:
    """The unit of every output port of a diagram's flat form, for display; ``""`` where it is unknown."""
    diagram = flat_diagram(diagram)
    drivers = diagram.drivers
    consumers: dict[str, list[str]] = {name: [] for name in diagram.blocks}
    for wire in diagram.connections:
        consumers[wire.source.block].append(wire.target.block)
    units = {
        PortRef(name, port.name): port.unit
        for name, block in diagram.blocks.items()
        for port in block.output_ports()
    }
    queue = deque(diagram.blocks)
    while queue:
        name = queue.popleft()
        block = diagram.blocks[name]
        sources = {port.name: drivers[PortRef(name, port.name)] for port in block.input_ports()}
        input_units = {port: units[source] for port, source in sources.items()}
        inferred = [(PortRef(name, port), unit) for port, unit in block.output_units(input_units).items()]
        inferred += [(sources[port], unit) for port, unit in block.input_units(input_units).items()]
        for port, unit in inferred:
            # A known unit does not change, so the iteration terminates.
            if unit and not units[port]:
                units[port] = unit
                queue.extend(consumers[port.block])
    return units


def rate_unit(unit: str) -> str:
    """Unit of the time derivative: ``rad`` -> ``rad/s`` -> ``rad/s2``; ``""`` stays unknown."""
    if unit.endswith("/s"):
        return unit + "2"
    if "/s" in unit:
        head, _, power = unit.rpartition("/s")
        return f"{head}/s{int(power) + 1}" if power.isdigit() else ""
    return unit + "/s" if unit else ""


def integral_unit(unit: str) -> str:
    """Unit of the integral over time, the inverse of :func:`rate_unit`; ``""`` where it has no short form."""
    if unit.endswith("/s"):
        return unit.removesuffix("/s")
    head, slash, power = unit.rpartition("/s")
    if slash and power.isdigit():
        return f"{head}/s" if power == "2" else f"{head}/s{int(power) - 1}"
    return ""
