"""The state of one integration as two flat arrays, shared by the native loop and its Python caller."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from armblocks.integration.rosenbrock_tableau import Tableau


class Status(IntEnum):
    """The status of the native loop when it returns."""

    DONE = 0
    PAUSED = 1
    """The maximum number of steps of the call is reached: call again."""
    STEP_TOO_SMALL = 2
    """The error is too large even with the minimum step."""
    NON_FINITE = 3
    """A derivative or state became NaN or infinite, even with the minimum step (fixed step: in this step)."""
    NON_FINITE_START = 4
    """The derivative at the start of a segment is NaN or infinite."""
    ENDLESS_EVENTS = 5
    """Endless events: at one instant, or at decreasing distances."""
    HISTORY_FULL = 6
    """The history of delayed signals needs more memory: enlarge it and call again."""
    STOPPED = 7
    """A guard that ends the run is positive; the present values are recorded."""
    MINIMUM_STEP = 8
    """The steps are needlessly short, and the run would need far too many of them."""
    INCONSISTENT_MODES = 9
    """No choice of the modes is consistent."""
    JUMPS_FULL = 10
    """The record of the jumps needs more memory: enlarge it and call again."""


class Scalar(IntEnum):
    """Indices in the array of doubles; the vectors of :class:`Workspace` come after them."""

    TIME = 0
    STEP = 1
    """Length of the next step; with a fixed step, the spacing of the grid."""
    TRIED = 2
    """Length of the latest trial step."""
    RTOL = 3
    ATOL = 4
    MAX_STEP = 5
    BOUND = 6
    """Maximum length of the next step. It is short after an event and grows with each step."""
    LAST_EVENT = 7
    """Time of the last event of any guard."""
    SPAN = 8
    """Approximate length of the run. The resolution of events is relative to ``max(time, 1e-6 SPAN)``."""
    WINDOW = 9
    """Length of the next window of the event search. It grows while the guards are smooth."""
    PAUSE = 10
    """The loop returns before the first step that begins at this time or later."""
    HALT = 11
    """The loop returns before the ticks of the first instant at this time or later."""
    END = 12


class Count(IntEnum):
    """Indices in the array of integers.

    Behind them are the number of the next tick of every clock, and the first and the last row of the history
    that each delayed signal reads. A negative last row means the newest row.
    """

    SAMPLE = 0
    """Index of the next sample to record."""
    SAMPLES = 1
    SEGMENT = 2
    SEGMENTS = 3
    STAGE = 4
    """A :class:`Stage`."""
    GRID = 5
    """With a fixed step: the next step ends at ``GRID * STEP``."""
    ACCEPTED = 6
    REJECTED = 7
    EVALUATIONS = 8
    RESTARTED = 9
    """Whether the next step is the first after a restart, so that its length is chosen again."""
    INSTANTS = 10
    """Instants with ticks so far."""
    EVENTS = 11
    """Events so far."""
    CLOSE_EVENTS = 12
    """Consecutive close events whose distances do not shrink."""
    SAVED = 13
    """Whether the checkpoint has been written."""
    STIFFNESS_STEPS = 14
    """Number of steps so far; every ``CHECK_INTERVAL``-th step is checked for stiffness."""
    STIFF = 15
    """Explicit methods: number of checks with a stability-limited step. Methods for stiff systems: number of
    consecutive checks without stiffness after which an explicit method replaces them."""
    NON_STIFF = 16
    """Number of consecutive checks without stiffness."""
    STIFFNESS_DETECTION = 17
    """0: the run keeps its method. Else 1 plus the number of changes of the method so far: the run pauses
    where another method is faster."""
    AT_START = 18
    """Whether the run is at its start, before the first mode iteration."""
    HISTORY_ROWS = 19
    """Rows of the history of delayed signals."""
    HISTORY_CAPACITY = 20
    """Capacity in rows."""
    SHORT_STEPS = 21
    """Number of checks that found a needlessly short step, minus ``SHORT_DECREASE`` for every check that did
    not."""
    RAPID_EVENTS = 22
    """Consecutive events whose distances are at most ``RAPID_DISTANCE`` times the time."""
    JUMPS = 23
    """Rows in the record of the jumps."""
    JUMPS_CAPACITY = 24
    """The loop returns before a step where ``JUMPS`` has reached this number."""
    JUMPS_RECORDED = 25
    """Whether jumps are recorded."""
    END = 26


class Stage(IntEnum):
    """The stage at which the loop is entered."""

    INSTANT = 0
    """Ticks and events at the present time, then the start."""
    START = 1
    """The first derivative."""
    RUNNING = 2
    """A step; its first derivative is in place."""
    TICKS = 3
    """Ticks at the present time, after the events that come before them."""


@dataclass(frozen=True, kw_only=True)
class DelaySlots:
    """One delayed scalar: the indices of its value and derivative in ``z``, and whether the delay is
    constant."""

    value: int
    derivative: int
    fixed: bool


@dataclass(frozen=True, kw_only=True)
class LoopSizes:
    """The properties of a system for which a loop is generated: lengths of vectors, clocks and guards.

    - ``clocks``: pairs of period and offset, s.
    - ``directions``: the direction of each guard. ``stops``: the guards that end the run when they are
      positive.
    - ``captures``: whether ``update`` is also called just before every instant.
    - ``modes``: the indices of the modes in ``z``. ``followers``: for each mode, whether it is a following
      mode.
    - ``hysteresis_modes``: three indices in ``z`` each: the mode, its previous value, and a mode that is 0
      while the previous value does not change (-1: none).
    - ``recaptured_states``: the indices in ``z`` of the captured values that belong to hysteresis modes.
    - ``momentary_states``: the indices in ``z`` that are set to 0 at the end of every instant.
    - ``disabled_guards``: guards, each with an index of ``momentary_states``. While that value is nonzero,
      the guard does not fire.
    - ``locating_guards``: the guards that only locate mode changes.
    - ``guard_ranks``: the rank of each guard; empty if all events are processed together.
      ``hysteresis_ranks``, ``recaptured_ranks``: the ranks of the entries of ``hysteresis_modes`` and
      ``recaptured_states``. ``controls``: the indices in ``z`` of a mode and of its old value, and a rank;
      while events of a lower rank are processed, the mode has its old value.
      ``ranks_before_ticks``: for each level of ticks, the highest rank of the events before it; negative if
      there are none.
    - ``parameters``: the number of parameters.
    - ``looped``: whether the system has algebraic loops.
    - ``tangents``: the first entries of ``x``, ``z`` and the guards that belong to derivatives, if there are
      any.
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
    hysteresis_modes: tuple[tuple[int, int, int], ...] = ()
    recaptured_states: tuple[int, ...] = ()
    momentary_states: tuple[int, ...] = ()
    disabled_guards: tuple[tuple[int, int], ...] = ()
    locating_guards: tuple[int, ...] = ()
    guard_ranks: tuple[int, ...] = ()
    ranks_before_ticks: tuple[int, ...] = (-1,)
    hysteresis_ranks: tuple[int, ...] = ()
    recaptured_ranks: tuple[int, ...] = ()
    controls: tuple[tuple[int, int, int], ...] = ()
    parameters: int = 0
    looped: bool = False
    tangents: tuple[int, int, int] | None = None

    @property
    def hybrid(self) -> bool:
        """Whether the system has ticks, events, delays or implicit equations."""
        return bool(self.discrete or self.algebraic or self.delays or self.clocks or self.directions)

    @property
    def may_be_undecided(self) -> bool:
        """Whether a following mode may depend on itself."""
        return self.looped and any(self.followers)


class Workspace:
    """The position of each vector in the array of doubles.

    All systems:

    - ``x``: the state of the last accepted step.
    - ``y``: the state of each stage of the trial step, then the state at its end.
    - ``stage_derivative(row)``: the stage derivatives.

    Only hybrid systems:

    - ``z``, ``w``: discrete variables and implicit unknowns of the last accepted step.
    - ``new_x``, ``new_z``: the result of a reset or update.
    - ``trial_w``: the implicit unknowns at the latest evaluation point.
    - ``guards``: their present values; ``guards_before``, ``guards_middle``: at the beginning and in the
      middle of the searched window.
    - ``guard_derivatives``: their derivatives at the end of the previous window (NaN: unknown).
    - ``signs``: their stored signs (0: none yet); ``guards_at_start``, ``signs_at_start``: values and signs
      at the start of the step.
    - ``fired``: the marks of the guards that fired; ``last``: the time of the last event of each guard.
    - ``gap``: the time between its last two events; ``shrinking``: the number of
      consecutive decreases of this time.
    - ``repeats``: the number of its events among the latest consecutive close events.
    - ``contradictions``: nonzero for inconsistent modes.
    - ``ticking``: the marks of the clocks.
    - ``undecided`` …: see :class:`UndecidedModes`.
    - ``residual``, ``jacobian``, ``before``, ``pivots``, ``swaps`` (integers): memory of Newton's method.
    - ``taus``: the present delays; ``bounds``: all shortest, then all longest delays; ``longest``: the
      longest of all.
    - ``history``: the history of the delayed signals, after everything else.
    """

    def __init__(self, tableau: Tableau, sizes: LoopSizes) -> None:
        n, nz, nw, ng = sizes.states, sizes.discrete, sizes.algebraic, len(sizes.directions)
        self.states = n
        self.x = int(Scalar.END)
        self.y = self.x + n
        self._stage_derivatives = self.y + n
        self.z = self._stage_derivatives + tableau.rows * n
        self.w = self.z + nz
        self.new_x = self.w + nw
        self.new_z = self.new_x + n
        self.trial_w = self.new_z + nz
        self.guards = self.trial_w + nw
        self.contradictions = self.guards + ng
        self.guards_before = self.contradictions + len(sizes.modes)
        self.guards_middle = self.guards_before + ng
        self.guard_derivatives = self.guards_middle + ng
        self.signs = self.guard_derivatives + ng
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
        if sizes.may_be_undecided:
            self.undecided = self.size
            self.remaining_contradictions = self.undecided + len(sizes.modes)
            self.saved_z = self.remaining_contradictions + len(sizes.modes)
            self.saved_w = self.saved_z + nz
            self.saved_guards = self.saved_w + nw
            self.changed_t = self.saved_guards + ng
            self.changed_x = self.changed_t + 1
            self.changed_p = self.changed_x + n
            self.size = self.changed_p + sizes.parameters
        lines = len(sizes.delays)
        self.taus = self.size
        self.bounds = self.taus + lines
        self.size = self.bounds + 2 * lines + (1 if lines else 0)
        self.longest = self.size - 1
        self.history = self.size
        self.history_width = 2 + 2 * lines
        self.counts = int(Count.END) + len(sizes.clocks) + 2 * lines

    def stage_derivative(self, row: int) -> int:
        """The index of row ``row`` of the stage derivatives."""
        return self._stage_derivatives + row * self.states
