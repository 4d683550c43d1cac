"""Converts tokens to the statements of a script."""

from __future__ import annotations

import re

from armblocks.matlab.lexer import Kind
from armblocks.matlab.parser import KEYWORDS, Parser
from armblocks.matlab.source import Source
from armblocks.matlab.syntax import (
    Assignment,
    Command,
    Evaluation,
    Matrix,
    Name,
    Postfix,
    Statement,
    Target,
    Transpose,
)

_ALLOWED_TARGETS = "name, name{i}, name.field …"


def parse_script(source: Source) -> tuple[Statement, ...]:
    """All statements of a script. Raises ``FormatError`` at the first invalid or unsupported line."""
    parser = Parser(source)
    statements: list[Statement] = []
    while parser.token.kind is not Kind.EOF:
        if parser.token.kind is Kind.END:
            parser.take()
            continue
        statements.append(_statement(parser))
        parser.expect_end()
    return tuple(statements)


def _statement(parser: Parser) -> Statement:
    token = parser.token
    location = parser.source.location(token.at)
    if token.kind is Kind.COMMAND:
        parser.take()
        words = tuple(token.text.split())
        if not all(re.fullmatch(r"-?[A-Za-z]\w*", word) for word in words):
            raise location.error(f"the command '{token.text[:40]}' is not supported", allowed="clear NAME …")
        return Command(words, token.at)
    if token.kind is Kind.NAME and token.text in KEYWORDS:
        raise location.error(f"'{token.text}' is not supported")
    value = parser.expression()
    if not parser.at_operator("="):
        return Evaluation(value, token.at)
    parser.take()
    targets: list[Target] = []
    match value:
        case Name(name=name):
            pass
        case Postfix(base=Name(name=name), steps=steps):
            targets = [step for step in steps if not isinstance(step, Transpose)]
            if len(targets) < len(steps):
                raise location.error("a transpose cannot be assigned to", allowed=_ALLOWED_TARGETS)
        case Matrix():
            raise location.error("assignment to several variables at once is not supported")
        case _:
            raise location.error("the left side of '=' is not a variable", allowed=_ALLOWED_TARGETS)
    result = Assignment(name, tuple(targets), parser.expression(), token.at)
    if parser.at_operator("="):
        raise location.error("two '=' in one statement", allowed="one assignment a statement")
    return result
