"""Minimisation with derivatives: the interior-point method Ipopt, through CasADi.

Source: A. Waechter, L. T. Biegler, Mathematical Programming 106, 2006, 25-57. The second derivatives are
approximated from the gradients (limited-memory BFGS).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from casadi import DM, MX, Callback, Sparsity, nlpsol, nlpsol_n_out, nlpsol_out
from numpy.typing import NDArray

from armblocks import interrupts
from armblocks.optimisation.program import NonlinearProgram, Solution

Array = NDArray[np.float64]

TOLERANCE = 1e-6
"""Tolerance of the optimality conditions after Ipopt's scaling of the functions."""
EQUATION_SLACK = 1e-8
"""Relative tolerance of equations if there are more equations than unknowns."""
_MESSAGES: Mapping[str, tuple[str, bool]] = {
    "Solve_Succeeded": ("converged", True),
    "Solved_To_Acceptable_Level": ("converged with a reduced tolerance", True),
    "Infeasible_Problem_Detected": ("no point near the last one satisfies the constraints", False),
    "Search_Direction_Becomes_Too_Small": ("the steps have become too small", False),
    "Diverging_Iterates": ("the variables grow without limit", False),
    "User_Requested_Stop": ("stopped", False),
    "Maximum_Iterations_Exceeded": ("the number of iterations is reached", False),
    "Restoration_Failed": ("no step reduces the violation of the constraints", False),
    "Invalid_Number_Detected": ("the runs near the last point have no values", False),
}
_MOST_ITERATIONS = 500


def minimise(
    program: NonlinearProgram,
    start: Array,
    stop: Callable[[], str] = lambda: "",
    tolerance: float = TOLERANCE,
) -> Solution:
    """A local minimum from ``start (n,)``. ``stop`` is called in each iteration; a text ends the search.

    Errors of the functions end the search and are raised again. After Ctrl-C ``KeyboardInterrupt`` is raised.
    """
    calls = _Calls(program, stop)
    n, m = program.lower.size, program.row_lower.size
    row_lower, row_upper = _row_limits(program)
    functions = _Functions(calls, n, m)
    iteration = _Iteration(calls, n, m)
    z = MX.sym("z", n)
    f, g = functions(z)
    options: dict[str, Any] = {
        "ipopt": {
            "hessian_approximation": "limited-memory",
            "tol": tolerance,
            "constr_viol_tol": min(1e-4, 0.5 * tolerance * _least_size(program)),
            "acceptable_tol": 100.0 * tolerance,
            "acceptable_iter": 8,
            "max_iter": _MOST_ITERATIONS,
            "bound_relax_factor": 0.0,
            "print_level": 0,
            "sb": "yes",
        },
        "print_time": False,
        "show_eval_warnings": False,
        "no_nlp_grad": True,
        "error_on_fail": False,
        "iteration_callback": iteration,
    }
    solver = nlpsol("solver", "ipopt", {"x": z, "f": f, "g": g}, options)
    try:
        result = solver(x0=start, lbx=program.lower, ubx=program.upper, lbg=row_lower, ubg=row_upper)
    except Exception:
        # CasADi replaces an exception of the functions by its own.
        if calls.error is None:
            raise
        raise calls.error from None
    if calls.error is not None:
        raise calls.error
    interrupts.check()
    statistics = solver.stats()
    status = str(statistics["return_status"])
    message, converged = _MESSAGES.get(status, (status.replace("_", " ").lower(), False))
    return Solution(
        point=np.asarray(result["x"], dtype=np.float64).ravel(),
        row_multipliers=np.asarray(result["lam_g"], dtype=np.float64).ravel(),
        bound_multipliers=np.asarray(result["lam_x"], dtype=np.float64).ravel(),
        iterations=int(statistics["iter_count"]),
        message=calls.reason or message,
        converged=converged,
    )


def _least_size(program: NonlinearProgram) -> float:
    """The least size ``1 + |limit|`` of the rows, to which their violation is relative."""
    limits = np.abs(np.concatenate([program.row_lower, program.row_upper]))
    return 1.0 + float(limits[np.isfinite(limits)].min(initial=np.inf))


def _row_limits(program: NonlinearProgram) -> tuple[Array, Array]:
    """The limits of the rows. Ipopt refuses more equations than unknowns, although they may agree with one
    another: such equations become pairs of limits that differ by less than the tolerance."""
    low, high = program.row_lower, program.row_upper
    equal = low == high
    if int(equal.sum()) <= int((program.lower < program.upper).sum()):
        return low, high
    slack = np.where(equal, EQUATION_SLACK * (1.0 + np.abs(np.where(equal, low, 0.0))), 0.0)
    return low - slack, high + slack


class _Calls:
    """The functions of a program; each point is evaluated once. Stores the first error."""

    def __init__(self, program: NonlinearProgram, stop: Callable[[], str]) -> None:
        self._program, self._stop = program, stop
        self.error: BaseException | None = None
        self.reason = ""
        self._values: tuple[bytes, tuple[float, Array]] | None = None
        self._derivatives: tuple[bytes, tuple[Array, Array]] | None = None

    def values(self, z: Array) -> tuple[float, Array]:
        key = z.tobytes()
        if self._values is None or self._values[0] != key:
            found = self._attempt(self._program.values, z)
            rows = self._program.row_lower.size
            self._values = key, found or (np.nan, np.full(rows, np.nan))
        return self._values[1]

    def derivatives(self, z: Array) -> tuple[Array, Array]:
        key = z.tobytes()
        if self._derivatives is None or self._derivatives[0] != key:
            found = self._attempt(self._program.derivatives, z)
            rows = self._program.row_lower.size
            self._derivatives = key, found or (np.full(z.size, np.nan), np.full((rows, z.size), np.nan))
        return self._derivatives[1]

    def _attempt(self, function: Callable[[Array], Any], z: Array) -> Any:
        if self.error is not None:
            return None
        try:
            return function(z.copy())
        except BaseException as error:  # raised again after the search
            self.error = error
            return None

    def stops(self) -> bool:
        if self.error is None and not self.reason:
            try:
                self.reason = self._stop()
            except BaseException as error:  # raised again after the search
                self.error = error
        return self.error is not None or bool(self.reason)


class _Functions(Callback):
    """``f`` and ``g`` for CasADi."""

    def __init__(self, calls: _Calls, n: int, m: int) -> None:
        Callback.__init__(self)
        self._calls, self._n, self._m = calls, n, m
        self._jacobian = _Jacobians(calls, n, m)
        self.construct("functions", {})

    def get_n_in(self) -> int:
        return 1

    def get_n_out(self) -> int:
        return 2

    def get_sparsity_in(self, index: int) -> Any:
        return Sparsity.dense(self._n, 1)

    def get_sparsity_out(self, index: int) -> Any:
        return Sparsity.dense(1 if index == 0 else self._m, 1)

    def has_jacobian(self) -> bool:
        return True

    def get_jacobian(self, name: str, inputs: object, outputs: object, options: object) -> Any:
        return self._jacobian

    def eval(self, arguments: Any) -> list[Any]:
        f, g = self._calls.values(np.asarray(arguments[0], dtype=np.float64).ravel())
        return [f, DM(g)]


class _Jacobians(Callback):
    """The derivatives of ``f`` and ``g`` for CasADi."""

    def __init__(self, calls: _Calls, n: int, m: int) -> None:
        Callback.__init__(self)
        self._calls, self._n, self._m = calls, n, m
        self.construct("jacobians", {})

    def get_n_in(self) -> int:
        return 3

    def get_n_out(self) -> int:
        return 2

    def get_sparsity_in(self, index: int) -> Any:
        return Sparsity.dense((self._n, 1, self._m)[index], 1)

    def get_sparsity_out(self, index: int) -> Any:
        return Sparsity.dense(1 if index == 0 else self._m, self._n)

    def eval(self, arguments: Any) -> list[Any]:
        gradient, jacobian = self._calls.derivatives(np.asarray(arguments[0], dtype=np.float64).ravel())
        return [DM(gradient).T, DM(jacobian)]


class _Iteration(Callback):
    """Called by the solver in each iteration; returns 1 to end the search."""

    def __init__(self, calls: _Calls, n: int, m: int) -> None:
        Callback.__init__(self)
        self._calls, self._n, self._m = calls, n, m
        self.construct("iteration", {})

    def get_n_in(self) -> int:
        return int(nlpsol_n_out())

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, index: int) -> Any:
        name = str(nlpsol_out(index))
        if name == "f":
            return Sparsity.scalar()
        if name in ("x", "lam_x"):
            return Sparsity.dense(self._n)
        return Sparsity.dense(self._m) if name in ("g", "lam_g") else Sparsity(0, 0)

    def eval(self, arguments: Any) -> list[Any]:
        return [int(self._calls.stops())]
