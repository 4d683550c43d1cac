"""Linear equations with symbols: Gaussian elimination with pivots that are chosen at run time.

Every row exchange is a conditional expression in the traced equations, so that the result is as accurate as
the result of a numerical library for every value of the signals. The elimination takes about n^3 operations
for an (n, n) matrix. It suits the sizes of arms and controllers, not hundreds of unknowns.
"""

from __future__ import annotations

from casadi import SX, fabs, horzcat, if_else, vertcat


def solve(A: SX, B: SX) -> SX:
    """X (n, k) with A X = B, for A (n, n) and B (n, k); not finite if A is singular."""
    n = A.shape[0]
    rows, _ = _triangular(horzcat(A, B))
    solution: list[SX] = [SX(0, 0)] * n
    for i in reversed(range(n)):
        right = rows[i][:, n:]
        for j in range(i + 1, n):
            right = right - rows[i][j] * solution[j]
        solution[i] = right / rows[i][i]
    return vertcat(*solution)


def determinant(A: SX) -> SX:
    """The determinant of A (n, n) from its triangular form; exactly 0 where all pivot candidates are 0."""
    n = A.shape[0]
    rows, sign = _triangular(A)
    product = sign
    for i in range(n):
        product = product * rows[i][i]
    # The rows below a zero pivot are not finite; the determinant is then zero.
    for i in range(n - 1):
        product = if_else(rows[i][i] == 0.0, 0.0, product)
    return product


def _triangular(A: SX) -> tuple[list[SX], SX]:
    """Rows of the upper triangular form, and the sign of the row permutation."""
    n = A.shape[0]
    rows = [A[i, :] for i in range(n)]
    sign = SX(1.0)
    for k in range(n):
        for i in range(k + 1, n):
            greater = fabs(rows[i][k]) > fabs(rows[k][k])
            rows[k], rows[i] = if_else(greater, rows[i], rows[k]), if_else(greater, rows[k], rows[i])
            sign = if_else(greater, -sign, sign)
        for i in range(k + 1, n):
            rows[i] = rows[i] - (rows[i][k] / rows[k][k]) * rows[k]
    return rows, sign
