"""Numbers, flags and poses in the elements of SDF."""

from __future__ import annotations

import math
from typing import NamedTuple

from armblocks.formats.file_findings import FileContext
from armblocks.formats.sdf.rules import ANGLE
from armblocks.formats.xml_elements import MAX_NUMBER, Element, note, shortened
from armblocks.spatial import Transform, transl, trotx, troty, trotz

MAX_ANGLE = 2 * math.pi * (1 + 1e-6)
"""Angles above a whole turn are probably in degrees."""
_TRUE, _FALSE = ("true", "1"), ("false", "0", "")
_INFINITE = ("inf", "+inf", "infinity", "-inf", "-infinity")


def number_in(parent: Element | None, tag: str, default: float, *, limit: float = MAX_NUMBER) -> float:
    """The number in a child element; ``default`` if it is absent. Infinite numbers are not allowed.

    ``limit``: the maximum magnitude.

    Files of SDF 1.0 to 1.2 have attributes instead of child elements.
    """
    child = parent.first(tag) if parent is not None else None
    if child is not None:
        return child.text_numbers(1, limit=limit)[0]
    return default if parent is None else parent.number(tag, default, limit=limit)


def unbounded_number_in(parent: Element | None, tag: str, default: float) -> float:
    """As :func:`number_in`; the number may be infinite."""
    child = parent.first(tag) if parent is not None else None
    text = (parent.attributes.get(tag, "") if parent is not None else "") if child is None else child.text
    word = text.strip().lower()
    return float(word) if word in _INFINITE else number_in(parent, tag, default, limit=math.inf)


def text_in(parent: Element, tag: str) -> str:
    """The text of a child element; empty if it is absent."""
    child = parent.first(tag)
    return "" if child is None else child.text


def is_true(element: Element, text: str) -> bool:
    """The truth value of a text in an element."""
    word = text.strip().lower()
    if word not in (*_TRUE, *_FALSE):
        raise element.error(f"'{shortened(text)}' is neither true nor false", allowed="true, false, 1, 0")
    return word in _TRUE


def flag_in(parent: Element, tag: str) -> bool:
    """The truth value of a child element; false if it is absent."""
    return is_true(parent, text_in(parent, tag))


class RelativePose(NamedTuple):
    """``transform`` in the frame named ``relative_to``; an empty name means the default frame of the
    element."""

    transform: Transform = Transform()
    relative_to: str = ""


def pose_of(pose: Element | None, context: FileContext, old: bool = False) -> RelativePose:
    """The value of a ``<pose>`` element; without it the identity.

    Six numbers: ``x y z roll pitch yaw``, with ``R = Rz(yaw) Ry(pitch) Rx(roll)``, angles in rad or with
    ``degrees="true"`` in degrees. Seven numbers with ``rotation_format="quat_xyzw"``: ``x y z qx qy qz qw``.
    ``old``: the file is older than SDF 1.7, in which ``relative_to`` replaced the attribute ``frame``.
    """
    if pose is None:
        return RelativePose()
    relative_to = pose.attributes.get("relative_to", "").strip()
    if old:
        relative_to = pose.attributes.get("frame", "").strip()
    form = pose.attributes.get("rotation_format", "euler_rpy").strip()
    if form not in ("euler_rpy", "quat_xyzw"):
        raise pose.error(f"the rotation format is '{shortened(form)}'", allowed="euler_rpy, quat_xyzw")
    if not pose.text:
        return RelativePose(Transform(), relative_to)
    if form == "quat_xyzw":
        return RelativePose(_from_quaternion(pose), relative_to)
    x, y, z, *angles = pose.text_numbers(6)
    if is_true(pose, pose.attributes.get("degrees", "")):
        angles = [math.radians(angle) for angle in angles]
    elif max(map(abs, angles)) > MAX_ANGLE:
        roll, pitch, yaw = angles
        what = f"the pose is rotated by {roll:g}, {pitch:g}, {yaw:g} rad, more than one turn; used as given"
        note(context, ANGLE, pose, what)
    roll, pitch, yaw = angles
    return RelativePose(transl(x, y, z) @ trotz(yaw) @ troty(pitch) @ trotx(roll), relative_to)


def _from_quaternion(pose: Element) -> Transform:
    *position, x, y, z, w = pose.text_numbers(7)
    size = math.hypot(x, y, z, w)
    if not 1e-9 < size < math.inf:
        raise pose.error("the quaternion is zero", allowed="qx qy qz qw of length 1")
    x, y, z, w = x / size, y / size, z / size, w / size
    rotation = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    return Transform(rotation=rotation, translation=position)
