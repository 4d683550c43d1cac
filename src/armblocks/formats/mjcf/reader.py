"""Robots from MJCF: the tree of the bodies of ``<worldbody>``.

A body with several joints becomes a series of links: a massless link for each joint except the last, with the
name of the joint, and then the link of the body, with the name of the body. A free body is at its initial
pose at the neutral coordinates. Key frames become named configurations. Shapes of the world itself are
surroundings and not part of the robot.

Source: MuJoCo documentation, *XML reference* and *Modeling* (versions 3.x).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import PurePath

from armblocks.errors import FormatError, RobotError
from armblocks.formats.file_findings import FileContext
from armblocks.formats.mjcf.equality import Parts, constraints_of
from armblocks.formats.mjcf.includes import with_includes
from armblocks.formats.mjcf.inertials import mass_properties
from armblocks.formats.mjcf.joints import actuated_joints, actuation_of, joint_of
from armblocks.formats.mjcf.keyframes import with_keyframes
from armblocks.formats.mjcf.meshes import MeshAssets
from armblocks.formats.mjcf.poses import pose_of
from armblocks.formats.mjcf.rules import NAME, STIFFNESS, UNREAD
from armblocks.formats.mjcf.settings import MAIN, Defaults, Settings, settings_of
from armblocks.formats.mjcf.shapes import Geom, drawn, geom_of, is_collision_only, site_pose
from armblocks.formats.mjcf.springs import (
    GivenSpring,
    line_springs,
    with_joint_springs,
)
from armblocks.formats.robot_writing import free_name
from armblocks.formats.xml_elements import Element, note, read_elements, shortened
from armblocks.robot import (
    Attachment,
    Closure,
    Constraint,
    Fixed,
    Free,
    Link,
    Motor,
    NamedFrame,
    Robot,
    Spring,
    deepest_tip,
    with_tip,
)
from armblocks.robot.checks import MAX_LINKS
from armblocks.robot.robot import STANDARD_GRAVITY
from armblocks.robot.shapes import Material, Shape
from armblocks.spatial import Transform, transl

_NOT_READ = ("replicate", "attach", "composite", "flexcomp", "plugin")
_FLAGS = ("constraint", "equality", "frictionloss", "limit", "damper")
"""Flags that disable parts of a model in MuJoCo; these parts are active in the robot."""
MAX_NAME = 200
"""Maximum number of characters of the name of a link."""


def read_mjcf(data: bytes, file: str, context: FileContext) -> Robot:
    """The robot of an MJCF file. ``file`` is its name in messages; findings are added to ``context``.

    Raises ``FormatError`` with file and line for XML that cannot be read, for numbers that are not finite,
    and for included files that cannot be read.
    """
    root = read_elements(data, file)
    if root.tag not in ("mujoco", "mujocoinclude"):
        raise root.error(
            f"the root element is <{shortened(root.tag)}>",
            allowed="<mujoco>: an MJCF file",
            fix="give a URDF file the suffix .urdf, and an SDF file .sdf",
        )
    root = with_includes(root, context)
    model = _Model(root, context)
    links = model.links()
    if not links:
        raise root.error(
            "the model has no bodies",
            allowed="<worldbody> with <body> elements",
            fix="load the file that includes this file",
        )
    name = root.attributes.get("model", "").strip() or PurePath(file).stem
    try:
        constraints = model.constraints(links)
        if any(isinstance(constraint, Closure) for constraint in constraints):
            links = model.with_motors(links)
        links, springs = model.with_springs(links)
        robot = Robot(
            name=name,
            links=tuple(links),
            gravity=_gravity(root),
            constraints=constraints,
            frames=model.frames(),
            springs=springs,
        )
        return with_tip(with_keyframes(robot, root, context), deepest_tip(links))
    except RobotError as error:
        raise FormatError(
            f"{error.where}: {error.what}", where=file, allowed=error.allowed, fix=error.fix
        ) from error


def _gravity(root: Element) -> tuple[float, float, float]:
    gravity = STANDARD_GRAVITY
    is_on = True
    for option in root.all("option"):
        gravity = option.vector("gravity", gravity)
        for flag in option.all("flag"):
            is_on = flag.attributes.get("gravity", "enable").strip() != "disable"
    return gravity if is_on else (0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class _Place:
    """The location of an element: the parent link, the pose of the enclosing frame, and the default class."""

    parent: str | None
    pose: Transform = field(default_factory=Transform)
    default_class: str = MAIN


@dataclass(kw_only=True)
class _Contents:
    """The elements of one body, including elements in its frames, with the pose of their frame in the
    body."""

    joints: list[tuple[Element, Transform]] = field(default_factory=list[tuple[Element, Transform]])
    geoms: list[Geom] = field(default_factory=list[Geom])
    bodies: list[tuple[Element, _Place]] = field(default_factory=list[tuple[Element, _Place]])
    sites: list[tuple[Element, Transform]] = field(default_factory=list[tuple[Element, Transform]])


class _Model:
    """The parts of the file that concern all bodies."""

    def __init__(self, root: Element, context: FileContext) -> None:
        self.root = root
        self.context = context
        self.settings: Settings = settings_of(root)
        self.defaults = Defaults(root)
        self.meshes = MeshAssets(root, self.defaults, self.settings, context)
        self.actuation = actuation_of(root, self.defaults, context)
        self.body_names = {body.attributes.get("name", "").strip() for body in _bodies(root)}
        self.names: set[str] = set()
        self.read_bodies: set[str] = set()
        self.has_shapes = False
        self.sites: dict[str, Attachment] = {}
        self.joints: dict[str, str] = {}
        self.given_springs: dict[str, GivenSpring] = {}
        self.rests: dict[str, float] = {}
        self._note_left_out()

    def links(self) -> list[Link]:
        """The links of all bodies, depth first."""
        links: list[Link] = []
        waiting: list[tuple[Element, _Place]] = []
        for world in reversed([*self.root.all("worldbody")]):
            default_class = world.attributes.get("childclass", MAIN)
            contents = self._contents(world, _Place(parent=None, default_class=default_class), shapes=False)
            self._add_sites(None, contents)
            waiting += reversed(contents.bodies)
        while waiting:
            body, place = waiting.pop()
            series, bodies = self._body(body, place)
            links += series
            if len(links) > MAX_LINKS:
                raise body.error(
                    "the model has too many bodies", allowed=f"at most {MAX_LINKS}", fix="split the model"
                )
            waiting += reversed(bodies)
        if not any(link.geometry for link in links) and not self.has_shapes:
            links = [replace(link, geometry=None) for link in links]
        total = sum(link.mass for link in links)
        if self.settings.total_mass is not None and total > 0:
            factor = self.settings.total_mass / total
            links = [_scaled(link, factor) for link in links]
        return links

    def _body(self, body: Element, place: _Place) -> tuple[list[Link], list[tuple[Element, _Place]]]:
        """The links of a body, and the bodies inside it."""
        default_class = body.attributes.get("childclass", place.default_class)
        pose = place.pose @ pose_of(body, self.settings)
        inside = self._contents(body, replace(place, pose=Transform(), default_class=default_class))
        name = self._free_name(body.attributes.get("name", ""), "body")
        given = body.attributes.get("name", "").strip()
        if given and given in self.read_bodies:
            what = f"there is another body of this name; this body is read as '{shortened(name)}'"
            note(self.context, NAME, body, what)
        self.read_bodies.add(given)
        self.context.lines[name] = body.line
        series: list[Link] = []
        parent, before, offset = place.parent, pose, transl(0.0, 0.0, 0.0)
        for index, (element, around) in enumerate(inside.joints):
            placed = joint_of(element, self.settings, self.actuation, self.context)
            at = transl(*around.apply(placed.position))
            joint = placed.joint
            if isinstance(joint, Free) and place.parent is not None:
                raise element.error(
                    "a body inside another body has a free joint",
                    allowed="free joints of bodies in the world",
                    fix="move the body into <worldbody>",
                )
            if "axis" in joint.parameters:
                joint = replace(joint, axis=Transform(rotation=around.rotation).apply(joint.axis))
            is_last = index == len(inside.joints) - 1
            link = name if is_last else self._free_name(element.attributes.get("name", ""), f"{name} joint")
            self.joints[element.attributes.get("name", "").strip()] = link
            self.rests[link] = placed.rest
            if placed.spring is not None:
                self.given_springs[link] = placed.spring
            series.append(
                Link(
                    name=link,
                    parent=parent,
                    joint=joint,
                    before=before @ at,
                    after=at.inverse(),
                    motor=placed.motor,
                    geometry=None if is_last else (),
                )
            )
            parent, before = link, offset
        if not series:
            series.append(Link(name=name, parent=parent, joint=Fixed(), before=before))
        self._add_sites(name, inside)
        properties = mass_properties(body, inside.geoms, self.settings, self.meshes, self.context)
        series[-1] = replace(
            series[-1],
            mass=properties.mass,
            centre_of_mass=properties.centre,
            inertia=properties.inertia,
            geometry=self._drawing(body, inside.geoms),
        )
        return series, [(child, replace(at, parent=name)) for child, at in inside.bodies]

    def _add_sites(self, link: str | None, contents: _Contents) -> None:
        """Add the named sites of a body, or of the world."""
        for element, pose in contents.sites:
            name = element.attributes.get("name", "").strip()[:MAX_NAME]
            if name and name not in self.sites:
                self.sites[name] = Attachment(link=link, pose=pose)

    def frames(self) -> tuple[NamedFrame, ...]:
        """The named sites as frames. A site with the name of a link gets another name."""
        used = set(self.names)
        return tuple(
            NamedFrame(name=free_name(name, used), link=site.link, pose=site.pose)
            for name, site in self.sites.items()
        )

    def constraints(self, links: list[Link]) -> tuple[Constraint, ...]:
        """The constraints of the section ``<equality>``."""
        offsets = {link.name: link.joint.offset for link in links if link.joint.nv == 1}
        bodies = [*_bodies(self.root)]
        parts = Parts(
            links=links,
            sites=self.sites,
            joints={name: (link, -offsets[link]) for name, link in self.joints.items() if link in offsets},
            mocap=frozenset(
                body.attributes.get("name", "").strip()
                for body in bodies
                if body.attributes.get("mocap", "").strip() == "true"
            ),
        )
        return constraints_of(self.root, self.defaults, parts, self.context)

    def with_springs(self, links: list[Link]) -> tuple[list[Link], tuple[Spring, ...]]:
        """The links with the damping of their springs, and the springs of joints and tendons."""
        driven = {name: link for name, link in self.joints.items() if name in self.actuation}
        damping = {link: self.actuation[name].damping for name, link in driven.items()}
        links, springs = with_joint_springs(links, self.given_springs, damping)
        lines = line_springs(self.root, self.defaults, links, self.sites, self.rests, self.context)
        used = {spring.name for spring in springs}
        return links, (*springs, *(replace(line, name=free_name(line.name, used)) for line in lines))

    def with_motors(self, links: list[Link]) -> list[Link]:
        """The links of a model with closed loops: the joints of actuators have motors.

        Inverse dynamics computes the torques of these joints.
        """
        driven = {self.joints.get(name) for name in actuated_joints(self.root, self.defaults)}
        return [
            replace(link, motor=Motor()) if link.name in driven and link.motor is None else link
            for link in links
        ]

    def _contents(self, element: Element, place: _Place, *, shapes: bool = True) -> _Contents:
        """The joints, shapes and bodies of a body or of the world; frames are replaced by their contents."""
        contents = _Contents()
        waiting = [(child, place) for child in reversed(element.children)]
        while waiting:
            child, at = waiting.pop()
            if child.tag == "frame":
                pose = at.pose @ pose_of(child, self.settings)
                default_class = child.attributes.get("childclass", at.default_class)
                inner = replace(at, pose=pose, default_class=default_class)
                waiting += [(grandchild, inner) for grandchild in reversed(child.children)]
            elif child.tag == "body":
                contents.bodies.append((child, at))
            elif child.tag in ("joint", "freejoint"):
                contents.joints.append((self.defaults.applied(child, at.default_class), at.pose))
            elif child.tag == "site":
                site = self.defaults.applied(child, at.default_class)
                contents.sites.append((site, at.pose @ site_pose(site, self.settings)))
            elif child.tag == "geom" and shapes:
                self.has_shapes = True
                geom = self.defaults.applied(child, at.default_class)
                contents.geoms.append(geom_of(geom, at.pose, self.settings))
            elif child.tag in _NOT_READ:
                note(self.context, UNREAD, child, f"the element <{child.tag}> is not read", element.label)
        return contents

    def _drawing(self, body: Element, geoms: list[Geom]) -> tuple[Shape, ...]:
        """The shapes of a body for drawings: collision shapes only where there are no others."""
        visible = [geom for geom in geoms if not is_collision_only(geom.element)] or geoms
        label, context = body.label, self.context
        return tuple(
            shape for geom in visible for shape in drawn(geom, self.meshes, label, context, Material.PAINT)
        )

    def _free_name(self, given_name: str, substitute: str) -> str:
        """The name of an element, or a new name if the element has none or its name is in use."""
        base = given_name.strip()[:MAX_NAME] or substitute
        name, number = base, 2
        is_body = substitute == "body" and given_name.strip() != ""
        while name in self.names or (name in self.body_names and not (is_body and name == base)):
            name, number = f"{base} {number}", number + 1
        self.names.add(name)
        return name

    def _note_left_out(self) -> None:
        """Findings for the parts of a model that a robot does not have."""
        for body in _bodies(self.root):
            if body.number("gravcomp", 0.0):
                note(self.context, STIFFNESS, body, "the gravity compensation of the body is omitted")
        for option in self.root.all("option"):
            for flag in option.all("flag"):
                off = [name for name in _FLAGS if flag.attributes.get(name, "").strip() == "disable"]
                if off:
                    what = f"the disabling of {', '.join(off)} is not read"
                    note(self.context, UNREAD, flag, what)
            if option.number("density", 0.0) or option.number("viscosity", 0.0):
                note(self.context, STIFFNESS, option, "the forces of the surrounding medium are omitted")


def _bodies(element: Element) -> Iterator[Element]:
    """All bodies inside an element."""
    for child in element.children:
        if child.tag == "body":
            yield child
        yield from _bodies(child)


def _scaled(link: Link, factor: float) -> Link:
    """The link with its mass and inertia multiplied by a factor."""
    rows = tuple(tuple(factor * value for value in row) for row in link.inertia)
    return replace(link, mass=factor * link.mass, inertia=rows)
