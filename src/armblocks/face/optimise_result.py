"""The result of an optimisation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.diagram import Diagram
from armblocks.equations import SimulationOptions
from armblocks.errors import InputError, counted
from armblocks.face.estimates import value_of
from armblocks.face.model import CompiledDiagram
from armblocks.face.text_table import text_table
from armblocks.face.trajectory_report import save_picture
from armblocks.pictures.numbers import table_number
from armblocks.pictures.picture import Picture
from armblocks.report.charts.search_chart import search_chart
from armblocks.simulation import SimulationResult

Array = NDArray[np.float64]

ACTIVE = 1e-4
"""A constraint is active if its value is nearer to the limit than this fraction of the limit."""


def _nothing() -> Array:
    return np.empty(0)


@dataclass(frozen=True, kw_only=True)
class OptimisedConstraint(metaclass=ArgumentErrors):
    """A constraint at the end of an optimisation: ``low <= value <= high``.

    - ``value``: in the scenario that is nearest to a limit.
    - ``start``: the same at the start.
    - ``multiplier``: minus the derivative of the minimum with respect to the limit. It is positive for the
      upper limit, negative for the lower one, 0 if neither is active, NaN if the method does not determine
      it.
    """

    name: str
    value: float
    start: float
    low: float
    high: float
    multiplier: float

    @property
    def active(self) -> bool:
        """Whether the value is at a limit."""
        ends = [end for end in (self.low, self.high) if np.isfinite(end)]
        sizes = [abs(end) or max(abs(self.start), 1e-6) for end in ends]
        return any(abs(self.value - end) <= ACTIVE * size for end, size in zip(ends, sizes))

    @property
    def satisfied(self) -> bool:
        """Whether the value is within the limits, up to a millionth."""
        slack = [1e-6 * (1.0 + abs(end)) if np.isfinite(end) else 0.0 for end in (self.low, self.high)]
        return self.low - slack[0] <= self.value <= self.high + slack[1]


@dataclass(frozen=True, kw_only=True, eq=False)
class LocalSolution(metaclass=ArgumentErrors):
    """The end of the search from one start: ``start``, ``values (n,)``, and its ``objective``."""

    start: Array
    values: Array
    objective: float
    feasible: bool
    message: str


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class OptimisationResult(metaclass=ArgumentErrors):
    """The result of :func:`armblocks.optimise`. ``print`` shows it as tables.

    - ``diagram``: the diagram with the best values.
    - ``variables``, ``units``: the names of the n variables, and their units.
    - ``values``, ``start`` (n,): the best values and the values at the start.
    - ``bounds`` (n, 2): the lowest and highest values.
    - ``bound_multipliers`` (n,): the multipliers of the bounds, as for constraints.
    - ``objective``, ``start_objective``: the value of ``objective_name`` at the best values and at the start.
    - ``constraints``: see :class:`OptimisedConstraint`.
    - ``method``: ``gradient`` (exact derivatives) or ``search`` (values alone).
    - ``reason``: the reason for this method.
    - ``message``: the reason why the search ended.
    - ``converged``: whether the search found a minimum.
    - ``feasible``: whether all constraints hold.
    - ``evaluations``, ``runs``: the numbers of evaluated points and of runs.
    - ``history`` (K, 2 + n): objective, largest relative violation of a constraint, and variables of each
      evaluated point.
    - ``solutions``: the ends of the searches from all starts.
    - ``scenarios``: the parameters of each of the S scenarios of the design ``over``.
    - ``scenario_objectives``, ``start_scenario_objectives`` (S,): the objective in each scenario, at the best
      values and at the start.
    """

    diagram: Diagram = field(repr=False)
    variables: tuple[str, ...]
    units: tuple[str, ...] = ()
    values: Array
    start: Array
    bounds: Array
    objective_name: str
    objective: float
    start_objective: float = np.nan
    constraints: tuple[OptimisedConstraint, ...] = ()
    bound_multipliers: Array = field(default_factory=_nothing)
    method: str = "gradient"
    reason: str = ""
    message: str = ""
    converged: bool = False
    feasible: bool = False
    evaluations: int = 0
    runs: int = 0
    history: Array = field(default_factory=_nothing)
    solutions: tuple[LocalSolution, ...] = ()
    statistic: str = "the mean"
    scenarios: tuple[Mapping[str, Any], ...] = ({},)
    scenario_objectives: Array = field(default_factory=_nothing)
    start_scenario_objectives: Array = field(default_factory=_nothing)
    options: SimulationOptions = field(repr=False)

    def __getitem__(self, variable: str) -> float:
        """The value of a variable. Raises UnknownNameError."""
        return value_of(variable, self.variables, self.values, "variable", self.diagram.name)

    @property
    def active(self) -> tuple[str, ...]:
        """The active constraints and bounds by name."""
        names = [constraint.name for constraint in self.constraints if constraint.active]
        for name, value, (low, high), start in zip(self.variables, self.values, self.bounds, self.start):
            width = ACTIVE * (high - low if np.isfinite(high - low) else max(abs(value), abs(start)))
            if value - low <= width:
                names.append(f"{name} >= {low:g}")
            elif high - value <= width:
                names.append(f"{name} <= {high:g}")
        return tuple(names)

    def worst(self, count: int = 1) -> NDArray[np.int64]:
        """The numbers of the scenarios with the largest objectives, the largest first."""
        if not _is_integer(count) or count < 0:
            raise InputError(
                f"count = {count!r}",
                where="OptimisationResult.worst",
                allowed="an integer number of scenarios, 0 or more",
                fix="give the number of scenarios that the result lists",
            )
        order = np.argsort(-np.nan_to_num(self.scenario_objectives, nan=np.inf), kind="stable")
        return order[:count].astype(np.int64)

    def run(self, scenario: int = 0) -> SimulationResult:
        """The run of one scenario with the best values and all signals.

        Raises ``InputError`` for a number that does not exist, ``SimulationError`` for a run that fails.
        """
        count = len(self.scenarios)
        if not _is_integer(scenario) or not 0 <= scenario < count:
            raise InputError(
                f"scenario {scenario!r} does not exist",
                where=self.diagram.name,
                allowed=f"0 to {count - 1}",
                fix="choose a number, such as result.worst()[0]",
            )
        model = CompiledDiagram(self.diagram)
        return model.simulate(self.options, parameters=dict(self.scenarios[scenario]) or None)

    def table(self) -> list[dict[str, float | str]]:
        """One row for each variable."""
        return [
            {
                "variable": name,
                "value": float(self.values[k]),
                "unit": self.units[k],
                "start": float(self.start[k]),
                "lower": float(self.bounds[k, 0]),
                "upper": float(self.bounds[k, 1]),
                "multiplier": float(self.bound_multipliers[k]),
            }
            for k, name in enumerate(self.variables)
        ]

    @property
    def findings(self) -> tuple[str, ...]:
        """Sentences on the end of the search, constraints that do not hold, and the method."""
        found: list[str] = []
        if not self.feasible:
            broken = [constraint.name for constraint in self.constraints if not constraint.satisfied]
            found.append("not satisfied: " + ("; ".join(broken) or "runs without a value"))
        if not self.converged:
            found.append(f"no minimum is confirmed: {self.message}; the values are the best so far")
        if len(self.scenarios) > 1:
            found.append(f"{self.statistic} of {len(self.scenarios)} scenarios")
        if len(self.solutions) > 1:
            close = 1e-3 * max(abs(self.objective), 1e-12)
            same = sum(s.feasible and abs(s.objective - self.objective) <= close for s in self.solutions)
            found.append(f"{same} of {len(self.solutions)} starts end at this objective")
        found.append(f"method '{self.method}': {self.reason}")
        return tuple(found)

    @property
    def headline(self) -> str:
        """The objective at the start and at the end, as a line."""
        before, after = table_number(self.start_objective, 6), table_number(self.objective, 6)
        effort = f"{counted(self.evaluations, 'evaluation')}, {counted(self.runs, 'run')}"
        return f"{self.diagram.name}: {self.objective_name} = {after}, {before} at the start ({effort})"

    def plot(self, *, save: str | PathLike[str] | None = None) -> Picture:
        """A picture of the history: the objective of all points, and the best one so far with its variables.

        ``save``: the ``.svg`` or ``.png`` file to write.
        """
        picture = search_chart(
            self.history[:, 0], self.history[:, 1], self.history[:, 2:], self.variables, self.objective_name
        )
        if save is not None:
            save_picture(picture, save, "OptimisationResult.plot")
        return picture

    def __repr__(self) -> str:
        end = "converged" if self.converged else self.message
        return (
            f"<OptimisationResult {self.diagram.name}: {self.objective_name} = {self.objective:.6g}, {end}>"
        )

    def __str__(self) -> str:
        lines = [self.headline, *text_table(VARIABLE_HEADS, variable_rows(self))]
        if self.constraints:
            lines += ["", *text_table(CONSTRAINT_HEADS, constraint_rows(self))]
        return "\n".join([*lines, "", *self.findings])


VARIABLE_HEADS = ("variable", "value", "unit", "start", "lower", "upper", "multiplier")
CONSTRAINT_HEADS = ("constraint", "value", "start", "active", "multiplier")


def _is_integer(value: object) -> bool:
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def _number(value: float | str) -> str:
    return table_number(float(value), 5) if np.isfinite(float(value)) else ""


def variable_rows(result: OptimisationResult) -> list[list[str]]:
    """The cells of :data:`VARIABLE_HEADS` for each variable."""
    return [
        [str(row[name]) if name in ("variable", "unit") else _number(row[name]) for name in VARIABLE_HEADS]
        for row in result.table()
    ]


def constraint_rows(result: OptimisationResult) -> list[list[str]]:
    """The cells of :data:`CONSTRAINT_HEADS` for each constraint."""
    return [
        [
            entry.name,
            _number(entry.value),
            _number(entry.start),
            "active" if entry.active else ("" if entry.satisfied else "not satisfied"),
            _number(entry.multiplier),
        ]
        for entry in result.constraints
    ]
