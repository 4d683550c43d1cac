"""The tape's ``SOLVE``: dense linear equations over one or more lanes.

Gaussian elimination with row pivoting. Pivots are chosen relative to the largest entry of their row, so that
scaling an equation does not change the choice (Golub, Van Loan, *Matrix Computations*, 4th ed., 3.5.2). One
step of iterative refinement in working precision makes the residual of every equation as small as the
rounding error of its terms (Skeel, *Math. Comp.* 35 (1980) 817-832). Each lane exchanges its rows by select
instructions. All lanes run the same instructions, and the results are bit-identical to the results with one
lane.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from armblocks.compiler.ir_text import Body, Module
from armblocks.compiler.lane_memory import Line
from armblocks.compiler.opcodes import solution_length
from armblocks.compiler.program_text import add_program
from armblocks.compiler.tape import Tape
from armblocks.compiler.work_space import WorkSpace
from armblocks.routines.arithmetic import select
from armblocks.routines.full_matrix import FullMatrix
from armblocks.routines.lanes import LaneArray, Lanes, Mask
from armblocks.routines.memory import NumberArray
from armblocks.routines.routine import Program, Routine
from armblocks.routines.values import Integer

MIN_BLOCK = 8
"""Minimum number of neighbouring inputs that are copied as a block, with one lane.

LLVM compares loads and stores pair by pair, so blocks compile faster.
"""
MIN_BLOCK_OF_LANES = 256
"""The same minimum with several lanes. Fewer inputs are read faster as whole registers."""
MIN_LARGE_SYSTEM = 24
"""Minimum number of unknowns at which ``MIN_BLOCK`` applies to several lanes too.

The elimination then takes so long that the time for reading is negligible.
"""


def emit_linear_solution(
    body: Body,
    tape: Tape,
    operands: Sequence[int],
    number: Callable[[int], str],
    line: Callable[[int], Line],
) -> list[str]:
    """The values of the members of a ``SOLVE``.

    ``number(register)`` returns the value of a register, ``line`` the memory positions of an input and the
    inputs that follow it.
    """
    n, module = solution_length(len(operands)), body.module
    symbol = f"linear_solution.{n}.{body.lanes}"
    _define(module, symbol, n, body.lanes)
    space = WorkSpace(body, _Solver.length(n))
    is_small = body.lanes > 1 and n < MIN_LARGE_SYSTEM
    min_block = MIN_BLOCK_OF_LANES if is_small else MIN_BLOCK
    for index, length in _blocks(tape, operands):
        if length >= min_block:
            line(operands[index]).copy(body, space.row(index), length)
            continue
        for k in range(index, index + length):
            space.write(k, number(operands[k]))
    body.do(f"call void @{symbol}(ptr {space.address})")
    start = n * (n + 1)
    solution = [space.read(start + k) for k in range(n)]
    space.free()
    return solution


def _define(module: Module, symbol: str, n: int, lanes: int) -> None:
    def solve(r: Routine, m: LaneArray) -> None:
        _Solver(n, m).write(r)

    if symbol not in module:
        program = Program(lanes)
        program.define(solve, symbol, inlined=False)
        add_program(module, program)


def _blocks(tape: Tape, operands: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Index and length of each run of contiguous inputs of one slot, and of each other operand."""
    start = 0
    for k in range(1, len(operands) + 1):
        continues = k < len(operands) and operands[k] == operands[k - 1] + 1 < tape.first_constant
        if continues and tape.input_position(operands[k])[1] > 0:
            continue
        yield start, k - start
        start = k


class _Solver:
    """Emits the function; its memory ``m`` has the matrix, right-hand side, solution, then work space."""

    def __init__(self, n: int, m: LaneArray) -> None:
        self.n = n
        self.matrix = FullMatrix(size=n, numbers=m)
        self.right = m.after(n * n)
        self.solution = self.right.after(n)
        self.factors = FullMatrix(size=n, numbers=self.solution.after(n))
        self.weights = self.factors.numbers.after(n * n)
        self.work = self.weights.after(n)

    @staticmethod
    def length(n: int) -> int:
        """Rows of lanes in the memory."""
        return 2 * n * n + 4 * n

    def write(self, r: Routine) -> None:
        """Solve the equations, and refine the solution once."""
        self.prepare(r)
        for k in r.range(0, self.n):
            self.pivot(r, k)
            self.eliminate(r, k)
        for i in r.range(0, self.n):
            self.work[i] = self.right[i]
        self.substitute(r)
        for i in r.range(0, self.n):
            self.solution[i] = self.work[i]
        for i in r.range(0, self.n):
            self.work[i] = self.matrix.less_products(r, self.right[i], i, self.solution, 0, self.n)
        self.substitute(r)
        for i in r.range(0, self.n):
            self.solution[i] = self.solution[i] + self.work[i]

    def prepare(self, r: Routine) -> None:
        """Copy the matrix, and set the weight of each row to the reciprocal of its largest entry."""
        for i in r.range(0, self.n):
            largest = r.variable(Lanes.constant(r, 0.0))
            for j in r.range(0, self.n):
                index = self.matrix.index(i, j)
                value = self.matrix.numbers[index]
                self.factors.numbers[index] = value
                size, previous = abs(value), largest.value
                largest.value = select(size > previous, size, previous)
            self.weights[i] = 1.0 / largest.value

    def pivot(self, r: Routine, k: Integer) -> None:
        """Exchange row ``k``, in each lane, with the row of the largest weighted entry in column ``k``."""
        for i in r.range(k + 1, self.n):
            larger = self.weighted(i, k) > self.weighted(k, k)
            with r.when(larger.any):
                for matrix in (self.factors, self.matrix):
                    for j in r.range(0, self.n):
                        exchange(larger, matrix.numbers, matrix.index(i, j), matrix.index(k, j))
                for column in (self.weights, self.right):
                    exchange(larger, column, i, k)

    def weighted(self, row: Integer, column: Integer) -> Lanes:
        """Magnitude of an entry relative to the largest entry of its row."""
        return abs(self.factors.numbers[self.factors.index(row, column)]) * self.weights[row]

    def eliminate(self, r: Routine, k: Integer) -> None:
        """Eliminate column ``k`` from the rows below row ``k``."""
        factors, index = self.factors.numbers, self.factors.index
        for i in r.range(k + 1, self.n):
            factor = factors[index(i, k)] / factors[index(k, k)]
            factors[index(i, k)] = factor
            self.factors.subtract_from_row(r, i, factor, k)

    def substitute(self, r: Routine) -> None:
        """Replace the right-hand side in ``work`` by the solution."""
        factors = self.factors
        factors.substitute(r, self.work, lambda value, i: value / factors.numbers[factors.index(i, i)])


def exchange(where: Mask, array: NumberArray[Lanes], one: Integer, other: Integer) -> None:
    """Exchange two rows of lanes in the lanes where the mask holds."""
    a, b = array[one], array[other]
    array[one] = select(where, b, a)
    array[other] = select(where, a, b)
