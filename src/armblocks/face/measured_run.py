"""The measures of a run with their exact derivatives with respect to parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from casadi import SX, Function, densify, jacobian, vertcat
from numpy.typing import NDArray

from armblocks.diagram import Diagram
from armblocks.diagram.mask import as_symbols
from armblocks.diagram.mask_tuning import dependent_parameters, mask_parameters
from armblocks.diagram.parameter import shape_of
from armblocks.equations import SimulationOptions, Slot, flatten
from armblocks.equations.sensitivity import sensitivity_system
from armblocks.equations.sensitivity_layout import entry_name, sensitivity_name
from armblocks.equations.sensitivity_times import INSTANT, rate_name, time_derivative, with_instant_times
from armblocks.errors import InputError, SimulationError
from armblocks.face.model import CompiledDiagram
from armblocks.face.sensitivity import InstantChecks
from armblocks.integration.system import compile_system
from armblocks.simulation import SimulationResult
from armblocks.simulation import simulate as run_system
from armblocks.simulation.whole_run import check_interrupt
from armblocks.sweeps.measure_derivatives import Dual
from armblocks.sweeps.measures import Measure, observe
from armblocks.sweeps.quantities import EVENTS

Array = NDArray[np.float64]

_SAME_TIME = 1e-12
"""Relative difference of times up to which a jump and the latest instant are the same."""


class Chain:
    """The entries of block parameters on which variables act, and the derivatives of these entries.

    A variable is a tunable parameter, an entry of it, or a mask parameter, on which other parameters depend
    by formulas.
    """

    def __init__(self, model: CompiledDiagram, variables: Sequence[str], where: str) -> None:
        """Raises ``InputError`` for a variable that is a constant of the equations."""
        self._layout = model.compiled.parameters
        self._variables = list(variables)
        self._masks = mask_parameters(model.diagram)
        columns = self._columns(model.diagram, where)
        self.entries = list(dict.fromkeys(entry for column in columns for entry in column))

    def derivatives(self, diagram: Diagram, where: str) -> Array:
        """The derivatives ``(entries, variables)`` at the parameters of a diagram."""
        matrix = np.zeros((len(self.entries), len(self._variables)))
        for k, column in enumerate(self._columns(diagram, where)):
            for entry, value in column.items():
                matrix[self.entries.index(entry), k] = value
        return matrix

    @property
    def constant(self) -> bool:
        """Whether the derivatives do not depend on the parameters: no variable is a mask parameter."""
        return all(_whole(name) in self._layout.ranges for name in self._variables)

    def _columns(self, diagram: Diagram, where: str) -> list[dict[str, float]]:
        return [self._column(diagram, name, where) for name in self._variables]

    def _column(self, diagram: Diagram, name: str, where: str) -> dict[str, float]:
        """The derivatives of entries with respect to one variable."""
        whole = name if name in self._layout.ranges or name in self._masks else _whole(name)
        if whole in self._layout.ranges:
            slot = self._layout[whole]
            return {entry_name(slot, name if name != whole else slot.elements[0]): 1.0}
        if whole not in self._masks:
            raise _constant(name, where)
        level, rule = self._masks[whole]
        nominal = as_symbols(level.mask_values[rule.name])
        if nominal is None:
            raise _constant(name, where)
        slot = Slot(whole, shape_of(level.mask_values[rule.name]))
        symbol = SX.sym("p", *nominal.shape)
        dependents = dependent_parameters(diagram, whole, symbol)
        if dependents.structural:
            raise _constant(name, where, dependents.structural[0])
        flat = flatten(symbol, slot.shape)
        index = slot.elements.index(name) if name != whole else 0
        level, rule = mask_parameters(diagram)[whole]
        at = np.array(level.mask_values[rule.name], dtype=np.float64)
        column: dict[str, float] = {}
        for path, formula in dependents.tunable.items():
            if path not in self._layout.ranges:
                continue
            target = self._layout[path]
            by_entry = densify(jacobian(flatten(formula, target.shape), flat)[:, index])
            values = np.asarray(Function("d", [symbol], [by_entry]).call([at]))[0].ravel()
            column |= {entry_name(target, e): float(v) for e, v in zip(target.elements, values)}
        return column


def _whole(name: str) -> str:
    return name.rpartition("[")[0] if name.endswith("]") else name


def _constant(name: str, where: str, through: str = "") -> InputError:
    means = f", which '{through}' depends on," if through else ""
    return InputError(
        f"the variable '{name}'{means} is a constant of the equations",
        where=where,
        allowed="tunable parameters, start values, and mask parameters on which only these depend",
        fix="compare its values in a sweep, or choose another variable",
    )


class MeasuredRun:
    """Runs a model together with the derivatives of the signals that measures need.

    ``entries``: the parameters (with indices) to differentiate by. Raises as
    :func:`~armblocks.equations.sensitivity.sensitivity_system`, and ``InputError`` for the number of events.
    """

    def __init__(
        self,
        model: CompiledDiagram,
        entries: Sequence[str],
        measures: Sequence[Measure],
        options: SimulationOptions,
    ) -> None:
        for measure in measures:
            if measure.kind == EVENTS:
                raise InputError(
                    f"the measure '{measure}' is an integer, which has no derivative",
                    where=model.diagram.name,
                    allowed="measures that change with the signals",
                    fix="use method='search'",
                )
        self._options = options
        self.measures = tuple(measures)
        compiled = model.compiled
        self._observation = observe(self.measures, (), model.signals_layout, compiled.aliases)
        layout = compiled.signals_layout
        owners = [slot for slot in layout for _ in range(slot.size)]
        paths = dict.fromkeys(owners[row].name for row in self._observation.used)
        augmented = with_instant_times(
            sensitivity_system(model.system, list(entries), list(paths)), list(paths)
        )
        self._compiled = compile_system(augmented)
        self._checks = InstantChecks(augmented)
        after = self._compiled.signals_layout
        self._rows: dict[int, NDArray[np.intp]] = {}
        self._rates: dict[int, int] = {}
        for row in self._observation.used:
            path = owners[row].name
            offset = row - layout.ranges[path].start
            if rate_name(path) in after.ranges:
                self._rates[row] = after.ranges[rate_name(path)].start + offset
            names = [sensitivity_name(path, entry) for entry in entries]
            self._rows[row] = np.array([after.ranges[name].start + offset for name in names], dtype=np.intp)
        self._instant: tuple[int, NDArray[np.intp]] | None = None
        if INSTANT in after.ranges:
            by = [after.ranges[time_derivative(entry)].start for entry in entries]
            self._instant = after.ranges[INSTANT].start, np.array(by, dtype=np.intp)
        self._gradients = self._expression_gradients()

    def _expression_gradients(self) -> Mapping[int, Function]:
        """For each quantity that is an expression, its derivatives by the used signals and by the time."""
        if self._observation.expressions is None:
            return {}
        traced = self._observation.expressions.traced
        t, y = traced.arguments
        (values,) = traced.results
        found: dict[int, Function] = {}
        for quantity in self._observation.quantities:
            if quantity.row < 0:
                used = vertcat(*(y[row] for row in quantity.used), SX(0, 1))
                value = values[-1 - quantity.row]
                by = [densify(jacobian(value, used)), densify(jacobian(value, t))]
                found[quantity.row] = Function("d", [t, used], by)
        return found

    def run(self, p: Array) -> SimulationResult:
        """The run with parameters ``(np,)``. Raises ``SimulationError`` for a run that fails, and for
        coinciding events that a parameter change would separate."""
        result = run_system(self._compiled, self._options, p)
        check_interrupt(result)
        self._checks.check(result, p)
        if result.run.message.startswith("stopped by block"):
            raise SimulationError(
                f"the run ended at {result.time[-1]:.9g} s: {result.run.message}",
                where=self._compiled.name,
                allowed="runs up to the stop time, whose derivatives are known",
                fix="remove the block that ends the run, or use method='search'",
                partial=result,
            )
        return result

    def series(self, result: SimulationResult, chain: Array) -> list[tuple[Dual, Dual]]:
        """For each measure its rows: times and values with derivatives by the variables, for ``chain
        (entries, n)``."""
        rows = [self._quantity(result, k, chain) for k in range(len(self._observation.quantities))]
        return [rows[measure.quantity] for measure in self._observation.measures]

    def _quantity(self, result: SimulationResult, number: int, chain: Array) -> tuple[Dual, Dual]:
        quantity = self._observation.quantities[number]
        table = result.jumps.table
        jumping = table.jumping[list(quantity.used)].any(axis=0) & (table.time > result.time[0])
        jumping &= table.time <= result.time[-1]
        instants = table.time[jumping]
        before, after = table.before.signals[:, jumping], table.after.signals[:, jumping]
        moved = self._moved(instants, after) @ chain
        samples = self._values(number, result.time, result.signals, chain)
        if not instants.size:
            return Dual(result.time, np.zeros((result.time.size, chain.shape[1]))), samples
        sides = [self._values(number, instants, side, chain) for side in (before, after)]
        rates = [self._rate(number, instants, side) for side in (before, after)]
        return _merged(result.time, samples, instants, (sides[0], sides[1]), (rates[0], rates[1]), moved)

    def _rate(self, number: int, times: Array, signals: Array) -> Array:
        """The time derivative ``(M,)`` of a quantity; NaN for systems with delays."""
        quantity = self._observation.quantities[number]
        if not all(row in self._rates for row in quantity.used):
            return np.full(times.size, np.nan)
        rates = [signals[self._rates[row]] for row in quantity.used]
        if quantity.row >= 0:
            return rates[0]
        by, by_time = self._by_signals(number, times, signals)
        return by_time + sum((by[:, k] * rate for k, rate in enumerate(rates)), np.zeros(times.size))

    def _by_signals(self, number: int, times: Array, signals: Array) -> tuple[Array, Array]:
        """The derivatives ``(M, used)`` of an expression by its signals, and by the time ``(M,)``."""
        quantity = self._observation.quantities[number]
        points = [times[np.newaxis], signals[list(quantity.used)]]
        found = self._gradients[quantity.row].call(points)
        by, by_time = (np.asarray(part).reshape(times.size, -1) for part in found)
        return by, by_time[:, 0]

    def _moved(self, instants: Array, after: Array) -> Array:
        """The derivatives ``(M, entries)`` of the times of instants."""
        entries = len(next(iter(self._rows.values()))) if self._rows else 0
        if self._instant is None or not instants.size:
            return np.zeros((instants.size, entries))
        row, by = self._instant
        known = np.abs(after[row] - instants) <= _SAME_TIME * np.maximum(1.0, np.abs(instants))
        return np.where(known[:, np.newaxis], after[by].T, 0.0)

    def _values(self, number: int, times: Array, signals: Array, chain: Array) -> Dual:
        """A quantity ``(N,)`` and its derivatives at fixed times."""
        quantity = self._observation.quantities[number]
        derivatives = [signals[self._rows[row]].T @ chain for row in quantity.used]
        if quantity.row >= 0:
            return Dual(signals[quantity.row], derivatives[0])
        expressions = self._observation.expressions
        assert expressions is not None
        # The rows after those of the model are derivatives.
        own = signals[: expressions.traced.inputs["y"].size]
        values = expressions.of(times, own)[-1 - quantity.row]
        total = np.zeros((times.size, chain.shape[1]))
        if quantity.used and times.size:
            by, _ = self._by_signals(number, times, signals)
            for k, derivative in enumerate(derivatives):
                total += by[:, k : k + 1] * derivative
        return Dual(values, total)


def _merged(
    time: Array,
    samples: Dual,
    instants: Array,
    sides: tuple[Dual, Dual],
    rates: tuple[Array, Array],
    moved: Array,
) -> tuple[Dual, Dual]:
    """The rows of samples and of both sides of jumps, in the order of the measures.

    A row at an instant that moves by ``moved (M, n)`` moves along its signal. Where the time derivative of
    the signal is NaN, it is that of the line to the neighbouring row.
    """
    place = np.minimum(np.searchsorted(time, instants), time.size - 1)
    without = time[place] != instants
    times = np.concatenate([time, instants, instants[without]])
    values = np.concatenate([samples.v, sides[0].v, sides[1].v[without]])
    by = np.concatenate([samples.d, sides[0].d, sides[1].d[without]])
    moves = np.concatenate([np.zeros_like(samples.d), moved, moved[without]])
    rate = np.concatenate([np.zeros(time.size), rates[0], rates[1][without]])
    left = np.zeros(times.size, dtype=np.bool_)
    left[time.size : time.size + instants.size] = True
    # A sample at the time of a jump is the row after it.
    moves[place[~without]] = moved[~without]
    rate[place[~without]] = rates[1][~without]
    order = np.lexsort((~left, times))
    times, values, by, moves = times[order], values[order], by[order], moves[order]
    left, rate = left[order], rate[order]
    steps = np.diff(times)
    lines = np.divide(np.diff(values), steps, out=np.zeros_like(steps), where=steps > 0.0)
    before, after = np.insert(lines, 0, 0.0), np.append(lines, 0.0)
    rate = np.where(np.isnan(rate), np.where(left, before, after), rate)
    return Dual(times, moves), Dual(values, by + rate[:, np.newaxis] * moves)
