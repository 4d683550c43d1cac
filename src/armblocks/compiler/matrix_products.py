"""Products of a matrix and a vector: recognised in a tape, and written as LLVM IR.

In a tape, an input matrix (such as the parameter of a matrix gain) times a vector is a chain of multiply-adds
for each row. 500 by 500 entries are half a million instructions, for which LLVM takes many minutes.
:func:`with_matrix_products` finds the chains and replaces them by one ``PRODUCT``, which multiplies and adds
in the same order. The results are therefore bitwise identical.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from armblocks.compiler.ir_text import Body
from armblocks.compiler.lane_memory import Line
from armblocks.compiler.opcodes import Opcode
from armblocks.compiler.program_text import add_program
from armblocks.compiler.tape import Operation, Tape
from armblocks.compiler.work_space import WorkSpace
from armblocks.routines.arithmetic import fma, in_all_lanes
from armblocks.routines.lanes import LaneArray, Lanes
from armblocks.routines.memory import NumberArray, Reals
from armblocks.routines.routine import Program, Routine
from armblocks.routines.values import Integer, NumberT

MIN_ROW_LENGTH = 8
"""Minimum number of products in a row; shorter chains are unchanged."""
MIN_ENTRIES = 256
"""Minimum number of entries of a matrix. LLVM keeps the vectors of smaller products in registers."""
MAX_ROWS = 256
"""Maximum number of rows of a ``PRODUCT``, which limits the length of the function that reads its results."""
PARALLEL_ROWS = 8
"""Number of sums computed in parallel: a multiply-add takes 4 cycles, and two can start in each cycle."""


@dataclass(frozen=True, kw_only=True)
class _Row:
    """``c + a1 x1 + … + an xn`` as the operations ``members`` of a tape, with ``a1`` in register ``first``.

    ``start`` is the register of ``c``, or ``None`` without ``c``.
    """

    first: int
    vector: tuple[int, ...]
    start: int | None
    members: tuple[int, ...]

    @property
    def last(self) -> int:
        """The operation that computes the result."""
        return self.members[-1]


def with_matrix_products(tape: Tape) -> Tape:
    """The tape with each large product of an input matrix, row by row, and a vector as one operation."""
    choices = [rows for chain in _chains(tape) for rows in _rows(tape, chain)]
    # If the factors of both sides are contiguous in memory, the side that several rows share is the vector.
    shared = Counter(row.vector for rows in choices for row in rows)
    chosen_rows = [max(rows, key=lambda row: shared[row.vector]) for rows in choices]
    products = [group for group in _matrices(tape, chosen_rows) if _entries(group) >= MIN_ENTRIES]
    return _with_products(tape, products) if products else tape


def _entries(rows: Sequence[_Row]) -> int:
    return sum(len(row.vector) for row in rows)


def _chains(tape: Tape) -> Iterator[list[int]]:
    """Chains of operations that each add a product to the sum of the previous operation.

    No other operation reads these sums.
    """
    first = tape.first_operation
    uses = [0] * tape.size
    for _, operands in tape.operations:
        for register in operands:
            uses[register] += 1
    for slot in tape.outputs:
        for register in slot:
            uses[register] += 1
    following: dict[int, int] = {}
    for k, (opcode, operands) in enumerate(tape.operations):
        if opcode is Opcode.FMA:
            a, b, c = operands
            inner = tape.operations[c - first].opcode if c >= first else None
            if inner in (Opcode.FMA, Opcode.MULTIPLY) and uses[c] == 1 and c not in (a, b):
                following[c - first] = k
    chain_starts = set(following) - set(following.values())
    for k in sorted(chain_starts):
        chain = [k]
        while (after := following.get(chain[-1])) is not None:
            chain.append(after)
        if len(chain) >= MIN_ROW_LENGTH:
            yield chain


def _rows(tape: Tape, chain: Sequence[int]) -> Iterator[list[_Row]]:
    """The parts of a chain whose factors on one side are contiguous inputs.

    Each part is given as one row, or as two alternatives if the factors of both sides are contiguous.
    """
    position = 0
    while position < len(chain):
        runs = [_run(tape, chain, position, side) for side in (0, 1)]
        length = max(map(len, runs))
        if length >= MIN_ROW_LENGTH:
            opcode, operands = tape.operations[chain[position]]
            yield [
                _Row(
                    first=run[0][0],
                    vector=tuple(x for _, x in run),
                    start=operands[2] if opcode is Opcode.FMA else None,
                    members=tuple(chain[position : position + length]),
                )
                for run in runs
                if len(run) == length
            ]
        position += max(1, length)


def _run(tape: Tape, chain: Sequence[int], position: int, side: int) -> list[tuple[int, int]]:
    """Pairs of a matrix entry and its factor, beginning with the operation at ``position``.

    ``side`` is the operand of this operation that is the first entry.
    """
    entry = tape.operations[chain[position]].operands[side]
    if entry >= tape.first_constant:
        return []
    slot = tape.input_position(entry)[0]
    end = tape.input_starts[slot + 1]
    run: list[tuple[int, int]] = []
    for k in chain[position:]:
        a, b = tape.operations[k].operands[:2]
        if entry == end or entry not in (a, b):
            break
        run.append((entry, b if a == entry else a))
        entry += 1
    return run


def _matrices(tape: Tape, rows: Sequence[_Row]) -> Iterator[list[_Row]]:
    """Groups of rows with the same vector that are contiguous in memory and do not depend on each other."""
    by_vector: dict[tuple[int, ...], list[_Row]] = {}
    for row in rows:
        by_vector.setdefault(row.vector, []).append(row)
    for vector, rows_of_vector in by_vector.items():
        matrix: list[_Row] = []
        for row in sorted(rows_of_vector, key=lambda row: row.first):
            extended = [*matrix, row]
            first_result = tape.first_operation + min(row.last for row in extended)
            belongs = not matrix or (
                row.first == matrix[-1].first + len(vector)
                and tape.input_position(row.first)[0] == tape.input_position(matrix[0].first)[0]
                and len(matrix) < MAX_ROWS
                and all(row.start is None or row.start < first_result for row in extended)
            )
            if not belongs:
                yield matrix
            matrix = extended if belongs else [row]
        yield matrix


def _with_products(tape: Tape, products: Sequence[Sequence[_Row]]) -> Tape:
    """The tape with a ``PRODUCT`` for each group of rows, at the position of the first of its results."""
    constants = list(tape.constants)
    registers: dict[str, int] = {}

    def constant(value: float) -> int:
        text = value.hex()
        if text not in registers:
            registers[text] = tape.first_constant + len(constants)
            constants.append(value)
        return registers[text]

    heads: dict[int, tuple[Sequence[_Row], list[int]]] = {}
    removed: set[int] = set()
    for rows in products:
        sizes = [constant(float(len(rows))), constant(float(len(rows[0].vector)))]
        heads[min(row.last for row in rows)] = rows, sizes
        removed.update(member for row in rows for member in row.members)
    indices = [constant(float(k)) for k in range(max(len(rows) for rows in products))]
    minus_zero = constant(-0.0)  # a b + -0 has the bits of a b
    register = list(range(tape.first_operation)) + [-1] * len(tape.operations)
    operations: list[Operation] = []
    first = tape.first_constant + len(constants)
    for k, (opcode, operands) in enumerate(tape.operations):
        if k in heads:
            rows, sizes = heads[k]
            starts = [minus_zero if row.start is None else register[row.start] for row in rows]
            vector = [register[x] for x in rows[0].vector]
            product = first + len(operations)
            operations.append(Operation(Opcode.PRODUCT, (rows[0].first, *sizes, *vector, *starts)))
            for index, row in enumerate(rows):
                register[tape.first_operation + row.last] = first + len(operations)
                operations.append(Operation(Opcode.MEMBER, (product, indices[index])))
        if k not in removed:
            register[tape.first_operation + k] = first + len(operations)
            operations.append(Operation(opcode, tuple(register[operand] for operand in operands)))
    outputs = tuple(tuple(register[member] for member in slot) for slot in tape.outputs)
    return replace(tape, constants=tuple(constants), operations=tuple(operations), outputs=outputs)


def emit_matrix_product(
    body: Body,
    tape: Tape,
    operands: Sequence[int],
    number: Callable[[int], str],
    line: Callable[[int], Line],
) -> list[str]:
    """The values of the members of a ``PRODUCT``.

    ``number(register)`` returns the value of a register, ``line`` the memory positions of an input and the
    inputs that follow it.
    """
    first = operands[0]
    m, n = product_shape(tape, operands)
    vector, starts = operands[3 : 3 + n], operands[3 + n :]
    matrix = line(first)
    is_plain = matrix.is_plain_array(body.lanes)
    program = Program(body.lanes)
    if is_plain:
        symbol = program.define(matrix_product, f"matrix_product.{body.lanes}", inlined=False).symbol
    else:
        name = f"matrix_product_in_each_lane.{body.lanes}"
        symbol = program.define(matrix_product_in_each_lane, name, inlined=False).symbol
    add_program(body.module, program)
    space = WorkSpace(body, m + n if is_plain else m + n + m * n)
    address = matrix.address if is_plain else space.row(m + n)
    if not is_plain:  # every sample of a batch has its own matrix
        matrix.copy(body, address, m * n)
    for k, register in enumerate([*starts, *vector]):
        space.write(k, number(register))
    pointers = f"ptr {address}, ptr {space.row(m)}, ptr {space.address}"
    body.do(f"call void @{symbol}({pointers}, i64 {m}, i64 {n})")
    sums = [space.read(i) for i in range(m)]
    space.free()
    return sums


def product_shape(tape: Tape, operands: Sequence[int]) -> tuple[int, int]:
    """Rows and columns of the matrix of a ``PRODUCT``."""
    rows, columns = (int(tape.constants[register - tape.first_constant]) for register in operands[1:3])
    return rows, columns


def matrix_product(r: Routine, A: Reals, x: LaneArray, y: LaneArray, m: Integer, n: Integer) -> None:
    """``y += A x`` in every lane, for ``A`` (m, n) stored by rows; sums are evaluated from left to right."""
    _add_product(r, A, in_all_lanes, x, y, m, n)


def matrix_product_in_each_lane(
    r: Routine, A: LaneArray, x: LaneArray, y: LaneArray, m: Integer, n: Integer
) -> None:
    """:func:`matrix_product` with a matrix for each lane."""
    _add_product(r, A, lambda entry: entry, x, y, m, n)


def _add_product(
    r: Routine,
    A: NumberArray[NumberT],
    in_lanes: Callable[[NumberT], Lanes],
    x: LaneArray,
    y: LaneArray,
    m: Integer,
    n: Integer,
) -> None:
    row = r.integer(0)

    def add_rows(count: int) -> None:
        start = row.value
        sums = [r.variable(y[start + k]) for k in range(count)]
        lines = [A.after((start + k) * n) for k in range(count)]
        for j in r.range(0, n):
            factor = x[j]
            for line, total in zip(lines, sums):
                total.value = fma(in_lanes(line[j]), factor, total.value)
        for k, total in enumerate(sums):
            y[start + k] = total.value
        row.value = start + count

    for count in (PARALLEL_ROWS, 1):
        with r.loop() as iteration:
            iteration.leave_when(row.value + count > m)
            add_rows(count)
