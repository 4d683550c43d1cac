"""Constraints of SDF models: joints that close loops, ``<mimic>``, and gearboxes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from armblocks.errors import UnknownNameError
from armblocks.formats.robot_rules import left_out_coupling
from armblocks.formats.robot_writing import free_name
from armblocks.formats.sdf.frames import Frame, Frames
from armblocks.formats.sdf.joints import AXES, direction_of, joint_type_of
from armblocks.formats.sdf.rules import CLOSURE, COUPLING
from armblocks.formats.sdf.values import number_in, text_in
from armblocks.formats.xml_elements import Element, note, shortened
from armblocks.robot import (
    Attachment,
    Closure,
    Constraint,
    Coupling,
    Link,
    PrismaticClosure,
    RevoluteClosure,
    SphericalClosure,
    UniversalClosure,
    WeldClosure,
)
from armblocks.robot.coordinate_map import remaining_coupling
from armblocks.spatial import Transform, Vector3

_CLOSURES: Mapping[str, type[Closure]] = {
    "revolute": RevoluteClosure,
    "continuous": RevoluteClosure,
    "prismatic": PrismaticClosure,
    "ball": SphericalClosure,
    "fixed": WeldClosure,
    "universal": UniversalClosure,
}


@dataclass(frozen=True, kw_only=True)
class Coordinate:
    """The coordinate of an axis of a joint: the coordinate of the robot's ``link``.

    ``joint``, ``tag``: the joint of the file and its axis. ``carrier``, ``carried``: the links on both sides
    of the joint, from the base outwards; None is the base.
    """

    link: str
    joint: Frame
    tag: str
    carrier: Frame | None
    carried: Frame


def closure_of(
    joint: Frame, ends: tuple[Frame | None, Frame | None], model: Frame, frames: Frames
) -> Closure:
    """The joint between a parent and a child that other joints connect already.

    Its frames refer to the initial configuration. Raises ``FormatError`` for types that close no loop.
    """
    kind = joint_type_of(joint)
    if kind not in _CLOSURES:
        raise joint.element.error(
            f"a joint of type {kind} closes a loop",
            allowed=", ".join(_CLOSURES),
            fix="close the loop at another joint, or move this joint up in the file",
        )
    if joint.element.first("axis") is not None and any(
        axis.first(tag) is not None for axis in joint.element.all("axis") for tag in ("limit", "dynamics")
    ):
        note(frames.context, CLOSURE, joint.element, "its limits, friction and springs are omitted")
    x = (1.0, 0.0, 0.0)
    axes = [direction_of(joint, joint.element.first(tag), tag, frames) for tag in AXES[kind]]
    first = _with_axis(axes[0], 2, x) if axes else Transform()
    second = _with_axis(axes[1], 1, axes[0]) if len(axes) == 2 else first
    attachments = [
        Attachment(
            link=None if link is None else link.name,
            pose=frames.between(link or model, joint) @ turn,
        )
        for link, turn in zip(ends, (first, second))
    ]
    return _CLOSURES[kind](name=joint.name, first=attachments[0], second=attachments[1])


def _with_axis(direction: Vector3, index: int, hint: Vector3) -> Transform:
    """A rotation whose axis with this index has a direction."""
    length = math.hypot(*direction)
    z = [value / length for value in direction]
    if abs(sum(a * b for a, b in zip(z, hint))) > 0.9 * math.hypot(*hint):
        smallest = min(range(3), key=lambda k: abs(z[k]))
        hint = (float(smallest == 0), float(smallest == 1), float(smallest == 2))
    x = _cross(_cross(z, hint), z)
    size = math.hypot(*x)
    x = [value / size for value in x]
    y = _cross(z, x)
    columns = {2: (x, y, z), 1: (y, z, x)}[index]
    return Transform(rotation=tuple(tuple(column[row] for column in columns) for row in range(3)))  # pyright: ignore[reportArgumentType]


def _cross(a: Sequence[float], b: Sequence[float]) -> list[float]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def couplings_of(
    links: Sequence[Link], coordinates: Sequence[Coordinate], gearboxes: Sequence[Frame], frames: Frames
) -> tuple[Constraint, ...]:
    """The couplings of mimic joints and gearboxes; unsupported elements become findings."""
    couplings: list[Coupling] = []
    moving = [link for link in links if link.joint.moves]
    used: set[str] = set()
    found = [
        *_mimics(coordinates, frames),
        *((_gearbox(gear, coordinates, frames), gear) for gear in gearboxes),
    ]
    for coupling, owner in found:
        if isinstance(coupling, str):
            note(frames.context, COUPLING, owner.element, coupling)
            continue
        named = replace(coupling, name=free_name(coupling.name, used))
        remaining = remaining_coupling(moving, couplings, named)
        if isinstance(remaining, Coupling):
            couplings.append(remaining)
        else:
            note(frames.context, COUPLING, owner.element, left_out_coupling(remaining))
    return tuple(couplings)


def _mimics(coordinates: Sequence[Coordinate], frames: Frames) -> Iterator[tuple[Coupling | str, Frame]]:
    """``q = multiplier (q_leader - reference) + offset`` for each element ``<mimic>``."""
    for own in coordinates:
        axis = own.joint.element.first(own.tag)
        mimic = axis.first("mimic") if axis is not None else None
        if mimic is None:
            continue
        leader = _leader(mimic, own.joint, coordinates, frames)
        multiplier, offset, reference = (
            number_in(mimic, tag, default)
            for tag, default in (("multiplier", 1.0), ("offset", 0.0), ("reference", 0.0))
        )
        named = shortened(mimic.attributes.get("joint", ""))
        if leader is None or leader.link == own.link or multiplier == 0.0:
            yield (
                f"it mimics joint '{named}' with the multiplier {multiplier:g}; it stays independent",
                own.joint,
            )
            continue
        terms = ((own.link, 1.0), (leader.link, -multiplier))
        constant = offset - multiplier * reference
        yield Coupling(name=f"{own.link} mimics {leader.link}", terms=terms, constant=constant), own.joint


def _leader(
    mimic: Element, joint: Frame, coordinates: Sequence[Coordinate], frames: Frames
) -> Coordinate | None:
    """The coordinate that a joint mimics."""
    tag = mimic.attributes.get("axis", "axis").strip()
    try:
        leader = frames.lookup(joint, mimic.attributes.get("joint", "").strip(), mimic)
    except UnknownNameError:
        return None
    return next((entry for entry in coordinates if entry.joint is leader and entry.tag == tag), None)


def _gearbox(gear: Frame, coordinates: Sequence[Coordinate], frames: Frames) -> Coupling | str:
    """``q2 = -ratio q1``: the angles of the parent and the child of the gearbox from its reference body."""
    reference = text_in(gear.element, "gearbox_reference_body")
    ratio = number_in(gear.element, "gearbox_ratio", 1.0)
    terms: list[tuple[str, float]] = []
    for end, tag, factor in (("child", "axis2", 1.0), ("parent", "axis", ratio)):
        name = text_in(gear.element, end)
        own = next(
            (
                entry
                for entry in coordinates
                if entry.carried.name == name
                and joint_type_of(entry.joint) in ("revolute", "continuous")
                and reference == (entry.carrier.name if entry.carrier is not None else "world")
            ),
            None,
        )
        if own is None or factor == 0.0:
            return f"no revolute joint connects '{shortened(name)}' with the reference body of the gearbox"
        axis = direction_of(gear, gear.element.first(tag), tag, frames)
        turned = Transform(rotation=frames.between(own.joint, gear).rotation).apply(axis)
        joint_axis = direction_of(own.joint, own.joint.element.first(own.tag), own.tag, frames)
        cosine = sum(a * b for a, b in zip(turned, joint_axis)) / (
            math.hypot(*turned) * math.hypot(*joint_axis)
        )
        if abs(cosine) < 0.999:
            return f"the axis of the gearbox differs from the axis of the joint of '{shortened(name)}'"
        terms.append((own.link, factor if cosine > 0 else -factor))
    return Coupling(name=gear.name, terms=tuple(terms))
