"""Contract of every integrator tableau: orders of steps and dense output, agreement with NumPy, names."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from numpy_integrator import integrate
from small_systems import states_of, system, van_der_pol_pid

from armblocks.equations import signature
from armblocks.errors import UnknownNameError
from armblocks.integration.butcher_tableau import ButcherTableau
from armblocks.integration.rosenbrock_tableau import Tableau
from armblocks.integration.system import compile_system
from armblocks.simulation.tableaux import DEFAULT, TABLEAUX, find_tableau

every_tableau = pytest.mark.parametrize("tableau", TABLEAUX, ids=[t.name for t in TABLEAUX])

# x' = 2 t x log y, y' = -2 t y log x: x = exp(sin t^2), y = exp(cos t^2). Hairer, Norsett, Wanner I, II.4,
# exercise: nonlinear in t, x and y, so that no error term vanishes.
PROBLEM = compile_system(
    system(
        "logarithms",
        states=states_of("a/x", "a/y"),
        signals=signature(("a/x", ())),
        derivative=lambda t, x, p: ca.vertcat(2 * t * x[0] * ca.log(x[1]), -2 * t * x[1] * ca.log(x[0])),
        outputs=lambda t, x, p: x[0],
        initial=(1.0, np.e),
    )
)
STOP = 2.0


def exact(t: np.ndarray) -> np.ndarray:
    return np.exp(np.column_stack([np.sin(t * t), np.cos(t * t)]))


def fixed_step_errors(tableau: Tableau, steps: int) -> tuple[float, float]:
    """Return the largest error at the ends of ``steps`` steps over 2 s, and at three times inside each."""
    fixed = tableau
    if tableau.adaptive:  # the same tableau without its error estimate
        fixed = replace(tableau, error=None, error_order=0)
        if isinstance(fixed, ButcherTableau):
            fixed = replace(fixed, second_error=None)
    h = STOP / steps
    samples = np.sort(
        np.concatenate([np.arange(steps + 1) * h, *((np.arange(steps) + f) * h for f in (0.2, 0.5, 0.9))])
    )
    samples[-1] = STOP
    run = PROBLEM.integrator(fixed).begin(np.array([1.0, np.e]), np.empty(0), samples, np.empty(0), step=h)
    run.advance(10**9)
    assert run.accepted == steps
    error = np.abs(run.states - exact(samples)).max(axis=1)
    return float(error[::4].max()), float(error.max())


@every_tableau
def test_half_the_step_reduces_the_error_according_to_the_order(tableau: Tableau) -> None:
    # Steps for which the error is well above rounding and dominated by its leading term.
    steps = {1: 400, 2: 200, 3: 100, 4: 60, 5: 80, 8: 16}[tableau.order]
    coarse, fine = fixed_step_errors(tableau, steps), fixed_step_errors(tableau, 2 * steps)
    assert np.log2(coarse[0] / fine[0]) > tableau.order - 0.3
    assert np.log2(coarse[1] / fine[1]) > tableau.dense_order - 0.35


@every_tableau
def test_the_native_loop_agrees_with_the_numpy_integrator(tableau: Tableau) -> None:
    """Equal steps, evaluations and values up to rounding, with breakpoints and dense output."""
    compiled = compile_system(van_der_pol_pid())
    p = np.empty(0)

    def f(t: float, x: np.ndarray) -> np.ndarray:
        e = np.sin(2 * np.pi * 0.1 * t) - x[0]
        u = 2 * e + 0.5 * x[2] - 0.5 * x[1]
        return np.array([x[1], (1 - x[0] ** 2) * x[1] - x[0] + u, e])

    samples = np.linspace(0, 6, 97)
    options = {"step": 0.05, "rtol": 1e-5, "atol": 1e-8}
    breakpoints = [1.2345, 4.0]
    run = compiled.integrator(tableau).begin(
        np.array([1.0, 0, 0]), p, samples, np.array(breakpoints), **options
    )
    run.advance(10**9)
    expected, counts = integrate(f, tableau, [1.0, 0, 0], samples, breakpoints, **options)
    assert (run.accepted, run.rejected, run.evaluations) == (
        counts.accepted,
        counts.rejected,
        counts.evaluations,
    )
    # rounding errors, amplified over 6 s
    np.testing.assert_allclose(run.states, expected, rtol=1e-10, atol=1e-11)


@every_tableau
def test_every_tableau_has_a_source(tableau: Tableau) -> None:
    assert tableau.title
    assert len(tableau.source) > 15
    if isinstance(tableau, ButcherTableau):
        assert tableau.real_stability >= 2.0


def test_names_and_aliases_are_unique_and_found_in_any_case() -> None:
    names = [name.casefold() for t in TABLEAUX for name in (t.name, *t.aliases)]
    assert len(names) == len(set(names))
    simulink = {"ode1": "euler", "ode2": "heun", "ode3": "rk3", "ode4": "rk4", "ode5": "rk5", "ode23": "rk23"}
    for name, expected in {
        **simulink,
        "ode45": "rk45",
        "RK45": "rk45",
        "ODE23": "rk23",
        "DOP853": "dop853",
    }.items():
        assert find_tableau(name).name == expected
    assert DEFAULT.name == "rk45"


def test_an_unknown_solver_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(UnknownNameError, match=r"no solver named 'rk455'.*did you mean 'rk45'"):
        find_tableau("rk455")


def test_stability_intervals_agree_with_the_published_ones() -> None:
    """Hairer, Wanner II, IV.2, table 2.1: 2.51 for order 3, 2.785 for RK4, 3.3 for Dormand-Prince."""
    published = {"euler": 2.0, "heun": 2.0, "rk3": 2.51, "rk4": 2.785, "rk45": 3.3}
    for name, value in published.items():
        method = find_tableau(name)
        assert isinstance(method, ButcherTableau)
        assert method.real_stability == pytest.approx(value, abs=0.02)
