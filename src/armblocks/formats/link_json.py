"""A link of a robot document: its joint or D-H row, limits, mass, motor and shapes."""

from __future__ import annotations

from dataclasses import replace

from armblocks.errors import RobotError, counted
from armblocks.formats.json_document import Node, closed_members
from armblocks.formats.shapes_json import shape_from_json, shape_to_json
from armblocks.formats.spatial_json import (
    angle_from_json,
    angle_to_json,
    transform_from_json,
    transform_to_json,
    vector_from_json,
)
from armblocks.robot import (
    JOINT_TYPES,
    DhConvention,
    DhRow,
    Joint,
    JointLimits,
    Link,
    Motor,
    Revolute,
    link_from_dh,
)
from armblocks.spatial import Matrix3, Transform

_MASS_KEYS = ("mass", "centre_of_mass", "inertia")
_LINK_KEYS = ("name", "parent", "dh", "joint", "before", "after", "limits", *_MASS_KEYS, "motor", "geometry")
_INERTIA_KEYS = ("xx", "yy", "zz", "xy", "yz", "xz")
_JOINTS = {kind.__name__.lower(): kind for kind in JOINT_TYPES}


def link_from_json(node: Node) -> Link:
    """The link that a JSON object describes."""
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
    centre = vector_from_json(members["centre_of_mass"]) if "centre_of_mass" in members else (0.0, 0.0, 0.0)
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
        before=transform_from_json(members["before"]) if "before" in members else Transform(),
        after=transform_from_json(members["after"]) if "after" in members else Transform(),
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
        alpha=angle_from_json(members["alpha"]) if "alpha" in members else 0.0,
        theta=angle_from_json(members["theta"]) if "theta" in members else 0.0,
        a=members["a"].number() if "a" in members else 0.0,
        d=members["d"].number() if "d" in members else 0.0,
        offset=0.0 if offset is None else offset.number() if is_prismatic else angle_from_json(offset),
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
            values[name] = vector_from_json(members[name]) if is_axis else members[name].number()
    try:
        joint = kind(**values)  # pyright: ignore[reportArgumentType] - parameters by name
        if "offset" in members:
            offset, angular = members["offset"], _is_angle(joint)
            joint = replace(joint, offset=angle_from_json(offset) if angular else offset.number())
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
        low, high = (angle_from_json(end) if angular else end.number() for end in ends)
        position = (low, high)
    speed = members.get("speed")
    return JointLimits(
        position=position,
        speed=None
        if speed is None
        else angle_from_json(speed, per_second=True)
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


def link_to_json(link: Link) -> dict[str, object]:
    """The JSON object of a link, without empty members and identity transforms."""
    entry: dict[str, object] = {"name": link.name, "parent": link.parent, "mass": link.mass}
    if link.dh is not None:
        entry["dh"] = _dh_to_json(link.dh)
    else:
        entry["joint"] = _joint_to_json(link.joint)
        for key in ("before", "after"):
            if not getattr(link, key).is_identity:
                entry[key] = transform_to_json(getattr(link, key))
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


def _dh_to_json(dh: DhRow) -> dict[str, object]:
    return {
        "convention": dh.convention.value,
        "joint": "prismatic" if dh.sigma else "revolute",
        "alpha": angle_to_json(dh.alpha),
        "a": dh.a,
        "d": dh.d,
        "theta": angle_to_json(dh.theta),
        "offset": dh.offset if dh.sigma else angle_to_json(dh.offset),
    }


def _joint_to_json(joint: Joint) -> dict[str, object]:
    entry: dict[str, object] = {"type": type(joint).__name__.lower()}
    for name in joint.parameters:
        is_angle = name == "offset" and _is_angle(joint)
        entry[name] = angle_to_json(joint.offset) if is_angle else getattr(joint, name)
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
        entry["position"] = [angle_to_json(end) if angular else end for end in limits.position]
    if limits.speed is not None:
        entry["speed"] = angle_to_json(limits.speed, "deg/s") if angular else limits.speed
    if limits.torque is not None:
        entry["torque"] = limits.torque
    return entry
