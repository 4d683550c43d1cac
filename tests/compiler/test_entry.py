"""The builtin of a kernel: results and errors equal to those of the kernel, and reference counts."""

import gc
import sys
import threading
import weakref
from collections.abc import Callable, Sequence
from types import BuiltinFunctionType
from typing import Any

import casadi
import numpy as np
import pytest
from casadi import SX
from small_functions import mixed, same_bits, traced

from armblocks.compiler import Kernel, compile_function, entry
from armblocks.equations import TracedFunction, signature
from armblocks.errors import InputError, UnknownNameError


@pytest.fixture(scope="module")
def kernel() -> Kernel:
    return compile_function(mixed())


@pytest.fixture(scope="module")
def several() -> Kernel:
    inputs = signature(("t", ()), ("A", (2, 2)))
    outputs = signature(("B", (2, 2)), ("s", ()))
    return compile_function(
        TracedFunction.trace("several", inputs, outputs, lambda t, A: [A * t, casadi.trace(A) + t])
    )


def arguments(seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.normal(size=3), rng.normal(size=3)


def test_the_entry_is_a_builtin_with_name_signature_and_docstring(kernel: Kernel) -> None:
    assert isinstance(kernel.entry, BuiltinFunctionType)
    assert kernel.entry.__name__ == "mixed"
    assert kernel.entry.__text_signature__ == "(a, b, *, out=None, threads=1)"
    assert kernel.entry.__doc__ == "a (3,), b (3,) -> y (11,); or N samples of each."


def test_results_of_the_builtin_equal_those_of_the_kernel_bit_for_bit(kernel: Kernel) -> None:
    for seed in range(30):
        a, b = arguments(seed)
        assert same_bits(kernel.entry(a, b), kernel(a, b))
    huge = np.array([1e200, -3e9, 2e19]), np.array([1e300, np.nan, np.inf])
    assert same_bits(kernel.entry(*huge), kernel(*huge))


class Subclass(np.ndarray):
    """A subclass of ndarray."""


def odd_arguments() -> dict[str, object]:
    a = arguments(1)[0]
    raw = np.zeros(25, dtype=np.uint8)[1:].view(np.float64)
    raw[:] = a
    read_only = a.copy()
    read_only.flags.writeable = False
    return {
        "list": a.tolist(),
        "tuple": tuple(a),
        "strided": np.repeat(a, 2)[::2],
        "reversed": a[::-1],
        "single precision": a.astype(np.float32),
        "integers": np.array([1, 2, 3]),
        "big-endian": a.astype(">f8"),
        "subclass": a.view(Subclass),
        "read-only": read_only,
        "unaligned": raw,
        "batch": np.tile(a, (5, 1)),
        "own dtype object": a.astype(np.dtype("f8", metadata={"unit": "rad"})),
        "memoryview": memoryview(a),
    }


@pytest.mark.parametrize("kind", odd_arguments())
def test_the_builtin_accepts_all_arguments_that_the_kernel_accepts(kernel: Kernel, kind: str) -> None:
    value = odd_arguments()[kind]
    b = arguments(1)[1]
    assert same_bits(np.asarray(kernel.entry(value, b)), np.asarray(kernel(value, b)))
    assert type(kernel.entry(value, b)) is np.ndarray


@pytest.mark.parametrize(
    "value",
    [
        np.zeros(2),
        np.zeros(4),
        np.zeros((1, 4)),
        np.zeros((3, 1, 3)),
        np.zeros(0),
        np.float64(3.0),
        3.0,
        None,
        "abc",
        np.zeros(3, complex),
        np.zeros(3, object),
        np.zeros(3, bool),
        [[1.0], [1.0, 2.0]],
        object(),
        {},
    ],
    ids=lambda value: f"{type(value).__name__} {value!r}".split(" at 0x")[0],
)
def test_the_builtin_refuses_all_arguments_that_the_kernel_refuses(kernel: Kernel, value: object) -> None:
    b = arguments(1)[1]
    with pytest.raises(InputError) as expected:
        kernel(value, b)
    with pytest.raises(InputError) as error:
        kernel.entry(value, b)
    assert str(error.value) == str(expected.value)


def test_wrong_counts_and_keywords_are_refused_with_the_message_of_the_kernel(kernel: Kernel) -> None:
    a, b = arguments(3)
    for inputs in ((), (a,), (a, b, a)):
        with pytest.raises(InputError, match=r"arguments? (is|are) given"):
            kernel.entry(*inputs)
    with pytest.raises(UnknownNameError, match="no argument named 'speed'"):
        kernel.entry(a, b, speed=3)
    assert same_bits(kernel.entry(b=b, a=a), kernel(a, b))
    out = np.empty(11)
    assert kernel.entry(a, b, out=out) is out
    assert same_bits(out, kernel(a, b))
    assert same_bits(kernel.entry(np.tile(a, (9, 1)), b, threads=2)[8], out)


def test_scalars_are_passed_and_returned_as_numbers(several: Kernel) -> None:
    A = np.arange(4.0).reshape(2, 2)
    for t in (2.0, np.float64(2.0), np.float32(2.0), 2, np.int64(2), np.array(2.0)):
        B, s = several.entry(t, A)
        assert np.array_equal(B, A * 2)
        assert type(s) is np.float64
        assert s == 5.0
    single = compile_function(
        TracedFunction.trace("one", signature(("t", ())), signature(("s", ())), lambda t: t * t)
    )
    assert type(single.entry(3.0)) is type(single(3.0)) is np.float64
    assert single.entry(3.0) == 9.0


def test_results_are_new_arrays(kernel: Kernel) -> None:
    a, b = arguments(4)
    first = kernel.entry(a, b)
    copy = first.copy()
    second = kernel.entry(b, a)
    assert first.base is None
    assert first.flags.owndata
    assert first.flags.c_contiguous
    assert first.flags.writeable
    assert not np.shares_memory(first, second)
    assert np.array_equal(first, copy)


def test_calls_neither_lose_nor_leak_references(kernel: Kernel, several: Kernel) -> None:
    a, b = arguments(5)
    A, out, batch, t = np.eye(2), np.empty(11), np.ones((600, 3)), np.ones(9)
    watched = (a, b, A, out, batch, t, kernel, kernel.entry, several.entry)
    shared = (np.dtype(np.float64), np.ndarray, np.float64)  # arrays of other tests are freed meanwhile

    def exercise() -> None:
        for _ in range(500):
            kernel.entry(a, b, threads=1)
            kernel.entry(a, b, out=out)
            several.entry(1.5, A)
            several.entry(t, A, out=None)
            kernel.entry(batch, b)
            for inputs in ((a,), (a, A), (a, None)):
                with pytest.raises(InputError):
                    kernel.entry(*inputs)

    exercise()
    gc.collect()
    before = [sys.getrefcount(item) for item in (*watched, *shared)]
    grown: list[int] = []
    for _ in range(3):  # other threads may allocate as well; a leak shows in every repetition
        blocks = sys.getallocatedblocks()
        exercise()
        gc.collect()
        grown.append(abs(sys.getallocatedblocks() - blocks))
    after = [sys.getrefcount(item) for item in (*watched, *shared)]
    changes = [abs(x - y) for x, y in zip(before, after)]
    assert max(changes[: len(watched)]) < 20
    # A leak in each call would exceed three times this bound.
    assert max(changes[len(watched) :]) < 400
    assert min(grown) < 400


def test_the_builtin_keeps_its_kernel_alive_until_it_is_deleted() -> None:
    kernel = compile_function(traced(lambda a: 3 * a, 2, name="triple"))
    builtin = kernel.entry
    watch = weakref.ref(kernel)
    del kernel
    gc.collect()
    assert np.array_equal(builtin(np.array([1.0, 2.0])), [3.0, 6.0])
    assert np.array_equal(builtin([1.0, 2.0]), [3.0, 6.0])
    del builtin
    gc.collect()
    assert watch() is None


def test_arguments_outside_the_fast_path_are_passed_to_the_fallback(kernel: Kernel) -> None:
    calls: list[tuple[object, ...]] = []

    def fallback(*arguments: object, **options: object) -> str:
        calls.append((arguments, options))
        return "fallback"

    builtin = kernel.entry_with_fallback(fallback)
    a, b = arguments(6)
    assert same_bits(builtin(a, b), kernel(a, b))
    assert builtin(a, b, payload=3) == "fallback"
    assert builtin([1], b) == "fallback"
    assert calls == [((a, b), {"payload": 3}), (([1], b), {})]


def test_errors_of_the_fallback_pass_through(kernel: Kernel) -> None:
    def fallback(*arguments: object) -> None:
        raise ZeroDivisionError("from the fallback")

    with pytest.raises(ZeroDivisionError, match="from the fallback"):
        kernel.entry_with_fallback(fallback)(1)


def test_with_an_unknown_binary_interface_the_kernel_itself_is_called(
    kernel: Kernel, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(entry, "_addresses", lambda: None)
    called = kernel.entry_with_fallback(kernel)
    assert called is kernel
    a, b = arguments(7)
    assert same_bits(called(a, b), kernel.entry(a, b))


def test_wrong_offsets_of_the_array_structure_are_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    entry._addresses.cache_clear()
    try:
        monkeypatch.setattr(entry, "ARRAY_DATA", 24)
        assert entry._addresses() is None
    finally:
        entry._addresses.cache_clear()


def test_random_arguments_give_the_results_and_errors_of_the_kernel(kernel: Kernel) -> None:
    rng = np.random.default_rng(8)
    pool = [*odd_arguments().values(), np.zeros(2), None, "x", 1.0, *arguments(9)]
    for _ in range(300):
        chosen = [pool[k] for k in rng.integers(len(pool), size=rng.integers(0, 4))]
        assert outcome(kernel.entry, chosen, {}) == outcome(kernel, chosen, {})


def outcome(call: Callable[..., object], arguments: Sequence[object], options: dict[str, object]) -> object:
    """Return type, shape and bits of each result of a call, or the text of its error."""
    try:
        result = call(*arguments, **options)
    except InputError as error:
        return str(error)
    parts = result if isinstance(result, tuple) else (result,)
    flags = [part is options.get("out") or part.flags.owndata for part in parts]
    return [type(result), flags, *((type(part), part.shape, part.tobytes()) for part in parts)]


def call_with_options(shapes: Sequence[tuple[int, ...]], result: tuple[int, ...], seed: int) -> Any:
    """Random inputs, single or in batches, and random options; most of them are valid."""
    rng = np.random.default_rng(seed)
    samples = int(rng.choice([0, 1, 2, 7, 8, 9, 64, 600]))
    memory = rng.normal(size=40_000)  # all arrays are slices of this memory, so that they may overlap
    offset = 0

    def piece(shape: tuple[int, ...]) -> np.ndarray:
        nonlocal offset
        start = offset
        offset += int(np.prod(shape))
        return memory[start:offset].reshape(shape)

    arguments: list[Any] = []
    for shape in shapes:
        count = samples + (rng.random() < 0.02)
        batched = rng.random() < 0.6
        value = piece((count, *shape) if batched else shape)
        arguments.append(float(value) if value.ndim == 0 else value)
    options: dict[str, Any] = {}
    if rng.random() < 0.3:
        options["threads"] = rng.choice(np.array([1, 1, 1, 2, 0, True, None], object))
    if rng.random() < 0.7:
        batched = any(np.ndim(value) > len(shape) for value, shape in zip(arguments, shapes))
        offset = max(0, offset - int(rng.choice([0, 0, 0, 1, offset])))
        out: Any = piece((samples, *result) if batched else result)
        fault = rng.integers(16)
        if fault == 0:
            out.flags.writeable = False
        options["out"] = {
            1: lambda: out.astype(np.float32),
            2: lambda: out.astype(">f8"),
            3: lambda: piece((*out.shape, 2))[..., 0],
            4: lambda: piece((1, *out.shape)),
            5: lambda: piece((samples + 1, *result)),
            6: lambda: out.tolist(),
            7: lambda: out.view(Subclass),
            8: lambda: None,
            9: lambda: (out,),
        }.get(fault, lambda: out)()
    return arguments, options, memory


def test_batches_and_options_give_the_results_and_errors_of_the_kernel(
    kernel: Kernel, several: Kernel
) -> None:
    square = compile_function(
        TracedFunction.trace("square", signature(("t", ())), signature(("s", ())), lambda t: t * t)
    )
    for called, shapes, result in (
        (kernel, [(3,), (3,)], (11,)),
        (several, [(), (2, 2)], (2, 2)),
        (square, [()], ()),
    ):
        for seed in range(150):
            expected = call_with_options(shapes, result, seed)
            actual = call_with_options(shapes, result, seed)
            assert outcome(called.entry, *actual[:2]) == outcome(called, *expected[:2])
            assert same_bits(actual[2], expected[2])  # nothing else was written


def test_batches_and_options_do_not_call_python(kernel: Kernel, several: Kernel) -> None:
    def fallback(*arguments: object, **options: object) -> None:
        raise AssertionError(f"{arguments} {options}")

    builtin = kernel.entry_with_fallback(fallback)
    a, b = arguments(10)
    out = np.empty(11)
    assert builtin(a, b, out=out, threads=1) is out
    assert same_bits(out, kernel(a, b))
    for count in (0, 1, 8, 33, 600):
        batch = np.tile(a, (count, 1))
        for inputs in ((batch, b), (a, np.tile(b, (count, 1))), (batch, np.tile(b, (count, 1)))):
            expected = kernel(*inputs)  # the first call compiles the batch function for these inputs
            assert same_bits(builtin(*inputs, threads=1), expected)
            out = np.empty((count, 11))
            assert builtin(*inputs, out=out) is out
            assert same_bits(out, expected)
    t = np.arange(5.0)
    expected = several(t, np.eye(2))
    actual = several.entry_with_fallback(fallback)(t, np.eye(2))
    assert all(map(same_bits, actual, expected))


def test_simultaneous_batches_of_several_threads_are_correct(kernel: Kernel) -> None:
    a, b = (np.random.default_rng(k).normal(size=(600, 3)) for k in (1, 2))
    expected = kernel(a, b)
    results: list[np.ndarray] = []

    def work() -> None:
        results.extend(kernel.entry(a, b) for _ in range(50))

    workers = [threading.Thread(target=work) for _ in range(4)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert len(results) == 200
    assert all(same_bits(result, expected) for result in results)


def test_batches_of_a_kernel_with_nine_inputs_are_evaluated() -> None:
    shapes = [(name, (1,)) for name in "abcdefghi"]
    kernel = compile_function(
        TracedFunction.trace("nine", signature(*shapes), signature(("s", (1,))), lambda *x: sum(x))
    )
    single = [np.array([float(k)]) for k in range(9)]
    assert kernel.entry(*single) == [36.0]
    assert np.array_equal(kernel.entry(*single[:8], np.zeros((3, 1))), np.full((3, 1), 28.0))


def test_matrices_in_column_major_order_are_read_correctly() -> None:
    kernel = compile_function(
        TracedFunction.trace(
            "transpose", signature(("A", (2, 3))), signature(("B", (3, 2))), lambda A: SX(A.T)
        )
    )
    A = np.arange(6.0).reshape(2, 3)
    for value in (A, np.asfortranarray(A)):
        assert np.array_equal(kernel.entry(value), A.T)
