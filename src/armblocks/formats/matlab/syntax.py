"""The syntax tree of a script.

Chains of operators and of postfixes are flat tuples, not nested pairs: however long a line is, walking over
it takes no deeper recursion than its brackets.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Number:
    """``1.8e-3``"""

    value: float
    line: int


@dataclass(frozen=True, slots=True)
class Text:
    """``'standard'``"""

    value: str
    line: int


@dataclass(frozen=True, slots=True)
class Name:
    """A variable, or a function without arguments."""

    name: str
    line: int


@dataclass(frozen=True, slots=True)
class Matrix:
    """``[a b; c d]``; ``broken`` where rows are parted by newlines alone, with no ``;``."""

    rows: tuple[tuple[Expression, ...], ...]
    broken: bool
    line: int


@dataclass(frozen=True, slots=True)
class CellLiteral:
    """``{a, b, c}``"""

    elements: tuple[Expression, ...]
    line: int


@dataclass(frozen=True, slots=True)
class Negative:
    """``-operand``; a row of signs is folded to one."""

    operand: Expression
    line: int


@dataclass(frozen=True, slots=True)
class Chain:
    """``first (operator operand)…``, all of one precedence, evaluated from the left."""

    first: Expression
    rest: tuple[tuple[str, Expression], ...]
    line: int


@dataclass(frozen=True, slots=True)
class Range:
    """``start:stop`` or ``start:step:stop``"""

    parts: tuple[Expression, ...]
    line: int


@dataclass(frozen=True, slots=True)
class Parentheses:
    """``(arguments)``: an index or a call."""

    arguments: tuple[Expression, ...]
    line: int


@dataclass(frozen=True, slots=True)
class Braces:
    """``{index}``: an element of a cell array."""

    arguments: tuple[Expression, ...]
    line: int


@dataclass(frozen=True, slots=True)
class Field:
    """``.name``"""

    name: str
    line: int


@dataclass(frozen=True, slots=True)
class Transpose:
    """``'`` or ``.'``"""

    line: int


Target = Parentheses | Braces | Field
"""What may follow a name left of ``=``."""
Step = Target | Transpose


@dataclass(frozen=True, slots=True)
class Postfix:
    """An operand and what follows it: ``L{2}.r(1)'``."""

    base: Expression
    steps: tuple[Step, ...]
    line: int


Expression = Number | Text | Name | Matrix | CellLiteral | Negative | Chain | Range | Postfix


@dataclass(frozen=True, slots=True)
class Assignment:
    """``name steps = value``"""

    name: str
    steps: tuple[Target, ...]
    value: Expression
    line: int


@dataclass(frozen=True, slots=True)
class Evaluation:
    """An expression alone: MATLAB shows it and keeps it as ``ans``."""

    value: Expression
    line: int


@dataclass(frozen=True, slots=True)
class Command:
    """``clear L``"""

    words: tuple[str, ...]
    line: int


Statement = Assignment | Evaluation | Command
