"""Robot descriptions: immutable values, and their numbered form for algorithms."""

from armblocks.robot.dh import DhConvention, DhRow, link_from_dh, modified_dh, serial_chain, standard_dh
from armblocks.robot.friction_model import FrictionModel
from armblocks.robot.joints import (
    JOINT_TYPES,
    Cylindrical,
    Fixed,
    Free,
    Joint,
    JointLimits,
    Planar,
    Prismatic,
    Revolute,
    Screw,
    Spherical,
    Universal,
)
from armblocks.robot.link import Link, Motor, inertia_matrix
from armblocks.robot.physicality import InertiaFinding, inertia_findings, warn_of_inertias
from armblocks.robot.plausibility import (
    PlausibilityFinding,
    plausibility_findings,
    warn_of_implausible_values,
)
from armblocks.robot.robot import Robot
from armblocks.robot.tips import deepest_tip, with_tip

__all__ = [
    "JOINT_TYPES",
    "Cylindrical",
    "DhConvention",
    "DhRow",
    "Fixed",
    "Free",
    "FrictionModel",
    "InertiaFinding",
    "Joint",
    "JointLimits",
    "Link",
    "Motor",
    "Planar",
    "PlausibilityFinding",
    "Prismatic",
    "Revolute",
    "Robot",
    "Screw",
    "Spherical",
    "Universal",
    "deepest_tip",
    "inertia_findings",
    "inertia_matrix",
    "link_from_dh",
    "modified_dh",
    "plausibility_findings",
    "serial_chain",
    "standard_dh",
    "warn_of_implausible_values",
    "warn_of_inertias",
    "with_tip",
]
