"""Linear equations inside traced expressions: one operation with pivoting at run time.

``linear_solution(A, b)`` is a call of a CasADi function with a fixed name inside scalar expressions. CasADi
can differentiate and evaluate it. The compiler translates it to one operation (the tape's ``SOLVE``), and
expands its derivatives by these rules: ``A dx = db - dA x``, and in reverse ``A' c = seed``. The adjoint of
``b`` is ``c``, and the adjoint of ``A`` is ``-c x'`` (Giles, *Collected matrix derivative results for
forward and reverse mode algorithmic differentiation*, 2008, 2.3.1).
"""

from __future__ import annotations

import re
from functools import cache

from casadi import MX, SX, Function, fabs, horzcat, horzsplit, mtimes, repmat
from casadi import solve as casadi_solve

_NAME = re.compile(r"linear_solution_(\d+)")
_DERIVATIVE = re.compile(r"(fwd|adj)(\d+)_(.*)")


def linear_solution(A: SX, b: SX) -> SX:
    """x (n, 1) with A x = b, for A (n, n) and b (n, 1); not finite if A is singular."""
    return _solver(A.shape[0])(A, b)


def solution_size(name: str) -> int | None:
    """The number of unknowns of a linear solution, from its name; ``None`` for other functions."""
    match = _NAME.fullmatch(name)
    return int(match[1]) if match else None


@cache
def derivative_rule(name: str) -> Function | None:
    """The derivative of this name as an expression; ``None`` if it is not a derivative of a linear solution.

    The names are CasADi's: ``fwd2_linear_solution_3`` has two directions. Its arguments are the arguments of
    the function, then its results (which are not used), then the directions side by side.
    """
    match = _DERIVATIVE.fullmatch(name)
    if match is None:
        return None
    mode, count, base = match[1], int(match[2]), match[3]
    size = solution_size(base)
    if size is None:
        rule = derivative_rule(base)
        if rule is None:
            return None
        return rule.forward(count) if mode == "fwd" else rule.reverse(count)
    A, b, x = SX.sym("A", size, size), SX.sym("b", size), SX(size, 1)
    if mode == "fwd":
        dA, db = SX.sym("dA", size, size * count), SX.sym("db", size, count)
        solved = linear_solution(A, b)
        columns = [
            linear_solution(A, right - mtimes(part, solved))
            for part, right in zip(horzsplit(dA, size), horzsplit(db, 1))
        ]
        return Function(name, [A, b, x, dA, db], [horzcat(*columns)])
    seeds = SX.sym("seeds", size, count)
    solved = linear_solution(A, b)
    columns = [linear_solution(A.T, seed) for seed in horzsplit(seeds, 1)]
    parts = [-mtimes(column, solved.T) for column in columns]
    return Function(name, [A, b, x, seeds], [horzcat(*parts), horzcat(*columns)])


@cache
def _solver(size: int) -> Function:
    """The implementation for CasADi's interpreter: QR of the row-scaled matrix with one refinement step."""
    A, b = MX.sym("A", size, size), MX.sym("b", size)
    weights = 1.0 / mtimes(fabs(A), MX.ones(size, 1))
    scaled = repmat(weights, 1, size) * A
    x = casadi_solve(scaled, weights * b, "lapackqr")
    x = x + casadi_solve(scaled, weights * (b - mtimes(A, x)), "lapackqr")
    return Function(f"linear_solution_{size}", [A, b], [x], {"never_inline": True})
