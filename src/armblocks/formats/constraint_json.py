"""Constraints and springs of robots as JSON: an object with ``type``, ``name`` and the fields of the type.

The type is the class name in lower case with underscores: ``revolute_closure``, ``rod``, ``line_spring``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields
from typing import TypeVar, cast

from armblocks.errors import RobotError
from armblocks.formats.json_document import Node, closed_members
from armblocks.robot.constraints import CONSTRAINT_TYPES, Attachment, Constraint
from armblocks.robot.springs import SPRING_TYPES, Spring
from armblocks.spatial import Transform


def _file_name(kind: type) -> str:
    return re.sub(r"(?<!^)(?=[A-Z])", "_", kind.__name__).lower()


CONSTRAINT_NAMES = {_file_name(kind): kind for kind in CONSTRAINT_TYPES}
"""The types of constraints by their names in files."""
SPRING_NAMES = {_file_name(kind): kind for kind in SPRING_TYPES}
"""The types of springs by their names in files."""


def constraint_from_json(node: Node, transform_from_json: Callable[[Node], Transform]) -> Constraint:
    """The constraint that a JSON object describes."""
    return _part_from_json(node, transform_from_json, CONSTRAINT_NAMES, "constraint")


def spring_from_json(node: Node, transform_from_json: Callable[[Node], Transform]) -> Spring:
    """The spring that a JSON object describes."""
    return _part_from_json(node, transform_from_json, SPRING_NAMES, "spring")


_Part = TypeVar("_Part", bound=Constraint | Spring)


def _part_from_json(
    node: Node,
    transform_from_json: Callable[[Node], Transform],
    kinds: Mapping[str, type[_Part]],
    subject: str,
) -> _Part:
    known = sorted({field.name for kind in kinds.values() for field in fields(kind)})
    kind = kinds[closed_members(node, ("type", *known), ("type",))["type"].choice(kinds)]
    names = [field.name for field in fields(kind)]
    members = closed_members(node, ("type", *names), ("type", "name"))
    values: dict[str, object] = {}
    for field in fields(kind):
        if field.name not in members:
            continue
        member = members[field.name]
        match field.type:
            case "str":
                values[field.name] = member.text()
            case "Attachment":
                values[field.name] = _attachment_from_json(member, transform_from_json)
            case "float":
                values[field.name] = member.number()
            case _:
                values[field.name] = tuple(_term_from_json(entry) for entry in member.elements())
    missing = [field.name for field in fields(kind) if field.default is MISSING and field.name not in values]
    if missing:
        raise node.error(
            f"the {subject} has no {missing[0]}", allowed=", ".join(names), fix=f"add '{missing[0]}'"
        )
    try:
        return kind(**values)  # pyright: ignore[reportArgumentType] - by the fields of the type
    except RobotError as error:
        raise node.error(error.what, allowed=error.allowed, fix=error.fix) from error


def part_to_json(
    part: Constraint | Spring, transform_to_json: Callable[[Transform], dict[str, object]]
) -> dict[str, object]:
    """The JSON object that describes a constraint or a spring."""
    entry: dict[str, object] = {"type": _file_name(type(part))}
    for field in fields(part):
        value = getattr(part, field.name)
        if isinstance(value, Attachment):
            frame: dict[str, object] = {"link": value.link}
            if not value.pose.is_identity:
                frame["pose"] = transform_to_json(value.pose)
            entry[field.name] = frame
        elif isinstance(value, tuple):
            terms = cast("tuple[tuple[str, float], ...]", value)
            entry[field.name] = [{"joint": joint, "coefficient": factor} for joint, factor in terms]
        elif value != field.default:
            entry[field.name] = value
    return entry


def _term_from_json(node: Node) -> tuple[str, float]:
    members = closed_members(node, ("joint", "coefficient"), ("joint", "coefficient"))
    return members["joint"].text(), members["coefficient"].number()


def _attachment_from_json(node: Node, transform_from_json: Callable[[Node], Transform]) -> Attachment:
    members = closed_members(node, ("link", "pose"), ("link",))
    link = None if members["link"].value is None else members["link"].text()
    return Attachment(
        link=link, pose=transform_from_json(members["pose"]) if "pose" in members else Transform()
    )
