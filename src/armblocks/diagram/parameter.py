"""Parameters of blocks: declared as dataclass fields, checked at construction."""

from __future__ import annotations

import dataclasses
import math
import numbers
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any, Protocol, cast, runtime_checkable

import numpy as np

from armblocks.argument_errors import ArgumentErrors, with_argument_errors
from armblocks.diagram.time_table import TimeTable
from armblocks.diagram.user_function import UserFunction
from armblocks.equations import Shape
from armblocks.errors import InputError

Value = float | int | bool | str | tuple[Any, ...] | object
"""A checked value: numbers as float, arrays as nested tuples of float, so that blocks compare by content."""

REQUIRED: Any = dataclasses.MISSING
"""Marks a parameter without default."""


class ParameterKind(Enum):
    """The kinds of parameter values."""

    NUMBER = "number"
    ARRAY = "array"
    INTEGER = "integer"
    CHOICE = "choice"
    STRING = "string"
    BOOLEAN = "boolean"
    ROBOT = "robot"
    DIAGRAM = "diagram"
    TABLE = "table"
    FUNCTION = "function"


@runtime_checkable
class RobotHolder(Protocol):
    """An object with a robot, such as an Arm, which a robot parameter accepts."""

    @property
    def robot(self) -> object: ...


@dataclass(frozen=True, kw_only=True)
class Parameter(metaclass=ArgumentErrors):
    """One parameter of a block type.

    - ``tunable``: the value is an input of the compiled system (numbers and arrays only; an array's shape is
      constant).
    - ``dimensions``: the allowed numbers of axes of an array (0 is a scalar).
    - ``minimum``, ``above``, ``maximum``: bounds of every entry.
    - ``finite``: infinities are rejected (NaN is always rejected).
    - ``roots``: an array of zeros or poles, which may be empty. Complex roots become rows (real, imaginary).
    - ``of_type``: the class that an object of kind ``ROBOT``, ``DIAGRAM``, ``TABLE`` or ``FUNCTION`` must
      have.
    """

    name: str
    kind: ParameterKind
    doc: str
    default: Any = REQUIRED
    unit: str = ""
    tunable: bool = False
    choices: tuple[str, ...] = ()
    dimensions: tuple[int, ...] = (0, 1, 2)
    minimum: float = -math.inf
    above: float | None = None
    maximum: float = math.inf
    finite: bool = True
    roots: bool = False
    of_type: type | None = None

    @property
    def required(self) -> bool:
        """Whether the parameter has no default."""
        return self.default is REQUIRED

    def check(self, value: object, where: str) -> Value:
        """The value in canonical form; raises ``InputError`` with ``where``, value and rule."""
        return _CHECKS[self.kind](self, value, where)

    def describe(self) -> str:
        """The rule as text, for error messages."""
        if self.kind is ParameterKind.CHOICE:
            return "one of " + ", ".join(self.choices)
        words = {
            ParameterKind.NUMBER: "a number",
            ParameterKind.ARRAY: "numbers with " + " or ".join(str(n) for n in self.dimensions) + " axes",
            ParameterKind.INTEGER: "an integer",
            ParameterKind.STRING: "text",
            ParameterKind.BOOLEAN: "true or false",
            ParameterKind.ROBOT: "a Robot, or an Arm",
            ParameterKind.DIAGRAM: "a Diagram",
            ParameterKind.TABLE: "a table of times and values",
            ParameterKind.FUNCTION: "a Python function",
        }[self.kind]
        bounds = [
            f"{sign} {bound:g}"
            for sign, bound in ((">=", self.minimum), (">", self.above), ("<=", self.maximum))
            if bound is not None and math.isfinite(bound)
        ]
        numeric = self.kind in (ParameterKind.NUMBER, ParameterKind.ARRAY)
        return ", ".join([words, *bounds, *(["finite"] if numeric and self.finite else [])])


@with_argument_errors
def parameter(
    default: Any = REQUIRED,
    *,
    doc: str,
    kind: ParameterKind | None = None,
    unit: str = "",
    tunable: bool | None = None,
    **rules: Any,
) -> Any:
    """Declare a parameter as a field of a block: ``gain: ArrayLike = parameter(1.0, doc="K")``.

    Without ``kind``, the type of the default determines it: a float is a number, an int an integer, a tuple
    an array, text a choice where ``choices`` are given. Numbers and arrays are tunable unless
    ``tunable=False``.
    """
    kind = kind or kind_of(default, rules)
    if tunable is None:
        tunable = kind in (ParameterKind.NUMBER, ParameterKind.ARRAY)
    declaration = Parameter(name="", kind=kind, doc=doc, default=default, unit=unit, tunable=tunable, **rules)
    if default is REQUIRED:
        return dataclasses.field(metadata={"parameter": declaration})
    return dataclasses.field(default=default, metadata={"parameter": declaration})


def shape_of(value: object) -> Shape:
    """Shape of a checked number or array."""
    return np.shape(cast("Any", value))


def kind_of(default: object, rules: dict[str, Any]) -> ParameterKind:
    """The kind of a default."""
    if isinstance(default, bool):
        return ParameterKind.BOOLEAN
    if isinstance(default, int):
        return ParameterKind.INTEGER
    if isinstance(default, float):
        return ParameterKind.NUMBER
    if isinstance(default, str):
        return ParameterKind.CHOICE if "choices" in rules else ParameterKind.STRING
    return ParameterKind.ARRAY


def _invalid_value(rule: Parameter, value: Any, where: str) -> InputError:
    text = repr(value)
    text = text if len(text) <= 80 else text[:77] + "..."
    return InputError(f"the value is {text}", where=where, allowed=rule.describe(), fix=f"give {rule.doc}")


def _check_bounds(rule: Parameter, values: np.ndarray[Any, Any], value: object, where: str) -> None:
    inside = (values >= rule.minimum) & (values <= rule.maximum)
    if rule.above is not None:
        inside &= values > rule.above
    if rule.finite:
        inside &= np.isfinite(values)
    if not bool(np.all(inside)):
        raise _invalid_value(rule, value, where)


def _check_number(rule: Parameter, value: object, where: str) -> float:
    if isinstance(value, np.ndarray) and cast("np.ndarray[Any, Any]", value).ndim == 0:
        value = cast("np.ndarray[Any, Any]", value).item()
    if not isinstance(value, numbers.Real) or isinstance(value, bool | np.bool):
        raise _invalid_value(rule, value, where)
    number = float(value)
    _check_bounds(rule, np.asarray(number), value, where)
    return number


def _check_array(rule: Parameter, value: object, where: str) -> Value:
    try:
        array: np.ndarray[Any, Any] = np.asarray(cast("Any", value))
    except ValueError:  # rows of different lengths
        raise _invalid_value(rule, value, where) from None
    if rule.roots and array.dtype.kind == "c" and array.ndim == 1:
        array = np.column_stack([np.real(array), np.imag(array)])
    empty = array.size == 0 and not rule.roots
    if array.dtype.kind not in "iuf" or array.ndim not in rule.dimensions or empty:
        raise _invalid_value(rule, value, where)
    array = array.astype(np.float64)
    _check_bounds(rule, array, value, where)
    return _as_tuples(array.tolist())


def _as_tuples(value: Any) -> Value:
    if isinstance(value, list):
        return tuple(_as_tuples(entry) for entry in cast("list[Any]", value))
    return float(value)


def _check_integer(rule: Parameter, value: object, where: str) -> int:
    if isinstance(value, bool) or not isinstance(value, numbers.Integral):
        raise _invalid_value(rule, value, where)
    number = int(value)
    _check_bounds(rule, np.asarray(float(number)), value, where)
    return number


def _check_choice(rule: Parameter, value: object, where: str) -> str:
    if not isinstance(value, str) or value not in rule.choices:
        raise _invalid_value(rule, value, where)
    return value


def _check_string(rule: Parameter, value: object, where: str) -> str:
    if not isinstance(value, str):
        raise _invalid_value(rule, value, where)
    return value


def _check_boolean(rule: Parameter, value: object, where: str) -> bool:
    if not isinstance(value, bool):
        raise _invalid_value(rule, value, where)
    return value


def _check_object(rule: Parameter, value: object, where: str) -> object:
    if rule.of_type is not None and not isinstance(value, rule.of_type):
        raise _invalid_value(rule, value, where)
    return value


def _check_robot(rule: Parameter, value: object, where: str) -> object:
    return _check_object(rule, value.robot if isinstance(value, RobotHolder) else value, where)


def _check_table(rule: Parameter, value: object, where: str) -> TimeTable:
    if isinstance(value, TimeTable):
        return value
    try:
        rows = np.asarray(cast("Any", value), dtype=np.float64)
    except (TypeError, ValueError):
        raise _invalid_value(rule, value, where) from None
    return TimeTable(rows)


def _check_function(rule: Parameter, value: object, where: str) -> UserFunction:
    if isinstance(value, UserFunction):
        return value
    if not callable(value):
        raise _invalid_value(rule, value, where)
    return UserFunction(value)


_CHECKS: dict[ParameterKind, Callable[[Parameter, object, str], Value]] = {
    ParameterKind.NUMBER: _check_number,
    ParameterKind.ARRAY: _check_array,
    ParameterKind.INTEGER: _check_integer,
    ParameterKind.CHOICE: _check_choice,
    ParameterKind.STRING: _check_string,
    ParameterKind.BOOLEAN: _check_boolean,
    ParameterKind.ROBOT: _check_robot,
    ParameterKind.DIAGRAM: _check_object,
    ParameterKind.TABLE: _check_table,
    ParameterKind.FUNCTION: _check_function,
}
