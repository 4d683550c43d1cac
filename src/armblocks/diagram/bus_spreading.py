"""Buses through blocks that pass a signal on unchanged: such a block stands for one block for each signal.

A Switch between two buses chooses between each pair of their signals; a Unit Delay delays each. In the flat
diagram there is a copy of the block for every signal, ``switch.motor.speed`` for the signal of this path; all
copies have the parameters of the one block (``Diagram.shares``). What is on a bus is found out from the
wires, from Bus Creators on; a loop through a delay takes it from where a bus enters the loop.
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
    """A block that is given buses, and the paths of the signals on them, in the order of its first input."""

    path: str
    block: Block
    given: str
    """The input that said what is on the buses."""
    structure: Bus
    """Of this input."""

    @property
    def elements(self) -> tuple[str, ...]:
        """Paths of all signals."""
        return tuple(path for path, _ in self.structure.leaves())

    def copy(self, element: str) -> str:
        """The path of the block that works on one signal."""
        return f"{self.path}.{element}"

    def carried(self, port: str) -> Bus:
        """What an output carries: the outputs of the copies, in the structure of the input."""
        return _renamed(self.structure, "", lambda element: PortRef(self.copy(element), port))

    def element(self, port: str, carried: Carried, element: str) -> Carried:
        """The signal of an input that a copy takes. Raises ``DiagramError`` where the inputs differ."""
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
    """Tell ``found`` of every block that is given a bus and works on each of its signals.

    ``carried_at`` gives what an input port carries by what was found so far, or raises ``DiagramError`` where
    that does not say it yet.
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
                    continue  # said later, if it is still so when all buses are known
                if isinstance(carried, Bus):
                    found(SpreadBlock(path=path, block=block, given=port, structure=carried))
                    del waiting[path]
                    progress = True
                    break
