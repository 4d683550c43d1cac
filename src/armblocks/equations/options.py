"""The settings of a run."""

from __future__ import annotations

from dataclasses import dataclass

from armblocks.argument_errors import ArgumentErrors


@dataclass(frozen=True, kw_only=True)
class SimulationOptions(metaclass=ArgumentErrors):
    """Settings of one run. For ``None``, the simulation chooses a value and reports it.

    - ``stop_time``: end of the run, s.
    - ``solver``: a name of ``armblocks.simulation.tableaux``, or ``"auto"``.
    - ``step``: length of a fixed step, s.
    - ``sample_time``: interval of the recorded samples, s. The samples are at ``k * sample_time``, computed
      as a product, and at the stop time.
    - ``max_step``: maximum length of a step, s.
    - ``rtol``, ``atol``: an adaptive step is accepted if the error is below ``atol + rtol |x|`` in the
      root-mean-square norm.
    - ``record_jumps``: whether both sides of each jump are recorded between samples.
    """

    stop_time: float = 10.0
    solver: str = "auto"
    step: float | None = None
    sample_time: float | None = None
    max_step: float | None = None
    rtol: float = 1e-6
    atol: float = 1e-9
    record_jumps: bool = True
