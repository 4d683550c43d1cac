"""URDF text of a robot.

A URDF link has its frame on its joint, a link of armblocks anywhere on the body. Therefore the frame of the
URDF link is the joint frame ``before motion(q + offset)``; inertias, shapes and the joints of the children
are transformed by ``after``. The pose of the tool becomes a last link, so that ``fkine`` stays the same. The
pose of the base becomes the origin of the first joints, and offsets of coordinates a part of the origins.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from armblocks.errors import counted
from armblocks.formats.file_findings import FileContext
from armblocks.formats.robot_writing import (
    Mimic,
    check_joint,
    free_name,
    inertial_in,
    joint_friction,
    limits_of,
    mimics_of,
    numbers,
    quoted,
    warn_of_configurations,
    warn_of_loss,
    warn_of_order,
    warn_of_shapes,
)
from armblocks.formats.spring_writing import joint_springs, line_springs, warn_of_springs
from armblocks.formats.urdf.joints import UNLIMITED
from armblocks.formats.urdf.reader import read_urdf
from armblocks.robot import Fixed, Free, Joint, Link, Planar, Prismatic, Revolute, Robot
from armblocks.robot.robot import STANDARD_GRAVITY
from armblocks.robot.shapes import Box, Cylinder, Shape, Sphere
from armblocks.spatial import Transform

_KINDS: Mapping[type[Joint], str] = {
    Revolute: "revolute",
    Prismatic: "prismatic",
    Fixed: "fixed",
    Planar: "planar",
    Free: "floating",
}


def write_urdf(robot: Robot) -> bytes:
    """The URDF of a robot. Reading it gives the same kinematics and dynamics up to rounding.

    Raises ``FormatError`` for joint types and constraints that URDF does not have. Warns of data that URDF
    does not have: link frames that are not at the joint, another gravity, springs, named configurations, the
    tip and the order of the coordinates of some trees, Coulomb friction that depends on the direction,
    friction that accelerates a joint, meshes and housings.
    """
    if not np.allclose(robot.gravity, STANDARD_GRAVITY, rtol=1e-15, atol=0.0):
        what = f"gravity {robot.gravity} is not part of a URDF file, which is read with -9.81 along z"
        warn_of_loss(f"robot '{robot.name}'", what)
    if robot.frames:
        what = "named frames are not part of the URDF file; use fixed links for them"
        warn_of_loss(f"robot '{robot.name}'", what)
    warn_of_shapes(robot, (Box, Cylinder, Sphere), "URDF")
    springs = [*joint_springs(robot), *(spring.name for spring in line_springs(robot))]
    warn_of_springs(robot, springs, "URDF")
    mimics = mimics_of(robot, "URDF")
    names = {link.name for link in robot.links}
    root = free_name("base_link", names)
    own_root = _root_link(robot)
    parts = [f"<robot name={quoted(robot.name, robot)}>"]
    if own_root is None:
        parts.append(f'  <link name="{root}"/>')
    for link in robot.links:
        parts += _link_lines(robot, link)
        if link is not own_root:
            parts += _joint_lines(robot, link, root, mimics.get(link.name))
    _warn_of_frames(robot)
    warn_of_configurations(robot, "URDF")
    last = robot.links[-1]
    tip, end = last.name, last.after @ robot.tool
    if not end.is_identity:
        tip = tool = free_name("tool", names)
        parts.append(f'  <link name="{tool}"/>')
        parts.append(f'  <joint name="{tool}_joint" type="fixed">')
        parts += _ends(last.name, tool, robot)
        parts += [f"    {_origin(end)}", "  </joint>"]
    data = ('<?xml version="1.0"?>\n' + "\n".join([*parts, "</robot>"]) + "\n").encode()
    warn_of_order(robot, tip, read_urdf(data, "robot.urdf", FileContext()), "URDF")
    return data


def _warn_of_frames(robot: Robot) -> None:
    """Warn of links whose frames are not at their joints."""
    moved = [link.name for link in robot.links if not link.after.is_identity]
    if moved:
        count = counted(len(moved), "link frame is", "link frames are")
        what = f"{count} moved to the joint, as URDF requires: {', '.join(moved[:6])}"
        warn_of_loss(f"robot '{robot.name}'", what + (" …" if len(moved) > 6 else ""))


def _root_link(robot: Robot) -> Link | None:
    """The link that can be the root of the file: the only link at the base, fixed to it at its origin."""
    at_base = [link for link in robot.links if link.parent is None]
    fixed = len(at_base) == 1 and isinstance(at_base[0].joint, Fixed) and robot.base.is_identity
    return at_base[0] if fixed and at_base[0].before.is_identity and at_base[0].after.is_identity else None


def _link_lines(robot: Robot, link: Link) -> list[str]:
    name = quoted(link.name, robot)
    inner: list[str] = []
    inertial = inertial_in(link, link.after)
    if inertial is not None:
        (x, y, z), values = inertial
        keys = ("ixx", "iyy", "izz", "ixy", "iyz", "ixz")
        moments = " ".join(f'{key}="{value!r}"' for key, value in zip(keys, values))
        inner += [
            "    <inertial>",
            f"      {_origin(Transform(translation=(x, y, z)))}",
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
            return f'<box size="{numbers(shape.size)}"/>'
        case Cylinder():
            return f'<cylinder radius="{shape.radius!r}" length="{shape.length!r}"/>'
        case Sphere():
            return f'<sphere radius="{shape.radius!r}"/>'
        case _:
            return ""


def _joint_lines(robot: Robot, link: Link, root: str, mimic: Mimic | None) -> list[str]:
    check_joint(robot, link, _KINDS, "URDF")
    joint = link.joint
    parent = next((other for other in robot.links if other.name == link.parent), None)
    carried = robot.base if parent is None else parent.after
    origin = carried @ link.before @ joint.motion(joint.neutral)
    kind = _KINDS[type(joint)]
    if kind == "revolute" and joint.coordinate_limits[0].position is None:
        kind = "continuous"
    name = quoted(f"{link.name}_joint", robot)
    lines = [f'  <joint name={name} type="{kind}">', *_ends(link.parent or root, link.name, robot)]
    lines.append(f"    {_origin(origin)}")
    if joint.moves:
        axis = [] if kind == "floating" else [f'    <axis xyz="{numbers(joint.axis)}"/>']
        limit = [f"    {_limit(link)}"] if joint.nv == 1 else []
        lines += [*axis, *limit, *_dynamics(robot, link)]
    if mimic is not None:
        leader = quoted(f"{mimic.leader}_joint", robot)
        lines.append(
            f'    <mimic joint={leader} multiplier="{mimic.multiplier!r}" offset="{mimic.offset!r}"/>'
        )
    lines.append("  </joint>")
    motor = link.motor
    if joint.moves and motor is not None and (motor.gear_ratio, motor.inertia) != (1.0, 0.0):
        motor_name = quoted(f"{link.name}_motor", robot)
        lines += [
            f"  <transmission name={quoted(f'{link.name}_transmission', robot)}>",
            "    <type>transmission_interface/SimpleTransmission</type>",
            f"    <joint name={name}/>",
            f"    <actuator name={motor_name}><mechanicalReduction>{motor.gear_ratio!r}</mechanicalReduction>"
            f"<rotorInertia>{motor.inertia!r}</rotorInertia></actuator>",
            "  </transmission>",
        ]
    return lines


def _limit(link: Link) -> str:
    limits = limits_of(link)
    speed, torque = (UNLIMITED if value is None else value for value in (limits.speed, limits.torque))
    text = f'effort="{torque!r}" velocity="{speed!r}"'
    if limits.position is None and isinstance(link.joint, Revolute):
        return f"<limit {text}/>"
    low, high = limits.position or (-UNLIMITED, UNLIMITED)
    return f'<limit lower="{low!r}" upper="{high!r}" {text}/>'


def _dynamics(robot: Robot, link: Link) -> list[str]:
    """Damping and friction at the joint."""
    damping, friction = joint_friction(robot, link, "URDF")
    return [f'    <dynamics damping="{damping!r}" friction="{friction!r}"/>'] if damping or friction else []


def _ends(parent: str, child: str, robot: Robot) -> list[str]:
    return [f"    <parent link={quoted(parent, robot)}/>", f"    <child link={quoted(child, robot)}/>"]


def _origin(pose: Transform) -> str:
    return f'<origin xyz="{numbers(pose.translation)}" rpy="{numbers(pose.rpy)}"/>'
