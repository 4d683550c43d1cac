"""``robot`` of releases up to 8, ``SerialLink`` of 9 and later: fields, and conversion to ``Robot``."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from armblocks.errors import ArmblocksError, counted
from armblocks.formats.matlab.link_constructors import is_modified, link_from_row, rows_of
from armblocks.formats.matlab.link_fields import finite_number, numbers, set_link_field
from armblocks.formats.matlab.records import LinkRecord, Release, RobotRecord
from armblocks.formats.matlab.values import MAX_LINKS, Cell, LinkArray, Value
from armblocks.matlab.arrays import Array, array_of, kind_of, scalar, text_of
from armblocks.matlab.source import Location
from armblocks.robot import (
    DhConvention,
    DhRow,
    FrictionModel,
    JointLimits,
    Link,
    Motor,
    Robot,
    link_from_dh,
    serial_chain,
)
from armblocks.spatial import Transform

ASSIGNABLE = "name, manuf, manufacturer, comment, gravity, base, tool, offset, qlim, links, plotopt"
_DISPLAY_ONLY = ("plotopt", "lineopt", "shadowopt", "plotopt3d", "config", "configs", "ikineType", "faceopt")
"""Fields and options for plots and labels: accepted and ignored, because no result depends on them."""


def make_robot(location: Location, arguments: list[Value], variable: str) -> RobotRecord:
    """``robot(L, name, manuf, comment)`` of releases up to 8; ``L`` a cell array of links or a D-H matrix.

    ``variable`` is the name of the first argument's variable, and the default name of a robot from a matrix.
    """
    if not 1 <= len(arguments) <= 4:
        raise location.error(
            f"robot is called with {counted(len(arguments), 'argument')}",
            allowed="robot(L, name, manuf, comment)",
        )
    first, *words = arguments
    match first:
        case RobotRecord():
            record = first.copy_on_assignment()
        case Cell():
            links = [_link_of(location, element, i) for i, element in enumerate(first.elements, start=1)]
            record = RobotRecord(
                location=location,
                release=Release.UP_TO_8,
                links=[link.copy_on_assignment() for link in links],
            )
        case _ if isinstance(first, np.ndarray) and first.size:
            links = _links_of_matrix(location, Release.UP_TO_8, first, modified=False)
            record = RobotRecord(
                location=location, release=Release.UP_TO_8, links=links, name=variable or "noname"
            )
        case _:
            raise location.error(
                f"robot is called with {kind_of(first)}",
                allowed="a cell array of links, L{1} = link(…), or a D-H matrix",
                fix="for an array of links, [L1 L2], use SerialLink",
            )
    for field, word in zip(("name", "manuf", "comment"), words):
        set_robot_field(location, record, field, word)
    _check_convention(location, record)
    return record


def make_serial_link(location: Location, arguments: list[Value]) -> RobotRecord:
    """``SerialLink(links or D-H matrix, 'name', …)`` of releases 9 and later."""
    if not arguments:
        raise location.error(
            "SerialLink is called without links", allowed="SerialLink(links, 'name', text, …)"
        )
    first, *options = arguments
    modified = False
    pairs: list[tuple[str, Value]] = []
    position = 0
    while position < len(options):
        key = text_of(location, options[position], f"argument {position + 2} of SerialLink")
        position += 1
        if key in ("modified", "standard"):
            modified = is_modified(location, key)
            continue
        if position == len(options):
            raise location.error(f"'{key}' of SerialLink has no value", allowed=f"'{key}', value")
        pairs.append((key, options[position]))
        position += 1
    links: list[LinkRecord] = []
    match first:
        case RobotRecord():
            links = list(first.links)
        case LinkRecord():
            links = [first]
        case LinkArray():
            links = [_link_of(location, link, i) for i, link in enumerate(first.links, start=1)]
        case Cell():
            links = [_link_of(location, element, i) for i, element in enumerate(first.elements, start=1)]
        case _ if isinstance(first, np.ndarray) and first.size:
            links = _links_of_matrix(location, Release.FROM_9, first, modified=modified)
        case _:
            raise location.error(
                f"SerialLink is called with {kind_of(first)}", allowed="links, or a D-H matrix"
            )
    record = RobotRecord(location=location, release=Release.FROM_9, links=links)
    if isinstance(first, RobotRecord):
        for field in ("name", "manufacturer", "comment", "gravity", "base", "tool"):
            setattr(record, field, getattr(first, field))
    for key, value in pairs:
        set_robot_field(location, record, key, value)
    _check_convention(location, record)
    return record


def _links_of_matrix(
    location: Location, release: Release, matrix: Array, *, modified: bool
) -> list[LinkRecord]:
    if matrix.shape[0] > MAX_LINKS:
        raise location.error(f"the robot has {matrix.shape[0]} links", allowed=f"at most {MAX_LINKS}")
    return [link_from_row(location, release, row, modified=modified) for row in rows_of(matrix)]


def _link_of(location: Location, element: Value | None, number: int) -> LinkRecord:
    if not isinstance(element, LinkRecord):
        raise location.error(
            f"element {number} of the links is {kind_of(element)}",
            allowed="links",
            fix=f"define link {number} first",
        )
    return element


def _check_convention(location: Location, record: RobotRecord) -> None:
    if not record.links:
        raise location.error("the robot has no links", allowed="1 link or more")
    if len({link.modified for link in record.links}) > 1:
        raise location.error(
            "standard and modified D-H links are mixed in one robot", allowed="one convention for all links"
        )


def set_robot_field(location: Location, robot: RobotRecord, name: str, value: Value) -> None:
    """``robot.name = value``. Raises ``FormatError`` for an unknown field or an invalid value."""
    match name:
        case "name" | "comment":
            setattr(robot, name, text_of(location, value, name))
        case "manuf" | "manufacturer":
            robot.manufacturer = text_of(location, value, name)
        case "gravity":
            x, y, z = numbers(location, value, "gravity", 3)
            robot.gravity = (x, y, z)
        case "base" | "tool":
            setattr(robot, name, _transform(location, value, name))
        case "links" | "link":
            _set_links(location, robot, value)
        case "offset" | "qlim":
            _set_joint_rows(location, robot, name, value)
        case _ if name in _DISPLAY_ONLY:
            pass
        case _:
            raise location.error(f"a robot has no field '{name}'", allowed=ASSIGNABLE)


def robot_field(location: Location, robot: RobotRecord, name: str) -> Value:
    """The value of ``robot.name``."""
    getter = _GETTERS.get(name)
    if getter is None:
        raise location.error(f"a robot has no field or method '{name}' here", allowed=f"n, {ASSIGNABLE}")
    return getter(robot)


_GETTERS: dict[str, Callable[[RobotRecord], Value]] = {
    "n": lambda robot: scalar(float(len(robot.links))),
    "name": lambda robot: robot.name,
    "manuf": lambda robot: robot.manufacturer,
    "manufacturer": lambda robot: robot.manufacturer,
    "comment": lambda robot: robot.comment,
    "gravity": lambda robot: np.array(robot.gravity).reshape(3, 1),
    "base": lambda robot: robot.base.matrix,
    "tool": lambda robot: robot.tool.matrix,
    "links": lambda robot: LinkArray(list(robot.links)),
    "link": lambda robot: Cell(list(robot.links)),
}


def _transform(location: Location, value: Value, name: str) -> Transform:
    matrix = array_of(location, value, name)
    try:
        return Transform.from_matrix(matrix)
    except ArmblocksError as error:
        raise location.error(
            f"{name} is invalid: {error.what}", allowed=error.allowed, fix=error.fix
        ) from None


def _set_links(location: Location, robot: RobotRecord, value: Value) -> None:
    elements = (
        value.links if isinstance(value, LinkArray) else value.elements if isinstance(value, Cell) else None
    )
    if elements is None:
        raise location.error(f"the links of a robot are {kind_of(value)}", allowed="links")
    robot.links = [_link_of(location, element, i) for i, element in enumerate(elements, start=1)]


def _set_joint_rows(location: Location, robot: RobotRecord, name: str, value: Value) -> None:
    """``offset`` (n numbers) or ``qlim`` (n rows of two) for all links at once."""
    if robot.release is Release.UP_TO_8:
        raise location.error(
            f"releases up to 8 ignore an assignment to '{name}' of a robot",
            allowed=f"'{name}' of each link",
            fix=f"write L{{i}}.{name} = … before robot(L, …)",
        )
    n = len(robot.links)
    if name == "offset":
        for link, number in zip(robot.links, numbers(location, value, "offset", n)):
            link.offset = finite_number(location, scalar(number), "offset")
        return
    array = array_of(location, value, "qlim")
    if array.shape != (n, 2):
        raise location.error(f"qlim is {kind_of(array)}", allowed=f"a {n}x2 matrix")
    for link, row in zip(robot.links, array):
        set_link_field(location, link, "qlim", row.reshape(1, 2))


def robot_from_record(record: RobotRecord, friction_model: FrictionModel) -> Robot:
    """The ``Robot`` of a script's record. Links are named ``link1``, ``link2`` … from the base.

    Raises ``FormatError`` at the line that created the robot.
    """
    _check_convention(record.location, record)
    try:
        links = [_link_from_record(i, link) for i, link in enumerate(record.links, start=1)]
        gx, gy, gz = record.gravity
        return Robot(
            name=record.name,
            links=serial_chain(links),
            manufacturer=record.manufacturer,
            comment=record.comment,
            base=record.base,
            tool=record.tool,
            gravity=(-gx, -gy, -gz),
            friction_model=friction_model,
            source=record.location.source.name,
        )
    except ArmblocksError as error:
        raise record.location.error(str(error).rstrip("."), allowed=error.allowed, fix=error.fix) from error


def _link_from_record(number: int, link: LinkRecord) -> Link:
    zero = (0.0, 0.0, 0.0)
    convention = DhConvention.MODIFIED if link.modified else DhConvention.STANDARD
    dh = DhRow(
        alpha=link.alpha,
        a=link.a,
        d=link.d,
        theta=link.theta,
        sigma=link.sigma,
        offset=link.offset,
        convention=convention,
    )
    return link_from_dh(
        f"link{number}",
        dh,
        limits=JointLimits(position=link.qlim),
        mass=link.mass or 0.0,
        centre_of_mass=link.centre_of_mass or zero,
        inertia=link.inertia or (zero, zero, zero),
        motor=_motor(link),
    )


def _motor(link: LinkRecord) -> Motor | None:
    """The motor, or ``None`` if the script sets no motor parameter."""
    parameters = (link.motor_inertia, link.gear_ratio, link.viscous_friction, link.coulomb_friction)
    if all(part is None for part in parameters):
        return None
    return Motor(
        inertia=link.motor_inertia or 0.0,
        gear_ratio=1.0 if link.gear_ratio is None else link.gear_ratio,
        viscous_friction=link.viscous_friction or 0.0,
        coulomb_friction=link.coulomb_friction or (0.0, 0.0),
    )
