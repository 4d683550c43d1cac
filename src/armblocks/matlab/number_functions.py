"""Functions of numbers, which act on arrays element by element, and constants."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from armblocks.matlab.function_kinds import (
    CHOICE,
    POWERS,
    ROUNDING,
    TRIGONOMETRY,
    Arithmetic,
    Function,
    constant,
    elementwise_function,
    reduction_function,
    rounded_function,
)

# Rounding and remainders, with the formulas of the blocks Rounding Function and Modulo.


def _nearest(ops: Arithmetic, x: Any) -> Any:
    below = ops.floor(ops.absolute(x))
    return ops.sign(x) * (below + (ops.absolute(x) - below >= 0.5))


def _toward_zero(ops: Arithmetic, x: Any) -> Any:
    return ops.sign(x) * ops.floor(ops.absolute(x))


def _modulo(ops: Arithmetic, x: Any, y: Any) -> Any:
    remaining = ops.remainder(x, y)
    other_sign = ops.logical_and(remaining != 0.0, (remaining < 0.0) != (y < 0.0))
    return ops.where(y == 0.0, x, ops.where(other_sign, remaining + y, remaining))


def _extreme(smaller: str, smallest: str, combine: Callable[[Arithmetic, Any, Any], Any]) -> Function:
    """``min`` or ``max``: of two arguments element by element, or of all elements of one."""

    def of_all(ops: Arithmetic, x: Any) -> Any:
        return ops.fold(lambda left, right: combine(ops, left, right), x)

    def compute(ops: Arithmetic, x: Any, *other: Any) -> Any:
        return combine(ops, x, *other) if other else of_all(ops, x)

    reduction = reduction_function(f"The {smallest} element.", CHOICE, of_all)
    return elementwise_function(
        "x, y",
        f"The {smaller} of two numbers, element by element; with `(x)` the {smallest} element of a vector or "
        "of each column of a matrix, with `(A, [], 2)` of each row.",
        CHOICE,
        compute,
        optional=1,
        reserved=True,
        reduction=replace(reduction, arguments="x, [], k"),
    )


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
LOGARITHM = rounded_function("log", "Natural logarithm.", POWERS, 0.0)
POWER = elementwise_function(
    "x, y",
    "x to the power of y, as `x.^y`.",
    POWERS,
    lambda ops, x, y: ops.elementary("power", x, y),
    reserved=True,
    elementary=True,
)
FUNCTIONS_OF_NUMBERS: Mapping[str, Function] = {
    "sin": rounded_function("sin", "Sine of an angle in rad.", TRIGONOMETRY),
    "cos": rounded_function("cos", "Cosine of an angle in rad.", TRIGONOMETRY),
    "tan": rounded_function("tan", "Tangent of an angle in rad.", TRIGONOMETRY),
    "asin": rounded_function("asin", "Inverse sine, -π/2 to π/2.", TRIGONOMETRY, -1.0, 1.0),
    "acos": rounded_function("acos", "Inverse cosine, 0 to π.", TRIGONOMETRY, -1.0, 1.0),
    "atan": rounded_function("atan", "Inverse tangent, -π/2 to π/2.", TRIGONOMETRY),
    "atan2": elementwise_function(
        "y, x",
        "The angle of the point (x, y), -π to π.",
        TRIGONOMETRY,
        lambda ops, y, x: ops.elementary("atan2", y, x),
        reserved=True,
        elementary=True,
    ),
    "sinh": rounded_function("sinh", "Hyperbolic sine.", TRIGONOMETRY),
    "cosh": rounded_function("cosh", "Hyperbolic cosine.", TRIGONOMETRY),
    "tanh": rounded_function("tanh", "Hyperbolic tangent.", TRIGONOMETRY),
    "asinh": rounded_function("asinh", "Inverse hyperbolic sine.", TRIGONOMETRY),
    "acosh": rounded_function("acosh", "Inverse hyperbolic cosine, of 1 or more.", TRIGONOMETRY, 1.0),
    "atanh": rounded_function("atanh", "Inverse hyperbolic tangent, of -1 to 1.", TRIGONOMETRY, -1.0, 1.0),
    "deg2rad": elementwise_function(
        "x", "Degrees in rad.", TRIGONOMETRY, lambda ops, x: x * (math.pi / 180.0), reserved=True
    ),
    "rad2deg": elementwise_function(
        "x", "Radians in degrees.", TRIGONOMETRY, lambda ops, x: x * (180.0 / math.pi), reserved=True
    ),
    "exp": rounded_function("exp", "e to the power of x.", POWERS),
    "expm1": rounded_function("expm1", "exp(x) - 1, exact for small x.", POWERS),
    "log": LOGARITHM,
    "ln": LOGARITHM,
    "log10": rounded_function("log10", "Decimal logarithm.", POWERS, 0.0),
    "log1p": rounded_function("log1p", "log(1 + x), exact for small x.", POWERS, -1.0),
    "sqrt": elementwise_function(
        "x", "Square root.", POWERS, lambda ops, x: ops.sqrt(x), reserved=True, real_from=0.0
    ),
    "power": POWER,
    "pow": POWER,
    "hypot": elementwise_function(
        "x, y",
        "The square root of x² + y².",
        POWERS,
        lambda ops, x, y: ops.elementary("hypot", x, y),
        reserved=True,
        elementary=True,
    ),
    "erf": rounded_function("erf", "Error function.", POWERS),
    "abs": elementwise_function(
        "x", "Absolute value.", ROUNDING, lambda ops, x: ops.absolute(x), reserved=True
    ),
    "sign": elementwise_function(
        "x", "The sign: -1, 0 or 1.", ROUNDING, lambda ops, x: ops.sign(x), reserved=True
    ),
    "floor": elementwise_function(
        "x", "Rounds down to an integer.", ROUNDING, lambda ops, x: ops.floor(x), reserved=True
    ),
    "ceil": elementwise_function(
        "x", "Rounds up to an integer.", ROUNDING, lambda ops, x: ops.ceil(x), reserved=True
    ),
    "round": elementwise_function("x", "The nearest integer; halves away from zero.", ROUNDING, _nearest),
    "fix": elementwise_function("x", "The integer part, rounded toward zero.", ROUNDING, _toward_zero),
    "rem": elementwise_function(
        "x, y",
        "The remainder with the sign of x; `rem(x, 0)` is NaN.",
        ROUNDING,
        lambda ops, x, y: ops.remainder(x, y),
        reserved=True,
    ),
    "mod": elementwise_function(
        "x, y", "The remainder with the sign of y; `mod(x, 0)` is x.", ROUNDING, _modulo
    ),
    "if": elementwise_function(
        "condition, yes, no",
        "`yes` where the condition is not 0, else `no`.",
        CHOICE,
        lambda ops, condition, yes, no: ops.where(condition != 0.0, yes, no),
        reserved=True,
    ),
    "and": elementwise_function(
        "x, y", "1 where both are not 0, as `x & y`.", CHOICE, lambda ops, x, y: ops.logical_and(x, y)
    ),
    "or": elementwise_function(
        "x, y", "1 where one is not 0, as `x | y`.", CHOICE, lambda ops, x, y: ops.logical_or(x, y)
    ),
    "xor": elementwise_function(
        "x, y",
        "1 where exactly one is not 0.",
        CHOICE,
        lambda ops, x, y: (x != 0.0) != (y != 0.0),
    ),
    "not": elementwise_function("x", "1 where x is 0, as `~x`.", CHOICE, lambda ops, x: x == 0.0),
    "any": reduction_function(
        "1 where one element is not 0.", CHOICE, lambda ops, x: ops.fold(ops.logical_or, x != 0.0)
    ),
    "all": reduction_function(
        "1 where all elements are not 0.", CHOICE, lambda ops, x: ops.fold(ops.logical_and, x != 0.0)
    ),
    "min": _extreme("smaller", "smallest", lambda ops, x, y: ops.minimum(x, y)),
    "max": _extreme("larger", "largest", lambda ops, x, y: ops.maximum(x, y)),
}
