"""A whole diagram as equations: the narrow waist between modelling and numerics."""

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
    """Ticks at ``offset + k period`` (s), ``k = 0, 1, …``: computed, never accumulated."""

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
    """Delayed scalars, ``nd`` of them: what goes in, how long it takes, and where in ``z`` it comes out.

    ``inputs``: from ``t, x, z, w, p`` what is delayed and its exact time derivatives, ``(2 nd,)``. ``times``:
    from the same how long, ``(nd,)`` s. ``bounds``: from ``p`` the shortest and the longest of each, above 0,
    ``(2 nd,)`` s. ``values`` and ``slopes``: the places in ``z`` that show the value at ``t - tau``, and its
    time derivative for a delay that is ``fixed``, whenever an equation is evaluated. They alone of ``z``
    change while the time flows. Before the start, a signal was what ``initial_discrete`` has in its place.
    """

    values: tuple[int, ...]
    slopes: tuple[int, ...]
    fixed: tuple[bool, ...]
    inputs: TracedFunction
    times: TracedFunction
    bounds: TracedFunction


@dataclass(frozen=True, eq=False, kw_only=True)
class LinearLoops:
    """Loops ``x = M x + c`` that are solved where they stand, and how to know their condition.

    ``signals``: the names of the unknowns of each. ``matrices``: from ``t, x, z, w, p`` all ``M - 1`` row by
    row, one after another.
    """

    signals: tuple[tuple[str, ...], ...]
    matrices: TracedFunction


@dataclass(frozen=True, eq=False, kw_only=True)
class HybridSystem:
    """Continuous flow, sampled parts, events and implicit equations of one diagram.

    ``x' = derivative(t, x, z, w, p)``, ``y = signals(t, x, z, w, p)``, ``x(0) = initial_states(p)``, where
    ``w`` solves ``0 = residual(t, x, z, w, p)``. ``z`` jumps at instants and is constant in between.

    The flat vectors ``x`` (states), ``z`` (discrete), ``w`` (algebraic), ``p`` (tunable parameters) and ``y``
    (signals) are laid out by the signatures. Slot names are paths: a signal is ``block/port``, a state
    ``block/state``, a parameter ``block.parameter``; signals stand in evaluation order, so the first
    non-finite one is the culprit.

    All functions have flat ends. ``derivative``, ``signals``, ``residual``, ``residual_jacobian`` and
    ``guards``: inputs ``t ()``, ``x (nx,)``, ``z (nz,)``, ``w (nw,)``, ``p (np,)``; one output ``xd (nx,)``,
    ``y (ny,)``, ``r (nw,)``, ``J (nw, nw)``, ``g (ng,)``.
    ``update``: one input more, ``m (nclocks,)``; output ``z (nz,)``: what z becomes at an instant at which
    the clocks with ``m[k] = 1`` tick. Where ``captures`` is true, it is also asked for with no clock ticking,
    just before every instant, at a time one unit in the last place earlier: then z keeps left limits.
    ``reset``: one input more, ``e (ng,)``, +1 or -1 where a guard fired upwards or downwards, else 0; outputs
    ``x (nx,)`` and ``z (nz,)``. With all ``e`` zero it gives the consistent modes (of a limiter that starts
    beyond its limit), with what they entail for states. A run calls it so at the start after the ticks, and
    whenever no guard fires and some mode contradicts its condition. A breakpoint is an instant like a tick:
    guards are compared across it.
    ``contradictions``: the inputs of ``guards``; output ``c (nm,)``, not 0 where the mode ``z[modes[k]]`` is
    not consistent with the values of the moment.
    ``initial_states``, ``initial_discrete``, ``initial_algebraic``: input ``p``; output ``x0``, ``z0``,
    ``w0``. At the start all clocks without an offset tick, before the first derivative.
    ``breakpoints``: input ``p``; output ``times (nb,)``: known instants at which signals jump (a step
    source). A signal is right-continuous: at such an instant, a tick or an event it has its new value.
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
    """Derivative of ``residual`` by ``w``."""
    update: TracedFunction
    guards: TracedFunction
    """An event happens where one of its entries crosses zero."""
    guard_directions: tuple[int, ...]
    """+1 upwards, -1 downwards, 0 both."""
    guard_names: tuple[str, ...]
    """The block of each guard, for messages."""
    reset: TracedFunction
    initial_states: TracedFunction
    initial_discrete: TracedFunction
    initial_algebraic: TracedFunction
    breakpoints: TracedFunction
    aliases: Mapping[str, str]
    """Other names of signals: the block's bare name where it has one output, and an input port
    (``scope/u``) for the signal that drives it."""
    guard_actions: tuple[str, ...] = ()
    """For each guard, if there are any: what it does to the run where it is positive. ``stop`` ends it,
    ``fail`` ends it as a failure, ``warn`` is told at its end, and empty nothing."""
    modes: tuple[int, ...] = ()
    """The places of the modes in ``z``."""
    followers: tuple[bool, ...] = ()
    """For each mode, whether it is a function of the signals alone."""
    remembered: tuple[tuple[int, int], ...] = ()
    """The places in ``z`` of the modes that are functions also of what they were before an instant, or before
    the latest event at it, and of that."""
    recaptured: tuple[int, ...] = ()
    """The places in ``z`` of captured values that go with such modes: they are captured again at events."""
    locating: tuple[int, ...] = ()
    """The guards whose zeros only tell when such modes change."""
    tangents: tuple[int, int, int] | None = None
    """From which entries of ``x``, ``z`` and the guards on they belong to derivatives, if any."""
    contradictions: TracedFunction | None = None
    """Which modes contradict their conditions; ``None`` where there are no modes."""
    delays: Delays | None = None
    """Signals that are looked up in the past."""
    captures: bool = False
    """Whether some discrete variable keeps how things were just before an instant."""
    called: tuple[str, ...] = ()
    """Blocks that are no equations: Python works out at each of their ticks what they give."""
    loops: LinearLoops | None = None
    """Loops that are solved already."""
