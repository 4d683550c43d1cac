"""Invalid arguments of kernels, and the error messages."""

import numpy as np
import pytest
from small_functions import mixed, traced

from armblocks.compiler import Kernel, compile_function
from armblocks.equations import TracedFunction, signature
from armblocks.errors import InputError


@pytest.fixture(scope="module")
def kernel() -> Kernel:
    return compile_function(mixed())


GOOD = np.ones(3)


def test_a_wrong_number_of_arguments_is_refused(kernel: Kernel) -> None:
    with pytest.raises(
        InputError, match=r"mixed: 1 argument is given. Allowed: a \(3,\), b \(3,\). Fix: call mixed"
    ):
        kernel(GOOD)


@pytest.mark.parametrize("shape", [(2,), (5, 4), (3, 5), (), (1, 1, 3)])
def test_an_array_of_the_wrong_shape_is_refused(kernel: Kernel, shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError) as caught:
        kernel(GOOD, np.ones(shape))
    assert str(caught.value).startswith(
        f"mixed: 'b' has shape {shape}. Allowed: shape (3,), or (N, 3) for N samples."
    )


def test_a_matrix_in_place_of_a_scalar_is_refused() -> None:
    kernel = compile_function(
        TracedFunction.trace("square", signature(("t", ())), signature(("s", ())), lambda t: t * t)
    )
    with pytest.raises(
        InputError, match=r"'t' has shape \(2, 2\). Allowed: a number, or shape \(N,\) for N samples"
    ):
        kernel(np.ones((2, 2)))


@pytest.mark.parametrize(
    ("value", "data_type"),
    [
        (np.ones(3, complex), "complex128"),
        (np.array(["1", "2", "3"]), "<U1"),
        (np.array([1, 2, None]), "object"),
        (np.ones(3, bool), "bool"),
        (np.zeros(3, "datetime64[s]"), r"datetime64\[s\]"),
        (np.zeros(3, [("x", float)]), r"\[\('x', '<f8'\)\]"),
    ],
)
def test_arrays_that_are_not_real_are_refused(kernel: Kernel, value: np.ndarray, data_type: str) -> None:
    with pytest.raises(
        InputError, match=f"mixed: 'a' holds {data_type}. Allowed: real numbers: any float or integer type"
    ):
        kernel(value, GOOD)


def test_a_ragged_list_is_refused(kernel: Kernel) -> None:
    with pytest.raises(InputError, match=r"mixed: 'a' cannot be read as an array: .*inhomogeneous"):
        kernel([[1.0], [1.0, 2.0, 3.0]], GOOD)


def test_different_numbers_of_samples_are_refused(kernel: Kernel) -> None:
    with pytest.raises(
        InputError,
        match=r"the inputs hold different numbers of samples: 'a' 4, 'b' 5. Allowed: one number of samples",
    ):
        kernel(np.ones((4, 3)), np.ones((5, 3)))


def read_only() -> np.ndarray:
    array = np.empty((2, 11))
    array.flags.writeable = False
    return array


@pytest.mark.parametrize(
    ("out", "problem"),
    [
        ([0.0] * 11, "is a list"),
        (np.empty((2, 11), np.float32), "holds <f4"),
        (np.empty((2, 11), ">f8"), "holds >f8"),
        (np.empty(11), r"has shape \(11,\)"),
        (np.empty((11, 2)).T, "is not C-contiguous"),
        (read_only(), "is read-only"),
    ],
)
def test_an_unsuitable_array_for_out_is_refused(kernel: Kernel, out: object, problem: str) -> None:
    with pytest.raises(InputError) as caught:
        kernel(np.ones((2, 3)), GOOD, out=out)
    assert caught.match(f"mixed: out= for 'y' {problem}. Allowed: a writable C-contiguous float64 array")
    assert "of shape (2, 11). Fix: omit out=, or allocate it with numpy.empty." in str(caught.value)


def test_a_wrong_number_of_arrays_for_out_is_refused(kernel: Kernel) -> None:
    with pytest.raises(InputError, match=r"mixed: out= holds 2 arrays. Allowed: one per output: y \(11,\)"):
        kernel(GOOD, GOOD, out=(np.empty(11), np.empty(11)))
    out = np.empty(11)
    assert kernel(GOOD, GOOD, out=(out,)) is out


@pytest.mark.parametrize("threads", [0, -1, 1.5, "two", None, True])
def test_an_invalid_number_of_threads_is_refused(kernel: Kernel, threads: object) -> None:
    with pytest.raises(InputError, match=r"mixed: threads=.*Allowed: a positive integer"):
        kernel(GOOD, GOOD, threads=threads)
    assert kernel(GOOD, GOOD, threads=np.int64(2)).shape == (11,)


def test_a_scalar_result_can_be_written_into_an_array() -> None:
    kernel = compile_function(
        TracedFunction.trace("cube", signature(("t", ())), signature(("s", ())), lambda t: t**3)
    )
    out = np.empty(())
    assert kernel(2.0, out=out) is out
    assert out == 8.0
    many = np.empty(4)
    assert kernel(np.arange(4.0), out=many) is many
    assert many.tolist() == [0.0, 1.0, 8.0, 27.0]


def test_two_outputs_in_the_same_array_are_written_in_order() -> None:
    kernel = compile_function(
        TracedFunction.trace(
            "pair", signature(("a", (2,))), signature(("x", (2,)), ("y", (2,))), lambda a: [a + 1, a * 2]
        )
    )
    out = np.empty(2)
    x, y = kernel(np.array([1.0, 5.0]), out=(out, out))
    assert x is out
    assert y is out  # the second output overwrites the first
    assert out.tolist() == [2.0, 10.0]
    assert compile_function(traced(lambda a: a, 2))([1, 2]).tolist() == [1.0, 2.0]
