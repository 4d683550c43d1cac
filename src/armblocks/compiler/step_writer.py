"""The arithmetic that all steps share, as LLVM IR: error norm, first step, values between steps.

Everything is written for vectors of ``n`` states that lie in the workspace ``%reals``: the old state x, the
new one y and the rows of K. What a method does to get from x to y is in
:mod:`armblocks.compiler.explicit_step` and :mod:`armblocks.compiler.rosenbrock_step`. Nothing here decides;
the loop around it is :mod:`armblocks.compiler.runge_kutta`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

from armblocks.compiler.butcher_tableau import ButcherTableau, Row
from armblocks.compiler.integrator_workspace import Real, Workspace
from armblocks.compiler.ir_routine import Routine
from armblocks.compiler.ir_text import number_text
from armblocks.compiler.rosenbrock_tableau import Tableau


class StepWriter(ABC):
    """Appends the arithmetic of ``tableau``'s steps to a routine that has ``%reals`` and ``%p``.

    ``derivative(t, x, xd)`` writes one evaluation of the derivative, between three addresses. ``clamp`` and
    ``evaluations`` are variables: the latest time to evaluate it at, and how often that was done.
    """

    def __init__(
        self,
        routine: Routine,
        tableau: Tableau,
        workspace: Workspace,
        derivative: Callable[[str, str, str], None],
        clamp: str,
        evaluations: str,
    ) -> None:
        self.w = routine
        self.tableau = tableau
        self.n = workspace.states
        self.x = workspace.x
        self.y = workspace.y
        self.K = workspace.slope
        self._derivative = derivative
        self._clamp = clamp
        self._evaluations = evaluations
        self._instant = routine.variable("double", number_text(0.0))
        self._rtol = routine.get(routine.at("%reals", Real.RTOL))
        self._atol = routine.get(routine.at("%reals", Real.ATOL))

    # Vectors in the workspace.

    def element(self, place: int, index: str) -> str:
        """Address of element ``index`` of the vector at ``place``."""
        return self.w.at("%reals", self.w.word_op("add", index, str(place)))

    def read(self, place: int, index: str) -> str:
        """Element ``index`` of the vector at ``place``."""
        return self.w.get(self.element(place, index))

    def copy(self, source: int, target: int) -> None:
        """``target = source``."""
        self.w.for_each(self.n, lambda i: self.w.put(self.read(source, i), self.element(target, i)))

    def evaluate(self, time: str, state: int, row: int) -> None:
        """``K[row] = f(min(time, clamp), state)``: before a breakpoint the old value of a jump holds."""
        w = self.w
        w.put(w.minimum(time, w.get(self._clamp)), self._instant)
        self._derivative(self._instant, w.at("%reals", state), w.at("%reals", self.K(row)))
        w.increase(self._evaluations)

    def move(self, weights: Row, h: str) -> None:
        """``y = x + h sum_j weights[j] K[j]``."""

        def write(index: str) -> None:
            moved = self.w.fma(h, self.combination(weights, index), self.read(self.x, index))
            self.w.put(moved, self.element(self.y, index))

        self.w.for_each(self.n, write)

    def all_finite(self, *places: int) -> str:
        """Whether every element of the vectors is finite: ``0 v`` is NaN for an infinity or a NaN."""

        def term(index: str, total: str) -> str:
            for place in places:
                total = self.w.fma(self.read(place, index), number_text(0.0), total)
            return total

        return self.w.compare("oeq", self.total(term), number_text(0.0))

    # The step.

    @abstractmethod
    def prepare(self, time: str) -> None:
        """What a step needs that does not depend on its length."""

    @abstractmethod
    def stages(self, time: str, h: str, new_time: str) -> None:
        """All stages, the new state into y and the derivative there into row ``end_row`` of K."""

    @abstractmethod
    def extra_stages(self, time: str, h: str) -> None:
        """The stages that only the dense output needs; y keeps its value."""

    def weighted(self, weights: Row) -> Callable[[str], str]:
        """Elements of ``sum_j weights[j] K[j]`` over what is allowed in the step to y."""
        w = self.w

        def element(index: str) -> str:
            before, after = (w.absolute(self.read(place, index)) for place in (self.x, self.y))
            return w.divide(self.combination(weights, index), self.scale(w.maximum(before, after)))

        return element

    def norm(self, h: str, weights: Row) -> str:
        """Weighted root-mean-square norm of ``h sum_j weights[j] K[j]``."""
        return self.w.multiply(h, self.mean_square(self.weighted(weights)))

    def error_norm(self, h: str, error: Row) -> str:
        """Weighted root-mean-square norm of the error estimate of the step to y."""
        w, tableau = self.w, self.tableau
        stretched = tableau.stretched_error if isinstance(tableau, ButcherTableau) else None
        if stretched is None:
            return self.norm(h, error)
        e5, e3 = self.square(self.weighted(error)), self.square(self.weighted(stretched))
        denominator = w.square_root(w.multiply(w.fma(number_text(0.01), e3, e5), number_text(float(self.n))))
        norm = w.divide(w.multiply(h, e5), denominator)
        nothing = w.compare("oeq", denominator, number_text(0.0))
        return w.select(nothing, number_text(0.0), norm)

    def first_step(self, time: str, interval: str, max_step: str) -> tuple[str, str]:
        """Length of a segment's first step: Hairer, Norsett, Wanner I, II.4, as SciPy does it.

        And whether the interval's length, the end of the run perhaps, has had a part in it.
        """
        w = self.w

        def weighted(value: Callable[[str], str]) -> Callable[[str], str]:
            return lambda i: w.divide(value(i), self.scale(w.absolute(self.read(self.x, i))))

        d0 = self.mean_square(weighted(lambda i: self.read(self.x, i)))
        d1 = self.mean_square(weighted(lambda i: self.read(self.K(0), i)))
        tiny = number_text(1e-5)
        small = w.either(w.compare("olt", d0, tiny), w.compare("olt", d1, tiny))
        h0 = w.select(small, number_text(1e-6), w.divide(w.multiply(number_text(0.01), d0), d1))
        clipped = w.compare("oge", h0, interval)
        h0 = w.minimum(h0, interval)
        self.move((1.0,), h0)
        self.evaluate(w.add(time, h0), self.y, 1)
        change = weighted(lambda i: w.subtract(self.read(self.K(1), i), self.read(self.K(0), i)))
        d2 = w.divide(self.mean_square(change), h0)
        steepest = w.maximum(d2, d1)
        # Kept inside the range of inverse_root; beyond it the other bounds decide anyway.
        bounded = w.multiply(number_text(100.0), steepest)
        bounded = w.maximum(w.minimum(bounded, number_text(1e300)), number_text(1e-300))
        h1 = w.select(
            w.compare("ole", steepest, number_text(1e-15)),
            w.maximum(w.multiply(h0, number_text(1e-3)), number_text(1e-6)),
            w.inverse_root(bounded, self.tableau.error_order + 1),
        )
        h = w.minimum(h1, w.multiply(number_text(100.0), h0))
        return w.minimum(w.minimum(h, interval), max_step), clipped

    # Between steps.

    def interpolate(self, instant: str, time: str, h: str, target: str) -> None:
        """The state at ``instant``, between ``time`` and ``time + h``, to the address ``target``."""
        w = self.w
        theta = w.divide(w.subtract(instant, time), h)
        weights = [
            (row, w.multiply(w.polynomial(theta, powers), theta))
            for row, powers in enumerate(self.tableau.dense_rows)
            if any(powers)
        ]

        def write(index: str) -> None:
            total = number_text(0.0)
            for row, weight in weights:
                total = w.fma(weight, self.read(self.K(row), index), total)
            w.put(w.fma(h, total, self.read(self.x, index)), w.at(target, index))

        w.for_each(self.n, write)

    # Sums.

    def scale(self, magnitude: str) -> str:
        """What an error is measured by: ``atol + rtol magnitude``."""
        return self.w.fma(magnitude, self._rtol, self._atol)

    def combination(self, weights: Row, index: str) -> str:
        """``sum_j weights[j] K[j][index]``, zeros left out."""
        w = self.w
        total: str | None = None
        for row, weight in enumerate(weights):
            if weight != 0.0:
                factors = number_text(weight), self.read(self.K(row), index)
                total = w.multiply(*factors) if total is None else w.fma(*factors, total)
        return total or number_text(0.0)

    def total(self, term: Callable[[str, str], str]) -> str:
        """``sum_i``: ``term(index, sum so far)`` gives the next sum."""
        total = self.w.variable("double", number_text(0.0))
        self.w.for_each(self.n, lambda index: self.w.put(term(index, self.w.get(total)), total))
        return self.w.get(total)

    def square(self, element: Callable[[str], str]) -> str:
        """``sum_i element(i)^2``."""

        def term(index: str, total: str) -> str:
            value = element(index)
            return self.w.fma(value, value, total)

        return self.total(term)

    def mean_square(self, element: Callable[[str], str]) -> str:
        """``sqrt(sum_i element(i)^2 / n)``."""
        return self.w.square_root(self.w.divide(self.square(element), number_text(float(self.n))))
