"""Corrections of MJCF files: the findings whose remedy is unambiguous."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from armblocks.formats.file_corrections import are_degrees, numbers_text
from armblocks.formats.file_findings import FileFinding
from armblocks.formats.mjcf.rules import LIMIT, NAME
from armblocks.formats.mjcf.settings import settings_of
from armblocks.formats.robot_rules import IMPLAUSIBLE
from armblocks.formats.xml_corrections import Edit, XmlFile
from armblocks.formats.xml_elements import Element


def edits_of(finding: FileFinding, element: Element, file: XmlFile) -> Sequence[Edit]:
    """The changes that remove a finding; none if its remedy is ambiguous."""
    if finding.rule is IMPLAUSIBLE:
        return [*_range_in_degrees(finding.link, file)]
    if finding.rule is NAME:
        return [*_unique_name(element, file)]
    return [*_ordered_range(element)] if finding.rule is LIMIT else []


def _unique_name(body: Element, file: XmlFile) -> Iterator[Edit]:
    base, number = body.attributes["name"].strip(), 2
    used = {
        element.attributes.get("name", "").strip() for tag in ("body", "joint") for element in file.all(tag)
    }
    while f"{base} {number}" in used:
        number += 1
    new = f"{base} {number}"
    yield Edit(element=body, what=f"body renamed '{new}'", attributes={"name": new})


def _ordered_range(joint: Element) -> Iterator[Edit]:
    if "range" not in joint.attributes:
        return  # in a default class, which other joints may use
    low, high = joint.numbers("range", (2,))
    if low > high:
        what = f"range exchanged: from {high:g} to {low:g}"
        yield Edit(element=joint, what=what, attributes={"range": numbers_text((high, low))})


def _range_in_degrees(link: str, file: XmlFile) -> Iterator[Edit]:
    """The conversion of the range of a link's hinge from degrees, in a file whose angles are in rad."""
    if settings_of(file.root).angle_unit != 1.0:
        return
    for joint in file.all("joint"):
        body = file.parents.get(joint)
        if body is None or body.tag != "body" or "range" not in joint.attributes:
            continue
        names = {joint.attributes.get("name", "").strip()}
        if [*body.all("joint")][-1] is joint:
            names.add(body.attributes.get("name", "").strip())
        low, high = joint.numbers("range", (2,))
        if link in names and joint.attributes.get("type", "hinge") == "hinge" and are_degrees((low, high)):
            what = f"range {low:g} {high:g} converted from degrees to rad"
            text = numbers_text((math.radians(low), math.radians(high)))
            yield Edit(element=joint, what=what, attributes={"range": text})
