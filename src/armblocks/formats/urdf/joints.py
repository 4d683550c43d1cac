"""Joints, limits, friction and transmissions of URDF."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from armblocks.errors import FormatError, counted
from armblocks.formats.file_findings import FileContext
from armblocks.formats.urdf.origins import origin_of
from armblocks.formats.urdf.rules import AXIS, DAMPING, LIMIT, MIMIC, NO_LIMIT, TRANSMISSION
from armblocks.formats.xml_elements import Element, note
from armblocks.robot import (
    Coupling,
    Fixed,
    Free,
    Joint,
    JointLimits,
    Motor,
    Planar,
    Prismatic,
    Revolute,
    Spherical,
)
from armblocks.spatial import Matrix3, Transform, Vector3, rotation_about, rotation_x

JOINT_KINDS: dict[str, type[Joint]] = {
    "revolute": Revolute,
    "continuous": Revolute,
    "prismatic": Prismatic,
    "fixed": Fixed,
    "planar": Planar,
    "floating": Free,
    "spherical": Spherical,
}
"""The joint types of URDF, and the type of ball joints in files for Bullet."""
_SINGLE = ("revolute", "continuous", "prismatic")
"""The types with one coordinate."""
UNIT_LENGTH = 1e-3
"""Maximum deviation of an axis's length from 1 without a finding."""
UNLIMITED = 1e9
"""A limit of this size means no limit. The writer uses it because other programs require a number."""
_INFINITE = {"inf", "+inf", "-inf", "infinity", "+infinity", "-infinity"}


class Transmission(NamedTuple):
    """``reduction``: motor turns per joint turn; ``inertia`` of the rotor, kg m2."""

    reduction: float
    inertia: float


def joint_type_of(element: Element) -> str:
    """The type of a joint. Raises ``FormatError`` for types that are not supported."""
    kind = element.required("type", ", ".join(JOINT_KINDS))
    if kind not in JOINT_KINDS:
        raise element.error(
            f"the joint is of type '{kind[:40]}', which is not a type of URDF",
            allowed=", ".join(JOINT_KINDS),
            fix="replace it by one of these types, or by a chain of them",
        )
    return kind


class PlacedJoint(NamedTuple):
    """A joint; ``before``: its frame in the parent link's frame; ``after``: the child link's frame in it."""

    joint: Joint
    before: Transform
    after: Transform = Transform()


def joint_of(element: Element, context: FileContext) -> PlacedJoint:
    """The joint of an element, with its place.

    A planar joint of URDF moves in the plane normal to its axis. The x and y axes of the plane are the axes
    of the joint frame, rotated by the smallest rotation of z to the axis. A floating joint has no limits
    here.
    """
    kind = joint_type_of(element)
    before = origin_of(element, context)
    if kind == "fixed":
        return PlacedJoint(Fixed(), before)
    if kind in ("floating", "spherical"):
        return PlacedJoint(JOINT_KINDS[kind](), before)
    if kind == "planar":
        to_axis = Transform(rotation=_z_to(_axis(element, context)))
        return PlacedJoint(Planar(), before @ to_axis, to_axis.inverse())
    joint = JOINT_KINDS[kind](axis=_axis(element, context), limits=_limits(element, kind, context))
    return PlacedJoint(joint, before)


def couplings_of(
    joints: Mapping[str, Element], links: Mapping[Element, tuple[str, str]], context: FileContext
) -> tuple[Coupling, ...]:
    """The couplings of joints that mimic others: ``q = multiplier q_leader + offset``.

    ``links``: the names of parent and child link of each joint; a joint has the name of its child link.
    """
    couplings: list[Coupling] = []
    moving = {name: element for name, element in joints.items() if joint_type_of(element) in _SINGLE}
    for name, element in moving.items():
        mimic = element.first("mimic")
        if mimic is None:
            continue
        leader = mimic.attributes.get("joint", "").strip()
        multiplier, offset = mimic.number("multiplier", 1.0), mimic.number("offset", 0.0)
        if leader not in moving or leader == name or multiplier == 0.0:
            what = f"it mimics joint '{leader[:40]}' with the multiplier {multiplier:g}"
            note(context, MIMIC, mimic, f"{what}; its coordinate is independent here", element.label)
            continue
        follower, followed = links[element][1], links[moving[leader]][1]
        terms = ((follower, 1.0), (followed, -multiplier))
        couplings.append(Coupling(name=f"{name} mimics {leader}", terms=terms, constant=offset))
    return tuple(couplings)


def _z_to(axis: Vector3) -> Matrix3:
    """The smallest rotation of the z axis to a direction; about x for the opposite direction."""
    x, y, z = Revolute(axis=axis).axis
    sine = math.hypot(x, y)
    if sine == 0.0:
        return rotation_x(0.0 if z > 0 else math.pi)
    return rotation_about((-y / sine, x / sine, 0.0), math.atan2(sine, z))


def _axis(element: Element, context: FileContext) -> Vector3:
    axis = element.first("axis")
    if axis is None:
        return (1.0, 0.0, 0.0)  # the default of URDF
    direction = axis.vector("xyz", (1.0, 0.0, 0.0))
    length = math.hypot(*direction)
    if length < 1e-9 or not math.isfinite(length):
        raise axis.error(
            f"the axis of {element.label} is {direction[0]:g} {direction[1]:g} {direction[2]:g}",
            allowed="a direction such as 0 0 1",
            fix="set the axis along which the joint moves",
        )
    if abs(length - 1) > UNIT_LENGTH:
        note(
            context, AXIS, axis, f"the axis has the length {length:.6g}; its direction is used", element.label
        )
    return direction


def _limits(element: Element, kind: str, context: FileContext) -> JointLimits:
    limit = element.first("limit")
    if limit is None:
        if kind != "continuous":
            note(context, NO_LIMIT, element, f"the {kind} joint has no limits; it is unlimited here")
        return JointLimits()
    position: tuple[float, float] | None = None
    if kind != "continuous" and ("lower" in limit.attributes or "upper" in limit.attributes):
        low, high = _bound(limit, "lower"), _bound(limit, "upper")
        if low > high:
            what = f"the lower limit {low:g} is above the upper limit {high:g}; both are omitted"
            note(context, LIMIT, limit, what, element.label)
        elif math.isfinite(low) and math.isfinite(high):
            position = (low, high)
    return JointLimits(
        position=position,
        speed=_magnitude(limit, "velocity", element, context),
        torque=_magnitude(limit, "effort", element, context),
    )


def _bound(limit: Element, name: str) -> float:
    text = limit.attributes.get(name, "0").strip()
    value = float(text) if text.lower() in _INFINITE else limit.number(name, 0.0, limit=math.inf)
    return value if abs(value) < UNLIMITED else math.copysign(math.inf, value)


def _magnitude(limit: Element, name: str, joint: Element, context: FileContext) -> float | None:
    """A limit of speed or torque; ``None`` for absent, infinite and impossible values."""
    if name not in limit.attributes:
        return None
    value = _bound(limit, name)
    if value <= 0:
        what = f"the {name} limit is {value:g}, with which the joint cannot move; it is omitted"
        note(context, LIMIT, limit, what, joint.label)
        return None
    return value if math.isfinite(value) else None


def motor_of(joint: Element, transmission: Transmission | None, context: FileContext) -> Motor | None:
    """The motor that gives the joint the friction of ``<dynamics>`` and the rotor of its transmission.

    URDF states friction at the joint: ``tau = damping qd + friction sign(qd)``. Motor friction is multiplied
    by G² (viscous) and ``|G|`` (Coulomb), so it is divided by them here.
    """
    dynamics = joint.first("dynamics")
    damping = friction = 0.0
    if dynamics is not None:
        damping, friction = dynamics.number("damping", 0.0), dynamics.number("friction", 0.0)
        if damping < 0 or friction < 0:
            what = (
                f"damping {damping:g} and friction {friction:g} would accelerate the joint; they are omitted"
            )
            note(context, DAMPING, dynamics, what, joint.label)
            damping = friction = 0.0
    if transmission is None and damping == friction == 0:
        return None
    G, rotor = transmission or Transmission(1.0, 0.0)
    return Motor(
        inertia=rotor,
        gear_ratio=G,
        viscous_friction=damping / (G * G),
        coulomb_friction=(friction / abs(G), -friction / abs(G)),
    )


def transmissions_of(root: Element, context: FileContext) -> dict[str, Transmission]:
    """The transmissions of a robot by the joint's name.

    ``mechanicalReduction`` is in the actuator (or in the joint or the transmission, as in older files), the
    rotor's inertia in ``rotorInertia``, ``motorInertia`` or ``drake:rotor_inertia`` of the actuator.
    """
    transmissions: dict[str, Transmission] = {}
    for transmission in root.all("transmission"):
        joints, actuators = list(transmission.all("joint")), list(transmission.all("actuator"))
        places = [*actuators, *joints, transmission]
        try:
            reduction = _value(places, ("mechanicalReduction", "drake:gear_ratio"))
            inertia = _value(places, ("rotorInertia", "motorInertia", "drake:rotor_inertia"))
        except FormatError as error:
            note(context, TRANSMISSION, transmission, f"it is not read: {error.what}")
            continue
        if reduction is None and inertia is None:
            continue
        G, rotor = reduction if reduction is not None else 1.0, inertia or 0.0
        if len(joints) != 1 or len(actuators) > 1 or G == 0 or rotor < 0:
            counts = f"{counted(len(joints), 'joint')}, {counted(len(actuators), 'actuator')}"
            what = f"{counts}, reduction {G:g}, rotor inertia {rotor:g}"
            note(context, TRANSMISSION, transmission, f"it is not read: {what}")
            continue
        if (G, rotor) != (1.0, 0.0):
            transmissions[joints[0].attributes.get("name", "").strip()] = Transmission(G, rotor)
    return transmissions


def _value(places: list[Element], names: tuple[str, ...]) -> float | None:
    """The number of the first of these child elements, in an attribute ``value`` or as text."""
    for place in places:
        for name in names:
            child = place.first(name)
            if child is not None:
                if "value" not in child.attributes:
                    child.attributes["value"] = child.text
                return child.number("value")
    return None
