"""Joint types, one file each. A new type needs one file; all algorithms and tests use it automatically."""

from armblocks.package_folder import classes_in
from armblocks.robot.joints.cylindrical import Cylindrical
from armblocks.robot.joints.fixed import Fixed
from armblocks.robot.joints.free import Free
from armblocks.robot.joints.joint import Joint
from armblocks.robot.joints.limits import JointLimits
from armblocks.robot.joints.motions import AxisMotion, BallMotion, Coordinate, Motion
from armblocks.robot.joints.planar import Planar
from armblocks.robot.joints.prismatic import Prismatic
from armblocks.robot.joints.revolute import Revolute
from armblocks.robot.joints.screw import Screw
from armblocks.robot.joints.spherical import Spherical
from armblocks.robot.joints.universal import Universal

_FIRST = (Revolute, Prismatic, Fixed)
JOINT_TYPES: tuple[type[Joint], ...] = (
    *_FIRST,
    *(kind for kind in classes_in(__name__, Joint) if kind not in (Joint, *_FIRST)),
)
"""All joint types of this package's folder, in the order of files and tables."""

__all__ = [
    "JOINT_TYPES",
    "AxisMotion",
    "BallMotion",
    "Coordinate",
    "Cylindrical",
    "Fixed",
    "Free",
    "Joint",
    "JointLimits",
    "Motion",
    "Planar",
    "Prismatic",
    "Revolute",
    "Screw",
    "Spherical",
    "Universal",
]
