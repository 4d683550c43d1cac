"""The linear equations of a Rosenbrock step, as routines: ``(E / gamma - h J) k = right``.

``E`` is one for the rows of the flow and zero for the rows of implicit equations. A large sparse matrix is
eliminated in the order of :mod:`armblocks.integration.elimination_plan`, with its pivots on the diagonal and
work in proportion to its entries. The residual of the first solution is checked, each row relative to its
terms (Oettli, Prager, *Numer. Math.* 6 (1964) 405-409; the check is invariant to scaling). If the
residual is too large, and always for small or nearly full matrices, the dense matrix is eliminated with row
pivoting instead.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence

from armblocks.integration.elimination_plan import Elimination, JacobianPattern, plan_elimination
from armblocks.integration.pivoted_elimination import PivotedElimination
from armblocks.routines.arithmetic import fma, maximum, select, square_root
from armblocks.routines.memory import Integers, Reals
from armblocks.routines.routine import Function, Program, Routine
from armblocks.routines.values import Boolean, Integer, Real

MAX_DENSE_SIZE = 8
"""Maximum size of a matrix that is always eliminated densely with pivoting, which is fastest there."""
MAX_FILL = 0.5
"""A matrix is also eliminated densely if L and U have more than this fraction of all entries."""
SCALING_ROUNDS = 6
"""Iterations after which the bound of the rates is within a factor of about two, for most matrices."""
MAX_RESIDUAL = 1e-7
"""Relative residual above which the elimination without pivoting counts as failed. An error of this size in
the Jacobian causes an error far below the usual tolerances of a Rosenbrock method."""


class LinearEquationsLayout:
    """The positions of the linear equations in ``scratch``. No step reads data of an earlier step.

    The system's ``flow_jacobian`` writes ``J`` and ``T``. ``right`` has the order of the equations,
    ``solution`` the order of the unknowns. ``swaps`` are integers, and so is ``dense``: whether the dense
    matrix was eliminated.
    """

    def __init__(self, pattern: JacobianPattern) -> None:
        self.pattern = pattern
        self.n, self.size = pattern.states, pattern.size
        plan: Elimination | None = plan_elimination(pattern) if pattern.size > MAX_DENSE_SIZE else None
        if plan is not None and plan.filled > MAX_FILL * pattern.size**2:
            plan = None
        self.plan = plan
        stored = 0 if plan is None else plan.filled
        self.J = 0
        self.T = self.J + len(pattern.rows)
        self.right = self.T + self.size
        self.solution = self.right + self.size
        self.work = self.solution + self.size
        self.pivots = self.work + self.size
        self.lower = self.pivots + self.size
        self.swaps = self.lower + stored
        self.dense = self.swaps + self.size
        self.matrix = self.dense + 1
        self.length = self.matrix + self.size**2


class LinearEquations:
    """The functions of a program that factor the matrix of a step and solve for its right-hand sides.

    ``gamma`` is the coefficient of the method. :attr:`factor` is the cheapest elimination,
    :attr:`factor_dense` the elimination with pivoting.
    """

    def __init__(self, program: Program, layout: LinearEquationsLayout, gamma: float) -> None:
        self.program = program
        self.layout = layout
        dense = _Dense(layout, 1.0 / gamma)
        self.factor_dense = program.define(dense.factor_dense, inlined=False)
        self.factor: Function[[Reals, Real], None] = self.factor_dense
        self.is_accurate: Function[[Reals, Real], Boolean] | None = None
        """Whether the solution with the step ``h`` is accurate: the residual of every row is small relative
        to the terms of the row. None for elimination with pivoting, which needs no check."""
        if layout.plan is not None:
            sparse = _Sparse(layout, layout.plan, 1.0 / gamma)
            self.factor = program.define(sparse.factor, inlined=False)
            self.is_accurate = program.define(sparse.is_accurate, inlined=False)
            dense.solve_sparse = program.define(sparse.solve_sparse, inlined=False)
        self.solve = program.define(dense.solve_linear, inlined=False)

    @property
    def rate_bound(self) -> Function[[Reals], Real]:
        """An upper bound of the magnitudes of the eigenvalues of ``J``.

        For any positive v, ``max_i (|J| v)_i / v_i`` is an upper bound (Collatz, Wielandt; Horn, Johnson,
        Matrix Analysis, 8.1.31 and 8.1.18). A few iterations of ``v = sqrt(v |J| v)`` adapt v to the scales
        of the states.
        """
        layout = self.layout

        def rate_bound(r: Routine, scratch: Reals) -> Real:
            n, entries = layout.n, len(layout.pattern.rows)
            rows = r.integers("jacobian.rows", layout.pattern.rows)
            columns = r.integers("jacobian.columns", layout.pattern.columns)
            J, v, product = (scratch.after(place) for place in (layout.J, layout.right, layout.work))
            bound = r.real(0.0)
            for i in r.range(0, n):
                v[i] = 1.0
            for _ in r.range(0, SCALING_ROUNDS):
                bound.value = 0.0
                for i in r.range(0, n):
                    product[i] = 0.0
                for k in r.range(0, entries):
                    row = rows[k]
                    weight = abs(J[k]) * v[columns[k]]
                    product[row] = product[row] + weight
                for i in r.range(0, n):
                    one, other = v[i], product[i]
                    bound.value = maximum(bound.value, other / one)
                    middle = square_root(one * other)
                    v[i] = select(middle > 0.0, middle, one)
            return bound.value

        return self.program.define(rate_bound, inlined=False)


class _Dense:
    """Elimination of the dense matrix, with row pivoting."""

    def __init__(self, layout: LinearEquationsLayout, diagonal: float) -> None:
        self.layout = layout
        self.n, self.size = layout.n, layout.size
        self.diagonal = diagonal
        self.solve_sparse: Function[[Reals], None] | None = None

    def factor_dense(self, r: Routine, scratch: Reals, h: Real) -> None:
        """Compute ``E / gamma - h J`` and factor it in place."""
        layout, size = self.layout, self.size
        pattern = layout.pattern
        matrix, J = scratch.after(layout.matrix), scratch.after(layout.J)
        places = [row * size + column for row, column in zip(pattern.rows, pattern.columns)]
        targets = r.integers("jacobian.places", places)
        scratch.integers[layout.dense] = 1
        for i in r.range(0, size**2):
            matrix[i] = 0.0
        for i in r.range(0, self.n):
            matrix[i * size + i] = self.diagonal
        minus_h = -h
        for k in r.range(0, len(places)):
            target = targets[k]
            matrix[target] = fma(minus_h, J[k], matrix[target])
        self.elimination(scratch).factor(r)

    def solve_linear(self, r: Routine, scratch: Reals) -> None:
        """Solve for the right-hand side in ``scratch`` with the latest factors."""
        layout = self.layout
        if self.solve_sparse is not None:
            with r.unless(scratch.integers[layout.dense] != 0):
                r.call(self.solve_sparse, scratch)
                r.return_()
        right, y = scratch.after(layout.right), scratch.after(layout.solution)
        for i in r.range(0, self.size):
            y[i] = right[i]
        self.elimination(scratch).solve(r, y)

    def elimination(self, scratch: Reals) -> PivotedElimination:
        layout = self.layout
        return PivotedElimination(
            size=layout.size,
            matrix=scratch.after(layout.matrix),
            pivots=scratch.after(layout.pivots),
            swaps=scratch.integers.after(layout.swaps),
        )


class _Sparse:
    """Sparse elimination by a plan: the places of the entries are constants of the program."""

    def __init__(self, layout: LinearEquationsLayout, plan: Elimination, diagonal: float) -> None:
        self.layout = layout
        self.plan = plan
        self.diagonal = [diagonal if column < layout.n else 0.0 for column in plan.columns]

    def entries(self, r: Routine) -> Rows:
        """The entries of J in each row: their indices, and their places in the row."""
        flat = [pair for row in self.plan.entries for pair in row]
        numbers = r.integers("entry.of", [number for number, _ in flat])
        places = r.integers("entry.place", [place for _, place in flat])
        return Rows(r, places, r.integers("entry.ends", _ends(self.plan.entries)), numbers)

    def lower(self, r: Routine) -> Rows:
        """The entries of L in each row, without the diagonal."""
        places = r.integers("lower.place", [k for row in self.plan.lower for k in row])
        return Rows(r, places, r.integers("lower.ends", _ends(self.plan.lower)))

    def upper(self, r: Routine) -> Rows:
        """The entries of U in each row, without the diagonal: stored after the entries of L."""
        first = sum(map(len, self.plan.lower))
        places = r.integers("upper.place", [0] * first + [k for row in self.plan.upper for k in row])
        return Rows(r, places, r.integers("upper.ends", [first + end for end in _ends(self.plan.upper)]))

    def factor(self, r: Routine, scratch: Reals, h: Real) -> None:
        """Compute the factors of ``E / gamma - h J``, row by row."""
        layout = self.layout
        J, work, pivots, factors = (
            scratch.after(place) for place in (layout.J, layout.work, layout.pivots, layout.lower)
        )
        entries, lower, upper = self.entries(r), self.lower(r), self.upper(r)
        diagonal = r.reals("diagonal.of", self.diagonal)
        scratch.integers[layout.dense] = 0
        minus_h = -h
        for i in r.range(0, layout.size):
            for part in (lower, upper):
                for k in part.of(i):
                    work[part.places[k]] = 0.0
            work[i] = diagonal[i]
            for k in entries.of(i):
                target = entries.places[k]
                work[target] = fma(minus_h, J[entries.numbers[k]], work[target])
            for k in lower.of(i):
                before = lower.places[k]
                factor = work[before] * pivots[before]
                factors[k] = factor
                minus = -factor
                for m in upper.of(before):
                    target = upper.places[m]
                    work[target] = fma(minus, factors[m], work[target])
            for k in upper.of(i):
                factors[k] = work[upper.places[k]]
            pivots[i] = 1.0 / work[i]

    def solve_sparse(self, r: Routine, scratch: Reals) -> None:
        """Forward and backward substitution."""
        layout = self.layout
        y, pivots, factors = (scratch.after(place) for place in (layout.work, layout.pivots, layout.lower))
        right, solution = scratch.after(layout.right), scratch.after(layout.solution)
        equations, unknowns = self.order(r)
        lower, upper = self.lower(r), self.upper(r)

        def subtract_all(part: Rows, i: Integer, start: Real) -> Real:
            total = r.real(start)
            for k in part.of(i):
                known = -y[part.places[k]]
                total.value = fma(factors[k], known, total.value)
            return total.value

        for i in r.range(0, layout.size):
            y[i] = subtract_all(lower, i, right[equations[i]])
        for k in r.range(0, layout.size):
            i = layout.size - 1 - k
            value = subtract_all(upper, i, y[i]) * pivots[i]
            y[i] = value
            solution[unknowns[i]] = value

    def is_accurate(self, r: Routine, scratch: Reals, h: Real) -> Boolean:
        """Whether the residual of every solved equation is small relative to the terms of the equation."""
        layout = self.layout
        J, right, solution = (scratch.after(place) for place in (layout.J, layout.right, layout.solution))
        entries, diagonal = self.entries(r), r.reals("diagonal.of", self.diagonal)
        equations, unknowns = self.order(r)
        accurate = r.boolean(True)
        minus_h = -h
        for i in r.range(0, layout.size):
            known, own = right[equations[i]], solution[unknowns[i]]
            product = diagonal[i] * own
            residual, terms = r.real(known - product), r.real(abs(known) + abs(product))
            for k in entries.of(i):
                coefficient = minus_h * J[entries.numbers[k]]
                part = coefficient * solution[unknowns[entries.places[k]]]
                residual.value = residual.value - part
                terms.value = terms.value + abs(part)
            accurate.value = accurate.value & (abs(residual.value) <= MAX_RESIDUAL * terms.value)
        return accurate.value

    def order(self, r: Routine) -> tuple[Integers, Integers]:
        """The equation and the unknown of each row."""
        return r.integers("equation.of", self.plan.equations), r.integers("unknown.of", self.plan.columns)


class Rows:
    """Entries of a sparse matrix by rows: the ``places`` of all entries, and the end of each row in them."""

    def __init__(self, r: Routine, places: Integers, ends: Integers, numbers: Integers | None = None) -> None:
        self._routine = r
        self._ends = ends
        self.places = places
        self.numbers = places if numbers is None else numbers

    def of(self, row: Integer) -> Generator[Integer]:
        """``for k in rows.of(i)``: every entry of a row."""
        return self._routine.range(self._ends[row], self._ends[row + 1])


def _ends(rows: Sequence[Sequence[object]]) -> list[int]:
    """The start of each row in the concatenation of all rows, and the end of the last row."""
    ends = [0]
    for row in rows:
        ends.append(ends[-1] + len(row))
    return ends
