"""Pass: a block that selects, delays or holds signals is copied for each signal of a bus.

A Switch between two buses selects each pair of their signals; a Unit Delay delays each signal. The elements
of a bus are propagated along the connections from Bus Creators and commented blocks; in a loop through a
delay they come from the bus that enters the loop.

Input: blocks with ``bus_inputs`` that may receive buses; replacements for all virtual blocks.

Result: each block with a bus at an input is copied for every signal, such as ``switch.motor.speed``. All
copies share the parameters of the original (``Diagram.shares``). The original becomes virtual: each of its
bus inputs selects the signals for the copies, and each output is the bus of the copies' outputs.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from armblocks.diagram.block import Block
from armblocks.diagram.bus import Bus, PortContent
from armblocks.diagram.grounded import Bypass
from armblocks.diagram.passes.contents import ContentSearch
from armblocks.diagram.passes.netlist import Netlist, Replacement, Replacements
from armblocks.diagram.port import PortRef
from armblocks.diagram.virtual_wiring import BusCreator
from armblocks.errors import DiagramError


def copy_for_buses(net: Netlist) -> Netlist:
    """The netlist in which every block with a bus at an input is copied for each signal of the bus.

    The replacements of the originals raise ``DiagramError`` where the buses at two inputs differ.
    """
    if not any(isinstance(block, BusCreator | Bypass) for block in net.blocks.values()):
        return net
    copied = _copied(net)
    blocks = {path: block for path, block in net.blocks.items() if path not in copied}
    drivers, gates = dict(net.drivers), dict(net.gates)
    shares, origins = dict(net.shares), dict(net.origins)
    for path, original in copied.items():
        for element in original.elements:
            copy = original.copy(element)
            blocks[copy], shares[copy], origins[copy] = original.block, path, net.origins.get(path, path)
            if path in net.gates:
                gates[copy] = net.gates[path]
            for port, source in original.sources.items():
                per_signal = port in original.block.bus_inputs()
                drivers[PortRef(copy, port)] = PortRef(path, f"{port}.{element}") if per_signal else source
    blocks |= {path: original.block for path, original in copied.items()}
    resolved = net.with_replaced({path: original.replacements() for path, original in copied.items()})
    return dataclasses.replace(
        resolved, blocks=blocks, drivers=drivers, gates=gates, shares=shares, origins=origins
    )


def _copied(net: Netlist) -> dict[str, _CopiedBlock]:
    """The blocks that receive a bus, by path, with the structure of the bus."""
    copied: dict[str, _CopiedBlock] = {}
    replaced = dict(net.replaced)
    search = ContentSearch(replaced, net.where)
    pending = {path: block for path, block in net.blocks.items() if block.bus_inputs()}
    sources: dict[str, dict[str, PortRef]] = {path: {} for path in pending}
    for target, source in net.drivers.items():
        if target.block in sources:
            sources[target.block][target.port] = source
    progress = True
    while progress and pending:
        progress = False
        for path, block in list(pending.items()):
            for port in block.bus_inputs():
                try:
                    content = search.content(sources[path][port])
                except DiagramError:
                    continue  # raised again once all buses are known, if the error persists
                if isinstance(content, Bus):
                    copied[path] = _CopiedBlock(
                        path=path, block=block, structure_input=port, structure=content, sources=sources[path]
                    )
                    replaced[path] = copied[path].replacements()
                    # Earlier results may refer to the original block.
                    search = ContentSearch(replaced, net.where)
                    del pending[path]
                    progress = True
                    break
    return copied


@dataclass(frozen=True, kw_only=True)
class _CopiedBlock:
    """A block with a bus at an input; it is copied for each signal of this bus."""

    path: str
    block: Block
    structure_input: str
    """The first input that receives a bus; it determines the elements."""
    structure: Bus
    """The bus at this input."""
    sources: dict[str, PortRef]
    """The driver of every input."""

    @property
    def elements(self) -> tuple[str, ...]:
        """Paths of all signals."""
        return tuple(path for path, _ in self.structure.leaves())

    def copy(self, element: str) -> str:
        """The path of the copy for one signal."""
        return f"{self.path}.{element}"

    def replacements(self) -> Replacements:
        """The buses of the copies' outputs, and the signals of the bus inputs, ``input.element``."""
        outputs = self.block.output_ports()
        contents = {port.name: Replacement((), self._joined(port.name)) for port in outputs}
        for port in self.block.bus_inputs():
            for element in self.elements:
                selected = self._selected(port, element)
                contents[f"{port}.{element}"] = Replacement((self.sources[port],), selected)
        return contents

    def _joined(self, port: str) -> Callable[[Sequence[PortContent]], PortContent]:
        """The bus at an output: the outputs of the copies, in the structure of the input bus."""
        bus = _renamed(self.structure, "", lambda element: PortRef(self.copy(element), port))
        return lambda _: bus

    def _selected(self, port: str, element: str) -> Callable[[Sequence[PortContent]], PortContent]:
        return lambda contents: self._element(port, contents[0], element)

    def _element(self, port: str, content: PortContent, element: str) -> PortContent:
        """The signal at an input of a copy. Raises ``DiagramError`` where the input buses differ."""
        if isinstance(content, Bus):
            paths = {path for path, _ in content.leaves()}
            signal = content.element(element)
            if paths == set(self.elements) and signal is not None:
                return signal
            text = f"a bus with {_listed(path for path, _ in content.leaves())}"
        else:
            text = f"the single signal '{content}'"
        raise DiagramError(
            f"input '{self.structure_input}' is a bus with {_listed(self.elements)}, "
            f"but input '{port}' is {text}",
            where=f"block '{self.path}' ({self.block.title})",
            allowed="buses with the same names of elements at all of these inputs",
            fix="build equal buses with Bus Creators, or select single signals with Bus Selectors",
        )


def _renamed(bus: Bus, prefix: str, source: Callable[[str], PortRef]) -> Bus:
    elements: dict[str, PortContent] = {}
    for name, content in bus.elements.items():
        path = f"{prefix}{name}"
        inner = isinstance(content, Bus)
        elements[name] = _renamed(content, f"{path}.", source) if inner else source(path)
    return Bus(elements)


def _listed(paths: Iterable[str]) -> str:
    return ", ".join(paths)
