"""Robots from URDF: a tree of links.

The frame of a URDF link is the frame of its joint. Therefore ``before`` of a link is the origin of the joint
that carries it, and ``after`` is the identity; only a planar joint has another ``after``, if its axis is not
z. The root link is fixed to the base of the robot. Links are in depth-first order, the children of a link in
the order of the joints in the file, so that the coordinates of a chain are consecutive.

Source: wiki.ros.org/urdf/XML, versions 1.0 to 1.2.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import PurePath

from armblocks.errors import FormatError, RobotError, UnknownNameError
from armblocks.formats.file_findings import FileContext
from armblocks.formats.urdf.inertials import inertial_of
from armblocks.formats.urdf.joints import (
    PlacedJoint,
    Transmission,
    couplings_of,
    joint_of,
    motor_of,
    transmissions_of,
)
from armblocks.formats.urdf.names import free_joint_name
from armblocks.formats.urdf.rules import NAME, UNKNOWN
from armblocks.formats.urdf.shapes import shapes_of
from armblocks.formats.urdf.xacro_expansion import expanded, uses_xacro
from armblocks.formats.xml_elements import Element, note, read_elements, shortened
from armblocks.robot import Fixed, Link, Robot, deepest_tip, with_tip
from armblocks.robot.checks import MAX_LINKS
from armblocks.robot.shapes import Material
from armblocks.spatial import Transform

_KNOWN = {
    "robot": {"link", "joint", "material", "transmission", "gazebo", "sensor", "group", "plugin", "comment"},
    "link": {
        "inertial",
        "visual",
        "collision",
        "self_collision_checking",
        "contact",
        "audio_source",
        "sensor",
    },
    "joint": {
        *("origin", "parent", "child", "axis", "limit", "dynamics", "mimic", "calibration"),
        *("safety_controller", "hardwareInterface"),
    },
}
"""The elements in robot, link and joint that are read, or that describe neither kinematics nor dynamics."""


def read_urdf(data: bytes, file: str, context: FileContext) -> Robot:
    """The robot of a URDF file. ``file`` is its name in messages; findings are added to ``context``.

    Raises ``FormatError`` with file and line for XML that cannot be read, for numbers that are not finite,
    and for links that do not form one tree.
    """
    root = read_elements(data, file)
    return robot_of(expanded(data, file, context) if uses_xacro(root) else root, context)


def robot_of(root: Element, context: FileContext) -> Robot:
    """The robot of the element ``<robot>``."""
    if root.tag != "robot":
        raise root.error(
            f"the root element is <{shortened(root.tag)}>",
            allowed="<robot>: a URDF file",
            fix="check the format of the file; SDF and MJCF are not URDF",
        )
    _note_unknown(root, context)
    links = _named(root, "link", context)
    joints = _named(root, "joint", context)
    if not links:
        raise root.error("the robot has no links", allowed="<link name=…>", fix="add the links of the robot")
    if len(links) > MAX_LINKS:
        raise root.error(
            f"the robot has {len(links)} links", allowed=f"at most {MAX_LINKS}", fix="split the robot"
        )
    context.lines.update({name: element.line for name, element in links.items()})
    transmissions = transmissions_of(root, context)
    joint_links = {joint: _ends(joint, links) for joint in joints.values()}
    described: list[Link] = []
    for name, joint in _depth_first(root, links, joint_links):
        parent = joint_links[joint][0] if joint is not None else None
        described.append(_link(links[name], joint, parent, transmissions, context))
    if not any(element.first("visual") or element.first("collision") for element in links.values()):
        described = [replace(link, geometry=None) for link in described]
    name = root.attributes.get("name", "").strip() or PurePath(root.file).stem
    try:
        couplings = couplings_of(joints, joint_links, context)
        robot = Robot(name=name, links=tuple(described), constraints=couplings)
        return with_tip(robot, deepest_tip(described))
    except RobotError as error:
        raise FormatError(
            f"{error.where}: {error.what}", where=root.file, allowed=error.allowed, fix=error.fix
        ) from error


def _note_unknown(root: Element, context: FileContext) -> None:
    """Findings for misspelt elements. Elements with a prefix belong to other programs."""
    for element in (root, *root.all("link"), *root.all("joint")):
        for child in element.children:
            if child.tag not in _KNOWN[element.tag] and ":" not in child.tag:
                what = f"the element <{shortened(child.tag)}> is not read"
                note(context, UNKNOWN, child, what, element.label)


def _named(root: Element, tag: str, context: FileContext) -> dict[str, Element]:
    """The links or joints by name.

    A second joint of the same name gets another name, because no other element refers to it. A
    second link is ignored if it is equal to the first, and refused otherwise.
    """
    elements: dict[str, Element] = {}
    names = {element.attributes.get("name", "").strip() for element in root.all(tag)}
    for element in root.all(tag):
        name = element.required("name", "a name that is not empty")
        if name in elements:
            place = f"there is another {tag} of this name in line {elements[name].line}"
            if tag == "joint":
                new = free_joint_name(name, names)
                note(context, NAME, element, f"{place}; this element is read as '{shortened(new)}'")
                names.add(new)
                name = element.attributes["name"] = new
            elif _equal(element, elements[name]):
                note(context, NAME, element, f"{place} with the same content; this element is omitted")
                continue
            else:
                raise element.error(place, allowed="unique names", fix="rename one of them")
        elements[name] = element
    return elements


def _equal(a: Element, b: Element) -> bool:
    """Whether two elements have the same attributes, texts and children."""
    return (
        (a.tag, a.attributes, a.text, len(a.children)) == (b.tag, b.attributes, b.text, len(b.children))
    ) and all(_equal(child, other) for child, other in zip(a.children, b.children))


def _ends(joint: Element, links: Mapping[str, Element]) -> tuple[str, str]:
    """The names of the parent and the child link of a joint."""
    names: list[str] = []
    for tag in ("parent", "child"):
        end = joint.first(tag)
        if end is None:
            raise joint.error(
                f"the joint has no <{tag}>", allowed=f"<{tag} link=…>", fix=f"add the {tag} link"
            )
        name = end.required("link", "the name of a link")
        if name not in links:
            raise UnknownNameError("link", name, links, where=f"{end.file}:{end.line}, {joint.label}")
        names.append(name)
    return names[0], names[1]


def _depth_first(
    root: Element, links: Mapping[str, Element], ends: Mapping[Element, tuple[str, str]]
) -> Iterator[tuple[str, Element | None]]:
    """Each link with the joint that carries it, parents first. Raises ``FormatError`` if it is not a tree."""
    carrier: dict[str, Element] = {}
    children: dict[str, list[str]] = {}
    for joint, (parent, child) in ends.items():
        if child in carrier:
            other = carrier[child]
            raise joint.error(
                f"link '{shortened(child)}' is also the child of {other.label} in line {other.line}",
                allowed="each link is the child of at most one joint: closed loops are not supported",
                fix="remove one of the two joints",
            )
        carrier[child] = joint
        children.setdefault(parent, []).append(child)
    roots = [name for name in links if name not in carrier]
    if len(roots) > 1:
        raise root.error(
            f"{len(roots)} links have no parent: {', '.join(map(shortened, roots[:8]))}",
            allowed="one tree of links",
            fix="connect them by fixed joints",
        )
    order: list[tuple[str, Element | None]] = []
    waiting = roots[:]
    while waiting:
        name = waiting.pop()
        order.append((name, carrier.get(name)))
        waiting += reversed(children.get(name, []))
    if len(order) < len(links):
        reached = {name for name, _ in order}
        ring = _ring(next(name for name in links if name not in reached), ends, carrier)
        raise carrier[ring[0]].error(
            "links are each other's parents: " + " -> ".join(map(shortened, ring[:8])),
            allowed="one tree of links",
            fix="remove one of these joints",
        )
    return iter(order)


def _ring(name: str, ends: Mapping[Element, tuple[str, str]], carrier: Mapping[str, Element]) -> list[str]:
    """The names of the links on the cycle that the chain of parents of a link reaches."""
    path: dict[str, None] = {}
    while name not in path:
        path[name] = None
        name = ends[carrier[name]][0]
    names = list(path)
    return [*names[names.index(name) :], name]


def _link(
    element: Element,
    joint: Element | None,
    parent: str | None,
    transmissions: Mapping[str, Transmission],
    context: FileContext,
) -> Link:
    placed = joint_of(joint, context) if joint is not None else PlacedJoint(Fixed(), Transform())
    motor = None
    if joint is not None and placed.joint.moves:
        motor = motor_of(joint, transmissions.get(joint.attributes["name"].strip()), context)
    inertial = inertial_of(element, context)
    return Link(
        name=element.attributes["name"].strip(),
        parent=parent,
        joint=placed.joint,
        before=placed.before,
        after=placed.after,
        mass=inertial.mass,
        centre_of_mass=inertial.centre,
        inertia=inertial.inertia,
        motor=motor,
        geometry=shapes_of(element, context, Material.PAINT if joint is not None else Material.BASE),
    )
