"""Runs compiled systems: integrators as tables, one call to simulate, results with names and units."""

from armblocks.simulation.calls import CalledFunction
from armblocks.simulation.plan import LogRequest
from armblocks.simulation.recording import Samples
from armblocks.simulation.result import ParameterChange, RunReport, SimulationResult
from armblocks.simulation.run_state import RunState
from armblocks.simulation.simulate import simulate
from armblocks.simulation.simulation import Simulation
from armblocks.simulation.tableaux import TABLEAUX, find_tableau

__all__ = [
    "TABLEAUX",
    "CalledFunction",
    "LogRequest",
    "ParameterChange",
    "RunReport",
    "RunState",
    "Samples",
    "Simulation",
    "SimulationResult",
    "find_tableau",
    "simulate",
]
