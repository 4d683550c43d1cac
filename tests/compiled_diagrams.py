"""Compiled systems of diagrams, cached for tests that run one diagram with several methods."""

from __future__ import annotations

from armblocks.diagram import Diagram, content_key, trace_diagram
from armblocks.integration.system import CompiledSystem, compile_system

MOST = 32
"""Number of cached systems; the variants of one test run one after another."""
_KEPT: dict[str, CompiledSystem] = {}


def compiled(diagram: Diagram) -> CompiledSystem:
    """Return the compiled system of a diagram, cached by the content of the diagram."""
    key = content_key(diagram)
    if key is None:
        return compile_system(trace_diagram(diagram))
    if key not in _KEPT:
        system = compile_system(trace_diagram(diagram))
        while len(_KEPT) >= MOST:
            del _KEPT[next(iter(_KEPT))]
        _KEPT[key] = system
    return _KEPT[key]
