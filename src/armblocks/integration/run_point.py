"""The state of a run at one time, and the arrays of a run that may be taken back."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Integers = NDArray[np.int64]

NO_NUMBERS: Vector = np.empty(0)


@dataclass(frozen=True, kw_only=True)
class RunPoint:
    """The state of a run: time (s), states, discrete variables, unknowns of the implicit equations, and the
    history of delayed signals (rows of :mod:`armblocks.integration.delay_history`; none at the start of a
    run).

    ``begun``: the ticks at this time are already processed.
    """

    time: float
    x: Vector
    begun: bool = False
    z: Vector = field(default_factory=lambda: NO_NUMBERS)
    w: Vector = field(default_factory=lambda: NO_NUMBERS)
    past: Vector = field(default_factory=lambda: NO_NUMBERS)


@dataclass(frozen=True, kw_only=True)
class Checkpoint:
    """The arrays of a run before the step that its end shortened, and the name of the method."""

    reals: Vector
    counts: Integers
    method: str
