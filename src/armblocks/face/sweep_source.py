"""The source of a sweep: what repeats its single runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from armblocks.equations import SimulationOptions
from armblocks.face.model import CompiledDiagram
from armblocks.sweeps.designs import Design


@dataclass(frozen=True, eq=False)
class SweepSource:
    """The model, the settings and the design of a sweep, for repeating single runs."""

    model: CompiledDiagram
    options: SimulationOptions
    design: Design
    measures: Mapping[str, str] = field(default_factory=dict[str, str])
    """The texts of the measures, or the names of their Python functions."""
