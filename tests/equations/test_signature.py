"""The layout of named quantities in flat vectors, for numbers and symbols."""

from __future__ import annotations

import numpy as np
import pytest
from casadi import SX, Function

from armblocks.equations import Signature, Slot, TracedFunction, flatten, signature, unflatten
from armblocks.errors import InputError, UnknownNameError

LAYOUT = signature(("t", (), "s"), ("q", (2,), "rad"), ("T", (2, 3)), ("stack", (2, 2, 2)))


def test_unpacking_is_the_inverse_of_packing() -> None:
    values = {slot.name: np.arange(slot.size, dtype=float).reshape(slot.shape) for slot in LAYOUT}
    flat = LAYOUT.pack(values)
    assert flat.shape == (LAYOUT.size,) == (17,)
    for name, value in LAYOUT.unpack(flat).items():
        assert np.array_equal(value, values[name])
        assert value.shape == LAYOUT[name].shape
    batch = LAYOUT.unpack(np.stack([flat, flat]))
    assert batch["T"].shape == (2, 2, 3)
    assert batch["t"].shape == (2,)


def test_quantities_are_stored_one_after_another() -> None:
    assert LAYOUT.names == ("t", "q", "T", "stack")
    assert LAYOUT.ranges["T"] == slice(3, 9)
    assert len(LAYOUT) == 4
    assert LAYOUT["q"].unit == "rad"


@pytest.mark.parametrize("shape", [(), (3,), (2, 3), (2, 3, 2)])
def test_symbols_are_stored_in_row_major_order(shape: tuple[int, ...]) -> None:
    numbers = np.arange(np.prod(shape, dtype=int), dtype=float)
    flat = SX.sym("flat", numbers.size)
    natural = unflatten(flat, shape)
    back = Function("f", [flat], [flatten(natural, shape), natural])
    unpacked, matrix = (np.asarray(value) for value in back.call([numbers]))
    assert np.array_equal(unpacked.ravel(), numbers)
    assert np.array_equal(matrix.ravel(), numbers)


def test_invalid_names_and_shapes_are_refused() -> None:
    with pytest.raises(InputError, match=r"the name 'q' occurs twice in one signature"):
        Signature((Slot("q"), Slot("q")))
    with pytest.raises(InputError, match=r"no value is given for 'q'. Allowed: t, q"):
        LAYOUT.pack({"t": 0.0})
    with pytest.raises(InputError, match=r"'t' has shape \(1,\). Allowed: shape \(\)"):
        LAYOUT.pack({"t": [0.0]})
    for wrong in (lambda: LAYOUT["p"], lambda: LAYOUT.pack({"p": 0.0})):
        with pytest.raises(UnknownNameError, match=r"there is no quantity named 'p'"):
            wrong()
    with pytest.raises(InputError, match=r"symbolic value has shape \(2, 1\). Allowed: \(2, 3\)"):
        flatten(SX.sym("v", 2), (2, 3))


def test_a_traced_function_can_be_called_with_numbers() -> None:
    ends = signature(("A", (2, 2)), ("b", (2,)))
    product = TracedFunction.trace("product", ends, signature(("y", (2,))), lambda A, b: A @ b)
    A, b = np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([5.0, 6.0])
    assert np.array_equal(product(A, b)[0], A @ b)


def test_equations_with_a_wrong_number_of_outputs_are_refused() -> None:
    with pytest.raises(InputError, match=r"the equations of 'f' return 2 values. Allowed: 1 value"):
        TracedFunction.trace("f", signature(("a", ())), signature(("b", ())), lambda a: (a, a))
