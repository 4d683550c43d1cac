"""Matrix-vector products on the tape: detection, and results equal to the sums of the traced operations."""

from __future__ import annotations

import numpy as np
import pytest
from casadi import SX, mtimes, sum1, vertcat

from armblocks.compiler import compile_function
from armblocks.compiler.interpret import interpret, multiply_add
from armblocks.compiler.matrix_products import MAX_ROWS, MIN_ENTRIES
from armblocks.compiler.opcodes import Opcode
from armblocks.compiler.tape import Tape
from armblocks.equations import Signature, Slot, TracedFunction

SHAPES = ((16, 16), (33, 8), (7, 50), (2, 128))


def traced(m: int, n: int) -> TracedFunction:
    """Products with inputs and with signals, with added terms; the input ``p`` contains the matrix."""
    inputs = Signature((Slot("x", (n,)), Slot("p", (m * n + 3,)), Slot("c", (m,))))
    outputs = Signature(tuple(Slot(name, (m,)) for name in ("plain", "added", "bent", "twice")))

    def equations(x: SX, p: SX, c: SX) -> list[SX]:
        A = p[2 : 2 + m * n].reshape((n, m)).T
        plain = mtimes(A, x)
        added = c
        for j in range(n):
            added = added + A[:, j] * x[n - 1 - j]
        bent = mtimes(A, x * x) + p[0] * c
        twice = mtimes(A, vertcat(*[sum1(plain)] * n))
        return [plain, added, bent, twice]

    return TracedFunction.trace("products", inputs, outputs, equations)


def sum_in_order(A: np.ndarray, x: np.ndarray, start: np.ndarray | None) -> np.ndarray:
    """``start + A x`` term by term; without ``start`` the sum begins with -0, which changes no product."""
    total = np.full(len(A), -0.0) if start is None else start
    for j, factor in enumerate(x):
        total = multiply_add(A[:, j].copy(), np.full(len(A), factor), total)
    return total


@pytest.mark.parametrize(("m", "n"), SHAPES)
def test_a_product_equals_the_sum_of_its_terms_in_order_bit_for_bit(m: int, n: int) -> None:
    random = np.random.default_rng(m + n)
    kernel = compile_function(traced(m, n))
    products = [operation.opcode for operation in kernel.tape.operations].count(Opcode.PRODUCT)
    assert products >= 4
    assert Tape.from_bytes(kernel.tape.to_bytes()) == kernel.tape
    samples = 19
    x, c = random.normal(size=(samples, n)), random.normal(size=(samples, m))
    p = random.normal(size=m * n + 3)
    p[random.random(p.size) < 0.2] = -0.0
    x[random.random(x.shape) < 0.2] = 0.0
    plain, added, bent, twice = kernel(x, p, c)
    A = p[2 : 2 + m * n].reshape(m, n)
    for k in range(samples):
        np.testing.assert_array_equal(plain[k], sum_in_order(A, x[k], None))
        np.testing.assert_array_equal(np.signbit(plain[k]), np.signbit(sum_in_order(A, x[k], None)))
        np.testing.assert_array_equal(added[k], sum_in_order(A, x[k, ::-1], c[k]))
    np.testing.assert_allclose(bent, x**2 @ A.T + p[0] * c, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(twice, np.outer(plain.sum(axis=1), A.sum(axis=1)), rtol=1e-9, atol=1e-9)
    expected = (plain, added, bent, twice)
    single = [np.array(results) for results in zip(*(kernel(x[k], p, c[k]) for k in range(samples)))]
    repeated_parameters = np.tile(p, (samples, 1))
    for other in (single, kernel(x, repeated_parameters, c), [part.T for part in kernel.columns(x, p, c)]):
        for results, known in zip(other, expected):
            np.testing.assert_array_equal(results, known)
    interpreted = interpret(kernel.tape, [x, p, c])
    np.testing.assert_array_equal(interpreted[0], plain)
    np.testing.assert_array_equal(interpreted[1], added)


def test_small_matrices_are_not_replaced_by_products() -> None:
    n = 15
    assert n * n < MIN_ENTRIES
    ends = Signature((Slot("A", (n, n)), Slot("x", (n,)))), Signature((Slot("y", (n,)),))
    kernel = compile_function(TracedFunction.trace("small", *ends, lambda A, x: [mtimes(A, x)]))
    opcodes = [operation.opcode for operation in kernel.tape.operations]
    assert Opcode.PRODUCT not in opcodes
    assert kernel.tape.count.fused_multiply_adds == n * (n - 1)


def test_a_tall_matrix_is_split_into_several_products() -> None:
    m, n = MAX_ROWS + 9, 30
    ends = Signature((Slot("A", (m, n)), Slot("x", (n,)))), Signature((Slot("y", (m,)),))
    kernel = compile_function(TracedFunction.trace("tall", *ends, lambda A, x: [mtimes(A, x)]))
    random = np.random.default_rng(5)
    A, x = random.normal(size=(m, n)), random.normal(size=n)
    assert [operation.opcode for operation in kernel.tape.operations].count(Opcode.PRODUCT) == 2
    np.testing.assert_array_equal(kernel(A, x), sum_in_order(A, x, None))


def test_the_operation_count_of_a_product_is_that_of_its_multiply_adds() -> None:
    m, n = 100, 120
    ends = Signature((Slot("A", (m, n)), Slot("x", (n,)))), Signature((Slot("y", (m,)),))
    tape = compile_function(TracedFunction.trace("large", *ends, lambda A, x: [mtimes(A, x)])).tape
    assert len(tape.operations) == m + 1
    assert tape.count.fused_multiply_adds == m * n
