"""Conversion between the text of a parameter's field and the value of the block.

Numbers and arrays may be typed as formulas, ``2*pi``, ``[1 2; 3 4]``, ``45*deg``, in the language of formulas
and scripts, :mod:`armblocks.matlab`. They are never evaluated as Python code.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, cast

from armblocks.diagram import Parameter, ParameterFormula, ParameterKind, TimeTable, UserFunction
from armblocks.diagram.mask import Scope, formula_number, formula_value, parameters_read
from armblocks.diagram.user_function import UnloadedFunction
from armblocks.errors import InputError, UnknownNameError, counted
from armblocks.formats.data_files import DataFiles, TableReference
from armblocks.robot import Robot

ResolveRobot = Callable[[str], Robot]
"""Finds a robot by the name that a client uses: a shipped name or a file of the project."""

_NUMERIC = (ParameterKind.NUMBER, ParameterKind.ARRAY, ParameterKind.INTEGER)
_ALLOWED = "a number, or an array such as [1 2; 3 4]; pi, + - * / ^ and brackets may be used"
_INFINITIES = {"inf": math.inf, "-inf": -math.inf}


def parameter_value(
    rule: Parameter,
    typed: Any,
    where: str,
    resolve_robot: ResolveRobot,
    scope: Scope | None = None,
    data: DataFiles | None = None,
) -> Any:
    """Return the checked value of a parameter that a client sends; ``None`` selects the default.

    A text that contains mask parameters of the diagram, ``scope``, is stored as a formula. ``data`` reads
    tables and functions of files. Raises ``InputError`` with the location ``where`` (a block) and the
    parameter name.
    """
    place = f"{where}, parameter '{rule.name}'"
    if typed is None and not rule.required:
        return rule.default
    if rule.kind is ParameterKind.ROBOT:
        return _robot(rule, typed, place, resolve_robot)
    if data is not None and rule.kind is ParameterKind.TABLE and isinstance(typed, dict):
        return rule.check(data.table(_table_reference(cast("dict[str, Any]", typed), place), None), place)
    if data is not None and rule.kind is ParameterKind.FUNCTION and isinstance(typed, str):
        return rule.check(data.function(typed, None), place)
    if isinstance(typed, str) and scope:
        numeric = rule.kind in _NUMERIC
        if typed.strip() in scope or (numeric and parameters_read(typed, scope, place)):
            formula_value(rule, typed, scope, where)
            return ParameterFormula(typed.strip())
    if rule.kind in _NUMERIC:
        read = _matrix if rule.dimensions == (2,) else number_value
        typed = read(typed, place) if isinstance(typed, str) else _with_infinities(typed)
        if rule.kind is ParameterKind.INTEGER and isinstance(typed, float) and typed.is_integer():
            typed = int(typed)
    return rule.check(typed, place)


def number_value(text: str, where: str) -> float | list[Any]:
    """Evaluate a text as a number, vector or matrix; a row or a column is a vector.

    Raises ``UnknownNameError`` for a name that is not a constant, ``InputError`` for any other error.
    """
    if not text.strip() or any(mark in text for mark in "\n\r\0"):
        raise InputError("this is not a value", where=where, allowed=_ALLOWED, fix="type a value")
    try:
        return formula_number(text.strip(), where)
    except UnknownNameError:
        raise
    except InputError as error:  # the list of all formula elements would hide the error
        raise InputError(error.what, where=where, allowed=_ALLOWED, fix="correct the formula") from None


def _matrix(text: str, where: str) -> Any:
    """Evaluate a text for a parameter that is always a matrix: ``[1 2]`` is a row, ``[1; 2]`` a column."""
    stripped = text.strip()
    inner = stripped[1:-1]
    if not (stripped.startswith("[") and stripped.endswith("]")) or "[" in inner:
        value = number_value(text, where)
        return value if isinstance(value, list) else [[value]]
    rows = [number_value(f"[{row}]", where) for row in inner.split(";")]
    return [row if isinstance(row, list) else [row] for row in rows]


def tuned_value(typed: Any, where: str) -> Any:
    """Return the tried value of a parameter from a client, as text or as numbers."""
    return number_value(typed, where) if isinstance(typed, str) else _with_infinities(typed)


def parameter_json(value: Any) -> Any:
    """Convert a checked value to JSON: infinities and formulas as text, robots and similar values by name."""
    if isinstance(value, ParameterFormula):
        return value.text
    if isinstance(value, Robot):
        return {"robot": value.name, "source": value.source}
    if isinstance(value, TimeTable):
        return _table_json(value)
    if isinstance(value, UserFunction):
        # The studio loads no functions of files: a loaded function is the default of a new block.
        source = value.shown if isinstance(value.function, UnloadedFunction) else ""
        return {"function": value.name, "source": source}
    if isinstance(value, complex):
        return f"{value.real!r}{value.imag:+}i" if value.imag else parameter_json(value.real)
    if isinstance(value, tuple):
        return [parameter_json(entry) for entry in cast("tuple[Any, ...]", value)]
    if isinstance(value, float) and math.isinf(value):
        return "inf" if value > 0 else "-inf"
    return value


def _table_json(table: TimeTable) -> dict[str, Any]:
    """The data of a table for pages: size, and the file and columns that :func:`parameter_value` takes."""
    count, width = table.shape
    values = counted(width - 1, "column of values", "columns of values")
    return {
        "table": f"{counted(count, 'row')}, {values}",
        "source": table.shown or table.source,
        "time": table.time,
        "columns": list(table.columns),
    }


def _table_reference(typed: Mapping[str, Any], place: str) -> TableReference:
    file, time, columns = typed.get("file"), typed.get("time", ""), typed.get("columns", [])
    names = cast("list[Any]", columns) if isinstance(columns, list) else [None]
    if not (isinstance(file, str) and isinstance(time, str) and all(isinstance(name, str) for name in names)):
        raise InputError(
            "this is not a choice of columns",
            where=place,
            allowed="a file of the project, a column of times, and columns of values",
            fix="choose a file",
        )
    return TableReference(file=file, time=time, columns=tuple(map(str, names)))


def _robot(rule: Parameter, typed: Any, place: str, resolve_robot: ResolveRobot) -> Any:
    if not isinstance(typed, str):
        raise InputError(
            f"the value must be a robot, and {type(typed).__name__} was given",
            where=place,
            allowed="the name of a shipped robot, or a robot file of this project",
            fix="choose one from the list",
        )
    return rule.check(resolve_robot(typed), place)


def _with_infinities(value: Any) -> Any:
    if isinstance(value, list):
        return [_with_infinities(entry) for entry in cast("list[Any]", value)]
    return _INFINITIES.get(value, value) if isinstance(value, str) else value
