"""Functions of numbers, which act on arrays element by element, and constants."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from armblocks.matlab.function_kinds import (
    CHOICE,
    POWERS,
    ROUNDING,
    TRIGONOMETRY,
    Arithmetic,
    Function,
    along_dimension,
    constant,
    elementwise,
    rounded,
)

# Rounding and remainders, with the formulas of the blocks Rounding Function and Modulo.


def _nearest(ops: Arithmetic, x: Any) -> Any:
    below = ops.floor(ops.absolute(x))
    return ops.sign(x) * (below + (ops.absolute(x) - below >= 0.5))


def _toward_zero(ops: Arithmetic, x: Any) -> Any:
    return ops.sign(x) * ops.floor(ops.absolute(x))


def _modulo(ops: Arithmetic, x: Any, y: Any) -> Any:
    rest = ops.remainder(x, y)
    other_sign = ops.both(rest != 0.0, (rest < 0.0) != (y < 0.0))
    return ops.where(y == 0.0, x, ops.where(other_sign, rest + y, rest))


def _least(ops: Arithmetic, x: Any, *other: Any) -> Any:
    return ops.minimum(x, *other) if other else ops.folded(ops.minimum, x)


def _greatest(ops: Arithmetic, x: Any, *other: Any) -> Any:
    return ops.maximum(x, *other) if other else ops.folded(ops.maximum, x)


INFINITY = constant(math.inf, "Infinity.", reserved=True)
NOT_A_NUMBER = constant(math.nan, "Not a number.")
CONSTANTS_BY_NAME: Mapping[str, Function] = {
    "pi": constant(math.pi, "π", reserved=True),
    "e": constant(math.e, "Euler's number, 2.718…", reserved=True),
    "inf": INFINITY,
    "Inf": INFINITY,
    "nan": NOT_A_NUMBER,
    "NaN": NOT_A_NUMBER,
    "eps": constant(2.0**-52, "The distance from 1 to the next larger number."),
    "deg": constant(math.pi / 180.0, "One degree in rad: `45*deg`.", reserved=True),
    "rad": constant(1.0, "One radian: `0.5*rad`.", reserved=True),
    "true": constant(True, "1"),
    "false": constant(False, "0"),
}
LOGARITHM = rounded("log", "Natural logarithm.", POWERS, 0.0)
POWER = elementwise(
    "x, y",
    "x to the power of y, as `x.^y`.",
    POWERS,
    lambda ops, x, y: ops.elementary("power", x, y),
    reserved=True,
    elementary=True,
)
FUNCTIONS_OF_NUMBERS: Mapping[str, Function] = {
    "sin": rounded("sin", "Sine of an angle in rad.", TRIGONOMETRY),
    "cos": rounded("cos", "Cosine of an angle in rad.", TRIGONOMETRY),
    "tan": rounded("tan", "Tangent of an angle in rad.", TRIGONOMETRY),
    "asin": rounded("asin", "Inverse sine, -π/2 to π/2.", TRIGONOMETRY, -1.0, 1.0),
    "acos": rounded("acos", "Inverse cosine, 0 to π.", TRIGONOMETRY, -1.0, 1.0),
    "atan": rounded("atan", "Inverse tangent, -π/2 to π/2.", TRIGONOMETRY),
    "atan2": elementwise(
        "y, x",
        "The angle of the point (x, y), -π to π.",
        TRIGONOMETRY,
        lambda ops, y, x: ops.elementary("atan2", y, x),
        reserved=True,
        elementary=True,
    ),
    "sinh": rounded("sinh", "Hyperbolic sine.", TRIGONOMETRY),
    "cosh": rounded("cosh", "Hyperbolic cosine.", TRIGONOMETRY),
    "tanh": rounded("tanh", "Hyperbolic tangent.", TRIGONOMETRY),
    "asinh": rounded("asinh", "Inverse hyperbolic sine.", TRIGONOMETRY),
    "acosh": rounded("acosh", "Inverse hyperbolic cosine, of 1 or more.", TRIGONOMETRY, 1.0),
    "atanh": rounded("atanh", "Inverse hyperbolic tangent, of -1 to 1.", TRIGONOMETRY, -1.0, 1.0),
    "deg2rad": elementwise(
        "x", "Degrees in rad.", TRIGONOMETRY, lambda ops, x: x * (math.pi / 180.0), reserved=True
    ),
    "rad2deg": elementwise(
        "x", "Radians in degrees.", TRIGONOMETRY, lambda ops, x: x * (180.0 / math.pi), reserved=True
    ),
    "exp": rounded("exp", "e to the power of x.", POWERS),
    "expm1": rounded("expm1", "exp(x) - 1, exact for small x.", POWERS),
    "log": LOGARITHM,
    "ln": LOGARITHM,
    "log10": rounded("log10", "Decimal logarithm.", POWERS, 0.0),
    "log1p": rounded("log1p", "log(1 + x), exact for small x.", POWERS, -1.0),
    "sqrt": elementwise(
        "x", "Square root.", POWERS, lambda ops, x: ops.sqrt(x), reserved=True, real_from=0.0
    ),
    "power": POWER,
    "pow": POWER,
    "hypot": elementwise(
        "x, y",
        "The square root of x² + y².",
        POWERS,
        lambda ops, x, y: ops.elementary("hypot", x, y),
        reserved=True,
        elementary=True,
    ),
    "erf": rounded("erf", "Error function.", POWERS),
    "abs": elementwise("x", "Absolute value.", ROUNDING, lambda ops, x: ops.absolute(x), reserved=True),
    "sign": elementwise("x", "-1, 0 or 1.", ROUNDING, lambda ops, x: ops.sign(x), reserved=True),
    "floor": elementwise("x", "Down to an integer.", ROUNDING, lambda ops, x: ops.floor(x), reserved=True),
    "ceil": elementwise("x", "Up to an integer.", ROUNDING, lambda ops, x: ops.ceil(x), reserved=True),
    "round": elementwise("x", "The nearest integer; halves away from zero.", ROUNDING, _nearest),
    "fix": elementwise("x", "The integer part, rounded toward zero.", ROUNDING, _toward_zero),
    "rem": elementwise(
        "x, y",
        "The remainder with the sign of x; `rem(x, 0)` is NaN.",
        ROUNDING,
        lambda ops, x, y: ops.remainder(x, y),
        reserved=True,
    ),
    "mod": elementwise("x, y", "The remainder with the sign of y; `mod(x, 0)` is x.", ROUNDING, _modulo),
    "if": elementwise(
        "condition, yes, no",
        "`yes` where the condition is not 0, else `no`.",
        CHOICE,
        lambda ops, condition, yes, no: ops.where(condition != 0.0, yes, no),
        reserved=True,
    ),
    "and": elementwise(
        "x, y", "1 where both are not 0, as `x & y`.", CHOICE, lambda ops, x, y: ops.both(x, y)
    ),
    "or": elementwise(
        "x, y", "1 where one is not 0, as `x | y`.", CHOICE, lambda ops, x, y: ops.either(x, y)
    ),
    "xor": elementwise(
        "x, y",
        "1 where exactly one is not 0.",
        CHOICE,
        lambda ops, x, y: (x != 0.0) != (y != 0.0),
    ),
    "not": elementwise("x", "1 where x is 0, as `~x`.", CHOICE, lambda ops, x: x == 0.0),
    "any": along_dimension(
        "1 where one element is not 0.", CHOICE, lambda ops, x: ops.folded(ops.either, x != 0.0)
    ),
    "all": along_dimension(
        "1 where all elements are not 0.", CHOICE, lambda ops, x: ops.folded(ops.both, x != 0.0)
    ),
    "min": elementwise(
        "x, y",
        "The smaller of two numbers, element by element; `min(x)` is the smallest element.",
        CHOICE,
        _least,
        optional=1,
        reserved=True,
    ),
    "max": elementwise(
        "x, y",
        "The larger of two numbers, element by element; `max(x)` is the largest element.",
        CHOICE,
        _greatest,
        optional=1,
        reserved=True,
    ),
}
