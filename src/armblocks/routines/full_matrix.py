"""Full square matrices in memory: the common part of the eliminations with pivoting.

The eliminations differ in pivot selection and storage: :mod:`armblocks.compiler.linear_solution` weighs rows
and exchanges them lane by lane, :mod:`armblocks.integration.pivoted_elimination` factors one matrix for many
right-hand sides.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic

from armblocks.routines.arithmetic import fma
from armblocks.routines.memory import NumberArray
from armblocks.routines.routine import Routine
from armblocks.routines.values import Integer, NumberT


@dataclass(frozen=True, kw_only=True)
class FullMatrix(Generic[NumberT]):
    """A matrix of ``size`` rows, one after the other in ``numbers``."""

    size: int
    numbers: NumberArray[NumberT]

    def index(self, row: Integer, column: Integer) -> Integer:
        """Index of an entry."""
        return row * self.size + column

    def subtract_from_row(self, r: Routine, row: Integer, factor: NumberT, other: Integer) -> None:
        """``A[row] -= factor A[other]`` right of column ``other``."""
        A = self.numbers
        minus = -factor
        for j in r.range(other + 1, self.size):
            target = self.index(row, j)
            A[target] = fma(minus, A[self.index(other, j)], A[target])

    def less_products(
        self,
        r: Routine,
        value: NumberT,
        row: Integer,
        y: NumberArray[NumberT],
        start: Integer | int,
        stop: Integer | int,
    ) -> NumberT:
        """``value - sum_j A[row][j] y[j]`` for ``j = start … stop - 1``, one after the other."""
        rest = r.variable(value)
        for j in r.range(start, stop):
            minus = -y[j]
            rest.value = fma(self.numbers[self.index(row, j)], minus, rest.value)
        return rest.value

    def substitute(
        self, r: Routine, y: NumberArray[NumberT], by_pivot: Callable[[NumberT, Integer], NumberT]
    ) -> None:
        """Solve ``L U x = y`` in place: the solution replaces ``y``.

        The matrix holds ``L`` below its diagonal, where ``L`` has ones, and ``U`` from the diagonal on;
        ``by_pivot(value, row)`` is the value divided by the row's pivot.
        """
        for i in r.range(0, self.size):
            y[i] = self.less_products(r, y[i], i, y, 0, i)
        for k in r.range(0, self.size):
            i = self.size - 1 - k
            y[i] = by_pivot(self.less_products(r, y[i], i, y, i + 1, self.size), i)
