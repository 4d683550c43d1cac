"""Converts the characters of a script or formula to tokens.

This module handles the special cases of MATLAB's syntax:

- a quote is a transpose after an operand, and starts a string elsewhere,
- a newline ends a statement outside brackets, and a row inside them,
- line continuation, block comments and command syntax (``clear L``).

It accepts statements that a printed page splits into lines. A line that ends with ``=`` or an operator
continues on the next line, and a line that starts with ``=`` continues the previous line. MATLAB rejects both
forms. Scripts that MATLAB accepts therefore have the same meaning in this module.
"""

from __future__ import annotations

import enum
import math
import re
from dataclasses import dataclass

from armblocks.errors import ArmblocksError
from armblocks.matlab.operators import ALTERNATIVES, INFIX
from armblocks.matlab.source import Location, Position, Source


class Kind(enum.Enum):
    """The kinds of tokens."""

    NUMBER = "number"
    NAME = "name"
    STRING = "string"
    OPERATOR = "operator"
    ROW = "end of row"
    """A newline right inside ``[ ]`` or ``{ }``."""
    END = "end of statement"
    COMMAND = "command"
    EOF = "end of file"


@dataclass(frozen=True, slots=True)
class Token:
    """One token; ``spaced``: whether blanks precede it, which matters inside matrices."""

    kind: Kind
    text: str
    at: Position
    spaced: bool = False
    number: float = 0.0


COMMANDS = ("clear", "clearvars", "clc", "close", "format", "more")
"""Commands that MATLAB scripts write in command syntax; all except the first two have no effect here."""

_DIGITS = "[0-9](?:_?[0-9])*"
_NUMBER = re.compile(
    rf"0[xX][0-9a-fA-F](?:_?[0-9a-fA-F])*|0[bB][01](?:_?[01])*|0[oO][0-7](?:_?[0-7])*"
    rf"|(?:{_DIGITS}(?:\.(?!\*(?!\*)|[/\\^']|\.\.)(?:{_DIGITS})?)?|\.{_DIGITS})(?:[eEdD][+-]?{_DIGITS})?"
)
_NAME = re.compile(r"[^\W\d]\w*")
_OPERATOR = re.compile(
    "|".join(map(re.escape, sorted({*INFIX, *ALTERNATIVES, ".'", *"=~'()[]{},;.@"}, key=len, reverse=True)))
)
_CONTINUED_OPERATORS = frozenset((*INFIX, "=", ",", "(", "~"))
"""Operators after which no statement can end."""
_CLOSING_BRACKETS = {"(": ")", "[": "]", "{": "}"}


def tokenize(source: Source) -> list[Token]:
    """All tokens of a source, with an END after every statement and an EOF at the end.

    Raises an error at invalid or unsupported characters, numbers and strings,
    and at brackets that do not match.
    """
    return _Lexer(source).run()


class _Lexer:
    """Reads the lines once; ``brackets`` contains the open brackets and their positions."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.tokens: list[Token] = []
        self.brackets: list[tuple[str, Position]] = []
        self.comment_starts: list[int] = []

    def run(self) -> list[Token]:
        for number, text in enumerate(self.source.lines, start=1):
            if self.source.is_file and self._block_comment(number, text):
                continue
            if not self._line(number, text):
                self._newline(number)
        if self.comment_starts:
            raise self._at(self.comment_starts[-1], 1).error(
                "the block comment is never closed", allowed="%{ … %}, each on a separate line"
            )
        if self.brackets:
            bracket, at = self.brackets[-1]
            raise self.source.location(at).error(
                f"'{bracket}' is never closed",
                allowed="brackets in pairs",
                fix=f"add '{_CLOSING_BRACKETS[bracket]}'",
            )
        last = Position(len(self.source.lines), len(self.source.lines[-1].rstrip()) + 1)
        self.tokens += [Token(Kind.END, "\n", last), Token(Kind.EOF, "", last)]
        return self.tokens

    def _at(self, line: int, column: int) -> Location:
        return self.source.location(Position(line, column))

    def _block_comment(self, number: int, text: str) -> bool:
        """Whether the line belongs to a block comment ``%{ … %}``. Block comments can be nested."""
        word = text.strip()
        if word == "%{":
            self.comment_starts.append(number)
            return True
        if self.comment_starts:
            if word == "%}":
                self.comment_starts.pop()
            return True
        return False

    def _line(self, number: int, text: str) -> bool:
        """Read one line; returns whether it ends in a continuation ``...``."""
        position = 0
        spaced = True
        while position < len(text):
            character = text[position]
            if character.isspace():
                position, spaced = position + 1, True
                continue
            if self._comment(number, text, position):
                return False
            if text.startswith("...", position):
                return True
            position = self._token(number, text, position, spaced)
            spaced = False
        return False

    def _comment(self, number: int, text: str, position: int) -> bool:
        """Whether a comment starts here: ``%`` in scripts; ``#``, as in Python, in formulas."""
        if self.source.is_file:
            return text[position] == "%"
        if text[position] == "%":
            raise self._at(number, position + 1).error(
                "'%' starts a comment in MATLAB and is the remainder in Python",
                allowed="# for comments, mod(a, b) for the remainder with the sign of b, rem(a, b) of a",
                fix="write mod(a, b), or remove the comment",
            )
        return text[position] == "#"

    def _token(self, number: int, text: str, position: int, spaced: bool) -> int:
        """Read one token and return the start of the next token."""
        character = text[position]
        at = Position(number, position + 1)
        if (match := _NUMBER.match(text, position)) is not None:
            return self._number(at, text, match, spaced)
        if (match := _NAME.match(text, position)) is not None and match.group().isidentifier():
            if self.source.is_file and match.group() in COMMANDS and self._starts_statement():
                after = text[match.end() :].lstrip()
                if not after.startswith("(") and not re.match(r"=(?!=)", after):
                    return self._command(at, text, position)
            self.tokens.append(Token(Kind.NAME, match.group(), at, spaced))
            return match.end()
        if character == '"' or (character == "'" and not self._is_transpose(spaced)):
            return self._string(at, text, position, spaced)
        if (match := _OPERATOR.match(text, position)) is not None:
            self._operator(at, ALTERNATIVES.get(match.group(), match.group()), spaced)
            return match.end()
        raise self.source.location(at).error(
            f"the character {character!r} is not allowed in MATLAB outside strings"
        )

    def _number(self, at: Position, text: str, match: re.Match[str], spaced: bool) -> int:
        literal = match.group()
        after = text[match.end() : match.end() + 1]
        if after.isalnum() or after == "_":
            raise self._number_error(at, re.match(r"[\w.]+", text[match.start() :]))
        digits = literal.replace("_", "")
        try:
            base = {"x": 16, "b": 2, "o": 8}.get(digits[1:2].lower())
            value = float(int(digits, base)) if base else float(digits.translate(_EXPONENTS))
        except OverflowError:
            value = math.inf
        if math.isinf(value):
            raise self.source.location(at).error(
                f"'{_short(literal)}' is too large a number", allowed="magnitudes below 1.8e308"
            )
        self.tokens.append(Token(Kind.NUMBER, literal, at, spaced, value))
        return match.end()

    def _number_error(self, at: Position, word: re.Match[str] | None) -> ArmblocksError:
        word_text = _short(word.group()) if word else ""
        if re.fullmatch(r"[0-9.]+(?:[eE][0-9]+)?[ij]", word_text):
            return self.source.location(at).error(
                f"'{word_text}' is an imaginary number", allowed="real numbers", fix="use real numbers"
            )
        return self.source.location(at).error(
            f"'{word_text}' is not a number", allowed="numbers such as 12, .5, 1.8e-3"
        )

    def _string(self, at: Position, text: str, position: int, spaced: bool) -> int:
        quote = text[position]
        match = re.compile(f"{quote}((?:[^{quote}]|{quote}{quote})*){quote}").match(text, position)
        if match is None:
            raise self.source.location(at).error(
                f"the string that {quote} starts is not closed on its line", allowed="'text' or \"text\""
            )
        self.tokens.append(Token(Kind.STRING, match.group(1).replace(quote * 2, quote), at, spaced))
        return match.end()

    def _command(self, at: Position, text: str, position: int) -> int:
        match = re.compile(r"[^;,%]*").match(text, position)
        end = match.end() if match is not None else len(text)
        self.tokens.append(Token(Kind.COMMAND, text[position:end].strip(), at))
        return end

    def _operator(self, at: Position, operator: str, spaced: bool) -> None:
        if operator == "@":
            raise self.source.location(at).error("function handles ('@') are not supported")
        if operator in _CLOSING_BRACKETS:
            self.brackets.append((operator, at))
        elif operator in (")", "]", "}"):
            if not self.brackets or _CLOSING_BRACKETS[self.brackets[-1][0]] != operator:
                raise self.source.location(at).error(
                    f"'{operator}' closes no bracket", allowed="brackets in pairs", fix="remove or match it"
                )
            self.brackets.pop()
        elif operator in (";", ",") and not self.brackets:
            self.tokens.append(Token(Kind.END, operator, at))
            return
        elif operator == "=" and self._starts_statement():
            self._undo_newline()
        self.tokens.append(Token(Kind.OPERATOR, operator, at, spaced))

    def _newline(self, line: int) -> None:
        last = self.tokens[-1] if self.tokens else None
        end = Position(line, len(self.source.lines[line - 1].rstrip()) + 1)
        if self.brackets and self.brackets[-1][0] in ("[", "{"):
            self.tokens.append(Token(Kind.ROW, "\n", end))
        elif last is not None and last.kind is Kind.OPERATOR and last.text in _CONTINUED_OPERATORS:
            return  # a statement cannot end here: the line was broken on a printed page
        elif self.brackets and self.source.is_file:
            bracket, start = self.brackets[-1]
            raise self.source.location(start).error(
                f"'{bracket}' is not closed on its line",
                allowed="a statement over several lines continues with '...'",
                fix=f"add '{_CLOSING_BRACKETS[bracket]}' or '...'",
            )
        elif not self.brackets:
            self.tokens.append(Token(Kind.END, "\n", end))

    def _undo_newline(self) -> None:
        """Remove the newlines before a line that starts with ``=``, because it continues the statement."""
        while self.tokens and self.tokens[-1].kind is Kind.END and self.tokens[-1].text == "\n":
            self.tokens.pop()

    def _starts_statement(self) -> bool:
        return not self.tokens or self.tokens[-1].kind is Kind.END

    def _is_transpose(self, spaced: bool) -> bool:
        if not self.tokens:
            return False
        last = self.tokens[-1]
        operand = last.kind in (Kind.NUMBER, Kind.NAME) or last.text in (")", "]", "}", "'", ".'")
        if last.kind is Kind.STRING:
            operand = False
        in_matrix = bool(self.brackets) and self.brackets[-1][0] in ("[", "{")
        return operand and not (in_matrix and spaced)


_EXPONENTS = str.maketrans("dD", "ee")


def _short(text: str) -> str:
    return text if len(text) <= 40 else text[:37] + "..."
