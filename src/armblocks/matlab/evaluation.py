"""The evaluation of a syntax tree with the arithmetic of one kind of values: numbers, symbols, robots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Generic, Protocol, TypeVar

from armblocks.matlab.operators import LOGIC
from armblocks.matlab.source import Location, Source
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

V = TypeVar("V")


class Values(Protocol[V]):
    """The operations on one kind of values. Each raises an error at ``location`` for values that do not
    fit."""

    def number(self, value: float) -> V:
        """A number."""
        ...

    def text(self, location: Location, value: str) -> V:
        """A string in quotes."""
        ...

    def negative(self, location: Location, value: V) -> V:
        """The negative ``-value``."""
        ...

    def logical_not(self, location: Location, value: V) -> V:
        """The logical negation ``~value``: 1 where the value is 0, else 0."""
        ...

    def operate(self, location: Location, operator: str, left: V, right: V) -> V:
        """``left operator right`` of arithmetic or a comparison."""
        ...

    def logic(self, location: Location, operator: str, values: Sequence[V]) -> V:
        """All values joined by one of ``&& || & |``."""
        ...

    def matrix(self, location: Location, rows: Sequence[Sequence[V]]) -> V:
        """The matrix ``[a b; c d]``."""
        ...

    def cell(self, location: Location, elements: Sequence[V]) -> V:
        """The cell array ``{a, b}``."""
        ...

    def range(self, location: Location, parts: Sequence[V]) -> V:
        """The range ``first:last`` or ``first:step:last``."""
        ...

    def transposed(self, location: Location, value: V) -> V:
        """The transpose ``value'``."""
        ...

    def index(self, location: Location, value: V, expression: Expression) -> V:
        """The value of an index; ``expression`` is its syntax tree."""
        ...

    def element(self, location: Location, value: V, indices: Sequence[V | None], label: str) -> V:
        """``value(indices)``, where ``None`` is ``:``; ``label`` is its name in messages, or empty."""
        ...

    def last_index(self, location: Location, value: V, position: int, count: int) -> V:
        """``end`` as index ``position`` of ``count`` indices."""
        ...

    def cell_element(self, location: Location, value: V, indices: Sequence[V | None]) -> V:
        """The element ``value{indices}`` of a cell array."""
        ...

    def field(self, location: Location, value: V, name: str) -> V:
        """The field ``value.name``."""
        ...

    def check_function(self, location: Location, name: str, called: bool) -> None:
        """Raise an error unless there is a function of this name; ``called``: whether it has arguments."""
        ...

    def call(
        self, location: Location, name: str, arguments: Sequence[V], expressions: Sequence[Expression]
    ) -> V:
        """``name(arguments)`` of a function; ``expressions`` are the syntax trees of the arguments."""
        ...


class Evaluator(Generic[V]):
    """The values of expressions. Variables hide functions of the same name, as in MATLAB."""

    def __init__(self, source: Source, values: Values[V], variables: Mapping[str, V]) -> None:
        self._source = source
        self._values = values
        self._variables = variables
        self._indexed: list[tuple[V, int, int]] = []
        """The values whose indices are being evaluated, with the position and the count of the indices."""

    def value(self, expression: Expression) -> V:
        """The value of an expression."""
        values, location = self._values, self._source.location(expression.at)
        match expression:
            case Number(value=number):
                return values.number(number)
            case Text(value=text):
                return values.text(location, text)
            case Name(name=name):
                return self._name(location, name)
            case Chain():
                return self._chain(expression)
            case Prefix(operator=operator, operand=operand):
                apply = values.negative if operator == "-" else values.logical_not
                return apply(location, self.value(operand))
            case Postfix():
                return self._postfix(expression)
            case Matrix(rows=rows):
                return values.matrix(location, [[self.value(element) for element in row] for row in rows])
            case Range(parts=parts):
                return values.range(location, [self.value(part) for part in parts])
            case CellLiteral(elements=elements):
                return values.cell(location, [self.value(element) for element in elements])
            case End() if self._indexed:
                return values.last_index(location, *self._indexed[-1])
            case End() | All():
                raise location.error("'end' and ':' are used outside of an index", allowed="v(end), A(:, 1)")

    def indices(self, value: V, arguments: Sequence[Expression]) -> list[V | None]:
        """The indices of ``value``: ``end`` is its last element, ``None`` means ``:``."""
        values: list[V | None] = []
        for position, argument in enumerate(arguments):
            self._indexed.append((value, position, len(arguments)))
            values.append(None if isinstance(argument, All) else self._index(argument))
            self._indexed.pop()
        return values

    def _index(self, argument: Expression) -> V:
        return self._values.index(self._source.location(argument.at), self.value(argument), argument)

    def _name(self, location: Location, name: str) -> V:
        value = self._variables.get(name)
        if value is not None:
            return value
        self._values.check_function(location, name, called=False)
        return self._values.call(location, name, (), ())

    def _chain(self, chain: Chain) -> V:
        values = self._values
        if chain.rest[0].operator in LOGIC:
            operands = [chain.first, *(operation.operand for operation in chain.rest)]
            location = self._source.location(chain.rest[0].at)
            return values.logic(
                location, chain.rest[0].operator, [self.value(operand) for operand in operands]
            )
        value = self.value(chain.first)
        for operation in chain.rest:
            operand = self.value(operation.operand)
            value = values.operate(self._source.location(operation.at), operation.operator, value, operand)
        return value

    def _postfix(self, expression: Postfix) -> V:
        base, steps = expression.base, expression.steps
        location = self._source.location(base.at)
        label = base.name if isinstance(base, Name) else ""
        if isinstance(base, Name) and base.name not in self._variables:
            arguments: tuple[Expression, ...] = ()
            if isinstance(steps[0], Parentheses):
                arguments, steps = steps[0].arguments, steps[1:]
            self._values.check_function(location, base.name, bool(arguments))
            values = [self.value(argument) for argument in arguments]
            value = self._values.call(location, base.name, values, arguments)
            label = ""
        else:
            value = self.value(base)
        for step in steps:
            value = self._step(value, step, label)
        return value

    def _step(self, value: V, step: Step, label: str) -> V:
        location = self._source.location(step.at)
        match step:
            case Transpose():
                return self._values.transposed(location, value)
            case Field(name=name):
                return self._values.field(location, value, name)
            case Braces(arguments=arguments):
                return self._values.cell_element(location, value, self.indices(value, arguments))
            case Parentheses(arguments=arguments):
                return self._values.element(location, value, self.indices(value, arguments), label)
