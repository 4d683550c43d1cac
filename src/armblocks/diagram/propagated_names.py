"""Propagated names of signals (Simulink: propagated signal labels).

A From block, an In block and an output of a subsystem pass on a signal; the name of the signal is propagated
with it. Drawings show propagated names as ``<name>``. They are computed for drawings only: results and
legends find the names of signals by the outputs that compute them.
"""

from __future__ import annotations

from armblocks.diagram.diagram import Diagram
from armblocks.diagram.levels import joined, level_of, name_of
from armblocks.diagram.port import PortRef
from armblocks.diagram.structure import DiagramBlock, Inport, Outport, Subsystem
from armblocks.diagram.virtual_wiring import From, Goto


def propagated_names(diagram: Diagram, sheet: str = "") -> dict[PortRef, str]:
    """The propagated names of the outputs of a sheet that have no own name.

    ``sheet`` is the path of the sheet's subsystem. The diagram may be incomplete: an output whose signal
    cannot be found, or that a conditional subsystem holds, has no propagated name.
    """
    search = _NameSearch(diagram)
    level = search.levels.get(sheet) or search.level(sheet)
    if level is None:
        return {}
    names = {
        ref: search.name(sheet, ref)
        for name, block in level.blocks.items()
        if isinstance(block, (From, Inport, Subsystem))
        for ref in (PortRef(name, port.name) for port in block.output_ports())
        if ref not in level.signal_names
    }
    return {ref: name for ref, name in names.items() if name}


class _NameSearch:
    """Searches upstream for the nearest name of a signal."""

    def __init__(self, diagram: Diagram) -> None:
        self.levels: dict[str, Diagram] = {"": diagram}
        self._drivers: dict[str, dict[PortRef, PortRef]] = {}
        self._gotos: dict[tuple[str, str, str], PortRef] | None = None

    def level(self, path: str) -> Diagram | None:
        """The sheet of the subsystem at a path; ``None`` if there is none."""
        if path not in self.levels:
            outer = self.level(level_of(path))
            block = outer.blocks.get(name_of(path)) if outer is not None else None
            if not isinstance(block, DiagramBlock):
                return None
            self.levels[path] = block.diagram
        return self.levels[path]

    def name(self, sheet: str, ref: PortRef) -> str:
        """The name of the signal at an output of a sheet, or ``""``."""
        visited: set[tuple[str, PortRef]] = set()
        place: tuple[str, PortRef] | None = (sheet, ref)
        while place is not None and place not in visited:
            visited.add(place)
            path, ref = place
            level = self.level(path)
            if level is None or ref.block not in level.blocks or ref.block in level.commented:
                return ""
            if ref in level.signal_names:
                return level.signal_names[ref]
            place = self._before(path, level, ref)
        return ""

    def _before(self, path: str, level: Diagram, ref: PortRef) -> tuple[str, PortRef] | None:
        """The output from which a block passes its signal on."""
        block = level.blocks[ref.block]
        if isinstance(block, From):
            return self._at_goto(path, block.tag)
        if isinstance(block, Inport) and path:
            outer = level_of(path)
            return self._driver(outer, PortRef(name_of(path), ref.block))
        if isinstance(block, Subsystem) and isinstance(block.diagram.blocks.get(ref.port), Outport):
            return self._driver(joined(path, ref.block), PortRef(ref.port, "u"))
        return None

    def _driver(self, path: str, target: PortRef) -> tuple[str, PortRef] | None:
        level = self.level(path)
        if level is None:
            return None
        if path not in self._drivers:
            self._drivers[path] = {wire.target: wire.source for wire in level.connections}
        source = self._drivers[path].get(target)
        return None if source is None else (path, source)

    def _at_goto(self, path: str, tag: str) -> tuple[str, PortRef] | None:
        """The signal at the nearest visible Goto with a tag; the same rule as in ``passes.tags``."""
        if self._gotos is None:
            self._gotos = {}
            self._add_gotos("", self.levels[""])
        outer_levels = [path]
        while outer_levels[-1]:
            outer_levels.append(level_of(outer_levels[-1]))
        candidates = [(path, tag, "local"), *((outer, tag, "scoped") for outer in outer_levels)]
        candidates.append(("", tag, "global"))
        goto = next((self._gotos[key] for key in candidates if key in self._gotos), None)
        if goto is None:
            return None
        return self._driver(level_of(goto.block), PortRef(name_of(goto.block), "u"))

    def _add_gotos(self, path: str, level: Diagram) -> None:
        assert self._gotos is not None
        for name, block in level.blocks.items():
            if name in level.commented:
                continue
            if isinstance(block, Goto):
                scope = "" if block.visibility == "global" else path
                self._gotos.setdefault((scope, block.tag, block.visibility), PortRef(joined(path, name), "u"))
            elif isinstance(block, DiagramBlock):
                self._add_gotos(joined(path, name), block.diagram)
