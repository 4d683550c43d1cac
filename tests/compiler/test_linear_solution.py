"""Linear equations on the tape: accuracy, equal bits in every lane, and exact derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from casadi import SX, jacobian, jtimes, reshape, vertcat

from armblocks.compiler import compile_function
from armblocks.compiler.interpret import interpret
from armblocks.compiler.tape import Tape
from armblocks.equations import Signature, Slot, TracedFunction
from armblocks.equations.linear_solution import linear_solution

EPS = np.finfo(np.float64).eps


def solver(n: int) -> TracedFunction:
    ends = Signature((Slot("A", (n, n)), Slot("b", (n,)))), Signature((Slot("x", (n,)),))
    return TracedFunction.trace("solver", *ends, lambda A, b: [linear_solution(A, b)])


def matrices(n: int, random: np.random.Generator) -> list[np.ndarray]:
    """Well-conditioned matrices, matrices with zero pivots, badly scaled ones, and nearly singular ones."""
    dense = random.normal(size=(n, n))
    triangle = np.triu(dense) + 3.0 * np.eye(n)
    scales = 10.0 ** random.uniform(-9.0, 9.0, (2, n))
    hilbert = 1.0 / (np.add.outer(np.arange(n), np.arange(n)) + 1.0)
    permuted = triangle[random.permutation(n)][:, random.permutation(n)]
    return [
        dense,
        permuted,
        scales[0][:, None] * permuted * scales[1],
        hilbert,
        hilbert[random.permutation(n)],
    ]


@pytest.mark.parametrize("n", (1, 2, 3, 4, 5, 7, 8, 9, 12))
def test_solutions_are_as_accurate_as_the_matrix_allows_in_every_lane(n: int) -> None:
    random = np.random.default_rng(n)
    A = np.array([matrix for _ in range(7) for matrix in matrices(n, random)])
    exact = random.normal(size=(len(A), n))
    b = np.einsum("kij,kj->ki", A, exact)
    kernel = compile_function(solver(n))
    x = kernel(A, b)
    for matrix, right, solution in zip(A, b, x):
        # Skeel's condition number is invariant under row scaling, and elementwise under column scaling.
        known = np.linalg.solve(matrix, right) if np.linalg.cond(matrix) < 1e6 else solution
        inverse = np.abs(np.linalg.inv(matrix)) if np.linalg.cond(matrix) < 1e15 else None
        if inverse is not None:
            bound = inverse @ (np.abs(matrix) @ np.abs(solution))
            assert (np.abs(solution - known) <= 20.0 * n * EPS * bound).all()
        # The residual of every equation is a rounding error relative to its terms.
        left = np.abs(matrix @ solution - right)
        assert (left <= 8.0 * n * EPS * (np.abs(matrix) @ np.abs(solution) + np.abs(right))).all()
    single = np.array([kernel(matrix, right) for matrix, right in zip(A, b)])
    np.testing.assert_array_equal(single, x)
    np.testing.assert_array_equal(kernel.columns(A, b).T, x)
    np.testing.assert_array_equal(interpret(kernel.tape, [A.reshape(len(A), -1), b])[0], x)
    assert Tape.from_bytes(kernel.tape.to_bytes()) == kernel.tape


def test_300_equations_are_solved_in_lanes_with_a_work_space_beyond_the_stack() -> None:
    """300 unknowns in eight lanes need 12 MB of work space, more than the stack of a thread."""
    n = 300
    random = np.random.default_rng(2)
    A, exact = random.normal(size=(9, n, n)), random.normal(size=(9, n))
    b = np.einsum("kij,kj->ki", A, exact)
    kernel = compile_function(solver(n))
    x = kernel(A, b)
    np.testing.assert_allclose(x, exact, rtol=0.0, atol=1e-9)
    np.testing.assert_array_equal(kernel(A[4], b[4]), x[4])
    np.testing.assert_array_equal(kernel.columns(A, b)[:, 4], x[4])


def test_a_singular_matrix_gives_values_that_are_not_finite() -> None:
    kernel = compile_function(solver(3))
    for matrix in (np.zeros((3, 3)), np.ones((3, 3)), np.full((3, 3), np.nan)):
        assert not np.isfinite(kernel(matrix, [1.0, 2.0, 3.0])).all()
        assert not np.isfinite(solver(3)(matrix, [1.0, 2.0, 3.0])).all()


def test_first_and_second_derivatives_agree_with_closed_forms() -> None:
    """x = A^-1 b with A = A0 + s A1: x' = -A^-1 A1 x, x'' = 2 A^-1 A1 A^-1 A1 x, dx/db = A^-1."""
    n, random = 4, np.random.default_rng(3)
    A0, A1, b0 = random.normal(size=(n, n)), random.normal(size=(n, n)), random.normal(size=n)

    def equations(s: SX, b: SX) -> list[SX]:
        x = linear_solution(SX(A0) + s * SX(A1), b)
        first = jtimes(x, s, SX(1.0))
        backwards = jtimes(x, vertcat(s, b), SX(np.arange(1.0, n + 1.0)), True)
        return [x, first, jtimes(first, s, SX(1.0)), reshape(jacobian(x, b).T, -1, 1), backwards]

    outputs = Signature(
        tuple(Slot(name, (size,)) for name, size in zip("uvwxy", (n, n, n, n * n, n + 1), strict=True))
    )
    function = TracedFunction.trace("f", Signature((Slot("s", ()), Slot("b", (n,)))), outputs, equations)
    inverse = np.linalg.inv(A0 + 0.3 * A1)
    x = inverse @ b0
    first = -inverse @ A1 @ x
    second = 2.0 * inverse @ A1 @ inverse @ A1 @ x
    weights = np.arange(1.0, n + 1.0)
    backwards = np.concatenate([[weights @ first], weights @ inverse])
    for evaluate in (compile_function(function), function):
        for actual, expected in zip(evaluate(0.3, b0), (x, first, second, inverse.ravel(), backwards)):
            np.testing.assert_allclose(actual, expected, rtol=1e-12, atol=1e-12)
