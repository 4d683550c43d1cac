"""The tape's ``SOLVE`` as LLVM IR: dense linear equations over one or more lanes.

Gaussian elimination with row pivoting. Rows are compared beside their largest entries, so that no scaling of
an equation changes the choice (Golub, Van Loan, *Matrix Computations*, 4th ed., 3.5.2). One correction by the
residual in working precision then makes every equation hold to rounding beside its own terms (Skeel, *Math.
Comp.* 35 (1980) 817-832). Each lane exchanges its own rows, by selects: all lanes take the same steps, and
the bits are those of one lane.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from armblocks.compiler.ir_routine import Routine
from armblocks.compiler.ir_text import Body, Module
from armblocks.compiler.opcodes import solution_length
from armblocks.compiler.tape import Tape

SHORTEST_BLOCK = 8
"""From so many neighbours on, inputs are copied in one go: LLVM compares loads and stores pair by pair."""


def emit_linear_solution(
    body: Body,
    tape: Tape,
    operands: Sequence[int],
    number: Callable[[int], str],
    address: Callable[[int], str | None],
) -> list[str]:
    """The values of the members of a ``SOLVE``.

    ``number(register)`` gives a register's value, ``address`` where an input lies with those after it.
    """
    n, module = solution_length(len(operands)), body.module
    symbol = f"linear_solution.{n}.{body.lanes}"
    module.define(symbol, lambda: _Solver(module, n, body.lanes, symbol).text())
    module.declare("ptr", "llvm.stacksave.p0")
    module.declare("void", "llvm.stackrestore.p0", "ptr")
    stack = body.let("call ptr @llvm.stacksave.p0()")
    align = 8 * body.lanes
    memory = body.let(f"alloca {body.real}, i64 {_Solver.length(n)}, align {align}")

    def place(index: int) -> str:
        return body.let(f"getelementptr inbounds {body.real}, ptr {memory}, i64 {index}")

    for index, length in _blocks(tape, operands):
        source = address(operands[index]) if length >= SHORTEST_BLOCK else None
        if source is not None:
            module.declare("void", "llvm.memcpy.p0.p0.i64", "ptr", "ptr", "i64", "i1")
            ends = f"ptr align 8 {place(index)}, ptr align 8 {source}"
            body.do(f"call void @llvm.memcpy.p0.p0.i64({ends}, i64 {8 * length}, i1 false)")
            continue
        for k in range(index, index + length):
            body.do(f"store {body.real} {number(operands[k])}, ptr {place(k)}, align {align}")
    body.do(f"call void @{symbol}(ptr {memory})")
    start = n * (n + 1)
    solution = [body.let(f"load {body.real}, ptr {place(start + k)}, align {align}") for k in range(n)]
    body.do(f"call void @llvm.stackrestore.p0(ptr {stack})")
    return solution


def _blocks(tape: Tape, operands: Sequence[int]) -> Iterator[tuple[int, int]]:
    """First place and length of each run of neighbouring inputs of one slot, and of each other operand."""
    start = 0
    for k in range(1, len(operands) + 1):
        follows = k < len(operands) and operands[k] == operands[k - 1] + 1 < tape.first_constant
        if follows and tape.input_place(operands[k])[1] > 0:
            continue
        yield start, k - start
        start = k


class _LaneRoutine(Routine):
    """A routine whose numbers have several lanes; integers and control flow are those of all of them."""

    def __init__(self, module: Module, lanes: int) -> None:
        super().__init__(module)
        self.lanes = lanes
        self.real, self.bit = self.type("double"), self.type("i1")


class _Solver:
    """Writes ``void f(ptr m)``; ``m`` has the matrix, the right side, the solution, then work space."""

    def __init__(self, module: Module, n: int, lanes: int, symbol: str) -> None:
        self.w = _LaneRoutine(module, lanes)
        self.n = n
        self.symbol = symbol
        self.matrix = 0
        self.right = n * n
        self.solution = self.right + n
        self.factors = self.solution + n
        self.weights = self.factors + n * n
        self.work = self.weights + n

    @staticmethod
    def length(n: int) -> int:
        """Numbers in the memory that the function gets."""
        return 2 * n * n + 4 * n

    def text(self) -> str:
        self.prepare()
        self.count("0", self.eliminate)
        self.count("0", lambda i: self.put(self.get(self.right, i), self.work, i))
        self.substitute()
        self.count("0", lambda i: self.put(self.get(self.work, i), self.solution, i))
        self.count("0", self.leave_residual)
        self.substitute()
        self.count("0", self.correct)
        self.w.do("ret void")
        return self.w.text(f"define internal void @{self.symbol}(ptr %m) nounwind noinline")

    # Memory and loops.

    def count(self, start: str, write: Callable[[str], None], stop: str | None = None) -> None:
        self.w.count(start, stop or str(self.n), write)

    def address(self, place: int, index: str) -> str:
        return self.w.at("%m", self.w.word_op("add", index, str(place)), self.w.real)

    def get(self, place: int, index: str) -> str:
        return self.w.get(self.address(place, index), self.w.real)

    def put(self, value: str, place: int, index: str) -> None:
        self.w.put(value, self.address(place, index), self.w.real)

    def entry(self, row: str, column: str) -> str:
        return self.w.word_op("add", self.w.word_op("mul", row, str(self.n)), column)

    # The parts.

    def prepare(self) -> None:
        """The factors begin as the matrix; the weight of a row is its largest entry's reciprocal."""
        w = self.w

        def row(i: str) -> None:
            self.put(w.number(0.0), self.weights, i)

            def take(j: str) -> None:
                place = self.entry(i, j)
                value = self.get(self.matrix, place)
                self.put(value, self.factors, place)
                size, known = w.absolute(value), self.get(self.weights, i)
                self.put(w.select(w.compare("ogt", size, known), size, known), self.weights, i)

            self.count("0", take)
            self.put(w.divide(w.number(1.0), self.get(self.weights, i)), self.weights, i)

        self.count("0", row)

    def eliminate(self, k: str) -> None:
        """The row of the largest weighted entry to place ``k``, then column ``k`` out of the rows below."""
        w = self.w
        below = w.word_op("add", k, "1")

        def exchange(i: str) -> None:
            sizes = [
                w.multiply(
                    w.absolute(self.get(self.factors, self.entry(row, k))), self.get(self.weights, row)
                )
                for row in (i, k)
            ]
            larger = w.compare("ogt", *sizes)

            def swap(place: int, one: str, other: str) -> None:
                a, b = self.get(place, one), self.get(place, other)
                self.put(w.select(larger, b, a), place, one)
                self.put(w.select(larger, a, b), place, other)

            def swap_rows() -> None:
                for place in (self.factors, self.matrix):
                    self.count("0", lambda j: swap(place, self.entry(i, j), self.entry(k, j)))  # noqa: B023
                for place in (self.weights, self.right):
                    swap(place, i, k)

            if w.lanes > 1:
                swap_rows()
                return
            exchanged, kept = w.fresh("exchange"), w.fresh("kept")
            w.branch(larger, exchanged, kept)
            w.place(exchanged)
            swap_rows()
            w.place(kept)

        self.count(below, exchange)

        def row(i: str) -> None:
            own = self.entry(i, k)
            factor = w.divide(self.get(self.factors, own), self.get(self.factors, self.entry(k, k)))
            self.put(factor, self.factors, own)
            minus = w.negate(factor)

            def subtract(j: str) -> None:
                target = self.entry(i, j)
                upper = self.get(self.factors, self.entry(k, j))
                self.put(w.fma(minus, upper, self.get(self.factors, target)), self.factors, target)

            self.count(below, subtract)

        self.count(below, row)

    def substitute(self) -> None:
        """``work`` becomes the solution for the right side that stands there."""
        w = self.w

        def less(i: str, j: str) -> None:
            known = w.negate(self.get(self.work, j))
            factor = self.get(self.factors, self.entry(i, j))
            self.put(w.fma(known, factor, self.get(self.work, i)), self.work, i)

        self.count("0", lambda i: self.count("0", lambda j: less(i, j), i))

        def back(turn: str) -> None:
            i = w.word_op("sub", str(self.n - 1), turn)
            self.count(w.word_op("add", i, "1"), lambda j: less(i, j))
            pivot = self.get(self.factors, self.entry(i, i))
            self.put(w.divide(self.get(self.work, i), pivot), self.work, i)

        self.count("0", back)

    def leave_residual(self, i: str) -> None:
        w = self.w
        self.put(self.get(self.right, i), self.work, i)

        def subtract(j: str) -> None:
            known = w.negate(self.get(self.solution, j))
            entry = self.get(self.matrix, self.entry(i, j))
            self.put(w.fma(known, entry, self.get(self.work, i)), self.work, i)

        self.count("0", subtract)

    def correct(self, i: str) -> None:
        corrected = self.w.add(self.get(self.solution, i), self.get(self.work, i))
        self.put(corrected, self.solution, i)
