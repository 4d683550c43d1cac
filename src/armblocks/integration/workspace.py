"""The state of one integration as two flat arrays, shared by the native loop and the Python around it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from armblocks.integration.rosenbrock_tableau import Tableau


class Status(IntEnum):
    """The status of the native loop when it returns."""

    DONE = 0
    PAUSED = 1
    """The asked number of steps is taken: call again."""
    STEP_TOO_SMALL = 2
    """The error is too large even with the minimum step."""
    NON_FINITE = 3
    """A derivative or state became NaN or infinite, even with the minimum step (fixed step: in this step)."""
    NON_FINITE_START = 4
    """The derivative at the start of a segment is NaN or infinite."""
    ENDLESS_EVENTS = 5
    """Endless events: at one instant, or at ever shorter distances."""
    HISTORY_FULL = 6
    """The history of delayed signals needs more memory: enlarge it and call again."""
    STOPPED = 7
    """A guard that ends the run is positive; the present values are recorded."""
    MINIMUM_STEP = 8
    """Steps so short that what changes in one is within the tolerance, and far more to come."""
    INCONSISTENT_MODES = 9
    """No choice of the modes is consistent."""


class Scalar(IntEnum):
    """Places in the array of doubles; the vectors of :class:`Workspace` come after them."""

    TIME = 0
    STEP = 1
    """Length of the next step; with a fixed step, the spacing of the grid."""
    TRIED = 2
    """Length of the step tried last."""
    RTOL = 3
    ATOL = 4
    MAX_STEP = 5
    BOUND = 6
    """The next step is not longer: steps begin short after an event and grow again."""
    LAST_EVENT = 7
    """Time of the last event of any guard."""
    SPAN = 8
    """Events are told apart beside ``max(time, 1e-6 SPAN)``: about the length of the run."""
    SCAN = 9
    """How far apart the guards are evaluated next, at most; as far as they have proved to be smooth."""
    PAUSE = 10
    """The loop returns before the first step that would begin at this time or later."""
    HALT = 11
    """The loop returns before the ticks of the first instant at this time or later."""
    END = 12


class Count(IntEnum):
    """Places in the array of integers.

    After them comes the number of the next tick of every clock, then the first and the last row of the
    history that each delayed signal reads; -1 where the last is the newest.
    """

    SAMPLE = 0
    """Index of the next sample to record."""
    SAMPLES = 1
    SEGMENT = 2
    SEGMENTS = 3
    STARTED = 4
    """A :class:`Stage`."""
    GRID = 5
    """With a fixed step: the next step ends at ``GRID * STEP``."""
    ACCEPTED = 6
    REJECTED = 7
    EVALUATIONS = 8
    FRESH = 9
    """Whether the next start also chooses the first step's length."""
    INSTANTS = 10
    """Instants with ticks so far."""
    EVENTS = 11
    """Events so far."""
    CLOSE = 12
    """Events in a row that follow one another closely and do not come to an end."""
    SAVED = 13
    """Whether the checkpoint is written."""
    WATCHED = 14
    """Steps so far that were checked for stiffness."""
    STIFF = 15
    """Explicit methods: checks that found a step bound by stability. Methods for stiff systems: so many
    checks in a row at a step that an explicit method could take as well make one take over."""
    CALM = 16
    """Checks in a row that found no stiffness."""
    WATCHING = 17
    """0: the run keeps its method. Else it wants to be told where another one does better, and pauses
    there; 1 and the number of changes so far."""
    AT_START = 18
    """Whether the run is at its start, before the first mode iteration."""
    HISTORY_ROWS = 19
    """Rows of the history of delayed signals."""
    HISTORY_ROOM = 20
    """Capacity in rows."""
    SHORT = 21
    """Checks that found a step short without need, less some for every check that did not."""
    CROWDED = 22
    """Events in a row of which each comes soon after the one before."""
    END = 23


class Stage(IntEnum):
    """The stage at which the loop is entered."""

    INSTANT = 0
    """Ticks and events at the time reached, then the start."""
    START = 1
    """The first derivative."""
    RUNNING = 2
    """A step; its first derivative is in place."""


@dataclass(frozen=True, kw_only=True)
class DelaySlots:
    """One delayed scalar: where in ``z`` its value and its slope stand, and whether the delay is constant."""

    value: int
    slope: int
    fixed: bool


@dataclass(frozen=True, kw_only=True)
class LoopSizes:
    """The properties of a system for which a loop is generated: lengths of vectors, clocks and guards.

    ``clocks`` are pairs of period and offset, s; ``directions`` those of the guards, ``stops`` the numbers of
    those that end the run where they are positive. ``captures``: whether ``update`` is also called just
    before every instant. ``modes``: the places of the modes in ``z``; ``followers``, for each, whether it
    is a function of the signals alone; ``remembered``, the places in ``z`` of those that also read what they
    were before, each with the place of that; ``recaptured``, the places of the captured values that go with
    these; ``momentary``, the places of what is 0 again at the end of an instant; ``silenced``, the guards
    that do not fire where such a place is not 0, each with that place; ``locating``, the guards that only
    tell when modes change that are a function of the signals.
    ``tangents``: from which entries of ``x``, ``z`` and the guards on they belong to derivatives, if any.
    """

    states: int
    discrete: int = 0
    algebraic: int = 0
    delays: tuple[DelaySlots, ...] = ()
    clocks: tuple[tuple[float, float], ...] = ()
    directions: tuple[int, ...] = ()
    stops: tuple[int, ...] = ()
    captures: bool = False
    modes: tuple[int, ...] = ()
    followers: tuple[bool, ...] = ()
    remembered: tuple[tuple[int, int], ...] = ()
    recaptured: tuple[int, ...] = ()
    momentary: tuple[int, ...] = ()
    silenced: tuple[tuple[int, int], ...] = ()
    locating: tuple[int, ...] = ()
    tangents: tuple[int, int, int] | None = None

    @property
    def hybrid(self) -> bool:
        """Whether the system has ticks, events, delays or implicit equations."""
        return bool(self.discrete or self.algebraic or self.delays or self.clocks or self.directions)


class Workspace:
    """The position of each vector in the array of doubles.

    ``x`` the state of the last accepted step, ``y`` that at the end of the step being tried (and, before it,
    at each stage), ``slope(row)`` the stage derivatives; then what only hybrid systems have: ``z`` and ``w``
    as accepted, ``new_x`` and ``new_z`` what a reset or update makes of them, ``trial_w`` the unknowns of the
    implicit equations at the point evaluated last, ``guards``, those at the beginning and in the middle of
    the window that is searched (``guards_before``, ``guards_middle``), how fast they changed at the end of
    the window before it (``guard_slopes``, NaN: not known), their ``signs`` (0: not known yet), the values
    and signs at the start of the step (``guards_at_start``, ``signs_at_start``),
    ``fired``, when each fired last (``last``), how long after the time before (``gap``), how often in a row
    this became shorter (``shrinking``), and how often it fired among the latest events that follow one
    another closely (``repeats``); ``contradictions``, not 0 for the modes that contradict their conditions;
    ``ticking``; and for Newton's method ``residual``, ``jacobian``, ``before``, and ``pivots`` and ``swaps``
    (integers) of its elimination. For delayed signals: how long each is delayed (``taus``), between which
    bounds (``bounds``: all shortest, all longest), the ``longest`` of all; the ``history`` comes behind
    everything.
    """

    def __init__(self, tableau: Tableau, sizes: LoopSizes) -> None:
        n, nz, nw, ng = sizes.states, sizes.discrete, sizes.algebraic, len(sizes.directions)
        self.states = n
        self.x = int(Scalar.END)
        self.y = self.x + n
        self._slopes = self.y + n
        self.z = self._slopes + tableau.rows * n
        self.w = self.z + nz
        self.new_x = self.w + nw
        self.new_z = self.new_x + n
        self.trial_w = self.new_z + nz
        self.guards = self.trial_w + nw
        self.contradictions = self.guards + ng
        self.guards_before = self.contradictions + len(sizes.modes)
        self.guards_middle = self.guards_before + ng
        self.guard_slopes = self.guards_middle + ng
        self.signs = self.guard_slopes + ng
        self.guards_at_start = self.signs + ng
        self.signs_at_start = self.guards_at_start + ng
        self.fired = self.signs_at_start + ng
        self.last = self.fired + ng
        self.gap = self.last + ng
        self.repeats = self.gap + ng
        self.shrinking = self.repeats + ng
        self.ticking = self.shrinking + ng
        self.residual = self.ticking + len(sizes.clocks)
        self.jacobian = self.residual + nw
        self.before = self.jacobian + nw * nw
        self.pivots = self.before + nw
        self.swaps = self.pivots + nw
        self.size = self.swaps + nw
        lines = len(sizes.delays)
        self.taus = self.size
        self.bounds = self.taus + lines
        self.size = self.bounds + 2 * lines + (1 if lines else 0)
        self.longest = self.size - 1
        self.history = self.size
        self.history_width = 2 + 2 * lines
        self.counts = int(Count.END) + len(sizes.clocks) + 2 * lines

    def slope(self, row: int) -> int:
        """Where row ``row`` of the stage derivatives begins."""
        return self._slopes + row * self.states
