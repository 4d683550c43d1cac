"""Newton's method for the implicit equations of a system, as LLVM IR.

``0 = residual(t, x, z, w, p)`` is solved for ``w`` wherever the system is evaluated, with the exact Jacobian,
dense elimination with row pivoting, and halved steps while the residual does not fall. It starts from the
``w`` of the last accepted step, so a step that is tried twice gives the same bits.

Where it does not converge, or the Jacobian is singular, ``w`` becomes NaN: a step that meets this is tried
shorter, and if nothing helps the run ends there like at any other NaN, and the cause is looked up then.
"""

from __future__ import annotations

from collections.abc import Callable

from armblocks.compiler.integrator_workspace import Workspace
from armblocks.compiler.ir_routine import Routine
from armblocks.compiler.ir_text import Module, number_text

ITERATIONS = 50
HALVINGS = 12
CONVERGED = 1e-13
"""Last correction over ``1 + |w|``; the one after it would be of the order of its square."""
ACCEPTABLE = 1e-9
"""The same where rounding keeps the corrections from falling further."""


def emit_solve(module: Module, workspace: Workspace, unknowns: int) -> None:
    """Add ``void solve(ptr t, ptr x, ptr reals, ptr p)``: it writes ``trial_w`` of the workspace."""

    def write() -> str:
        solver = _Newton(Routine(module), workspace, unknowns)
        solver.emit()
        return solver.w.text("define internal void @solve(ptr %t, ptr %x, ptr %reals, ptr %p) noinline")

    module.define("solve", write)


class _Newton:
    def __init__(self, routine: Routine, workspace: Workspace, unknowns: int) -> None:
        self.w = routine
        self.places = workspace
        self.n = unknowns

    def address(self, place: int, index: str) -> str:
        return self.w.at("%reals", self.w.word_op("add", index, str(place)))

    def entry(self, row: str, column: str) -> str:
        """Address of an entry of the Jacobian."""
        place = self.w.word_op("add", self.w.word_op("mul", row, str(self.n)), column)
        return self.address(self.places.jacobian, place)

    def all(self, write: Callable[[str], None]) -> None:
        self.w.count("0", str(self.n), write)

    def copy(self, source: int, target: int) -> None:
        self.all(lambda i: self.w.put(self.w.get(self.address(source, i)), self.address(target, i)))

    def evaluate(self, function: str, target: int) -> None:
        w, places = self.w, self.places
        z, trial, result = (w.at("%reals", place) for place in (places.z, places.trial_w, target))
        w.do(f"call void @{function}(ptr %t, ptr %x, ptr {z}, ptr {trial}, ptr %p, ptr {result})")

    def square(self, place: int) -> str:
        """Sum of the squares of a vector."""
        w = self.w
        total = w.variable("double", number_text(0.0))

        def add(i: str) -> None:
            value = w.get(self.address(place, i))
            w.put(w.fma(value, value, w.get(total)), total)

        self.all(add)
        return w.get(total)

    def emit(self) -> None:
        w, places = self.w, self.places
        turn, on, failed, done = (w.fresh(stem) for stem in ("turn", "on", "failed", "done"))
        self.copy(places.w, places.trial_w)
        turns = w.variable("i64", "0")
        w.place(turn)
        w.increase(turns)
        self.evaluate("residual", places.residual)
        self.evaluate("residual_jacobian", places.jacobian)
        before = self.square(places.residual)
        self.eliminate()
        self.copy(places.trial_w, places.before)
        self.walk(before)
        size = self.correction()
        w.branch(w.compare("ole", size, number_text(CONVERGED)), done, on)
        w.place(on)
        again = w.both(w.compare("ord", size, size), w.word_test("slt", w.get(turns, "i64"), str(ITERATIONS)))
        stuck = w.fresh("stuck")
        w.branch(again, turn, stuck)
        w.place(stuck)
        w.branch(w.compare("ole", size, number_text(ACCEPTABLE)), done, failed)
        w.place(failed)
        self.all(lambda i: w.put(number_text(float("nan")), self.address(places.trial_w, i)))
        w.place(done)
        w.do("ret void")

    def correction(self) -> str:
        """The largest correction over ``1 + |w|``; NaN where one is."""
        w, places = self.w, self.places
        largest = w.variable("double", number_text(0.0))

        def compare(i: str) -> None:
            value = w.get(self.address(places.trial_w, i))
            size = w.absolute(w.subtract(value, w.get(self.address(places.before, i))))
            part = w.divide(size, w.add(number_text(1.0), w.absolute(value)))
            known = w.get(largest)
            w.put(
                w.select(
                    w.compare("ogt", known, part), known, w.add(part, w.multiply(known, number_text(0.0)))
                ),
                largest,
            )

        self.all(compare)
        return w.get(largest)

    def walk(self, before: str) -> None:
        """``w -= lambda d`` with ``lambda`` halved until the residual falls, a dozen times at most."""
        w, places = self.w, self.places
        turn, accepted, shorter = (w.fresh(stem) for stem in ("walk", "accepted", "shorter"))
        length = w.variable("double", number_text(1.0))
        w.place(turn)
        factor = w.negate(w.get(length))

        def move(i: str) -> None:
            d, start = w.get(self.address(places.residual, i)), w.get(self.address(places.before, i))
            w.put(w.fma(factor, d, start), self.address(places.trial_w, i))

        self.all(move)
        # The eliminated Jacobian is done with: its first row takes the new residual.
        self.evaluate("residual", places.jacobian)
        after = self.square(places.jacobian)
        fell = w.compare("ole", after, before)
        short = w.compare("ole", w.get(length), number_text(2.0**-HALVINGS))
        w.branch(w.either(fell, short), accepted, shorter)
        w.place(shorter)
        w.put(w.multiply(w.get(length), number_text(0.5)), length)
        w.jump(turn)
        w.place(accepted)

    def eliminate(self) -> None:
        """``residual`` becomes the correction: Gaussian elimination with row pivoting, in place."""
        w, size = self.w, str(self.n)

        def column(k: str) -> None:
            self.pivot(k)
            below = w.word_op("add", k, "1")

            def row(i: str) -> None:
                factor = w.negate(w.divide(w.get(self.entry(i, k)), w.get(self.entry(k, k))))

                def subtract(j: str) -> None:
                    target = self.entry(i, j)
                    w.put(w.fma(factor, w.get(self.entry(k, j)), w.get(target)), target)

                self.w.count(below, size, subtract)
                right = self.address(self.places.residual, i)
                w.put(w.fma(factor, w.get(self.address(self.places.residual, k)), w.get(right)), right)

            self.w.count(below, size, row)

        self.all(column)

        def back(turn: str) -> None:
            k = w.word_op("sub", str(self.n - 1), turn)
            right = self.address(self.places.residual, k)

            def subtract(j: str) -> None:
                known = w.negate(w.get(self.address(self.places.residual, j)))
                w.put(w.fma(known, w.get(self.entry(k, j)), w.get(right)), right)

            self.w.count(w.word_op("add", k, "1"), size, subtract)
            w.put(w.divide(w.get(right), w.get(self.entry(k, k))), right)

        self.all(back)

    def pivot(self, k: str) -> None:
        """Bring the row with the largest entry of column ``k`` to its place."""
        w = self.w
        best = w.variable("i64", k)

        def look(i: str) -> None:
            known = w.get(best, "i64")
            larger = w.compare(
                "ogt", w.absolute(w.get(self.entry(i, k))), w.absolute(w.get(self.entry(known, k)))
            )
            w.put(w.let(f"select i1 {larger}, i64 {i}, i64 {known}"), best, "i64")

        self.w.count(w.word_op("add", k, "1"), str(self.n), look)
        row = w.get(best, "i64")

        def swap(one: str, other: str) -> None:
            a, b = w.get(one), w.get(other)
            w.put(b, one)
            w.put(a, other)

        self.w.count(k, str(self.n), lambda j: swap(self.entry(k, j), self.entry(row, j)))
        swap(self.address(self.places.residual, k), self.address(self.places.residual, row))
