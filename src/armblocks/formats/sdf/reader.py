"""Robots from SDF: every model of a file or world is a robot.

The frame of an SDF link can be anywhere on the link. With the joint's frame J, parent P and child C, the
pose of the child is ``T_PC(q) = T_PJ motion(q) T_JC``; ``before`` of the link is ``T_PJ``, ``after`` is
``T_JC``, both in the initial configuration of the file, in which all coordinates are zero. Where the child of
a joint carries its parent, the joint is read in the opposite direction: ``T_CP(q) = T_CJ motion(-q) T_JP``.

Links that are joined to the world are children of the base. The base is the frame of the model; its pose is
the pose of the model in the world. A model without a joint to the world has a root link, which is fixed to
the base: the first link that is not the child of a joint. Links are in depth-first order, the children of a
link in the order of the joints in the file.

Source: sdformat.org/spec, versions 1.4 to 1.12.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

from armblocks.errors import ArmblocksError, FormatError, RobotError
from armblocks.formats.file_findings import FileContext
from armblocks.formats.robot_writing import free_name
from armblocks.formats.sdf.constraints import Coordinate, closure_of, couplings_of
from armblocks.formats.sdf.frames import WORLD, Frame, Frames, Scope
from armblocks.formats.sdf.inertials import inertial_of
from armblocks.formats.sdf.joints import AXES, GEARBOX, joint_type_of, joints_of, spring_of
from armblocks.formats.sdf.models import Models, source_of
from armblocks.formats.sdf.rules import FRAME, FREE_LINK, GRAVITY, UNKNOWN
from armblocks.formats.sdf.shapes import shapes_of
from armblocks.formats.sdf.values import is_true, text_in
from armblocks.formats.xml_elements import Element, note, read_elements, shortened
from armblocks.robot import Fixed, Link, NamedFrame, Robot, deepest_tip, with_tip
from armblocks.robot.checks import MAX_LINKS
from armblocks.robot.named_frame import MAX_FRAMES
from armblocks.robot.shapes import Material
from armblocks.spatial import Transform, Vector3

_KNOWN = {
    "model": {
        *(
            "link",
            "joint",
            "frame",
            "model",
            "include",
            "pose",
            "static",
            "self_collide",
            "gripper",
            "plugin",
        ),
        *("allow_auto_disable", "enable_wind", "origin"),
    },
    "link": {
        *("inertial", "visual", "collision", "pose", "gravity", "enable_wind", "self_collide", "kinematic"),
        *(
            "must_be_base_link",
            "velocity_decay",
            "sensor",
            "projector",
            "audio_sink",
            "audio_source",
            "battery",
        ),
        *("light", "particle_emitter", "origin", "damping", "turnGravityOff", "plugin", "contact"),
    },
    "joint": {
        *("parent", "child", "pose", "axis", "axis2", "physics", "sensor", "gearbox_ratio", "thread_pitch"),
        *("gearbox_reference_body", "screw_thread_pitch", "origin", "plugin"),
    },
}
"""The elements that are read, or that describe neither kinematics nor dynamics."""


class Edge(NamedTuple):
    """A link, the joint and link that carry it; ``reverse``: it is read from child to parent."""

    link: Frame
    joint: Frame | None
    carrier: Frame | None
    reverse: bool


def read_sdf(data: bytes, file: str, context: FileContext) -> Mapping[str, Robot]:
    """The robots of an SDF file by the names of the models. ``file`` is its name in messages.

    Findings are added to ``context``, also for models of a world that cannot be read. Raises ``FormatError``
    with file and line for XML that cannot be read, and if no model can be read.
    """
    root = read_elements(data, file)
    source = source_of(root, context.folder)
    worlds = [*root.all("world")]
    robots: dict[str, Robot] = {}
    errors: list[ArmblocksError] = []
    for element in [root, *worlds]:
        models = Models(context)
        world = models.world(element, source)
        errors += models.errors
        for model in [frame for frame in world.names.values() if frame.kind == "model"]:
            try:
                if model.name in robots:
                    raise model.element.error("there is another model of this name", allowed="unique names")
                robots[model.name] = robot_of(model, world, context)
            except ArmblocksError as error:
                errors.append(error)
                if element.tag == "world":
                    models.refused(model.element, error)
    if errors and (not robots or not worlds):
        raise errors[0]
    if not robots:
        raise root.error("the file has no models", allowed="<model name=…>", fix="choose another file")
    return robots


def robot_of(model: Frame, world: Scope, context: FileContext) -> Robot:
    """The robot of a model."""
    scope = model.inner
    assert scope is not None
    frames = Frames(context)
    links = [*scope.frames("link")]
    if not links:
        raise model.element.error("the model has no links", allowed="<link name=…>", fix="add links")
    if len(links) > MAX_LINKS:
        raise model.element.error(
            f"the model has {len(links)} links", allowed=f"at most {MAX_LINKS}", fix="split the model"
        )
    joints = [*scope.frames("joint")]
    for element in (model.element, *(frame.element for frame in (*links, *joints))):
        _note_unknown(element, context)
    context.lines.update({link.name: link.element.line for link in links})
    used = {link.name for link in links}
    described: list[Link] = []
    edges, closing = _edges(links, joints, frames)
    coordinates: list[Coordinate] = []
    for edge in _depth_first(links, edges, frames):
        series = [*_links(edge, model, frames, used)]
        described += series
        if edge.joint is not None:
            tags = AXES[joint_type_of(edge.joint)]
            for link, tag in zip(series, tags[::-1] if edge.reverse else tags):
                at = Coordinate(
                    link=link.name, joint=edge.joint, tag=tag, carrier=edge.carrier, carried=edge.link
                )
                coordinates.append(at)
    closures = tuple(closure_of(joint, (parent, child), model, frames) for joint, parent, child in closing)
    springs = [spring_of(at.joint, at.tag, at.link, context) for at in coordinates]
    gearboxes = [joint for joint in joints if joint_type_of(joint) == GEARBOX]
    couplings = couplings_of(described, coordinates, gearboxes, frames)
    if not any(link.element.first("visual") or link.element.first("collision") for link in links):
        described = [replace(link, geometry=None) for link in described]
    named = _named_frames(model, scope, frames, used)
    base = frames.between(world.frame, model)
    gravity = _gravity(world.frame.element)
    try:
        robot = Robot(
            name=model.name,
            links=tuple(described),
            base=base,
            frames=named,
            constraints=(*closures, *couplings),
            springs=tuple(spring for spring in springs if spring is not None),
        )
        robot = robot if gravity is None else replace(robot, gravity=gravity)
        return with_tip(robot, deepest_tip(described))
    except RobotError as error:
        raise FormatError(
            f"{error.where}: {error.what}", where=model.element.where, allowed=error.allowed, fix=error.fix
        ) from error


def _named_frames(model: Frame, scope: Scope, frames: Frames, used: set[str]) -> tuple[NamedFrame, ...]:
    """The elements ``<frame>`` of a model. Adds a finding for each frame whose pose is not defined."""
    named: list[NamedFrame] = []
    for frame in [*scope.frames("frame")][:MAX_FRAMES]:
        try:
            body = frames.body(frame)
            fixed = body.kind == WORLD or body.scope.fixed
            pose = frames.between(model if fixed else body, frame)
        except ArmblocksError as error:
            note(frames.context, FRAME, frame.element, f"it is not read: {error.what}")
            continue
        name = free_name(frame.name, used)
        named.append(NamedFrame(name=name, link=None if fixed else body.name, pose=pose))
    return tuple(named)


def _note_unknown(element: Element, context: FileContext) -> None:
    """Findings for misspelt elements. Elements with a prefix belong to other programs."""
    for child in element.children:
        if child.tag not in _KNOWN[element.tag] and ":" not in child.tag:
            note(context, UNKNOWN, child, f"the element <{shortened(child.tag)}> is not read", element.label)


def _gravity(world: Element) -> Vector3 | None:
    """The gravity of a world, m/s2, if the file gives it; before SDF 1.5 it is in ``<physics>``."""
    physics = world.first("physics")
    gravity = world.first("gravity") or (physics.first("gravity") if physics is not None else None)
    if gravity is None or not gravity.text:
        return None
    x, y, z = gravity.text_numbers(3)
    return x, y, z


Ends = tuple[Frame, Frame | None, Frame | None]
"""A joint with the links of its parent and child; ``None`` is the base."""


def _edges(links: list[Frame], joints: list[Frame], frames: Frames) -> tuple[list[Ends], list[Ends]]:
    """The joints of a spanning tree, and the joints that close its loops."""
    group: dict[Frame | None, Frame | None] = {link: link for link in (*links, None)}

    def leader(link: Frame | None) -> Frame | None:
        while group[link] is not link:
            group[link] = group[group[link]]
            link = group[link]
        return link

    edges: list[Ends] = []
    closing: list[Ends] = []
    for joint in joints:
        kind = joint_type_of(joint)
        parent, child = (_end(joint, tag, frames) for tag in ("parent", "child"))
        if joint.scope.fixed or kind == GEARBOX:
            continue
        a, b = leader(parent), leader(child)
        if a is b:
            if parent is child:
                raise joint.element.error(
                    "the joint connects a link with itself", allowed="two links", fix="correct its parent"
                )
            closing.append((joint, parent, child))
            continue
        group[b] = a
        edges.append((joint, parent, child))
    return edges, closing


def _end(joint: Frame, tag: str, frames: Frames) -> Frame | None:
    """The link at the parent or child of a joint; ``None`` for the world and for static models."""
    element = joint.element.first(tag)
    if element is None:
        raise joint.element.error(
            f"the joint has no <{tag}>", allowed=f"<{tag}>name of a link</{tag}>", fix=f"add the {tag} link"
        )
    name = element.text or element.required("link", "the name of a link")
    link = frames.body(frames.lookup(joint, name, element))
    return None if link.kind == WORLD or link.scope.fixed else link


def _depth_first(links: list[Frame], edges: list[Ends], frames: Frames) -> Iterator[Edge]:
    """Each link with the joint that carries it, carriers before their children."""
    at: dict[Frame | None, list[Edge]] = {}
    children: set[Frame | None] = set()
    for joint, parent, child in edges:
        children.add(child)
        if child is not None:
            at.setdefault(parent, []).append(Edge(child, joint, parent, False))
        if parent is not None:
            at.setdefault(child, []).append(Edge(parent, joint, child, True))
    reached: set[Frame] = set()
    roots = [Edge(link, None, None, False) for link in links if link.scope.fixed]
    grounded = bool(roots) or None in at
    waiting = [*reversed(at.get(None, [])), *reversed(roots)]
    free = iter([link for link in links if link not in children] + links)
    while True:
        while waiting:
            edge = waiting.pop()
            if edge.link in reached:
                continue
            reached.add(edge.link)
            yield edge
            waiting += [
                onward for onward in reversed(at.get(edge.link, [])) if onward.joint is not edge.joint
            ]
        root = next((link for link in free if link not in reached), None)
        if root is None:
            return
        if grounded:
            what = "no joint connects the link with the others; it is fixed to the base"
            note(frames.context, FREE_LINK, root.element, what)
        grounded = True
        waiting = [Edge(root, None, None, False)]


def _links(edge: Edge, model: Frame, frames: Frames, used: set[str]) -> Iterator[Link]:
    """The link of an edge; before it, for a joint with two axes, a massless link with the joint's name."""
    link, joint = edge.link, edge.joint
    carrier = edge.carrier or model
    parent = None if edge.carrier is None else edge.carrier.name
    series = joints_of(joint, frames, edge.reverse) if joint is not None else []
    if joint is None or not series:
        before, after, moving, motor = frames.between(carrier, link), Transform(), Fixed(), None
    else:
        before, after = frames.between(carrier, joint), frames.between(joint, link)
        for moving, motor in series[:-1]:
            name = joint.name
            while name in used:
                name += "_"
            used.add(name)
            yield Link(name=name, parent=parent, joint=moving, before=before, motor=motor, geometry=())
            before, parent = Transform(), name
        moving, motor = series[-1]
    moves = joint is not None and not link.scope.fixed
    inertial = inertial_of(link, frames, moves)
    if (
        moves
        and link.element.first("gravity") is not None
        and not is_true(link.element, text_in(link.element, "gravity"))
    ):
        note(
            frames.context,
            GRAVITY,
            link.element,
            "gravity is disabled for the link; in armblocks it acts on all links",
        )
    yield Link(
        name=link.name,
        parent=parent,
        joint=moving,
        before=before,
        after=after,
        mass=inertial.mass,
        centre_of_mass=inertial.centre,
        inertia=inertial.inertia,
        motor=motor,
        geometry=shapes_of(link, frames, Material.PAINT if moves else Material.BASE),
    )
