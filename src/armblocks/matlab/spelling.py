"""Writes trees as text, with the brackets that the precedences require; parsing gives the same tree."""

from __future__ import annotations

from collections.abc import Sequence

from armblocks.matlab.operators import INFIX, Level
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
    Parentheses,
    Postfix,
    Prefix,
    Range,
    Step,
    Text,
    Transpose,
)


def spelling(expression: Expression) -> str:
    """The text of an expression."""
    match expression:
        case Number(value=value):
            return repr(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
        case Text(value=value):
            return "'" + value.replace("'", "''") + "'"
        case Name(name=name):
            return name
        case End():
            return "end"
        case All():
            return ":"
        case Matrix(rows=rows):
            return "[" + "; ".join(_row(row) for row in rows) + "]"
        case CellLiteral(elements=elements):
            return "{" + _row(elements) + "}"
        case Prefix(operator=operator, operand=operand):
            return operator + _bracketed(operand, Level.POWER)
        case Chain(first=first, rest=rest):
            level = INFIX[rest[0].operator]
            text_parts = [_bracketed(first, Level(level + 1))]
            for operation in rest:
                operand = _operand_of_power if level is Level.POWER else _bracketed
                blank = "" if level >= Level.PRODUCT else " "
                text_parts += [blank, operation.operator, blank, operand(operation.operand, Level(level + 1))]
            return "".join(text_parts)
        case Range(parts=parts):
            return ":".join(_bracketed(part, Level.SUM) for part in parts)
        case Postfix(base=base, steps=steps):
            operand_text = _bracketed(base, Level.OPERAND)
            is_unambiguous = not (isinstance(base, Number) and isinstance(steps[0], Field))  # not 5.T
            return (operand_text if is_unambiguous else f"({operand_text})") + "".join(map(_step, steps))


def _row(elements: Sequence[Expression]) -> str:
    return ", ".join(map(spelling, elements))


def _step(step: Step) -> str:
    match step:
        case Parentheses(arguments=arguments):
            return f"({_row(arguments)})"
        case Braces(arguments=arguments):
            return "{" + _row(arguments) + "}"
        case Field(name=name):
            return f".{name}"
        case _:
            return "'"


def _level(expression: Expression) -> Level:
    match expression:
        case Chain(rest=rest):
            return INFIX[rest[0].operator]
        case Prefix():
            return Level.SIGN
        case Range():
            return Level.RANGE
        case _:
            return Level.OPERAND


def _bracketed(expression: Expression, min_level: Level) -> str:
    text = spelling(expression)
    return text if _level(expression) >= min_level else f"({text})"


def _operand_of_power(expression: Expression, min_level: Level) -> str:
    """An exponent: its signs need no brackets, ``2^-1``, unless a power follows them, ``2^(-1^2)``.

    A transpose in an exponent needs brackets, because ``A^b'`` is ``(A^b)'``.
    """
    if isinstance(expression, Prefix):
        return expression.operator + _operand_of_power(expression.operand, Level.OPERAND)
    if isinstance(expression, Postfix) and any(isinstance(step, Transpose) for step in expression.steps):
        return f"({spelling(expression)})"
    return _bracketed(expression, min_level)
