"""The solvers behind ``ab.optimise`` on problems with known solutions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.testing import assert_allclose

from armblocks.optimisation.interior_point import minimise
from armblocks.optimisation.program import NonlinearProgram
from armblocks.optimisation.search import Search, search_minimum, violations

Array = np.ndarray


def circle(values: Callable[[Array], float] | None = None) -> NonlinearProgram:
    """Rosenbrock's function inside the unit circle."""

    def rosenbrock(z: Array) -> float:
        return float((1.0 - z[0]) ** 2 + 100.0 * (z[1] - z[0] ** 2) ** 2)

    def derivatives(z: Array) -> tuple[Array, Array]:
        rest = z[1] - z[0] ** 2
        gradient = np.array([-2.0 * (1.0 - z[0]) - 400.0 * z[0] * rest, 200.0 * rest])
        return gradient, 2.0 * z[np.newaxis]

    function = values or rosenbrock
    return NonlinearProgram(
        lower=np.array([-2.0, -2.0]),
        upper=np.array([2.0, 2.0]),
        row_lower=np.array([-np.inf]),
        row_upper=np.array([1.0]),
        values=lambda z: None if z[0] > 1.5 else (function(z), np.array([z @ z])),
        derivatives=derivatives,
    )


def test_interior_point_meets_the_conditions_of_a_minimum() -> None:
    found = minimise(circle(), np.array([0.0, 0.0]))
    assert found.converged and found.message == "converged"
    assert_allclose(found.point, [0.7864151, 0.6176983], atol=1e-5)
    gradient, jacobian = circle().derivatives(found.point) or (np.empty(0), np.empty(0))
    assert_allclose(gradient + found.row_multipliers @ jacobian + found.bound_multipliers, 0.0, atol=1e-4)
    assert found.row_multipliers[0] > 0.1
    stopped = minimise(circle(), np.array([0.0, 0.0]), lambda: "enough")
    assert (stopped.message, stopped.converged) == ("enough", False)


def test_errors_and_interrupts_of_the_functions_are_raised() -> None:
    def fails(_: Array) -> float:
        raise ZeroDivisionError("inside")

    def interrupted(_: Array) -> float:
        raise KeyboardInterrupt

    with pytest.raises(ZeroDivisionError, match="inside"):
        minimise(circle(fails), np.zeros(2))
    with pytest.raises(KeyboardInterrupt):
        minimise(circle(interrupted), np.zeros(2))
    nothing = minimise(circle(), np.array([1.9, 0.0]))  # there are no values at the start
    assert not nothing.converged and nothing.message


def test_search_finds_the_global_minimum_within_constraints() -> None:
    calls: list[int] = []

    def values(points: Array) -> tuple[Array, Array]:
        calls.append(len(points))
        x = 4.0 * points - 2.0
        f = (x**2).sum(axis=1) + 3.0 * np.sin(4.0 * x).sum(axis=1)
        f[x[:, 0] > 1.8] = np.inf  # no value
        return f, x.sum(axis=1, keepdims=True)

    limits = {"row_lower": np.array([-0.2]), "row_upper": np.array([np.inf])}
    start, stop = np.array([0.9, 0.9]), str
    search = Search(values=values, **limits, start=start, evaluations=1500, seed=1, stop=stop)
    point, message, converged = search_minimum(search, global_search=True)
    grid = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 801)] * 2), axis=-1).reshape(-1, 2)
    f, rows = values(grid)
    best = f[rows[:, 0] >= -0.2].min()
    assert converged and message == "converged"
    assert values(point[np.newaxis])[0][0] <= best + 1e-4
    assert sum(calls) - len(grid) - 1 <= 1500 + 5
    again = search_minimum(search, global_search=True)[0]
    assert_allclose(again, point, atol=1e-12)
    few = Search(values=values, **limits, start=start, evaluations=30, seed=1, stop=stop)
    assert search_minimum(few, global_search=True)[1:] == ("the number of evaluations is reached", False)


def test_violations_are_relative_to_the_limits() -> None:
    rows = np.array([[5.0, 1.0], [5.0, -3.0], [np.nan, 1.0]])
    found = violations(rows, np.array([-np.inf, 0.0]), np.array([4.0, np.inf]))
    assert_allclose(found, [0.2, 3.0, np.inf])
    assert_allclose(violations(np.empty((2, 0)), np.empty(0), np.empty(0)), 0.0)


def test_feasible_convex_problems_are_never_called_infeasible() -> None:
    """Quadratic programs with a known feasible point: dependent equations, also more than unknowns, limits
    without an interior, and points at the bounds. The oracle is SciPy's SLSQP."""
    from scipy.optimize import LinearConstraint, minimize

    for seed in range(60):
        random = np.random.default_rng(seed)
        n, m = int(random.integers(1, 5)), int(random.integers(0, 7))
        root = random.normal(size=(n, n))
        hessian, c = root @ root.T + 0.1 * np.eye(n), random.normal(size=n)
        inside = random.uniform(size=n)
        if seed % 3 == 0:
            inside = np.round(inside)
        jacobian = random.normal(size=(m, n)) * 10.0 ** random.uniform(-1.0, 2.0, (m, 1))
        at, slack = jacobian @ inside, random.exponential(size=m) * random.integers(0, 2, m)
        kind = random.integers(0, 3, m)
        low, high = np.where(kind == 0, -np.inf, at - slack), np.where(kind == 1, np.inf, at + slack)

        def value(z: Array, hessian: Array = hessian, c: Array = c) -> float:
            return float(0.5 * z @ hessian @ z + c @ z)

        program = NonlinearProgram(
            lower=np.zeros(n),
            upper=np.ones(n),
            row_lower=low,
            row_upper=high,
            values=lambda z, J=jacobian, value=value: (value(z), J @ z),
            derivatives=lambda z, J=jacobian, hessian=hessian, c=c: (hessian @ z + c, J),
        )
        found = minimise(program, random.uniform(size=n))
        assert found.converged, (seed, found.message)
        assert violations((jacobian @ found.point)[np.newaxis], low, high)[0] <= 1e-6, seed
        scale = np.abs(jacobian).max(axis=1, initial=0.0)
        rows = [
            LinearConstraint(jacobian[k] / scale[k, None], low[k] / scale[k], high[k] / scale[k])
            for k in (np.flatnonzero(low == high), np.flatnonzero(low != high))
            if k.size
        ]
        oracle = minimize(value, inside, bounds=[(0, 1)] * n, constraints=rows, method="SLSQP")
        best = min(float(oracle.fun), value(inside)) if oracle.success else value(inside)
        assert value(found.point) <= best + 1e-4 * (1.0 + abs(best)), seed
