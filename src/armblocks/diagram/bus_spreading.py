"""Buses at blocks that pass signals on unchanged: the block is copied for each signal of the bus.

A Switch between two buses selects each pair of their signals; a Unit Delay delays each signal. The flat
diagram has a copy of the block for every signal, such as ``switch.motor.speed``; all copies share the
parameters of the original (``Diagram.shares``). The elements of a bus are propagated along the connections
from Bus Creators; in a loop through a delay they come from the bus that enters the loop.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from armblocks.diagram.block import Block
from armblocks.diagram.bus import Bus, Carried
from armblocks.diagram.port import PortRef
from armblocks.errors import DiagramError


@dataclass(frozen=True, kw_only=True)
class SpreadBlock:
    """A block with bus inputs, and the paths of the signals, in the order of its first bus input."""

    path: str
    block: Block
    given: str
    """The input that determines the elements."""
    structure: Bus
    """The bus at this input."""

    @property
    def elements(self) -> tuple[str, ...]:
        """Paths of all signals."""
        return tuple(path for path, _ in self.structure.leaves())

    def copy(self, element: str) -> str:
        """The path of the copy for one signal."""
        return f"{self.path}.{element}"

    def carried(self, port: str) -> Bus:
        """The bus at an output: the outputs of the copies, in the structure of the input bus."""
        return _renamed(self.structure, "", lambda element: PortRef(self.copy(element), port))

    def element(self, port: str, carried: Carried, element: str) -> Carried:
        """The signal at an input of a copy. Raises ``DiagramError`` where the input buses differ."""
        if isinstance(carried, Bus):
            there = {path for path, _ in carried.leaves()}
            found = carried.element(element)
            if there == set(self.elements) and found is not None:
                return found
            said = f"a bus with {_listed(path for path, _ in carried.leaves())}"
        else:
            said = f"the single signal '{carried}'"
        raise DiagramError(
            f"input '{self.given}' is a bus with {_listed(self.elements)}, but input '{port}' is {said}",
            where=f"block '{self.path}' ({self.block.title})",
            allowed="buses with the same names of elements at all of these inputs",
            fix="make them alike with Bus Creators, or take single signals with Bus Selectors",
        )


def _renamed(bus: Bus, above: str, source: Callable[[str], PortRef]) -> Bus:
    elements: dict[str, Carried] = {}
    for name, carried in bus.elements.items():
        path = f"{above}{name}"
        inner = isinstance(carried, Bus)
        elements[name] = _renamed(carried, f"{path}.", source) if inner else source(path)
    return Bus(elements)


def _listed(paths: Iterable[str]) -> str:
    return ", ".join(paths)


def spread_blocks(
    blocks: Mapping[str, Block],
    carried_at: Callable[[str, str], Carried],
    found: Callable[[SpreadBlock], None],
) -> None:
    """Call ``found`` for every block with a bus input that is copied for each signal.

    ``carried_at`` gives the content of an input port from the results so far, or raises ``DiagramError``
    where it is not known yet.
    """
    waiting = {path: block for path, block in blocks.items() if block.bus_inputs()}
    progress = True
    while progress and waiting:
        progress = False
        for path, block in list(waiting.items()):
            for port in block.bus_inputs():
                try:
                    carried = carried_at(path, port)
                except DiagramError:
                    continue  # raised later, if still true when all buses are known
                if isinstance(carried, Bus):
                    found(SpreadBlock(path=path, block=block, given=port, structure=carried))
                    del waiting[path]
                    progress = True
                    break
