"""Joint types, one file each. A new type needs one file; all algorithms and tests use it automatically."""

from armblocks.package_folder import classes_in
from armblocks.robot.joints.fixed import Fixed
from armblocks.robot.joints.joint import Joint, JointLimits
from armblocks.robot.joints.prismatic import Prismatic
from armblocks.robot.joints.revolute import Revolute

_FIRST = (Revolute, Prismatic, Fixed)
JOINT_TYPES: tuple[type[Joint], ...] = (
    *_FIRST,
    *(kind for kind in classes_in(__name__, Joint) if kind not in (Joint, *_FIRST)),
)
"""All joint types of this package's folder, in the order of files and tables."""

__all__ = ["JOINT_TYPES", "Fixed", "Joint", "JointLimits", "Prismatic", "Revolute"]
