"""Matrix blocks compared with NumPy's linear algebra."""

from __future__ import annotations

import numpy as np
import pytest
from block_evaluation import evaluate

from armblocks.blocks import (
    CrossProduct,
    Determinant,
    DiagonalMatrix,
    ExtractDiagonal,
    LinearSolve,
    MatrixConcatenate,
    MatrixInverse,
    MatrixPower,
    Reshape,
    Trace,
    Transpose,
)
from armblocks.errors import DiagramError

RANDOM = np.random.default_rng(21)


@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_solutions_of_linear_equations_agree_with_numpy(n: int) -> None:
    A, B = RANDOM.normal(size=(n, n)), RANDOM.normal(size=(n, 2))
    # errors grow with the condition number of A, which is moderate here
    assert evaluate(LinearSolve(), A, B)["y"] == pytest.approx(np.linalg.solve(A, B), rel=1e-11)
    assert evaluate(LinearSolve(), A, B[:, 0])["y"] == pytest.approx(np.linalg.solve(A, B[:, 0]), rel=1e-11)
    assert evaluate(MatrixInverse(), A)["y"] == pytest.approx(np.linalg.inv(A), rel=1e-11)
    assert evaluate(Determinant(), A)["y"] == pytest.approx(np.linalg.det(A), rel=1e-12)


def test_pivots_are_chosen_by_magnitude() -> None:
    A = np.array([[0.0, 2.0, 0.0], [0.0, 0.0, 4.0], [8.0, 0.0, 0.0]])
    assert evaluate(MatrixInverse(), A)["y"].tolist() == np.linalg.inv(A).tolist()
    assert evaluate(Determinant(), A)["y"] == 64.0
    small = [[1e-20, 1.0], [1.0, 1.0]]  # without row exchanges the result would be (0, 1)
    assert evaluate(LinearSolve(), small, [1.0, 2.0])["y"] == pytest.approx([1.0, 1.0], rel=1e-15)


def test_a_singular_matrix_has_the_determinant_0_and_no_finite_inverse() -> None:
    singular = [[1.0, 2.0, 3.0], [2.0, 4.0, 6.0], [1.0, 0.0, 1.0]]
    assert evaluate(Determinant(), singular)["y"] == 0.0
    assert evaluate(Determinant(), np.zeros((3, 3)))["y"] == 0.0
    assert not np.isfinite(evaluate(MatrixInverse(), singular)["y"]).any()


@pytest.mark.parametrize("exponent", [-3, -1, 0, 1, 2, 5, 12])
def test_matrix_powers_agree_with_numpy(exponent: int) -> None:
    A = RANDOM.normal(size=(3, 3)) + 2 * np.eye(3)
    expected = np.linalg.matrix_power(A, exponent)
    assert evaluate(MatrixPower(exponent=exponent), A)["y"] == pytest.approx(expected, rel=1e-10, abs=1e-12)


def test_transposes_reshapes_diagonals_and_products_agree_with_numpy() -> None:
    A = RANDOM.normal(size=(2, 3))
    assert np.array_equal(evaluate(Transpose(), A)["y"], A.T)
    assert evaluate(Transpose(), [1.0, 2.0])["y"].tolist() == [[1, 2]]
    assert np.array_equal(evaluate(Reshape(), A)["y"], A.ravel(order="F"))
    assert np.array_equal(evaluate(Reshape(output="matrix", rows=3), A)["y"], A.reshape(3, 2, order="F"))
    assert evaluate(Reshape(output="row"), A)["y"].shape == (1, 6)
    assert evaluate(Reshape(output="column"), A)["y"].shape == (6, 1)
    assert evaluate(DiagonalMatrix(), [1.0, 2.0])["y"].tolist() == [[1, 0], [0, 2]]
    S = RANDOM.normal(size=(3, 3))
    assert np.array_equal(evaluate(ExtractDiagonal(), S)["y"], np.diag(S))
    assert evaluate(Trace(), S)["y"] == pytest.approx(np.trace(S), rel=1e-15)
    u, v = RANDOM.normal(size=(2, 3))
    assert evaluate(CrossProduct(), u, v)["y"] == pytest.approx(np.cross(u, v), rel=1e-13)


def test_matrices_are_concatenated() -> None:
    A, B = RANDOM.normal(size=(2, 3)), RANDOM.normal(size=(2, 1))
    assert np.array_equal(evaluate(MatrixConcatenate(), A, B)["y"], np.hstack([A, B]))
    vertical = MatrixConcatenate(direction="vertical")
    assert np.array_equal(evaluate(vertical, A, A + 1)["y"], np.vstack([A, A + 1]))
    assert evaluate(MatrixConcatenate(), [1.0, 2.0], [3.0, 4.0])["y"].tolist() == [[1, 3], [2, 4]]
    assert evaluate(vertical, [1.0, 2.0], 3.0)["y"].tolist() == [1, 2, 3]


def test_matrices_of_unsuitable_shape_are_refused() -> None:
    A = np.ones((2, 3))
    with pytest.raises(DiagramError, match=r"the matrix has shape \(2, 3\).*Allowed: a square matrix"):
        evaluate(MatrixInverse(), A)
    with pytest.raises(DiagramError, match=r"the matrix has shape \(2, 2\) and the right-hand side \(3,\)"):
        evaluate(LinearSolve(), np.eye(2), [1.0, 2.0, 3.0])
    with pytest.raises(DiagramError, match=r"6 elements cannot form a matrix with 4 rows"):
        evaluate(Reshape(output="matrix", rows=4), A)
    with pytest.raises(DiagramError, match=r"the parts have shapes \(2, 3\), \(3, 3\)"):
        evaluate(MatrixConcatenate(), A, np.ones((3, 3)))
    with pytest.raises(DiagramError, match=r"the diagonal 'u' has shape \(2, 3\)"):
        evaluate(DiagonalMatrix(), A)
