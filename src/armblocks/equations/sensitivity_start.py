"""Parameters without a derivative at the start of a run.

A change of a parameter can move an event at the start into the run or before it. The derivatives for both
differ, unless flow and signals are the same on both sides of the event. A change can also move a block that
starts exactly at a limit or at a jump to one of its sides. The start is evaluated in Python, before a run.
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from casadi import SX, Function, densify, jtimes, vertcat
from numpy.typing import NDArray

from armblocks.equations.hybrid_system import HybridSystem
from armblocks.equations.table_reading import evaluated, reads_tables
from armblocks.equations.traced_function import TracedFunction
from armblocks.errors import InputError

Array = NDArray[np.float64]

ZERO_TOLERANCE = 1e-8
"""A guard whose zero is within this time (s) counts as 0."""
RESTING = 1e-12
"""The largest value, and the largest time derivative, of a guard that is 0 and does not move at first."""
DERIVATIVE_TOLERANCE = 1e-9
"""Relative tolerance of equal derivatives of states and signals."""

KINK_STEP, KINK, ROUNDING = 1e-6, 1e-2, 1e-13
"""The relative change of a parameter, the smallest relative difference of two derivatives at a kink, and the
relative rounding error of a value."""
CLOSER = 1.0 / 16.0
"""The ratio of two changes of a parameter."""
SHORT = 0.01
"""A kink that the run leaves within this time (s) does not count."""
MAX_NEWTON_STEPS, SAME_SOLUTION = 50, 1e-13
"""Newton's method for implicit equations: its maximum number of steps, and the relative last step."""


def refuse_moving_start(system: HybridSystem, parameters: Sequence[str]) -> None:
    """Raise ``InputError`` for a parameter without a derivative at the start of a run.

    There are two such cases. The parameter moves an event at the start whose two sides differ, or it moves a
    block that starts exactly at a limit or at a jump. If the implicit equations have no solution at the
    start, nothing is checked here, because the run then ends with its own error.
    """
    with contextlib.suppress(_UnsolvedError):
        start = _Start(_Equations(system))
        for name in parameters:
            _refuse(start, system, name)


def _refuse(start: _Start, system: HybridSystem, name: str) -> None:
    """Raise ``InputError`` if the parameter with this name has no derivative at the start."""
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


class _UnsolvedError(ArithmeticError):
    """Newton's method finds no solution of the implicit equations."""


class _Point(NamedTuple):
    """States, discrete variables and unknowns, each (n,)."""

    x: Array
    z: Array
    w: Array


class _Equations:
    """The functions of a system at t = 0 and their derivatives along a direction, each built once."""

    def __init__(self, system: HybridSystem) -> None:
        self.system = system
        self.symbols = list(system.signals.arguments)
        """``t, x, z, w, p``."""
        self.direction = [SX.sym(f"along {k}", symbol.numel()) for k, symbol in enumerate(self.symbols)]
        self._reading: dict[int, bool] = {}

    def numbers(self, function: Function, *arguments: Array) -> list[Array]:
        """The values of a function, each a flat array."""
        key = id(function)
        if key not in self._reading:
            self._reading[key] = reads_tables(function)
        return evaluated(function, arguments, reads=self._reading[key])

    def along(
        self, function: Function, point: _Point, p: Array, direction: Sequence[Array], t: float = 0.0
    ) -> Array:
        """The derivative of a column along changes of ``t, x, z, p``; ``function`` is one of the derivatives
        of this class. The unknowns follow from the implicit equations."""
        moved_t, moved_x, moved_z, moved_p = direction
        moved_w: Array = np.zeros(point.w.size)
        at = [np.array([t]), *point, p]
        if point.w.size:
            moved = self.numbers(self.residual_along, *at, moved_t, moved_x, moved_z, moved_w, moved_p)[0]
            try:
                moved_w = np.asarray(-np.linalg.solve(self.jacobian(point, p), moved), dtype=np.float64)
            except np.linalg.LinAlgError:
                raise _UnsolvedError from None
        return self.numbers(function, *at, moved_t, moved_x, moved_z, moved_w, moved_p)[0]

    def jacobian(self, point: _Point, p: Array) -> Array:
        """The derivatives of the implicit equations with respect to the unknowns, (n, n)."""
        n = point.w.size
        (matrix,) = self.numbers(self._functions["residual_jacobian"], np.zeros(1), *point, p)
        return matrix.reshape(n, n)

    def at(self, name: str, point: _Point, p: Array, *arguments: Array, t: float = 0.0) -> list[Array]:
        """The values of a function of the system."""
        return self.numbers(self._functions[name], np.array([t]), *point, p, *arguments)

    def solved(self, x: Array, z: Array, guess: Array, p: Array) -> _Point:
        """The point with the solution of the implicit equations. Raises ``_UnsolvedError``."""
        point = _Point(x, z, guess)
        for _ in range(MAX_NEWTON_STEPS if guess.size else 0):
            (residual,) = self.at("residual", point, p)
            try:
                step = np.linalg.solve(self.jacobian(point, p), residual)
            except np.linalg.LinAlgError:
                raise _UnsolvedError from None
            point = _Point(x, z, point.w - step)
            if (np.abs(step) <= SAME_SOLUTION * (1.0 + np.abs(point.w))).all():
                return point
        if guess.size:
            raise _UnsolvedError
        return point

    @cached_property
    def _functions(self) -> dict[str, Function]:
        names = ("signals", "derivative", "guards", "residual", "residual_jacobian", "update", "reset")
        return {name: getattr(self.system, name).casadi_function() for name in names}

    @cached_property
    def initial(self) -> Function:
        """The initial states and discrete variables, from p."""
        return Function("initial", [self.symbols[4]], [vertcat(*self._initial_columns)])

    @cached_property
    def initial_along(self) -> Function:
        """The derivatives of the initial states and of the initial discrete variables, from p and its
        change."""
        p, moved = self.symbols[4], self.direction[4]
        rates = [_along(column, p, moved) for column in self._initial_columns]
        return Function("initial", [p, moved], rates)

    @property
    def _initial_columns(self) -> list[SX]:
        initial = (self.system.initial_states, self.system.initial_discrete)
        return [_in_symbols(traced, [self.symbols[4]]) for traced in initial]

    @cached_property
    def values_along(self) -> Function:
        """The derivative of the signals and of the flow."""
        return self._derivative(vertcat(*(self._column(name) for name in ("signals", "derivative"))))

    @cached_property
    def guards_along(self) -> Function:
        return self._derivative(self._column("guards"))

    @cached_property
    def residual_along(self) -> Function:
        return self._derivative(self._column("residual"))

    @cached_property
    def reset_along(self) -> Function:
        """The derivative of the states after a reset without events."""
        traced = self.system.reset
        no_event = SX.zeros(len(self.system.guard_directions))
        after = _in_symbols(traced, [*self.symbols, no_event])
        return self._derivative(after[: self.symbols[1].numel(), :])

    @cached_property
    def guard_rates(self) -> Function:
        """The guards and their time derivatives up to the third order, with constant unknowns."""
        return Function("rates", self.symbols, [densify(rate) for rate in self._guard_rates])

    @cached_property
    def guard_rates_along(self) -> Function:
        """The derivatives of ``guard_rates``, in one column."""
        return self._derivative(vertcat(*self._guard_rates))

    @cached_property
    def _guard_rates(self) -> list[SX]:
        t, x = self.symbols[:2]
        rates = [self._column("guards")]
        direction = vertcat(SX(1.0), self._column("derivative"))
        for _ in range(3):
            rates.append(_along(rates[-1], vertcat(t, x), direction))
        return rates

    def _column(self, name: str) -> SX:
        return _in_symbols(getattr(self.system, name), self.symbols)

    def _derivative(self, column: SX) -> Function:
        rate = _along(column, vertcat(*self.symbols), vertcat(*self.direction))
        return Function("along", [*self.symbols, *self.direction], [rate])


def _along(column: SX, symbols: SX, direction: SX) -> SX:
    return densify(jtimes(column, symbols, direction)) if column.numel() else column


def _in_symbols(traced: TracedFunction, symbols: list[SX]) -> SX:
    """All results of a function in one column, in other symbols."""
    function = Function("f", list(traced.arguments), [vertcat(*traced.results, SX(0, 1))])
    (column,) = function.call(symbols, True, False)
    return densify(column)


class _Start:
    """The time 0 of a run, after the ticks and with consistent modes. Raises ``_UnsolvedError``."""

    def __init__(self, equations: _Equations, p: Array | None = None) -> None:
        self.equations, system = equations, equations.system
        self.system = system
        p = self.p = np.asarray(system.parameter_values if p is None else p, dtype=np.float64)
        (values,) = equations.numbers(equations.initial, p)
        self.initial = values
        x, z = np.split(values, [system.states.size])
        (guess,) = (column.ravel() for column in system.initial_algebraic(p))
        marks = np.array([float(clock.offset == 0.0) for clock in system.clocks])
        self._no_event = np.zeros(len(system.guard_directions))
        point = equations.solved(x, z, guess, p)
        for ticking, follows_events in system.ticks_by_level(marks):
            if follows_events:
                point = self._consistent(point)
            (z,) = equations.at("update", point, p, ticking)
            point = equations.solved(point.x, z, point.w, p)
        self.before = point
        self.after = self._consistent(point)

    def _consistent(self, point: _Point) -> _Point:
        """States, discrete variables and unknowns after resets without events."""
        for _ in range(self._no_event.size):
            x, z = self._reset(point, self._no_event)
            same = np.array_equal(x, point.x) and np.array_equal(z, point.z)
            point = self.equations.solved(x, z, point.w, self.p)
            if same:
                break
        return point

    def _reset(self, point: _Point, event: Array) -> list[Array]:
        values = np.concatenate(self.equations.at("reset", point, self.p, event))
        return np.split(values, [point.x.size])

    def moving_guards(self, entries: slice) -> list[int]:
        """The guards that are zero, depend on one of these parameters, and whose two sides differ."""
        if not self.system.guard_directions:
            return []
        guards: set[int] = set()
        for point in (self.before, self.after):
            g, rate, moves = self._guards(point, entries)
            if point is self.after:
                guards |= self._resting_guards(g, rate, entries)
            zero = np.isfinite(rate) & (np.abs(g) <= ZERO_TOLERANCE * np.abs(rate)) & (rate != 0.0)
            for guard in np.flatnonzero(zero & (moves > ZERO_TOLERANCE * np.abs(rate))).tolist():
                direction = self.system.guard_directions[guard]
                # A guard of one direction fires in that direction only.
                fires = direction * rate[guard] > 0.0
                if fires or (direction == 0 and self._sides_differ(guard)):
                    guards.add(guard)
        return sorted(guards)

    def _resting_guards(self, g: Array, rate: Array, entries: slice) -> set[int]:
        """The guards that are zero with a zero time derivative at the start, and that a parameter moves.

        An example is a comparison with the position of a body that starts from rest. Such a guard has a
        multiple zero at t = 0. A small change of the parameter splits this zero, so that there are events
        for one sign of the change only.
        """
        resting = (np.abs(g) <= RESTING) & (np.abs(rate) <= RESTING)
        if not resting.any():
            return set()
        point, p, equations = self.after, self.p, self.equations
        rates = np.array(equations.numbers(equations.guard_rates, np.zeros(1), *point, p))
        directions = np.array(self.system.guard_directions)
        movements = [
            equations.along(equations.guard_rates_along, point, p, direction).reshape(rates.shape)
            for direction in self._initial_directions(entries)
        ]
        lower = np.zeros(g.size, dtype=bool)
        guards: set[int] = set()
        for order, leading in enumerate(rates):
            leaves = resting & lower & (np.abs(leading) > RESTING) & (directions * leading >= 0.0)
            guards.update(k for k in map(int, np.flatnonzero(leaves)) if self._sides_differ(k))
            resting &= np.abs(leading) <= RESTING
            for movement in movements:
                lower |= np.abs(movement[order]) > ZERO_TOLERANCE * (1.0 + np.abs(leading))
        return guards

    def held_states(self, entries: slice) -> list[str]:
        """The blocks for which the reset at the start changes the derivative of a state with respect to a
        parameter."""
        changed = np.zeros(self.system.states.size)
        for direction in self._initial_directions(entries):
            after = self.equations.along(self.equations.reset_along, self.after, self.p, direction)
            changed = np.maximum(changed, np.abs(after - direction[1]))
        names = [element for slot in self.system.states for element in slot.elements]
        return [names[index].rpartition("/")[0] for index in np.flatnonzero(changed > ZERO_TOLERANCE)]

    def kinks(self, entries: slice) -> list[str]:
        """The blocks with values at the start that have no derivative with respect to a parameter: an initial
        value equal to a limit, or a comparison of two equal constants, for example.

        The derivative by the traced equations is compared with the differences to both sides. The error of a
        difference decreases with the change of the parameter, except at a kink or a jump. A kink that the
        run leaves at once does not count. A jump of a signal always counts, because the time until the run
        leaves the jump depends on the change. A jump of the flow alone counts as a kink only. An example is a
        rate limiter that starts beside its input and reaches the input at once.
        """
        system = self.system
        layouts = (system.states, system.discrete, system.signals_layout, system.states)
        elements: list[str] = [
            element for layout in layouts for slot in layout.slots for element in slot.elements
        ]
        found: dict[str, None] = {}
        for index in range(entries.start, entries.stop):
            if not np.isfinite(self.p[index]):
                continue
            for sign in (-1.0, 1.0):
                step = sign * KINK_STEP * (1.0 + abs(self.p[index]))
                try:
                    far, near = self._changed(index, step), self._changed(index, step * CLOSER)
                except _UnsolvedError:
                    continue
                kinks, jumps = self._kinks_and_jumps(index, step, far, near)
                if kinks.any():
                    lasting = kinks & self._lasts(far, near)
                    if not self._modes_change(far):
                        # The time at which a ramp begins, for example, does not last either.
                        lasting &= self._kinks_and_jumps(index, step, far, near, SHORT)[0]
                    counted = lasting | jumps
                    for k in map(int, np.flatnonzero(counted)[:1]):
                        found[elements[k].rpartition("/")[0]] = None
        return list(found)

    def _kinks_and_jumps(
        self, index: int, step: float, far: _Start, near: _Start, t: float = 0.0
    ) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Which values have a kink or a jump at time ``t``, and which signals and variables have a jump.

        ``far`` and ``near`` are the starts after the changes ``step`` and ``step * CLOSER`` of the parameter.
        """
        error, limit = self._error(index, step, far, t)
        remaining, _ = self._error(index, step * CLOSER, near, t)
        kinks = (error > limit) & (remaining > error / 2.0)
        with np.errstate(invalid="ignore"):
            jumps = kinks & (remaining > error / (2.0 * CLOSER))
        jumps[jumps.size - self.system.states.size :] = False
        return kinks, jumps

    def _modes_change(self, side: _Start) -> bool:
        modes = list(self.system.modes)
        return not np.array_equal(self.after.z[modes], side.after.z[modes])

    def _changed(self, index: int, step: float) -> _Start:
        """The start with one parameter changed by a step."""
        p = self.p.copy()
        p[index] += step
        return _Start(self.equations, p)

    def _lasts(self, far: _Start, near: _Start) -> bool:
        """Whether the run stays at a kink for longer than ``SHORT``. True if no mode differs at ``far``.

        Otherwise the guards decide that are zero for the unchanged parameter only. The result is false if
        there are such guards and all of them move, which means that they change by more than their value
        within ``SHORT``. ``far`` and ``near`` are starts with two changes of the parameter in the ratio 1 to
        ``CLOSER``.
        """
        if not self._modes_change(far):
            return True
        g, rates = (
            self.equations.numbers(self.equations.guard_rates, np.zeros(1), *side.after, side.p)
            for side in (far, near)
        )
        here = np.abs(rates[0])
        with np.errstate(invalid="ignore"):  # infinite guards
            through_zero = (here > 0.0) & (np.abs(g[0] - rates[0] / CLOSER) <= 0.1 * np.abs(g[0]))
        moves = np.array([np.abs(rate) * SHORT**order > here for order, rate in enumerate(rates)][1:])
        moving = through_zero & moves.any(axis=0)
        return bool((through_zero & ~moving).any() or not moving.any())

    def _values(self, t: float) -> Array:
        """The initial states and discrete variables, and the signals and the flow at a time."""
        return np.concatenate([self.initial, self._present(self.after, t)])

    def _present(self, point: _Point, t: float = 0.0) -> Array:
        """The signals and the flow."""
        names = ("signals", "derivative")
        columns = (column for name in names for column in self.equations.at(name, point, self.p, t=t))
        return np.concatenate([*columns])

    def _error(self, index: int, step: float, side: _Start, t: float) -> tuple[Array, Array]:
        """The errors of the finite differences of all values, and for each the smallest error that counts.

        A finite difference uses a step of one parameter; its error is the deviation from the derivative by
        the equations. ``side`` is the start after the step.
        """
        values = self._values(t)
        with np.errstate(invalid="ignore", over="ignore"):  # infinite values have no difference
            rate = self._rate(index, side, step, t)
            error = np.abs((side._values(t) - values) / step - rate)
            return error, KINK * (1.0 + np.abs(rate)) + ROUNDING * np.abs(values / step)

    def _rate(self, index: int, side: _Start, step: float, t: float) -> Array:
        """The derivatives of all values with respect to one parameter, with constant modes. ``side`` is the
        start with this parameter changed by ``step``."""
        ((zero, of_states, of_discrete, seed),) = self._initial_directions(slice(index, index + 1))
        of_z = (side.after.z - self.after.z) / step
        of_z[list(self.system.modes)] = 0.0
        direction = (zero, of_states, of_z, seed)
        rate = self.equations.along(self.equations.values_along, self.after, self.p, direction, t)
        return np.concatenate([of_states, of_discrete, rate])

    def _initial_directions(self, entries: slice) -> list[tuple[Array, Array, Array, Array]]:
        """For each parameter entry the derivatives of time (0), of the initial states and discrete variables,
        and of the parameters."""
        directions: list[tuple[Array, Array, Array, Array]] = []
        for index in range(entries.start, entries.stop):
            seed = np.zeros(self.p.size)
            seed[index] = 1.0
            x, z = self.equations.numbers(self.equations.initial_along, self.p, seed)
            directions.append((np.zeros(1), x, z, seed))
        return directions

    def _guards(self, point: _Point, entries: slice) -> tuple[Array, Array, Array]:
        """The guards, their time derivatives, and their largest derivative with respect to the parameters,
        each (ng,)."""
        equations = self.equations
        (g,), (flow,) = (equations.at(name, point, self.p) for name in ("guards", "derivative"))
        with_time = (np.ones(1), flow, np.zeros(point.z.size), np.zeros(self.p.size))
        rate, *moves = (
            equations.along(equations.guards_along, point, self.p, direction)
            for direction in (with_time, *self._initial_directions(entries))
        )
        return g, rate, np.abs(np.array(moves)).max(axis=0)

    def _sides_differ(self, guard: int) -> bool:
        """Whether an event of a guard, upwards or downwards, changes the flow or a signal."""
        others: list[Array] = []
        for direction in (-1.0, 1.0):
            event = np.zeros(len(self.system.guard_directions))
            event[guard] = direction
            x, z = self._reset(self.after, event)
            others.append(self._present(self.equations.solved(x, z, self.after.w, self.p)))
        present = self._present(self.after)
        with np.errstate(invalid="ignore"):
            limit = DERIVATIVE_TOLERANCE * (1.0 + np.abs(present))
            return any((np.abs(present - other) > limit).any() for other in others)
