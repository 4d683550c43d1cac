"""A damped least-squares step in each lane, ``dq = J' (J J' + l I)^-1 e``, with an active set of joints at
limits.

The damping is proportional to the squared error, ``l = k E`` (Chan and Lawrence, *General inverse kinematics
with the error damped pseudoinverse*, ICRA 1988; Sugihara, *Solvability-unconcerned inverse kinematics by the
Levenberg-Marquardt method*, IEEE Trans. Robotics 27, 2011). Steps are bounded at singular configurations, and
near a regular solution the convergence is quadratic. A joint at a limit that the step would exceed is
excluded from the step (active set).
"""

from __future__ import annotations

from collections.abc import Sequence

from armblocks.inverse_kinematics.layout import ROWS
from armblocks.routines.arithmetic import fma
from armblocks.routines.lanes import Lanes
from armblocks.routines.routine import Routine

MIN_DAMPING = 1e-13
"""Damping of small errors, which keeps the pivots positive at singular configurations."""

MAX_DAMPING = 0.3
"""Damping of errors that are large compared with the arm. Translations without limits have such errors."""

Matrix = Sequence[Sequence[Lanes]]
"""Rows of the Jacobian."""


def damped_step(r: Routine, J: Matrix, e: Sequence[Lanes], damping: Lanes) -> list[Lanes]:
    """``dq`` for weighted rows ``J`` and errors ``e``; columns of joints in the active set are zero.

    If J has fewer columns than rows, the equivalent form ``(J' J + l I)^-1 J' e`` has the smaller system.
    """
    n = len(J[0])
    columns = [[J[k][i] for k in range(ROWS)] for i in range(n)]
    if n >= ROWS:
        gram = [[_dot(r, J[i], J[j]) for j in range(i + 1)] for i in range(ROWS)]
        y = _solution(gram, list(e), damping)
        return [_dot(r, column, y) for column in columns]
    gram = [[_dot(r, columns[i], columns[j]) for j in range(i + 1)] for i in range(n)]
    return _solution(gram, [_dot(r, column, e) for column in columns], damping)


def _solution(lower: list[list[Lanes]], y: list[Lanes], damping: Lanes) -> list[Lanes]:
    """The solution of ``(A + l I) x = y`` by the factors ``L D L'`` of a positive definite matrix.

    Source: Golub, Van Loan, *Matrix Computations*, 4th ed., 4.1.2.
    """
    n = len(y)
    reciprocals: list[Lanes] = []
    scaled: list[list[Lanes]] = [[] for _ in range(n)]  # L D
    factor: list[list[Lanes]] = [[] for _ in range(n)]
    for i in range(n):
        for j in range(i):
            value = lower[i][j]
            for k in range(j):
                value = fma(-scaled[i][k], factor[j][k], value)
            scaled[i].append(value)
            factor[i].append(value * reciprocals[j])
        pivot = lower[i][i] + damping
        for k in range(i):
            pivot = fma(-scaled[i][k], factor[i][k], pivot)
        reciprocals.append(1.0 / pivot)
    for i in range(n):
        for k in range(i):
            y[i] = fma(-factor[i][k], y[k], y[i])
    y = [value * reciprocal for value, reciprocal in zip(y, reciprocals)]
    for i in reversed(range(n)):
        for k in range(i + 1, n):
            y[i] = fma(-factor[k][i], y[k], y[i])
    return y


def _dot(r: Routine, a: Sequence[Lanes], b: Sequence[Lanes]) -> Lanes:
    total = a[0] * b[0]
    for x, y in zip(a[1:], b[1:]):
        total = fma(x, y, total)
    return total
