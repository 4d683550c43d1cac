"""Types of constraints, one file each. A new type needs one file; all algorithms use it automatically."""

from armblocks.package_folder import classes_in
from armblocks.robot.constraints.constraint import Attachment, Closure, Constraint
from armblocks.robot.constraints.coupling import Coupling
from armblocks.robot.constraints.cylindrical_closure import CylindricalClosure
from armblocks.robot.constraints.planar_closure import PlanarClosure
from armblocks.robot.constraints.point_on_line import PointOnLine
from armblocks.robot.constraints.point_on_plane import PointOnPlane
from armblocks.robot.constraints.prescribed_motion import PrescribedMotion
from armblocks.robot.constraints.prismatic_closure import PrismaticClosure
from armblocks.robot.constraints.relations import (
    Distance,
    NoDisplacement,
    Perpendicular,
    Relation,
)
from armblocks.robot.constraints.revolute_closure import RevoluteClosure
from armblocks.robot.constraints.rod import Rod
from armblocks.robot.constraints.spherical_closure import SphericalClosure
from armblocks.robot.constraints.universal_closure import UniversalClosure
from armblocks.robot.constraints.weld_closure import WeldClosure

CONSTRAINT_TYPES: tuple[type[Constraint], ...] = tuple(
    kind for kind in classes_in(__name__, Constraint) if kind not in (Constraint, Closure)
)
"""All types of constraints of this package's folder."""

__all__ = [
    "CONSTRAINT_TYPES",
    "Attachment",
    "Closure",
    "Constraint",
    "Coupling",
    "CylindricalClosure",
    "Distance",
    "NoDisplacement",
    "Perpendicular",
    "PlanarClosure",
    "PointOnLine",
    "PointOnPlane",
    "PrescribedMotion",
    "PrismaticClosure",
    "Relation",
    "RevoluteClosure",
    "Rod",
    "SphericalClosure",
    "UniversalClosure",
    "WeldClosure",
]
