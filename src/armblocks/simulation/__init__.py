"""Simulation of compiled systems: integrators as tables, runs, and results with names and units."""

from typing import TYPE_CHECKING

from armblocks.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from armblocks.simulation.calls import CalledFunction
    from armblocks.simulation.plan import LogRequest
    from armblocks.simulation.recording import Samples
    from armblocks.simulation.result import SimulationResult
    from armblocks.simulation.run_data import ParameterChange, RunReport
    from armblocks.simulation.run_state import RunState
    from armblocks.simulation.simulation import Simulation
    from armblocks.simulation.tableaux import TABLEAUX, find_tableau
    from armblocks.simulation.whole_run import simulate
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "TABLEAUX": "armblocks.simulation.tableaux",
            "CalledFunction": "armblocks.simulation.calls",
            "LogRequest": "armblocks.simulation.plan",
            "ParameterChange": "armblocks.simulation.run_data",
            "RunReport": "armblocks.simulation.run_data",
            "RunState": "armblocks.simulation.run_state",
            "Samples": "armblocks.simulation.recording",
            "Simulation": "armblocks.simulation.simulation",
            "SimulationResult": "armblocks.simulation.result",
            "find_tableau": "armblocks.simulation.tableaux",
            "simulate": "armblocks.simulation.whole_run",
        },
    )

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
