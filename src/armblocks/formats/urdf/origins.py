"""Poses from the ``<origin>`` elements of URDF."""

from __future__ import annotations

import math

from armblocks.formats.file_findings import FileContext
from armblocks.formats.urdf.rules import ANGLE
from armblocks.formats.xml_elements import Element, note
from armblocks.spatial import Transform, transl, trotx, troty, trotz

MAX_ANGLE = 2 * math.pi * (1 + 1e-6)
"""Angles above a whole turn are probably in degrees."""


def origin_of(element: Element, context: FileContext) -> Transform:
    """The pose of an element's ``<origin>``, with ``R = Rz(yaw) Ry(pitch) Rx(roll)``; without it identity."""
    origin = element.first("origin")
    if origin is None:
        return Transform()
    x, y, z = origin.vector("xyz", (0.0, 0.0, 0.0))
    roll, pitch, yaw = origin.vector("rpy", (0.0, 0.0, 0.0))
    if max(map(abs, (roll, pitch, yaw))) > MAX_ANGLE:
        what = f"the origin is rotated by {roll:g}, {pitch:g}, {yaw:g} rad, more than one turn; used as given"
        note(context, ANGLE, origin, what, element.label)
    return transl(x, y, z) @ trotz(yaw) @ troty(pitch) @ trotx(roll)
