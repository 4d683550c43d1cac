"""Kernels: results equal to the interpreter's for any number of samples, layout and number of threads."""

import threading

import casadi
import numpy as np
import pytest
from casadi import SX
from hypothesis import given, settings
from hypothesis import strategies as st
from small_functions import mixed, same_bits, traced

from armblocks.compiler import Kernel, compile_function
from armblocks.compiler.interpret import interpret
from armblocks.equations import TracedFunction, signature


@pytest.fixture(scope="module")
def kernel() -> Kernel:
    return compile_function(mixed())


def samples(count: int, *, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.normal(size=(count, 3)), rng.normal(size=(count, 3)) * 3


def test_compiled_code_agrees_with_interpreter_and_casadi(kernel: Kernel) -> None:
    a, b = samples(40)
    function = mixed()
    for x, y in zip(a, b):
        # Functions differ by one or two units in the last place, which is visible in sums of order one.
        np.testing.assert_allclose(kernel(x, y), interpret(kernel.tape, [x, y])[0], rtol=1e-14, atol=1e-15)
        np.testing.assert_allclose(kernel(x, y), function(x, y)[0], rtol=1e-13, atol=1e-15)


@pytest.mark.parametrize("count", [0, 1, 2, 3, 7, 8, 9, 15, 16, 17, 100])
def test_a_batch_equals_single_calls_bit_for_bit(kernel: Kernel, count: int) -> None:
    a, b = samples(count)
    batch = kernel(a, b)
    assert batch.shape == (count, 11)
    for k in range(count):
        assert same_bits(batch[k], kernel(a[k], b[k]))
        assert same_bits(batch[k], kernel.entry(a[k], b[k]))
    assert same_bits(kernel.columns(a, b), batch.T.copy())


def test_a_huge_angle_or_a_nan_does_not_affect_other_samples(kernel: Kernel) -> None:
    a, b = samples(64)
    without_special_values = kernel(a, b)
    a[5, 0], a[20, 1], b[33, 2], a[50, 2] = 1e300, np.nan, np.inf, 1e18
    with_special_values = kernel(a, b)
    others = np.setdiff1d(np.arange(64), [5, 20, 33, 50])
    assert same_bits(with_special_values[others], without_special_values[others])
    for k in (5, 20, 33, 50):
        assert same_bits(with_special_values[k], kernel(a[k], b[k]))


def test_the_number_of_threads_does_not_change_the_bits(kernel: Kernel) -> None:
    a, b = samples(20_011)
    single_thread = kernel(a, b)
    for threads in (2, 3, 8):
        assert same_bits(kernel(a, b, threads=threads), single_thread)
        assert same_bits(kernel.columns(a, b, threads=threads), single_thread.T.copy())


def test_calls_from_many_threads_at_once_are_safe() -> None:
    kernel = compile_function(traced(lambda a: casadi.sin(a) * a, 4, name="concurrent"))
    a = np.random.default_rng(2).normal(size=(5000, 4))
    results: list[np.ndarray] = []
    workers = [threading.Thread(target=lambda: results.append(kernel(a, threads=2))) for _ in range(6)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert len(results) == 6
    assert all(same_bits(result, kernel(a)) for result in results)


def test_an_input_of_one_sample_is_broadcast(kernel: Kernel) -> None:
    a, b = samples(21)
    shared = kernel(a, b[0])
    assert same_bits(shared, kernel(a, np.tile(b[0], (21, 1))))
    assert same_bits(kernel(a[0], b), kernel(np.tile(a[0], (21, 1)), b))
    assert same_bits(kernel.columns(a, b[0]), shared.T.copy())


def test_columns_accepts_arrays_in_column_major_order(kernel: Kernel) -> None:
    a, b = samples(37)
    column_major = np.asfortranarray(a)
    assert same_bits(kernel.columns(column_major, b), kernel.columns(a, b))
    assert kernel.columns(a[0], b[0]).shape == (11,)


@pytest.mark.parametrize(
    "dtype", [np.float32, np.float16, np.int64, np.int8, np.uint16, ">f8", "<f8", np.longdouble]
)
def test_any_real_dtype_is_accepted(kernel: Kernel, dtype: str) -> None:
    a = (np.arange(30).reshape(10, 3) % 5 + 1).astype(dtype)
    b = np.ones((10, 3))
    assert same_bits(kernel(a, b), kernel(a.astype(np.float64), b))
    assert same_bits(kernel.entry(a[0], b[0]), kernel(a[0].astype(np.float64), b[0]))


def test_any_strides_are_accepted(kernel: Kernel) -> None:
    wide = np.random.default_rng(3).normal(size=(40, 9))
    b = np.ones((20, 3))
    views = [wide[::2, ::3], wide[:20, 2:5], wide[::-2, 4:1:-1], np.asfortranarray(wide)[:20, :3]]
    raw = np.zeros(20 * 24 + 1, dtype=np.uint8)[1:].view(np.float64).reshape(20, 3)  # not aligned
    raw[:] = wide[:20, :3]
    broadcast = np.broadcast_to(wide[0, :3], (20, 3))
    for view in (*views, raw, broadcast):
        assert same_bits(kernel(view, b), kernel(view.copy(), b))
        assert same_bits(kernel(view[3], b[3]), kernel(view[3].copy(), b[3]))
        assert same_bits(kernel.entry(view[3], b[3]), kernel(view[3].copy(), b[3]))
    assert same_bits(kernel(wide[:20, :3].tolist(), b), kernel(wide[:20, :3].copy(), b))


@pytest.mark.parametrize("size", [1, 2, 3, 4, 5, 7, 8, 9, 12, 16, 17, 24])
def test_rows_of_every_width_are_transposed_into_lanes(size: int) -> None:
    def equations(a: SX) -> SX:
        return casadi.vertcat(*(a[(k + 1) % size] for k in range(size)))

    kernel = compile_function(traced(equations, size, name=f"roll{size}"))
    for count in (8, 19):
        a = np.arange(count * size, dtype=np.float64).reshape(count, size)
        guarded = np.full((count + 2, size), -1.0)
        kernel(a, out=guarded[1:-1])
        assert np.array_equal(guarded[1:-1], np.roll(a, -1, axis=1))
        assert (guarded[[0, -1]] == -1.0).all()  # nothing is written outside
        assert np.array_equal(kernel.columns(a), np.roll(a, -1, axis=1).T)


def test_a_kernel_with_several_outputs_and_matrices_agrees_with_numpy() -> None:
    inputs = signature(("t", ()), ("A", (2, 3)), ("none", (0,)))
    outputs = signature(("B", (3, 2)), ("s", ()), ("empty", (0,)), ("stack", (2, 1, 3)))

    def equations(t: SX, A: SX, empty: SX) -> list[SX]:
        return [A.T * t, casadi.sum1(casadi.sum1(A).T), empty, A + t]

    kernel = compile_function(TracedFunction.trace("several", inputs, outputs, equations))
    A = np.arange(6.0).reshape(2, 3)
    for call in (kernel, kernel.entry):
        B, s, empty, stack = call(2.0, A, np.zeros(0))
        assert np.array_equal(B, A.T * 2)
        assert type(s) is np.float64
        assert s == 15.0
        assert empty.shape == (0,)
        assert np.array_equal(stack, (A + 2).reshape(2, 1, 3))
    t = np.arange(11.0)
    B, s, empty, stack = kernel(t, A, np.zeros(0))
    assert B.shape == (11, 3, 2)
    assert np.array_equal(B[4], A.T * 4)
    assert np.array_equal(s, np.full(11, 15.0))
    assert empty.shape == (11, 0)
    assert np.array_equal(stack[7], (A + 7).reshape(2, 1, 3))
    assert [part.shape for part in kernel.columns(t, A, np.zeros(0))] == [
        (3, 2, 11),
        (11,),
        (0, 11),
        (2, 1, 3, 11),
    ]
    assert repr(kernel).startswith("<Kernel several: t (), A (2, 3), none (0,) -> B (3, 2), s (),")


def test_out_receives_the_result_even_if_it_is_an_input() -> None:
    kernel = compile_function(traced(lambda a: casadi.vertcat(a[1], a[0], a[2]), 3, name="swap"))
    a = np.arange(30.0).reshape(10, 3)
    expected = a[:, [1, 0, 2]].copy()
    out = np.empty((10, 3))
    assert kernel(a, out=out) is out
    assert np.array_equal(out, expected)
    assert kernel(a, out=a) is a
    assert np.array_equal(a, expected)
    single = np.array([1.0, 2.0, 3.0])
    assert kernel.entry(single, out=single) is single
    assert np.array_equal(single, [2.0, 1.0, 3.0])


EXPRESSIONS = st.recursive(
    st.sampled_from(["a0", "a1", "a2", "b0", "b1"]) | st.floats(-3, 3).map(lambda value: round(value, 3)),
    lambda inner: (
        st.tuples(st.sampled_from(["+", "-", "*", "/", "min", "max", "<", "copysign"]), inner, inner)
        | st.tuples(st.sampled_from(["neg", "sqrt", "abs", "sign", "floor", "square"]), inner)
        | st.tuples(st.just("if"), inner, inner, inner)
    ),
    max_leaves=25,
)


def symbolic(tree: object, a: SX, b: SX) -> SX:
    """A random CasADi expression of operations whose results IEEE 754 defines exactly."""
    if isinstance(tree, str):
        return (a if tree[0] == "a" else b)[int(tree[1])]
    if not isinstance(tree, tuple):
        return SX(tree)
    name, *rest = tree
    x = [symbolic(part, a, b) for part in rest]
    return {
        "+": lambda: x[0] + x[1],
        "-": lambda: x[0] - x[1],
        "*": lambda: x[0] * x[1],
        "/": lambda: x[0] / x[1],
        "min": lambda: casadi.fmin(x[0], x[1]),
        "max": lambda: casadi.fmax(x[0], x[1]),
        "<": lambda: x[0] < x[1],
        "copysign": lambda: casadi.copysign(x[0], x[1]),
        "neg": lambda: -x[0],
        "sqrt": lambda: casadi.sqrt(x[0]),
        "abs": lambda: casadi.fabs(x[0]),
        "sign": lambda: casadi.sign(x[0]),
        "floor": lambda: casadi.floor(x[0]),
        "square": lambda: x[0] * x[0],
        "if": lambda: casadi.if_else(x[0], x[1], x[2]),
    }[name]()


@given(st.lists(EXPRESSIONS, min_size=8, max_size=20))
@settings(max_examples=12, deadline=None, derandomize=True)
def test_random_arithmetic_equals_the_interpreter_bit_for_bit(trees: list[object]) -> None:
    kernel = compile_function(
        traced(lambda a, b: casadi.vertcat(*(symbolic(tree, a, b) for tree in trees)), 3, 2, name="random")
    )
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(21, 3)), rng.normal(size=(21, 2))
    a[3], b[4], a[7, 1], b[8] = 0.0, -0.0, np.inf, np.nan
    expected = interpret(kernel.tape, [a, b])[0]
    batch = kernel(a, b)
    assert same_bits(batch, expected)
    assert all(same_bits(kernel(a[k], b[k]), expected[k]) for k in range(21))
