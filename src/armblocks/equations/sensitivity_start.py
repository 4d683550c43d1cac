"""Events at the start of a run that a change of a parameter would move into the run or before it.

The derivatives for a change that moves the event into the run, and for a change that moves it before the run,
differ. They are equal only if flow and signals are the same on both sides of the event. The start is
evaluated once, in Python, before a run.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from casadi import SX, Function, densify, jtimes, vertcat
from numpy.typing import NDArray

from armblocks.equations.hybrid_system import HybridSystem
from armblocks.equations.table_reading import evaluate_with_reads, reads_tables
from armblocks.equations.traced_function import TracedFunction
from armblocks.errors import InputError

Array = NDArray[np.float64]

ZERO_TOLERANCE = 1e-8
"""A guard whose zero is within this time (s) counts as 0."""
DERIVATIVE_TOLERANCE = 1e-9
"""Relative tolerance of equal derivatives of states and signals."""

KINK_STEP, KINK, ROUNDING = 1e-6, 1e-2, 1e-13
"""The relative change of a parameter, the smallest relative difference of two derivatives at a kink, and the
relative rounding error of a value."""
CLOSER = 1.0 / 16.0
"""The ratio of two changes of a parameter."""
SHORT = 0.01
"""A kink that the run leaves within this time (s) does not count."""


def refuse_moving_start(system: HybridSystem, parameters: Sequence[str]) -> None:
    """Raise ``InputError`` if an event is at the start, depends on a parameter, and its two sides differ.

    Diagrams with implicit equations are not checked, because their unknowns are not solved yet.
    """
    if system.algebraic.size:
        return
    start = _Start(system)
    for name in parameters:
        entries = system.parameters.range_of(name)
        guards = [system.guard_names[guard] for guard in start.moving_guards(entries)]
        for block in [*guards, *start.held_states(entries)]:
            raise InputError(
                f"an event of '{block}' at the start moves with the parameter '{name}'",
                where=system.name,
                allowed="events at the start that no parameter moves, or that change nothing",
                fix=f"choose '{name}' so that the event is a little later",
            )
        for block in start.kinks(entries):
            raise InputError(
                f"block '{block}' starts exactly at a limit or at a jump, which '{name}' moves",
                where=system.name,
                allowed="parameters with one derivative at the start of the run",
                fix=f"change '{name}' a little, or use the difference of two runs",
            )


class _Start:
    """The time 0 of a run, after the ticks and with consistent modes."""

    def __init__(self, system: HybridSystem, p: Array | None = None) -> None:
        self.system = system
        p = self.p = np.asarray(system.parameter_values if p is None else p, dtype=np.float64)
        x, z = system.initial_states(p)[0].ravel(), system.initial_discrete(p)[0].ravel()
        marks = np.array([float(clock.offset == 0.0) for clock in system.clocks])
        self._no_event = np.zeros(len(system.guard_directions))
        for ticking, follows_events in system.ticks_by_level(marks):
            if follows_events:
                x, z = self._consistent(x, z)
            (z,) = self._at(system.update, x, z, ticking)
        self.before = (x, z)
        self.after = self._consistent(x, z)

    def _consistent(self, x: Array, z: Array) -> tuple[Array, Array]:
        """States and discrete variables after resets without events."""
        for _ in range(self._no_event.size):
            new_x, new_z = self._at(self.system.reset, x, z, self._no_event)
            same = np.array_equal(new_x, x) and np.array_equal(new_z, z)
            x, z = new_x, new_z
            if same:
                break
        return x, z

    def _at(self, traced: TracedFunction, x: Array, z: Array, *arguments: Array) -> tuple[Array, ...]:
        return tuple(value.ravel() for value in traced(0.0, x, z, np.empty(0), self.p, *arguments))

    def moving_guards(self, entries: slice) -> list[int]:
        """The guards that are zero, depend on one of these parameters, and whose two sides differ."""
        guards: set[int] = set()
        for point in (self.before, self.after):
            g, rate, moves = self._guards(*point, entries)
            zero = np.isfinite(rate) & (np.abs(g) <= ZERO_TOLERANCE * np.abs(rate)) & (rate != 0.0)
            for guard in np.flatnonzero(zero & (moves > ZERO_TOLERANCE * np.abs(rate))).tolist():
                direction = self.system.guard_directions[guard]
                # A guard of one direction fires in that direction only.
                fires = direction * rate[guard] > 0.0
                if fires or (direction == 0 and self._sides_differ(guard)):
                    guards.add(guard)
        return sorted(guards)

    def held_states(self, entries: slice) -> list[str]:
        """The blocks with states whose derivative with respect to these parameters is changed by the reset at
        the start."""
        system = self.system
        t, x, z, w, p, e = system.reset.arguments
        after = vertcat(*system.reset.results)[: x.numel(), :]
        changes: list[SX] = []
        for of_states, of_discrete, seed in self._initial_rates(p, entries):
            changes.append(jtimes(after, vertcat(x, z, p), vertcat(of_states, of_discrete, seed)) - of_states)
        values = self._numbers([t, x, z, w, p, e], changes, self.after, np.zeros(e.numel()))
        largest = np.abs(np.array(values)).max(axis=0)
        names = [element for slot in system.states for element in slot.elements]
        return [names[index].rpartition("/")[0] for index in np.flatnonzero(largest > ZERO_TOLERANCE)]

    def kinks(self, entries: slice) -> list[str]:
        """The blocks with values at the start that have no derivative with respect to a parameter: an initial
        value equal to a limit, or a comparison of two equal constants, for example.

        The derivative by the traced equations is compared with the differences to both sides. The error of a
        difference decreases with the change of the parameter, except at a kink or a jump. A kink that the
        run leaves at once does not count.
        """
        blocks = [element.rpartition("/")[0] for element in self._elements()]
        found: dict[str, None] = {}
        for index in range(entries.start, entries.stop):
            if not np.isfinite(self.p[index]):
                continue
            for sign in (-1.0, 1.0):
                step = sign * KINK_STEP * (1.0 + abs(self.p[index]))
                far, near = self._changed(index, step), self._changed(index, step * CLOSER)
                error, limit = self._error(index, step, far)
                remaining, _ = self._error(index, step * CLOSER, near)
                kinks = np.flatnonzero((error > limit) & (remaining > error / 2.0))
                if kinks.size and self._lasts(far, near):
                    found[blocks[kinks[0]]] = None
        return list(found)

    def _changed(self, index: int, step: float) -> _Start:
        """The start with one parameter changed by a step."""
        p = self.p.copy()
        p[index] += step
        return _Start(self.system, p)

    def _lasts(self, far: _Start, near: _Start) -> bool:
        """Whether modes that change with a parameter stay changed: whether no mode changes, or a guard that
        is zero only for the unchanged parameter does not move. ``far`` and ``near`` are starts with two
        changes of the parameter in the ratio 1 to ``CLOSER``."""
        modes = list(self.system.modes)
        if np.array_equal(self.after[1][modes], far.after[1][modes]):
            return True
        g, rates = far._guard_rates()[0], near._guard_rates()
        here = np.abs(rates[0])
        with np.errstate(invalid="ignore"):  # infinite guards
            through_zero = (here > 0.0) & (np.abs(g - rates[0] / CLOSER) <= 0.1 * np.abs(g))
        moves = np.array([np.abs(rate) * SHORT**order > here for order, rate in enumerate(rates)][1:])
        return bool((through_zero & ~moves.any(axis=0)).any())

    def _guard_rates(self) -> list[Array]:
        """The guards at the start, and their time derivatives up to the third order."""
        t, x, z, w, p = self.system.guards.arguments
        rates = [vertcat(*self.system.guards.results, SX(0, 1))]
        direction = vertcat(SX(1.0), self._flow(t, x, z, w, p))
        for _ in range(3):
            rates.append(jtimes(rates[-1], vertcat(t, x), direction))
        return self._numbers([t, x, z, w, p], rates, self.after)

    def _error(self, index: int, step: float, side: _Start) -> tuple[Array, Array]:
        """The difference between the derivatives of all values by a step of one parameter and by the
        equations, and the smallest difference that counts. ``side`` is the start after the step."""
        values = self._values()
        with np.errstate(invalid="ignore", over="ignore"):  # infinite values have no difference
            rate = self._rate(index, side, step)
            error = np.abs((side._values() - values) / step - rate)
            return error, KINK * (1.0 + np.abs(rate)) + ROUNDING * np.abs(values / step)

    def _elements(self) -> list[str]:
        """The names of the elements of :meth:`_values`."""
        system = self.system
        layouts = (system.states, system.discrete, system.signals_layout, system.states)
        return [element for layout in layouts for slot in layout for element in slot.elements]

    def _values(self) -> Array:
        """The initial states and discrete variables, the signals and the flow at the start."""
        system = self.system
        initial = [*system.initial_states(self.p), *system.initial_discrete(self.p)]
        present = [*self._at(system.signals, *self.after), *self._at(system.derivative, *self.after)]
        return np.concatenate([column.ravel() for column in (*initial, *present)])

    def _rate(self, index: int, side: _Start, step: float) -> Array:
        """The derivatives of :meth:`_values` with respect to one parameter, with constant modes. ``side`` is
        the start with this parameter changed by ``step``."""
        t, x, z, w, p = self.system.signals.arguments
        ((of_states, of_discrete, seed),) = self._initial_rates(p, slice(index, index + 1))
        of_x, of_z = ((b - a) / step for a, b in zip(self.after, side.after))
        of_z[list(self.system.modes)] = 0.0
        values = vertcat(*self.system.signals.results, self._flow(t, x, z, w, p))
        rate = jtimes(values, vertcat(x, z, p), vertcat(of_x, of_z, seed))
        return self._numbers([t, x, z, w, p], [vertcat(of_states, of_discrete, rate)], self.after)[0]

    def _initial_rates(self, p: SX, entries: slice) -> list[tuple[SX, SX, SX]]:
        """For each parameter entry the derivatives of the initial states and discrete variables, and its unit
        vector."""
        rates_by_entry: list[tuple[SX, SX, SX]] = []
        for index in range(entries.start, entries.stop):
            seed = SX.zeros(p.numel())
            seed[index] = 1.0
            rates: list[SX] = []
            for traced in (self.system.initial_states, self.system.initial_discrete):
                (own,) = traced.arguments
                initial = Function("i", [own], [vertcat(*traced.results, SX(0, 1))])
                (value,) = initial.call([p], True, False)
                rates.append(densify(jtimes(value, p, seed)) if value.numel() else value)
            rates_by_entry.append((rates[0], rates[1], seed))
        return rates_by_entry

    def _guards(self, x: Array, z: Array, entries: slice) -> tuple[Array, Array, Array]:
        """The guards, their time derivatives, and their largest derivative with respect to the parameters,
        each (ng,)."""
        t, states, discrete, w, p = self.system.guards.arguments
        g = vertcat(*self.system.guards.results)
        f = self._flow(t, states, discrete, w, p)
        moves = [
            jtimes(g, vertcat(states, discrete, p), vertcat(*rates))
            for rates in self._initial_rates(p, entries)
        ]
        rate = jtimes(g, vertcat(t, states), vertcat(SX(1.0), f))
        values = self._numbers([t, states, discrete, w, p], [g, rate, *moves], (x, z))
        return values[0], values[1], np.abs(np.array(values[2:])).max(axis=0)

    def _flow(self, *symbols: SX) -> SX:
        """The derivative of the states in other symbols ``t, x, z, w, p``."""
        derivative = self.system.derivative
        flow = Function("f", list(derivative.arguments), [vertcat(*derivative.results, SX(0, 1))])
        (xd,) = flow.call(list(symbols), True, False)
        return xd

    def _numbers(
        self, symbols: list[SX], results: list[SX], point: tuple[Array, Array], *further_arguments: Array
    ) -> list[Array]:
        """The values of expressions in ``symbols`` at the start; ``further_arguments`` follow ``t, x, z, w,
        p``."""
        arguments = [np.zeros(1), *point, np.empty(0), self.p, *further_arguments]
        function = Function("f", symbols, [densify(result) for result in results])
        values = (
            evaluate_with_reads(function, arguments) if reads_tables(function) else function.call(arguments)
        )
        return [np.array(value, dtype=np.float64).ravel() for value in values]

    def _sides_differ(self, guard: int) -> bool:
        """Whether the flow or a signal jumps where a guard of both directions fires."""
        sides: list[tuple[Array, ...]] = [self.after]
        for direction in (-1.0, 1.0):
            event = np.zeros(len(self.system.guard_directions))
            event[guard] = direction
            sides.append(self._at(self.system.reset, *self.after, event))
        present, *others = (
            np.concatenate([*self._at(self.system.derivative, *side), *self._at(self.system.signals, *side)])
            for side in sides
        )
        with np.errstate(invalid="ignore"):
            limit = DERIVATIVE_TOLERANCE * (1.0 + np.abs(present))
            return any((np.abs(present - other) > limit).any() for other in others)
