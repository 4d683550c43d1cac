"""From tokens to statements, with MATLAB's precedences and its rule for blanks inside matrices."""

from __future__ import annotations

import re

from armblocks.formats.matlab.lexer import Kind, Token, tokenize
from armblocks.formats.matlab.source import Source
from armblocks.formats.matlab.syntax import (
    Assignment,
    Braces,
    CellLiteral,
    Chain,
    Command,
    Evaluation,
    Expression,
    Field,
    Matrix,
    Name,
    Negative,
    Number,
    Parentheses,
    Postfix,
    Range,
    Statement,
    Step,
    Target,
    Text,
    Transpose,
)

DEEPEST = 30
"""Brackets inside brackets."""

KEYWORDS = frozenset(
    re.findall(
        r"\w+",
        """break case catch classdef continue else elseif end for function global if otherwise parfor
        persistent return spmd switch try while""",
    )
)

_SUMS = ("+", "-")
_PRODUCTS = ("*", "/", "\\", ".*", "./", ".\\")
_POWERS = ("^", ".^")


def parse(source: Source) -> tuple[Statement, ...]:
    """All statements of a script. Raises ``FormatError`` at the first line that is not understood."""
    return _Parser(source, tokenize(source)).run()


class _Parser:
    """Recursive descent; ``in_matrix`` says that blanks part elements right here."""

    def __init__(self, source: Source, tokens: list[Token]) -> None:
        self.source = source
        self.tokens = tokens
        self.position = 0
        self.in_matrix = False
        self.depth = 0

    def run(self) -> tuple[Statement, ...]:
        statements: list[Statement] = []
        while self.token.kind is not Kind.EOF:
            if self.token.kind is Kind.END:
                self.position += 1
                continue
            statements.append(self._statement())
            self._expect_end()
        return tuple(statements)

    @property
    def token(self) -> Token:
        return self.tokens[self.position]

    def _is(self, *texts: str) -> bool:
        return self.token.kind is Kind.OPERATOR and self.token.text in texts

    def _take(self) -> Token:
        token = self.token
        self.position += 1
        return token

    def _expect(self, text: str) -> None:
        if not self._is(text):
            raise self._unexpected(f"'{text}'")
        self.position += 1

    def _expect_end(self) -> None:
        if self.token.kind is not Kind.END:
            raise self._unexpected()

    def _unexpected(self, wanted: str = "") -> Exception:
        token = self.token
        shown = {
            Kind.END: "the end of the statement",
            Kind.ROW: "the end of the line",
            Kind.EOF: "the end",
        }.get(token.kind, f"'{token.text[:40]}'")
        hint = f", expected {wanted}" if wanted else ""
        return self.source.place(token.line).error(f"{shown} is not understood here{hint}")

    def _statement(self) -> Statement:
        token = self.token
        place = self.source.place(token.line)
        if token.kind is Kind.COMMAND:
            self.position += 1
            words = tuple(token.text.split())
            if not all(re.fullmatch(r"-?[A-Za-z]\w*", word) for word in words):
                raise place.error(f"the command '{token.text[:40]}' is not supported", allowed="clear NAME …")
            return Command(words, token.line)
        if token.kind is Kind.NAME and token.text in KEYWORDS:
            raise place.error(f"'{token.text}' is not supported")
        value = self._expression()
        if not self._is("="):
            return Evaluation(value, token.line)
        self.position += 1
        targets: list[Target] = []
        match value:
            case Name(name=name):
                pass
            case Postfix(base=Name(name=name), steps=steps):
                targets = [step for step in steps if not isinstance(step, Transpose)]
                if len(targets) < len(steps):
                    raise place.error(
                        "a transpose cannot be assigned to", allowed="name, name{i}, name.field …"
                    )
            case Matrix():
                raise place.error("assignment to several variables at once is not supported")
            case _:
                raise place.error(
                    "the left side of '=' is not a variable", allowed="name, name{i}, name.field …"
                )
        result = Assignment(name, tuple(targets), self._expression(), token.line)
        if self._is("="):
            raise place.error("two '=' in one statement", allowed="one assignment a statement")
        return result

    def _expression(self) -> Expression:
        """A range, or what binds tighter."""
        line = self.token.line
        parts = [self._chain(_SUMS)]
        while self._is(":") and len(parts) < 3:
            self.position += 1
            parts.append(self._chain(_SUMS))
        return parts[0] if len(parts) == 1 else Range(tuple(parts), line)

    def _chain(self, operators: tuple[str, ...]) -> Expression:
        line = self.token.line
        first = self._product() if operators is _SUMS else self._signed()
        rest: list[tuple[str, Expression]] = []
        while self._is(*operators) and not self._parts_elements():
            operator = self._take().text
            rest.append((operator, self._product() if operators is _SUMS else self._signed()))
        return Chain(first, tuple(rest), line) if rest else first

    def _product(self) -> Expression:
        return self._chain(_PRODUCTS)

    def _parts_elements(self) -> bool:
        """Inside a matrix ``[1 -2]`` has two elements and ``[1 - 2]``, ``[1-2]`` have one."""
        if not self.in_matrix or not self._is("+", "-"):
            return False
        return self.token.spaced and not self.tokens[self.position + 1].spaced

    def _signed(self) -> Expression:
        """A row of signs and what follows; the power binds tighter than the sign."""
        line = self.token.line
        negative = False
        while self._is("+", "-"):
            negative ^= self._take().text == "-"
        operand = self._power()
        return Negative(operand, line) if negative else operand

    def _power(self) -> Expression:
        line = self.token.line
        first = self._postfix()
        rest: list[tuple[str, Expression]] = []
        while self._is(*_POWERS):
            operator = self._take().text
            sign_line, negative = self.token.line, False
            while self._is("+", "-"):
                negative ^= self._take().text == "-"
            operand = self._postfix()
            rest.append((operator, Negative(operand, sign_line) if negative else operand))
        return Chain(first, tuple(rest), line) if rest else first

    def _postfix(self) -> Expression:
        line = self.token.line
        base = self._primary()
        steps: list[Step] = []
        while (step := self._step()) is not None:
            steps.append(step)
        return Postfix(base, tuple(steps), line) if steps else base

    def _step(self) -> Step | None:
        token = self.token
        if token.kind is not Kind.OPERATOR or (self.in_matrix and token.spaced):
            return None
        if token.text in ("'", ".'"):
            self.position += 1
            return Transpose(token.line)
        if token.text == "(":
            return Parentheses(self._arguments("(", ")"), token.line)
        if token.text == "{":
            return Braces(self._arguments("{", "}"), token.line)
        if token.text == ".":
            self.position += 1
            if self.token.kind is not Kind.NAME:
                raise self._unexpected("the name of a field")
            return Field(self._take().text, token.line)
        return None

    def _primary(self) -> Expression:
        token = self.token
        if token.kind is Kind.NUMBER:
            self.position += 1
            return Number(token.number, token.line)
        if token.kind is Kind.STRING:
            self.position += 1
            return Text(token.text, token.line)
        if token.kind is Kind.NAME:
            if token.text in KEYWORDS:
                raise self.source.place(token.line).error(f"'{token.text}' is not supported here")
            self.position += 1
            return Name(token.text, token.line)
        if self._is("("):
            self._enter(matrix=False)
            outer, self.in_matrix = self.in_matrix, False
            self.position += 1
            value = self._expression()
            self._expect(")")
            self.in_matrix, self.depth = outer, self.depth - 1
            return value
        if self._is("["):
            return self._matrix()
        if self._is("{"):
            line = token.line
            rows, _ = self._rows("{", "}")
            if len(rows) > 1 and any(len(row) != 1 for row in rows):
                raise self.source.place(line).error("a cell array with several rows is not supported")
            return CellLiteral(tuple(element for row in rows for element in row), line)
        raise self._unexpected("a value")

    def _enter(self, *, matrix: bool) -> None:
        self.depth += 1
        if self.depth > DEEPEST:
            kind = "[" if matrix else "("
            raise self.source.place(self.token.line).error(
                f"'{kind}' lies too deep in other brackets", allowed=f"{DEEPEST} brackets inside each other"
            )

    def _arguments(self, opening: str, closing: str) -> tuple[Expression, ...]:
        """``(a, b)``: blanks part nothing in here."""
        self._enter(matrix=False)
        outer, self.in_matrix = self.in_matrix, False
        self._expect(opening)
        arguments: list[Expression] = []
        self._skip_newlines()
        while not self._is(closing):
            arguments.append(self._expression())
            self._skip_newlines()
            if not self._is(closing):
                self._expect(",")
                self._skip_newlines()
        self.position += 1
        self.in_matrix, self.depth = outer, self.depth - 1
        return tuple(arguments)

    def _skip_newlines(self) -> None:
        while self.token.kind is Kind.ROW:
            self.position += 1

    def _matrix(self) -> Expression:
        line = self.token.line
        rows, broken = self._rows("[", "]")
        return Matrix(rows, broken, line)

    def _rows(self, opening: str, closing: str) -> tuple[tuple[tuple[Expression, ...], ...], bool]:
        """Rows of a matrix or cell literal without the empty ones, and whether newlines alone part them."""
        self._enter(matrix=True)
        outer, self.in_matrix = self.in_matrix, True
        self._expect(opening)
        rows: list[tuple[Expression, ...]] = []
        row: list[Expression] = []
        semicolons = False
        while not self._is(closing):
            if self._is(";") or self.token.kind is Kind.ROW:
                semicolons |= self._take().text == ";"
                if row:
                    rows.append(tuple(row))
                    row = []
                continue
            if self._is(","):
                if not row or self.tokens[self.position - 1].text == ",":
                    raise self._unexpected("a value")
                self.position += 1
                continue
            row.append(self._expression())
        if row:
            rows.append(tuple(row))
        self.position += 1
        self.in_matrix, self.depth = outer, self.depth - 1
        return tuple(rows), len(rows) > 1 and not semicolons
