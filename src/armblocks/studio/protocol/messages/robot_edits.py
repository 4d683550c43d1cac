"""The edits of robots; :mod:`armblocks.studio.robots.edits` applies them."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from armblocks.studio.protocol.message import Edit


class RobotEdit(Edit):
    """An edit of a robot."""


class SetCell(RobotEdit):
    """Set the text of one cell of a link, or of the robot if ``link`` is empty."""

    kind: Literal["cell"] = "cell"
    link: str
    column: str
    text: str = Field(max_length=1000)
    angles: Literal["deg", "rad"]
    """Unit of a plain number in an angle column; a text that contains pi, deg or rad has its own unit."""


class RenameLink(RobotEdit):
    """Give a link another name."""

    kind: Literal["rename_link"] = "rename_link"
    link: str
    name: str = Field(max_length=200)


class AddJoint(RobotEdit):
    """Insert a new link after another link, or at the base if ``after`` is empty."""

    kind: Literal["add_joint"] = "add_joint"
    after: str


class RemoveJoint(RobotEdit):
    """Remove a link; its child links are attached to its parent."""

    kind: Literal["remove_joint"] = "remove_joint"
    link: str


class MoveJoint(RobotEdit):
    """Exchange a link of a chain with the previous link (``by`` is -1) or with the next link (1)."""

    kind: Literal["move_joint"] = "move_joint"
    link: str
    by: Literal[-1, 1]


class SetConvention(RobotEdit):
    """Interpret the D-H rows in another convention, or with ``keep_arm`` convert them for the same arm."""

    kind: Literal["convention"] = "convention"
    convention: Literal["standard", "modified"]
    keep_arm: bool
