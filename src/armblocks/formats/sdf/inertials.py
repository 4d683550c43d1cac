"""Mass, centre of mass and inertia of SDF links."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armblocks.formats.sdf.frames import Frame, Frames
from armblocks.formats.sdf.rules import AUTO_INERTIA, NO_INERTIA
from armblocks.formats.sdf.values import is_true, number_in
from armblocks.formats.xml_elements import note
from armblocks.spatial import IDENTITY3, Matrix3, Vector3, matrix3

_UNIT: Matrix3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Inertial(NamedTuple):
    """``mass`` kg; ``centre`` of mass m in the link's frame; ``inertia`` kg m2 about it, in link axes.

    Defaults are the same as in SDF.
    """

    mass: float = 1.0
    centre: Vector3 = (0.0, 0.0, 0.0)
    inertia: Matrix3 = _UNIT


def inertial_of(link: Frame, frames: Frames, moves: bool) -> Inertial:
    """The ``<inertial>`` of a link, or the default of SDF, with a finding if the link moves.

    The matrix of the file is in the axes of the inertial's pose: ``I_link = R I R'``.
    """
    element = link.element.first("inertial")
    if element is None:
        if moves:
            what = "the link has no <inertial>; the default of SDF, 1 kg and 1 kg m2, is used"
            note(frames.context, NO_INERTIA, link.element, what)
        return Inertial()
    if is_true(element, element.attributes.get("auto", "")):
        what = "the inertia from the shapes is not computed; the numbers of the file or the defaults are used"
        note(frames.context, AUTO_INERTIA, element, what, link.element.label)
    mass = number_in(element, "mass", 1.0)
    if mass < 0:
        raise (element.first("mass") or element).error(
            f"the mass of {link.element.label} is {mass:g} kg", allowed="zero or more", fix="correct the sign"
        )
    pose = frames.inside(link, element.first("pose") or element.first("origin"))
    moments = element.first("inertia")
    xx, yy, zz = (number_in(moments, name, 1.0) for name in ("ixx", "iyy", "izz"))
    xy, yz, xz = (number_in(moments, name, 0.0) for name in ("ixy", "iyz", "ixz"))
    matrix: Matrix3 = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
    if pose.rotation == IDENTITY3:
        return Inertial(mass, pose.translation, matrix)
    rotated = pose.R @ np.array(matrix) @ pose.R.T
    return Inertial(mass, pose.translation, matrix3((rotated + rotated.T) / 2))
