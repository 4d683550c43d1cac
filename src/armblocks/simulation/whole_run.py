"""Run a compiled system, from the start or from the state of another run."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from numpy.typing import ArrayLike

from armblocks.equations import SimulationOptions
from armblocks.integration.system import CompiledSystem
from armblocks.simulation.plan import LogRequest
from armblocks.simulation.result import SimulationResult
from armblocks.simulation.run_state import RunState
from armblocks.simulation.simulation import Simulation

Progress = Callable[[float, float, float], None]
"""Called with the simulated time (s), the fraction of the whole (0 to 1) and the real-time factor."""

PROGRESS_SECONDS = 0.06


def simulate(
    compiled: CompiledSystem,
    options: SimulationOptions,
    parameters: Mapping[str, ArrayLike] | ArrayLike | None = None,
    progress: Progress | None = None,
    initial_state: RunState | None = None,
    log: LogRequest | None = None,
) -> SimulationResult:
    """Run ``compiled`` from 0 to ``options.stop_time`` and record its signals.

    With an ``initial_state``, another run's ``final_state``, it goes on from there to ``stop_time``: bit for
    bit as if that run had not ended, if solver, settings and parameters are the same, else started anew from
    its values; ``run.reason`` says which.

    ``parameters`` changes tunable ones: a mapping from ``block.parameter``, or the flat vector ``(np,)``.
    ``progress(time, fraction, real_time_factor)`` is called at most some 16 times a second and at the end.

    With ``solver="auto"`` a system without states is evaluated directly at all instants. Any other is
    integrated by RK4 where ``step`` is given, else by Dormand-Prince 5(4), until stability and not accuracy
    has held its steps short some thousand times: then Rodas5P goes on. Without a ``sample_time`` the stop
    time is cut into 1000 (10 s in steps of 10 ms); with a fixed step, every step is recorded, or as many of
    them as give at most 10 000 rows.

    With a ``log`` the signals go to a file while the run goes on, memory stays flat however long it is, and
    the result holds the rows that show all extremes.

    Ctrl-C ends the run early: what is there is returned, with ``run.complete`` false.

    Raises ``InputError`` and ``UnknownNameError`` for options and parameters that cannot be run, and
    ``SimulationError`` where a signal or a derivative is not finite or the step becomes too small; its
    ``partial`` is the result up to the last good instant.
    """
    run = Simulation(compiled, options, parameters, initial_state, log)
    return run_to_the_end(run, progress)


def run_to_the_end(run: Simulation, progress: Progress | None = None) -> SimulationResult:
    """All that is left of a run, with its progress told; Ctrl-C ends it early."""
    try:
        while not run.finished:
            run.advance(wall_time=None if progress is None else PROGRESS_SECONDS)
            if progress is not None and not run.finished:
                _tell(progress, run)
    except KeyboardInterrupt:
        run.stop(f"stopped by Ctrl-C at {run.time:g} s of {run.stop_time:g} s")
    result = run.result()
    if progress is not None and result.run.complete:
        _tell(progress, run)
    return result


def _tell(progress: Progress, run: Simulation) -> None:
    stop = run.stop_time
    progress(run.time, run.time / stop if stop > 0.0 else 1.0, run.time / max(run.wall_time, 1e-9))
