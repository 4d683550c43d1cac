"""Values of parameters as JSON: numbers, arrays and strings; references to robots, functions and tables.

Infinite numbers are the strings ``"inf"`` and ``"-inf"``.
"""

from __future__ import annotations

import math
from typing import cast

from armblocks.diagram import Parameter, ParameterKind, TimeTable, UserFunction
from armblocks.formats.json_document import Node
from armblocks.formats.located_errors import located
from armblocks.formats.robot_references import RobotReader, RobotWriter
from armblocks.robot import Robot

_INFINITIES = {"inf": math.inf, "-inf": -math.inf}
_NUMERIC = (ParameterKind.NUMBER, ParameterKind.ARRAY)


def parameter_from_json(rule: Parameter, node: Node, robots: RobotReader) -> object:
    """The checked value of one parameter; errors contain its line."""
    if rule.kind is ParameterKind.ROBOT:
        return robots.robot(node)
    if rule.kind is ParameterKind.FUNCTION:
        return robots.function(node) if node.value else rule.default
    if rule.kind is ParameterKind.TABLE and isinstance(node.value, str | dict):
        return robots.table(node)
    with located(node):
        return rule.check(with_infinities(rule, node.value), "")


def parameter_to_json(rule: Parameter, value: object, robots: RobotWriter) -> object:
    """The value of one parameter as a plain value. Raises ``FormatError`` if a file cannot represent it."""
    if isinstance(value, Robot):
        return robots.reference(value)
    if isinstance(value, UserFunction):
        return "" if value == rule.check(rule.default, "") else robots.function_reference(value)
    if isinstance(value, TimeTable):
        return robots.table_reference(value)
    return _infinities_as_text(value) if rule.kind in _NUMERIC else value


def plain_value(node: Node) -> object:
    """A number, boolean, text or nested array of them, of a parameter without a rule."""
    if isinstance(node.value, list):
        return tuple(plain_value(element) for element in node.elements())
    if not isinstance(node.value, bool | int | float | str):
        raise node.error("the value is not a number or an array", allowed="numbers, arrays and strings")
    return node.value


def with_infinities(rule: Parameter, value: object) -> object:
    """The value with infinities in place of ``"inf"`` and ``"-inf"``, for numbers and arrays."""
    return _with_infinities(value) if rule.kind in _NUMERIC else value


def plain_parameter(value: object) -> object:
    """The JSON form of a number, an array or a string."""
    return _infinities_as_text(value)


def is_diagram(rule: Parameter) -> bool:
    """Whether the value of a parameter is the inner diagram of a subsystem."""
    return rule.kind is ParameterKind.DIAGRAM


def _with_infinities(value: object) -> object:
    if isinstance(value, list | tuple):
        return [_with_infinities(entry) for entry in cast("list[object]", value)]
    return _INFINITIES.get(value, value) if isinstance(value, str) else value


def _infinities_as_text(value: object) -> object:
    if isinstance(value, tuple):
        return [_infinities_as_text(entry) for entry in cast("tuple[object, ...]", value)]
    if isinstance(value, float) and math.isinf(value):
        return "inf" if value > 0 else "-inf"
    return value
