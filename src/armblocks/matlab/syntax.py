"""The syntax tree of expressions and statements; every node has the position of its first character.

Chains of operators and of postfixes are flat tuples, not nested pairs: the recursion depth depends on the
nesting of brackets, not on the length of the line.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from armblocks.matlab.operators import COMPARISONS, LOGIC
from armblocks.matlab.source import Position


@dataclass(frozen=True, slots=True)
class Number:
    """A number: ``1.8e-3``."""

    value: float
    at: Position


@dataclass(frozen=True, slots=True)
class Text:
    """A string in quotes: ``'standard'``."""

    value: str
    at: Position


@dataclass(frozen=True, slots=True)
class Name:
    """A variable, or a function without arguments."""

    name: str
    at: Position


@dataclass(frozen=True, slots=True)
class End:
    """``end`` inside an index: the last element."""

    at: Position


@dataclass(frozen=True, slots=True)
class All:
    """``:`` as an index: all elements."""

    at: Position


@dataclass(frozen=True, slots=True)
class Matrix:
    """A matrix: ``[a b; c d]``; ``line_breaks``: only newlines separate rows, without ``;``."""

    rows: tuple[tuple[Expression, ...], ...]
    line_breaks: bool
    at: Position


@dataclass(frozen=True, slots=True)
class CellLiteral:
    """A cell array: ``{a, b, c}``."""

    elements: tuple[Expression, ...]
    at: Position


@dataclass(frozen=True, slots=True)
class Prefix:
    """A signed operand: ``-operand`` or ``~operand``; a sequence of signs is reduced to one."""

    operator: str
    operand: Expression
    at: Position


@dataclass(frozen=True, slots=True)
class Operation:
    """An operator and the operand right of it."""

    operator: str
    operand: Expression
    at: Position
    """The position of the operator."""


@dataclass(frozen=True, slots=True)
class Chain:
    """Operations of one precedence, evaluated from the left: ``first (operator operand)…``."""

    first: Expression
    rest: tuple[Operation, ...]
    at: Position


@dataclass(frozen=True, slots=True)
class Range:
    """A range: ``start:stop`` or ``start:step:stop``."""

    parts: tuple[Expression, ...]
    at: Position


@dataclass(frozen=True, slots=True)
class Parentheses:
    """``(arguments)``: an index or a call."""

    arguments: tuple[Expression, ...]
    at: Position


@dataclass(frozen=True, slots=True)
class Braces:
    """``{index}``: an element of a cell array."""

    arguments: tuple[Expression, ...]
    at: Position


@dataclass(frozen=True, slots=True)
class Field:
    """A field: ``.name``."""

    name: str
    at: Position


@dataclass(frozen=True, slots=True)
class Transpose:
    """A transpose: ``'`` or ``.'``."""

    at: Position


Target = Parentheses | Braces | Field
"""An index or field after a name on the left of ``=``."""
Step = Target | Transpose


@dataclass(frozen=True, slots=True)
class Postfix:
    """An operand with its indices and fields: ``L{2}.r(1)'``."""

    base: Expression
    steps: tuple[Step, ...]
    at: Position


Expression = Number | Text | Name | End | All | Matrix | CellLiteral | Prefix | Chain | Range | Postfix


@dataclass(frozen=True, slots=True)
class Assignment:
    """An assignment: ``name steps = value``."""

    name: str
    steps: tuple[Target, ...]
    value: Expression
    at: Position


@dataclass(frozen=True, slots=True)
class Evaluation:
    """An expression statement, whose value MATLAB stores in ``ans``."""

    value: Expression
    at: Position


@dataclass(frozen=True, slots=True)
class Command:
    """A command: ``clear L``."""

    words: tuple[str, ...]
    at: Position


Statement = Assignment | Evaluation | Command


def parts_of(expression: Expression) -> tuple[Expression, ...]:
    """The direct parts of an expression, in the order of the text."""
    match expression:
        case Matrix(rows=rows):
            return tuple(element for row in rows for element in row)
        case CellLiteral(elements=elements):
            return elements
        case Prefix(operand=operand):
            return (operand,)
        case Chain(first=first, rest=rest):
            return (first, *(operation.operand for operation in rest))
        case Range(parts=parts):
            return parts
        case Postfix(base=base, steps=steps):
            step_arguments = (step.arguments for step in steps if isinstance(step, Parentheses | Braces))
            return (base, *(argument for arguments in step_arguments for argument in arguments))
        case _:
            return ()


LOGICAL_FUNCTIONS = frozenset(("true", "false", "and", "or", "xor", "not", "any", "all"))


def is_logical(expression: Expression) -> bool:
    """Whether an expression is a comparison, a logical operation, or an array that contains one."""
    match expression:
        case Chain(rest=rest):
            return rest[0].operator in LOGIC or rest[0].operator in COMPARISONS
        case Prefix(operator=operator):
            return operator == "~"
        case Name(name=name) | Postfix(base=Name(name=name)):
            return name in LOGICAL_FUNCTIONS
        case Matrix():
            return any(is_logical(element) for element in parts_of(expression))
        case _:
            return False


def levels(expression: Expression) -> Iterator[tuple[Expression, ...]]:
    """The expressions of a tree level by level, from the root."""
    level: tuple[Expression, ...] = (expression,)
    while level:
        yield level
        level = tuple(part for parent in level for part in parts_of(parent))
