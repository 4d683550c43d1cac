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

KINK_STEP, KINK = 1e-6, 1e-2
"""The relative change of a parameter on both sides, and the smallest difference of both derivatives."""


def refuse_moving_start(system: HybridSystem, parameters: Sequence[str]) -> None:
    """Raise ``InputError`` if an event is at the start, depends on a parameter, and its two sides differ.

    Diagrams with implicit equations are not checked, because their unknowns are not solved yet.
    """
    if not system.guard_directions or system.algebraic.size:
        return
    start = _Start(system)
    for name in parameters:
        entries = system.parameters.range_of(name)
        guards = [system.guard_names[guard] for guard in start.moving_guards(entries)]
        for block in [*guards, *start.held_states(entries), *start.kinks(entries)]:
            raise InputError(
                f"an event of '{block}' at the start moves with the parameter '{name}'",
                where=system.name,
                allowed="events at the start that no parameter moves, or that change nothing",
                fix=f"choose '{name}' so that the event is a little later",
            )


class _Start:
    """The time 0 of a run, after the ticks and with consistent modes."""

    def __init__(self, system: HybridSystem) -> None:
        self.system = system
        p = self.p = np.asarray(system.parameter_values, dtype=np.float64)
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
        """The blocks with initial states that have different derivatives to the left and to the right of a
        parameter, for example an initial value equal to a limit."""
        found: set[str] = set()
        for initial, layout in (
            (self.system.initial_states, self.system.states),
            (self.system.initial_discrete, self.system.discrete),
        ):
            names = [element for slot in layout.slots for element in slot.elements]
            for index in self._dependences(initial, entries):
                step = KINK_STEP * (1.0 + abs(self.p[index]))
                sides = [self.p.copy() for _ in range(3)]
                for side, shift in zip(sides, (-step, 0.0, step)):
                    side[index] += shift
                below, here, above = (initial(side)[0].ravel() for side in sides)
                with np.errstate(invalid="ignore"):  # infinite values have no difference
                    curved = np.abs(above - 2.0 * here + below) > KINK * step
                found |= {names[k].rpartition("/")[0] for k in np.flatnonzero(curved)}
        return sorted(found)

    def _dependences(self, initial: TracedFunction, entries: slice) -> list[int]:
        """The finite parameters among these on which initial values depend."""
        columns = set(initial.casadi_function().jac_sparsity(0, 0).get_col())
        return [
            index
            for index in range(entries.start, entries.stop)
            if index in columns and np.isfinite(self.p[index])
        ]

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
        derivative = self.system.derivative
        flow = Function("f", list(derivative.arguments), [vertcat(*derivative.results, SX(0, 1))])
        (f,) = flow.call([t, states, discrete, w, p], True, False)
        moves = [
            jtimes(g, vertcat(states, discrete, p), vertcat(*rates))
            for rates in self._initial_rates(p, entries)
        ]
        rate = jtimes(g, vertcat(t, states), vertcat(SX(1.0), f))
        values = self._numbers([t, states, discrete, w, p], [g, rate, *moves], (x, z))
        return values[0], values[1], np.abs(np.array(values[2:])).max(axis=0)

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
