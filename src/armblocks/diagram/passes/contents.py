"""The contents of output ports: replacements are traced back to the blocks that compute signals."""

from __future__ import annotations

from collections.abc import Mapping

from armblocks.diagram.bus import PortContent
from armblocks.diagram.passes.netlist import Replacements
from armblocks.diagram.port import PortRef
from armblocks.errors import DiagramError


class ContentSearch:
    """Finds the signal or bus at output ports; ``found`` caches the results."""

    def __init__(self, replaced: Mapping[str, Replacements], where: str) -> None:
        self._replaced = replaced
        self._where = where
        self.found: dict[PortRef, PortContent] = {}

    def content(self, ref: PortRef) -> PortContent:
        """The signal or bus at an output port; uses an explicit stack, so that paths may be long.

        Raises ``DiagramError`` where replacements form a cycle, and the errors of their contents.
        """
        route = {ref: None}
        while route:
            last = next(reversed(route))
            if last in self.found:
                del route[last]
                continue
            if last.block not in self._replaced:
                self.found[last] = last
                continue
            entry = self._replaced[last.block][last.port]
            missing = next((source for source in entry.sources if source not in self.found), None)
            if missing is None:
                self.found[last] = entry.content([self.found[source] for source in entry.sources])
            elif missing in route:
                loop = [str(port) for port in route][list(route).index(missing) :][::-1]
                raise DiagramError(
                    f"connections form a cycle without a block that computes a signal: {' -> '.join(loop)}",
                    where=self._where,
                    allowed="each connection starts at a block that computes a signal",
                    fix="remove one of these connections",
                )
            else:
                route[missing] = None
        return self.found[ref]
