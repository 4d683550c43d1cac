"""Mass, centre of mass and inertia of URDF links."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armblocks.formats.file_findings import FileContext
from armblocks.formats.urdf.origins import origin_of
from armblocks.formats.urdf.rules import INERTIAL
from armblocks.formats.xml_elements import Element, note
from armblocks.spatial import IDENTITY3, Matrix3, Vector3, matrix3

ZERO3: Matrix3 = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


class Inertial(NamedTuple):
    """``mass`` kg; ``centre`` of mass m in the link's frame; ``inertia`` kg m2 about it, in link axes."""

    mass: float = 0.0
    centre: Vector3 = (0.0, 0.0, 0.0)
    inertia: Matrix3 = ZERO3


def inertial_of(link: Element, context: FileContext) -> Inertial:
    """The ``<inertial>`` of a link; zero if there is none.

    The matrix of the file is in the axes of the origin: ``I_link = R I R'``.
    """
    inertial = link.first("inertial")
    if inertial is None:
        return Inertial()
    pose = origin_of(inertial, context)
    missing = [tag for tag in ("mass", "inertia") if inertial.first(tag) is None]
    if missing:
        what = f"it has no <{'> and no <'.join(missing)}>, which is read as zero"
        note(context, INERTIAL, inertial, what, link.label)
    mass = inertial.first("mass")
    kilograms = 0.0 if mass is None else mass.number("value")
    if mass is not None and kilograms < 0:
        raise mass.error(
            f"the mass of {link.label} is {kilograms:g} kg", allowed="zero or more", fix="correct the sign"
        )
    moments = inertial.first("inertia")
    if moments is None:
        return Inertial(kilograms, pose.translation)
    xx, yy, zz, xy, yz, xz = (
        moments.number(name, 0.0) for name in ("ixx", "iyy", "izz", "ixy", "iyz", "ixz")
    )
    matrix: Matrix3 = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
    if pose.rotation == IDENTITY3:
        return Inertial(kilograms, pose.translation, matrix)
    rotated = pose.R @ np.array(matrix) @ pose.R.T
    return Inertial(kilograms, pose.translation, matrix3((rotated + rotated.T) / 2))
