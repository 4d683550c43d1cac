"""The edits of the recorded poses of a robot; :mod:`armblocks.studio.robots.pose_edits` applies them."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from armblocks.studio.protocol.messages.robot_edits import RobotEdit
from armblocks.studio.protocol.messages.robots import Joints


class PoseEdit(RobotEdit):
    """An edit of the list of recorded poses."""


class RecordPose(PoseEdit):
    """Append a pose, or insert it after another pose. Without a name it is called P1, P2 …"""

    kind: Literal["record_pose"] = "record_pose"
    q: Joints
    name: str = Field(default="", max_length=200)
    after: str = ""


class UpdatePose(PoseEdit):
    """Replace the coordinates of a pose."""

    kind: Literal["update_pose"] = "update_pose"
    name: str
    q: Joints


class RenamePose(PoseEdit):
    """Give a pose the name ``to``."""

    kind: Literal["rename_pose"] = "rename_pose"
    name: str
    to: str = Field(max_length=200)


class MovePose(PoseEdit):
    """Move a pose by a number of places in the list, toward the end if ``by`` is positive."""

    kind: Literal["move_pose"] = "move_pose"
    name: str
    by: int = Field(ge=-1000, le=1000)


class RemovePose(PoseEdit):
    """Remove a pose."""

    kind: Literal["remove_pose"] = "remove_pose"
    name: str
