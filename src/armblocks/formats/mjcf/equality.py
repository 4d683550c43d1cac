"""Constraints ``<equality>`` of MJCF: ``connect``, ``weld`` and ``joint``.

MuJoCo's constraints are soft; constraints of a robot are exact. Frames that the file does not give are
computed from the initial configuration. Source: MuJoCo documentation, *XML reference*, *equality*.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from armblocks.formats.file_findings import FileContext
from armblocks.formats.mjcf.poses import of_quaternion
from armblocks.formats.mjcf.rules import EQUALITY
from armblocks.formats.mjcf.settings import Defaults, sections
from armblocks.formats.robot_rules import left_out_coupling
from armblocks.formats.robot_writing import free_name
from armblocks.formats.xml_elements import Element, note, shortened
from armblocks.robot import Attachment, Closure, Constraint, Coupling, Link, SphericalClosure, WeldClosure
from armblocks.robot.constraint_checks import MAX_CONSTRAINTS
from armblocks.robot.coordinate_map import remaining_coupling
from armblocks.spatial import Transform, matrix3, transl


@dataclass(frozen=True, kw_only=True)
class Parts:
    """The parts of a model that constraints refer to.

    ``links`` in an order in which parents precede their children; ``sites`` by name; ``joints``: the link and
    the initial coordinate of each hinge or slide, by name; ``mocap``: the bodies that the user moves.
    """

    links: Sequence[Link]
    sites: Mapping[str, Attachment]
    joints: Mapping[str, tuple[str, float]]
    mocap: frozenset[str]


def constraints_of(
    root: Element, defaults: Defaults, parts: Parts, context: FileContext
) -> tuple[Constraint, ...]:
    """The active constraints of a file; unsupported constraints become findings."""
    constraints: list[Constraint] = []
    used: set[str] = set()
    poses = _initial_poses(parts.links)
    for element in sections(root, "equality"):
        settings = defaults.applied(replace(element, tag="equality"))
        if settings.attributes.get("active", "true").strip() == "false":
            continue
        found = _constraint(element, parts, poses)
        if isinstance(found, str):
            note(context, EQUALITY, element, f"the constraint <{shortened(element.tag)}> is omitted: {found}")
            continue
        found = replace(found, name=free_name(found.name, used))
        if isinstance(found, Coupling):
            others = [other for other in constraints if isinstance(other, Coupling)]
            remaining = remaining_coupling([link for link in parts.links if link.joint.moves], others, found)
            if not isinstance(remaining, Coupling):
                note(context, EQUALITY, element, left_out_coupling(remaining))
                continue
            found = remaining
        if len(constraints) < MAX_CONSTRAINTS:
            constraints.append(found)
        else:
            note(context, EQUALITY, element, f"the model has more than {MAX_CONSTRAINTS} constraints")
    return tuple(constraints)


def _constraint(element: Element, parts: Parts, poses: Mapping[str | None, Transform]) -> Constraint | str:
    """The constraint of an element, or the reason why there is none."""
    match element.tag:
        case "joint":
            return _coupling(element, parts)
        case "connect" | "weld":
            return _closure(element, parts, poses)
        case _:
            return "only constraints of bodies and of two joints are supported"


def _coupling(element: Element, parts: Parts) -> Coupling | str:
    """``q1 - r1 = a0 + a1 (q2 - r2)`` with the initial coordinates r1 and r2."""
    names = [element.attributes.get(key, "").strip() for key in ("joint1", "joint2")]
    for name in names[: 2 if names[1] else 1]:
        if name not in parts.joints:
            return f"there is no hinge or slide named '{shortened(name)}'"
    a = [0.0, 1.0, 0.0, 0.0, 0.0]
    if "polycoef" in element.attributes:
        given = element.numbers("polycoef", range(1, 6))
        a[: len(given)] = given
    name = element.attributes.get("name", "").strip()
    first, r1 = parts.joints[names[0]]
    if not names[1] or (a[1] == 0.0 and not any(a[2:])):
        return Coupling(name=name or f"{names[0]} fixed", terms=((first, 1.0),), constant=r1 + a[0])
    if any(a[2:]):
        return "its polynomial is not linear"
    second, r2 = parts.joints[names[1]]
    if first == second:
        return "both joints are the same"
    constant = r1 + a[0] - a[1] * r2
    terms = ((first, 1.0), (second, -a[1]))
    return Coupling(name=name or f"{names[0]} follows {names[1]}", terms=terms, constant=constant)


def _closure(element: Element, parts: Parts, poses: Mapping[str | None, Transform]) -> Closure | str:
    """The closure of a ``weld`` or ``connect``, or the reason why there is none.

    ``connect`` is the coincidence of two points, and so is a ``weld`` whose ``torquescale`` is 0. A weld
    holds ``p1 + R1 relpos = p2 + R2 anchor`` and ``R1 relrot = R2``.
    """
    is_rigid = element.tag == "weld" and element.number("torquescale", 1.0) != 0.0
    kind = WeldClosure if is_rigid else SphericalClosure
    sites = [element.attributes.get(key, "").strip() for key in ("site1", "site2")]
    bodies = [element.attributes.get(key, "").strip() for key in ("body1", "body2")]
    name = element.attributes.get("name", "").strip()
    if any(sites):
        if not all(site in parts.sites for site in sites):
            return "a site does not exist"
        ends = [parts.sites[site] for site in sites]
        name = name or f"{element.tag} {sites[0]} {sites[1]}"
    else:
        if any(body in parts.mocap for body in bodies):
            return "one of the bodies is moved by the user (mocap)"
        links = [None if body in ("", "world") else body for body in bodies]
        if any(link not in poses for link in links):
            return "a body does not exist"
        between = poses[links[0]].inverse() @ poses[links[1]]  # pose of the second body in the first body
        anchor = transl(*element.vector("anchor", (0.0, 0.0, 0.0)))
        if element.tag == "weld":
            ends = [
                Attachment(link=links[0], pose=_given_pose(element) or between @ anchor),
                Attachment(link=links[1], pose=anchor),
            ]
        else:
            ends = [
                Attachment(link=links[0], pose=anchor),
                Attachment(link=links[1], pose=between.inverse() @ anchor),
            ]
        name = name or f"{element.tag} {bodies[0]} {bodies[1] or 'world'}"
    if ends[0].link == ends[1].link:
        return "both frames are on the same body"
    return kind(name=name, first=ends[0], second=ends[1])


def _given_pose(element: Element) -> Transform | None:
    """The relative pose of a weld. A zero quaternion gives None: the pose in the initial configuration."""
    if "relpose" not in element.attributes:
        return None
    x, y, z, *quaternion = element.numbers("relpose", (7,))
    if not any(quaternion):
        return None
    return Transform(rotation=matrix3(of_quaternion(element, quaternion)), translation=(x, y, z))


def _initial_poses(links: Sequence[Link]) -> dict[str | None, Transform]:
    """The poses of the world and of all links in the initial configuration."""
    poses: dict[str | None, Transform] = {None: Transform()}
    for link in links:
        poses[link.name] = poses[link.parent] @ link.before @ link.after
    return poses
