"""Gaussian elimination of a full matrix with row pivoting, as a routine writes it."""

from __future__ import annotations

from dataclasses import dataclass

from armblocks.routines.arithmetic import fma, select
from armblocks.routines.routine import Routine
from armblocks.routines.values import Integer, Integers, Reals


@dataclass(frozen=True, kw_only=True)
class PivotedElimination:
    """``P A = L U`` in place of a ``matrix`` of ``size`` rows, one after the other.

    ``pivots`` gets the reciprocals of the diagonal of ``U``, ``swaps`` the row that each row was exchanged
    with: both have ``size`` elements. Where the matrix is singular, solutions are infinite or NaN.
    """

    size: int
    matrix: Reals
    pivots: Reals
    swaps: Integers

    def factor(self, r: Routine) -> None:
        """Factor the matrix: the factors ``L`` below the diagonal, ``U`` from the diagonal on."""
        for k in r.range(0, self.size):
            self._column(r, k)

    def _column(self, r: Routine, k: Integer) -> None:
        """Exchange row ``k`` with the one that has the largest entry of column ``k``; eliminate below it."""
        size, A = self.size, self.matrix
        below = k + 1
        largest = r.integer(k)
        for i in r.range(below, size):
            known = largest.value
            larger = abs(A[i * size + k]) > abs(A[known * size + k])
            largest.value = select(larger, i, known)
        row = largest.value
        self.swaps[k] = row
        for j in r.range(0, size):
            one, other = k * size + j, row * size + j
            a, b = A[one], A[other]
            A[one] = b
            A[other] = a
        inverse = 1.0 / A[k * size + k]
        self.pivots[k] = inverse
        for i in r.range(below, size):
            place = i * size + k
            factor = A[place] * inverse
            A[place] = factor
            minus = -factor
            with r.when(factor != 0.0):
                for j in r.range(below, size):
                    target = i * size + j
                    A[target] = fma(minus, A[k * size + j], A[target])

    def solve(self, r: Routine, y: Reals) -> None:
        """Solve for the right side ``y``, in its place."""
        # Whole rows were exchanged, those of L as well, so the right side is permuted before anything else.
        for k in r.range(0, self.size):
            row = self.swaps[k]
            a, b = y[k], y[row]
            y[k] = b
            y[row] = a
        for i in r.range(0, self.size):
            self._subtract_products(r, y, i, 0, i)
        for turn in r.range(0, self.size):
            i = self.size - 1 - turn
            self._subtract_products(r, y, i, i + 1, self.size)
            y[i] = y[i] * self.pivots[i]

    def _subtract_products(
        self, r: Routine, y: Reals, row: Integer, start: Integer | int, stop: Integer | int
    ) -> None:
        """``y[row] -= sum_j matrix[row][j] y[j]`` for ``j = start … stop - 1``."""
        total = r.real(y[row])
        for j in r.range(start, stop):
            minus = -y[j]
            total.value = fma(self.matrix[row * self.size + j], minus, total.value)
        y[row] = total.value
