"""Joints of MJCF: type, axis, limits, friction, and the torque limits that actuators give."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from armblocks.formats.file_findings import FileContext
from armblocks.formats.mjcf.rules import FRICTION, LIMIT, TENDON
from armblocks.formats.mjcf.settings import Defaults, Settings, sections
from armblocks.formats.mjcf.springs import GivenSpring, spring_of
from armblocks.formats.xml_elements import Element, note, shortened
from armblocks.robot import Free, Joint, JointLimits, Motor, Prismatic, Revolute, Spherical
from armblocks.spatial import Vector3

_KINDS: Mapping[str, type[Joint]] = {
    "hinge": Revolute,
    "slide": Prismatic,
    "ball": Spherical,
    "free": Free,
}
_TRANSMISSIONS_OF_TENDONS = ("tendon", "cranksite", "slidersite")


class PlacedJoint(NamedTuple):
    """A joint, the ``position`` of its axis in the frame of its body (m), its motor and its spring.

    ``rest``: the coordinate of a hinge or slide at which tendons have their default rest length, rad or m.
    """

    joint: Joint
    position: Vector3
    motor: Motor | None
    spring: GivenSpring | None
    rest: float = 0.0


class Actuation(NamedTuple):
    """Contributions of actuators to a joint, at the joint: largest torque, rotor inertia, damping (SI units).

    ``torque``: N m or N, None if unknown.
    """

    torque: float | None = None
    armature: float = 0.0
    damping: float = 0.0


def joint_of(
    element: Element, settings: Settings, actuation: Mapping[str, Actuation], context: FileContext
) -> PlacedJoint:
    """The joint of an element with its defaults. Raises ``FormatError`` for unknown types.

    In MJCF the pose of a body is that at the joint coordinate ``ref``, so the offset is ``-ref``. The pose of
    a body with a ball or free joint is that at ``neutral``.
    """
    kind = "free" if element.tag == "freejoint" else element.attributes.get("type", "hinge").strip()
    if kind not in _KINDS:
        raise element.error(
            f"the joint is of type '{shortened(kind)}', which MJCF does not have",
            allowed=", ".join(_KINDS),
            fix="correct the type",
        )
    unit = settings.angle_unit if kind == "hinge" else 1.0
    spring = spring_of(element, kind, unit, context)
    driven = actuation.get(element.attributes.get("name", "").strip(), Actuation())
    if kind in ("ball", "free"):
        if driven.armature or driven.damping:
            what = f"armature and damping of the actuators of the {kind} joint are omitted"
            note(context, FRICTION, element, what)
        motor = _motor_of(element, Actuation(), context)
        if kind == "free":
            return PlacedJoint(Free(), (0.0, 0.0, 0.0), motor, None)
        if _range(element, 1.0, settings, context) is not None:
            note(context, LIMIT, element, "the range of the ball joint is omitted")
        return PlacedJoint(Spherical(), element.vector("pos", (0.0, 0.0, 0.0)), motor, None)
    position = element.vector("pos", (0.0, 0.0, 0.0))
    axis = element.vector("axis", (0.0, 0.0, 1.0))
    if not 1e-10 < math.hypot(*axis) < math.inf:
        raise element.error(
            "the axis of the joint is zero", allowed="a direction such as 0 0 1", fix="set the axis"
        )
    torque = driven.torque if driven.torque is not None else _force_limit(element, "actuatorfrcrange")
    limits = JointLimits(position=_range(element, unit, settings, context), torque=torque)
    joint = _KINDS[kind](axis=axis, offset=-unit * element.number("ref", 0.0), limits=limits)
    rest = unit * element.number("springref", 0.0)
    return PlacedJoint(joint, position, _motor_of(element, driven, context), spring, rest)


def _first(element: Element, attribute: str) -> float:
    """The first number of an attribute (damping may be a polynomial); 0 if it is absent."""
    return element.numbers(attribute, range(1, 9))[0] if attribute in element.attributes else 0.0


def _range(
    element: Element, unit: float, settings: Settings, context: FileContext
) -> tuple[float, float] | None:
    limited = element.attributes.get("limited", "auto").strip()
    if "range" not in element.attributes or limited == "false":
        return None
    if limited == "auto" and not settings.limits_by_range:
        return None
    low, high = (unit * value for value in element.numbers("range", (2,)))
    if low > high or (low == high == 0.0):
        note(context, LIMIT, element, f"the range from {low:g} to {high:g} is omitted")
        return None
    return low, high


def _motor_of(element: Element, driven: Actuation, context: FileContext) -> Motor | None:
    """The motor with the armature as rotor inertia, and with the friction of the joint and its actuators."""
    damping, friction = _first(element, "damping"), element.number("frictionloss", 0.0)
    armature = element.number("armature", 0.0)
    if "damping" in element.attributes and any(element.numbers("damping", range(1, 9))[1:]):
        note(context, FRICTION, element, "the nonlinear part of the damping is omitted")
    if min(damping, friction, armature) < 0.0:
        text = f"damping {damping:g}, frictionloss {friction:g}, armature {armature:g}"
        what = f"{text}: negative values are omitted"
        note(context, FRICTION, element, what)
        damping, friction, armature = (max(value, 0.0) for value in (damping, friction, armature))
    damping, armature = damping + driven.damping, armature + driven.armature
    if damping == friction == armature == 0.0:
        return None
    return Motor(
        inertia=armature, gear_ratio=1.0, viscous_friction=damping, coulomb_friction=(friction, -friction)
    )


def _force_limit(element: Element, attribute: str, factor: float = 1.0) -> float | None:
    """The largest magnitude in a range of forces, times ``factor``; ``None`` if there is no finite range."""
    if attribute not in element.attributes:
        return None
    low, high = element.numbers(attribute, (2,))
    limit = max(-low, high) * abs(factor)
    return limit if 0.0 < limit < math.inf else None


def actuated_joints(root: Element, defaults: Defaults) -> set[str]:
    """The names of the joints at which actuators act."""
    actuators = [defaults.applied(element) for element in sections(root, "actuator")]
    return {element.attributes.get("joint", "").strip() for element in actuators} - {""}


def actuation_of(root: Element, defaults: Defaults, context: FileContext) -> dict[str, Actuation]:
    """The contributions of the actuators to each joint, by the joint's name.

    The largest torque is the force range of an actuator, or the control range of a motor, times the magnitude
    of the gear. Armature and damping are at the actuator: at the joint they are larger by the squared gear.
    """
    found: dict[str, Actuation] = {}
    for element in sections(root, "actuator"):
        actuator = defaults.applied(element)
        if any(name in actuator.attributes for name in _TRANSMISSIONS_OF_TENDONS):
            note(context, TENDON, actuator, "the actuator does not act on a joint; it is omitted")
            continue
        names = [actuator.attributes.get(key, "").strip() for key in ("joint", "jointinparent")]
        joint = names[0] or names[1]
        gear = actuator.numbers("gear", range(1, 7))[0] if "gear" in actuator.attributes else 1.0
        force = _force_limit(actuator, "forcerange", gear)
        if force is None and actuator.tag == "motor":
            force = _force_limit(actuator, "ctrlrange", gear)
        armature, damping = actuator.number("armature", 0.0), _first(actuator, "damping")
        if "damping" in actuator.attributes and any(actuator.numbers("damping", range(1, 9))[1:]):
            note(context, FRICTION, actuator, "the nonlinear part of the damping is omitted")
        if min(armature, damping) < 0.0:
            what = f"damping {damping:g}, armature {armature:g}: negative values are omitted"
            note(context, FRICTION, actuator, what)
        if joint:
            others = found.get(joint, Actuation())
            torques = [torque for torque in (force, others.torque) if torque is not None]
            found[joint] = Actuation(
                max(torques, default=None),
                others.armature + gear * gear * max(armature, 0.0),
                others.damping + gear * gear * max(damping, 0.0),
            )
    return found
