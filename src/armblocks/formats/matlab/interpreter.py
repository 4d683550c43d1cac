"""Interprets the statements of a script on plain values. No Python code is executed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from armblocks.formats.matlab.link_fields import VECTORS, link_field, set_link_field
from armblocks.formats.matlab.records import LinkRecord, RobotRecord
from armblocks.formats.matlab.robot_records import robot_field, set_robot_field
from armblocks.formats.matlab.script_values import ScriptValues, single_index
from armblocks.formats.matlab.values import MAX_LINKS, Cell, LinkArray, Value, copy_of_value
from armblocks.matlab.arrays import Budget, empty, kind_of, number_of, with_element
from armblocks.matlab.evaluation import Evaluator
from armblocks.matlab.lexer import COMMANDS
from armblocks.matlab.source import Location, Source
from armblocks.matlab.syntax import (
    Assignment,
    Braces,
    Command,
    Evaluation,
    Expression,
    Field,
    Matrix,
    Name,
    Parentheses,
    Postfix,
    Statement,
    Target,
)

PRINT_FUNCTIONS = ("disp",)
"""Functions that only print: their arguments are evaluated, but nothing is printed."""


class Interpreter:
    """The variables of one run of one script.

    ``joined_lines``: the numbers of the lines whose vector continues on the next line (see ``_joined_rows``).
    """

    def __init__(self, source: Source) -> None:
        self.source = source
        self.variables: dict[str, Value] = {}
        self.budget = Budget()
        self.joined_lines: list[int] = []
        self._evaluator: Evaluator[Value] = Evaluator(
            source, ScriptValues(self.budget, self.variables), self.variables
        )

    def run(self, statements: tuple[Statement, ...]) -> None:
        """Execute all statements in order. Raises ``FormatError`` at the first invalid statement."""
        for statement in statements:
            self.budget.spend(self.source.location(statement.at), 10)
            match statement:
                case Assignment():
                    self._assign(statement)
                case Evaluation(value=value):
                    if (text := self._evaluation(value)) is not None:
                        self.variables["ans"] = text
                case Command(words=words):
                    self._command(self.source.location(statement.at), words)

    # -- statements ----------------------------------------------------------------------------------------

    def _evaluation(self, value: Expression) -> Value | None:
        """The value of an expression statement; ``None`` for a command that is written as a call."""
        match value:
            case Postfix(base=Name(name=name), steps=(Parentheses(arguments=arguments),), at=at) if (
                name not in self.variables and name in (*COMMANDS, *PRINT_FUNCTIONS)
            ):
                location = self.source.location(at)
                values = [self._evaluator.value(argument) for argument in arguments]
                if name in COMMANDS:
                    words = [word if isinstance(word, str) else kind_of(word) for word in values]
                    self._command(location, (name, *words))
                return None
            case Name(name=name) if name in self.variables:
                return None  # showing a variable does not set ans
            case _:
                return copy_of_value(self._evaluator.value(value))

    def _command(self, location: Location, words: tuple[str, ...]) -> None:
        if words[0] not in ("clear", "clearvars"):
            return  # clc, close, format, more: without effect here
        names = words[1:]
        if not names or names in (("all",), ("variables",), ("-all",), ("classes",)):
            self.variables.clear()
            return
        for name in names:
            if not name.isidentifier():
                raise location.error(f"'{name}' cannot be cleared", allowed="clear, clear all, clear NAME …")
            self.variables.pop(name, None)

    def _assign(self, statement: Assignment) -> None:
        location = self.source.location(statement.at)
        last = statement.steps[-1] if statement.steps else None
        if isinstance(last, Field) and last.name in VECTORS and isinstance(statement.value, Matrix):
            value = self._evaluator.value(self._joined_rows(statement.value))
        else:
            value = self._evaluator.value(statement.value)
        copy = copy_of_value(value)
        old = self.variables.get(statement.name)
        if not statement.steps:
            self.variables[statement.name] = copy
            return
        if old is None and isinstance(statement.steps[0], Field):
            raise location.error(
                f"'{statement.name}' is not defined, so it has no fields",
                allowed="fields of links and robots",
                fix=f"define {statement.name} first, with link, Link, robot or SerialLink",
            )
        self.variables[statement.name] = self._stored(location, old, statement.steps, copy)

    def _joined_rows(self, matrix: Matrix) -> Matrix:
        """The matrix; a vector that a printed page splits into two lines becomes one row.

        MATLAB reads ``[ .13`` and ``.524 .539]`` on the next line as two rows and rejects them, because their
        lengths differ. In an assignment to a vector field they can only be one row. Three lines are not
        joined: they may be a triangle of a symmetric matrix.
        """
        if not matrix.line_breaks or len(matrix.rows) != 2 or len(matrix.rows[0]) == len(matrix.rows[1]):
            return matrix
        self.joined_lines.append(matrix.at.line)
        return replace(matrix, rows=((*matrix.rows[0], *matrix.rows[1]),))

    def _stored(self, location: Location, old: Value | None, steps: tuple[Target, ...], new: Value) -> Value:
        """``old`` with ``new`` at the element or field that ``steps`` select: ``L{2}.r(1) = …``."""
        if not steps:
            return new
        step, rest = steps[0], steps[1:]
        location = self.source.location(step.at)
        match step:
            case Field(name=name):
                return self._stored_field(location, old, name, rest, new)
            case Braces(arguments=arguments):
                return self._stored_cell(location, old, self._indices(old, arguments), rest, new)
            case Parentheses(arguments=arguments):
                return self._stored_element(location, old, self._indices(old, arguments), rest, new)

    def _stored_field(
        self, location: Location, old: Value | None, name: str, rest: tuple[Target, ...], new: Value
    ) -> Value:
        match old:
            case LinkRecord():
                set_link_field(
                    location,
                    old,
                    name,
                    self._stored(location, link_field(location, old, name), rest, new) if rest else new,
                )
            case RobotRecord():
                set_robot_field(
                    location,
                    old,
                    name,
                    self._stored(location, robot_field(location, old, name), rest, new) if rest else new,
                )
            case _:
                raise location.error(
                    f"{kind_of(old)} has no field '{name}'", allowed="fields of links and robots"
                )
        return old

    def _stored_cell(
        self,
        location: Location,
        old: Value | None,
        indices: list[Value],
        rest: tuple[Target, ...],
        new: Value,
    ) -> Value:
        if old is None or (isinstance(old, np.ndarray) and old.size == 0):
            old = Cell()
        if not isinstance(old, Cell):
            raise location.error(f"{{}} is used on {kind_of(old)}", allowed="cell arrays")
        index = single_index(location, indices, MAX_LINKS)
        inner = old.elements[index] if index < len(old.elements) else None
        stored = self._stored(location, inner, rest, new)
        if isinstance(stored, Cell):
            raise location.error(
                "a cell array inside a cell array is not supported", allowed="links, numbers, text"
            )
        old.elements += [None] * (index + 1 - len(old.elements))
        old.elements[index] = stored
        return old

    def _stored_element(
        self,
        location: Location,
        old: Value | None,
        indices: list[Value],
        rest: tuple[Target, ...],
        new: Value,
    ) -> Value:
        if isinstance(old, LinkRecord):
            old = LinkArray([old])
        if old is None or (isinstance(old, np.ndarray) and old.size == 0 and isinstance(new, LinkRecord)):
            old = LinkArray() if isinstance(new, LinkRecord) or rest else empty()
        if isinstance(old, LinkArray):
            index = single_index(location, indices, MAX_LINKS)
            inner = old.links[index] if index < len(old.links) else None
            stored = self._stored(location, inner, rest, new)
            if not isinstance(stored, LinkRecord):
                raise location.error(
                    f"{kind_of(stored)} is assigned to an element of an array of links", allowed="links"
                )
            old.links += [None] * (index + 1 - len(old.links))
            old.links[index] = stored
            return old
        if isinstance(old, np.ndarray) and not rest:
            self.budget.spend(location, old.size)
            return with_element(
                location, old, indices, number_of(location, new, "the value assigned to an element")
            )
        raise location.error(f"() is used on {kind_of(old)}", allowed="matrices and arrays of links")

    def _indices(self, value: Value | None, arguments: tuple[Expression, ...]) -> list[Value]:
        """The indices on the left of ``=``; ``end`` is the last element of the present value."""
        checked: list[Value] = []
        indices = self._evaluator.indices(empty() if value is None else value, arguments)
        for index, argument in zip(indices, arguments):
            if index is None:
                raise self.source.location(argument.at).error(
                    "assignment to several elements at once is not supported", allowed="A(i, j) = number"
                )
            checked.append(index)
        return checked
