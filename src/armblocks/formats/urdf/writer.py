"""URDF text of a robot.

A URDF link has its frame on its joint, a link of armblocks anywhere on the body. Therefore the frame of the
URDF link is the joint frame ``before motion(q + offset)``; inertias, shapes and the joints of the children
are transformed by ``after``. The pose of the tool becomes a last link, so that ``fkine`` stays the same. The
pose of the base becomes the origin of the first joints, and offsets of coordinates a part of the origins.
"""

from __future__ import annotations

import math
import re
import warnings
from xml.sax.saxutils import quoteattr

import numpy as np

from armblocks.errors import ArmblocksWarning, FormatError
from armblocks.formats.file_findings import FileContext
from armblocks.formats.urdf.joints import UNLIMITED
from armblocks.formats.urdf.reader import read_urdf
from armblocks.robot import Fixed, Link, Prismatic, Revolute, Robot, with_tip
from armblocks.robot.robot import STANDARD_GRAVITY
from armblocks.robot.shapes import Box, Cylinder, Shape, Sphere
from armblocks.spatial import Transform

_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def write_urdf(robot: Robot) -> bytes:
    """The URDF of a robot. Reading it gives the same kinematics and dynamics up to rounding.

    Raises ``FormatError`` for joints that are neither revolute, prismatic nor fixed. Warns of data that URDF
    does not have: another gravity, the tip and the order of the coordinates of some trees, Coulomb friction
    that depends on the direction, friction that accelerates.
    """
    where = f"robot '{robot.name}'"
    if not np.allclose(robot.gravity, STANDARD_GRAVITY):
        _warn(where, f"gravity {robot.gravity} is not part of a URDF file, which is read with -9.81 along z")
    names = {link.name for link in robot.links}
    root = _free("base_link", names)
    own_root = _root_link(robot)
    parts = [f"<robot name={_quoted(robot.name, where)}>"]
    if own_root is None:
        parts.append(f'  <link name="{root}"/>')
    for link in robot.links:
        parts += _link_lines(link, where)
        if link is not own_root:
            parts += _joint_lines(robot, link, root, where)
    last = robot.links[-1]
    tip, end = last.name, last.after @ robot.tool
    if not end.is_identity:
        tip = tool = _free("tool", names)
        parts.append(f'  <link name="{tool}"/>')
        parts.append(f'  <joint name="{tool}_joint" type="fixed">')
        parts += _ends(last.name, tool, where)
        parts += [f"    {_origin(end)}", "  </joint>"]
    data = ('<?xml version="1.0"?>\n' + "\n".join([*parts, "</robot>"]) + "\n").encode()
    _warn_of_order(robot, tip, data, where)
    return data


def _warn_of_order(robot: Robot, tip: str, data: bytes, where: str) -> None:
    """Warn if the robot of the file has another tip, or its coordinates in another order.

    URDF has no element for the tip or the order; :mod:`armblocks.formats.urdf.reader` defines both.
    """
    copy = read_urdf(data, "robot.urdf", FileContext())
    if copy.links[-1].name != tip:
        _warn(where, f"the tip is not part of a URDF file; load this one with tip={tip!r}")
        copy = with_tip(copy, tip)
    if copy.joint_names != robot.joint_names:
        order = ", ".join(copy.joint_names)
        _warn(where, f"the coordinates of the file are in another order: {order}")


def _root_link(robot: Robot) -> Link | None:
    """The link that can be the root of the file: the only link at the base, fixed to it at its origin."""
    at_base = [link for link in robot.links if link.parent is None]
    fixed = len(at_base) == 1 and isinstance(at_base[0].joint, Fixed) and robot.base.is_identity
    return at_base[0] if fixed and at_base[0].before.is_identity and at_base[0].after.is_identity else None


def _link_lines(link: Link, where: str) -> list[str]:
    name = _quoted(link.name, where)
    inner: list[str] = []
    if link.mass or any(map(any, link.inertia)):
        centre = link.after.apply(link.centre_of_mass)
        R = link.after.R
        moment = link.I if link.after.rotation == Transform().rotation else R @ link.I @ R.T
        entries = {"ixx": (0, 0), "iyy": (1, 1), "izz": (2, 2), "ixy": (0, 1), "iyz": (1, 2), "ixz": (0, 2)}
        moments = " ".join(f'{key}="{float(moment[place])!r}"' for key, place in entries.items())
        inner += [
            "    <inertial>",
            f"      {_origin(Transform(translation=centre))}",
            f'      <mass value="{link.mass!r}"/>',
            f"      <inertia {moments}/>",
            "    </inertial>",
        ]
    for shape in link.geometry or ():
        geometry = _geometry(shape)
        if geometry:
            pose = _origin(link.after @ Transform.from_matrix(np.array(shape.pose)))
            inner.append(f"    <visual>{pose}<geometry>{geometry}</geometry></visual>")
    return [f"  <link name={name}>", *inner, "  </link>"] if inner else [f"  <link name={name}/>"]


def _geometry(shape: Shape) -> str:
    """The element of a shape; empty for shapes that URDF does not have."""
    match shape:
        case Box():
            return f'<box size="{_numbers(shape.size)}"/>'
        case Cylinder():
            return f'<cylinder radius="{shape.radius!r}" length="{shape.length!r}"/>'
        case Sphere():
            return f'<sphere radius="{shape.radius!r}"/>'
        case _:
            return ""


def _joint_lines(robot: Robot, link: Link, root: str, where: str) -> list[str]:
    joint = link.joint
    if type(joint) not in (Revolute, Prismatic, Fixed):
        raise FormatError(
            f"the joint of link '{link.name}' is a {type(joint).__name__}, which URDF does not have",
            where=where,
            allowed="revolute, prismatic and fixed joints",
            fix="save the robot as .json",
        )
    parent = next((other for other in robot.links if other.name == link.parent), None)
    carried = robot.base if parent is None else parent.after
    origin = carried @ link.before @ joint.motion(joint.offset)
    kind = type(joint).__name__.lower()
    if kind == "revolute" and joint.limits.position is None:
        kind = "continuous"
    if not joint.moves:
        origin = carried @ link.before
    name = _quoted(f"{link.name}_joint", where)
    lines = [f'  <joint name={name} type="{kind}">', *_ends(link.parent or root, link.name, where)]
    lines.append(f"    {_origin(origin)}")
    if joint.moves:
        lines += [f'    <axis xyz="{_numbers(joint.axis)}"/>', f"    {_limit(link)}", *_dynamics(robot, link)]
    lines.append("  </joint>")
    motor = link.motor
    if joint.moves and motor is not None and (motor.gear_ratio, motor.inertia) != (1.0, 0.0):
        motor_name = _quoted(f"{link.name}_motor", where)
        lines += [
            f"  <transmission name={_quoted(f'{link.name}_transmission', where)}>",
            "    <type>transmission_interface/SimpleTransmission</type>",
            f"    <joint name={name}/>",
            f"    <actuator name={motor_name}><mechanicalReduction>{motor.gear_ratio!r}</mechanicalReduction>"
            f"<rotorInertia>{motor.inertia!r}</rotorInertia></actuator>",
            "  </transmission>",
        ]
    return lines


def _limit(link: Link) -> str:
    limits = link.joint.limits
    speed, torque = (UNLIMITED if value is None else value for value in (limits.speed, limits.torque))
    text = f'effort="{torque!r}" velocity="{speed!r}"'
    if limits.position is None and isinstance(link.joint, Revolute):
        return f"<limit {text}/>"
    low, high = limits.position or (-UNLIMITED, UNLIMITED)
    return f'<limit lower="{low!r}" upper="{high!r}" {text}/>'


def _dynamics(robot: Robot, link: Link) -> list[str]:
    """Damping and friction at the joint."""
    if link.motor is None:
        return []
    viscous, coulomb = robot.friction_model.factors(link.motor.gear_ratio)
    plus, minus = (coulomb * torque for torque in link.motor.coulomb_friction)
    damping, friction = viscous * link.motor.viscous_friction, (plus - minus) / 2
    place = f"robot '{robot.name}', link '{link.name}'"
    if not math.isclose(plus, -minus, rel_tol=1e-12, abs_tol=0.0):
        _warn(place, f"Coulomb friction {plus:g}, {minus:g} depends on the direction; the mean is written")
    if damping < 0 or friction < 0:
        _warn(place, "friction that accelerates the joint is not part of a URDF file")
        damping, friction = max(damping, 0.0), max(friction, 0.0)
    return [f'    <dynamics damping="{damping!r}" friction="{friction!r}"/>'] if damping or friction else []


def _ends(parent: str, child: str, where: str) -> list[str]:
    return [f"    <parent link={_quoted(parent, where)}/>", f"    <child link={_quoted(child, where)}/>"]


def _origin(pose: Transform) -> str:
    return f'<origin xyz="{_numbers(pose.translation)}" rpy="{_numbers(pose.rpy)}"/>'


def _numbers(values: tuple[float, ...]) -> str:
    return " ".join(repr(value + 0.0) for value in values)


def _quoted(name: str, where: str) -> str:
    if _NOT_XML.search(name):
        raise FormatError(
            f"the name {name!r} has characters that XML cannot contain",
            where=where,
            allowed="printable characters",
            fix="rename the link",
        )
    return quoteattr(name)


def _free(name: str, used: set[str]) -> str:
    """A name that no link has."""
    while name in used:
        name += "_"
    used.add(name)
    return name


def _warn(where: str, what: str) -> None:
    warnings.warn(f"{where}: {what}.", ArmblocksWarning, stacklevel=4)
