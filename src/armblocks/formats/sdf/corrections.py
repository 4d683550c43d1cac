"""Corrections of SDF files: the findings whose remedy is unambiguous."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence

from armblocks.formats.file_corrections import are_degrees, number_text, numbers_text
from armblocks.formats.file_findings import FileFinding
from armblocks.formats.robot_rules import IMPLAUSIBLE
from armblocks.formats.sdf.rules import ANGLE, AXIS, FRAME, LIMIT, NO_INERTIA
from armblocks.formats.xml_corrections import Edit, XmlFile
from armblocks.formats.xml_elements import Element

_DEFAULT_INERTIAL = (
    "<inertial><mass>1</mass><inertia><ixx>1</ixx><ixy>0</ixy><ixz>0</ixz><iyy>1</iyy><iyz>0</iyz>"
    "<izz>1</izz></inertia></inertial>"
)


def edits_of(finding: FileFinding, element: Element, file: XmlFile) -> Sequence[Edit]:
    """The changes that remove a finding; none if its remedy is ambiguous."""
    if finding.rule is IMPLAUSIBLE:
        return [*_limits_in_degrees(finding.link, file)]
    correction = _CORRECTIONS.get(finding.rule.code)
    return [] if correction is None else [*correction(element)]


def _unit_axis(element: Element) -> Iterator[Edit]:
    if element.tag != "xyz" or not element.text:
        return  # a joint without an axis
    x, y, z = element.text_numbers(3)
    length = math.hypot(x, y, z)
    text = numbers_text((x / length, y / length, z / length))
    yield Edit(element=element, what=f"axis divided by its length {length:.6g}", text=text)


def _ordered_limits(limit: Element) -> Iterator[Edit]:
    """Reversed limits are exchanged. Limits of zero, which would lock the joint, are removed."""
    lower, upper = limit.first("lower"), limit.first("upper")
    if lower is not None and upper is not None and float(lower.text) > float(upper.text):
        low, high = lower.text, upper.text
        what = f"limits exchanged: from {high} to {low}"
        yield Edit(element=lower, what=what, text=high)
        yield Edit(element=upper, what=what, text=low)
    for name in ("effort", "velocity"):
        child = limit.first(name)
        if child is not None and float(child.text) == 0.0:
            yield Edit(element=child, what=f"{name} limit of 0 removed", removed=True)


def _pose_in_degrees(pose: Element) -> Iterator[Edit]:
    *position, roll, pitch, yaw = pose.text_numbers(6)
    if are_degrees((roll, pitch, yaw)):
        angles = [math.radians(angle) for angle in (roll, pitch, yaw)]
        what = "angles of the pose converted from degrees to rad"
        yield Edit(element=pose, what=what, text=numbers_text([*position, *angles]))


def _default_inertial(link: Element) -> Iterator[Edit]:
    yield Edit(
        element=link, what="the default of SDF, 1 kg and 1 kg m2, written out", child=_DEFAULT_INERTIAL
    )


def _without_frame(pose: Element) -> Iterator[Edit]:
    name = "frame" if "frame" in pose.attributes else "relative_to"
    if name in pose.attributes:
        yield Edit(element=pose, what=f"attribute '{name}' removed", attributes={name: None})


def _limits_in_degrees(link: str, file: XmlFile) -> Iterator[Edit]:
    """The limits of the revolute joint of a link, if only one joint of the file can be meant."""
    joints = [joint for joint in file.all("joint") if _child(joint) == link.rpartition("::")[2]]
    if len(joints) != 1 or joints[0].attributes.get("type", "").strip() != "revolute":
        return
    axis = joints[0].first("axis")
    limit = axis.first("limit") if axis is not None else None
    lower, upper = (limit.first(name) if limit is not None else None for name in ("lower", "upper"))
    if lower is None or upper is None:
        return
    low, high = float(lower.text), float(upper.text)
    if are_degrees((low, high)):
        what = f"limits {low:g} and {high:g} converted from degrees to rad"
        yield Edit(element=lower, what=what, text=number_text(math.radians(low)))
        yield Edit(element=upper, what=what, text=number_text(math.radians(high)))


def _child(joint: Element) -> str:
    child = joint.first("child")
    return "" if child is None else (child.text or child.attributes.get("link", "").strip())


_CORRECTIONS: Mapping[str, Callable[[Element], Iterator[Edit]]] = {
    AXIS.code: _unit_axis,
    LIMIT.code: _ordered_limits,
    ANGLE.code: _pose_in_degrees,
    NO_INERTIA.code: _default_inertial,
    FRAME.code: _without_frame,
}
