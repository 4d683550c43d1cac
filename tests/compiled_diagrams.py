"""Compiled systems of diagrams, cached for tests that run one diagram with several methods."""

from __future__ import annotations

from armblocks.diagram import Diagram, content_key, trace_diagram
from armblocks.integration.system import CompiledSystem, compile_system

CAPACITY = 32
"""Number of cached systems; the variants of one test run one after another."""
_CACHE: dict[str, CompiledSystem] = {}


def compiled(diagram: Diagram) -> CompiledSystem:
    """Return the compiled system of a diagram, cached by the content of the diagram."""
    key = content_key(diagram)
    if key is None:
        return compile_system(trace_diagram(diagram))
    if key not in _CACHE:
        system = compile_system(trace_diagram(diagram))
        while len(_CACHE) >= CAPACITY:
            del _CACHE[next(iter(_CACHE))]
        _CACHE[key] = system
    return _CACHE[key]
