"""The grammar of ``--set block.parameter=value``: read by rule, nothing is evaluated.

::

    assignment = block "." parameter "=" value          the parameter follows the last dot before "="
    value      = scalar | vector | matrix | "true" | "false" | text
    vector     = "[" scalar (" " | ",") scalar … "]"    or, without brackets, 1,2,3
    matrix     = "[" row ";" row … "]"
    scalar     = number | [sign] [number "*"] "pi" ["/" number]
    text       = "…" | '…' | a bare word of letters, digits, "_", "-" and "."
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from armblocks.errors import InputError

Value = float | bool | str | list[float] | list[list[float]]

_ALLOWED = "a number, a vector [1 2 3] or 1,2,3, a matrix [1 2; 3 4], or text in quotes"
_NUMBER = r"(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_WHOLE = re.compile(r"[+-]?\d{1,15}", re.ASCII)
_PLAIN = re.compile(rf"[+-]?(?:{_NUMBER}|nan|inf)", re.ASCII | re.IGNORECASE)
_OF_PI = re.compile(rf"([+-]?)(?:({_NUMBER})\*)?pi(?:/({_NUMBER}))?", re.ASCII)
_WORD = re.compile(r"[A-Za-z_][A-Za-z0-9_.-]*", re.ASCII)


def parse_assignments(texts: Sequence[str]) -> dict[str, Value]:
    """Values by ``block.parameter``, from the texts of ``--set``.

    Raises ``InputError`` for a text that the grammar above does not know and for a parameter set twice.
    Whether the block and the parameter exist is for the diagram to say.
    """
    values: dict[str, Value] = {}
    for text in texts:
        path, equals, value = text.partition("=")
        path = path.strip()
        block, dot, parameter = path.rpartition(".")
        if not (equals and dot and block and parameter):
            raise InputError(
                f"'{text}' does not say which parameter gets which value",
                where="--set",
                allowed="block.parameter=value",
                fix="write for example --set jtraj.tmax=5",
            )
        if path in values:
            raise InputError(f"'{path}' is set twice", where="--set", fix="keep one of the two")
        values[path] = parse_value(value.strip(), where=f"--set {path}")
    return values


def parse_value(text: str, where: str = "--set") -> Value:
    """The value that one text says; raises ``InputError`` where it says none."""
    if len(text) >= 2 and text[0] == text[-1] and text[0] in "\"'":
        return text[1:-1]
    if text.startswith("[") and text.endswith("]"):
        rows = [_row(row, where) for row in text[1:-1].split(";")]
        if len(rows) == 1:
            return rows[0]
        if len({len(row) for row in rows}) > 1:
            lengths = ", ".join(str(len(row)) for row in rows)
            raise InputError(
                f"the rows of {text} have {lengths} numbers",
                where=where,
                allowed="rows of one length",
                fix="give every row as many numbers",
            )
        return rows
    if "," in text:
        return _row(text, where)
    if _WHOLE.fullmatch(text):
        return int(text)
    number = _scalar(text)
    if number is not None:
        return number
    if text in ("true", "false"):
        return text == "true"
    if _WORD.fullmatch(text):
        return text
    raise InputError(
        f"'{text}' is no value",
        where=where,
        allowed=_ALLOWED,
        fix="put quotes around a text that is none of these",
    )


def _row(text: str, where: str) -> list[float]:
    parts = [part.strip() for part in text.split(",")] if "," in text else text.split()
    numbers: list[float] = []
    for part in parts:
        number = _scalar(part)
        if number is None:
            found = (
                f"'{part}' in '{text.strip()}' is no number" if part else f"a number is missing in '{text}'"
            )
            raise InputError(found, where=where, allowed=_ALLOWED, fix="correct that number")
        numbers.append(number)
    return numbers


def _scalar(text: str) -> float | None:
    if _PLAIN.fullmatch(text):
        return float(text)
    match = _OF_PI.fullmatch(text)
    if match is None:
        return None
    sign, factor, divisor = match.groups()
    value = math.pi * float(factor or 1.0)
    if divisor:
        value = value / float(divisor) if float(divisor) else math.nan
    return -value if sign == "-" else value
