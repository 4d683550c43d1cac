"""Stiff problems compared with SciPy's implicit solvers and SUNDIALS.

    python benchmarks/stiff.py [--quick]

All solvers use the exact Jacobian, except CVODE of scikit-sundae for the Brusselator, which approximates a
banded Jacobian by differences. SciPy calls the Jacobian as a function, for the Brusselator sparse (LSODA:
dense). CVODES in CasADi gets it from CasADi and uses a sparse linear solver; all of its code is C. CVODE of
scikit-sundae, an optional package, calls the compiled derivatives of armblocks through Python. The error is
the largest relative error at the end. Its reference is `rodas5p` at rtol 1e-11, which agrees with Radau at
1e-10 to at least 8 digits. The time is the wall time of a run without compilation, minimum of the
repetitions.
"""

from __future__ import annotations

import argparse
import importlib.util
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import scipy.sparse
from scipy.integrate import solve_ivp

from armblocks.equations import SimulationOptions, Slot, TracedFunction, continuous_system, signature
from armblocks.integration.system import CompiledSystem, compile_system
from armblocks.simulation import simulate

RTOL = 1e-6


@dataclass(frozen=True, kw_only=True)
class Problem:
    """``y' = rates(y)`` with ``y(0) = start``, up to ``stop`` s. All solvers use ``atol`` and ``RTOL``."""

    name: str
    rates: Callable[[ca.SX], ca.SX]
    start: np.ndarray
    stop: float
    atol: float


def robertson(y: ca.SX) -> ca.SX:
    slow, fast, reverse = 0.04 * y[0], 3e7 * y[1] ** 2, 1e4 * y[1] * y[2]
    return ca.vertcat(reverse - slow, slow - reverse - fast, fast)


def van_der_pol(y: ca.SX) -> ca.SX:
    return ca.vertcat(y[1], 1000.0 * (1 - y[0] ** 2) * y[1] - y[0])


def brusselator(n: int) -> Problem:
    """Reaction and diffusion of two substances on a line of n points (Hairer, Wanner II, IV.10, (10.6'))."""
    place = np.arange(1, n + 1) / (n + 1)
    start = np.column_stack([1.0 + np.sin(2 * np.pi * place), np.full(n, 3.0)]).ravel()
    rate = 0.02 * (n + 1) ** 2

    def rates(y: ca.SX) -> ca.SX:
        u, v = y[0::2], y[1::2]
        diffusion = [
            rate * (ca.vertcat(edge, part[:-1]) - 2 * part + ca.vertcat(part[1:], edge))
            for part, edge in ((u, 1.0), (v, 3.0))
        ]
        du = 1.0 + u**2 * v - 4.0 * u + diffusion[0]
        dv = 3.0 * u - u**2 * v + diffusion[1]
        return ca.reshape(ca.horzcat(du, dv).T, 2 * n, 1)

    return Problem(name=f"Brusselator, {2 * n} states", rates=rates, start=start, stop=10.0, atol=1e-6)


PROBLEMS = (
    Problem(
        name="Robertson to 1e11 s", rates=robertson, start=np.array([1.0, 0.0, 0.0]), stop=1e11, atol=1e-14
    ),
    Problem(
        name="van der Pol, mu = 1000, to 2000 s",
        rates=van_der_pol,
        start=np.array([2.0, 0.0]),
        stop=2000.0,
        atol=1e-9,
    ),
    brusselator(100),
    brusselator(250),
)


def compiled(problem: Problem) -> CompiledSystem:
    n = problem.start.size
    arguments = signature(("t", ()), ("x", (n,)), ("p", (0,)))
    only_p = signature(("p", (0,)))
    trace = TracedFunction.trace
    system = continuous_system(
        name=problem.name,
        states=signature(Slot("problem/y", (n,))),
        parameters=signature(),
        signals_layout=signature(Slot("y", (n,))),
        parameter_values=np.empty(0),
        derivative=trace("derivative", arguments, signature(("xd", (n,))), lambda t, x, p: problem.rates(x)),
        signals=trace("signals", arguments, signature(("y", (n,))), lambda t, x, p: x),
        initial_states=trace(
            "initial_states", only_p, signature(("x0", (n,))), lambda p: ca.SX(ca.DM(problem.start))
        ),
        breakpoints=trace("breakpoints", only_p, signature(("times", (0,))), lambda p: ca.SX(0, 1)),
        aliases={},
    )
    return compile_system(system)


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Result of one solver on one problem. ``seconds`` is the minimum of the repetitions."""

    solver: str
    steps: int
    seconds: float
    error: float


Solve = Callable[[], tuple[np.ndarray, int]]
"""Function that returns the final state and the number of steps, −1 if unknown."""


def armblocks_solver(system: CompiledSystem, problem: Problem, solver: str, rtol: float = RTOL) -> Solve:
    options = SimulationOptions(
        stop_time=problem.stop,
        sample_time=problem.stop,
        solver=solver,
        rtol=rtol,
        atol=problem.atol * rtol / RTOL,
    )

    def solve() -> tuple[np.ndarray, int]:
        result = simulate(system, options)
        return result["y"][-1], result.run.steps

    return solve


def python_functions(problem: Problem) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Derivatives and Jacobian as Python functions, evaluated by CasADi's virtual machine."""
    y = ca.SX.sym("y", problem.start.size)
    rates = problem.rates(y)
    f, J = ca.Function("f", [y], [rates]), ca.Function("J", [y], [ca.jacobian(rates, y)])
    small = problem.start.size < 20

    def jacobian(t: float, y: np.ndarray) -> Any:
        return np.asarray(J(y)) if small else scipy.sparse.csc_matrix(J(y).sparse())

    return lambda t, y: np.asarray(f(y)).ravel(), jacobian


def scipy_solver(problem: Problem, method: str) -> Solve:
    f, J = python_functions(problem)
    options = {"jac": J}
    if method == "LSODA" and problem.start.size >= 20:
        dense = lambda t, y: J(t, y).toarray()  # noqa: E731
        options = {"jac": dense}

    def solve() -> tuple[np.ndarray, int]:
        span = (0.0, problem.stop)
        solution = solve_ivp(f, span, problem.start, method=method, rtol=RTOL, atol=problem.atol, **options)
        return solution.y[:, -1], solution.t.size - 1

    return solve


def casadi_solver(problem: Problem) -> Solve:
    y = ca.SX.sym("y", problem.start.size)
    options = {"reltol": RTOL, "abstol": problem.atol, "max_num_steps": 1_000_000}
    cvodes = ca.integrator("F", "cvodes", {"x": y, "ode": problem.rates(y)}, 0.0, problem.stop, options)

    def solve() -> tuple[np.ndarray, int]:
        end = np.asarray(cvodes(x0=problem.start)["xf"]).ravel()
        return end, int(cvodes.stats()["nsteps"])

    return solve


def sundae_solver(system: CompiledSystem, problem: Problem) -> Solve | None:
    if importlib.util.find_spec("sksundae") is None:
        return None
    from sksundae.cvode import CVODE

    empty = np.empty(0)
    _, J = python_functions(problem)

    def rates(t: float, y: np.ndarray, yp: np.ndarray) -> None:
        yp[:] = system.derivative(t, y, empty, empty, empty)

    def jacobian(t: float, y: np.ndarray, yp: np.ndarray, JJ: np.ndarray) -> None:
        JJ[:] = J(t, y)

    options: dict[str, Any] = {"rtol": RTOL, "atol": problem.atol, "max_num_steps": 1_000_000}
    if problem.start.size < 20:
        options["jacfn"] = jacobian
    else:
        options |= {"linsolver": "band", "lband": 2, "uband": 2}
    solver = CVODE(rates, **options)

    def solve() -> tuple[np.ndarray, int]:
        solution = solver.solve(np.array([0.0, problem.stop]), problem.start)
        return solution.y[-1], -1

    return solve


def outcomes(problem: Problem, repeats: int) -> list[Outcome]:
    """Run all solvers on one problem, in alternation."""
    system = compiled(problem)
    reference, _ = armblocks_solver(system, problem, "rodas5p", 1e-11)()
    solvers: dict[str, Solve | None] = {
        "armblocks rodas5p": armblocks_solver(system, problem, "rodas5p"),
        "armblocks auto": armblocks_solver(system, problem, "auto"),
        "CVODES in CasADi": casadi_solver(problem),
        "CVODE, scikit-sundae": sundae_solver(system, problem),
        "SciPy Radau": scipy_solver(problem, "Radau"),
        "SciPy BDF": scipy_solver(problem, "BDF"),
        "SciPy LSODA": scipy_solver(problem, "LSODA"),
    }
    present = {name: solve for name, solve in solvers.items() if solve is not None}
    best = dict.fromkeys(present, float("inf"))
    results: dict[str, tuple[np.ndarray, int]] = {}
    for turn in range(repeats + 1):
        for name, solve in present.items():
            if turn > 2 and best[name] > 0.5:
                continue  # the solver is too slow for more repetitions
            started = time.perf_counter()
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                results[name] = solve()
            if turn:  # the first run includes compilation
                best[name] = min(best[name], time.perf_counter() - started)
    scale = problem.atol / RTOL + np.abs(reference)
    return [
        Outcome(
            solver=name,
            steps=steps,
            seconds=best[name],
            error=float(np.max(np.abs(end - reference) / scale)),
        )
        for name, (end, steps) in results.items()
    ]


def stiff_section(repeats: int) -> list[str]:
    """Return the section of the stiff problems as lines of Markdown."""
    lines = ["## Stiff systems", "", f"At rtol {RTOL:g}.", ""]
    lines += [
        "| problem | solver | steps | error | time | relative to rodas5p |",
        "|---|---|---|---|---|---|",
    ]
    for problem in PROBLEMS:
        outcomes_of_problem = outcomes(problem, repeats)
        for row in outcomes_of_problem:
            steps = f"{row.steps:,}" if row.steps >= 0 else ""
            ratio = row.seconds / outcomes_of_problem[0].seconds
            cells = (problem.name, row.solver, steps, f"{row.error:.1e}", f"{row.seconds * 1e3:,.3f} ms")
            lines.append("| " + " | ".join((*cells, f"{ratio:,.1f} x")) + " |")
    return [*lines, "", *(__doc__ or "").strip().splitlines()[4:]]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="three repetitions instead of fifteen")
    print("\n".join(stiff_section(3 if parser.parse_args().quick else 15)))
