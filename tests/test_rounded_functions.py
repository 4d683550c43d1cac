"""Functions of constants are correctly rounded, and thus have the same value on every machine."""

import decimal
import math
from decimal import Decimal

import numpy as np
import pytest

from armblocks.rounded_functions import FUNCTIONS

INFINITY, NAN = math.inf, math.nan

# The doubles nearest to the values of mpmath 1.3 with 2600 bits.
CORRECT = [
    ("sin", (1e22,), -0.8522008497671888),
    ("cos", (1.995,), -0.4115951665320671),
    ("tan", (1.57,), 1255.7655915007897),
    ("asin", (0.73,), 0.8183219506315598),
    ("acos", (-0.31,), 1.8859893592356212),
    ("atan", (2.7,), 1.2160906747839564),
    ("atan2", (0.3, -1.1), 2.875340604438868),
    ("sinh", (0.7,), 0.7585837018395335),
    ("cosh", (3.3,), 13.574761044029561),
    ("tanh", (1.086110847564406,), 0.7954542553248655),
    ("asinh", (-0.42,), -0.4085402078298078),
    ("acosh", (1.7,), 1.123230982587296),
    ("atanh", (0.35,), 0.36544375427139614),
    ("exp", (0.529,), 1.6972342254930017),
    ("exp", (-740.5,), 2.5e-322),
    ("expm1", (1.769,), 4.864985442469668),
    ("log", (0.9999,), -0.00010000500033334732),
    ("log10", (7.0,), 0.8450980400142568),
    ("log1p", (1e-05,), 9.999950000333332e-06),
    ("power", (2.2, 0.41), 1.381634913333611),
    ("hypot", (0.3, 0.41), 0.5080354318352215),
    ("erf", (0.31,), 0.33890815031079025),
]

# C99, Annex F.
SPECIAL = [
    *[
        (name, (zero,), zero)
        for name in ("sin", "tan", "asin", "atan", "sinh", "tanh")
        for zero in (0.0, -0.0)
    ],
    *[(name, (zero,), zero) for name in ("asinh", "atanh", "expm1", "log1p", "erf") for zero in (0.0, -0.0)],
    *[(name, (NAN,), NAN) for name in FUNCTIONS if name not in ("atan2", "power", "hypot")],
    *[(name, (INFINITY,), NAN) for name in ("sin", "cos", "tan", "asin", "acos", "atanh")],
    *[("exp", (INFINITY,), INFINITY), ("exp", (-INFINITY,), 0.0), ("expm1", (-INFINITY,), -1.0)],
    *[("exp", (710.0,), INFINITY), ("expm1", (710.0,), INFINITY), ("cosh", (-711.0,), INFINITY)],
    *[("log", (0.0,), -INFINITY), ("log", (-1.0,), NAN), ("log", (1.0,), 0.0), ("log10", (1000.0,), 3.0)],
    *[("log1p", (-1.0,), -INFINITY), ("log1p", (-1.5,), NAN), ("log1p", (INFINITY,), INFINITY)],
    *[("acosh", (1.0,), 0.0), ("acosh", (0.9,), NAN), ("atanh", (-1.0,), -INFINITY), ("asin", (1.1,), NAN)],
    *[("asin", (-1.0,), -math.pi / 2), ("acos", (-1.0,), math.pi), ("acos", (1.0,), 0.0)],
    *[("sinh", (-INFINITY,), -INFINITY), ("tanh", (INFINITY,), 1.0), ("erf", (-7.0,), -1.0)],
    *[("atan", (INFINITY,), math.pi / 2), ("asinh", (-INFINITY,), -INFINITY)],
    *[("atan2", (0.0, -0.0), math.pi), ("atan2", (-0.0, -1.0), -math.pi), ("atan2", (-0.0, 1.0), -0.0)],
    *[("atan2", (-1.0, 0.0), -math.pi / 2), ("atan2", (INFINITY, -INFINITY), 3 * math.pi / 4)],
    *[("atan2", (1.0, NAN), NAN), ("atan2", (1e-300, 1e300), 0.0), ("atan2", (2.0, -INFINITY), math.pi)],
    *[("hypot", (INFINITY, NAN), INFINITY), ("hypot", (NAN, 1.0), NAN), ("hypot", (-0.0, 0.0), 0.0)],
    *[("hypot", (3 * 2.0**600, 2.0**602), 5 * 2.0**600), ("hypot", (2.0, 3.0, 6.0), 7.0)],
    ("hypot", (15e-324, 20e-324), 25e-324),
    *[("power", (0.0, 0.0), 1.0), ("power", (NAN, 0.0), 1.0), ("power", (1.0, NAN), 1.0)],
    *[("power", (-8.0, 1 / 3), NAN), ("power", (-2.0, 3.0), -8.0), ("power", (0.0, -1.0), INFINITY)],
    *[("power", (-0.0, -3.0), -INFINITY), ("power", (10.0, 400.0), INFINITY), ("power", (0.5, 2000.0), 0.0)],
    *[("power", (-1.0, 1e300), 1.0), ("power", (2.0, INFINITY), INFINITY), ("power", (2.0, -1074.0), 5e-324)],
]


@pytest.mark.parametrize(("name", "arguments", "value"), [*CORRECT, *SPECIAL])
def test_values_are_the_nearest_doubles(name: str, arguments: tuple[float, ...], value: float) -> None:
    actual = FUNCTIONS[name](*arguments)
    assert (actual == value and math.copysign(1.0, actual) == math.copysign(1.0, value)) or (
        math.isnan(actual) and math.isnan(value)
    ), actual


@pytest.mark.parametrize("name", FUNCTIONS)
def test_values_agree_with_the_c_library_within_two_units_in_the_last_place(name: str) -> None:
    """C libraries state errors of up to two units in the last place for these functions."""
    rng = np.random.default_rng(3)
    sizes = np.ldexp(rng.uniform(-1.0, 1.0, 300), rng.integers(-60, 9, 300))
    values = 1.0 + np.abs(sizes) if name == "acosh" else np.concatenate([sizes, rng.uniform(-1.0, 1.0, 100)])
    others = rng.permutation(values)
    reference = {"power": math.pow}.get(name) or getattr(math, name)
    for x, y in zip(values.tolist(), others.tolist()):
        arguments = (x, y) if name in ("atan2", "hypot", "power") else (x,)
        try:
            expected = reference(*arguments)
        except (ValueError, OverflowError):
            continue  # the table above has the ends of the range
        assert abs(FUNCTIONS[name](*arguments) - expected) <= 2.0 * math.ulp(expected), arguments


def test_exponentials_and_logarithms_are_correctly_rounded() -> None:
    """Python's decimal arithmetic rounds them correctly to any number of digits."""
    rng = np.random.default_rng(4)
    with decimal.localcontext(prec=60):
        for x, y in zip(rng.uniform(0.0, 50.0, 200).tolist(), rng.uniform(-5.0, 5.0, 200).tolist()):
            assert FUNCTIONS["exp"](y) == float(Decimal(y).exp())
            assert FUNCTIONS["expm1"](y) == float(Decimal(y).exp() - 1)
            assert FUNCTIONS["log"](x) == float(Decimal(x).ln())
            assert FUNCTIONS["log10"](x) == float(Decimal(x).log10())
            assert FUNCTIONS["power"](x, y) == float(Decimal(x) ** Decimal(y))
            assert FUNCTIONS["hypot"](x, y) == float((Decimal(x) ** 2 + Decimal(y) ** 2).sqrt())
            tangent = (Decimal(2 * y).exp() - 1) / (Decimal(2 * y).exp() + 1)
            assert FUNCTIONS["tanh"](y) == float(tangent)
