"""The system of a diagram, compiled once for tests that run the same diagram by several methods."""

from __future__ import annotations

from armblocks.diagram import Diagram, content_key, trace_diagram
from armblocks.integration.system import CompiledSystem, compile_system

MOST = 32
"""Systems that are kept: variants of a test follow one another."""
_KEPT: dict[str, CompiledSystem] = {}


def compiled(diagram: Diagram) -> CompiledSystem:
    """The system of a diagram: the same one for diagrams of the same content."""
    key = content_key(diagram)
    if key is None:
        return compile_system(trace_diagram(diagram))
    if key not in _KEPT:
        system = compile_system(trace_diagram(diagram))
        while len(_KEPT) >= MOST:
            del _KEPT[next(iter(_KEPT))]
        _KEPT[key] = system
    return _KEPT[key]
