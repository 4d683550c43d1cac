"""An open robot with its undo history and the clients that edit it."""

from __future__ import annotations

import warnings

from armblocks.errors import ArmblocksWarning
from armblocks.robot import Link, Robot
from armblocks.studio.documents.aspects import Aspect
from armblocks.studio.documents.editable_document import EditableDocument, Outcome
from armblocks.studio.protocol.messages.documents import Change
from armblocks.studio.protocol.messages.pose_edits import PoseEdit
from armblocks.studio.protocol.messages.robot_edits import RobotEdit
from armblocks.studio.robots.columns import ROBOT_COLUMNS
from armblocks.studio.robots.edits import ROBOT_EDITS
from armblocks.studio.robots.link_columns import LINK_COLUMNS
from armblocks.studio.robots.pose_edits import POSE_EDITS


class RobotDocument(EditableDocument[Robot]):
    """One open robot; see :class:`~armblocks.studio.documents.editable_document.EditableDocument`."""

    kind = "robot"
    edits = RobotEdit
    noun = "robot"

    def outcome(self, request: Change) -> Outcome[Robot]:
        """Return title, new robot and edited cell of a change."""
        if isinstance(request.edit, PoseEdit):
            after = POSE_EDITS.applied(request.edit, self.value)
            return Outcome(POSE_EDITS.title(request.edit), after, request.gesture)
        with warnings.catch_warnings():  # the tables show these warnings as findings
            warnings.simplefilter("ignore", ArmblocksWarning)
            after = ROBOT_EDITS.applied(request.edit, self.value)
        return Outcome(ROBOT_EDITS.title(request.edit), after, request.gesture)

    def aspects(self, before: Robot, after: Robot) -> set[Aspect]:
        """Return the cells that differ, links and poses that were added, removed or changed, and changes of
        the order of links or poses."""
        return _pose_aspects(before, after) | _robot_aspects(before, after)

    def mark_saved(self, value: Robot, name: str) -> None:
        """Mark ``value`` as saved; the name of a robot does not depend on its file name."""
        self.saved = value


def _pose_aspects(before: Robot, after: Robot) -> set[Aspect]:
    old, new = ({pose.name: pose for pose in robot.configurations.entries} for robot in (before, after))
    changed: set[Aspect] = {
        ("/", "pose", name) for name in old.keys() | new.keys() if old.get(name) != new.get(name)
    }
    if [name for name in old if name in new] != [name for name in new if name in old]:
        changed.add(("/", "poses"))
    return changed


def _robot_aspects(before: Robot, after: Robot) -> set[Aspect]:
    cells = {
        ("/", name) for name, column in ROBOT_COLUMNS.items() if column.read(before) != column.read(after)
    }
    old, new = ({link.name: link for link in robot.links} for robot in (before, after))
    if list(old) != list(new):
        cells.add(("/", "links"))
    for name in old.keys() | new.keys():
        cells |= _link_aspects(name, old.get(name), new.get(name))
    return cells


def _link_aspects(name: str, old: Link | None, new: Link | None) -> set[Aspect]:
    if old is None or new is None:
        return {(name, "")}
    if old == new:
        return set()
    cells = {(name, column.name) for column in LINK_COLUMNS.values() if column.read(old) != column.read(new)}
    return cells or {(name, "parent")}
