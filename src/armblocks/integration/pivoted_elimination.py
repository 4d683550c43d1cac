"""Gaussian elimination of a full matrix with row pivoting, as code of a routine."""

from __future__ import annotations

from dataclasses import dataclass

from armblocks.routines.arithmetic import select
from armblocks.routines.full_matrix import FullMatrix
from armblocks.routines.memory import Integers, Reals
from armblocks.routines.routine import Routine
from armblocks.routines.values import Integer, Real


@dataclass(frozen=True, kw_only=True)
class PivotedElimination:
    """``P A = L U``, in place, of a ``matrix`` of ``size`` rows that are stored one after the other.

    ``pivots`` receives the reciprocals of the diagonal of ``U``, and ``swaps`` the row with which each row
    was exchanged. Both have ``size`` elements. Solutions with a singular matrix are infinite or NaN.
    """

    size: int
    matrix: Reals
    pivots: Reals
    swaps: Integers

    @property
    def full(self) -> FullMatrix[Real]:
        """The matrix, or its factors."""
        return FullMatrix(size=self.size, numbers=self.matrix)

    def factor(self, r: Routine) -> None:
        """Factor the matrix: ``L`` is stored below the diagonal, ``U`` on and above it."""
        for k in r.range(0, self.size):
            self._column(r, k)

    def _column(self, r: Routine, k: Integer) -> None:
        """Exchange row ``k`` with the row that has the largest entry of column ``k``; eliminate the rows
        below."""
        A, index = self.matrix, self.full.index
        below = k + 1
        largest = r.integer(k)
        for i in r.range(below, self.size):
            known = largest.value
            larger = abs(A[index(i, k)]) > abs(A[index(known, k)])
            largest.value = select(larger, i, known)
        row = largest.value
        self.swaps[k] = row
        for j in r.range(0, self.size):
            one, other = index(k, j), index(row, j)
            a, b = A[one], A[other]
            A[one] = b
            A[other] = a
        inverse = 1.0 / A[index(k, k)]
        self.pivots[k] = inverse
        for i in r.range(below, self.size):
            own = index(i, k)
            factor = A[own] * inverse
            A[own] = factor
            with r.when(factor != 0.0):
                self.full.subtract_from_row(r, i, factor, k)

    def solve(self, r: Routine, y: Reals) -> None:
        """Replace the right-hand side ``y`` by the solution."""
        # Whole rows were exchanged, also in L, so the right-hand side is permuted before the substitution.
        for k in r.range(0, self.size):
            row = self.swaps[k]
            a, b = y[k], y[row]
            y[k] = b
            y[row] = a
        self.full.substitute(r, y, lambda value, row: value * self.pivots[row])
