"""MJCF text of a robot.

A body has the frame of the link at the coordinate 0: its pose in the parent is ``before motion(offset)
after``, and its joint is at the pose ``after`` inverse in the body. MuJoCo does not accept moving bodies
without mass. A link without mass, inertia and shapes that only carries the joint of the next link therefore
becomes an additional joint of the body of that link. The pose of the base is included in the poses of the
first bodies. The tool becomes the last body, so that ``fkine`` does not change.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from armblocks.errors import FormatError
from armblocks.formats.file_findings import FileContext
from armblocks.formats.mjcf.equality_writing import CLOSURES, add_site, equality_lines, placed, tendon_lines
from armblocks.formats.mjcf.keyframes import key_lines
from armblocks.formats.mjcf.reader import MAX_NAME, read_mjcf
from armblocks.formats.robot_writing import (
    check_joint,
    file_names,
    free_name,
    inertial_in,
    joint_friction,
    limits_of,
    mimics_of,
    numbers,
    quoted,
    warn_of_loss,
    warn_of_order,
    warn_of_shapes,
)
from armblocks.formats.spring_writing import joint_springs, line_springs
from armblocks.formats.xml_elements import MAX_DEPTH
from armblocks.robot import Fixed, Free, Joint, Link, Prismatic, Revolute, Robot, Spherical
from armblocks.robot.shapes import Box, Cylinder, Mesh, Shape, Sphere
from armblocks.spatial import IDENTITY3, Transform

_KINDS: Mapping[type[Joint], str] = {
    Revolute: "hinge",
    Prismatic: "slide",
    Fixed: "",
    Spherical: "ball",
    Free: "free",
}
_MOST_JOINTS = 6
"""Maximum number of joints of a body in MuJoCo."""


@dataclass(kw_only=True)
class _Body:
    """A body of the file: the link, the series of joints that move it, and its pose in the parent body.

    ``joints``: for each joint its link, and the pose of the body in the frame of the joint.
    """

    link: Link
    pose: Transform
    joints: list[tuple[Link, Transform]] = field(default_factory=list[tuple[Link, Transform]])
    children: list[str] = field(default_factory=list[str])


def write_mjcf(robot: Robot) -> bytes:
    """The MJCF of a robot. Reading it gives the same kinematics and dynamics up to rounding.

    Raises ``FormatError`` for constraints and joint types that MJCF does not have, and for chains of bodies
    that exceed the maximum depth of XML files. A revolute closure becomes two coincident pairs of points.
    Warns of data that MJCF does not have: line springs with a constant force, gear ratios (rotor inertia and
    friction are written at the joint), speed limits, the tip and the order of the coordinates of some trees,
    Coulomb friction that depends on the direction, friction that accelerates a joint, housings. MuJoCo does
    not accept moving bodies without mass or with physically impossible inertias; they are written unchanged.
    """
    mimics = mimics_of(robot, "MJCF", CLOSURES)
    for link in robot.links:
        check_joint(robot, link, _KINDS, "MJCF")
        if link.joint.nq != link.joint.nv:
            _check_quaternions(robot, link)
    _warn_of_losses(robot)
    names = file_names(robot, _is_changed, "MJCF")
    meshes: list[str] = []
    bodies, roots = _bodies(robot)
    sites = _sites(robot)
    frames = {frame.name: frame for frame in robot.frames}
    equality = equality_lines(robot, mimics, names, frames, sites)
    tendons = tendon_lines(robot, frames, sites)
    lines = _nested(robot, bodies, roots, names, meshes, sites)
    head = [
        f"<mujoco model={quoted(robot.name or 'robot', robot)}>",
        '  <compiler angle="radian" inertiafromgeom="false" autolimits="true"/>',
        f'  <option gravity="{numbers(robot.gravity)}"/>',
    ]
    if meshes:
        head += ["  <asset>", *(f"    {mesh}" for mesh in meshes), "  </asset>"]
    tail = ["  <tendon>", *tendons, "  </tendon>"] if tendons else []
    tail += ["  <equality>", *equality, "  </equality>"] if equality else []
    if robot.configurations:
        proximal = {
            link.name: robot.base @ link.before for link in robot.links
        }  # of free joints, at the base
        keys = key_lines(robot, _joint_order(bodies, roots), proximal)
        tail += ["  <keyframe>", *(f"  {key}" for key in keys), "  </keyframe>"]
    text = "\n".join([*head, "  <worldbody>", *sites[None], *lines, "  </worldbody>", *tail, "</mujoco>"])
    data = f'<?xml version="1.0"?>\n{text}\n'.encode()
    tip = names[robot.links[-1].name] if robot.tool.is_identity else _tool_name(robot, names)
    warn_of_order(robot, tip, read_mjcf(data, "robot.xml", FileContext()), "MJCF")
    return data


def _is_changed(name: str) -> bool:
    """Whether the reader would rename a body with this name."""
    return name == "world" or name != name.strip() or len(name) > MAX_NAME


def _warn_of_losses(robot: Robot) -> None:
    where = f"robot '{robot.name}'"
    warn_of_shapes(robot, (Box, Cylinder, Sphere, Mesh), "MJCF")
    moving = [link for link in robot.links if link.joint.moves]
    if any(link.motor is not None and link.motor.gear_ratio != 1.0 for link in moving):
        warn_of_loss(
            where, "gear ratios are not part of an MJCF file; inertia and friction are converted to the joint"
        )
    if any(limits.speed is not None for limits in robot.limits):
        warn_of_loss(where, "speed limits are not part of an MJCF file")
    for link in moving:
        low, high = limits_of(link).position or (0.0, 1.0)
        if low == high:
            warn_of_loss(
                f"{where}, link '{link.name}'", f"a range of zero width, {low:g}, is not part of an MJCF file"
            )


def _check_quaternions(robot: Robot, link: Link) -> None:
    """Check that a ball or free joint has the same coordinates in the file, and warn otherwise."""
    where = f"robot '{robot.name}', link '{link.name}'"
    if isinstance(link.joint, Free) and link.parent is not None:
        raise FormatError(
            "the free joint is not at the base",
            where=where,
            allowed="free joints of links at the base only, as in MuJoCo",
            fix="save the robot as .json",
        )
    if link.after.rotation != IDENTITY3 or (isinstance(link.joint, Free) and not link.after.is_identity):
        warn_of_loss(
            where, "the coordinates of its joint are relative to the axes of the link in the MJCF file"
        )


def _tool_name(robot: Robot, names: Mapping[str | None, str]) -> str:
    used = {*names.values(), *(link.name for link in robot.links), *(frame.name for frame in robot.frames)}
    return free_name("tool", used)


def _sites(robot: Robot) -> dict[str | None, list[str]]:
    """The elements of the named frames, by their link; None is the world."""
    sites: dict[str | None, list[str]] = {None: []}
    for frame in robot.frames:
        add_site(robot, sites, frame)
    return sites


def _bodies(robot: Robot) -> tuple[dict[str, _Body], list[str]]:
    """The bodies by the name of the link, and the bodies at the base."""
    children: dict[str | None, list[Link]] = {}
    for link in robot.links:
        children.setdefault(link.parent, []).append(link)
    bodies: dict[str, _Body] = {}
    roots: list[str] = []
    series: dict[str, tuple[_Body, str | None]] = {}  # links that become joints of the next body
    waiting = list(reversed(children.get(None, [])))
    while waiting:
        link = waiting.pop()
        inside = children.get(link.name, [])
        pose = link.before @ link.joint.motion(link.joint.neutral)
        if link.parent in series:
            body, parent = series[link.parent]
        else:
            at_base = robot.base if link.parent is None else Transform()
            body, parent = _Body(link=link, pose=at_base), link.parent
        # The frame of the body moves to this link.
        step = pose @ link.after
        body.joints = [(carried, after @ step) for carried, after in body.joints]
        body.pose, body.link = body.pose @ step, link
        if link.joint.moves:
            body.joints.append((link, link.after))
        if _only_carries_a_joint(robot, link, inside) and len(body.joints) < _MOST_JOINTS:
            series[link.name] = body, parent
        else:
            bodies[link.name] = body
            (roots if parent is None else bodies[parent].children).append(link.name)
        waiting += reversed(inside)
    return bodies, roots


def _only_carries_a_joint(robot: Robot, link: Link, children: Sequence[Link]) -> bool:
    """Whether a link without mass and shapes only connects two joints."""
    return (
        len(children) == 1
        and children[0].joint.nv == 1
        and link.joint.nv == 1
        and inertial_in(link, Transform()) is None
        and not link.geometry
        and link is not robot.links[-1]
        and all(frame.link != link.name for frame in robot.frames)
        and all(link.name not in closure.links for closure in robot.closures)
        and all(link.name not in (spring.first.link, spring.second.link) for spring in line_springs(robot))
    )


def _nested(
    robot: Robot,
    bodies: Mapping[str, _Body],
    roots: Sequence[str],
    names: Mapping[str | None, str],
    meshes: list[str],
    sites: Mapping[str | None, list[str]],
) -> list[str]:
    """The lines of the nested bodies; the tool is the last body inside the body of the tip."""
    tip = robot.links[-1].name
    lines: list[str] = []
    waiting: list[tuple[str, int]] = [(name, 2) for name in reversed(roots)]
    while waiting:
        name, depth = waiting.pop()
        if depth > MAX_DEPTH - 2:
            raise FormatError(
                f"the chain of links up to '{name}' has more than {MAX_DEPTH - 3} bodies inside each other",
                where=f"robot '{robot.name}'",
                allowed=f"at most {MAX_DEPTH - 3}",
                fix="save the robot as .urdf, .sdf or .json",
            )
        indent = "  " * depth
        if not name:
            lines.append(f"{indent}</body>")
            continue
        body = bodies[name]
        lines += [f"{indent}{line}" for line in _body_lines(robot, body, names, meshes)]
        lines += [f"{indent}{line}" for line in sites.get(name, ())]
        if name == tip and not robot.tool.is_identity:
            tool = _tool_name(robot, names)
            lines.append(f"{indent}  <body name={quoted(tool, robot)} {placed(robot.tool)}/>")
        waiting.append(("", depth))
        waiting += [(child, depth + 1) for child in reversed(body.children)]
    return lines


def _joint_order(bodies: Mapping[str, _Body], roots: Sequence[str]) -> list[Link]:
    """The links with joints in the order of the file."""
    order: list[Link] = []
    waiting = list(reversed(roots))
    while waiting:
        body = bodies[waiting.pop()]
        order += [link for link, _ in body.joints]
        waiting += reversed(body.children)
    return order


def _body_lines(robot: Robot, body: _Body, names: Mapping[str | None, str], meshes: list[str]) -> list[str]:
    """The start tag of a body, its joints, inertia and shapes."""
    link = body.link
    lines = [f"<body name={quoted(names[link.name], robot)} {placed(body.pose)}>"]
    lines += [f"  {_joint(robot, carried, after, names)}" for carried, after in body.joints]
    inertial = inertial_in(link, Transform())
    if inertial is not None:
        centre, (xx, yy, zz, xy, yz, xz) = inertial
        lines.append(
            f'  <inertial pos="{numbers(centre)}" mass="{link.mass!r}" '
            f'fullinertia="{numbers((xx, yy, zz, xy, xz, yz))}"/>'
        )
    for shape in link.geometry or ():
        geometry = _geometry(shape, meshes)
        if geometry:
            pose = placed(Transform.from_matrix(np.array(shape.pose)))
            lines.append(f'  <geom {geometry} {pose} contype="0" conaffinity="0" group="1"/>')
    return lines


def _joint(robot: Robot, link: Link, after: Transform, names: Mapping[str | None, str]) -> str:
    """The joint of a link in a body; ``after``: the pose of the body in the frame of the joint."""
    joint, frame = link.joint, after.inverse()
    words = [f'<joint name={quoted(names[link.name], robot)} type="{_KINDS[type(joint)]}"']
    if not isinstance(joint, Free):
        words.append(f'pos="{numbers(frame.translation)}"')
    if "axis" in joint.parameters:
        axis = Transform(rotation=frame.rotation).apply(joint.axis)
        words.append(f'axis="{numbers(axis)}"')
    limits = limits_of(link)
    if limits.position is not None and limits.position[0] < limits.position[1]:
        words.append(f'range="{numbers(limits.position)}"')
    if limits.torque is not None:
        words.append(f'actuatorfrcrange="{numbers((-limits.torque, limits.torque))}"')
    damping, friction = joint_friction(robot, link, "MJCF")
    armature = link.motor.reflected_inertia if link.motor is not None else 0.0
    values = {"armature": armature, "damping": damping, "frictionloss": friction}
    words += [f'{key}="{value!r}"' for key, value in values.items() if value]
    spring = joint_springs(robot).get(link.name)
    if spring is not None:
        words.append(f'stiffness="{spring.stiffness!r}" springref="{spring.rest!r}"')
    return " ".join(words) + "/>"


def _geometry(shape: Shape, meshes: list[str]) -> str:
    """Type and size of a shape; a mesh is added to the assets. Empty for shapes that MJCF does not have."""
    match shape:
        case Box():
            return f'type="box" size="{numbers([length / 2 for length in shape.size])}"'
        case Cylinder():
            return f'type="cylinder" size="{numbers((shape.radius, shape.length / 2))}"'
        case Sphere():
            return f'type="sphere" size="{numbers((shape.radius,))}"'
        case Mesh():
            name = f"mesh_{len(meshes)}"
            vertices = numbers([value for vertex in shape.vertices for value in vertex])
            faces = " ".join(str(index) for face in shape.faces for index in face)
            meshes.append(f'<mesh name="{name}" inertia="shell" vertex="{vertices}" face="{faces}"/>')
            return f'type="mesh" mesh="{name}"'
        case _:
            return ""
