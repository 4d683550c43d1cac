"""Newton's method for the implicit equations of a system, as a routine.

At every evaluation of the system, ``0 = residual(t, x, z, w, p)`` is solved for ``w``. The method uses the
exact Jacobian and dense elimination with row pivoting. It halves steps while the residual does not decrease.
The iteration starts from ``w`` of the last accepted step, so a repeated step gives identical results.

A point where the residual is exactly zero and the Jacobian is undefined is a solution. If Newton's method
does not converge, or the Jacobian is singular, ``w`` becomes NaN. The loop then repeats
the step with a shorter length. If that fails, the run ends as for any other NaN, and Python diagnoses the
cause.
"""

from __future__ import annotations

from armblocks.integration.pivoted_elimination import PivotedElimination
from armblocks.integration.system_functions import residual, residual_jacobian
from armblocks.integration.workspace import Workspace
from armblocks.routines.arithmetic import fma, select
from armblocks.routines.memory import Reals
from armblocks.routines.routine import Function, Program, Routine
from armblocks.routines.values import Boolean, Real

MAX_ITERATIONS, MAX_HALVINGS = 50, 12
"""Maximum number of iterations, and of halvings of one correction."""
CONVERGED = 1e-13
"""Convergence: the last correction relative to ``1 + |w|`` is below this. The next correction would be of the
order of its square."""
ACCEPTABLE = 1e-9
"""The same limit where rounding errors keep the corrections from decreasing further."""


def define_solve(
    program: Program, workspace: Workspace, unknowns: int
) -> Function[[Reals, Reals, Reals, Reals], None]:
    """Define ``solve(t, x, reals, p)``: it writes ``trial_w`` of the workspace ``reals``."""

    def solve(r: Routine, t: Reals, x: Reals, reals: Reals, p: Reals) -> None:
        _Newton(r, workspace, unknowns, t, x, reals, p).write()

    return program.define(solve, inlined=False)


class _Newton:
    """Emits Newton's method at one point."""

    def __init__(
        self, r: Routine, workspace: Workspace, unknowns: int, t: Reals, x: Reals, reals: Reals, p: Reals
    ) -> None:
        self.r = r
        self.n = unknowns
        self.point = t, x, reals.after(workspace.z)
        self.p = p
        self.accepted = reals.after(workspace.w)
        self.trial = reals.after(workspace.trial_w)
        self.before = reals.after(workspace.before)
        self.residual = reals.after(workspace.residual)
        self.jacobian = reals.after(workspace.jacobian)
        self.elimination = PivotedElimination(
            size=unknowns,
            matrix=self.jacobian,
            pivots=reals.after(workspace.pivots),
            swaps=reals.integers.after(workspace.swaps),
        )

    def write(self) -> None:
        """Emit the iteration, which writes ``trial_w``."""
        r, n = self.r, self.n
        for i in r.range(0, n):
            self.trial[i] = self.accepted[i]
        iterations = r.integer(0)
        with r.part() as search:
            with r.part() as iteration:
                iterations.value = iterations.value + 1
                r.call(residual, *self.point, self.trial, self.p, self.residual)
                r.call(residual_jacobian, *self.point, self.trial, self.p, self.jacobian)
                before = self.square(self.residual)
                search.leave_when((before == 0.0) & self.undefined())
                self.elimination.factor(r)
                self.elimination.solve(r, self.residual)
                for i in r.range(0, n):
                    self.before[i] = self.trial[i]
                self.damped_correction(before)
                size = self.correction()
                with r.when(size <= CONVERGED):
                    search.leave()
                iteration.again_when(size.ordered & (iterations.value < MAX_ITERATIONS))
                with r.when(size <= ACCEPTABLE):
                    search.leave()
            for i in r.range(0, n):
                self.trial[i] = float("nan")

    def undefined(self) -> Boolean:
        """Whether an entry of the Jacobian is NaN, as for ``hypot(u, w)`` at the origin."""
        any_nan = self.r.boolean(False)
        for i in self.r.range(0, self.n * self.n):
            any_nan.value = any_nan.value | ~self.jacobian[i].ordered
        return any_nan.value

    def square(self, vector: Reals) -> Real:
        """Sum of the squares of a vector."""
        total = self.r.real(0.0)
        for i in self.r.range(0, self.n):
            value = vector[i]
            total.value = fma(value, value, total.value)
        return total.value

    def correction(self) -> Real:
        """The largest correction relative to ``1 + |w|``; NaN if a correction is NaN."""
        largest = self.r.real(0.0)
        for i in self.r.range(0, self.n):
            value = self.trial[i]
            size = abs(value - self.before[i])
            part = size / (1.0 + abs(value))
            known = largest.value
            largest.value = select(known > part, known, part + known * 0.0)
        return largest.value

    def damped_correction(self, before: Real) -> None:
        """``w -= lambda d``. Halves ``lambda`` up to ``MAX_HALVINGS`` times until the residual decreases."""
        r = self.r
        length = r.real(1.0)
        with r.loop() as shorter:
            factor = -length.value
            for i in r.range(0, self.n):
                d, start = self.residual[i], self.before[i]
                self.trial[i] = fma(factor, d, start)
            # The factors of the Jacobian are no longer needed: the new residual takes the memory of their
            # first row.
            r.call(residual, *self.point, self.trial, self.p, self.jacobian)
            after = self.square(self.jacobian)
            fell = after <= before
            shorter.leave_when(fell | (length.value <= 2.0**-MAX_HALVINGS))
            length.value = length.value * 0.5
