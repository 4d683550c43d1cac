"""Elementary functions: accuracy in units in the last place, special values, equal bits for all lane counts.

The reference is NumPy in extended precision (64-bit mantissa) where the platform has it; its error is then
negligible. Elsewhere the reference is the C library in double precision, and its error of up to one unit is
added to the bound.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from small_functions import native, same_bits, single_operation

from armblocks.compiler.opcodes import ELEMENTARY, Opcode

Values = NDArray[np.float64]
EXTENDED = np.finfo(np.longdouble).nmant > 60
RNG = np.random.default_rng(20)
COUNT = 3000
HUGE = np.finfo(np.float64).max
NOT_FINITE = (np.inf, -np.inf, np.nan)


def powers(low: float, high: float) -> Values:
    """Numbers of both signs with uniformly distributed exponents."""
    return 2.0 ** RNG.uniform(low, high, COUNT) * RNG.choice([-1.0, 1.0], COUNT)


def uniform(low: float, high: float) -> Values:
    return RNG.uniform(low, high, COUNT)


ANGLES = np.concatenate(
    [powers(-40, 31), powers(31, 1023.9), uniform(-10, 10), [6381956970095103.0 * 2.0**797]]
)
UNIT_INTERVAL = np.concatenate([uniform(-1, 1), np.abs(powers(-50, 0)), 1 - np.abs(powers(-52, -1))])
HYPERBOLIC = np.concatenate([uniform(-3, 3), powers(-60, 9.46)])
PAIRS = (
    np.concatenate([powers(-3, 3), powers(-500, 500)]),
    np.concatenate([powers(-3, 3), powers(-500, 500)]),
)

# Function, its reference, arguments, allowed error in units in the last place.
CASES: dict[str, tuple[Opcode, Callable[..., Any], tuple[Values, ...], float]] = {
    "sin": (Opcode.SIN, np.sin, (ANGLES,), 1.1),
    "cos": (Opcode.COS, np.cos, (ANGLES,), 1.1),
    "tan": (Opcode.TAN, np.tan, (ANGLES,), 1.5),
    "asin": (Opcode.ASIN, np.arcsin, (UNIT_INTERVAL,), 1.0),
    "acos": (Opcode.ACOS, np.arccos, (np.concatenate([UNIT_INTERVAL, -UNIT_INTERVAL]),), 1.0),
    "atan": (Opcode.ATAN, np.arctan, (np.concatenate([uniform(-4, 4), powers(-60, 60)]),), 1.0),
    "atan2": (Opcode.ATAN2, np.arctan2, PAIRS, 1.0),
    "sinh": (Opcode.SINH, np.sinh, (HYPERBOLIC,), 1.0),
    "cosh": (Opcode.COSH, np.cosh, (HYPERBOLIC,), 1.0),
    "tanh": (Opcode.TANH, np.tanh, (HYPERBOLIC,), 1.0),
    "asinh": (Opcode.ASINH, np.arcsinh, (np.concatenate([uniform(-3, 3), powers(-60, 1000)]),), 1.0),
    "acosh": (Opcode.ACOSH, np.arccosh, (1 + np.abs(powers(-50, 1000)),), 1.0),
    "atanh": (Opcode.ATANH, np.arctanh, (UNIT_INTERVAL,), 1.0),
    "exp": (Opcode.EXP, np.exp, (np.concatenate([uniform(-3, 3), uniform(-708, 709.7)]),), 1.0),
    "expm1": (Opcode.EXPM1, np.expm1, (np.concatenate([powers(-60, 2), uniform(-708, 709.7)]),), 1.0),
    "log": (
        Opcode.LOG,
        np.log,
        (np.concatenate([np.abs(powers(-1074, 1023.9)), 1 + powers(-50, -1)]),),
        0.6,
    ),
    "log1p": (
        Opcode.LOG1P,
        np.log1p,
        (np.concatenate([np.abs(powers(-60, 1000)), -(UNIT_INTERVAL[:COUNT] ** 2)]),),
        0.6,
    ),
    "hypot": (Opcode.HYPOT, np.hypot, PAIRS, 0.6),
}


def errors_in_units(actual: Values, reference: NDArray[np.longdouble]) -> Values:
    """Return errors in units in the last place of the result."""
    size = np.spacing(np.abs(reference).astype(np.float64))
    return np.abs((actual.astype(np.longdouble) - reference) / size).astype(np.float64)


@pytest.mark.parametrize("name", CASES)
def test_errors_stay_below_two_units_in_the_last_place(name: str) -> None:
    opcode, reference, arguments, allowed = CASES[name]
    extended = reference(*(argument.astype(np.longdouble) for argument in arguments))
    ordinary = (
        np.abs(extended) > 1e-300
    )  # smaller results are close to the subnormal range, where a unit is relatively large
    actual = native(single_operation(opcode), 8)(*arguments)
    error = errors_in_units(actual, extended)[ordinary]
    assert error.max() < allowed + (0.0 if EXTENDED else 1.0)


def test_error_function_is_within_two_units_of_the_c_library() -> None:
    x = np.concatenate([uniform(-6.5, 6.5), powers(-60, 3)])
    reference = np.array([math.erf(value) for value in x])
    assert (
        errors_in_units(native(single_operation(Opcode.ERF), 8)(x), reference.astype(np.longdouble)).max()
        < 2.0
    )


def test_powers_are_within_one_unit() -> None:
    base = np.concatenate([uniform(0.1, 10), np.abs(powers(-100, 100)), 1 + powers(-40, -5)])
    exponent = np.concatenate([uniform(-200, 200), uniform(-6, 6), powers(0, 40)])
    with np.errstate(all="ignore"):
        extended = base.astype(np.longdouble) ** exponent.astype(np.longdouble)
    ordinary = (extended > 1e-300) & (extended < 1e300)
    actual = native(single_operation(Opcode.POWER), 8)(base, exponent)
    error = errors_in_units(actual[ordinary], extended[ordinary])
    assert error.max() < (1.0 if EXTENDED else 2.0)


def test_angles_next_to_a_multiple_of_a_right_angle_are_reduced_exactly() -> None:
    # The double nearest to a multiple of pi/2 (Muller, Elementary Functions, 2016, chapter 11).
    hardest_angle = np.array([6381956970095103.0 * 2.0**797])
    cosine = native(single_operation(Opcode.COS), 1)(hardest_angle)
    np.testing.assert_allclose(cosine, [-4.6871659242546277e-19], rtol=2e-16)
    near = np.array([np.pi, 2 * np.pi, 1e6 * np.pi, 1e9 * np.pi, 1e15 * np.pi, 1e22])
    expected = [math.sin(value) for value in near]
    np.testing.assert_allclose(native(single_operation(Opcode.SIN), 8)(near), expected, rtol=4e-16)


@pytest.mark.parametrize("opcode", sorted(ELEMENTARY), ids=lambda opcode: opcode.name)
def test_special_values_agree_with_numpy(opcode: Opcode) -> None:
    reference = SPECIAL[opcode]
    tiny = 5e-324
    values = np.array(
        [
            0.0,
            -0.0,
            tiny,
            -tiny,
            1e-310,
            0.5,
            -0.5,
            1.0,
            -1.0,
            1.5,
            -2.0,
            3.0,
            1e5,
            -1e20,
            1e300,
            -1e300,
            HUGE,
            *NOT_FINITE,
        ]
    )
    grids = np.meshgrid(*[values] * opcode.arity)
    arguments = [grid.ravel() for grid in grids]
    with np.errstate(all="ignore"):
        expected = np.asarray(reference(*arguments), dtype=np.float64)
    for lanes in (1, 8):
        actual = native(single_operation(opcode), lanes)(*arguments)
        np.testing.assert_allclose(actual, expected, rtol=1e-15, atol=1e-323)
        numbers = ~np.isnan(expected)
        assert np.array_equal(np.signbit(actual[numbers]), np.signbit(expected[numbers]))


def _remainder(x: Values, y: Values) -> Values:
    def one(a: float, b: float) -> float:
        return math.nan if math.isinf(a) or b == 0.0 else math.remainder(a, b)

    return np.array([one(a, b) for a, b in zip(x, y)])


SPECIAL: dict[Opcode, Callable[..., Any]] = {
    opcode: reference for opcode, reference, _, _ in CASES.values()
} | {
    Opcode.ERF: lambda x: [math.erf(value) for value in x],
    Opcode.POWER: np.power,
    Opcode.MODULO: np.fmod,
    Opcode.REMAINDER: _remainder,
}

NUMBERS = st.floats(width=64)


@given(st.lists(st.tuples(NUMBERS, NUMBERS), min_size=1, max_size=20))
@settings(max_examples=150, derandomize=True)
def test_remainders_of_division_are_exact(pairs: list[tuple[float, float]]) -> None:
    x, y = (np.array(column) for column in zip(*pairs))
    with np.errstate(all="ignore"):
        expected = np.fmod(x, y)
    assert same_bits(native(single_operation(Opcode.MODULO), 8)(x, y), expected)
    assert same_bits(native(single_operation(Opcode.REMAINDER), 8)(x, y), _remainder(x, y))


def test_remainders_round_ties_to_even_as_in_ieee_754() -> None:
    x = np.array([1.0, 3.0, 5.0, -3.0, 2.5, 7.5, 5e-324, 1.5e-323, 1e300, 2.0**1023])
    y = np.array([2.0, 2.0, 2.0, 2.0, 5.0, 5.0, 1e-323, 1e-323, 3.0, 2.0**1023 * 1.5])
    assert same_bits(native(single_operation(Opcode.REMAINDER), 2)(x, y), _remainder(x, y))


@pytest.mark.parametrize("opcode", sorted(ELEMENTARY), ids=lambda opcode: opcode.name)
def test_the_number_of_lanes_does_not_change_the_bits(opcode: Opcode) -> None:
    numbers = np.concatenate([powers(-30, 30), powers(-1074, 1023), powers(29, 33), [np.inf, np.nan, 0.0]])
    arguments = [RNG.permutation(numbers)[:2003] for _ in range(opcode.arity)]
    one = native(single_operation(opcode), 1)(*arguments)
    for lanes in (2, 4, 8):
        assert same_bits(native(single_operation(opcode), lanes)(*arguments), one)
