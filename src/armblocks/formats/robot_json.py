"""Robots as canonical JSON, ``robot.json``: every field of a ``Robot``, in SI units.

Angles may be texts such as ``"90 deg"``, and angular speeds such as ``"105 deg/s"``. The writer uses degrees
where they have few digits and read back exactly. A link with a ``dh`` row takes its joint and transforms from
it. Unknown keys are errors that suggest the nearest known key, because ignoring a misspelt key would give a
wrong robot. ``notes`` is a comment; :mod:`armblocks.formats.robot_facts` reads ``facts``. Neither
is preserved. ``configurations`` is a list of objects with ``name`` and ``q``, because keys are sorted; older
files name it ``poses``.

The JSON Schema is ``formats/schema/robot.schema.json``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from typing import cast

import numpy as np

from armblocks.errors import ArmblocksError, FormatError, RobotError, UnknownNameError, counted
from armblocks.formats.canonical_json import canonical_bytes
from armblocks.formats.constraint_json import constraint_from_json, part_to_json, spring_from_json
from armblocks.formats.json_document import KeyPath, Node, closed_members, read_document
from armblocks.formats.robot_facts import MAX_BYTES, facts_from_json
from armblocks.formats.shapes_json import shape_from_json, shape_to_json
from armblocks.robot import (
    JOINT_TYPES,
    Configuration,
    DhConvention,
    DhRow,
    FrictionModel,
    Joint,
    JointLimits,
    Link,
    Motor,
    NamedFrame,
    Revolute,
    Robot,
    link_from_dh,
)
from armblocks.robot.robot import STANDARD_GRAVITY
from armblocks.spatial import Matrix3, Transform, Vector3

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
_MASS_KEYS = ("mass", "centre_of_mass", "inertia")
_LINK_KEYS = ("name", "parent", "dh", "joint", "before", "after", "limits", *_MASS_KEYS, "motor", "geometry")
_INERTIA_KEYS = ("xx", "yy", "zz", "xy", "yz", "xz")
_DEGREES = re.compile(r"(-?[0-9]+(?:\.[0-9]+)?) deg(/s)?")
_JOINTS = {kind.__name__.lower(): kind for kind in JOINT_TYPES}


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
    links = tuple(_link_from_json(member) for member in members["links"].elements())
    constraints = tuple(
        constraint_from_json(member, _transform_from_json)
        for member in (members["constraints"].elements() if "constraints" in members else ())
    )
    frames = tuple(
        _frame_from_json(member) for member in (members["frames"].elements() if "frames" in members else ())
    )
    springs = tuple(
        spring_from_json(member, _transform_from_json)
        for member in (members["springs"].elements() if "springs" in members else ())
    )
    try:
        robot = Robot(
            name=texts["name"],
            manufacturer=texts["manufacturer"],
            comment=texts["comment"],
            links=links,
            base=_transform_from_json(members["base"]) if "base" in members else Transform(),
            tool=_transform_from_json(members["tool"]) if "tool" in members else Transform(),
            gravity=_vector_from_json(members["gravity"]) if "gravity" in members else STANDARD_GRAVITY,
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
    """Whether a list of a robot document, with angles as texts, is written on one line."""
    return path[-1:] in (("position",), ("q",))


def robot_to_json(robot: Robot) -> dict[str, object]:
    """The JSON object that describes a robot, without empty members and identity transforms."""
    document: dict[str, object] = {
        "format": FORMAT_VERSION,
        "name": robot.name,
        "gravity": robot.gravity,
        "friction_model": robot.friction_model.value,
        "links": [_link_to_json(link) for link in robot.links],
    }
    for key in ("manufacturer", "comment"):
        if getattr(robot, key):
            document[key] = getattr(robot, key)
    for key in ("base", "tool"):
        if not getattr(robot, key).is_identity:
            document[key] = _transform_to_json(getattr(robot, key))
    if robot.constraints:
        document["constraints"] = [part_to_json(entry, _transform_to_json) for entry in robot.constraints]
    if robot.frames:
        document["frames"] = [_frame_to_json(frame) for frame in robot.frames]
    if robot.springs:
        document["springs"] = [part_to_json(spring, _transform_to_json) for spring in robot.springs]
    if robot.configurations:
        document["configurations"] = [
            _configuration_to_json(entry, robot) for entry in robot.configurations.entries
        ]
    return {key: _without_signed_zeros(value) for key, value in document.items()}


def _frame_to_json(frame: NamedFrame) -> dict[str, object]:
    pose = {} if frame.pose.is_identity else {"pose": _transform_to_json(frame.pose)}
    return {"name": frame.name, "link": frame.link, **pose}


def _configuration_to_json(configuration: Configuration, robot: Robot) -> dict[str, object]:
    units = [entry.unit for entry in robot.positions]
    q = [_angle_to_json(value) if unit == "rad" else value for value, unit in zip(configuration.q, units)]
    return {"name": configuration.name, "q": q}


# -- reading -----------------------------------------------------------------------------------------------


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
        q = [_angle_from_json(n) if is_angle else n.number() for n, is_angle in zip(numbers, angular)]
        found.append((entry["name"].text(), q))
    return found


def _frame_from_json(node: Node) -> NamedFrame:
    members = closed_members(node, ("name", "link", "pose"), required=("name", "link"))
    return NamedFrame(
        name=members["name"].text(),
        link=None if members["link"].value is None else members["link"].text(),
        pose=_transform_from_json(members["pose"]) if "pose" in members else Transform(),
    )


def _link_from_json(node: Node) -> Link:
    members = closed_members(node, _LINK_KEYS, required=("name",))
    if "dh" in members and (both := {"joint", "before", "after"} & set(members)):
        raise node.error(
            f"the link has both 'dh' and {', '.join(map(repr, sorted(both)))}",
            allowed="a D-H row, or joint, before and after",
            fix="remove one of them",
        )
    name = members["name"].text()
    parent = members["parent"].text() if "parent" in members and members["parent"].value is not None else None
    geometry = (
        tuple(shape_from_json(shape) for shape in members["geometry"].elements())
        if "geometry" in members
        else None
    )
    mass = members["mass"].number() if "mass" in members else 0.0
    centre = _vector_from_json(members["centre_of_mass"]) if "centre_of_mass" in members else (0.0, 0.0, 0.0)
    inertia = _inertia_from_json(members["inertia"]) if "inertia" in members else (0.0,) * 6
    motor = _motor_from_json(members["motor"]) if "motor" in members else None
    if "dh" in members:
        dh = _dh_from_json(members["dh"])
        joint = _with_limits(dh.joint(), members.get("limits"))
        return link_from_dh(
            name,
            dh,
            parent=parent,
            limits=joint.coordinate_limits[0],
            mass=mass,
            centre_of_mass=centre,
            inertia=inertia,
            motor=motor,
            geometry=geometry,
        )
    return Link(
        name=name,
        parent=parent,
        joint=_joint_from_json(members.get("joint"), members.get("limits")),
        before=_transform_from_json(members["before"]) if "before" in members else Transform(),
        after=_transform_from_json(members["after"]) if "after" in members else Transform(),
        mass=mass,
        centre_of_mass=centre,
        inertia=_symmetric(inertia),
        motor=motor,
        geometry=geometry,
    )


def _symmetric(six: tuple[float, ...]) -> Matrix3:
    xx, yy, zz, xy, yz, xz = six
    return (xx, xy, xz), (xy, yy, yz), (xz, yz, zz)


def _dh_from_json(node: Node) -> DhRow:
    members = closed_members(
        node, ("convention", "joint", "alpha", "a", "d", "theta", "offset"), ("convention",)
    )
    is_prismatic = "joint" in members and members["joint"].choice(("revolute", "prismatic")) == "prismatic"
    word = members["convention"].choice([convention.value for convention in DhConvention])
    offset = members.get("offset")
    return DhRow(
        convention=DhConvention(word),
        sigma=int(is_prismatic),
        alpha=_angle_from_json(members["alpha"]) if "alpha" in members else 0.0,
        theta=_angle_from_json(members["theta"]) if "theta" in members else 0.0,
        a=members["a"].number() if "a" in members else 0.0,
        d=members["d"].number() if "d" in members else 0.0,
        offset=0.0 if offset is None else offset.number() if is_prismatic else _angle_from_json(offset),
    )


def _joint_from_json(node: Node | None, limits: Node | None) -> Joint:
    if node is None:
        kind, members = _JOINTS["revolute"], dict[str, Node]()
    else:
        kind = _JOINTS[node.members()["type"].choice(_JOINTS)] if "type" in node.members() else Revolute
        members = closed_members(node, ("type", *kind.parameters), required=("type",))
    values: dict[str, object] = {}
    for name in kind.parameters:
        if name in members and name != "offset":
            is_axis = name.endswith("axis")
            values[name] = _vector_from_json(members[name]) if is_axis else members[name].number()
    try:
        joint = kind(**values)  # pyright: ignore[reportArgumentType] - parameters by name
        if "offset" in members:
            offset, angular = members["offset"], _is_angle(joint)
            joint = replace(joint, offset=_angle_from_json(offset) if angular else offset.number())
        return _with_limits(joint, limits)
    except RobotError as error:
        place = limits if node is None else node
        assert place is not None
        raise place.error(error.what, allowed=error.allowed, fix=error.fix) from error


def _is_angle(joint: Joint) -> bool:
    """Whether the offset of a joint is an angle."""
    return not joint.moves or joint.speeds[0].unit == "rad"


def _with_limits(joint: Joint, node: Node | None) -> Joint:
    """The joint with the limits of a member: an object, or a list of them with one for each speed."""
    if node is None:
        return joint
    if not isinstance(node.value, list):
        return replace(joint, limits=_limits_from_json(node, angular=_is_angle(joint)))
    entries = node.elements()
    angular = [entry.unit == "rad" for entry in joint.speeds]
    if len(entries) != len(angular):
        raise node.error(
            f"{counted(len(entries), 'limit is', 'limits are')} given",
            allowed=f"{len(angular)}, one for each speed",
        )
    return replace(
        joint,
        limits=tuple(_limits_from_json(entry, angular=unit) for entry, unit in zip(entries, angular)),
    )


def _limits_from_json(node: Node, *, angular: bool) -> JointLimits:
    members = closed_members(node, ("position", "speed", "torque"))
    position: tuple[float, float] | None = None
    if "position" in members:
        ends = members["position"].elements()
        if len(ends) != 2:
            raise members["position"].error(
                f"{counted(len(ends), 'limit is', 'limits are')} given", allowed="the lowest and the highest"
            )
        low, high = (_angle_from_json(end) if angular else end.number() for end in ends)
        position = (low, high)
    speed = members.get("speed")
    return JointLimits(
        position=position,
        speed=None
        if speed is None
        else _angle_from_json(speed, per_second=True)
        if angular
        else speed.number(),
        torque=members["torque"].number() if "torque" in members else None,
    )


def _motor_from_json(node: Node) -> Motor:
    members = closed_members(node, ("inertia", "gear_ratio", "viscous_friction", "coulomb_friction"))
    numbers = {
        key: members[key].number() for key in ("inertia", "gear_ratio", "viscous_friction") if key in members
    }
    plus, minus = members["coulomb_friction"].numbers(2) if "coulomb_friction" in members else (0.0, 0.0)
    return Motor(coulomb_friction=(plus, minus), **numbers)


def _inertia_from_json(node: Node) -> tuple[float, ...]:
    members = closed_members(node, _INERTIA_KEYS)
    return tuple(members[key].number() if key in members else 0.0 for key in _INERTIA_KEYS)


def _vector_from_json(node: Node) -> Vector3:
    x, y, z = node.numbers(3)
    return x, y, z


def _transform_from_json(node: Node) -> Transform:
    members = closed_members(node, ("rotation", "translation"))
    identity = Transform()
    rotation: Matrix3 = identity.rotation
    if "rotation" in members:
        rows = members["rotation"].elements()
        if len(rows) != 3:
            raise members["rotation"].error(
                f"{counted(len(rows), 'row is', 'rows are')} given", allowed="3 rows of 3 numbers"
            )
        rotation = (_vector_from_json(rows[0]), _vector_from_json(rows[1]), _vector_from_json(rows[2]))
    translation = (
        _vector_from_json(members["translation"]) if "translation" in members else identity.translation
    )
    try:
        with np.errstate(all="ignore"):  # numbers whose products overflow are not a rotation
            return Transform(rotation=rotation, translation=translation)
    except ArmblocksError as error:
        raise node.error(error.what, allowed=error.allowed, fix=error.fix) from error


def _angle_from_json(node: Node, *, per_second: bool = False) -> float:
    """An angle in rad or an angular speed in rad/s, from a number or from text in degrees."""
    if not isinstance(node.value, str):
        return node.number()
    match = _DEGREES.fullmatch(node.value)
    unit = "deg/s" if per_second else "deg"
    if match is None or (match.group(2) is not None) != per_second or len(node.value) > 40:
        raise node.error(
            f"'{node.value[:40]}' is not an angle", allowed=f'rad as a number, or text such as "90 {unit}"'
        )
    return math.radians(float(match.group(1)))


# -- writing -----------------------------------------------------------------------------------------------


def _link_to_json(link: Link) -> dict[str, object]:
    entry: dict[str, object] = {"name": link.name, "parent": link.parent, "mass": link.mass}
    if link.dh is not None:
        entry["dh"] = _dh_to_json(link.dh)
    else:
        entry["joint"] = _joint_to_json(link.joint)
        for key in ("before", "after"):
            if not getattr(link, key).is_identity:
                entry[key] = _transform_to_json(getattr(link, key))
    if link.joint.limits != JointLimits():
        entry["limits"] = _all_limits_to_json(link.joint)
    if any(link.centre_of_mass):
        entry["centre_of_mass"] = link.centre_of_mass
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = link.inertia
    moments = dict(zip(_INERTIA_KEYS, (xx, yy, zz, xy, yz, xz)))
    if any(moments.values()):
        products = {key: moments[key] for key in ("xy", "yz", "xz") if moments[key]}
        entry["inertia"] = {"xx": xx, "yy": yy, "zz": zz, **products}
    if link.motor is not None:
        entry["motor"] = {
            "inertia": link.motor.inertia,
            "gear_ratio": link.motor.gear_ratio,
            "viscous_friction": link.motor.viscous_friction,
            "coulomb_friction": link.motor.coulomb_friction,
        }
    if link.geometry is not None:
        entry["geometry"] = [shape_to_json(shape) for shape in link.geometry]
    return entry


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


def _dh_to_json(dh: DhRow) -> dict[str, object]:
    return {
        "convention": dh.convention.value,
        "joint": "prismatic" if dh.sigma else "revolute",
        "alpha": _angle_to_json(dh.alpha),
        "a": dh.a,
        "d": dh.d,
        "theta": _angle_to_json(dh.theta),
        "offset": dh.offset if dh.sigma else _angle_to_json(dh.offset),
    }


def _joint_to_json(joint: Joint) -> dict[str, object]:
    entry: dict[str, object] = {"type": type(joint).__name__.lower()}
    for name in joint.parameters:
        is_angle = name == "offset" and _is_angle(joint)
        entry[name] = _angle_to_json(joint.offset) if is_angle else getattr(joint, name)
    return entry


def _all_limits_to_json(joint: Joint) -> object:
    """The limits as one object if they hold for all coordinates of the same unit, else a list."""
    entries = [
        _limits_to_json(limits, angular=coordinate.unit == "rad")
        for coordinate, limits in zip(joint.speeds, joint.coordinate_limits)
    ]
    if not isinstance(joint.limits, tuple) and len({entry.unit for entry in joint.speeds}) <= 1:
        return _limits_to_json(joint.limits, angular=_is_angle(joint))
    return entries


def _limits_to_json(limits: JointLimits, *, angular: bool) -> dict[str, object]:
    entry: dict[str, object] = {}
    if limits.position is not None:
        entry["position"] = [_angle_to_json(end) if angular else end for end in limits.position]
    if limits.speed is not None:
        entry["speed"] = _angle_to_json(limits.speed, "deg/s") if angular else limits.speed
    if limits.torque is not None:
        entry["torque"] = limits.torque
    return entry


def _transform_to_json(transform: Transform) -> dict[str, object]:
    return {"rotation": transform.rotation, "translation": transform.translation}


def _angle_to_json(angle: float, unit: str = "deg") -> float | str:
    """An angle as text in degrees if these have few digits and read back exactly, else in rad."""
    degrees = round(math.degrees(angle), 6)
    text = f"{degrees:.6f}".rstrip("0").rstrip(".")
    if angle == 0 or len(text) > 8 or math.radians(float(text)) != angle:
        return angle
    return f"{text} {unit}"
