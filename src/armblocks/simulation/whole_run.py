"""Run a compiled system, from the start or from the state of another run."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from numpy.typing import ArrayLike

from armblocks import interrupts
from armblocks.equations import SimulationOptions
from armblocks.integration.system import CompiledSystem
from armblocks.simulation.plan import LogRequest
from armblocks.simulation.result import SimulationResult
from armblocks.simulation.run_state import RunState
from armblocks.simulation.simulation import Simulation

Progress = Callable[[float, float, float], None]
"""Called with the simulated time (s), the fraction of the whole (0 to 1) and the real-time factor."""

PROGRESS_SECONDS = 0.06
"""Approximate wall time between two calls of ``progress``, s."""


def simulate(
    compiled: CompiledSystem,
    options: SimulationOptions,
    parameters: Mapping[str, ArrayLike] | ArrayLike | None = None,
    progress: Progress | None = None,
    initial_state: RunState | None = None,
    log: LogRequest | None = None,
) -> SimulationResult:
    """Run ``compiled`` from 0 to ``options.stop_time`` and record its signals.

    With an ``initial_state`` (the ``final_state`` of another run) the run continues from there to
    ``stop_time``. If solver, settings and parameters are the same, the result is bitwise equal to that
    of an uninterrupted run. Otherwise the integration restarts from the values of the state. ``run.reason``
    states which case applies.

    ``parameters`` changes tunable parameters: a mapping from ``block.parameter``, or the flat vector
    ``(np,)``. ``progress(time, fraction, real_time_factor)`` is called at most about 16 times a second, and
    at the end.

    With ``solver="auto"`` a system without states is evaluated directly at all sample times. Other systems
    are integrated with RK4 if ``step`` is given, else with Dormand-Prince 5(4). When stability, not accuracy,
    has limited 4000 of its steps, Rodas5P replaces it. Without a ``sample_time`` the stop time is
    divided into 1000 intervals (10 s into intervals of 10 ms). With a fixed step every step is recorded, or
    every n-th step so that there are at most 10 000 rows.

    With a ``log`` the signals are written to a file during the run. The memory does not grow with the length
    of the run, and the result has a selection of the rows with all extremes of the signals.

    Ctrl-C ends the run early: the result so far is returned, with ``run.complete`` false.

    Raises ``InputError`` and ``UnknownNameError`` for invalid options and parameters, and ``SimulationError``
    if a signal or a derivative is not finite or the step becomes too small; its ``partial`` is the result up
    to the last valid sample.
    """
    run = Simulation(compiled, options, parameters, initial_state, log)
    return run_to_the_end(run, progress)


def run_to_the_end(run: Simulation, progress: Progress | None = None) -> SimulationResult:
    """Continue a run to its end with calls of ``progress``; Ctrl-C ends it early."""
    try:
        while not run.finished:
            run.advance(wall_time=None if progress is None else PROGRESS_SECONDS)
            if progress is not None and not run.finished:
                _report_progress(progress, run)
    except KeyboardInterrupt:
        # After the last step there is nothing to stop: the analysis that needs the run ends instead.
        if not run.finished:
            interrupts.answered()
            run.stop(f"stopped by Ctrl-C at {run.time:g} s of {run.stop_time:g} s")
    result = run.result()
    if progress is not None and result.run.complete:
        _report_progress(progress, run)
    return result


def check_interrupt(result: SimulationResult) -> None:
    """Raise ``KeyboardInterrupt`` if Ctrl-C ended a run early, or came after its last step."""
    if not result.run.complete:
        raise KeyboardInterrupt
    interrupts.check()


def _report_progress(progress: Progress, run: Simulation) -> None:
    stop = run.stop_time
    progress(run.time, run.time / stop if stop > 0.0 else 1.0, run.time / max(run.wall_time, 1e-9))
