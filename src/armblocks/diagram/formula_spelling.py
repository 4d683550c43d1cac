"""Translation of MATLAB-like formulas, ``[1 2; 3 4]' * k``, into Python syntax.

:mod:`armblocks.diagram.expression_language` checks which constructs are allowed. Inside brackets, spaces
separate elements as in MATLAB: ``[a -b]`` has two elements, ``[a - b]`` and ``[a-b]`` one.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from armblocks.errors import InputError

CALLED_IF = "if_"
"""``if`` is a keyword of Python."""
CALLED_RANGE = "range_"
"""``a:b`` and ``a:step:b`` inside brackets."""
DEEPEST = 20
"""Maximum nesting depth of brackets."""

_OPERATORS = (
    (r"\.\*(?!\*)", "@"),
    (r"\./", "//"),
    (r"\.?\^", "**"),
    (r"&&", " and "),
    (r"\|\|", " or "),
    (r"~=", "!="),
    (r"!(?!=)|~", " not "),
)
_OPERAND_END = re.compile(r"[\w.)\]']")
_ONE_ELEMENT = "*/^<>=&|,;:"
"""Next to one of these characters a space does not separate elements."""


def python_spelling(text: str, where: str) -> str:
    """The formula in Python syntax. Raises ``InputError`` for unbalanced brackets."""
    if "[" in text or "'" in text:
        text = "".join(_Brackets(text, where).rewritten())
    text = re.sub(r"\bif\s*\(", f"{CALLED_IF}(", text)
    text = re.sub(r"(?<![\w.])0+(?=\d)", "", text)  # Python refuses 007
    for pattern, python in _OPERATORS:
        text = re.sub(pattern, python, text)
    return text.strip()


class _Brackets:
    """Reads a text once, from left to right; arrays become lists of rows, ``'`` becomes ``.T``."""

    def __init__(self, text: str, where: str) -> None:
        self._text = text
        self._where = where
        self._place = 0

    def rewritten(self) -> Iterator[str]:
        """The text in pieces."""
        while self._place < len(self._text):
            yield self._piece(0)

    def _piece(self, depth: int) -> str:
        """One character, or one pair of brackets."""
        mark = self._text[self._place]
        before = self._text[self._place - 1] if self._place else " "
        self._place += 1
        if mark == "[":
            if depth >= DEEPEST:
                raise self._error("brackets are nested too deeply", f"{DEEPEST} levels")
            return self._index(depth) if re.fullmatch(r"[\w)\]]", before) else self._array(depth + 1)
        if mark == "." and self._text.startswith("'", self._place):  # .' is ' for real numbers
            self._place += 1
            return " .T"
        if mark == "'" and _OPERAND_END.fullmatch(before):
            return " .T"  # the space separates the point from a preceding number
        return mark

    def _index(self, depth: int) -> str:
        pieces = ["["]
        while self._mark() != "]":
            pieces.append(self._piece(depth + 1))
        self._place += 1
        return "".join([*pieces, "]"])

    def _array(self, depth: int) -> str:
        rows: list[list[str]] = [[""]]
        round_brackets = 0
        while (mark := self._mark()) != "]" or round_brackets:
            round_brackets += (mark == "(") - (mark == ")")
            if round_brackets:
                rows[-1][-1] += self._piece(depth)
            elif mark == ";":
                self._place += 1
                rows.append([""])
            elif mark == ",":
                if not rows[-1][-1].strip():
                    raise self._error("a number is missing before a comma", "one comma between two elements")
                self._place += 1
                rows[-1].append("")
            elif mark.isspace():
                if self._parts(rows[-1][-1]):
                    rows[-1].append("")
            else:
                rows[-1][-1] += self._piece(depth)
        self._place += 1
        # A space before a comma or the end separates no elements.
        shown = [[_ranged(entry) for entry in row if entry.strip()] for row in rows]
        return "[" + ", ".join("[" + ", ".join(row) + "]" for row in shown if row) + "]"

    def _parts(self, before: str) -> bool:
        """Skip spaces; return whether they separate two elements."""
        while self._mark().isspace():
            self._place += 1
        after = self._text[self._place : self._place + 2]
        if not before.strip() or not _OPERAND_END.fullmatch(before.rstrip()[-1]):
            return False
        if after[0] in "+-":
            return not after[1:].isspace()
        return after[0] not in _ONE_ELEMENT and after not in ("!=", "~=", ".*", "./", ".^")

    def _mark(self) -> str:
        if self._place >= len(self._text):
            raise self._error("a bracket '[' is not closed", "one ']' for each '['")
        return self._text[self._place]

    def _error(self, what: str, allowed: str) -> InputError:
        return InputError(what, where=self._where, allowed=allowed, fix="correct the formula")


def _ranged(entry: str) -> str:
    """An element, or ``range_(a, b)`` where it is ``a:b``."""
    if ":" not in entry:
        return entry.strip()
    return f"{CALLED_RANGE}({', '.join(part.strip() for part in entry.split(':'))})"
