"""The search of an optimisation: choice of the method, several starts, and the record of all points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from armblocks import interrupts
from armblocks.analysis.designs import SOBOL, unit_points
from armblocks.errors import ArmblocksError, InputError, SimulationError
from armblocks.face.optimise_formulas import Condition, Formulas
from armblocks.face.optimise_gradient import GradientProgram
from armblocks.face.optimise_result import LocalSolution
from armblocks.face.optimise_runs import Runs
from armblocks.face.optimise_statistics import Statistics, row_limits, violation
from armblocks.face.optimise_variables import Variables
from armblocks.optimisation.interior_point import minimise
from armblocks.optimisation.search import FEASIBILITY, Search, search_minimum

Array = NDArray[np.float64]

GRADIENT, SEARCH = "gradient", "search"
CANDIDATES = 32
"""Number of points of the sweep from which each further start is chosen."""
RESTARTS = 3
"""Maximum number of further starts if no start ends at a feasible point."""
_EVALUATIONS_OF_A_START, _EVALUATIONS_OF_A_VARIABLE, _LEAST_EVALUATIONS = 300, 500, 1000
_CTRL_C = "stopped by Ctrl-C"


@dataclass(kw_only=True, eq=False)
class Optimisation:
    """The problem, and the record of all evaluated points."""

    variables: Variables
    formulas: Formulas
    conditions: list[Condition]
    statistics: Statistics
    runs: Runs
    seed: int
    progress: Callable[[int, float], None] | None
    where: str
    history: list[Array] = field(default_factory=list[Array])
    best: tuple[float, float, Array] | None = None
    """Violation beyond the tolerance, objective and variables of the best point."""

    message: str = ""
    """The message of the first run without a value."""

    def evaluate(self, points: Array) -> tuple[Array, Array]:
        """Objective ``(N,)`` and rows ``(N, m)`` at values ``(N, n)``; a record of each."""
        measured = self.runs.measured(points)
        self.message = self.message or measured.message
        return self.recorded(points, measured.values)

    def formula_values(self, points: Array, measures: Array) -> Array:
        """The objective and the constraints ``(N, S, 1 + k)`` of measures ``(N, S, nm)``."""
        count, scenarios = measures.shape[:2]
        flat = measures.reshape(count * scenarios, -1)
        values = self.formulas.values(flat, np.repeat(points, scenarios, axis=0))
        return values.reshape(count, scenarios, -1)

    def recorded(self, points: Array, measures: Array) -> tuple[Array, Array]:
        """Objective and rows of measures ``(N, S, nm)``; a record of each."""
        values = self.formula_values(points, measures)
        objectives = self.statistics.objectives(values[..., 0])
        rows = self.statistics.rows(values[..., 1:], self.conditions)
        broken = violation(rows, self.conditions)
        for x, f, distance in zip(points, objectives.tolist(), broken.tolist()):
            self.history.append(np.array([f, distance, *x]))
            key = (max(distance - FEASIBILITY, 0.0), f)
            if np.isfinite(f) and (self.best is None or key < self.best[:2]):
                self.best = (*key, x.copy())
        if self.progress is not None:
            least = self.best[1] if self.best is not None and self.best[0] == 0.0 else np.nan
            self.progress(len(self.history), least)
        return objectives, rows


@dataclass(frozen=True, kw_only=True, eq=False)
class Outcome:
    """The end of the search. Multipliers are NaN if the method does not determine them."""

    values: Array
    multipliers: Array
    bound_multipliers: Array
    method: str
    reason: str
    message: str
    converged: bool
    solutions: tuple[LocalSolution, ...]
    runs: int


def optimised(
    problem: Optimisation, method: str, starts: int, evaluations: int | None, *, allow_stops: bool
) -> Outcome:
    """Search with one of the methods. Raises ``InputError`` and ``SimulationError``."""
    program, reason = (None, "it was chosen") if method == SEARCH else _gradient_program(problem, allow_stops)
    if program is None and method == GRADIENT:
        raise InputError(
            f"the derivatives do not exist, because {reason}",
            where=problem.where,
            allowed="measures, parameters and diagrams with derivatives",
            fix="use method='search'",
        )
    if program is None:
        problem.variables.require_bounds(f"the search without derivatives ({reason})", problem.where)
        return _by_search(problem, reason, evaluations)
    reason = "it was chosen" if method == GRADIENT else "all derivatives exist"
    return _by_gradient(problem, program, reason, starts, evaluations)


def _gradient_program(problem: Optimisation, allow_stops: bool) -> tuple[GradientProgram | None, str]:
    """The program with derivatives, or the reason why there is none."""
    if problem.formulas.functions:
        return None, "a function of the result is Python code"
    if not problem.statistics.smooth:
        return None, "a quantile of the scenarios is not differentiable"
    if allow_stops:
        return None, "runs that a block ends are allowed"

    def observe(x: Array, measures: Array) -> None:
        problem.recorded(x[np.newaxis], measures[np.newaxis])

    try:
        program = GradientProgram(
            problem.runs,
            problem.variables,
            problem.formulas,
            problem.conditions,
            problem.statistics,
            observe,
        )
    except InputError as error:
        return None, error.what
    try:
        program.scenarios(problem.variables.start)
    except SimulationError as error:
        # Runs without derivatives may still have values.
        f, _ = problem.evaluate(problem.variables.start[np.newaxis])
        return (None, error.what) if np.isfinite(f[0]) else (program, "")
    return program, ""


def _by_search(problem: Optimisation, reason: str, evaluations: int | None) -> Outcome:
    v = problem.variables

    def values(points: Array) -> tuple[Array, Array]:
        return problem.evaluate(v.values(points))

    limits = row_limits(problem.conditions)
    most = max(_LEAST_EVALUATIONS, _EVALUATIONS_OF_A_VARIABLE * v.start.size)
    search = Search(
        values=values,
        row_lower=limits[0],
        row_upper=limits[1],
        start=v.coordinates(v.start),
        evaluations=evaluations or most,
        seed=problem.seed,
        stop=lambda: "",
    )
    _, message, converged = search_minimum(search, global_search=True)
    best = _best(problem)
    nothing = np.full(len(problem.conditions), np.nan)
    solution = LocalSolution(
        start=v.start, values=best[2], objective=best[1], feasible=best[0] == 0.0, message=message
    )
    return Outcome(
        values=best[2],
        multipliers=nothing,
        bound_multipliers=np.full(v.start.size, np.nan),
        method=SEARCH,
        reason=reason,
        message=message,
        converged=converged and best[0] == 0.0,
        solutions=(solution,),
        runs=problem.runs.count,
    )


def _best(problem: Optimisation) -> tuple[float, float, Array]:
    if problem.best is None:
        raise SimulationError(
            f"no run has a value of the objective: {problem.message or 'a measure is not defined'}",
            where=problem.where,
            allowed="a start, or bounds, with runs that reach the stop time",
            fix="begin at other values, or choose measures that are defined",
        )
    return problem.best


@dataclass(frozen=True, eq=False)
class _Local:
    """The end of one local search, with its multipliers."""

    solution: LocalSolution
    multipliers: Array
    bound_multipliers: Array
    converged: bool


def _by_gradient(
    problem: Optimisation, program: GradientProgram, reason: str, starts: int, evaluations: int | None
) -> Outcome:
    v = problem.variables
    found: list[_Local] = []
    message = ""
    before = len(problem.history)
    limit = (evaluations or _EVALUATIONS_OF_A_START * starts) + before
    try:
        for begin in _starts(problem, starts):
            if found and len(problem.history) >= limit:
                break
            local = _local(problem, program, begin, limit)
            if local is not None:
                found.append(local)
        if not any(local.solution.feasible for local in found) and v.bounded:
            limit = evaluations + before if evaluations else len(problem.history) + _EVALUATIONS_OF_A_START
            found += _restarted(problem, program, [local.solution.start for local in found], limit)
    except KeyboardInterrupt:
        if problem.best is None:
            raise
        interrupts.answered()
        message = _CTRL_C
    best = _best(problem)
    valid = [local for local in found if local.solution.feasible]
    chosen = min(valid, key=lambda local: local.solution.objective, default=None)
    ends_here = chosen is not None and not _passed_better(problem, chosen)
    nothing = np.full(len(problem.conditions), np.nan), np.full(v.start.size, np.nan)
    solved = chosen if ends_here else None
    last = solved or (found[-1] if found else None)
    return Outcome(
        values=best[2] if solved is None else solved.solution.values,
        multipliers=nothing[0] if solved is None else solved.multipliers,
        bound_multipliers=nothing[1] if solved is None else solved.bound_multipliers,
        method=GRADIENT,
        reason=reason,
        message=message or _end(last.solution if last is not None else None, ends_here=solved is not None),
        converged=solved is not None and solved.converged,
        solutions=tuple(local.solution for local in found),
        runs=problem.runs.count + program.count,
    )


def _end(last: LocalSolution | None, *, ends_here: bool) -> str:
    """Why the search ended."""
    if last is None:
        return "no search began"
    if ends_here or not last.message.startswith("converged"):
        return last.message
    return "the search passed a better point than its end, because the objective is not smooth there"


def _passed_better(problem: Optimisation, end: _Local) -> bool:
    """Whether a search has passed a feasible point with an objective below that of its end, by more than by
    rounding or by a violation of the constraints within their tolerance."""
    history = np.array(problem.history)
    f, broken, least = history[:, 0], history[:, 1], end.solution.objective
    sizes = np.array([_size(condition) for condition in problem.conditions])
    gain = float(np.abs(end.multipliers) @ sizes) * broken
    valid = np.isfinite(f) & (broken <= FEASIBILITY)
    scale = float(np.abs(f[valid]).max(initial=0.0))
    slack = 1e-6 * abs(least) + 1e-9 * scale
    return bool((valid & (f < least - slack - np.minimum(gain, 1e-3 * abs(least) + 1e-6 * scale))).any())


def _size(condition: Condition) -> float:
    """The size of the limits, to which violations are relative."""
    return 1.0 + max(abs(limit) for limit in (condition.low, condition.high) if np.isfinite(limit))


def _starts(problem: Optimisation, count: int) -> list[Array]:
    """The first point, and further points of a sweep over the bounds."""
    start = problem.variables.start
    if count == 1:
        return [start]
    problem.variables.require_bounds("a choice of several starts", problem.where)
    return [start, *_swept(problem, [start], count - 1)]


def _swept(problem: Optimisation, tried: list[Array], count: int) -> list[Array]:
    """The best ``count`` points of a sweep over the bounds that are far from one another and from those
    tried before: those with the least violation of the constraints, then with the least objective."""
    v = problem.variables
    total = count + len(tried)
    points = unit_points(SOBOL, CANDIDATES * total, v.start.size, problem.seed)
    objectives, rows = problem.evaluate(v.values(points))
    order = np.lexsort((objectives, violation(rows, problem.conditions)))
    known = [v.coordinates(point) for point in tried]
    chosen: list[Array] = []
    distance = 0.5 * total ** (-1.0 / v.start.size)
    while len(chosen) < count and distance > 1e-6:
        for k in order.tolist():
            far = all(float(np.linalg.norm(points[k] - other)) >= distance for other in known)
            if len(chosen) < count and far and np.isfinite(objectives[k]):
                known.append(points[k])
                chosen.append(v.values(points[k]))
        distance *= 0.5
    return chosen


def _restarted(
    problem: Optimisation, program: GradientProgram, tried: list[Array], limit: int
) -> list[_Local]:
    """Searches from further starts until one ends at a feasible point.

    A local search stops at a point where the violation of the constraints has no descent direction, for
    example where a controller saturates and the peak of its signal does not depend on the variables.
    """
    found: list[_Local] = []
    if len(problem.history) >= limit:
        return found
    for begin in _swept(problem, tried, RESTARTS):
        if len(problem.history) >= limit:
            break
        local = _local(problem, program, begin, limit)
        if local is not None:
            found.append(local)
            if local.solution.feasible:
                break
    return found


def _local(problem: Optimisation, program: GradientProgram, begin: Array, limit: int) -> _Local | None:
    """The local minimum from one start; ``None`` if its runs fail."""
    v = problem.variables
    try:
        unknowns = program.begin(begin)
    except ArmblocksError as error:
        problem.message = problem.message or error.what
        return None
    if not np.isfinite(unknowns).all():
        problem.message = problem.message or "a measure is not defined"
        return None

    def stop() -> str:
        return "the number of evaluations is reached" if len(problem.history) >= limit else ""

    solution = minimise(program.program(), unknowns, stop)
    n = v.start.size
    x = v.values(solution.point[:n])
    objective, broken = np.inf, np.inf
    try:
        measures = np.array([point.measures.v for point in program.scenarios(x)])
        objectives, rows = problem.recorded(x[np.newaxis], measures[np.newaxis])
        objective, broken = float(objectives[0]), float(violation(rows, problem.conditions)[0])
    except SimulationError:
        pass
    feasible = bool(broken <= FEASIBILITY and np.isfinite(objective))
    local = LocalSolution(
        start=begin, values=x, objective=objective, feasible=feasible, message=solution.message
    )
    return _Local(
        solution=local,
        multipliers=_not_negligible(program.multipliers(solution.row_multipliers)),
        bound_multipliers=_not_negligible(solution.bound_multipliers[:n]) / v.rates(x),
        converged=solution.converged and feasible,
    )


def _not_negligible(multipliers: Array) -> Array:
    """The interior-point method leaves small multipliers at limits that are not active."""
    largest = float(np.abs(multipliers).max(initial=0.0))
    return np.where(np.abs(multipliers) > max(1e-6 * largest, 1e-8), multipliers, 0.0)
