"""The memory of a loop that integrates a run in each lane: rows of lanes, shared numbers, addresses.

A row has one double for each lane. Counters are integers with the bits of a double in the row, so that all
rows have one type.
"""

from __future__ import annotations

from enum import IntEnum

from armblocks.integration.rosenbrock_tableau import Tableau
from armblocks.integration.workspace import LoopSizes


class Row(IntEnum):
    """The first rows of the memory; the vectors of :class:`LaneWorkspace` come after them."""

    TIME = 0
    LENGTH = 1
    """Length of the next step, adaptive methods."""
    GROWTH = 2
    """Maximum ratio of the following to the present step; 1 after a rejection."""
    SEGMENT_END = 3
    CLAMP = 4
    """The latest time at which the derivative may be evaluated in this segment."""
    LAST_END = 5
    """The end of the run."""
    NEXT_SAMPLE = 6
    """The time of the next sample; infinite after the last."""
    RUNNING = 7
    """1 for a lane whose next action is a step, else 0."""
    STARTING = 8
    """1 for a lane whose next action is the start of a segment, else 0."""
    ACCEPTED = 9
    """Number of accepted steps. This and the following rows up to ``NON_STIFF`` are integers."""
    ALLOWED = 10
    """Maximum number of accepted steps."""
    SHORT_STEPS = 11
    STIFF = 12
    NON_STIFF = 13
    """These three are as in :class:`armblocks.integration.workspace.Count`."""
    GRID = 14
    """Number of the next grid point, methods with a fixed step."""
    SAMPLE = 15
    """The number of the next sample, an integer."""
    POINT = 16
    """The time of an evaluation."""
    NEW_TIME = 17
    """The end of an accepted step with samples."""
    TRIED = 18
    """The length of this step."""
    END = 19


class SharedNumber(IntEnum):
    """Indices of doubles that all runs have in common."""

    STEP = 0
    """Spacing of the grid, methods with a fixed step."""
    RTOL = 1
    ATOL = 2
    MAX_STEP = 3
    END = 4


class SharedCount(IntEnum):
    """Indices of integers that all runs have in common."""

    NEXT_RUN = 0
    STOP_RUN = 1
    """The number of the first run that is not computed."""
    MAX_STEPS = 2
    STIFFNESS_DETECTION = 3
    """Whether a run pauses where a method for stiff systems is faster."""
    END = 4


class SharedPlace(IntEnum):
    """Indices of addresses that all runs have in common."""

    START = 0
    """The function that writes the start values of a run to its arrays."""
    FINISH = 1
    """The function that computes the results of a run from its arrays."""
    NUMBERS = 2
    """The second argument of these functions."""
    PARAMETERS = 3
    """The parameters of all runs ``(runs, np)``."""
    SAMPLES = 4
    """The sample times, followed by infinity."""
    SHARED = 5
    COUNTS = 6
    END = 7
    """The addresses of the lanes follow: :class:`LanePlace` for each lane."""


class LanePlace(IntEnum):
    """Indices of the addresses of one lane. The arrays are those of a run without lanes."""

    TABLE = 0
    """The first argument of the functions ``START`` and ``FINISH``."""
    REALS = 1
    COUNTS = 2
    ENDS = 3
    CLAMPS = 4
    STATES = 5
    """The states of the samples ``(N, n)``."""
    JUMPS = 6
    RUN = 7
    """An integer: the number of the lane's run."""
    END = 8


class LaneWorkspace:
    """The position of each vector in the rows.

    ``x``: the state of the last accepted step. ``y``: the state of each stage, then the state at the step's
    end. ``p``: the parameters. ``stage_derivative(row)``: the stage derivatives.
    """

    def __init__(self, tableau: Tableau, sizes: LoopSizes) -> None:
        self.states = sizes.states
        self.x = int(Row.END)
        self.y = self.x + self.states
        self._stage_derivatives = self.y + self.states
        self.p = self._stage_derivatives + max(2, tableau.rows) * self.states
        self.size = self.p + sizes.parameters

    def stage_derivative(self, row: int) -> int:
        """The first row of the stage derivatives ``row``."""
        return self._stage_derivatives + row * self.states
