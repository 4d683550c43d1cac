"""Formulas: expressions as values of parameters and as functions of signals."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from casadi import SX

from armblocks.errors import InputError
from armblocks.matlab.evaluation import Evaluator
from armblocks.matlab.functions import TABLE
from armblocks.matlab.operators import COMPARISONS
from armblocks.matlab.parser import parse_formula
from armblocks.matlab.source import Position, formula_source
from armblocks.matlab.symbols import OrientedVector, Symbol, Symbols
from armblocks.matlab.syntax import Chain, Expression, Name, Parentheses, Postfix, levels, parts_of

MAX_FORMULA_LENGTH = 4000
"""Maximum number of characters of a formula; longer ones should be diagrams."""

_BOUNDARY_OFFSETS: Mapping[str, float] = {">": -1e-300, "<=": -1e-300, ">=": 1e-300, "<": 1e-300}
"""Offsets, smaller than any signal resolution, that assign equality to one side of a comparison."""


class Formula:
    """A parsed formula with unresolved names.

    Raises ``InputError`` with the position and the allowed syntax where the text is not a formula.
    """

    def __init__(self, text: str, where: str, *, max_length: int = MAX_FORMULA_LENGTH) -> None:
        if len(text) > max_length:
            raise InputError(
                f"the formula has {len(text)} characters",
                where=where,
                allowed=f"at most {max_length}",
                fix="split it, or draw it as blocks",
            )
        self._source = formula_source(text, where)
        if not text.strip():
            raise self._source.location(Position(1, 0)).error(
                "the formula is empty", fix="write an expression"
            )
        self._tree = parse_formula(self._source)

    @property
    def names(self) -> frozenset[str]:
        """The names that need a value: all names that are not in the function table.

        A name such as ``length`` is a parameter where it is used alone and a function where it is called.
        """
        return frozenset(name for name, called in _names(self._tree) if _needs_value(name, called))

    @property
    def readable_names(self) -> frozenset[str]:
        """:attr:`names`, and the functions that a parameter of the same name would hide."""
        readable = (
            name for name, called in _names(self._tree) if _needs_value(name, called) or name in TABLE
        )
        return frozenset(name for name in readable if name not in TABLE or not TABLE[name].reserved)

    @property
    def unknown_functions(self) -> frozenset[str]:
        """The names that are called or indexed and are not in the function table."""
        return frozenset(name for name, called in _names(self._tree) if called and name not in TABLE)

    def trace(self, names: Mapping[str, SX]) -> SX:
        """The value of the formula for these names; vectors are columns, scalars are broadcast.

        Raises ``UnknownNameError`` for an unknown name or function, ``InputError`` for other errors.
        """
        return self._value(self._tree, names)

    def switching_functions(self, names: Mapping[str, SX]) -> list[SX]:
        """Functions with a zero where a comparison in the formula changes: left minus right side of each.

        At equality the offset gives the value of the comparison. For a formula without comparisons the result
        is its value.
        """
        differences: list[SX] = []
        for level in levels(self._tree):
            for part in level:
                if isinstance(part, Chain) and part.rest[0].operator in COMPARISONS:
                    left, right = (self._value(side, names) for side in parts_of(part))
                    differences.append(left - right + _BOUNDARY_OFFSETS.get(part.rest[0].operator, 0.0))
        return differences or [self.trace(names)]

    def _value(self, expression: Expression, names: Mapping[str, SX]) -> SX:
        variables: Mapping[str, Symbol] = dict(names)
        value = Evaluator(self._source, Symbols(names), variables).value(expression)
        if isinstance(value, str):
            raise self._source.location(expression.at).error(
                f"the text '{value[:40]}' is not a number", allowed="numbers and names without quotes"
            )
        return value.value if isinstance(value, OrientedVector) else value


def _names(tree: Expression) -> Iterator[tuple[str, bool]]:
    """All names in a tree, and for each whether it is called or indexed."""
    called: set[int] = set()
    for level in levels(tree):
        for part in level:
            if isinstance(part, Postfix) and isinstance(part.steps[0], Parentheses):
                called.add(id(part.base))
            elif isinstance(part, Name):
                yield part.name, id(part) in called


def _needs_value(name: str, called: bool) -> bool:
    function = TABLE.get(name)
    if function is None:
        return True
    return not called and function.min_arguments > 0 and not function.reserved
