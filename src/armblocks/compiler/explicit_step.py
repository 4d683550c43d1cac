"""The arithmetic of one explicit Runge-Kutta step as LLVM IR: stages, and how stiff the step felt."""

from __future__ import annotations

from collections.abc import Callable

from armblocks.compiler.butcher_tableau import ButcherTableau
from armblocks.compiler.integrator_workspace import Workspace
from armblocks.compiler.ir_routine import Routine
from armblocks.compiler.ir_text import number_text
from armblocks.compiler.step_writer import StepWriter


class ExplicitStep(StepWriter):
    """Appends the arithmetic of an explicit ``tableau``'s steps."""

    def __init__(
        self,
        routine: Routine,
        tableau: ButcherTableau,
        workspace: Workspace,
        derivative: Callable[[str, str, str], None],
        clamp: str,
        evaluations: str,
    ) -> None:
        super().__init__(routine, tableau, workspace, derivative, clamp, evaluations)
        self.butcher = tableau

    def prepare(self, time: str) -> None:
        """Nothing: the derivative at the start is there already."""

    def stages(self, time: str, h: str, new_time: str) -> None:
        """All stages, the new state into y and the derivative there into row ``s`` of K."""
        tableau = self.butcher
        for stage in range(1, tableau.stages):
            self.move(tableau.matrix[stage], h)
            self.evaluate(self.w.fma(number_text(tableau.nodes[stage]), h, time), self.y, stage)
        self.move(tableau.weights, h)
        self.evaluate(new_time, self.y, tableau.stages)

    def extra_stages(self, time: str, h: str) -> None:
        """The stages that only the dense output needs; y keeps its value."""
        tableau = self.butcher
        for k, node in enumerate(tableau.extra_nodes):
            self.move(tableau.extra_matrix[k], h)
            self.evaluate(self.w.fma(number_text(node), h, time), self.y, tableau.stages + 1 + k)
        # The extra stages went through y: give it the new state again, by the same operations.
        self.move(tableau.weights, h)

    def stiffness(self) -> str:
        """The square of ``h`` times the fastest rate, as the last two evaluations show it (Hairer, Wanner II,
        IV.2, equation (2.20)): both are at the step's end, so they differ by the Jacobian times the
        difference of their states."""
        w, tableau = self.w, self.butcher
        last = (*tableau.matrix[-1], 0.0)
        difference = tuple(b - a for a, b in zip(last, tableau.weights))
        end, before = self.K(tableau.stages), self.K(tableau.stages - 1)
        slopes = self.square(lambda i: w.subtract(self.read(end, i), self.read(before, i)))
        states = self.square(lambda i: self.combination(difference, i))
        # Both sums lack h^2: y_new - y_last = h sum_j (b_j - a_j) K[j].
        return w.divide(slopes, w.maximum(states, number_text(1e-300)))
