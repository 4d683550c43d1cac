"""The equations of a whole diagram: the interface between modelling and numerics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from armblocks.equations.signatures import Signature
from armblocks.errors import InputError

if TYPE_CHECKING:
    from armblocks.equations.traced_function import TracedFunction


@dataclass(frozen=True)
class SampleClock:
    """A clock with ticks at ``offset + k period`` (s), ``k = 0, 1, …``. The times are products, not sums."""

    period: float
    offset: float = 0.0

    def __post_init__(self) -> None:
        if not (0.0 < self.period < np.inf and 0.0 <= self.offset < self.period):
            raise InputError(
                f"a clock has the period {self.period:g} s and the offset {self.offset:g} s",
                allowed="a finite period > 0 and 0 <= offset < period",
                fix="change the sample time",
                where="sample clock",
            )


@dataclass(frozen=True, eq=False, kw_only=True)
class Delays:
    """The ``nd`` delayed scalars: inputs, delays, and indices of the delayed values in ``z``.

    - ``values``, ``derivatives``: the indices in ``z`` of the values at ``t - tau``, and of their time
      derivatives for ``fixed`` delays. They are the only entries of ``z`` that change between instants.
    - ``inputs``: from ``t, x, z, w, p`` the delayed signals and their exact time derivatives, ``(2 nd,)``.
    - ``times``: from the same arguments the delays, ``(nd,)`` s.
    - ``bounds``: from ``p`` the lower and upper limits of the delays, above 0, ``(2 nd,)`` s.

    Before the start, a signal has its value in ``initial_discrete``.
    """

    values: tuple[int, ...]
    derivatives: tuple[int, ...]
    fixed: tuple[bool, ...]
    inputs: TracedFunction
    times: TracedFunction
    bounds: TracedFunction


@dataclass(frozen=True, eq=False, kw_only=True)
class LinearLoops:
    """Linear loops ``x = M x + c`` that are solved symbolically, with the data for their condition numbers.

    ``signals``: the names of the unknowns of each loop. ``matrices``: from ``t, x, z, w, p`` the matrices
    ``M - 1`` of all loops, row by row.
    """

    signals: tuple[tuple[str, ...], ...]
    matrices: TracedFunction


@dataclass(frozen=True, kw_only=True)
class EventRanks:
    """The ranks of events at one instant: events of a lower rank are processed first. Events of a negative
    rank change only derivatives. Events up to the rank ``before_ticks[k]`` come before the ticks of level
    ``k``.

    ``guards``, ``hysteresis_modes``, ``recaptured_states``: the ranks of the entries of the fields of
    :class:`HybridSystem` with these names. ``controls``: for each control of a conditional subsystem, two
    indices in ``z`` and a rank. The first index is that of the mode with the sign of the control signal, the
    second that of the value of this mode at its last event. While events of a lower rank are processed, the
    mode has its old value.
    """

    before_ticks: tuple[int, ...]
    guards: tuple[int, ...]
    hysteresis_modes: tuple[int, ...]
    recaptured_states: tuple[int, ...]
    controls: tuple[tuple[int, int, int], ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class HybridSystem:
    """Continuous flow, sampled parts, events and implicit equations of one diagram.

    ``x' = derivative(t, x, z, w, p)``, ``y = signals(t, x, z, w, p)``, ``x(0) = initial_states(p)``, where
    ``w`` solves ``0 = residual(t, x, z, w, p)``. ``z`` changes at instants and is constant in between.

    The flat vectors ``x`` (states), ``z`` (discrete), ``w`` (algebraic), ``p`` (tunable parameters) and ``y``
    (signals) are laid out by the signatures. Slot names are paths: a signal is ``block/port``, a state
    ``block/state``, a parameter ``block.parameter``; signals are in evaluation order, so the first non-finite
    signal causes all others.

    All functions have flat inputs and outputs:

    - ``derivative``, ``signals``, ``residual``, ``residual_jacobian`` and ``guards``: inputs ``t ()``, ``x
      (nx,)``, ``z (nz,)``, ``w (nw,)``, ``p (np,)``; one output ``xd (nx,)``, ``y (ny,)``, ``r (nw,)``, ``J
      (nw, nw)``, ``g (ng,)``. At a breakpoint, as at a tick, the signs of guards before and after the instant
      are compared.
    - ``update``: the additional input ``m (nclocks,)``; output ``z (nz,)``: the new z at an instant at which
      the clocks with ``m[k] = 1`` tick. If ticks have several levels, a clock with ``m[k] = 2 + j`` ticks for
      the outputs and discrete states of level ``j`` only. If ``captures`` is true, ``update`` is also
      evaluated without a ticking clock just before every instant, at a time one unit in the last place
      earlier: z then stores left limits.
    - ``reset``: the additional input ``e (ng,)``, +1 or -1 where a guard fired upwards or downwards, else 0;
      outputs ``x (nx,)`` and ``z (nz,)``. With all ``e`` zero it gives the consistent modes (for example of a
      limiter that starts beyond its limit) and the resulting states. A run makes this call at the start,
      before each level of ticks that follows events and after the ticks, and whenever no guard fires and a
      mode is inconsistent.
    - ``contradictions``: the inputs of ``guards``; output ``c (nm,)``, not 0 where the mode ``z[modes[k]]``
      is not consistent with the present values.
    - ``initial_states``, ``initial_discrete``, ``initial_algebraic``: input ``p``; output ``x0``, ``z0``,
      ``w0``. At the start all clocks without an offset tick, before the first derivative.
    - ``breakpoints``: input ``p``; output ``times (nb,)``: known times at which signals jump (a step source).

    Signals are right-continuous: at a breakpoint, a tick or an event they have their new values.
    """

    name: str
    states: Signature
    discrete: Signature
    """Held outputs, discrete states and modes: slots ``block/state``."""
    algebraic: Signature
    """Unknowns of implicit equations: slots ``block/port``."""
    parameters: Signature
    signals_layout: Signature
    clocks: tuple[SampleClock, ...]
    """The distinct sample times, fastest first."""
    parameter_values: NDArray[np.float64]
    derivative: TracedFunction
    signals: TracedFunction
    residual: TracedFunction
    residual_jacobian: TracedFunction
    """Derivative of ``residual`` with respect to ``w``."""
    update: TracedFunction
    guards: TracedFunction
    """Guards: an event occurs where an entry crosses zero."""
    guard_directions: tuple[int, ...]
    """The direction in which each guard fires: +1 upwards, -1 downwards, 0 both."""
    guard_names: tuple[str, ...]
    """The block of each guard, for messages."""
    reset: TracedFunction
    initial_states: TracedFunction
    initial_discrete: TracedFunction
    initial_algebraic: TracedFunction
    breakpoints: TracedFunction
    aliases: Mapping[str, str]
    """Other names of signals: the name of a block with one output, and an input port (``scope/u``) for the
    signal that drives it."""
    guard_actions: tuple[str, ...] = ()
    """The effect of each guard when it is positive: ``stop`` ends the run, ``fail`` ends it with an error,
    ``warn`` is reported at the end of the run, an empty text has no effect."""
    modes: tuple[int, ...] = ()
    """The indices of the modes in ``z``."""
    followers: tuple[bool, ...] = ()
    """For each mode, whether it is a following mode: a function of the present signals, possibly with
    hysteresis."""
    hysteresis_modes: tuple[tuple[int, int, int], ...] = ()
    """Three indices in ``z`` for each hysteresis mode: the mode; its previous value; a mode that is 0 while
    the previous value does not change (-1: none). The previous value is the value before the instant, or
    before the latest event at this instant."""
    recaptured_states: tuple[int, ...] = ()
    """The indices in ``z`` of the captured values of hysteresis modes, which are captured again at events."""
    momentary_states: tuple[int, ...] = ()
    """The indices in ``z`` of the momentary values, which become 0 at the end of every instant."""
    disabled_guards: tuple[tuple[int, int], ...] = ()
    """Guards, each with the index in ``z`` of a momentary value. While that value is nonzero the guard does
    not fire; at the end of the instant its stored sign becomes the sign of its value."""
    locating_guards: tuple[int, ...] = ()
    """The guards that only locate changes of following modes."""
    ranks: EventRanks | None = None
    """The order of events at one instant; ``None`` if all events are processed together."""
    tangents: tuple[int, int, int] | None = None
    """The first indices in ``x``, ``z`` and the guards that belong to derivatives, if there are any."""
    contradictions: TracedFunction | None = None
    """The function that is nonzero for inconsistent modes; ``None`` without modes."""
    delays: Delays | None = None
    """The delayed signals."""
    captures: bool = False
    """Whether a discrete variable stores a left limit."""
    called: tuple[str, ...] = ()
    """Blocks without equations, whose outputs are computed in Python at their ticks."""
    loops: LinearLoops | None = None
    """The linear loops that are solved symbolically."""

    def ticks_by_level(self, ticking: NDArray[np.float64]) -> list[tuple[NDArray[np.float64], bool]]:
        """For each level of ticks the argument ``m`` of ``update``, and whether events come before the level.
        ``ticking``: 1 for each clock that ticks, else 0."""
        ranks = (-1,) if self.ranks is None else self.ranks.before_ticks
        if not ticking.any():
            return []
        if len(ranks) == 1:
            return [(ticking, ranks[0] >= 0)]
        return [(ticking * (2.0 + level), rank >= 0) for level, rank in enumerate(ranks)]
