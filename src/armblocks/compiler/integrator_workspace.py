"""The state of one integration as two flat arrays, shared by the native loop and the Python around it."""

from __future__ import annotations

from enum import IntEnum

from armblocks.compiler.butcher_tableau import ButcherTableau


class Status(IntEnum):
    """Why the native loop returned."""

    DONE = 0
    PAUSED = 1
    """The asked number of steps is taken: call again."""
    STEP_TOO_SMALL = 2
    """The error stays too large however short the step."""
    NON_FINITE = 3
    """A derivative or state became NaN or infinite, however short the step (fixed step: in this step)."""
    NON_FINITE_START = 4
    """The derivative at the start of a segment is NaN or infinite."""


class Real(IntEnum):
    """Places in the array of doubles; after them come x (n), y (n) and K (rows of n)."""

    TIME = 0
    STEP = 1
    """Length of the next step; with a fixed step, the spacing of the grid."""
    TRIED = 2
    """Length of the step tried last."""
    RTOL = 3
    ATOL = 4
    MAX_STEP = 5
    END = 6


class Count(IntEnum):
    """Places in the array of integers."""

    SAMPLE = 0
    """The next sample instant to be written."""
    SAMPLES = 1
    SEGMENT = 2
    SEGMENTS = 3
    STARTED = 4
    """Whether the current segment's first derivative is in place."""
    GRID = 5
    """With a fixed step: the next step ends at ``GRID * STEP``."""
    ACCEPTED = 6
    REJECTED = 7
    EVALUATIONS = 8
    END = 9


def state_place() -> int:
    """Where the state of the last accepted step begins."""
    return Real.END


def trial_place(states: int) -> int:
    """Where the state at the end of the step being tried begins (and, before it, at each stage)."""
    return Real.END + states


def slope_place(states: int, row: int) -> int:
    """Where row ``row`` of the stage derivatives K begins."""
    return Real.END + (2 + row) * states


def workspace_size(tableau: ButcherTableau, states: int) -> int:
    """Doubles that an integration needs."""
    return slope_place(states, tableau.rows)
