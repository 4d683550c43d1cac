"""Converts tokens to expressions, with MATLAB's precedences and its rule for blanks inside matrices.

In formulas, ``u[1]`` is an index like ``u(1)``; in scripts, a bracket directly after an operand starts
another element of a matrix, as in MATLAB.
"""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import islice

from armblocks.errors import ArmblocksError
from armblocks.matlab.lexer import Kind, Token, tokenize
from armblocks.matlab.operators import INFIX, SIGNS, WORDS, Level
from armblocks.matlab.source import Position, Source
from armblocks.matlab.syntax import (
    All,
    Braces,
    CellLiteral,
    Chain,
    End,
    Expression,
    Field,
    Matrix,
    Name,
    Number,
    Operation,
    Parentheses,
    Postfix,
    Prefix,
    Range,
    Step,
    Text,
    Transpose,
    levels,
)

MAX_BRACKET_DEPTH = 60
"""Maximum nesting of brackets."""
MAX_TREE_DEPTH = 200
"""Maximum nesting of an expression, which has a level for every change of precedence."""

KEYWORDS = frozenset(
    re.findall(
        r"\w+",
        """break case catch classdef continue else elseif end for function global if otherwise parfor
        persistent return spmd switch try while""",
    )
)
"""Words that a script cannot use as names. In formulas these words may be names."""


def parse_formula(source: Source) -> Expression:
    """The expression of a formula. Raises ``InputError`` with the position of the first error."""
    parser = Parser(source)
    parser.skip_ends()
    value = parser.expression()
    parser.expect_end()
    parser.skip_ends()
    if parser.token.kind is not Kind.EOF:
        raise parser.unexpected()
    return value


class Parser:
    """Precedence climbing; ``in_matrix``: whether blanks separate elements here."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.tokens = tokenize(source)
        self.position = 0
        self.in_matrix = False
        self.depth = 0
        self.indices = 0
        """Number of open indices and calls around the current token."""

    # -- tokens ------------------------------------------------------------------------------------------

    @property
    def token(self) -> Token:
        """The next token."""
        return self.tokens[self.position]

    def at_operator(self, *texts: str) -> bool:
        """Whether the next token is one of these operators."""
        return self.token.kind is Kind.OPERATOR and self.token.text in texts

    def take(self) -> Token:
        """Consume the next token."""
        token = self.token
        self.position += 1
        return token

    def skip_ends(self) -> None:
        """Consume newlines before or after an expression."""
        while self.token.kind is Kind.END and self.token.text == "\n":
            self.position += 1

    def expect_end(self) -> None:
        """Raise an error unless a statement ends here."""
        if self.token.kind is not Kind.END or (not self.source.is_file and self.token.text != "\n"):
            raise self.unexpected()

    def unexpected(self, expected: str = "") -> ArmblocksError:
        """The error at a token that does not fit here."""
        token = self.token
        text = {Kind.ROW: "the end of the line", Kind.EOF: "the end"}.get(token.kind, f"'{token.text[:40]}'")
        if not expected and token.kind in (Kind.NUMBER, Kind.NAME, Kind.STRING):
            expected = "an operator"
        message = f"{text} is not allowed here" + (f", expected {expected}" if expected else "")
        if token.kind is Kind.END and token.text == "\n":
            text_kind = "statement" if self.source.is_file else "formula"
            message = f"the {text_kind} ends where {expected or 'something else'} is expected"
        fix = ""
        if token.text == "=" and not self.source.is_file:
            fix = "compare with '=='"
        elif token.text == "if":
            fix = "write if(condition, yes, no)"
        return self.source.location(token.at).error(message, fix=fix)

    def _expect(self, text: str) -> None:
        if not self.at_operator(text):
            raise self.unexpected(f"'{text}'")
        self.position += 1

    # -- operators ---------------------------------------------------------------------------------------

    def expression(self) -> Expression:
        """A whole expression. Raises an error if it is nested too deeply."""
        start = self.token.at
        try:
            tree = self._operators(Level.OR_ELSE)
        except RecursionError:
            raise self._depth_error(start) from None
        if self.depth == 0 and next(islice(levels(tree), MAX_TREE_DEPTH, None), None):
            raise self._depth_error(start)
        return tree

    def _depth_error(self, at: Position) -> ArmblocksError:
        return self.source.location(at).error(
            "the expression is nested too deeply",
            allowed=f"{MAX_TREE_DEPTH} levels of operators",
            fix="split it",
        )

    def _operators(self, min_level: Level) -> Expression:
        """Operands and the operators between them that bind at least as tightly as ``min_level``."""
        at = self.token.at
        operand = self._not_word(min_level) if self._is_word("not") else self._signed()
        while (level := self._level()) is not None and level >= min_level:
            if level is Level.RANGE:
                operand = self._range(operand, at)
                continue
            rest: list[Operation] = []
            while self._level() is level:
                token = self.take()
                operator = WORDS.get(token.text, token.text)
                rest.append(Operation(operator, self._operators(Level(level + 1)), token.at))
            if level is Level.COMPARISON and len(rest) > 1:
                raise self.source.location(rest[1].at).error(
                    "comparisons cannot be chained",
                    allowed="one comparison between && or ||",
                    fix="write a < b && b < c, or set brackets",
                )
            operand = Chain(operand, tuple(rest), at)
        return operand

    def _level(self) -> Level | None:
        """The level of the next token if it is an operator between two operands."""
        token = self.token
        if token.kind is Kind.NAME and token.text in WORDS and not self.in_matrix:
            return INFIX[WORDS[token.text]]
        if token.kind is not Kind.OPERATOR:
            return None
        level = INFIX.get(token.text)
        if level is Level.SUM and self.in_matrix and token.spaced:
            # [1 -2] has two elements; [1 - 2] and [1-2] have one.
            return level if self.tokens[self.position + 1].spaced else None
        return level

    def _is_word(self, word: str) -> bool:
        """Whether the next token is a word used as an operator, not the name of a function."""
        following = self.tokens[min(self.position + 1, len(self.tokens) - 1)]
        calls = following.text == "(" and not following.spaced
        return self.token.kind is Kind.NAME and self.token.text == word and not calls and not self.in_matrix

    def _not_word(self, min_level: Level) -> Expression:
        token = self.take()
        if min_level > Level.NOT_WORD:
            raise self.source.location(token.at).error(
                "'not' needs brackets here", allowed="~x, or not(x)", fix="write ~"
            )
        return Prefix("~", self._operators(Level.NOT_WORD), token.at)

    def _range(self, first: Expression, at: Position) -> Expression:
        parts = [first]
        while self.at_operator(":"):
            if len(parts) == 3:
                raise self.unexpected()
            self.position += 1
            parts.append(self._operators(Level.SUM))
        return Range(tuple(parts), at)

    def _signed(self) -> Expression:
        """A sequence of signs and its operand; a power binds tighter than a sign.

        A transpose has the precedence of a power: ``A^2'`` is ``(A^2)'``.
        """
        signs = self._signs()
        at = self.token.at
        operand = self._postfix()
        rest: list[Operation] = []
        while self._level() is Level.POWER:
            token = self.take()
            exponent_signs = self._signs()
            rest.append(
                Operation(token.text, _with_signs(exponent_signs, self._postfix(exponent=True)), token.at)
            )
            if self._at_transpose():
                power, steps = Chain(operand, tuple(rest), at), list[Step]()
                while self._at_transpose():
                    steps.append(Transpose(self.take().at))
                operand, rest = Postfix(power, tuple(steps), at), []
        return _with_signs(signs, Chain(operand, tuple(rest), at) if rest else operand)

    def _signs(self) -> list[Token]:
        signs: list[Token] = []
        while self.at_operator(*SIGNS) or (signs and signs[-1].text == "~" and self._is_word("not")):
            token = self.take()
            signs.append(replace(token, text="~") if token.text == "not" else token)
        return signs

    # -- operands ----------------------------------------------------------------------------------------

    def _at_transpose(self) -> bool:
        return self.at_operator("'", ".'") and not (self.in_matrix and self.token.spaced)

    def _postfix(self, *, exponent: bool = False) -> Expression:
        """An operand with its indices, fields and transposes; an ``exponent`` ends before a transpose."""
        at = self.token.at
        base = self._primary()
        steps: list[Step] = []
        while not (exponent and self._at_transpose()):
            if (step := self._step(base, bool(steps))) is None:
                break
            steps.append(step)
        if steps and isinstance(base, Postfix):
            return Postfix(base.base, (*base.steps, *steps), at)
        return Postfix(base, tuple(steps), at) if steps else base

    def _step(self, base: Expression, has_steps: bool) -> Step | None:
        token = self.token
        if token.kind is not Kind.OPERATOR or (self.in_matrix and token.spaced):
            return None
        if token.text in ("'", ".'"):
            self.position += 1
            return Transpose(token.at)
        if token.text == "(":
            return Parentheses(self._arguments("(", ")"), token.at)
        if token.text == "[" and not (self.source.is_file or token.spaced or has_steps):
            return Parentheses(self._arguments("[", "]"), token.at) if isinstance(base, Name) else None
        if token.text == "{":
            return Braces(self._arguments("{", "}"), token.at)
        if token.text == ".":
            self.position += 1
            if self.token.kind is not Kind.NAME:
                raise self.unexpected("the name of a field")
            return Field(self.take().text, token.at)
        return None

    def _primary(self) -> Expression:
        token = self.token
        if token.kind is Kind.NUMBER:
            self.position += 1
            return Number(token.number, token.at)
        if token.kind is Kind.STRING:
            self.position += 1
            return Text(token.text, token.at)
        if token.kind is Kind.NAME:
            return self._name()
        if self.at_operator("("):
            self._enter()
            outer, self.in_matrix = self.in_matrix, False
            self.position += 1
            self._skip_rows()
            value = self._operators(Level.OR_ELSE)
            self._skip_rows()
            self._expect(")")
            self.in_matrix, self.depth = outer, self.depth - 1
            return value
        if self.at_operator("["):
            rows, line_breaks = self._rows("[", "]")
            return Matrix(rows, line_breaks, token.at)
        if self.at_operator("{"):
            rows, _ = self._rows("{", "}")
            if len(rows) > 1 and any(len(row) != 1 for row in rows):
                raise self.source.location(token.at).error("a cell array with several rows is not supported")
            return CellLiteral(tuple(element for row in rows for element in row), token.at)
        raise self.unexpected("a value")

    def _name(self) -> Expression:
        token = self.token
        if token.text == "end" and self.indices:
            self.position += 1
            return End(token.at)
        called = token.text == "if" and self.tokens[self.position + 1].text == "("
        if token.text in KEYWORDS and self.source.is_file and not called:
            raise self.source.location(token.at).error(f"'{token.text}' is not supported here")
        self.position += 1
        return Name(token.text, token.at)

    def _enter(self) -> None:
        self.depth += 1
        if self.depth > MAX_BRACKET_DEPTH:
            raise self.source.location(self.token.at).error(
                "brackets are nested too deeply",
                allowed=f"{MAX_BRACKET_DEPTH} brackets inside each other",
                fix="split the expression",
            )

    def _arguments(self, opening: str, closing: str) -> tuple[Expression, ...]:
        """``(a, b)``: blanks do not separate arguments."""
        self._enter()
        outer, self.in_matrix = self.in_matrix, False
        self.indices += 1
        self._expect(opening)
        arguments: list[Expression] = []
        self._skip_rows()
        while not self.at_operator(closing):
            arguments.append(self._argument())
            self._skip_rows()
            if not self.at_operator(closing):
                self._expect(",")
                self._skip_rows()
        self.position += 1
        self.indices -= 1
        self.in_matrix, self.depth = outer, self.depth - 1
        return tuple(arguments)

    def _argument(self) -> Expression:
        following = self.tokens[self.position + 1]
        if (
            self.at_operator(":")
            and following.kind is Kind.OPERATOR
            and following.text in (",", ")", "]", "}")
        ):
            return All(self.take().at)
        return self._operators(Level.OR_ELSE)

    def _skip_rows(self) -> None:
        while self.token.kind is Kind.ROW:
            self.position += 1

    def _rows(self, opening: str, closing: str) -> tuple[tuple[tuple[Expression, ...], ...], bool]:
        """The rows of a matrix or cell that are not empty, and whether only newlines separate them."""
        self._enter()
        outer, self.in_matrix = self.in_matrix, True
        self._expect(opening)
        rows: list[tuple[Expression, ...]] = []
        row: list[Expression] = []
        semicolons = False
        while not self.at_operator(closing):
            if self.at_operator(";") or self.token.kind is Kind.ROW:
                semicolons |= self.take().text == ";"
                if row:
                    rows.append(tuple(row))
                    row = []
                continue
            if self.at_operator(","):
                if not row or self.tokens[self.position - 1].text == ",":
                    raise self.unexpected("a value")
                self.position += 1
                continue
            row.append(self._operators(Level.OR_ELSE))
        if row:
            rows.append(tuple(row))
        self.position += 1
        self.in_matrix, self.depth = outer, self.depth - 1
        return tuple(rows), len(rows) > 1 and not semicolons


def _with_signs(signs: list[Token], operand: Expression) -> Expression:
    """The operand with a sequence of signs; two minus signs cancel."""
    negative, at = False, None
    for token in reversed(signs):
        if token.text == "~":
            operand = Prefix("-", operand, at) if negative and at else operand
            operand, negative = Prefix("~", operand, token.at), False
        elif token.text == "-":
            negative, at = not negative, token.at
    return Prefix("-", operand, at) if negative and at else operand
