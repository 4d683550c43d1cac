"""The numeric functions that robot scripts call. Adding one is one line in ``FUNCTIONS``."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from armblocks import rounded_functions
from armblocks.formats.matlab.source import Place
from armblocks.formats.matlab.values import (
    ROUNDED_WORK,
    Array,
    Budget,
    Cell,
    LinkArray,
    Value,
    array_of,
    check_size,
    count_of,
    number_of,
    scalar,
)
from armblocks.rounded_functions import atan2
from armblocks.spatial import Transform, transl, trotx, troty, trotz

Arguments = list[Value]


@dataclass(frozen=True)
class NumericFunction:
    """A function of ``fewest`` to ``most`` arguments."""

    fewest: int
    most: int
    compute: Callable[[Place, Arguments], Value]
    work: int = 1
    """What an element of the result costs, in elements of a sum."""


def call_function(place: Place, budget: Budget, name: str, arguments: Arguments) -> Value:
    """The value of ``name(arguments)``; the caller has looked up that ``FUNCTIONS`` holds the name."""
    function = FUNCTIONS[name]
    if not function.fewest <= len(arguments) <= function.most:
        counts = (
            f"{function.fewest}"
            if function.fewest == function.most
            else (f"{function.fewest} to {function.most}")
        )
        raise place.error(f"{name} is called with {len(arguments)} arguments", allowed=counts)
    if function.work > 1:
        budget.spend(place, function.work * array_of(place, arguments[0], f"the argument of {name}").size)
    with np.errstate(all="ignore"):
        value = function.compute(place, arguments)
    budget.spend(place, value.size if isinstance(value, np.ndarray) else 1)
    return value


def _elementwise(
    name: str,
    compute: Callable[[Array], Array],
    low: float = -math.inf,
    high: float = math.inf,
) -> NumericFunction:
    """A real function of one matrix, with the interval in which its values are real."""

    def apply(place: Place, arguments: Arguments) -> Value:
        array = array_of(place, arguments[0], f"the argument of {name}")
        if np.any((array < low) | (array > high)):
            raise place.error(
                f"{name} has a complex value here", allowed=f"arguments from {low:g} to {high:g}"
            )
        return compute(array)

    return NumericFunction(1, 1, apply)


def _rounded(name: str, low: float = -math.inf, high: float = math.inf) -> NumericFunction:
    """A function of :mod:`armblocks.rounded_functions`, element by element."""
    every = np.vectorize(rounded_functions.FUNCTIONS[name], otypes=[np.float64])
    plain = _elementwise(name, every, low, high)
    return dataclasses.replace(plain, work=ROUNDED_WORK)


def _constant(value: float) -> NumericFunction:
    return NumericFunction(0, 0, lambda place, arguments: scalar(value))


def _filled(name: str, make: Callable[[int, int], Array]) -> NumericFunction:
    """``zeros(n)``, ``zeros(m, n)``, ``zeros([m n])``"""

    def apply(place: Place, arguments: Arguments) -> Value:
        extents: list[Value] = list(arguments) or [scalar(1.0)]
        if len(extents) == 1:
            both = array_of(place, extents[0], f"the size in {name}")
            extents = (
                [scalar(float(both.ravel()[0])), scalar(float(both.ravel()[1]))]
                if both.size == 2
                else ([both, both])
            )
        rows, columns = (count_of(place, extent, f"the size in {name}") for extent in extents)
        check_size(place, rows, columns)
        return make(rows, columns)

    return NumericFunction(0, 2, apply)


def _diag(place: Place, arguments: Arguments) -> Value:
    array = array_of(place, arguments[0], "the argument of diag")
    if 1 in array.shape or array.size == 0:
        check_size(place, array.size, array.size)
        return np.diag(array.ravel())
    return np.diag(array).reshape(-1, 1)


def _length(place: Place, arguments: Arguments) -> Value:
    match arguments[0]:
        case Cell(elements=elements):
            return scalar(float(len(elements)))
        case LinkArray(links=links):
            return scalar(float(len(links)))
        case str() as text:
            return scalar(float(len(text)))
        case value:
            array = array_of(place, value, "the argument of length")
            return scalar(float(max(array.shape) if array.size else 0))


def _atan2(place: Place, arguments: Arguments) -> Value:
    y, x = (number_of(place, argument, "an argument of atan2") for argument in arguments)
    return scalar(atan2(y, x))


def _linspace(place: Place, arguments: Arguments) -> Value:
    first, last = (number_of(place, argument, "an end of linspace") for argument in arguments[:2])
    count = count_of(place, arguments[2], "the count of linspace") if len(arguments) > 2 else 100
    return np.linspace(first, last, count).reshape(1, -1)


def _transl(place: Place, arguments: Arguments) -> Value:
    if len(arguments) == 1:
        vector = array_of(place, arguments[0], "the argument of transl")
        if vector.shape == (4, 4):
            return vector[:3, 3:].copy()
        if vector.size != 3:
            raise place.error(
                f"the argument of transl has {vector.size} elements",
                allowed="x, y, z, or [x y z], or a 4x4 pose",
            )
        x, y, z = (float(number) for number in vector.ravel())
    elif len(arguments) == 3:
        x, y, z = (number_of(place, argument, "an argument of transl") for argument in arguments)
    else:
        raise place.error("transl is called with 2 arguments", allowed="x, y, z, or [x y z], or a 4x4 pose")
    return transl(x, y, z).matrix


def _pose(place: Place, arguments: Arguments) -> Value:
    """``SE3()``, ``SE3(T)``, ``SE3(x, y, z)``, ``SE3([x y z])`` of release 10: a 4x4 matrix here."""
    if not arguments:
        return np.eye(4)
    if len(arguments) == 1 and array_of(place, arguments[0], "the argument of SE3").shape == (4, 4):
        return array_of(place, arguments[0], "the argument of SE3")
    return _transl(place, arguments)


def _turn(name: str, make: Callable[[float], Transform]) -> NumericFunction:
    def apply(place: Place, arguments: Arguments) -> Value:
        angle = number_of(place, arguments[0], f"the angle of {name}")
        if len(arguments) > 1:
            if arguments[1] != "deg":
                raise place.error(f"the option of {name} is not known", allowed="'deg'")
            angle = math.radians(angle)
        return make(angle).matrix

    return NumericFunction(1, 2, apply)


def _degrees_to_radians(array: Array) -> Array:
    return array * (math.pi / 180)


FUNCTIONS: dict[str, NumericFunction] = {
    "pi": _constant(math.pi),
    "eps": _constant(2.0**-52),
    "inf": _constant(math.inf),
    "Inf": _constant(math.inf),
    "zeros": _filled("zeros", lambda m, n: np.zeros((m, n))),
    "ones": _filled("ones", lambda m, n: np.ones((m, n))),
    "eye": _filled("eye", lambda m, n: np.eye(m, n)),
    "diag": NumericFunction(1, 1, _diag),
    "length": NumericFunction(1, 1, _length),
    "numel": NumericFunction(
        1, 1, lambda place, arguments: scalar(float(array_of(place, arguments[0], "the argument").size))
    ),
    "linspace": NumericFunction(2, 3, _linspace),
    "deg2rad": _elementwise("deg2rad", _degrees_to_radians),
    "rad2deg": _elementwise("rad2deg", lambda array: array * (180 / math.pi)),
    "sqrt": _elementwise("sqrt", np.sqrt, low=0.0),
    "abs": _elementwise("abs", np.abs),
    "sin": _rounded("sin"),
    "cos": _rounded("cos"),
    "tan": _rounded("tan"),
    "asin": _rounded("asin", low=-1.0, high=1.0),
    "acos": _rounded("acos", low=-1.0, high=1.0),
    "atan": _rounded("atan"),
    "atan2": NumericFunction(2, 2, _atan2),
    "exp": _rounded("exp"),
    "transl": NumericFunction(1, 3, _transl),
    "trotx": _turn("trotx", trotx),
    "troty": _turn("troty", troty),
    "trotz": _turn("trotz", trotz),
    "SE3": NumericFunction(0, 3, _pose),
}
