"""A small language of formulas, ``sin(u[1]) * k``: parsed, never evaluated by Python, and traced to symbols.

Python's own grammar reads the text; every node of the tree must be one of those listed here, so that a
formula can do nothing but arithmetic. ``^`` is a power, ``&&``, ``||`` and ``!`` are logic as in Simulink's
Fcn block, but ``!`` binds as Python's ``not``: it takes the whole comparison behind it. Elements are counted
from 1: ``u[1]`` and ``u(1)`` are the first.
"""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Callable, Mapping

import casadi
from casadi import SX, if_else, logic_and, logic_not, logic_or

from armblocks.errors import InputError, UnknownNameError

LONGEST = 4000
"""Characters of a formula; long ones are diagrams."""
DEEPEST = 60
"""Levels of brackets and operators within each other."""


def _power(base: SX, exponent: SX) -> SX:
    return base**exponent


def _where(condition: SX, yes: SX, no: SX) -> SX:
    return if_else(condition != 0.0, yes, no)


CONSTANTS: Mapping[str, float] = {"pi": math.pi, "e": math.e}

FUNCTIONS: Mapping[str, tuple[int, Callable[..., SX]]] = {
    **{
        name: (1, getattr(casadi, name))
        for name in (
            *("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh"),
            *("exp", "expm1", "log", "log10", "log1p", "sqrt", "floor", "ceil", "sign", "erf"),
        )
    },
    "abs": (1, casadi.fabs),
    "ln": (1, casadi.log),
    "atan2": (2, casadi.atan2),
    "hypot": (2, casadi.hypot),
    "min": (2, casadi.fmin),
    "max": (2, casadi.fmax),
    "power": (2, _power),
    "pow": (2, _power),
    "rem": (2, casadi.fmod),
    "if": (3, _where),
}
"""Functions by name: how many arguments they take, and what they give; of vectors, element by element."""

_OPERATORS: Mapping[type[ast.operator], Callable[[SX, SX], SX]] = {
    ast.Add: lambda left, right: left + right,
    ast.Sub: lambda left, right: left - right,
    ast.Mult: lambda left, right: left * right,
    ast.Div: lambda left, right: left / right,
    ast.Pow: lambda left, right: left**right,
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
"""Beside a border by less than any signal can tell: it gives the border itself a side."""
_SPELLINGS = ((r"\^", "**"), (r"&&", " and "), (r"\|\|", " or "), (r"~=", "!="), (r"!(?!=)|~", " not "))
_CALLED_IF = "if_"  # a word that Python keeps for itself


class Formula:
    """A parsed formula; the names in it are not known yet.

    Raises ``InputError`` where the text is no formula, saying the place and what is allowed.
    """

    def __init__(self, text: str, where: str) -> None:
        self._where = where
        spelt = re.sub(r"\bif\s*\(", f"{_CALLED_IF}(", text.strip())
        for pattern, python in _SPELLINGS:
            spelt = re.sub(pattern, python, spelt)
        if len(text) > LONGEST:
            raise self._error(f"the formula has {len(text)} characters", f"at most {LONGEST}")
        try:
            self._tree = ast.parse(spelt.strip(), mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            reason = error.msg if isinstance(error, SyntaxError) else "it is nested too deeply"
            raise self._error(f"'{_short(text)}' is no formula: {reason}", _ALLOWED) from None

    def trace(self, names: Mapping[str, SX]) -> SX:
        """The formula's value where its names have these; vectors are columns, and scalars spread.

        Raises ``UnknownNameError`` for a name or function that does not exist, ``InputError`` for the rest.
        """
        return self._value(self._tree, {**{key: SX(value) for key, value in CONSTANTS.items()}, **names}, 0)

    def borders(self, names: Mapping[str, SX]) -> list[SX]:
        """Quantities at whose zeros a comparison in the formula changes: left less right of each.

        Equality has the side on which the comparison is as it says. Of a formula that compares nothing, its
        own value.
        """
        known = {**{key: SX(value) for key, value in CONSTANTS.items()}, **names}
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
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
            return self._call(node.func.id, node.args, names, depth)
        raise self._error(f"'{_short(ast.unparse(node))}' has no meaning in a formula", _ALLOWED)

    def _chain(self, node: ast.BinOp, names: Mapping[str, SX], depth: int) -> SX:
        """a + b + c + …: deep in the tree, but not for a reader."""
        links: list[tuple[ast.operator, ast.expr]] = []
        first: ast.expr = node
        while isinstance(first, ast.BinOp):
            links.append((first.op, first.right))
            first = first.left
        value = self._value(first, names, depth + 1)
        for operator, right in reversed(links):
            if type(operator) not in _OPERATORS:
                raise self._error(f"'{_short(ast.unparse(node))}' has no meaning in a formula", _ALLOWED)
            operand = self._value(right, names, depth + 1)
            value = self._together(_OPERATORS[type(operator)], value, operand)
        return value

    def _call(self, name: str, arguments: list[ast.expr], names: Mapping[str, SX], depth: int) -> SX:
        name = "if" if name == _CALLED_IF else name
        if name in names and len(arguments) == 1:
            return self._element(name, arguments[0], names)
        if name not in FUNCTIONS:
            raise UnknownNameError("function", name, FUNCTIONS, where=self._where)
        count, function = FUNCTIONS[name]
        if len(arguments) != count:
            raise self._error(f"{name} has {len(arguments)} arguments", f"{count}")
        return self._together(function, *(self._value(part, names, depth + 1) for part in arguments))

    def _element(self, name: str, index: ast.expr, names: Mapping[str, SX]) -> SX:
        value = self._look_up(name, names)
        if not (isinstance(index, ast.Constant) and type(index.value) is int):
            raise self._error(
                f"'{name}[{_short(ast.unparse(index))}]' has no fixed index", f"{name}[1] and so on"
            )
        if not 1 <= index.value <= value.numel():
            raise self._error(
                f"'{name}[{index.value}]' does not exist",
                f"{name}[1] to {name}[{value.numel()}], as '{name}' has {value.numel()} elements",
            )
        return value[index.value - 1]

    def _look_up(self, name: str, names: Mapping[str, SX]) -> SX:
        if name not in names:
            if name in FUNCTIONS:
                raise self._error(f"the function '{name}' has no arguments", f"{name}(…)")
            raise UnknownNameError("name", name, names, where=self._where)
        return names[name]

    def _together(self, function: Callable[..., SX], *values: SX) -> SX:
        sizes = {value.numel() for value in values} - {1}
        if len(sizes) > 1:
            raise self._error(
                f"vectors of {' and '.join(map(str, sorted(sizes)))} elements meet",
                "vectors of one length, and scalars with anything",
            )
        return function(*values)

    def _number(self, node: ast.Constant) -> float:
        try:
            number = float(node.value)  # pyright: ignore[reportArgumentType]
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise self._error(f"'{_short(ast.unparse(node))}' is too large a number", "numbers up to 1.8e308")
        return number

    def _error(self, what: str, allowed: str) -> InputError:
        return InputError(what, where=self._where, allowed=allowed, fix="correct the formula")


def _short(text: str) -> str:
    return text if len(text) <= 40 else text[:37] + "..."


_ALLOWED = "numbers, names, u[1], + - * / ^, comparisons, && || !, and the functions " + ", ".join(
    sorted(FUNCTIONS)
)
