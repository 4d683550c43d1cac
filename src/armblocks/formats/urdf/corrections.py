"""Corrections of URDF files: the findings whose remedy is unambiguous."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence

from armblocks.formats.file_corrections import are_degrees, number_text, numbers_text
from armblocks.formats.file_findings import FileFinding
from armblocks.formats.robot_rules import IMPLAUSIBLE
from armblocks.formats.urdf.joints import UNLIMITED
from armblocks.formats.urdf.names import free_joint_name
from armblocks.formats.urdf.rules import ANGLE, AXIS, INERTIAL, LIMIT, NAME, NO_LIMIT
from armblocks.formats.xml_corrections import Edit, XmlFile
from armblocks.formats.xml_elements import Element


def edits_of(finding: FileFinding, element: Element, file: XmlFile) -> Sequence[Edit]:
    """The changes that remove a finding; none if its remedy is ambiguous."""
    if finding.rule is IMPLAUSIBLE:
        return [*_limits_in_degrees(finding.link, file)]
    correction = _CORRECTIONS.get(finding.rule.code)
    return [] if correction is None else [*correction(element, file)]


def _unit_axis(axis: Element, _: XmlFile) -> Iterator[Edit]:
    x, y, z = axis.vector("xyz", (1.0, 0.0, 0.0))
    length = math.hypot(x, y, z)
    text = numbers_text((x / length, y / length, z / length))
    yield Edit(element=axis, what=f"axis divided by its length {length:.6g}", attributes={"xyz": text})


def _ordered_limits(limit: Element, _: XmlFile) -> Iterator[Edit]:
    """Reversed limits are exchanged. Limits of zero, which would lock the joint, become infinite."""
    low, high = (limit.attributes.get(name, "0") for name in ("lower", "upper"))
    if limit.number("lower", 0.0) > limit.number("upper", 0.0):
        what = f"limits exchanged: from {high} to {low}"
        yield Edit(element=limit, what=what, attributes={"lower": high, "upper": low})
    for name in ("effort", "velocity"):
        if limit.number(name, 1.0) == 0.0:
            what = f"{name} limit of 0 replaced by {UNLIMITED:g}, no limit"
            yield Edit(element=limit, what=what, attributes={name: number_text(UNLIMITED)})


def _no_limit(joint: Element, _: XmlFile) -> Iterator[Edit]:
    if joint.attributes["type"].strip() == "revolute":
        yield Edit(
            element=joint, what="joint without limits made continuous", attributes={"type": "continuous"}
        )
        return
    large = number_text(UNLIMITED)
    limit = f'<limit lower="-{large}" upper="{large}" effort="{large}" velocity="{large}"/>'
    yield Edit(element=joint, what=f"limits of {UNLIMITED:g}, no limit, added", child=limit)


def _origin_in_degrees(origin: Element, _: XmlFile) -> Iterator[Edit]:
    angles = origin.vector("rpy", (0.0, 0.0, 0.0))
    if are_degrees(angles):
        text = numbers_text([math.radians(angle) for angle in angles])
        yield Edit(element=origin, what="rpy converted from degrees to rad", attributes={"rpy": text})


def _missing_inertia(inertial: Element, _: XmlFile) -> Iterator[Edit]:
    missing: list[str] = []
    if inertial.first("mass") is None:
        missing.append('<mass value="0"/>')
    if inertial.first("inertia") is None:
        missing.append('<inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>')
    yield Edit(element=inertial, what=f"added {''.join(missing)}", child="".join(missing))


def _unique_name(element: Element, file: XmlFile) -> Iterator[Edit]:
    if element.tag == "link":
        yield Edit(element=element, what="second copy of the link removed", removed=True)
        return
    name = element.attributes["name"].strip()
    new = free_joint_name(
        name, {joint.attributes.get("name", "").strip() for joint in file.root.all("joint")}
    )
    yield Edit(element=element, what=f"joint renamed '{new}'", attributes={"name": new})


def _limits_in_degrees(link: str, file: XmlFile) -> Iterator[Edit]:
    for joint in file.root.all("joint"):
        child, limit = joint.first("child"), joint.first("limit")
        if child is None or limit is None or child.attributes.get("link", "").strip() != link:
            continue
        if joint.attributes.get("type", "").strip() != "revolute":
            continue
        low, high = limit.number("lower", 0.0), limit.number("upper", 0.0)
        if are_degrees((low, high)):
            what = f"limits {low:g} and {high:g} converted from degrees to rad"
            attributes = {"lower": number_text(math.radians(low)), "upper": number_text(math.radians(high))}
            yield Edit(element=limit, what=what, attributes=attributes)


_CORRECTIONS: Mapping[str, Callable[[Element, XmlFile], Iterator[Edit]]] = {
    AXIS.code: _unit_axis,
    LIMIT.code: _ordered_limits,
    NO_LIMIT.code: _no_limit,
    ANGLE.code: _origin_in_degrees,
    INERTIAL.code: _missing_inertia,
    NAME.code: _unique_name,
}
