"""The text of a script or formula, and positions in it: errors contain line, column and text."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import NamedTuple

from armblocks.errors import ArmblocksError, FormatError, InputError

SCRIPT_SYNTAX = (
    "straight-line scripts of the Robotics Toolbox: link, robot, Link, Revolute, Prismatic, SerialLink, "
    "their fields, cell arrays, matrices, arithmetic, common functions, comments, clear"
)
FORMULA_SYNTAX = (
    "numbers, names, u(1) or u[1], [1 2; 3 4], + - * / ^, comparisons, && || ~ and functions such as sin, "
    "sqrt, max"
)

MAX_QUOTE_LENGTH = 100
"""Maximum number of characters of a line that a message quotes."""
POINTER = "\u00bb"
"""Marks the column in a quoted line. Unlike ``^``, it is not an operator; old code pages contain it, too."""


class Position(NamedTuple):
    """A line and a column, both counted from 1."""

    line: int
    column: int


@dataclass(frozen=True, kw_only=True)
class Source:
    """The lines of a text, and its name in messages: a file (``is_file``), or the location of a formula."""

    name: str
    lines: tuple[str, ...]
    is_file: bool = False

    def location(self, at: Position) -> Location:
        """The location of a position."""
        return Location(self, at)


def formula_source(text: str, where: str) -> Source:
    """The lines of a formula; ``where`` identifies the formula in messages."""
    return Source(name=where, lines=_lines(text))


def script_source(text: str, name: str) -> Source:
    """The lines of a script with the file name ``name``."""
    return Source(name=name, lines=_lines(text), is_file=True)


def _lines(text: str) -> tuple[str, ...]:
    # Only MATLAB's own line ends: str.splitlines would also break at form feeds and Unicode separators.
    return tuple(re.split(r"\r\n|\r|\n", text))


@dataclass(frozen=True)
class Location:
    """A position in a source, for error messages."""

    source: Source
    at: Position

    def error(self, what: str, *, allowed: str = "", fix: str = "") -> ArmblocksError:
        """The error at this location, which the caller raises.

        ``FormatError`` for a script, with file and line; ``InputError`` for a formula.
        """
        source, (line, column) = self.source, self.at
        text = source.lines[line - 1] if 1 <= line <= len(source.lines) else ""
        if quoted := _quoted(text, column):
            within = f"line {line}, column" if len(source.lines) > 1 and not source.is_file else "column"
            what = f"{what}, in {within} {column}: {quoted}"
        if source.is_file:
            return FormatError(what, where=f"{source.name}:{line}", allowed=allowed or SCRIPT_SYNTAX, fix=fix)
        return InputError(
            what, where=source.name, allowed=allowed or FORMULA_SYNTAX, fix=fix or "correct the formula"
        )


def _quoted(text: str, column: int) -> str:
    """The line with a pointer before the column; of a long line, the part around it."""
    if not text.strip():
        return ""
    start, end = max(0, column - 1 - 2 * MAX_QUOTE_LENGTH // 3), column - 1
    before, after = text[start:end], text[end : start + MAX_QUOTE_LENGTH]
    head = "… " if start and before.strip() else ""
    tail = " …" if start + MAX_QUOTE_LENGTH < len(text.rstrip()) else ""
    return f"{head}{before.lstrip()}{POINTER}{after.rstrip()}{tail}"
