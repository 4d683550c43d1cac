"""The result of an optimisation, from the outcome of its search."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armblocks.diagram import Diagram, with_parameters
from armblocks.equations import SimulationOptions
from armblocks.face.optimise_formulas import Condition
from armblocks.face.optimise_result import OptimisationResult, OptimisedConstraint
from armblocks.face.optimise_search import Optimisation, Outcome
from armblocks.face.optimise_statistics import MEAN, WORST, Statistics, violation
from armblocks.face.sweep_parameters import values_of_run
from armblocks.optimisation.search import FEASIBILITY
from armblocks.sweeps.designs import Design

Array = NDArray[np.float64]


def summarised(
    problem: Optimisation,
    outcome: Outcome,
    diagram: Diagram,
    name: str,
    design: Design | None,
    options: SimulationOptions,
) -> OptimisationResult:
    """The result. Its values are those of runs without derivatives, at the start and at the best values."""
    v = problem.variables
    points = np.stack([v.start, outcome.values])
    measures = problem.runs.measured(points).values
    values = problem.formula_values(points, measures)
    objectives = problem.statistics.objectives(values[..., 0])
    rows = problem.statistics.rows(values[..., 1:], problem.conditions)
    broken = violation(rows, problem.conditions)
    best = with_parameters(diagram, v.parameters(outcome.values))
    constraints = tuple(
        _constraint(condition, problem.statistics, values[..., 1 + k], float(outcome.multipliers[k]))
        for k, condition in enumerate(problem.conditions)
    )
    scenarios: list[Mapping[str, Any]] = [{}]
    if design is not None:
        scenarios = [values_of_run(best, design, k) for k in range(design.count)]
    return OptimisationResult(
        diagram=best,
        variables=v.names,
        units=v.units,
        values=outcome.values,
        start=v.start,
        bounds=np.stack([v.lower, v.upper], axis=1),
        objective_name=name,
        objective=float(objectives[1]),
        start_objective=float(objectives[0]),
        constraints=constraints,
        bound_multipliers=outcome.bound_multipliers,
        method=outcome.method,
        reason=outcome.reason,
        message=outcome.message,
        converged=outcome.converged,
        feasible=bool(np.isfinite(objectives[1]) and broken[1] <= 10.0 * FEASIBILITY),
        evaluations=len(problem.history),
        runs=outcome.runs,
        history=np.array(problem.history).reshape(-1, 2 + v.start.size),
        solutions=outcome.solutions,
        statistic=_statistic(problem.statistics),
        scenarios=tuple(scenarios),
        scenario_objectives=values[1, :, 0],
        start_scenario_objectives=values[0, :, 0],
        options=options,
    )


def _statistic(statistics: Statistics) -> str:
    texts = {MEAN: "the mean", WORST: "the largest objective"}
    if isinstance(statistics.objective, float):
        return f"the quantile {statistics.objective:g}"
    return texts[str(statistics.objective)]


def _constraint(
    condition: Condition, statistics: Statistics, values: Array, multiplier: float
) -> OptimisedConstraint:
    """A constraint with its values ``(2, S)`` at the start and at the end."""
    rows = statistics.rows(values[..., np.newaxis], [condition])
    limits = [limit for limit in (condition.high, condition.low) if np.isfinite(limit)]
    # A condition with two limits has two rows. The row that is nearest to its limit counts.
    signs = [1.0 if limit == condition.high and k == 0 else -1.0 for k, limit in enumerate(limits)]
    excess = np.array(
        [[sign * (value - limit) for sign, value, limit in zip(signs, row, limits)] for row in rows]
    )
    nearest = np.argmax(np.nan_to_num(excess, nan=np.inf), axis=1)
    found = OptimisedConstraint(
        name=condition.name,
        value=float(rows[1, nearest[1]]),
        start=float(rows[0, nearest[0]]),
        low=condition.low,
        high=condition.high,
        multiplier=multiplier,
    )
    # The interior-point method leaves small multipliers at limits that are not active.
    inactive = not np.isnan(multiplier) and not found.active
    return replace(found, multiplier=0.0) if inactive else found
