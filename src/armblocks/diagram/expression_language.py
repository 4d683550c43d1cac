"""A small language of formulas, ``sin(u[1]) * k``: parsed, never evaluated by Python, and traced to symbols.

Python's own grammar reads the text (:mod:`armblocks.diagram.formula_spelling` respells it first); every node
of the tree must be one of those listed here, so that a formula can do nothing but arithmetic. ``^`` is a
power as in MATLAB: ``2^3^2`` is ``(2^3)^2``, ``-2^2`` is ``-(2^2)`` and ``2^-1^2`` is ``(2^-1)^2``. ``&&``,
``||`` and ``!`` are logic as in Simulink's Fcn block, but ``!`` binds as Python's ``not``: it takes the whole
comparison behind it. Elements are counted from 1: ``u[1]`` and ``u(1)`` are the first.

Arrays are written as in MATLAB, ``[1 2; 3 4]``, ``[0:0.5:2]``. A vector is neither row nor column: ``[1 2]``
and ``[1; 2]`` are the same, and ``[v; w]`` has the rows v and w. Two vectors are multiplied element by
element, as in the Fcn block (MATLAB would refuse two rows); with a matrix ``*`` is the matrix product, as in
MATLAB, and ``.*`` goes element by element.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping
from typing import cast

import numpy as np
from casadi import SX, evalf, horzcat, logic_and, logic_not, logic_or, mtimes, vertcat

from armblocks.diagram.formula_functions import CONSTANTS, FUNCTIONS, MAKERS, MATRIX_FUNCTIONS, range_of
from armblocks.diagram.formula_powers import powers_from_the_left
from armblocks.diagram.formula_spelling import CALLED_IF, CALLED_RANGE, python_spelling
from armblocks.equations import elementary
from armblocks.errors import InputError, UnknownNameError

LONGEST = 4000
"""Maximum number of characters of a formula; longer ones should be diagrams."""
DEEPEST = 60
"""Maximum nesting depth of brackets and operators."""


def _quotient(left: SX, right: SX) -> SX:
    """CasADi evaluates every constant divided by zero as plus infinity, also -1/0 and 0/0."""
    if not (left.is_constant() and right.is_constant()):
        return left / right
    with np.errstate(divide="ignore", invalid="ignore"):
        return SX(np.divide(evalf(left).full(), evalf(right).full()))


_OPERATORS: Mapping[type[ast.operator], Callable[[SX, SX], SX]] = {
    ast.Add: lambda left, right: left + right,
    ast.Sub: lambda left, right: left - right,
    ast.Mult: lambda left, right: left * right,
    ast.MatMult: lambda left, right: left * right,  # .*
    ast.Div: _quotient,
    ast.FloorDiv: _quotient,  # ./
    ast.Pow: lambda left, right: elementary("power", left, right),
}
_COMPARISONS: Mapping[type[ast.cmpop], Callable[[SX, SX], SX]] = {
    ast.Lt: lambda left, right: left < right,
    ast.LtE: lambda left, right: left <= right,
    ast.Gt: lambda left, right: right < left,
    ast.GtE: lambda left, right: right <= left,
    ast.Eq: lambda left, right: left == right,
    ast.NotEq: lambda left, right: left != right,
}
_SIDES: Mapping[type[ast.cmpop], float] = {
    ast.Gt: -1e-300,
    ast.LtE: -1e-300,
    ast.GtE: 1e-300,
    ast.Lt: 1e-300,
}
"""An offset below any signal resolution: it assigns the border itself to one side."""


class Formula:
    """A parsed formula with unresolved names.

    Raises ``InputError`` with the position and the allowed syntax where the text is not a formula.
    """

    def __init__(self, text: str, where: str, *, longest: int = LONGEST) -> None:
        self._where = where
        if len(text) > longest:
            raise self._error(f"the formula has {len(text)} characters", f"at most {longest}")
        for mark in ("@", "//"):
            if mark in text:
                raise self._error(f"'{_short(text)}' is not allowed in a formula", _ALLOWED)
        self._spelt = spelt = python_spelling(text, where)
        try:
            self._tree = powers_from_the_left(ast.parse(spelt, mode="eval").body, spelt)
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            reason = error.msg if isinstance(error, SyntaxError) else "it is nested too deeply"
            raise self._error(f"'{_short(text)}' is not a formula: {reason}", _ALLOWED) from None

    @property
    def names(self) -> frozenset[str]:
        """The free names: all names except constants and functions."""
        found = {node.id for node in ast.walk(self._tree) if isinstance(node, ast.Name)}
        return frozenset(
            found - {*CONSTANTS, *FUNCTIONS, *MATRIX_FUNCTIONS, *MAKERS, CALLED_IF, CALLED_RANGE}
        )

    def trace(self, names: Mapping[str, SX]) -> SX:
        """The value of the formula for these names; vectors are columns, scalars are broadcast.

        Raises ``UnknownNameError`` for an unknown name or function, ``InputError`` for other errors.
        """
        return self._value(self._tree, {**_constants(), **names}, 0)

    def borders(self, names: Mapping[str, SX]) -> list[SX]:
        """Quantities whose zeros are the changes of comparisons in the formula: left minus right of each.

        At equality the offset gives the value of the comparison. For a formula without comparisons the result
        is its value.
        """
        known = {**_constants(), **names}
        found: list[SX] = []
        for node in ast.walk(self._tree):
            if isinstance(node, ast.Compare):
                left, right = (self._value(part, known, 1) for part in (node.left, node.comparators[0]))
                found.append(left - right + _SIDES.get(type(node.ops[0]), 0.0))
        return found or [self.trace(names)]

    def _value(self, node: ast.expr, names: Mapping[str, SX], depth: int) -> SX:
        if depth > DEEPEST:
            raise self._error("the formula is nested too deeply", f"{DEEPEST} levels")
        if isinstance(node, ast.BinOp):
            return self._chain(node, names, depth)
        if isinstance(node, ast.Constant) and type(node.value) in (int, float):
            return SX(self._number(node))
        if isinstance(node, ast.Name):
            return self._look_up(node.id, names)
        if isinstance(node, ast.UnaryOp):
            value = self._value(node.operand, names, depth + 1)
            if isinstance(node.op, ast.USub):
                return -value
            if isinstance(node.op, ast.UAdd):
                return value
            if isinstance(node.op, ast.Not):
                return logic_not(value != 0.0)
        if isinstance(node, ast.BoolOp):
            gate = logic_and if isinstance(node.op, ast.And) else logic_or
            first, *others = (self._value(part, names, depth + 1) != 0.0 for part in node.values)
            for other in others:
                first = self._together(gate, first, other)
            return first
        if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in _COMPARISONS:
            left, right = (self._value(part, names, depth + 1) for part in (node.left, node.comparators[0]))
            return self._together(_COMPARISONS[type(node.ops[0])], left, right)
        if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name):
            return self._element(node.value.id, node.slice, names)
        if isinstance(node, ast.List) and all(isinstance(row, ast.List) for row in node.elts):
            return self._array(cast("list[ast.List]", node.elts), names, depth)
        if isinstance(node, ast.Attribute) and node.attr == "T":  # the spelling of '
            return _plain(self._value(node.value, names, depth + 1).T)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
            return self._call(node.func.id, node.args, names, depth)
        raise self._error(f"'{_short(ast.unparse(node))}' is not allowed in a formula", _ALLOWED)

    def _chain(self, node: ast.BinOp, names: Mapping[str, SX], depth: int) -> SX:
        """a + b + c + …: deep in the syntax tree but not nested in the text."""
        links: list[tuple[ast.operator, ast.expr]] = []
        first: ast.expr = node
        while isinstance(first, ast.BinOp):
            links.append((first.op, first.right))
            first = first.left
        value = self._value(first, names, depth + 1)
        for operator, right in reversed(links):
            kind = type(operator)
            if kind not in _OPERATORS:
                raise self._error(f"'{_short(ast.unparse(node))}' is not allowed in a formula", _ALLOWED)
            operand = self._value(right, names, depth + 1)
            if kind is ast.Mult and _is_matrix(value, operand):
                value = self._product(value, operand)
            elif kind is ast.Pow and _is_matrix(value, operand, spread=True):
                raise self._error("powers of matrices are not supported", "powers of numbers and vectors")
            elif kind is ast.Div and operand.numel() != 1 and _is_matrix(value, operand):
                raise self._error("the divisor is a matrix", "inv(A) * b, or ./ for elementwise division")
            else:
                value = self._together(_OPERATORS[kind], value, operand)
        return value

    def _product(self, left: SX, right: SX) -> SX:
        """The matrix product; a vector on the left is a row."""
        if left.shape[1] == 1:
            left = left.T
        if left.shape[1] != right.shape[0]:
            raise self._error(
                f"a matrix of {_size(left)} is multiplied by one of {_size(right)}",
                "as many columns on the left as rows on the right; .* multiplies elementwise",
            )
        return _plain(mtimes(left, right))

    def _array(self, rows: list[ast.List], names: Mapping[str, SX], depth: int) -> SX:
        """``[1 2; 3 4]``: every row concatenates its numbers and vectors."""
        values = [] if rows else [SX(0, 1)]
        for row in rows:
            entries = [self._value(entry, names, depth + 1) for entry in row.elts]
            if any(entry.shape[1] > 1 for entry in entries):
                raise self._error("a matrix is inside brackets", "numbers and vectors inside brackets")
            values.append(vertcat(*entries))
        if len(values) == 1 or all(value.numel() == 1 for value in values):
            return vertcat(*values)
        if len({value.numel() for value in values}) > 1:
            lengths = ", ".join(str(value.numel()) for value in values)
            raise self._error(f"the rows of an array have {lengths} numbers", "rows of one length")
        return _plain(horzcat(*values).T)

    def _call(self, name: str, arguments: list[ast.expr], names: Mapping[str, SX], depth: int) -> SX:
        name = "if" if name == CALLED_IF else name
        if name in names and len(arguments) == 1:
            return self._element(name, arguments[0], names)
        if name in MATRIX_FUNCTIONS and len(arguments) == 1:
            argument = self._value(arguments[0], names, depth + 1)
            try:
                return _plain(MATRIX_FUNCTIONS[name](argument))
            except ValueError as error:
                raise self._error(str(error), f"a different argument of {name}") from None
        if name in MAKERS or name == CALLED_RANGE:
            return self._made(name, [self._value(part, names, depth + 1) for part in arguments])
        if name not in FUNCTIONS:
            known = (*FUNCTIONS, *MATRIX_FUNCTIONS, *MAKERS)
            raise UnknownNameError("function", name, known, where=self._where)
        count, function = FUNCTIONS[name]
        if len(arguments) != count:
            raise self._error(f"{name} has {len(arguments)} arguments", f"{count}")
        return self._together(function, *(self._value(part, names, depth + 1) for part in arguments))

    def _made(self, name: str, arguments: list[SX]) -> SX:
        """An array whose size is given by constant arguments."""
        if not all(argument.numel() == 1 and argument.is_constant() for argument in arguments):
            raise self._error(
                f"the size of an array made by {_called(name)} is not constant", "constant numbers"
            )
        numbers = [float(argument) for argument in arguments]
        try:
            array = range_of(*numbers) if name == CALLED_RANGE else MAKERS[name](*numbers)
        except (TypeError, ValueError) as error:
            what = str(error) if isinstance(error, ValueError) else f"{len(numbers)} numbers are given"
            raise self._error(f"{_called(name)}: {what}", "eye(n), zeros(m, n), linspace(a, b, n)") from None
        return _plain(SX(array))

    def _element(self, name: str, index: ast.expr, names: Mapping[str, SX]) -> SX:
        value = self._look_up(name, names)
        if not (isinstance(index, ast.Constant) and type(index.value) is int):
            raise self._error(
                f"'{name}[{_short(ast.unparse(index))}]' has no constant index", f"{name}[1] and so on"
            )
        if value.shape[1] > 1:
            raise self._error(f"'{name}[{index.value}]' is an element of a matrix", "elements of vectors")
        if not 1 <= index.value <= value.numel():
            raise self._error(
                f"'{name}[{index.value}]' does not exist",
                f"{name}[1] to {name}[{value.numel()}], as '{name}' has {value.numel()} elements",
            )
        return value[index.value - 1]

    def _look_up(self, name: str, names: Mapping[str, SX]) -> SX:
        if name not in names:
            if name in FUNCTIONS or name in MATRIX_FUNCTIONS or name in MAKERS:
                raise self._error(f"the function '{name}' has no arguments", f"{name}(…)")
            raise UnknownNameError("name", name, names, where=self._where)
        return names[name]

    def _together(self, function: Callable[..., SX], *values: SX) -> SX:
        shapes = {value.shape for value in values if value.numel() != 1}
        sizes = {value.numel() for value in values} - {1}
        if len(shapes) > 1 and any(columns > 1 for _, columns in shapes):
            raise self._error(
                f"arrays of {' and '.join(sorted(f'{m} x {n}' for m, n in shapes))} numbers are combined",
                "arrays of equal size, and scalars with any array",
            )
        if len(shapes) > 1:
            raise self._error(
                f"vectors of {' and '.join(map(str, sorted(sizes)))} elements are combined",
                "vectors of equal length, and scalars with any vector",
            )
        return function(*values)

    def _number(self, node: ast.Constant) -> float:
        try:
            number = float(node.value)  # pyright: ignore[reportArgumentType]
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            typed = ast.get_source_segment(self._spelt, node) or "inf"
            raise self._error(f"'{_short(typed)}' is too large a number", "numbers up to 1.8e308")
        return number

    def _error(self, what: str, allowed: str) -> InputError:
        return InputError(what, where=self._where, allowed=allowed, fix="correct the formula")


def _constants() -> dict[str, SX]:
    return {key: SX(value) for key, value in CONSTANTS.items()}


def _plain(value: SX) -> SX:
    """Vectors as columns, whatever their origin."""
    return value.T if value.shape[0] == 1 and value.shape[1] > 1 else value


def _is_matrix(left: SX, right: SX, *, spread: bool = False) -> bool:
    """Whether a matrix is an operand together with another array or, with ``spread``, with any operand."""
    beside = spread or not (left.numel() == 1 or right.numel() == 1)
    return beside and (left.shape[1] > 1 or right.shape[1] > 1)


def _size(value: SX) -> str:
    return f"{value.shape[0]} x {value.shape[1]}"


def _called(name: str) -> str:
    return "a range" if name == CALLED_RANGE else name


def _short(text: str) -> str:
    return text if len(text) <= 40 else text[:37] + "..."


_ALLOWED = (
    "numbers, names, u[1], [1 2; 3 4], + - * / ^, comparisons, && || ! and functions such as sin, sqrt, max"
)
