"""The settings of a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from armblocks.errors import check_arguments


@dataclass(frozen=True, kw_only=True)
class SimulationOptions:
    """Settings of one run. ``None`` leaves the choice to the simulation, which reports it.

    ``stop_time`` s; ``solver`` a name of ``armblocks.simulation.tableaux`` or ``"auto"``; ``step`` s: size of
    a fixed step; ``sample_time`` s: interval of the recorded samples (at ``k * sample_time``, computed by a
    product, and at the stop time); ``max_step`` s; ``rtol``, ``atol``: an adaptive step is accepted where the
    error is below ``atol + rtol |x|`` in the root-mean-square norm; ``record_jumps``: whether both sides of
    each jump of a signal are recorded between the samples.
    """

    stop_time: float = 10.0
    solver: str = "auto"
    step: float | None = None
    sample_time: float | None = None
    max_step: float | None = None
    rtol: float = 1e-6
    atol: float = 1e-9
    record_jumps: bool = True

    def __new__(cls, *values: object, **named: object) -> Self:
        check_arguments(cls, values, named)
        return super().__new__(cls)
