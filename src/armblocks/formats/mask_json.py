"""Parameters that a diagram declares, as JSON::

{"name": "stiffness", "kind": "number", "default": 400, "unit": "N m/rad", "doc": "of the gear", "above": 0}
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from armblocks.diagram import REQUIRED, Parameter, ParameterKind, mask_parameter
from armblocks.formats.json_document import Node, closed_members

_TEXTS = ("doc", "unit")
_BOUNDS = ("minimum", "above", "maximum")
_OPTIONS = (*_TEXTS, *_BOUNDS, "choices", "dimensions")
_KEYS = ("name", "kind", "default", *_OPTIONS)
_DEFAULTS = Parameter(name="", kind=ParameterKind.NUMBER, doc="", default=0.0)
"""A parameter with only the required fields; the others have their defaults."""

WriteValue = Callable[[Parameter, object], object]
ReadValue = Callable[[Parameter, Node], object]


def mask_parameter_to_json(rule: Parameter, write: WriteValue) -> dict[str, object]:
    """A parameter as plain values, without fields that have their defaults."""
    options = {key: value for key in _OPTIONS if (value := getattr(rule, key)) != getattr(_DEFAULTS, key)}
    return {"name": rule.name, "kind": rule.kind.value, "default": write(rule, rule.default), **options}


def mask_parameter_from_json(node: Node, read: ReadValue) -> Parameter:
    """The parameter declared by an object. Raises ``FormatError`` and ``InputError``."""
    members = closed_members(node, _KEYS, required=("name", "kind", "default"))
    kind = ParameterKind(members["kind"].choice([kind.value for kind in ParameterKind]))
    rules: dict[str, Any] = {"kind": kind, "doc": ""}
    rules |= {key: members[key].text() for key in _TEXTS if key in members}
    rules |= {key: members[key].number() for key in _BOUNDS if key in members}
    if "choices" in members:
        rules["choices"] = tuple(entry.text() for entry in members["choices"].elements())
    if "dimensions" in members:
        rules["dimensions"] = tuple(int(entry.number()) for entry in members["dimensions"].elements())
    name = members["name"].text()
    return mask_parameter(
        name, read(Parameter(name=name, default=REQUIRED, **rules), members["default"]), **rules
    )
