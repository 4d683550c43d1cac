"""A slow interpreter of tapes in NumPy, the reference for compiled code.

It shares only the tape with the code generator: arithmetic is NumPy's, and elementary functions come from
NumPy or the C library. Tapes without elementary functions give the same bits as compiled code when ``fused``
is true, because fused multiply-adds are then rounded once, as the hardware does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.compiler.opcodes import Opcode, solution_length
from armblocks.compiler.tape import Tape
from armblocks.errors import InputError

Values = NDArray[np.float64]


def interpret(tape: Tape, inputs: Sequence[ArrayLike], *, fused: bool = True) -> list[Values]:
    """Evaluate ``tape`` for samples.

    ``inputs[k]`` has shape ``(..., size of slot k)``; the leading shapes broadcast against each other.
    Returns one array ``(..., size)`` per output slot. With ``fused=False`` a multiply-add is rounded twice.
    Raises :class:`InputError` if the number of inputs or the size of an input is wrong.
    """
    arrays = [np.asarray(value, dtype=np.float64) for value in inputs]
    sizes = tuple(array.shape[-1] if array.ndim else -1 for array in arrays)
    if sizes != tape.input_sizes:
        raise InputError(
            f"inputs of sizes {sizes}",
            allowed=f"sizes {tape.input_sizes} on the last axis",
            where="tape",
            fix="give one array for each input of the tape",
        )
    sample_shape = np.broadcast_shapes(*(array.shape[:-1] for array in arrays))
    registers: list[Values] = []
    for array in arrays:
        registers += [np.broadcast_to(array[..., index], sample_shape) for index in range(array.shape[-1])]
    registers += [np.full(sample_shape, value) for value in tape.constants]
    with np.errstate(all="ignore"):
        for opcode, operands in tape.operations:
            if opcode is Opcode.READ:
                registers.append(_read(registers, tape, *operands))
                continue
            if opcode is Opcode.SOLVE:
                values = [registers[operand] for operand in operands]
                registers.append(_solve(values, solution_length(len(operands)), fused=fused))
                continue
            if opcode is Opcode.PRODUCT:
                registers.append(_product(registers, tape, operands, fused=fused))
                continue
            if opcode is Opcode.MEMBER:
                vector, index = operands
                registers.append(registers[vector][..., int(tape.constants[index - tape.first_constant])])
                continue
            registers.append(evaluate(opcode, [registers[operand] for operand in operands], fused=fused))
    return [
        np.stack([registers[register] for register in slot], axis=-1)
        if slot
        else np.empty((*sample_shape, 0))
        for slot in tape.outputs
    ]


def _read(registers: Sequence[Values], tape: Tape, first: int, count: int, index: int) -> Values:
    """The entries of a table at the indices."""
    size = int(tape.constants[count - tape.first_constant])
    entries = np.clip(np.nan_to_num(np.trunc(registers[index]), nan=0.0), 0, size - 1).astype(np.intp)
    values = np.empty(entries.shape)
    for entry in np.unique(entries):
        is_entry = entries == entry
        values[is_entry] = registers[first + int(entry)][is_entry]
    return values


def _product(registers: Sequence[Values], tape: Tape, operands: Sequence[int], *, fused: bool) -> Values:
    """The sums (…, m) of a matrix (m, n) times a vector, term by term."""
    m, n = (int(tape.constants[size - tape.first_constant]) for size in operands[1:3])
    matrix = np.stack(registers[operands[0] : operands[0] + m * n], axis=-1)
    sums = np.stack([registers[start] for start in operands[3 + n :]], axis=-1)
    for j, x in enumerate(operands[3 : 3 + n]):
        values = [matrix[..., j::n], np.broadcast_to(registers[x][..., None], sums.shape), sums]
        sums = evaluate(Opcode.FMA, values, fused=fused)
    return sums


def _solve(values: Sequence[Values], n: int, *, fused: bool) -> Values:
    """The solutions (…, n) of linear equations, step by step as :mod:`armblocks.compiler.linear_solution`."""
    stacked = np.stack(values, axis=-1)
    matrix, right = stacked[..., : n * n].reshape((*stacked.shape[:-1], n, n)), stacked[..., n * n :].copy()

    def subtract_product(a: Values, b: Values, c: Values) -> Values:
        """``c - a b``."""
        return multiply_add(-a, *np.broadcast_arrays(b, c)) if fused else c - a * b

    weights = 1.0 / np.max(np.where(np.isnan(matrix), 0.0, np.abs(matrix)), axis=-1)
    # Each exchange concerns the rows of the factors and of the matrix, the weight and the right-hand side.
    rows = np.concatenate([matrix, matrix, weights[..., None], right[..., None]], axis=-1)
    for k in range(n):
        for i in range(k + 1, n):
            sizes = [np.abs(rows[..., row, k]) * rows[..., row, 2 * n] for row in (i, k)]
            larger = (sizes[0] > sizes[1])[..., None]
            first, second = rows[..., k, :].copy(), rows[..., i, :].copy()
            rows[..., k, :], rows[..., i, :] = (
                np.where(larger, second, first),
                np.where(larger, first, second),
            )
        for i in range(k + 1, n):
            factor = rows[..., i, k] / rows[..., k, k]
            rows[..., i, k] = factor
            if k + 1 < n:
                span = slice(k + 1, n)
                factors = np.broadcast_to(factor[..., None], rows[..., k, span].shape)
                rows[..., i, span] = subtract_product(factors, rows[..., k, span], rows[..., i, span])
    matrix, right = rows[..., n : 2 * n], rows[..., 2 * n + 1]

    def substitute(work: Values) -> Values:
        work = work.copy()
        for i in range(n):
            for j in range(i):
                work[..., i] = subtract_product(work[..., j], rows[..., i, j], work[..., i])
        for i in reversed(range(n)):
            for j in range(i + 1, n):
                work[..., i] = subtract_product(work[..., j], rows[..., i, j], work[..., i])
            work[..., i] = work[..., i] / rows[..., i, i]
        return work

    solution = substitute(right)
    residual = right.copy()
    for i in range(n):
        for j in range(n):
            residual[..., i] = subtract_product(solution[..., j], matrix[..., i, j], residual[..., i])
    return solution + substitute(residual)


def evaluate(opcode: Opcode, values: Sequence[Values], *, fused: bool = True) -> Values:
    """One operation on arrays of equal shape."""
    if opcode in (Opcode.FMA, Opcode.FMS, Opcode.FNMA):
        a, b, c = values
        a = -a if opcode is Opcode.FNMA else a
        c = -c if opcode is Opcode.FMS else c
        return multiply_add(a, b, c) if fused else a * b + c
    return np.asarray(_RULES[opcode](*values), dtype=np.float64)


def multiply_add(a: Values, b: Values, c: Values) -> Values:
    """``a b + c`` rounded once.

    Where no intermediate result can leave the range of normal numbers, the product and the sum are computed
    without error (Dekker 1971, Knuth), and the low part is added with rounding to odd (Boldo and Melquiond,
    "Emulation of FMA and correctly rounded sums", IEEE Trans. Computers 57, 2008, section 3). Elsewhere exact
    fractions are used.
    """
    product, product_error = _two_product(a, b)
    high, low = _two_sum(product, c)
    residual, residual_error = _two_sum(product_error, low)
    # Round to odd: if the sum was inexact and its last bit is even, step towards the error.
    even = (residual.view(np.int64) & 1) == 0
    target = np.where(residual_error > 0.0, np.inf, -np.inf)
    odd = np.where((residual_error != 0.0) & even, np.nextafter(residual, target), residual)
    result = np.asarray(high + odd)
    size = [np.abs(value) for value in (a, b, c, product)]
    in_range = np.all([(value < 1e250) & ((value > 1e-250) | (value == 0.0)) for value in size], axis=0)
    # The splitting may lose the sign of a product of zero and of a sum that cancels exactly.
    in_range &= (product != 0.0) & (result != 0.0)
    for position in zip(*np.nonzero(np.atleast_1d(~in_range))):
        at = position if result.ndim else ()
        result[at] = _exact_multiply_add(float(a[at]), float(b[at]), float(c[at]))
    return result


def _two_product(a: Values, b: Values) -> tuple[Values, Values]:
    def split(x: Values) -> tuple[Values, Values]:
        scaled = 134217729.0 * x
        high = scaled - (scaled - x)
        return high, x - high

    product = a * b
    (ah, al), (bh, bl) = split(a), split(b)
    return product, al * bl - (((product - ah * bh) - al * bh) - ah * bl)


def _two_sum(a: Values, b: Values) -> tuple[Values, Values]:
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def _exact_multiply_add(a: float, b: float, c: float) -> float:
    if not (math.isfinite(a) and math.isfinite(b) and math.isfinite(c)):
        return c if math.isfinite(a) and math.isfinite(b) else a * b + c
    exact = Fraction(a) * Fraction(b) + Fraction(c)
    if exact == 0:
        return a * b + c if a == 0.0 or b == 0.0 or c == 0.0 else 0.0
    try:
        rounded = float(exact)
    except OverflowError:
        rounded = math.inf
    return math.copysign(rounded, 1 if exact > 0 else -1)


def _select(condition: Values, yes: Values, no: Values) -> Values:
    return np.where(condition != 0.0, yes, no)


def _minimum(a: Values, b: Values) -> Values:
    return np.where(np.isnan(a) | (a < b), a, b)


def _maximum(a: Values, b: Values) -> Values:
    return np.where(np.isnan(a) | (a > b), a, b)


def _sign(a: Values) -> Values:
    return np.where(a > 0.0, 1.0, np.where(a < 0.0, -1.0, a))


def _remainder(a: Values, b: Values) -> Values:
    def scalar(x: float, y: float) -> float:
        try:
            return math.remainder(x, y)
        except ValueError:  # an infinite dividend or a zero divisor
            return math.nan

    return np.vectorize(scalar, otypes=[np.float64])(a, b)


def _per_sample(function: Callable[[float], float]) -> Callable[[Values], Values]:
    return np.vectorize(function, otypes=[np.float64])


_RULES: dict[Opcode, Callable[..., Any]] = {
    Opcode.ADD: np.add,
    Opcode.SUBTRACT: np.subtract,
    Opcode.MULTIPLY: np.multiply,
    Opcode.DIVIDE: np.divide,
    Opcode.NEGATE: np.negative,
    Opcode.SQUARE_ROOT: np.sqrt,
    Opcode.ABSOLUTE: np.abs,
    Opcode.SIGN: _sign,
    Opcode.FLOOR: np.floor,
    Opcode.CEILING: np.ceil,
    Opcode.MINIMUM: _minimum,
    Opcode.MAXIMUM: _maximum,
    Opcode.COPY_SIGN: np.copysign,
    Opcode.MODULO: np.fmod,
    Opcode.REMAINDER: _remainder,
    Opcode.LESS: np.less,
    Opcode.LESS_EQUAL: np.less_equal,
    Opcode.EQUAL: np.equal,
    Opcode.NOT_EQUAL: np.not_equal,
    Opcode.NOT: np.logical_not,
    Opcode.AND: np.logical_and,
    Opcode.OR: np.logical_or,
    Opcode.SELECT: _select,
    Opcode.SIN: np.sin,
    Opcode.COS: np.cos,
    Opcode.TAN: np.tan,
    Opcode.ASIN: np.arcsin,
    Opcode.ACOS: np.arccos,
    Opcode.ATAN: np.arctan,
    Opcode.ATAN2: np.arctan2,
    Opcode.SINH: np.sinh,
    Opcode.COSH: np.cosh,
    Opcode.TANH: np.tanh,
    Opcode.ASINH: np.arcsinh,
    Opcode.ACOSH: np.arccosh,
    Opcode.ATANH: np.arctanh,
    Opcode.EXP: np.exp,
    Opcode.EXPM1: np.expm1,
    Opcode.LOG: np.log,
    Opcode.LOG1P: np.log1p,
    Opcode.POWER: np.power,
    Opcode.HYPOT: np.hypot,
    Opcode.ERF: _per_sample(math.erf),
}
