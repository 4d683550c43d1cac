"""Native linear equations of a stiff step compared with NumPy: sparse, and dense with pivoting."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

from armblocks.compiler.native import load_code
from armblocks.integration.elimination_plan import JacobianPattern
from armblocks.integration.linear_equations import LinearEquations, LinearEquationsLayout
from armblocks.routines.llvm import definitions
from armblocks.routines.memory import Reals
from armblocks.routines.routine import Program, Routine
from armblocks.routines.values import Integer, Real

GAMMA, H = 0.25, 0.1


class Solver:
    """The native functions of one sparsity pattern."""

    def __init__(self, J: np.ndarray, states: int) -> None:
        rows, columns = np.nonzero(J)
        pattern = JacobianPattern(
            states=states, size=len(J), rows=tuple(rows.tolist()), columns=tuple(columns.tolist())
        )
        self.layout = LinearEquationsLayout(pattern)
        program = Program()
        equations = LinearEquations(program, self.layout, GAMMA)

        def sparse(r: Routine, scratch: Reals, h: Real) -> Integer:
            r.call(equations.factor, scratch, h)
            r.call(equations.solve, scratch)
            check = equations.is_accurate
            return r.call(check, scratch, h).count() if check else r.integer(1).value

        def dense(r: Routine, scratch: Reals, h: Real) -> Integer:
            r.call(equations.factor_dense, scratch, h)
            r.call(equations.solve, scratch)
            check = equations.is_accurate
            return r.call(check, scratch, h).count() if check else r.integer(1).value

        def rate(r: Routine, scratch: Reals) -> Real:
            return r.call(equations.rate_bound, scratch)

        for function in (sparse, dense, rate):
            program.define(function, public=True)
        text = "\n\n".join(definitions(program).values())
        self.code = load_code(("linear equations test", text), lambda: text)
        kind = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_double)
        self.functions = {name: kind(self.code.address(name)) for name in ("sparse", "dense")}
        self.rate = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_void_p)(self.code.address("rate"))
        self.scratch = np.empty(self.layout.length)
        self.scratch[: len(rows)] = J[rows, columns]
        E = np.zeros(len(J))
        E[:states] = 1.0 / GAMMA
        self.matrix = np.diag(E) - H * J

    def solve(self, method: str, right: np.ndarray) -> tuple[bool, np.ndarray]:
        """Return whether the solution passes the accuracy check, and the solution."""
        layout = self.layout
        self.scratch[layout.right : layout.right + layout.size] = right
        accurate = self.functions[method](self.scratch.ctypes.data, H)
        return bool(accurate), self.scratch[layout.solution : layout.solution + layout.size].copy()


def random_sparse(seed: int, n: int, filled: float) -> np.ndarray:
    random = np.random.default_rng(seed)
    return np.where(random.random((n, n)) < filled, random.normal(size=(n, n)), 0.0)


@pytest.mark.parametrize(("n", "filled"), [(1, 1.0), (5, 0.5), (12, 0.9), (60, 0.05)])
def test_both_eliminations_agree_with_numpy(n: int, filled: float) -> None:
    solver = Solver(random_sparse(n, n, filled) + np.eye(n), n)
    right = np.random.default_rng(0).normal(size=n)
    for method in ("sparse", "dense"):
        accurate, x = solver.solve(method, right)
        assert accurate
        np.testing.assert_allclose(x, np.linalg.solve(solver.matrix, right), rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("n", [2, 7, 40])
@pytest.mark.parametrize("spread", [0.0, 3.0])
def test_the_rate_bound_is_above_every_eigenvalue_and_near_the_largest(n: int, spread: float) -> None:
    """Eigenvalues do not depend on the units of the states, which differ here by many powers of ten."""
    random = np.random.default_rng(n)
    for _ in range(10):
        scales = 10.0 ** random.uniform(-spread, spread, n)
        J = random_sparse(int(random.integers(1000)), n, 0.3) * scales[:, None] / scales[None, :]
        J[0, 1] = J[0, 1] or scales[0] / scales[1]
        solver = Solver(J, n)
        bound = solver.rate(solver.scratch.ctypes.data)
        assert bound >= np.abs(np.linalg.eigvals(J)).max() * (1 - 1e-12)
        # The least bound over all scalings of the states is the largest eigenvalue of |J|.
        assert bound <= 40.0 * max(np.abs(np.linalg.eigvals(np.abs(J))).max(), 0.1)
    oscillator = Solver(np.array([[0.0, 1.0], [-100.0, 0.0]]), 2)
    assert oscillator.rate(oscillator.scratch.ctypes.data) == pytest.approx(10.0)


def test_small_and_full_matrices_have_no_plan() -> None:
    assert Solver(random_sparse(1, 8, 0.2), 8).layout.plan is None
    assert Solver(np.ones((20, 20)), 20).layout.plan is None
    assert Solver(np.eye(20), 20).layout.plan is not None


def test_a_vanishing_pivot_is_detected_and_pivoting_solves_the_equations() -> None:
    """A chain in which every fourth pivot ``1 / gamma - h J`` is as small as the rounding errors of its
    terms."""
    n = 40
    J = np.diag(np.full(n - 1, 1.0), 1) + np.diag(np.full(n - 1, -2.0), -1) + np.diag(np.full(n, -1.0))
    for k in range(0, n, 4):
        J[k, k] = (1.0 / GAMMA - 1e-17) / H
    solver = Solver(J, n)
    right = np.random.default_rng(3).normal(size=n)
    expected = np.linalg.solve(solver.matrix, right)
    accurate, _ = solver.solve("sparse", right)
    assert not accurate
    accurate, x = solver.solve("dense", right)
    assert accurate
    np.testing.assert_allclose(x, expected, rtol=1e-9, atol=1e-12)


def test_the_accuracy_check_does_not_depend_on_units() -> None:
    """States with units from 1e-12 to 1e12: the same elimination with the same accuracy."""
    n = 30
    J = random_sparse(7, n, 0.06) - np.eye(n)
    units = 10.0 ** np.random.default_rng(1).integers(-12, 13, n)
    right = np.random.default_rng(2).normal(size=n)
    accurate, plain = Solver(J, n).solve("sparse", right)
    assert accurate
    accurate, scaled = Solver(J * units[:, np.newaxis] / units, n).solve("sparse", right * units)
    assert accurate
    np.testing.assert_allclose(scaled / units, plain, rtol=1e-9, atol=1e-11)


def test_implicit_equations_are_eliminated_with_the_states() -> None:
    """Their diagonal entries are zero: each equation is matched with the unknown of another one."""
    n, m = 20, 4
    J = random_sparse(5, n + m, 0.1)
    J[n:, n:] = np.roll(np.diag([1.0, 2.0, 3.0, 4.0]), 1, axis=0)
    solver = Solver(J, n)
    assert solver.layout.plan is not None
    right = np.random.default_rng(4).normal(size=n + m)
    accurate, x = solver.solve("sparse", right)
    assert accurate
    np.testing.assert_allclose(x, np.linalg.solve(solver.matrix, right), rtol=1e-9)
