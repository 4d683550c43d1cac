"""Robots as canonical JSON, ``robot.json``: every field of a ``Robot``, in SI units.

Angles may be strings such as ``"90 deg"``, and angular speeds such as ``"105 deg/s"``. The writer uses
degrees where they have few digits and read back exactly. A link with a ``dh`` row takes its joint and
transforms from it. Unknown keys are errors that suggest the nearest known key, because ignoring a misspelt
key would give a wrong robot. ``notes`` is a comment; :mod:`armblocks.formats.robot_facts` reads ``facts``.
Neither is preserved. ``configurations`` is a list of objects with ``name`` and ``q``, because keys are
sorted; older files name it ``poses``.

The JSON Schema is ``formats/schema/robot.schema.json``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import cast

from armblocks.errors import FormatError, RobotError, UnknownNameError
from armblocks.formats.canonical_json import canonical_bytes
from armblocks.formats.constraint_json import constraint_from_json, part_to_json, spring_from_json
from armblocks.formats.json_document import KeyPath, Node, closed_members, read_document
from armblocks.formats.link_json import link_from_json, link_to_json
from armblocks.formats.robot_facts import MAX_BYTES, facts_from_json
from armblocks.formats.spatial_json import (
    angle_from_json,
    angle_to_json,
    transform_from_json,
    transform_to_json,
    vector_from_json,
)
from armblocks.robot import Configuration, FrictionModel, NamedFrame, Robot
from armblocks.robot.robot import STANDARD_GRAVITY
from armblocks.spatial import Transform

FORMAT_VERSION = 1

_ROBOT_KEYS = (
    "format",
    "name",
    "manufacturer",
    "comment",
    "notes",
    "facts",
    "base",
    "tool",
    "gravity",
    "friction_model",
    "links",
    "constraints",
    "frames",
    "springs",
    "configurations",
    "poses",
)


def read_robot(data: bytes, name: str) -> Robot:
    """The robot of a JSON document. Raises ``FormatError`` with file, line and path."""
    return robot_from_json(read_document(data, name, MAX_BYTES))


def robot_from_json(node: Node) -> Robot:
    """The robot that a JSON object describes."""
    members = closed_members(node, _ROBOT_KEYS, required=("format", "name", "links"))
    if members["format"].value != FORMAT_VERSION or isinstance(members["format"].value, bool):
        raise members["format"].error(
            f"the format version is {members['format'].value!r}",
            allowed=str(FORMAT_VERSION),
            fix="update armblocks, if the file is newer than it",
        )
    texts = {
        key: members[key].text() if key in members else ""
        for key in ("name", "manufacturer", "comment", "notes")
    }
    if "facts" in members:
        facts_from_json(members["facts"])
    model = FrictionModel.SQUARED_GEAR
    if "friction_model" in members:
        model = FrictionModel(members["friction_model"].choice([model.value for model in FrictionModel]))
    links = tuple(link_from_json(member) for member in members["links"].elements())
    constraints = tuple(
        constraint_from_json(member, transform_from_json)
        for member in (members["constraints"].elements() if "constraints" in members else ())
    )
    frames = tuple(
        _frame_from_json(member) for member in (members["frames"].elements() if "frames" in members else ())
    )
    springs = tuple(
        spring_from_json(member, transform_from_json)
        for member in (members["springs"].elements() if "springs" in members else ())
    )
    try:
        robot = Robot(
            name=texts["name"],
            manufacturer=texts["manufacturer"],
            comment=texts["comment"],
            links=links,
            base=transform_from_json(members["base"]) if "base" in members else Transform(),
            tool=transform_from_json(members["tool"]) if "tool" in members else Transform(),
            gravity=vector_from_json(members["gravity"]) if "gravity" in members else STANDARD_GRAVITY,
            friction_model=model,
            constraints=constraints,
            frames=frames,
            springs=springs,
        )
        if named := _configurations_from_json(members, robot):
            robot = replace(robot, configurations=named)
    except (RobotError, UnknownNameError) as error:
        raise FormatError(
            f"{error.where}: {error.what}", where=node.where, allowed=error.allowed, fix=error.fix
        ) from error
    return robot


def write_robot(robot: Robot) -> bytes:
    """The canonical document of a robot. Reading it gives an equal robot."""
    return canonical_bytes(robot_to_json(robot), one_line=is_one_line)


def is_one_line(path: KeyPath) -> bool:
    """Whether a list of a robot document, with angles as strings, is written on one line."""
    return path[-1:] in (("position",), ("q",))


def robot_to_json(robot: Robot) -> dict[str, object]:
    """The JSON object that describes a robot, without empty members and identity transforms."""
    document: dict[str, object] = {
        "format": FORMAT_VERSION,
        "name": robot.name,
        "gravity": robot.gravity,
        "friction_model": robot.friction_model.value,
        "links": [link_to_json(link) for link in robot.links],
    }
    for key in ("manufacturer", "comment"):
        if getattr(robot, key):
            document[key] = getattr(robot, key)
    for key in ("base", "tool"):
        if not getattr(robot, key).is_identity:
            document[key] = transform_to_json(getattr(robot, key))
    if robot.constraints:
        document["constraints"] = [part_to_json(entry, transform_to_json) for entry in robot.constraints]
    if robot.frames:
        document["frames"] = [_frame_to_json(frame) for frame in robot.frames]
    if robot.springs:
        document["springs"] = [part_to_json(spring, transform_to_json) for spring in robot.springs]
    if robot.configurations:
        document["configurations"] = [
            _configuration_to_json(entry, robot) for entry in robot.configurations.entries
        ]
    return {key: _without_signed_zeros(value) for key, value in document.items()}


def _frame_to_json(frame: NamedFrame) -> dict[str, object]:
    pose = {} if frame.pose.is_identity else {"pose": transform_to_json(frame.pose)}
    return {"name": frame.name, "link": frame.link, **pose}


def _configuration_to_json(configuration: Configuration, robot: Robot) -> dict[str, object]:
    units = [entry.unit for entry in robot.positions]
    q = [angle_to_json(value) if unit == "rad" else value for value, unit in zip(configuration.q, units)]
    return {"name": configuration.name, "q": q}


def _configurations_from_json(members: Mapping[str, Node], robot: Robot) -> list[tuple[str, list[float]]]:
    """The named configurations; ``poses`` is the name of the key in older files."""
    keys = [key for key in ("configurations", "poses") if key in members]
    if len(keys) > 1:
        raise members["poses"].error(
            "the file has both 'configurations' and 'poses', the older name of the same list",
            allowed="one of them",
            fix="move the entries of 'poses' to 'configurations'",
        )
    units = [entry.unit for entry in robot.positions]
    found: list[tuple[str, list[float]]] = []
    for element in members[keys[0]].elements() if keys else ():
        entry = closed_members(element, ("name", "q"), required=("name", "q"))
        numbers = entry["q"].elements()
        angular = [unit == "rad" for unit in units] if len(numbers) == len(units) else [False] * len(numbers)
        q = [angle_from_json(n) if is_angle else n.number() for n, is_angle in zip(numbers, angular)]
        found.append((entry["name"].text(), q))
    return found


def _frame_from_json(node: Node) -> NamedFrame:
    members = closed_members(node, ("name", "link", "pose"), required=("name", "link"))
    return NamedFrame(
        name=members["name"].text(),
        link=None if members["link"].value is None else members["link"].text(),
        pose=transform_from_json(members["pose"]) if "pose" in members else Transform(),
    )


def _without_signed_zeros(value: object) -> object:
    """The value with 0.0 instead of -0.0, so that equal robots have equal files."""
    match value:
        case float():
            return value + 0.0
        case dict():
            return {
                key: _without_signed_zeros(entry) for key, entry in cast("dict[str, object]", value).items()
            }
        case list() | tuple():
            return [
                _without_signed_zeros(entry) for entry in cast("list[object] | tuple[object, ...]", value)
            ]
        case _:
            return value
