"""Shapes ``<geom>`` of MJCF: their mass properties, and solids for drawings."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from armblocks.errors import FormatError
from armblocks.formats.file_findings import FileContext
from armblocks.formats.mjcf.meshes import MeshAssets
from armblocks.formats.mjcf.poses import pose_of, towards
from armblocks.formats.mjcf.rules import INERTIA, MESH, SHAPE
from armblocks.formats.mjcf.settings import Settings
from armblocks.formats.mjcf.solids import Solid, solid_of, solid_of_mesh
from armblocks.formats.xml_elements import Element, note, shortened
from armblocks.robot.shapes import Box, Cylinder, Material, Pose, Shape, Sphere
from armblocks.spatial import Transform, matrix3, transl
from armblocks.spatial.inertia import RigidInertia
from armblocks.spatial.vectors import Symmetric

WATER = 1000.0
"""Density of shapes without mass and density, kg/m3."""
_SIZES = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}
"""Number of sizes of each type of shape."""


@dataclass(frozen=True, kw_only=True)
class Geom:
    """One shape: its type, its sizes (half lengths and radii, m), its pose in the frame of the body."""

    element: Element
    kind: str
    size: tuple[float, ...]
    pose: Transform

    @property
    def mesh(self) -> str:
        """The name of its mesh; ``""`` without one."""
        return self.element.attributes.get("mesh", "").strip()


def geom_of(element: Element, around: Transform, settings: Settings) -> Geom:
    """The shape of an element with its defaults; ``around``: the pose of the frame around it in the body."""
    kind = element.attributes.get("type", "sphere").strip()
    if kind == "sphere" and "type" not in element.attributes and "mesh" in element.attributes:
        kind = "mesh"
    size = tuple(element.numbers("size", (1, 2, 3))) if "size" in element.attributes else ()
    if "fromto" in element.attributes and kind in _SIZES:
        return _between_points(element, kind, size, around, settings)
    return Geom(element=element, kind=kind, size=size, pose=around @ pose_of(element, settings))


def site_pose(element: Element, settings: Settings) -> Transform:
    """The pose of a site in the frame around it: between two points, or as other elements."""
    if "fromto" not in element.attributes:
        return pose_of(element, settings)
    return _between_points(element, "capsule", (1.0,), Transform(), settings).pose


def _between_points(
    element: Element, kind: str, size: tuple[float, ...], around: Transform, settings: Settings
) -> Geom:
    """A shape along z between two points; ``size`` has its radius or its half widths."""
    ends = np.array(element.numbers("fromto", (6,))).reshape(2, 3)
    span = ends[0] - ends[1]
    length = float(np.linalg.norm(span))
    if length < 1e-10 or not size:
        raise element.error(
            "the ends of 'fromto' coincide, or the size is missing", allowed="two points, and size"
        )
    x, y, z = ends.mean(axis=0).tolist()
    pose = Transform(rotation=matrix3(towards(span / length)), translation=(x, y, z))
    radius = float(size[0])
    across = (radius,) if kind in ("capsule", "cylinder") else (radius, size[1] if len(size) > 1 else radius)
    return Geom(element=element, kind=kind, size=(*across, length / 2.0), pose=around @ pose)


def inertia_of(geom: Geom, meshes: MeshAssets, label: str, context: FileContext) -> RigidInertia:
    """The inertia of a shape in the frame of the body, from its mass or density; a finding where unknown."""
    element = geom.element
    mass = element.number("mass") if "mass" in element.attributes else None
    density = element.number("density", WATER)
    if mass == 0.0 or (mass is None and density == 0.0) or geom.kind in ("plane", "hfield"):
        return RigidInertia()
    solid = _solid(geom, meshes)
    if isinstance(solid, str) or solid.volume <= 0.0:
        reason = solid if isinstance(solid, str) else "its volume is zero"
        note(context, INERTIA, element, f"the mass of this shape is not included: {reason}", label)
        return RigidInertia()
    if element.attributes.get("shellinertia", "").strip() == "true":
        note(
            context,
            INERTIA,
            element,
            "the shape is a shell; its inertia is computed as for a solid",
            label,
        )
    if mass is None:
        mass = density * solid.volume
    moments = solid.inertia * (mass / solid.volume)
    second = Symmetric(*(float(moments[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))))
    x, y, z = solid.centre.tolist()
    return RigidInertia.at_centre(mass, second).shifted((x, y, z)).moved(geom.pose)


def _solid(geom: Geom, meshes: MeshAssets) -> Solid | str:
    """The solid of a shape, or the reason why it is unknown."""
    if geom.kind == "mesh":
        corners = meshes.triangles(geom.mesh)
        if isinstance(corners, str):
            return corners
        rule = meshes.mass_rule(geom.mesh)
        if rule not in ("legacy", "exact"):
            return f"the rule '{shortened(rule)}' for the inertia of meshes is not supported"
        return solid_of_mesh(corners, legacy=rule == "legacy")
    if geom.kind not in _SIZES:
        return f"shapes of type '{shortened(geom.kind)}' are not known"
    if geom.mesh:
        return "a primitive that is fitted to a mesh is not computed"
    if len(geom.size) < _SIZES[geom.kind] or min(geom.size[: _SIZES[geom.kind]]) <= 0:
        return "its size is not above zero"
    return solid_of(geom.kind, geom.size[: _SIZES[geom.kind]])


def drawn(
    geom: Geom, meshes: MeshAssets, label: str, context: FileContext, material: Material
) -> list[Shape]:
    """The shapes that draw a geom; a finding where it cannot be drawn."""
    kind, element, pose = geom.kind, geom.element, geom.pose
    if kind in ("plane", "hfield"):
        return []
    if kind == "mesh" or geom.mesh:
        corners = meshes.triangles(geom.mesh)
        if isinstance(corners, str):
            note(context, MESH, element, f"the mesh '{shortened(geom.mesh)}' is not shown: {corners}", label)
            return []
        mesh: Shape = replace(meshes.drawing(geom.mesh, corners), material=material, pose=_rows(pose))
        return [mesh]
    if kind not in _SIZES or len(geom.size) < _SIZES[kind] or min(geom.size[: _SIZES[kind]]) <= 0:
        note(context, SHAPE, element, f"the shape of type '{shortened(kind)}' is not shown", label)
        return []
    size = geom.size
    if kind == "box":
        a, b, c = size[:3]
        return [Box(size=(2 * a, 2 * b, 2 * c), material=material, pose=_rows(pose))]
    if kind == "ellipsoid":
        return [Sphere(radius=math.prod(size[:3]) ** (1 / 3), material=material, pose=_rows(pose))]
    ball = Sphere(radius=size[0], material=material, pose=_rows(pose))
    if kind == "sphere":
        return [ball]
    tube = Cylinder(radius=size[0], length=2 * size[1], material=material, pose=_rows(pose))
    if kind == "cylinder":
        return [tube]
    ends = (transl(0.0, 0.0, side * size[1]) for side in (-1.0, 1.0))
    shapes: list[Shape] = [tube]
    shapes += (replace(ball, pose=_rows(pose @ end)) for end in ends)
    return shapes


def is_collision_only(element: Element) -> bool:
    """Whether a shape is of group 3 or above, which MuJoCo's viewer hides: collision shapes by convention."""
    try:
        return element.number("group", 0.0) >= 3
    except FormatError:
        return False


def _rows(pose: Transform) -> Pose:
    a, b, c, d = (tuple(row) for row in pose.matrix.tolist())
    return (a, b, c, d)
