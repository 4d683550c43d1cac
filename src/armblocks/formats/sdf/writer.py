"""SDF text of a robot.

The link of an SDF file has the same frame as the link of armblocks: the pose of the joint in the parent is
``before motion(offset)``, and the pose of the link in the joint is ``after``. The base of the robot is the
pose of the model. The pose of the tool becomes a last link, so that ``fkine`` stays the same.

Motors have the elements ``drake:rotor_inertia`` and ``drake:gear_ratio`` of Drake; SDF itself has none.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from xml.sax.saxutils import escape

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import FormatError
from armblocks.formats.file_findings import FileContext
from armblocks.formats.robot_writing import (
    Mimic,
    check_joint,
    file_names,
    frame_names,
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
from armblocks.formats.sdf.reader import read_sdf
from armblocks.formats.spring_writing import joint_springs, line_springs, warn_of_springs
from armblocks.robot import (
    Closure,
    Fixed,
    Joint,
    Link,
    Prismatic,
    PrismaticClosure,
    Revolute,
    RevoluteClosure,
    Robot,
    Screw,
    Spherical,
    SphericalClosure,
    UniversalClosure,
    WeldClosure,
)
from armblocks.robot.constraints import Distance, NoDisplacement, Perpendicular
from armblocks.robot.geometry import link_frames
from armblocks.robot.robot import STANDARD_GRAVITY
from armblocks.robot.shapes import Box, Cylinder, Shape, Sphere
from armblocks.spatial import Transform

_KINDS: Mapping[type[Joint], str] = {
    Revolute: "revolute",
    Prismatic: "prismatic",
    Fixed: "fixed",
    Screw: "screw",
    Spherical: "ball",
}
_CLOSURES: Mapping[type[Closure], str] = {
    RevoluteClosure: "continuous",
    PrismaticClosure: "prismatic",
    SphericalClosure: "ball",
    WeldClosure: "fixed",
    UniversalClosure: "universal",
}
_VERSION = "1.9"
_DRAKE = "http://drake.mit.edu"


def write_sdf(robot: Robot) -> bytes:
    """The SDF of a robot. Reading it gives the same kinematics and dynamics up to rounding.

    A robot with another gravity than -9.81 m/s2 along z is written as the model of a world with this gravity.

    Raises ``FormatError`` for constraints and joint types that SDF does not have, and for loops that are not
    closed with all joints at zero. Warns of data that SDF does not have: the tip and the order of the
    coordinates of some trees, Coulomb friction that depends on the direction, friction that accelerates a
    joint, meshes and housings, named configurations, names that SDF reserves.
    """
    mimics = mimics_of(robot, "SDF", tuple(_CLOSURES))
    warn_of_configurations(robot, "SDF")
    warn_of_shapes(robot, (Box, Cylinder, Sphere), "SDF")
    names = file_names(robot, _is_reserved, "SDF")
    used = set(names.values()) | {link.name for link in robot.links}
    frames = frame_names(robot, _is_reserved, "SDF", used)
    lines = [f"<model name={quoted(robot.name or 'robot', robot)}>"]
    if not robot.base.is_identity:
        lines.append(f"  {_pose(robot.base)}")
    joints = {link.name: free_name(f"{names[link.name]}_joint", used) for link in robot.links}
    for link in robot.links:
        lines += _link_lines(robot, link, names, joints[link.name])
        lines += _joint_lines(robot, link, names, joints, mimics.get(link.name))
    for closure in robot.closures:
        lines += _closure_lines(robot, closure, names, free_name(closure.name, used))
    tip = names[robot.links[-1].name]
    if not robot.tool.is_identity:
        tip, last = free_name("tool", used), tip
        lines += _tool_lines(robot, last, tip, free_name(f"{tip}_joint", used))
    for frame in robot.frames:
        if frame.link is None:
            where = f"robot '{robot.name}', frame '{frame.name}'"
            warn_of_loss(where, "frames on the base are not part of the SDF file")
        else:
            name = quoted(frames[frame.name], robot)
            at = quoted(names[frame.link], robot)
            lines.append(f"  <frame name={name} attached_to={at}>{_pose(frame.pose)}</frame>")
    lines.append("</model>")
    warn_of_springs(robot, [spring.name for spring in line_springs(robot)], "SDF")
    if not np.allclose(robot.gravity, STANDARD_GRAVITY, rtol=1e-15, atol=0.0):
        gravity = f"  <gravity>{numbers(robot.gravity)}</gravity>"
        lines = ['<world name="world">', gravity, *(f"  {line}" for line in lines), "</world>"]
    head = f'<?xml version="1.0"?>\n<sdf version="{_VERSION}" xmlns:drake="{_DRAKE}">\n'
    data = (head + "\n".join(f"  {line}" for line in lines) + "\n</sdf>\n").encode()
    (copy,) = read_sdf(data, "robot.sdf", FileContext()).values()
    warn_of_order(robot, tip, copy, "SDF")
    return data


def _is_reserved(name: str) -> bool:
    is_private = name.startswith("__") and name.endswith("__")
    return name == "world" or "::" in name or name != name.strip() or is_private


def _link_lines(robot: Robot, link: Link, names: Mapping[str | None, str], joint: str) -> list[str]:
    """The link. Without mass it has the mass 0, because the default of SDF is 1 kg."""
    lines = [f"  <link name={quoted(names[link.name], robot)}>", f"    {_pose(link.after, joint, robot)}"]
    centre, values = inertial_in(link, Transform()) or ((0.0,) * 3, (0.0,) * 6)
    keys = ("ixx", "iyy", "izz", "ixy", "iyz", "ixz")
    moments = "".join(f"<{key}>{value!r}</{key}>" for key, value in zip(keys, values))
    lines += [
        "    <inertial>",
        f"      <pose>{numbers([*centre, 0.0, 0.0, 0.0])}</pose>",
        f"      <mass>{link.mass!r}</mass>",
        f"      <inertia>{moments}</inertia>",
        "    </inertial>",
    ]
    for number, shape in enumerate(link.geometry or ()):
        geometry = _geometry(shape)
        if geometry:
            pose = _pose(Transform.from_matrix(np.array(shape.pose)))
            lines.append(f'    <visual name="visual_{number}">{pose}<geometry>{geometry}</geometry></visual>')
    return [*lines, "  </link>"]


def _geometry(shape: Shape) -> str:
    """The element of a shape; empty for shapes that SDF does not have."""
    match shape:
        case Box():
            return f"<box><size>{numbers(shape.size)}</size></box>"
        case Cylinder():
            return f"<cylinder><radius>{shape.radius!r}</radius><length>{shape.length!r}</length></cylinder>"
        case Sphere():
            return f"<sphere><radius>{shape.radius!r}</radius></sphere>"
        case _:
            return ""


def _joint_lines(
    robot: Robot,
    link: Link,
    names: Mapping[str | None, str],
    joints: Mapping[str, str],
    mimic: Mimic | None,
) -> list[str]:
    name = joints[link.name]
    check_joint(robot, link, _KINDS, "SDF")
    joint = link.joint
    kind = _KINDS[type(joint)]
    if isinstance(joint, Revolute) and limits_of(link).position is None:
        kind = "continuous"
    before = link.before @ joint.motion(joint.neutral)
    parent = "world" if link.parent is None else names[link.parent]
    lines = [
        f'  <joint name={quoted(name, robot)} type="{kind}">',
        f"    {_pose(before, '__model__' if link.parent is None else parent, robot)}",
        f"    <parent>{escape(parent)}</parent>",
        f"    <child>{escape(names[link.name])}</child>",
    ]
    if isinstance(joint, Screw):
        lines.append(f"    <screw_thread_pitch>{joint.pitch!r}</screw_thread_pitch>")
    if isinstance(joint, Spherical) and link.motor is not None:
        what = "friction and rotor inertia of its ball joint are not part of the SDF file"
        warn_of_loss(f"robot '{robot.name}', link '{link.name}'", what)
    if joint.nv == 1:
        lines += ["    <axis>", f"      <xyz>{numbers(joint.axis)}</xyz>"]
        lines += [f"      {line}" for line in (_limit(link), _dynamics(robot, link)) if line]
        if mimic is not None:
            leader = quoted(joints[mimic.leader], robot)
            coefficients = f"<multiplier>{mimic.multiplier!r}</multiplier><offset>{mimic.offset!r}</offset>"
            lines.append(f"      <mimic joint={leader}>{coefficients}<reference>0</reference></mimic>")
        lines.append("    </axis>")
        motor = link.motor
        if motor is not None and (motor.gear_ratio, motor.inertia) != (1.0, 0.0):
            lines.append(f"    <drake:rotor_inertia>{motor.inertia!r}</drake:rotor_inertia>")
            lines.append(f"    <drake:gear_ratio>{motor.gear_ratio!r}</drake:gear_ratio>")
    return [*lines, "  </joint>"]


def _closure_lines(robot: Robot, closure: Closure, names: Mapping[str | None, str], name: str) -> list[str]:
    """The joint that closes a loop, at the frame of its child."""
    tree = replace(robot, constraints=())
    rows = link_frames(tree, tree.neutral.tolist())
    index = {None: 0, **{link.name: k for k, link in enumerate(robot.links, start=1)}}
    a, b = (rows[index[end.link]] @ end.pose.matrix for end in (closure.first, closure.second))
    check_closed(robot, closure, a, b)
    parent, child = ("world" if link is None else names[link] for link in closure.links)
    lines = [
        f'  <joint name={quoted(name, robot)} type="{_CLOSURES[type(closure)]}">',
        f"    {_pose(closure.second.pose, '__model__' if closure.second.link is None else child, robot)}",
        f"    <parent>{escape(parent)}</parent>",
        f"    <child>{escape(child)}</child>",
    ]
    if isinstance(closure, UniversalClosure):
        first = (b[:3, :3].T @ a[:3, 2]).tolist()
        lines.append(f"    <axis><xyz>{numbers(first)}</xyz></axis><axis2><xyz>0 1 0</xyz></axis2>")
    elif isinstance(closure, RevoluteClosure | PrismaticClosure):
        lines.append("    <axis><xyz>0 0 1</xyz></axis>")
    return [*lines, "  </joint>"]


def check_closed(robot: Robot, closure: Closure, a: NDArray[np.float64], b: NDArray[np.float64]) -> None:
    """Raise ``FormatError`` unless a closure is closed with all joints at zero.

    SDF defines both frames of a joint by this configuration. ``a`` and ``b`` (4, 4): the poses of the frames.
    """
    for relation in closure.relations:
        match relation:
            case NoDisplacement(axis):
                gap = a[:3, axis] @ (b[:3, 3] - a[:3, 3])
            case Perpendicular(first, second):
                gap = a[:3, first] @ b[:3, second]
            case Distance(length):
                gap = np.linalg.norm(b[:3, 3] - a[:3, 3]) - length
        reverse = any(a[:3, axis] @ b[:3, axis] < 0.0 for axis in closure.parallel_axes)
        if reverse or abs(float(gap)) > 1e-9:
            raise FormatError(
                f"constraint '{closure.name}' is not satisfied with all joints at zero",
                where=f"robot '{robot.name}'",
                allowed="closures that are satisfied at zero, where SDF defines the frames of joints",
                fix="add the coordinates of arm.assemble() to the joint offsets, or save a .json file",
            )


def _tool_lines(robot: Robot, last: str, tool: str, joint: str) -> list[str]:
    """A link without mass at the pose of the tool."""
    zero = "".join(f"<{key}>0</{key}>" for key in ("ixx", "iyy", "izz"))
    return [
        f'  <link name="{tool}">',
        f"    {_pose(robot.tool, last, robot)}",
        f"    <inertial><mass>0</mass><inertia>{zero}</inertia></inertial>",
        "  </link>",
        f'  <joint name="{joint}" type="fixed">',
        f"    <parent>{escape(last)}</parent>",
        f"    <child>{tool}</child>",
        "  </joint>",
    ]


def _limit(link: Link) -> str:
    limits = limits_of(link)
    low, high = limits.position or (None, None)
    values = {"lower": low, "upper": high, "effort": limits.torque, "velocity": limits.speed}
    inner = "".join(f"<{key}>{value!r}</{key}>" for key, value in values.items() if value is not None)
    return f"<limit>{inner}</limit>" if inner else ""


def _dynamics(robot: Robot, link: Link) -> str:
    damping, friction = joint_friction(robot, link, "SDF")
    spring = joint_springs(robot).get(link.name)
    if not damping and not friction and spring is None:
        return ""
    inner = f"<damping>{damping!r}</damping><friction>{friction!r}</friction>"
    if spring is not None:
        inner += f"<spring_reference>{spring.rest!r}</spring_reference>"
        inner += f"<spring_stiffness>{spring.stiffness!r}</spring_stiffness>"
    return f"<dynamics>{inner}</dynamics>"


def _pose(pose: Transform, frame: str = "", robot: Robot | None = None) -> str:
    relative = f" relative_to={quoted(frame, robot)}" if robot is not None else ""
    return f"<pose{relative}>{numbers([*pose.translation, *pose.rpy])}</pose>"
