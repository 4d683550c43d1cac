"""Equilibrium operating points: a damped Newton method with exact derivatives.

The unknowns are the states that are not given, the discrete states of clocks, the outputs of delays, the
unknowns of implicit equations, and the free parameters. The equations are: the derivatives of all non-moving
states are 0, ticks change no state, outputs of delays equal their inputs, the implicit equations hold, and
the chosen signals have their required values. Steps follow the method of Levenberg and Marquardt (Moré,
Lecture Notes in Mathematics 630, 1978, 105-116), limited to the bounds of the unknowns. Equations and
unknowns are scaled by the rows and columns of the Jacobian, so that their units have no effect. The search
ends when the equations hold to their rounding errors, or when a step is within the rounding errors of the
unknowns. If there are several solutions, the result is one near the start. The modes are updated at the
solution, and the iteration is repeated. If this fails, the modes are updated at every step. This is
necessary, for example, for a table whose first segment, extended as a straight line, reaches zero only far
beyond the last segment.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.equilibration import ResidualScales, equilibrating_factors
from armblocks.analysis.operating_point import OperatingPoint, operating_point, solved
from armblocks.equations import HybridSystem, Signature
from armblocks.equations.evaluation import EvaluatedSystem, Jacobians, Point
from armblocks.errors import SimulationError, counted

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

MAX_ITERATIONS = 200
"""Maximum number of steps of one search."""
MAX_MODE_CHANGES = 20
"""Maximum number of mode changes."""
ROUNDING_ERROR = 4.0 * float(np.finfo(np.float64).eps)
"""Relative rounding error of a term of an equation."""
SOLVED = 16.0 * ROUNDING_ERROR
"""Residual of a solved equation, relative to the sum of the magnitudes of its terms."""
NEARBY, NEARBY_POINTS = 1e-12, 4
"""Distance, relative to the largest values, and number of the points at which roundings are measured."""
SAFETY = 4.0
"""Ratio of the bound of a rounding error and the largest measured one."""
START_DAMPING = 1e-3
"""Damping of the first step; without failed steps it decreases."""
MAX_NAMED_EQUATIONS = 6
"""Maximum number of equations that a message names."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TrimProblem:
    """The definition of a trim problem.

    - ``start``: the first guess.
    - ``free_states``: the indices in ``x`` of the states that may change.
    - ``resting``: the indices of the states whose derivative must be 0.
    - ``free_parameters``: the indices in ``p`` of the parameters that may change.
    - ``rows``: the indices in ``y`` of the signals that must have the values ``targets``.
    - ``bounds``: lower and upper bound by the name of an unknown scalar.
    """

    system: HybridSystem
    start: Point
    free_states: Indices
    resting: Indices
    free_parameters: Indices
    rows: Indices
    targets: Array
    bounds: Mapping[str, tuple[float, float]]
    tolerance: float


@dataclass(frozen=True, kw_only=True, eq=False)
class TrimResult:
    """An operating point with its residuals.

    ``free``: the parameters that were found, in the form for ``simulate(parameters=…)``. ``residuals``: the
    residual of every equation, by name. ``at_bounds``: unknowns that are at a bound of their range.
    """

    point: OperatingPoint
    free: Mapping[str, Array]
    residuals: Mapping[str, float]
    at_bounds: tuple[str, ...]
    iterations: int

    @property
    def largest_residual(self) -> float:
        """The largest magnitude of a residual."""
        return max((abs(value) for value in self.residuals.values()), default=0.0)

    @property
    def accuracies(self) -> Mapping[str, Array]:
        """Bounds of the rounding errors of all unknowns, by name and in their shape."""
        return self.point.accuracies

    def shown(self, name: str, value: Array) -> Array:
        """A value of the point or of ``free``, with 0 for every number that is 0 within its accuracy."""
        return self.point.shown(name, value)

    def __repr__(self) -> str:
        head = (
            f"<TrimResult of {self.point.name} at {self.point.time:g} s: "
            f"{counted(len(self.residuals), 'equation')} to "
            f"{self.largest_residual:.2g} in {counted(self.iterations, 'iteration')}>"
        )
        parts = [*self.point.states.items(), *self.point.discrete.items(), *self.free.items()]
        width = max((len(name) for name, _ in parts), default=0)
        lines = (
            f"  {name:<{width}}  {np.array2string(self.shown(name, value), precision=8)}"
            for name, value in parts
        )
        return "\n".join([head, *lines])


def trim_system(problem: TrimProblem) -> TrimResult:
    """Solve a trim problem.

    Raises ``SimulationError`` if no equilibrium is found; its ``partial`` is the result at the last point.
    """
    search = _Search(problem)
    point, iterations, inconsistent = _solve_with_mode_updates(search)
    if inconsistent or not search.is_solution(point):
        other, used = search.run(problem.start, update_modes=True)
        iterations += used
        if search.is_solution(other) and not search.inconsistent_modes(other):
            point, inconsistent = other, []
    result = search.result(point, iterations)
    if inconsistent:
        raise SimulationError(
            f"the modes {', '.join(inconsistent[:MAX_NAMED_EQUATIONS])} remain inconsistent",
            where=problem.system.name,
            allowed="an operating point at which no switching block is at a threshold",
            fix="start from a point on the intended side, or change the limits",
            partial=result,
        )
    if not search.is_solution(point):
        raise _failure(problem, search, point, result)
    return result


def _solve_with_mode_updates(search: _Search) -> tuple[Point, int, list[str]]:
    """Solve with constant modes, update the modes, and repeat.

    Returns the point, the number of iterations and the modes that remain inconsistent.
    """
    point, iterations = search.problem.start, 0
    previous_modes: list[bytes] = []
    while True:
        point, used = search.run(point)
        iterations += used
        changing = search.inconsistent_modes(point)
        z = search.consistent_modes(point)
        if not changing or z.tobytes() in previous_modes or len(previous_modes) == MAX_MODE_CHANGES:
            return point, iterations, changing
        previous_modes.append(point.z.tobytes())
        point = dataclasses.replace(point, z=z)


def _elements(layout: Signature) -> list[str]:
    return [name for slot in layout for name in slot.elements]


class _Search:
    """Equations, derivatives and steps of one problem."""

    def __init__(self, problem: TrimProblem) -> None:
        system = problem.system
        self.problem = problem
        self.evaluated = EvaluatedSystem(system, problem.free_parameters.tolist(), problem.rows.tolist())
        self.full_system = EvaluatedSystem(system)
        self.sampled = self.evaluated.sampled
        delays = system.delays
        self.delayed: Indices = np.array(
            [*delays.values, *delays.derivatives] if delays else [], dtype=np.intp
        )
        self.ticked: Indices = np.flatnonzero(self.sampled)
        self.free_discrete: Indices = np.concatenate([self.ticked, self.delayed])
        free_discrete: list[int] = self.free_discrete.tolist()
        self.ticking = np.ones(len(system.clocks))
        self.state_names, discrete_names = _elements(system.states), _elements(system.discrete)
        parameter_names = _elements(system.parameters)
        signal_names = _elements(system.signals_layout)
        self.unknowns: list[str] = [
            *(self.state_names[k] for k in problem.free_states.tolist()),
            *(discrete_names[k] for k in free_discrete),
            *_elements(system.algebraic),
            *(parameter_names[k] for k in problem.free_parameters.tolist()),
        ]
        self.equations: list[str] = [
            *(f"rate of {self.state_names[k]}" for k in problem.resting.tolist()),
            *(f"tick of {discrete_names[k]}" for k in self.ticked.tolist()),
            *(f"delay of {discrete_names[k]}" for k in self.delayed.tolist()),
            *(f"equation of {name}" for name in _elements(system.algebraic)),
            *(signal_names[k] for k in problem.rows.tolist()),
        ]
        bounds = [problem.bounds.get(name, (-np.inf, np.inf)) for name in self.unknowns]
        self.lower = np.array([low for low, _ in bounds], dtype=np.float64)
        self.upper = np.array([high for _, high in bounds], dtype=np.float64)
        self.largest_values = np.zeros(len(self.unknowns))

    def values(self, point: Point) -> Array:
        """The unknowns of a point in one vector."""
        problem = self.problem
        return np.concatenate(
            [
                point.x[problem.free_states],
                point.z[self.free_discrete],
                point.w,
                point.p[problem.free_parameters],
            ]
        )

    def point_with(self, values: Array, point: Point) -> Point:
        """The point with other values of the unknowns."""
        problem = self.problem
        sizes = [problem.free_states.size, self.free_discrete.size, point.w.size]
        states, ticked, unknowns, parameters = np.split(values, np.cumsum(sizes))
        x, z, p = point.x.copy(), point.z.copy(), point.p.copy()
        x[problem.free_states], z[self.free_discrete], p[problem.free_parameters] = states, ticked, parameters
        return Point(t=point.t, x=x, z=z, w=unknowns, p=p)

    def residuals(self, point: Point) -> Array:
        """The residuals of all equations."""
        problem, evaluated = self.problem, self.evaluated
        parts = [evaluated.derivative(point)[problem.resting]]
        if self.ticked.size:
            parts.append((evaluated.update(point, self.ticking) - point.z)[self.ticked])
        if self.delayed.size:
            parts.append(evaluated.delay_inputs(point) - point.z[self.delayed])
        parts += [evaluated.residual(point), evaluated.signals(point) - problem.targets]
        return np.concatenate(parts)

    def _jacobian_rows(self, point: Point) -> list[tuple[Jacobians, Indices, Indices]]:
        """The derivatives of the equations, in their order.

        Each entry has the derivatives, the selected rows, and for each row the index of the entry of z that
        the equation subtracts.
        """
        problem, evaluated = self.problem, self.evaluated
        flow = evaluated.derivative_jacobians(point)
        none = np.zeros(0, dtype=np.intp)
        blocks = [(flow, problem.resting, none)]
        if self.ticked.size:
            blocks.append((evaluated.update_jacobians(point, self.ticking), self.ticked, self.ticked))
        if self.delayed.size:
            input_jacobians = evaluated.delay_input_jacobians(point)
            blocks.append((input_jacobians, np.arange(self.delayed.size), self.delayed))
        blocks.append((evaluated.residual_jacobians(point), np.arange(point.w.size), none))
        blocks.append((evaluated.signal_jacobians(point), np.arange(problem.rows.size), none))
        return blocks

    def jacobian_and_sizes(self, point: Point) -> tuple[Array, Array]:
        """Derivatives of the equations with respect to the unknowns, and the sizes of the equations.

        Each equation is a sum of terms, derivative times value. Its size is the sum of their magnitudes.
        """
        problem = self.problem
        free = point.p[problem.free_parameters]
        rows: list[Array] = []
        sizes: list[Array] = []
        for j, chosen, subtracted in self._jacobian_rows(point):
            by_z = j.z[np.ix_(chosen, self.free_discrete)]
            with np.errstate(invalid="ignore"):  # at a point without finite derivatives
                terms = np.abs(j.x[chosen]) @ np.abs(point.x) + np.abs(j.z[chosen]) @ np.abs(point.z)
                terms += np.abs(j.w[chosen]) @ np.abs(point.w) + np.abs(j.p[chosen]) @ np.abs(free)
            if subtracted.size:
                by_z = by_z - (subtracted[:, None] == self.free_discrete)
                terms += np.abs(point.z[subtracted])
            by_x = j.x[np.ix_(chosen, problem.free_states)]
            rows.append(np.hstack([by_x, by_z, j.w[chosen], j.p[chosen]]))
            sizes.append(terms)
        return np.vstack(rows), np.concatenate(sizes)

    def errors(self, point: Point) -> Array:
        """Bound of the rounding error of every unknown at a solution.

        The terms of an equation have a few roundings each. The error of the equation and its residual,
        multiplied by the inverse Jacobian, bound the error of the unknowns (Golub and Van Loan, Matrix
        Computations, 4th ed., 2.6). Terms that cancel without an unknown, such as a weight and its
        compensation, are not in the Jacobian. Their roundings are measured.
        """
        matrix, sizes = self.jacobian_and_sizes(point)
        if not np.isfinite(matrix).all():  # the search has failed
            return np.zeros(len(self.unknowns))
        rows, columns = equilibrating_factors(matrix)
        inverse = np.abs(np.linalg.pinv(matrix * rows[:, None] * columns))
        residuals = np.abs(self.residuals(point)) + self._measured_roundings(point, matrix)
        return columns * (inverse @ (rows * (ROUNDING_ERROR * sizes + residuals)))

    def _measured_roundings(self, point: Point, jacobian: Array) -> Array:
        """Differences of the residuals at close points from the linear equations.

        The points differ by a small part of the largest values in the search, such that terms of second
        order are smaller than the roundings.
        """
        values, before = self.values(point), self.residuals(point)
        found = np.zeros(before.size)
        for k in range(NEARBY_POINTS):
            signs = np.where(np.arange(values.size) & (1 << k), -1.0, 1.0) * (1.0 - k / (2.0 * NEARBY_POINTS))
            nearby = values + NEARBY * signs * self.largest_values
            change = self.residuals(self.point_with(nearby, point)) - before
            difference = np.abs(change - jacobian @ (nearby - values))
            found = np.maximum(found, np.where(np.isfinite(difference), difference, 0.0))
        return SAFETY * found

    def rounding(self, point: Point, residuals: Array, jacobian: Array, sizes: Array) -> Array:
        """Residuals that can be rounding errors.

        They are proportional to the size of an equation if the equation is linear within the rounding errors
        of the unknowns, else 0: an angle of 1e16 rad has no sine.
        """
        errors = SOLVED * sizes
        if not ((residuals != 0.0) & (np.abs(residuals) <= errors)).any():
            return errors
        values = self.values(point)
        nearby, _ = self.jacobian_and_sizes(self.point_with(values * (1.0 + SOLVED), point))
        change, linear = np.abs(nearby - jacobian) @ np.abs(values), np.abs(jacobian) @ np.abs(values)
        return np.where(change <= 1e-6 * linear, errors, 0.0)

    def violated(self, point: Point) -> list[int]:
        """The equations that hold neither to the tolerance nor to their rounding errors."""
        residuals = self.residuals(point)
        allowed: Array = np.full(residuals.size, self.problem.tolerance)
        if not np.abs(residuals).max(initial=0.0) <= self.problem.tolerance:
            allowed = np.maximum(allowed, self.rounding(point, residuals, *self.jacobian_and_sizes(point)))
        return np.flatnonzero(~(np.abs(residuals) <= allowed)).tolist()

    def is_solution(self, point: Point) -> bool:
        """Whether every equation holds."""
        return not self.violated(point)

    def consistent_modes(self, point: Point) -> Array:
        """``z`` with consistent modes; the entries that clocks update are unchanged."""
        if not point.z.size:
            return point.z
        return np.where(self.sampled, point.z, self.full_system.consistent_modes(point))

    def inconsistent_modes(self, point: Point) -> list[str]:
        """The inconsistent modes at a point."""
        names = _elements(self.problem.system.discrete)
        return [names[k] for k in np.flatnonzero(self.consistent_modes(point) != point.z).tolist()]

    def run(self, start: Point, *, update_modes: bool = False) -> tuple[Point, int]:
        """Take damped steps until they no longer reduce the residuals.

        ``update_modes``: update the modes at each trial.
        """
        point = self.point_with(np.clip(self.values(start), self.lower, self.upper), start)
        if update_modes:
            point = dataclasses.replace(point, z=self.consistent_modes(point))
        residuals, damping = self.residuals(point), START_DAMPING
        derivatives, values = np.zeros((len(self.equations), len(self.unknowns))), np.abs(self.values(point))
        for iteration in range(MAX_ITERATIONS):
            jacobian, sizes = self.jacobian_and_sizes(point)
            if not np.isfinite(jacobian).all() or not np.isfinite(residuals).all():
                return point, iteration
            derivatives = np.maximum(derivatives, np.abs(jacobian))
            rounding = self.rounding(point, residuals, jacobian, sizes)
            scales = ResidualScales.of(derivatives, residuals, rounding)
            size = scales.excess(residuals)
            if size == 0.0:
                return point, iteration
            while True:
                if damping > 1e12:
                    return point, iteration
                step = self._step(point, jacobian, residuals, damping, scales)
                trial = self.point_with(self.values(point) + step, point)
                if update_modes:
                    trial = dataclasses.replace(trial, z=self.consistent_modes(trial))
                trial_residuals = self.residuals(trial)
                is_better = scales.excess(trial_residuals) < size
                is_last = damping <= START_DAMPING and bool((np.abs(step) <= ROUNDING_ERROR * values).all())
                if is_better or is_last:
                    break
                damping *= 10.0
            if is_better:
                point, residuals, damping = trial, trial_residuals, max(damping / 30.0, 1e-18)
            if is_last:
                return point, iteration + 1
            values = np.maximum(values, np.abs(self.values(point)))
            self.largest_values = np.maximum(self.largest_values, values)
        return point, MAX_ITERATIONS

    def _step(
        self, point: Point, jacobian: Array, residuals: Array, damping: float, scales: ResidualScales
    ) -> Array:
        """One step of the damped normal equations. Unknowns that would leave their bounds stay at them."""
        values = self.values(point)
        scaled = jacobian * scales.rows[:, None] * scales.columns
        free = np.ones(values.size, dtype=np.bool_)
        step = np.zeros(values.size)
        for _ in range(values.size + 1):
            matrix = np.vstack([scaled[:, free], np.sqrt(damping) * np.eye(int(free.sum()))])
            # The right-hand side includes the steps of the unknowns that are at their bounds.
            right = np.concatenate(
                [-scales.rows * (residuals + jacobian[:, ~free] @ step[~free]), np.zeros(int(free.sum()))]
            )
            step[free] = scales.columns[free] * np.linalg.lstsq(matrix, right, rcond=None)[0]
            beyond = free & ((values + step < self.lower) | (values + step > self.upper))
            if not beyond.any():
                break
            step = np.clip(values + step, self.lower, self.upper) - values
            free &= ~beyond
        return step

    def result(self, point: Point, iterations: int) -> TrimResult:
        """The result at a point, by name."""
        if self.is_solution(point):
            point = solved(self.full_system, point)
        values = self.values(point)
        bounded = (values <= self.lower) | (values >= self.upper)
        system = self.problem.system
        known = operating_point(self.full_system, point)
        chosen = {int(k) for k in self.problem.free_parameters}
        free = {
            name: known.parameters[name]
            for name, entry in system.parameters.ranges.items()
            if chosen & set(range(*entry.indices(system.parameters.size)))
        }
        zero_point = Point(t=0.0, **{part: np.zeros_like(getattr(point, part)) for part in "xzwp"})
        accuracies = self.point_with(self.errors(point), zero_point)
        known = dataclasses.replace(
            known,
            accuracies={
                **system.states.unpack(accuracies.x),
                **system.discrete.unpack(accuracies.z),
                **system.algebraic.unpack(accuracies.w),
                **{name: system.parameters.unpack(accuracies.p)[name] for name in free},
            },
        )
        return TrimResult(
            point=known,
            free=free,
            residuals=dict(zip(self.equations, self.residuals(point).tolist())),
            at_bounds=tuple(self.unknowns[k] for k in np.flatnonzero(bounded).tolist()),
            iterations=iterations,
        )


def _failure(problem: TrimProblem, search: _Search, point: Point, result: TrimResult) -> SimulationError:
    """The error that names the equations that do not hold, and the likely cause."""
    names = list(result.residuals)
    violated = {names[k]: result.residuals[names[k]] for k in search.violated(point)}
    worst = sorted(
        violated, key=lambda name: -abs(violated[name]) if np.isfinite(violated[name]) else -np.inf
    )
    text = ", ".join(
        f"{name} is {_residual_text(name, violated[name])}" for name in worst[:MAX_NAMED_EQUATIONS]
    )
    others = f" and {len(worst) - MAX_NAMED_EQUATIONS} more" if len(worst) > MAX_NAMED_EQUATIONS else ""
    return SimulationError(
        f"no operating point was found: {text}{others}",
        where=problem.system.name,
        allowed=_cause(problem, search, point, worst, result),
        fix="free another parameter, give another start, or name states in moving",
        partial=result,
    )


def _residual_text(name: str, value: float) -> str:
    return f"{value:.4g}" if name.startswith(("rate of", "tick of", "equation of")) else f"{value:+.4g} off"


def _cause(
    problem: TrimProblem, search: _Search, point: Point, worst: Sequence[str], result: TrimResult
) -> str:
    jacobian, _ = search.jacobian_and_sizes(point)
    if not np.isfinite(jacobian).all():
        return "points with finite derivatives; they are not finite at this point"
    rows = {name: jacobian[k] for k, name in enumerate(search.equations)}
    fixed = [name for name in worst if not rows[name].any()]
    if fixed:
        names = ", ".join(fixed[:MAX_NAMED_EQUATIONS])
        return f"equations that depend on a free variable; {names} depends on none"
    if result.at_bounds:
        return f"values within the bounds; {', '.join(result.at_bounds[:MAX_NAMED_EQUATIONS])} is at a bound"
    if len(search.equations) > len(search.unknowns):
        return f"as many equations as unknowns ({len(search.equations)} and {len(search.unknowns)} here)"
    return "a start from which the equations can be solved"
