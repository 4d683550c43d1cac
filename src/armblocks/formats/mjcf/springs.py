"""Springs of MJCF: at joints, and as tendons between two sites.

The torque of a joint is ``-stiffness (q - springref)``. With ``springdamper`` stiffness and damping follow
from a time constant, a damping ratio and the inertia at the joint in the initial configuration, while the
other joints are free. A spatial tendon between two sites pulls them together with
``stiffness (L - springlength)``. Source: MuJoCo documentation, *XML reference*, *body/joint* and
*tendon/spatial*.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from armblocks.dynamics import trace_inertia
from armblocks.formats.file_findings import FileContext
from armblocks.formats.mjcf.rules import STIFFNESS, TENDON
from armblocks.formats.mjcf.settings import Defaults, sections
from armblocks.formats.robot_writing import free_name
from armblocks.formats.xml_elements import Element, note
from armblocks.robot import Attachment, JointSpring, LineSpring, Link, Motor, Robot, Spring
from armblocks.robot.springs import MAX_SPRINGS
from armblocks.spatial import Transform


class GivenSpring(NamedTuple):
    """The spring of a joint of the file; ``by_inertia``: its time constant (s) and damping ratio."""

    stiffness: float
    rest: float
    by_inertia: tuple[float, float] | None


def spring_of(element: Element, kind: str, unit: float, context: FileContext) -> GivenSpring | None:
    """The spring of a joint with its defaults; ``unit``: rad per unit of the file's angles.

    Unsupported springs become findings.
    """
    stiffness, *higher = _polynomial(element, "stiffness")
    time, ratio = (
        element.numbers("springdamper", (2,)) if "springdamper" in element.attributes else (0.0, 0.0)
    )
    if stiffness == 0.0 and not any(higher) and time == ratio == 0.0:
        return None
    if kind in ("ball", "free"):
        note(context, STIFFNESS, element, f"the spring of the {kind} joint is omitted")
        return None
    if any(higher):
        note(context, STIFFNESS, element, "the nonlinear part of the stiffness is omitted")
    by_inertia = (time, ratio) if time > 0.0 and ratio > 0.0 else None
    if by_inertia is None and (time or ratio):
        note(context, STIFFNESS, element, f"springdamper {time:g} {ratio:g} is omitted")
    if stiffness < 0.0:
        note(context, STIFFNESS, element, f"the stiffness {stiffness:g} is omitted")
        stiffness = 0.0
    if stiffness == 0.0 and by_inertia is None:
        return None
    return GivenSpring(stiffness, unit * element.number("springref", 0.0), by_inertia)


def _polynomial(element: Element, attribute: str) -> list[float]:
    return [*element.numbers(attribute, range(1, 9))] if attribute in element.attributes else [0.0]


def with_joint_springs(
    links: Sequence[Link], given: Mapping[str, GivenSpring], actuator_damping: Mapping[str, float]
) -> tuple[list[Link], list[Spring]]:
    """The links, with the damping of ``springdamper``, and the springs of their joints.

    ``given``: by the name of the link. ``actuator_damping``: the part of the damping at a joint that is
    independent of ``springdamper``.
    """
    springs: list[Spring] = []
    found = {link.name: link for link in links}
    inertias = _inertias(links) if any(spring.by_inertia for spring in given.values()) else {}
    used: set[str] = set()
    for name, spring in given.items():
        stiffness = spring.stiffness
        if spring.by_inertia is not None:
            time, ratio = spring.by_inertia
            inertia = inertias[name]
            stiffness = inertia / (time * time * ratio * ratio)
            motor = found[name].motor or Motor()
            damping = 2.0 * inertia / time + actuator_damping.get(name, 0.0)
            found[name] = replace(found[name], motor=replace(motor, viscous_friction=damping))
        title = free_name(f"{name} spring", used)
        springs.append(JointSpring(name=title, joint=name, stiffness=stiffness, rest=spring.rest))
    return list(found.values()), springs


def _inertias(links: Sequence[Link]) -> dict[str, float]:
    """The inertia at each joint with one coordinate while all other joints are free.

    It is computed in the initial configuration, as the inverse of the diagonal of the inverse inertia matrix.
    """
    robot = Robot(name="springs", links=tuple(links))
    q = [value for link in robot.moving_links for value in _initial_coordinates(link)]
    M = np.asarray(trace_inertia(robot).casadi_function()(np.array(q)).full()).reshape(robot.n, robot.n)
    diagonal = iter((1.0 / np.diag(np.linalg.pinv(M))).tolist())
    inertias: dict[str, float] = {}
    for link in robot.moving_links:
        inertias[link.name], *_ = (next(diagonal) for _ in range(link.joint.nv))
    return inertias


def _initial_coordinates(link: Link) -> tuple[float, ...]:
    """The coordinates of a joint in the initial configuration: ``ref``, which is minus the offset."""
    joint = link.joint
    return (-joint.offset,) if joint.nv == 1 else joint.neutral


def line_springs(
    root: Element,
    defaults: Defaults,
    links: Sequence[Link],
    sites: Mapping[str, Attachment],
    rests: Mapping[str, float],
    context: FileContext,
) -> list[Spring]:
    """The spatial tendons between two sites; a finding for the forces of other tendons.

    ``links``: parents before children. ``rests``: the coordinates of joints (``springref``) at which
    tendons have their default rest length, by the name of the link.
    """
    springs: list[Spring] = []
    used: set[str] = set()
    for own in sections(root, "tendon"):
        tendon = defaults.applied(replace(own, tag="tendon"))
        stiffness, *higher = _polynomial(tendon, "stiffness")
        others = [name for name in ("damping", "frictionloss", "armature") if any(_polynomial(tendon, name))]
        if not stiffness and not any(higher) and not others:
            continue
        ends = [child.attributes.get("site", "").strip() for child in own.children if child.tag == "site"]
        is_line = own.tag == "spatial" and len(own.children) == len(ends) == 2
        if not is_line or not all(end in sites for end in ends) or stiffness < 0.0 or any(higher):
            note(context, TENDON, own, "the forces of the tendon are omitted")
            continue
        if others:
            note(context, TENDON, own, f"the {', '.join(others)} of the tendon is omitted")
        first, second = (sites[end] for end in ends)
        lengths = tendon.numbers("springlength", range(1, 3)) if "springlength" in tendon.attributes else [-1]
        if min(lengths) != max(lengths):
            note(context, TENDON, own, "the forces of the tendon are omitted: its rest length is a range")
            continue
        if not stiffness or first.link == second.link or len(springs) >= MAX_SPRINGS:
            continue
        length = lengths[0] if lengths[0] >= 0.0 else _rest_length(links, first, second, rests)
        name = free_name(tendon.attributes.get("name", "").strip() or "tendon", used)
        springs.append(LineSpring(name=name, first=first, second=second, stiffness=stiffness, length=length))
    return springs


def _rest_length(
    links: Sequence[Link], first: Attachment, second: Attachment, rests: Mapping[str, float]
) -> float:
    """The distance of two sites where the springs of all joints are at rest."""
    poses: dict[str | None, Transform] = {None: Transform()}
    for link in links:
        q = (rests.get(link.name, 0.0),) if link.joint.nv == 1 else link.joint.neutral
        poses[link.name] = poses[link.parent] @ link.pose(q)
    a, b = (poses[end.link].apply(end.pose.translation) for end in (first, second))
    return float(np.linalg.norm(np.subtract(a, b)))
