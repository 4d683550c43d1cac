"""Between what a person types into a parameter's field and the value that the block keeps.

Numbers and arrays may be typed as MATLAB literals: ``2*pi``, ``-1/3``, ``[1 2; 3 4]``, ``45*deg``. They are
read by the interpreter of MATLAB scripts, which knows plain values only: nothing is evaluated by Python.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any, cast

import numpy as np

from armblocks.diagram import Parameter, ParameterFormula, ParameterKind, TimeTable, UserFunction
from armblocks.diagram.mask import Scope, formula_value
from armblocks.errors import ArmblocksError, InputError
from armblocks.formats import read_script
from armblocks.robot import Robot

ResolveRobot = Callable[[str], Robot]
"""From what a page calls a robot (a shipped name, a file of the project) to the robot."""

LONGEST_TEXT = 100_000
"""Characters of one field."""
_NAME = re.compile(r"[A-Za-z_]\w*")
_NUMERIC = (ParameterKind.NUMBER, ParameterKind.ARRAY)
_INFINITIES = {"inf": math.inf, "-inf": -math.inf}


def parameter_value(
    rule: Parameter, typed: Any, where: str, resolve_robot: ResolveRobot, scope: Scope | None = None
) -> Any:
    """The checked value of a parameter from what the page sends; ``None`` is the default.

    A text that names parameters of the diagram's mask, ``scope``, is a formula and stays one. Raises
    ``InputError`` with the place ``where`` (a block) and the parameter's name.
    """
    place = f"{where}, parameter '{rule.name}'"
    if typed is None and not rule.required:
        return rule.default
    if rule.kind is ParameterKind.ROBOT:
        return _robot(rule, typed, place, resolve_robot)
    if isinstance(typed, str) and scope and set(_NAME.findall(typed)) & set(scope):
        bare = typed.strip() in scope
        if bare or rule.kind in (*_NUMERIC, ParameterKind.INTEGER):
            formula_value(rule, typed, scope, where)
            return ParameterFormula(typed.strip())
    if rule.kind in _NUMERIC or rule.kind is ParameterKind.INTEGER:
        typed = number_value(typed, place) if isinstance(typed, str) else _with_infinities(typed)
        if rule.kind is ParameterKind.INTEGER and isinstance(typed, float) and typed.is_integer():
            typed = int(typed)
    return rule.check(typed, place)


def number_value(text: str, where: str) -> float | list[Any]:
    """The number, vector or matrix that a MATLAB literal means; a row or a column is a vector.

    Raises ``InputError`` for anything else.
    """
    allowed = "a number, or an array such as [1 2; 3 4]; pi, + - * / ^ and brackets may be used"
    if text.strip() in _INFINITIES:
        return _INFINITIES[text.strip()]
    if len(text) > LONGEST_TEXT or not text.strip() or any(mark in text for mark in "\n\r\0"):
        raise InputError("this is no value", where=where, allowed=allowed, fix="type a value")
    try:
        variables = read_script(f"deg = pi/180; rad = 1; value = {text};".encode(), "field").variables
    except ArmblocksError as error:
        what = error.what.partition(", in: ")[0]  # the line around it is not the user's
        raise InputError(
            f"'{_short(text)}': {what}", where=where, allowed=allowed, fix="correct the formula"
        ) from None
    value = variables.get("value")
    if set(variables) != {"deg", "rad", "value"} or not isinstance(value, np.ndarray):
        raise InputError(f"'{_short(text)}' is no number", where=where, allowed=allowed, fix="type a value")
    array = np.asarray(value, dtype=np.float64)
    if array.size == 1:
        return float(array.reshape(-1)[0])
    return array.reshape(-1).tolist() if 1 in array.shape else array.tolist()


def tuned_value(typed: Any, where: str) -> Any:
    """The number or array that a page tries for a parameter: typed as text, or numbers already."""
    return number_value(typed, where) if isinstance(typed, str) else _with_infinities(typed)


def parameter_json(value: Any) -> Any:
    """A checked value as the page gets it: infinities and formulas as text, robots and such by name."""
    if isinstance(value, ParameterFormula):
        return value.text
    if isinstance(value, Robot):
        return {"robot": value.name, "source": value.source}
    if isinstance(value, TimeTable):
        return {"table": f"{np.shape(value.rows)[0]} rows", "source": value.source}
    if isinstance(value, UserFunction):
        return {"function": value.name, "source": ""}
    if isinstance(value, complex):
        return f"{value.real!r}{value.imag:+}i" if value.imag else parameter_json(value.real)
    if isinstance(value, tuple):
        return [parameter_json(entry) for entry in cast("tuple[Any, ...]", value)]
    if isinstance(value, float) and math.isinf(value):
        return "inf" if value > 0 else "-inf"
    return value


def _robot(rule: Parameter, typed: Any, place: str, resolve_robot: ResolveRobot) -> Any:
    if not isinstance(typed, str):
        raise InputError(
            f"a robot is asked for, and {type(typed).__name__} was given",
            where=place,
            allowed="the name of a shipped robot, or a robot file of this project",
            fix="choose one from the list",
        )
    return rule.check(resolve_robot(typed), place)


def _with_infinities(value: Any) -> Any:
    if isinstance(value, list):
        return [_with_infinities(entry) for entry in cast("list[Any]", value)]
    return _INFINITIES.get(value, value) if isinstance(value, str) else value


def _short(text: str) -> str:
    return text if len(text) <= 60 else text[:57] + "..."
