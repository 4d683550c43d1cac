"""The arithmetic of one Rosenbrock step as LLVM IR: Jacobian, linear equations, stages.

Rows of K are the derivative at the step's start, the stages, and the derivative at its end, so that all else
(error norm, first step, values between the steps) is that of the explicit steps. The Jacobian is worked out
once a step, also where the step is tried again shorter. Its entries that are infinite or NaN (the slope of a
root at zero) count as zero: the derivative itself is finite there, and the error estimate sees what they
lack.
"""

from __future__ import annotations

from collections.abc import Callable

from armblocks.compiler.butcher_tableau import Row
from armblocks.compiler.integrator_workspace import Workspace
from armblocks.compiler.ir_routine import Routine
from armblocks.compiler.ir_text import number_text
from armblocks.compiler.linear_equations import LinearEquations, LinearSpace
from armblocks.compiler.program_text import add_program
from armblocks.compiler.rosenbrock_tableau import RosenbrockTableau
from armblocks.compiler.step_writer import StepWriter
from armblocks.routines.routine import Program


class RosenbrockStep(StepWriter):
    """Appends the arithmetic of ``tableau``'s steps to a routine that also has ``%scratch``.

    ``jacobian(instant, x)`` writes the evaluation of ``J`` and ``T`` at two addresses into the space.
    """

    def __init__(
        self,
        routine: Routine,
        tableau: RosenbrockTableau,
        workspace: Workspace,
        derivative: Callable[[str, str, str], None],
        clamp: str,
        evaluations: str,
        space: LinearSpace,
        jacobian: Callable[[str, str], None],
    ) -> None:
        super().__init__(routine, tableau, workspace, derivative, clamp, evaluations)
        self.rosenbrock = tableau
        self.space = space
        self._jacobian = jacobian
        self._time = ""
        program = Program()
        self.equations = LinearEquations(program, space, tableau.gamma)
        if space.size == self.n:
            _ = self.equations.rate_bound
        add_program(routine.module, program)

    def prepare(self, time: str) -> None:
        """The Jacobian at the step's start."""
        w, space = self.w, self.space
        w.put(w.minimum(time, w.get(self._clamp)), self._instant)
        self._jacobian(self._instant, w.at("%reals", self.x))
        zero = number_text(0.0)

        def finite(index: str) -> None:
            place = w.at("%scratch", index)
            value = w.get(place)
            known = w.compare("oeq", w.multiply(value, zero), zero)
            w.put(w.select(known, value, zero), place)

        w.for_each(space.T + space.size, finite)

    def stages(self, time: str, h: str, new_time: str) -> None:
        """All stages, the new state into y and the derivatives into their rows of K."""
        w, tableau = self.w, self.rosenbrock
        self._time = time
        w.do(f"call void @factor(ptr %scratch, double {h})" if self.space.plan else self._whole(h))
        for stage in range(tableau.stages):
            row = 1 + stage
            source = self.K(0)
            if stage:
                self.move((0.0, *tableau.matrix[stage]), h)
                self.evaluate(w.fma(number_text(tableau.nodes[stage]), h, time), self.y, row)
                source = self.K(row)
            self._right(source, stage, h)
            w.do("call void @solve_linear(ptr %scratch)")
            if stage == 0 and self.space.plan:
                self._check(h)
            w.for_each(
                self.n,
                lambda i: w.put(
                    w.get(w.at("%scratch", w.word_op("add", i, str(self.space.solution)))),
                    self.element(self.K(row), i),  # noqa: B023
                ),
            )
        self.move((0.0, *tableau.weights), h)
        self.evaluate(new_time, self.y, tableau.end_row)

    def error_norm(self, h: str, error: Row) -> str:
        """That of the embedded method, or of the values in the middle of the step, whichever is larger."""
        w, tableau, space = self.w, self.rosenbrock, self.space
        ends = super().error_norm(h, error)
        state, slope = self.K(tableau.middle_row), self.K(tableau.middle_row + 1)
        middle = w.fma(number_text(0.5), h, self._time)
        self.interpolate(middle, self._time, h, w.at("%reals", state))
        self.evaluate(middle, state, tableau.middle_row + 1)
        weights = tableau.slope_weights(0.5)

        def defect(i: str) -> None:
            value = w.subtract(self.read(slope, i), self.combination(weights, i))
            w.put(value, w.at("%scratch", w.word_op("add", i, str(space.right))))

        def nothing(i: str) -> None:
            place = w.word_op("add", i, str(space.right + self.n))
            w.put(number_text(0.0), w.at("%scratch", place))

        def weighted(i: str) -> str:
            value = w.get(w.at("%scratch", w.word_op("add", i, str(space.solution))))
            before, after = (w.absolute(self.read(place, i)) for place in (self.x, self.y))
            return w.divide(value, self.scale(w.maximum(before, after)))

        w.for_each(self.n, defect)
        if space.size > self.n:
            w.for_each(space.size - self.n, nothing)
        w.do("call void @solve_linear(ptr %scratch)")
        between = w.multiply(h, self.mean_square(weighted))
        # A NaN of either is the result: it makes the step be tried shorter.
        return w.select(
            w.compare("olt", between, ends), ends, w.add(between, w.multiply(ends, number_text(0.0)))
        )

    def fastest_rate(self) -> str:
        """No less than the fastest rate of the flow at the step's start, 1/s."""
        return self.w.let("call double @rate_bound(ptr %scratch)")

    def extra_stages(self, time: str, h: str) -> None:
        """None: the stages give the values between the steps."""

    def _whole(self, h: str) -> str:
        return f"call void @factor_whole(ptr %scratch, double {h})"

    def _check(self, h: str) -> None:
        """If the elimination without pivoting went wrong, another one with it."""
        w = self.w
        badly, well = w.fresh("badly"), w.fresh("well")
        w.branch(w.let(f"call i1 @solved_well(ptr %scratch, double {h})"), well, badly)
        w.place(badly)
        w.do(self._whole(h))
        w.do("call void @solve_linear(ptr %scratch)")
        w.place(well)

    def _right(self, source: int, stage: int, h: str) -> None:
        """``right = f + sum_j couplings[j] k[j] + h time_weight T``."""
        w, tableau, space = self.w, self.rosenbrock, self.space
        weight = tableau.time_weights[stage]
        factor = w.multiply(number_text(weight), h) if weight else ""

        def over_time(index: str, total: str) -> str:
            if not weight:
                return total
            T = w.get(w.at("%scratch", w.word_op("add", index, str(space.T))))
            return w.fma(factor, T, total)

        def flow(index: str) -> None:
            total = self.read(source, index)
            for j, coupling in enumerate(tableau.couplings[stage]):
                total = w.fma(number_text(coupling), self.read(self.K(1 + j), index), total)
            w.put(over_time(index, total), w.at("%scratch", w.word_op("add", index, str(space.right))))

        def implicit(index: str) -> None:
            index = w.word_op("add", index, str(self.n))
            total = over_time(index, number_text(0.0))
            w.put(total, w.at("%scratch", w.word_op("add", index, str(space.right))))

        w.for_each(self.n, flow)
        if space.size > self.n:
            w.for_each(space.size - self.n, implicit)
