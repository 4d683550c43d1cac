"""The memory of a batch of runs: the indices of its addresses and numbers, shared with the native loop."""

from __future__ import annotations

from enum import IntEnum


class Place(IntEnum):
    """Indices in the table of addresses of a batch."""

    ADVANCE = 0
    """The native loop of a run."""
    INITIAL_STATES = 1
    INITIAL_DISCRETE = 2
    BREAKPOINTS = 3
    SIGNALS = 4
    EXPRESSIONS = 5
    """The function of the expressions over signals."""
    PARAMETERS = 6
    """The parameters of all runs of the batch, ``(runs, np)``."""
    GUESSES = 7
    """The guesses of the implicit unknowns of all runs, ``(runs, nw)``."""
    REALS = 8
    COUNTS = 9
    FIRST_REALS = 10
    """The arrays of a run before its first step."""
    FIRST_COUNTS = 11
    SAMPLES = 12
    FIRST_SAMPLES = 13
    ENDS = 14
    CLAMPS = 15
    STATES = 16
    DISCRETE = 17
    ALGEBRAIC = 18
    JUMPS = 19
    SAVED_REALS = 20
    SAVED_COUNTS = 21
    SCRATCH = 22
    BREAKPOINT_TIMES = 23
    INSTANTS = 24
    """The times at which the signals are evaluated, then at which they jump."""
    VALUES = 25
    """Signals ``(ny, N)``."""
    EXPRESSION_VALUES = 26
    SIDE_TIMES = 27
    SIDE_STATES = 28
    SIDE_DISCRETE = 29
    SIDE_ALGEBRAIC = 30
    SIDE_VALUES = 31
    """Signals on both sides of all jumps, ``(ny, 2 M)``."""
    SIDE_EXPRESSIONS = 32
    JUMP_TIMES = 33
    JUMPING = 34
    """Whether each used signal jumps at each instant, ``(used signals, M)``, integers."""
    SERIES_TIMES = 35
    SERIES_VALUES = 36
    USED = 37
    """The rows of the used signals."""
    QUANTITIES = 38
    """A row for each quantity: see :class:`Quantity`."""
    QUANTITY_SIGNALS = 39
    """The indices of the used signals of all quantities, one after the other."""
    MEASURES = 40
    """The addresses of the measures' functions; null for the number of events."""
    MEASURE_QUANTITIES = 41
    MEASURE_OPTIONS = 42
    RESULTS = 43
    """The measures of all runs, ``(runs, measures)``."""
    REPORTS = 44
    """A row of integers for each run: see :class:`Report`."""
    END_TIMES = 45
    KEPT = 46
    """The quantities whose samples are kept."""
    KEPT_VALUES = 47
    """The kept samples of all runs, ``(runs, kept, N)``."""
    STOPS = 48
    """The guards that end the run."""
    DELAYED = 49
    """The indices in ``z`` of the delayed values."""
    END = 50


class Number(IntEnum):
    """Indices in the integers of a batch."""

    PARAMETERS = 0
    STATES = 1
    DISCRETE = 2
    ALGEBRAIC = 3
    SIGNALS = 4
    SAMPLES = 5
    BREAKPOINTS = 6
    REALS = 7
    COUNTS = 8
    X = 9
    """Index of the states in the array of doubles. The next members are indices in the same array."""
    Z = 10
    W = 11
    SIGNS = 12
    HISTORY = 13
    DELAYS = 14
    STOPS = 15
    USED = 16
    QUANTITIES = 17
    MEASURES = 18
    KEPT = 19
    MAX_STEPS = 20
    SIDES = 21
    """Maximum number of sides of jumps."""
    END = 22


class Quantity(IntEnum):
    """The columns of the table of quantities."""

    ROW = 0
    """A row of the signals; -1 - k for the expression k."""
    FIRST = 1
    """Index of the quantity's first signal in the table of indices."""
    COUNT = 2
    """The number of the quantity's signals."""
    END = 3


class Report(IntEnum):
    """The columns of the reports of runs."""

    STATUS = 0
    """An :class:`Outcome`."""
    GUARD = 1
    """The guard that ended the run; of another outcome, the status of the loop."""
    STEPS = 2
    EVENTS = 3
    SAMPLES = 4
    END = 5


class Outcome(IntEnum):
    """The outcome of a native run."""

    COMPLETED = 0
    STOPPED = 1
    """A block ended the run."""
    LIMIT = 2
    """The run has not ended after the maximum number of steps."""
    OTHER = 3
    """The run failed, needs another method or needs more memory; ``run_alone`` repeats it."""
