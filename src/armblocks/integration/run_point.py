"""The state of a run at one time, and checkpoints, to which a run can return."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from armblocks.integration.workspace import Count, LoopSizes, Scalar, Stage, Workspace

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
    history: Vector = field(default_factory=lambda: NO_NUMBERS)


@dataclass(frozen=True, kw_only=True)
class Checkpoint:
    """The arrays of a run before its last step, which the stop time shortened, and the name of the method."""

    reals: Vector
    counts: Integers
    method: str


def is_history(numbers: Vector, width: int) -> bool:
    """Whether an array can be a history of delayed signals with rows of ``width`` numbers: at least one
    complete row, times that do not decrease, and the middle row of each step after its first row."""
    if not numbers.size or numbers.size % width:
        return False
    rows = numbers.reshape(-1, width)
    times, middle = rows[:, 0], rows[:, 1]
    flags = bool(np.isin(middle, (0.0, 1.0)).all()) and middle[0] == 0.0
    return bool(flags and (np.diff(times) >= 0.0).all() and not (middle[1:] * middle[:-1]).any())


def fits(checkpoint: Checkpoint, workspace: Workspace, sizes: LoopSizes) -> bool:
    """Whether the arrays have the sizes and indices of a loop. The arrays of a damaged file may differ."""
    reals, counts = checkpoint.reals, checkpoint.counts
    if reals.size < workspace.size or counts.size != workspace.counts:
        return False
    if not (np.isfinite(reals[Scalar.TIME]) and counts[Count.STAGE] in tuple(Stage)):
        return False
    if not sizes.delays:
        return True
    width, rows = workspace.history_width, int(counts[Count.HISTORY_ROWS])
    numbers = reals[workspace.history :]
    first, last = counts[-2 * len(sizes.delays) :].reshape(2, -1)
    if not 0 < rows <= numbers.size // width or not ((first >= 0) & (last >= -rows) & (last < rows)).all():
        return False
    history = numbers[: rows * width]
    jumps = history[1::width][last] == 0.0
    return is_history(history, width) and bool(((last < 0) & (first < rows) | (last >= first) & jumps).all())
