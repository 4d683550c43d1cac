"""Joint types, one file each. A new type needs one file; all algorithms and tests use it automatically."""

from armblocks.robot.joints.fixed import Fixed
from armblocks.robot.joints.joint import Joint, JointLimits
from armblocks.robot.joints.prismatic import Prismatic
from armblocks.robot.joints.revolute import Revolute

JOINT_TYPES: tuple[type[Joint], ...] = (Revolute, Prismatic, Fixed)
"""The shipped joint types, as files and tables list them."""

__all__ = ["JOINT_TYPES", "Fixed", "Joint", "JointLimits", "Prismatic", "Revolute"]
