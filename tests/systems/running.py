"""Trace, compile and simulate a diagram, as users do."""

from __future__ import annotations

from armblocks.diagram import Diagram
from armblocks.equations import SimulationOptions
from armblocks.simulation import SimulationResult, simulate
from compiled_diagrams import compiled


def run(
    diagram: Diagram, stop_time: float, *, rtol: float = 1e-10, atol: float = 1e-12, solver: str = "auto"
) -> SimulationResult:
    """Simulate a diagram and return all signals at 101 times."""
    options = SimulationOptions(
        stop_time=stop_time, sample_time=stop_time / 100, rtol=rtol, atol=atol, solver=solver
    )
    return simulate(compiled(diagram), options)
