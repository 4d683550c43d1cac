"""Joints of SDF: types, axes, limits, friction."""

from __future__ import annotations

import math

from armblocks.formats.file_findings import FileContext
from armblocks.formats.sdf.frames import MODEL_FRAME, Frame, Frames
from armblocks.formats.sdf.rules import AXIS, DAMPING, LIMIT, SPRING
from armblocks.formats.sdf.values import flag_in, number_in, unbounded_number_in
from armblocks.formats.xml_elements import Element, note
from armblocks.robot import Joint, JointLimits, JointSpring, Motor, Prismatic, Revolute, Screw, Spherical
from armblocks.spatial import Transform, Vector3

AXES: dict[str, tuple[str, ...]] = {
    "revolute": ("axis",),
    "continuous": ("axis",),
    "prismatic": ("axis",),
    "fixed": (),
    "revolute2": ("axis", "axis2"),
    "universal": ("axis", "axis2"),
    "screw": ("axis",),
    "ball": (),
}
"""The types of joints that are supported, with their axes from the parent to the child."""
GEARBOX = "gearbox"
UNIT_LENGTH = 1e-3
"""Maximum deviation of an axis's length from 1 without a finding."""
UNLIMITED = 1e9
"""A limit of this size means no limit: older versions have the default 1e16."""


def joint_type_of(joint: Frame) -> str:
    """The type of a joint. Raises ``FormatError`` for types that are not supported."""
    kind = joint.element.required("type", ", ".join(AXES))
    if kind not in AXES and kind != GEARBOX:
        raise joint.element.error(
            f"the joint is of type '{kind[:40]}', which is not supported",
            allowed=", ".join(AXES),
            fix="replace it by a fixed joint, or by a chain of these joints",
        )
    return kind


def joints_of(joint: Frame, frames: Frames, reverse: bool) -> list[tuple[Joint, Motor | None]]:
    """The joints that a joint consists of, from its parent to its child: one for each axis; none if fixed.

    Each axis has its own limits and friction. The axes are in the frame of the joint. ``reverse``: the result
    describes the motion of the parent relative to the child: the order is reversed, and the axes are negated,
    so that the coordinates keep their values. The quaternion of a ball joint is then the inverse one.
    """
    kind = joint_type_of(joint)
    if kind == "ball":
        return [(Spherical(), None)]
    axes: list[tuple[Joint, Motor | None]] = []
    for tag in AXES[kind]:
        axis = joint.element.first(tag)
        x, y, z = direction_of(joint, axis, tag, frames)
        limits = _limits(joint, axis, kind == "continuous", frames.context)
        direction = (-x, -y, -z) if reverse else (x, y, z)
        if kind == "screw":
            described: Joint = Screw(axis=direction, limits=limits, pitch=_pitch(joint.element))
        elif kind == "prismatic":
            described = Prismatic(axis=direction, limits=limits)
        else:
            described = Revolute(axis=direction, limits=limits)
        axes.append((described, motor_of(joint, axis, frames.context)))
    return axes[::-1] if reverse else axes


def _pitch(joint: Element) -> float:
    """The translation per turn, m. ``screw_thread_pitch`` is this number, with the default 1.

    The older ``thread_pitch`` is in rad/m and positive for a left-handed thread.
    """
    older = number_in(joint, "thread_pitch", 0.0)
    pitch = number_in(joint, "screw_thread_pitch", -2.0 * math.pi / older if older else 1.0)
    if pitch == 0.0:
        raise joint.error(
            "the pitch of the thread is 0", allowed="m per turn, other than 0", fix="use a revolute joint"
        )
    return pitch


def direction_of(joint: Frame, axis: Element | None, tag: str, frames: Frames) -> Vector3:
    """The axis in the frame of the joint."""
    xyz = axis.first("xyz") if axis is not None else None
    if axis is None or (xyz is None and "xyz" not in axis.attributes):
        what = f"there is no <{tag}> with <xyz>; the z axis of the joint is used"
        note(frames.context, AXIS, joint.element, what)
        return (0.0, 0.0, 1.0)
    if xyz is not None:
        x, y, z = xyz.text_numbers(3)
    else:
        x, y, z = axis.vector("xyz", (0.0, 0.0, 1.0))
    place, length = xyz or axis, math.hypot(x, y, z)
    if not 1e-9 < length < math.inf:
        raise place.error(
            f"the axis of {joint.element.label} is {x:g} {y:g} {z:g}",
            allowed="a direction such as 0 0 1",
            fix="set the axis along which the joint moves",
        )
    if abs(length - 1) > UNIT_LENGTH:
        what = f"the axis has the length {length:.6g}; its direction is used"
        note(frames.context, AXIS, place, what, joint.element.label)
    name = place.attributes.get("expressed_in", "").strip()
    if joint.source.before_frames:
        # Before SDF 1.5, axes are always in the frame of the model.
        name = MODEL_FRAME if joint.source.version < (1, 5) or flag_in(axis, "use_parent_model_frame") else ""
    if not name:
        return x, y, z
    rotation = frames.between(joint, frames.lookup(joint, name, place)).rotation
    return Transform(rotation=rotation).apply((x, y, z))


def _limits(joint: Frame, axis: Element | None, continuous: bool, context: FileContext) -> JointLimits:
    limit = axis.first("limit") if axis is not None else None
    if limit is None:
        return JointLimits()
    low, high = (_bound(limit, tag, sign * math.inf) for tag, sign in (("lower", -1), ("upper", 1)))
    position: tuple[float, float] | None = None
    if low > high:
        what = f"the lower limit {low:g} is above the upper limit {high:g}; both are omitted"
        note(context, LIMIT, limit, what, joint.element.label)
    elif not continuous and math.isfinite(low) and math.isfinite(high):
        position = (low, high)
    speed, torque = (_magnitude(limit, tag, joint, context) for tag in ("velocity", "effort"))
    return JointLimits(position=position, speed=speed, torque=torque)


def _bound(limit: Element, tag: str, default: float) -> float:
    value = unbounded_number_in(limit, tag, default)
    return value if abs(value) < UNLIMITED else math.copysign(math.inf, value)


def _magnitude(limit: Element, tag: str, joint: Frame, context: FileContext) -> float | None:
    """A limit of speed or torque; ``None`` for absent, infinite and negative values and for zero."""
    value = _bound(limit, tag, math.inf)
    if value == 0:
        what = f"the {tag} limit is 0, with which the joint cannot move; it is omitted"
        note(context, LIMIT, limit, what, joint.element.label)
    return value if math.isfinite(value) and value > 0 else None


def motor_of(joint: Frame, axis: Element | None, context: FileContext) -> Motor | None:
    """The motor that gives a joint the friction of ``<dynamics>``: ``tau = damping qd + friction sign(qd)``.

    Rotor and gear are read from Drake's elements ``drake:rotor_inertia`` and ``drake:gear_ratio``. Findings
    name friction that accelerates the joint.
    """
    if axis is None:
        return None
    rotor = number_in(joint.element, "drake:rotor_inertia", 0.0)
    gear = number_in(joint.element, "drake:gear_ratio", 1.0)
    if rotor < 0 or gear == 0:
        what = f"rotor inertia {rotor:g} and gear ratio {gear:g} are omitted"
        note(context, DAMPING, joint.element, what)
        rotor, gear = 0.0, 1.0
    damping, friction = _friction(joint, axis.first("dynamics"), context)
    if damping == friction == rotor == 0 and gear == 1:
        return None
    # Motor friction is multiplied by G² (viscous) and |G| (Coulomb).
    Tc = friction / abs(gear)
    B = damping / (gear * gear)
    return Motor(inertia=rotor, gear_ratio=gear, viscous_friction=B, coulomb_friction=(Tc, -Tc))


def spring_of(joint: Frame, tag: str, link: str, context: FileContext) -> JointSpring | None:
    """The spring of an axis of a joint, at the joint of a link of the robot."""
    axis = joint.element.first(tag)
    dynamics = axis.first("dynamics") if axis is not None else None
    if dynamics is None:
        return None
    stiffness = number_in(dynamics, "spring_stiffness", 0.0)
    if stiffness < 0.0:
        what = f"the spring with the stiffness {stiffness:g} is omitted"
        note(context, SPRING, dynamics, what, joint.element.label)
    if stiffness <= 0.0:
        return None
    rest = number_in(dynamics, "spring_reference", 0.0)
    return JointSpring(name=f"{link} spring", joint=link, stiffness=stiffness, rest=rest)


def _friction(joint: Frame, dynamics: Element | None, context: FileContext) -> tuple[float, float]:
    """Damping and friction at the joint."""
    if dynamics is None:
        return 0.0, 0.0
    damping, friction = number_in(dynamics, "damping", 0.0), number_in(dynamics, "friction", 0.0)
    if damping < 0 or friction < 0:
        what = f"damping {damping:g} and friction {friction:g} would accelerate the joint; they are omitted"
        note(context, DAMPING, dynamics, what, joint.element.label)
        return 0.0, 0.0
    return damping, friction
