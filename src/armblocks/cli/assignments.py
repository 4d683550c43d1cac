"""The grammar of ``--set block.parameter=value``: parsed, never evaluated by Python.

The parameter follows the last dot before ``=``. A value is a formula of numbers
(:mod:`armblocks.matlab.formula`), ``2``, ``3*pi/4`` or ``[1 2; 3 4]``; a row without brackets,
``1,2,3``; ``true`` or ``false``; or a string in quotes, or a single word.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from armblocks.errors import ArmblocksError, InputError

if TYPE_CHECKING:
    from armblocks import Diagram

Value = float | bool | str | list[Any]

_ALLOWED = "a number, a vector [1 2 3] or 1,2,3, a matrix [1 2; 3 4], formulas of numbers, or text in quotes"
_INTEGER = re.compile(r"[+-]?\d{1,15}", re.ASCII)
_DECIMAL = re.compile(r"[+-]?(?:(?:\d+(?:\.\d*)?|\.\d+)(?:e[+-]?\d+)?|nan|inf)", re.ASCII | re.IGNORECASE)
_WORD = re.compile(r"(?!pi$)[A-Za-z_][A-Za-z0-9_.-]*", re.ASCII)


def parse_assignments(texts: Sequence[str]) -> dict[str, Value]:
    """Values by ``block.parameter``, from the texts of ``--set``.

    Raises ``InputError`` for a text outside this grammar and for a parameter that is set twice. The diagram
    checks whether block and parameter exist.
    """
    values: dict[str, Value] = {}
    for text in texts:
        path, equals, value = text.partition("=")
        path = path.strip()
        block, dot, parameter = path.rpartition(".")
        if not (equals and dot and block and parameter):
            raise InputError(
                f"'{text}' is not of the form block.parameter=value",
                where="--set",
                allowed="block.parameter=value",
                fix="write for example --set jtraj.tmax=5",
            )
        if path in values:
            raise InputError(f"'{path}' is set twice", where="--set", fix="keep one of the two")
        values[path] = parse_value(value.strip(), where=f"--set {path}")
    return values


def chosen_parameters(diagram: Diagram, set_name: str | None, texts: Sequence[str] | None) -> dict[str, Any]:
    """Values by ``block.parameter``: first from a parameter set of the diagram, then from ``--set``.

    Raises ``UnknownNameError`` for an unknown set, and as
    :func:`~armblocks.diagram.parameter_sets.checked_set` and :func:`parse_assignments`.
    """
    from armblocks.diagram.parameter_sets import checked_set, parameter_set, set_location

    values: dict[str, Any] = {}
    if set_name is not None:
        values |= checked_set(diagram, parameter_set(diagram, set_name), set_location(diagram, set_name))
    return values | parse_assignments(texts or [])


def parse_value(text: str, where: str = "--set") -> Value:
    """The value of one text; raises ``InputError`` for an invalid text."""
    if len(text) >= 2 and text[0] == text[-1] and text[0] in "\"'":
        return text[1:-1]
    if _INTEGER.fullmatch(text):
        return int(text)
    if _DECIMAL.fullmatch(text):  # also NaN: the rule of the parameter checks the range
        return float(text)
    if text in ("true", "false"):
        return text == "true"
    if _WORD.fullmatch(text):
        return text
    from armblocks.diagram.mask import formula_number  # imports CasADi, which plain values do not need

    row = "," in text and not any(mark in text for mark in "[(")
    try:
        value = formula_number(f"[{text}]" if row else text, where)
    except ArmblocksError as error:
        raise InputError(
            error.what,
            where=where,
            allowed=_ALLOWED,
            fix="correct it, or put quotes around a string",
        ) from error
    is_row = row or (text.startswith("[") and text.endswith("]"))
    return [value] if is_row and not isinstance(value, list) else value
