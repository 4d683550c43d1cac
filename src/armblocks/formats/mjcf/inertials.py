"""Mass, centre of mass and inertia of MJCF bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from armblocks.formats.file_findings import FileContext
from armblocks.formats.mjcf.meshes import MeshAssets
from armblocks.formats.mjcf.poses import rotation_of
from armblocks.formats.mjcf.rules import INERTIA
from armblocks.formats.mjcf.settings import Settings
from armblocks.formats.mjcf.shapes import Geom, inertia_of
from armblocks.formats.xml_elements import Element, note
from armblocks.robot.link import ZERO3
from armblocks.spatial import Matrix3, Vector3, matrix3
from armblocks.spatial.inertia import RigidInertia


class MassProperties(NamedTuple):
    """``mass`` kg; ``centre`` of mass in the frame of the body, m; ``inertia`` about it, kg m2."""

    mass: float = 0.0
    centre: Vector3 = (0.0, 0.0, 0.0)
    inertia: Matrix3 = ZERO3


def mass_properties(
    body: Element,
    geoms: Sequence[Geom],
    settings: Settings,
    meshes: MeshAssets,
    context: FileContext,
) -> MassProperties:
    """The mass properties of ``<inertial>``, or of the shapes, within the bounds of the settings."""
    inertial = body.first("inertial")
    from_shapes = settings.inertia_from_shapes
    if inertial is not None and not from_shapes:
        properties = _given(inertial, settings)
    elif from_shapes is False:
        properties = MassProperties()
    else:
        low, high = settings.groups
        total = RigidInertia()
        for geom in geoms:
            if low <= geom.element.number("group", 0.0) <= high:
                total = total.plus(inertia_of(geom, meshes, body.label, context))
        properties = _about_centre(total)
        if not np.isfinite([properties.mass, *properties.centre, *np.ravel(properties.inertia)]).all():
            what = "its mass cannot be computed from sizes or masses that are almost zero; it is read as zero"
            note(context, INERTIA, body, what)
            properties = MassProperties()
    return _bounded(properties, settings) if properties.mass > 0 else properties


def _given(inertial: Element, settings: Settings) -> MassProperties:
    mass = inertial.number("mass")
    if mass < 0:
        raise inertial.error(f"the mass is {mass:g} kg", allowed="zero or more", fix="correct the sign")
    centre = inertial.vector("pos", (0.0, 0.0, 0.0))
    if "fullinertia" in inertial.attributes:
        xx, yy, zz, xy, xz, yz = inertial.numbers("fullinertia", (6,))
        return MassProperties(mass, centre, ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))
    moments = inertial.numbers("diaginertia", (3,)) if "diaginertia" in inertial.attributes else [0.0] * 3
    R = rotation_of(inertial, settings)
    return MassProperties(mass, centre, _symmetric(R @ np.diag(moments) @ R.T))


def _about_centre(total: RigidInertia) -> MassProperties:
    mass = float(total.mass)
    if mass <= 0:
        return MassProperties()
    x, y, z = (float(moment) / mass for moment in total.first)
    # The parallel-axis theorem in the other direction: a negative mass at the centre of mass.
    S = total.plus(RigidInertia.at_centre(-mass, _NO_SECOND).shifted((x, y, z))).second
    rows = ((S.xx, S.xy, S.xz), (S.xy, S.yy, S.yz), (S.xz, S.yz, S.zz))
    return MassProperties(mass, (x, y, z), matrix3(np.array(rows, dtype=float)))


_NO_SECOND = RigidInertia().second


def _bounded(properties: MassProperties, settings: Settings) -> MassProperties:
    """The properties with the lower bounds of mass and principal moments, and with balanced moments."""
    mass, centre, inertia = properties
    mass = max(mass, settings.least_mass)
    if not (settings.least_inertia > 0 or settings.balances_inertia):
        return MassProperties(mass, centre, inertia)
    moments, axes = np.linalg.eigh(np.array(inertia))
    moments = np.maximum(moments, settings.least_inertia)
    if settings.balances_inertia and moments[0] + moments[1] < moments[2]:
        moments = np.full(3, moments.mean())
    return MassProperties(mass, centre, _symmetric(axes @ np.diag(moments) @ axes.T))


def _symmetric(matrix: np.ndarray) -> Matrix3:
    return matrix3((matrix + matrix.T) / 2)
