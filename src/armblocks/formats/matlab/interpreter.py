"""Interprets the statements of a script on plain values. No Python code is executed."""

from __future__ import annotations

import difflib
import math

import numpy as np

from armblocks.formats.matlab.functions import FUNCTIONS, call_function
from armblocks.formats.matlab.lexer import COMMANDS
from armblocks.formats.matlab.link_constructors import CONSTRUCTORS
from armblocks.formats.matlab.link_fields import VECTORS, link_field, set_link_field
from armblocks.formats.matlab.records import LinkRecord, RobotRecord
from armblocks.formats.matlab.robot_records import make_robot, make_serial_link, robot_field, set_robot_field
from armblocks.formats.matlab.source import Place, Source
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
from armblocks.formats.matlab.values import (
    MOST_ELEMENTS,
    MOST_LINKS,
    Array,
    Budget,
    Cell,
    LinkArray,
    Value,
    array_of,
    concatenate,
    copied,
    empty,
    index_of,
    kind_of,
    number_of,
    operate,
    part_of,
    scalar,
    with_element,
)

QUIET = ("disp",)
"""Functions that only print: their arguments are computed and nothing is shown."""


class Interpreter:
    """The variables of one run of one script.

    ``joined_lines`` collects the lines on which a vector went on after a line break (see ``_joined``).
    """

    def __init__(self, source: Source) -> None:
        self.source = source
        self.variables: dict[str, Value] = {}
        self.budget = Budget()
        self.joined_lines: list[int] = []

    def run(self, statements: tuple[Statement, ...]) -> None:
        """Execute all statements in order. Raises ``FormatError`` at the first that cannot be."""
        for statement in statements:
            self.budget.spend(self.source.place(statement.line), 10)
            match statement:
                case Assignment():
                    self._assign(statement)
                case Evaluation(value=value):
                    if (shown := self._evaluation(value)) is not None:
                        self.variables["ans"] = shown
                case Command(words=words):
                    self._command(self.source.place(statement.line), words)

    # -- statements ----------------------------------------------------------------------------------------

    def _evaluation(self, value: Expression) -> Value | None:
        """An expression alone; ``None`` where it is a command in the form of a call."""
        match value:
            case Postfix(base=Name(name=name), steps=(Parentheses(arguments=arguments),), line=line) if (
                name not in self.variables and name in (*COMMANDS, *QUIET)
            ):
                place = self.source.place(line)
                given = [self._value(argument) for argument in arguments]
                if name in COMMANDS:
                    words = [word if isinstance(word, str) else kind_of(word) for word in given]
                    self._command(place, (name, *words))
                return None
            case Name(name=name) if name in self.variables:
                return None  # showing a variable does not set ans
            case _:
                return copied(self._value(value))

    def _command(self, place: Place, words: tuple[str, ...]) -> None:
        if words[0] not in ("clear", "clearvars"):
            return  # clc, close, format, more: nothing to see here
        names = words[1:]
        if not names or names in (("all",), ("variables",), ("-all",), ("classes",)):
            self.variables.clear()
            return
        for name in names:
            if not name.isidentifier():
                raise place.error(f"'{name}' cannot be cleared", allowed="clear, clear all, clear NAME …")
            self.variables.pop(name, None)

    def _assign(self, statement: Assignment) -> None:
        place = self.source.place(statement.line)
        last = statement.steps[-1] if statement.steps else None
        if isinstance(last, Field) and last.name in VECTORS and isinstance(statement.value, Matrix):
            value = self._matrix(statement.value, joined=self._joined(statement.value))
        else:
            value = self._value(statement.value)
        kept = copied(value)
        old = self.variables.get(statement.name)
        if not statement.steps:
            self.variables[statement.name] = kept
            return
        if old is None and isinstance(statement.steps[0], Field):
            raise place.error(
                f"'{statement.name}' is not defined, so it has no fields",
                allowed="fields of links and robots",
                fix=f"define {statement.name} first, with link, Link, robot or SerialLink",
            )
        self.variables[statement.name] = self._stored(place, old, statement.steps, kept)

    def _joined(self, matrix: Matrix) -> bool:
        """Whether a vector was broken over two lines on a printed page.

        ``[ .13`` and ``.524 .539]`` on the next line are two rows to MATLAB, which refuses them as their
        lengths differ; where a field takes a vector, nothing else than one row can be meant. Three lines
        are left alone: they may be a triangle of a symmetric matrix.
        """
        broken = matrix.broken and len(matrix.rows) == 2 and len(matrix.rows[0]) != len(matrix.rows[1])
        if broken:
            self.joined_lines.append(matrix.line)
        return broken

    def _stored(self, place: Place, old: Value | None, steps: tuple[Target, ...], new: Value) -> Value:
        """``old`` with ``new`` put where ``steps`` lead: ``L{2}.r(1) = …``."""
        if not steps:
            return new
        step, rest = steps[0], steps[1:]
        place = self.source.place(step.line)
        match step:
            case Field(name=name):
                return self._stored_field(place, old, name, rest, new)
            case Braces(arguments=arguments):
                return self._stored_cell(place, old, [self._value(a) for a in arguments], rest, new)
            case Parentheses(arguments=arguments):
                return self._stored_element(place, old, [self._value(a) for a in arguments], rest, new)

    def _stored_field(
        self, place: Place, old: Value | None, name: str, rest: tuple[Target, ...], new: Value
    ) -> Value:
        match old:
            case LinkRecord():
                set_link_field(
                    place,
                    old,
                    name,
                    self._stored(place, link_field(place, old, name), rest, new) if rest else new,
                )
            case RobotRecord():
                set_robot_field(
                    place,
                    old,
                    name,
                    self._stored(place, robot_field(place, old, name), rest, new) if rest else new,
                )
            case _:
                raise place.error(
                    f"{kind_of(old)} has no field '{name}'", allowed="fields of links and robots"
                )
        return old

    def _stored_cell(
        self, place: Place, old: Value | None, indices: list[Value], rest: tuple[Target, ...], new: Value
    ) -> Value:
        if old is None or (isinstance(old, np.ndarray) and old.size == 0):
            old = Cell()
        if not isinstance(old, Cell):
            raise place.error(f"{{}} is used on {kind_of(old)}", allowed="cell arrays")
        index = self._single_index(place, indices, MOST_LINKS)
        inner = old.elements[index] if index < len(old.elements) else None
        stored = self._stored(place, inner, rest, new)
        if isinstance(stored, Cell):
            raise place.error(
                "a cell array inside a cell array is not supported", allowed="links, numbers, text"
            )
        old.elements += [None] * (index + 1 - len(old.elements))
        old.elements[index] = stored
        return old

    def _stored_element(
        self, place: Place, old: Value | None, indices: list[Value], rest: tuple[Target, ...], new: Value
    ) -> Value:
        if isinstance(old, LinkRecord):
            old = LinkArray([old])
        if old is None or (isinstance(old, np.ndarray) and old.size == 0 and isinstance(new, LinkRecord)):
            old = LinkArray() if isinstance(new, LinkRecord) or rest else empty()
        if isinstance(old, LinkArray):
            index = self._single_index(place, indices, MOST_LINKS)
            inner = old.links[index] if index < len(old.links) else None
            stored = self._stored(place, inner, rest, new)
            if not isinstance(stored, LinkRecord):
                raise place.error(f"{kind_of(stored)} is put among links", allowed="links")
            old.links += [None] * (index + 1 - len(old.links))
            old.links[index] = stored
            return old
        if isinstance(old, np.ndarray) and not rest:
            self.budget.spend(place, old.size)
            return with_element(place, old, indices, number_of(place, new, "what is assigned to an element"))
        raise place.error(f"() is used on {kind_of(old)}", allowed="matrices and arrays of links")

    def _single_index(self, place: Place, indices: list[Value], most: int) -> int:
        if len(indices) == 2 and number_of(place, indices[0], "an index") == 1:
            indices = indices[1:]  # L{1, 3} of a row
        if len(indices) != 1:
            raise place.error(f"{len(indices)} indices are given", allowed="one index")
        return index_of(place, indices[0], most)

    # -- expressions ---------------------------------------------------------------------------------------

    def _value(self, expression: Expression) -> Value:
        match expression:
            case Number(value=value):
                return scalar(value)
            case Text(value=value):
                return value
            case Name():
                return self._name(expression)
            case Matrix():
                return self._matrix(expression)
            case CellLiteral(elements=elements, line=line):
                return self._cell(self.source.place(line), elements)
            case Negative(operand=operand, line=line):
                place = self.source.place(line)
                array = array_of(place, self._value(operand), "what stands behind '-'")
                self.budget.spend(place, array.size)
                return 0.0 - array if array.size == 1 and array[0, 0] == 0 else -array
            case Chain(first=first, rest=rest, line=line):
                value = self._value(first)
                for operator, operand in rest:
                    value = operate(
                        self.source.place(line), self.budget, operator, value, self._value(operand)
                    )
                return value
            case Range(parts=parts, line=line):
                return self._range(self.source.place(line), [self._value(part) for part in parts])
            case Postfix():
                return self._postfix(expression)

    def _name(self, name: Name) -> Value:
        if name.name in self.variables:
            return self.variables[name.name]
        return self._call(self.source.place(name.line), name.name, (), [])

    def _matrix(self, matrix: Matrix, *, joined: bool = False) -> Value:
        rows = matrix.rows
        if joined:
            rows = (tuple(element for row in rows for element in row),)
        values = [[self._value(element) for element in row] for row in rows]
        return concatenate(self.source.place(matrix.line), self.budget, values)

    def _cell(self, place: Place, elements: tuple[Expression, ...]) -> Cell:
        if len(elements) > MOST_LINKS:
            raise place.error(f"{len(elements)} elements in one cell array", allowed=f"at most {MOST_LINKS}")
        values: list[Value | None] = []
        for element in elements:
            value = copied(self._value(element))
            if isinstance(value, Cell):
                raise place.error(
                    "a cell array inside a cell array is not supported", allowed="links, numbers, text"
                )
            values.append(value)
        return Cell(values)

    def _range(self, place: Place, parts: list[Value]) -> Array:
        ends = [number_of(place, part, "an end of a range") for part in parts]
        first, step, last = (ends[0], 1.0, ends[1]) if len(ends) == 2 else ends
        if step == 0 or not all(math.isfinite(end) for end in (first, step, last)):
            raise place.error("a range without end or step", allowed="first:last or first:step:last")
        # A hair more than the quotient, as MATLAB does, so that 0:0.1:1 reaches 1.
        count = (
            math.floor((last - first) / step * (1 + 4e-16) + 1e-10) + 1 if (last - first) / step >= 0 else 0
        )
        if count > MOST_ELEMENTS:
            raise place.error(f"a range of {count} elements", allowed=f"at most {MOST_ELEMENTS}")
        self.budget.spend(place, count)
        return np.array([[first + step * i for i in range(count)]]).reshape(1, -1)

    def _postfix(self, expression: Postfix) -> Value:
        base, steps = expression.base, expression.steps
        if isinstance(base, Name) and base.name not in self.variables:
            place = self.source.place(base.line)
            if isinstance(steps[0], Parentheses):
                arguments = steps[0].arguments
                value = self._call(place, base.name, arguments, [self._value(a) for a in arguments])
                steps = steps[1:]
            else:
                value = self._call(place, base.name, (), [])
        else:
            value = self._value(base)
        for step in steps:
            value = self._step(value, step)
        return value

    def _step(self, value: Value, step: Step) -> Value:
        place = self.source.place(step.line)
        match step:
            case Transpose():
                if isinstance(value, LinkArray):
                    return value
                array = array_of(place, value, "what is transposed")
                self.budget.spend(place, array.size)
                return array.T.copy()
            case Field(name=name):
                if isinstance(value, LinkRecord):
                    return link_field(place, value, name)
                if isinstance(value, RobotRecord):
                    return robot_field(place, value, name)
                raise place.error(
                    f"{kind_of(value)} has no field '{name}'", allowed="fields of links and robots"
                )
            case Braces(arguments=arguments):
                return self._cell_element(place, value, [self._value(a) for a in arguments])
            case Parentheses(arguments=arguments):
                return self._element(place, value, [self._value(a) for a in arguments])

    def _cell_element(self, place: Place, value: Value, indices: list[Value]) -> Value:
        if not isinstance(value, Cell):
            raise place.error(f"{{}} is used on {kind_of(value)}", allowed="cell arrays")
        index = self._single_index(place, indices, MOST_LINKS)
        element = value.elements[index] if index < len(value.elements) else None
        if element is None:
            raise place.error(
                f"element {index + 1} of the cell array is not set", allowed="elements that are set"
            )
        return element

    def _element(self, place: Place, value: Value, indices: list[Value]) -> Value:
        if isinstance(value, LinkRecord):
            value = LinkArray([value])
        if isinstance(value, LinkArray):
            index = self._single_index(place, indices, MOST_LINKS)
            link = value.links[index] if index < len(value.links) else None
            if link is None:
                raise place.error(f"link {index + 1} of the array is not set", allowed="links that are set")
            return link
        if isinstance(value, np.ndarray):
            self.budget.spend(place, value.size)
            return part_of(place, value, indices)
        raise place.error(f"() is used on {kind_of(value)}", allowed="matrices and arrays of links")

    def _call(
        self, place: Place, name: str, written: tuple[Expression, ...], arguments: list[Value]
    ) -> Value:
        if name == "robot":
            variable = written[0].name if written and isinstance(written[0], Name) else ""
            return make_robot(place, arguments, variable)
        if name == "SerialLink":
            return make_serial_link(place, arguments)
        if name in CONSTRUCTORS:
            return CONSTRUCTORS[name](place, arguments)
        if name in FUNCTIONS:
            return call_function(place, self.budget, name, arguments)
        callable_names = ["robot", "SerialLink", *CONSTRUCTORS, *FUNCTIONS]
        near = difflib.get_close_matches(name, [*self.variables, *callable_names], n=1, cutoff=0.6)
        raise place.error(
            f"'{name}' is neither a variable nor a supported function",
            allowed=f"straight-line robot scripts, with {', '.join(callable_names)}",
            fix=f"did you mean '{near[0]}'?" if near else "define it, or remove the line",
        )
