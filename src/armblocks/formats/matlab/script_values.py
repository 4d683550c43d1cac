"""Values of the expressions of scripts: numbers, strings, and the toolbox's links and robots."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence

from armblocks.formats.matlab.link_constructors import CONSTRUCTORS
from armblocks.formats.matlab.link_fields import link_field
from armblocks.formats.matlab.records import LinkRecord, RobotRecord
from armblocks.formats.matlab.robot_records import make_robot, make_serial_link, robot_field
from armblocks.formats.matlab.values import MAX_LINKS, Cell, LinkArray, Value, copy_of_value, join_links
from armblocks.matlab.arrays import Budget, index_of, kind_of, number_of, scalar
from armblocks.matlab.functions import TABLE
from armblocks.matlab.numbers import Numbers
from armblocks.matlab.source import Location
from armblocks.matlab.syntax import Expression, Name


class ScriptValues:
    """Implements :class:`armblocks.matlab.evaluation.Values` for the values of scripts."""

    def __init__(self, budget: Budget, variables: Mapping[str, Value]) -> None:
        self._numbers = Numbers(budget)
        self._variables = variables

    def number(self, value: float) -> Value:
        """A number."""
        return scalar(value)

    def text(self, location: Location, value: str) -> Value:
        """A string in quotes."""
        return value

    def negative(self, location: Location, value: Value) -> Value:
        """The negative ``-value``."""
        return self._numbers.negative(location, value)

    def logical_not(self, location: Location, value: Value) -> Value:
        """The logical negation ``~value``."""
        return self._numbers.logical_not(location, value)

    def operate(self, location: Location, operator: str, left: Value, right: Value) -> Value:
        """``left operator right`` of arithmetic or a comparison."""
        return self._numbers.operate(location, operator, left, right)

    def logic(self, location: Location, operator: str, values: Sequence[Value]) -> Value:
        """All values joined by one of ``&& || & |``."""
        return self._numbers.logic(location, operator, values)

    def matrix(self, location: Location, rows: Sequence[Sequence[Value]]) -> Value:
        """``[a b; c d]`` of matrices, of strings in one row, or of links."""
        flat = [value for row in rows for value in row]
        if any(isinstance(value, LinkRecord | LinkArray) for value in flat):
            return join_links(location, flat)
        return self._numbers.matrix(location, rows)

    def cell(self, location: Location, elements: Sequence[Value]) -> Value:
        """The cell array ``{a, b}``."""
        if len(elements) > MAX_LINKS:
            raise location.error(
                f"{len(elements)} elements in one cell array", allowed=f"at most {MAX_LINKS}"
            )
        if any(isinstance(element, Cell) for element in elements):
            raise location.error(
                "a cell array inside a cell array is not supported", allowed="links, numbers, text"
            )
        return Cell([copy_of_value(element) for element in elements])

    def range(self, location: Location, parts: Sequence[Value]) -> Value:
        """The range ``first:last`` or ``first:step:last``."""
        return self._numbers.range(location, parts)

    def transposed(self, location: Location, value: Value) -> Value:
        """The transpose ``value'``."""
        return value if isinstance(value, LinkArray) else self._numbers.transposed(location, value)

    def index(self, location: Location, value: Value, expression: Expression) -> Value:
        """The value of an index: positions, or a logical array that selects elements."""
        return value

    def element(self, location: Location, value: Value, indices: Sequence[Value | None], label: str) -> Value:
        """``value(indices)`` of a matrix or of an array of links."""
        if isinstance(value, LinkRecord):
            value = LinkArray([value])
        if isinstance(value, LinkArray):
            index = single_index(location, indices, MAX_LINKS)
            link = value.links[index] if index < len(value.links) else None
            if link is None:
                raise location.error(
                    f"link {index + 1} of the array is not set", allowed="links that are set"
                )
            return link
        return self._numbers.element(location, value, indices, label)

    def last_index(self, location: Location, value: Value, position: int, count: int) -> Value:
        """``end`` as index ``position`` of ``count`` indices."""
        if isinstance(value, Cell | LinkArray):
            return scalar(float(_length(value)))
        return self._numbers.last_index(location, value, position, count)

    def cell_element(self, location: Location, value: Value, indices: Sequence[Value | None]) -> Value:
        """The element ``value{indices}`` of a cell array."""
        if not isinstance(value, Cell):
            raise location.error(f"{{}} is used on {kind_of(value)}", allowed="cell arrays")
        index = single_index(location, indices, MAX_LINKS)
        element = value.elements[index] if index < len(value.elements) else None
        if element is None:
            raise location.error(
                f"element {index + 1} of the cell array is not set", allowed="elements that are set"
            )
        return element

    def field(self, location: Location, value: Value, name: str) -> Value:
        """The field ``value.name`` of a link or robot."""
        if isinstance(value, LinkRecord):
            return link_field(location, value, name)
        if isinstance(value, RobotRecord):
            return robot_field(location, value, name)
        return self._numbers.field(location, value, name)

    def check_function(self, location: Location, name: str, called: bool) -> None:
        """Raise ``FormatError`` unless there is a constructor or a function of this name."""
        callable_names = ["robot", "SerialLink", *CONSTRUCTORS, *TABLE]
        if name in callable_names:
            return
        matches = difflib.get_close_matches(name, [*self._variables, *callable_names], n=1, cutoff=0.6)
        raise location.error(
            f"'{name[:60]}' is neither a variable nor a supported function",
            allowed=f"straight-line robot scripts, with {', '.join(callable_names)}",
            fix=f"did you mean '{matches[0]}'?" if matches else "define it, or remove the line",
        )

    def call(
        self, location: Location, name: str, arguments: Sequence[Value], expressions: Sequence[Expression]
    ) -> Value:
        """``name(arguments)`` of a constructor of the toolbox, or of a function in the table."""
        if name == "robot":
            first = expressions[0] if expressions else None
            variable = first.name if isinstance(first, Name) else ""
            return make_robot(location, list(arguments), variable)
        if name == "SerialLink":
            return make_serial_link(location, list(arguments))
        if name in CONSTRUCTORS:
            return CONSTRUCTORS[name](location, list(arguments))
        if name in ("length", "numel") and len(arguments) == 1:
            value = arguments[0]
            if isinstance(value, Cell | LinkArray | str):
                return scalar(float(_length(value)))
        return self._numbers.call(location, name, arguments, expressions)


def single_index(location: Location, indices: Sequence[Value | None], maximum: int) -> int:
    """The index into a row of links or values, from 0, given by one index or as ``L{1, 3}``."""
    if len(indices) == 2 and indices[0] is not None and number_of(location, indices[0], "an index") == 1:
        indices = indices[1:]
    if len(indices) != 1 or indices[0] is None:
        raise location.error(f"{len(indices)} indices are given", allowed="one index")
    return index_of(location, indices[0], maximum)


def _length(value: Cell | LinkArray | str) -> int:
    match value:
        case Cell(elements=elements):
            return len(elements)
        case LinkArray(links=links):
            return len(links)
        case _:
            return len(value)
