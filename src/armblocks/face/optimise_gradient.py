"""The nonlinear program of an optimisation with exact derivatives.

Its unknowns are the coordinates ``u (n,)`` of the variables, and bounds of largest values. A measure of a
largest value (peak, overshoot …) becomes an unknown ``s``, with a constraint ``value <= s`` for the largest
value of each part of the run. The worst scenario becomes an unknown ``worst``, with a constraint ``objective
<= worst`` for each scenario. These functions are smooth, also where several largest values are equal, which
is typical of a minimum.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.diagram import with_parameters
from armblocks.errors import DiagramError, SimulationError
from armblocks.face.measured_run import MeasuredRun
from armblocks.face.optimise_formulas import Condition, Formulas
from armblocks.face.optimise_runs import Runs
from armblocks.face.optimise_statistics import WORST, Statistics
from armblocks.face.optimise_variables import Variables
from armblocks.optimisation.program import NonlinearProgram
from armblocks.sweeps.measure_derivatives import EXTREMES, Dual, largest_of_parts, measure_with_derivatives

Array = NDArray[np.float64]

PARTS = 16
"""Number of parts of a run with a largest value of their own."""
MOST_ROWS = 2000
"""Maximum number of rows for largest values."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ScenarioPoint:
    """One scenario at one point: measures ``(nm,)`` with derivatives by the variables, and the largest
    values of the parts ``(parts,)`` of each extreme measure."""

    measures: Dual
    parts: dict[int, Dual]


class GradientProgram:
    """The functions of the program; ``observe(x, measures (S, nm))`` is called for every point."""

    def __init__(
        self,
        runs: Runs,
        variables: Variables,
        formulas: Formulas,
        conditions: list[Condition],
        statistics: Statistics,
        observe: Callable[[Array, Array], None],
    ) -> None:
        """Raises ``InputError`` where there are no derivatives."""
        self._runs, self._variables, self._formulas = runs, variables, formulas
        self._conditions, self._statistics, self._observe = conditions, statistics, observe
        self._where = "optimise"
        self._measured = [
            MeasuredRun(group.model, chain.entries, runs.measures, runs.options)
            for group, chain in zip(runs.groups, runs.chains)
        ]
        self._extreme: tuple[int, ...] = ()
        self._least: dict[int, float] = {}
        self._parts = PARTS
        self._last: tuple[bytes, list[ScenarioPoint] | None] | None = None
        self.count = 0
        """The number of computed runs."""

    # Runs.

    def scenarios(self, x: Array) -> list[ScenarioPoint]:
        """All scenarios at the values ``x (n,)`` of the variables. Raises ``SimulationError``."""
        found: list[ScenarioPoint | None] = [None] * self._runs.scenarios
        for group, chain, measured in zip(self._runs.groups, self._runs.chains, self._measured):
            parameters = self._runs.parameters(group, x[np.newaxis])
            shared = chain.derivatives(group.model.diagram, self._where) if chain.constant else None
            for _, places, p in parameters.groups(0, parameters.design.count):
                for place, row in zip(places.tolist(), p):
                    by = shared
                    if by is None:
                        changed = with_parameters(group.model.diagram, parameters.values(place))
                        by = chain.derivatives(changed, self._where)
                    found[int(group.places[place])] = self._scenario(measured, row, by)
        return [point for point in found if point is not None]

    def _scenario(self, measured: MeasuredRun, p: Array, chain: Array) -> ScenarioPoint:
        result = measured.run(p)
        self.count += 1
        series = measured.series(result, chain)
        values, derivatives = np.empty(len(series)), np.empty((len(series), chain.shape[1]))
        parts: dict[int, Dual] = {}
        ends: Array = np.linspace(float(result.time[0]), float(result.time[-1]), self._parts + 1)
        for k, (measure, (t, y)) in enumerate(zip(measured.measures, series)):
            found = measure_with_derivatives(measure.kind, measure.values, t, y)
            values[k], derivatives[k] = found.v, found.d
            if measure.kind in EXTREMES and np.isfinite(found.v):
                largest = largest_of_parts(measure.kind, measure.values, t, y, ends)
                if largest is not None:
                    parts[k], self._least[k] = largest
        return ScenarioPoint(measures=Dual(values, derivatives), parts=parts)

    def _at(self, x: Array) -> list[ScenarioPoint] | None:
        """The scenarios, or ``None`` if a run fails or a measure has no value."""
        key = x.tobytes()
        if self._last is None or self._last[0] != key:
            found: list[ScenarioPoint] | None = None
            try:
                found = self.scenarios(x)
                self._observe(x, np.array([point.measures.v for point in found]))
                if not all(np.isfinite(point.measures.v).all() for point in found):
                    found = None
            except (SimulationError, DiagramError):
                found = None
            self._last = key, found
        return self._last[1]

    # The program.

    def begin(self, x: Array) -> Array:
        """The unknowns at the values ``x``; determines which extreme measures have unknowns.

        Raises ``SimulationError`` if the runs fail, or the derivatives do not exist.
        """
        points = self.scenarios(x)
        self._extreme = tuple(
            k
            for k, measure in enumerate(self._runs.measures)
            if measure.kind in EXTREMES and self._grows(k, x, points)
        )
        count = len(self._extreme) * len(points)
        parts = max(1, min(PARTS, MOST_ROWS // max(1, count)))
        if parts != self._parts:
            self._parts, self._last = parts, None
            points = self.scenarios(x)
        extremes = [
            max(float(point.parts[k].v.max()), self._least[k]) for point in points for k in self._extreme
        ]
        unknowns = [self._variables.coordinates(x), np.array(extremes)]
        if self._worst:
            unknowns.append(np.array([max(self._formula(point, x)[0][0] for point in points)]))
        return np.concatenate(unknowns)

    @property
    def _worst(self) -> bool:
        return self._statistics.objective == WORST and self._runs.scenarios > 1

    def _grows(self, k: int, x: Array, points: list[ScenarioPoint]) -> bool:
        """Whether a larger extreme value is worse in the objective and in every constraint."""
        sign = -1.0 if self._runs.measures[k].kind == "minimum" else 1.0
        for point in points:
            if k not in point.parts:
                return False
            by = sign * self._formulas.at(point.measures.v, x)[1][:, k]
            if by[0] < 0.0:
                return False
            for condition, rate in zip(self._conditions, by[1:]):
                limited_below = np.isfinite(condition.low) and rate > 0.0
                limited_above = np.isfinite(condition.high) and rate < 0.0
                if limited_below or limited_above:
                    return False
        return True

    def _formula(self, point: ScenarioPoint, x: Array) -> tuple[Array, Array, Array]:
        return self._formulas.at(point.measures.v, x)

    def program(self) -> NonlinearProgram:
        """The program for the unknowns of :meth:`begin`."""
        v, scenarios = self._variables, self._runs.scenarios
        least = np.array([self._least[k] for _ in range(scenarios) for k in self._extreme])
        worst = np.full(int(self._worst), -np.inf)
        low = [condition.low for condition in self._conditions] * scenarios
        high = [condition.high for condition in self._conditions] * scenarios
        rows = len(least) * self._parts + scenarios * int(self._worst)
        return NonlinearProgram(
            lower=np.concatenate([v.u_lower, least, worst]),
            upper=np.concatenate([v.u_upper, np.full(least.size + worst.size, np.inf)]),
            row_lower=np.concatenate([low, np.full(rows, -np.inf)]),
            row_upper=np.concatenate([high, np.zeros(rows)]),
            values=self._values,
            derivatives=self._derivatives,
        )

    def _values(self, z: Array) -> tuple[float, Array] | None:
        found = self._functions(z)
        return None if found is None else (found[0], found[1])

    def _derivatives(self, z: Array) -> tuple[Array, Array] | None:
        found = self._functions(z)
        return None if found is None else (found[2], found[3])

    def _functions(self, z: Array) -> tuple[float, Array, Array, Array] | None:
        """Objective, rows, gradient and Jacobian."""
        n, e = self._variables.start.size, len(self._extreme)
        x = self._variables.values(z[:n])
        points = self._at(x)
        if points is None:
            return None
        rates = self._variables.rates(x)
        bounds = z[n : n + e * len(points)].reshape(len(points), e)
        k, s = len(self._conditions), len(points)
        gradient = np.zeros(z.size)
        objective = 0.0
        conditions, by_conditions = np.empty((s, k)), np.zeros((s, k, z.size))
        worst, by_worst = np.empty(s), np.zeros((s, z.size))
        largest: list[Array] = []
        by_largest: list[Array] = []
        for number, point in enumerate(points):
            values, derivatives = self._with_bounds(point, bounds[number], number, n, z.size, rates)
            f, by_m, by_x = self._formulas.at(values, x)
            by = by_m @ derivatives
            by[:, :n] += by_x * rates
            conditions[number], by_conditions[number] = f[1:], by[1:]
            worst[number], by_worst[number] = f[0], by[0]
            objective += f[0] / s
            gradient += by[0] / s
            for place, measure in enumerate(self._extreme):
                parts = point.parts[measure]
                rows = np.zeros((parts.v.size, z.size))
                rows[:, :n] = parts.d * rates
                rows[:, n + number * e + place] = -1.0
                largest.append(parts.v - bounds[number, place])
                by_largest.append(rows)
        g = [conditions.ravel(), *largest]
        J = [by_conditions.reshape(s * k, z.size), *by_largest]
        if self._worst:
            objective, gradient = float(z[-1]), np.zeros(z.size)
            gradient[-1] = 1.0
            by_worst[:, -1] -= 1.0
            g.append(worst - z[-1])
            J.append(by_worst)
        return float(objective), np.concatenate(g), gradient, np.vstack(J)

    def _with_bounds(
        self, point: ScenarioPoint, bounds: Array, number: int, n: int, size: int, rates: Array
    ) -> tuple[Array, Array]:
        """The measures of a scenario with the unknowns for extreme measures, and their derivatives by all
        unknowns ``(nm, size)``."""
        values = point.measures.v.copy()
        derivatives = np.zeros((values.size, size))
        derivatives[:, :n] = point.measures.d * rates
        for place, measure in enumerate(self._extreme):
            sign = -1.0 if self._runs.measures[measure].kind == "minimum" else 1.0
            values[measure] = sign * bounds[place]
            derivatives[measure] = 0.0
            derivatives[measure, n + number * len(self._extreme) + place] = sign
        return values, derivatives

    def multipliers(self, row_multipliers: Array) -> Array:
        """The multipliers of the constraints: the sums over the scenarios, ``(k,)``."""
        k, s = len(self._conditions), self._runs.scenarios
        return row_multipliers[: k * s].reshape(s, k).sum(axis=0)
