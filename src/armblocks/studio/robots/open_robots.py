"""The open robots of a studio."""

from __future__ import annotations

import asyncio
import dataclasses
import functools

from armblocks import formats
from armblocks.face.arm import Arm
from armblocks.robot import Configurations, Robot
from armblocks.studio.documents.open_files import OpenFile, OpenFiles
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.documents.state_folder import StateFolder
from armblocks.studio.robots.document import RobotDocument
from armblocks.studio.robots.robot_kind import RobotKind


@dataclasses.dataclass(eq=False, kw_only=True)
class OpenRobot(OpenFile[RobotDocument]):
    """A robot with its file, its journal, and the compiled equations of its present value."""

    notes: tuple[str, ...] = ()
    """Warnings issued while the file was read."""
    reading: asyncio.Lock = dataclasses.field(default_factory=asyncio.Lock)
    _arm: Arm | None = None

    @property
    def robot(self) -> Robot:
        """The present robot."""
        return self.document.value

    @functools.cached_property
    def published(self) -> tuple[str, ...]:
        """Names of the configurations of the shipped robot of which this robot is a copy."""
        is_shipped = self.origin in formats.list_robots()
        return tuple(formats.load_robot(self.origin).configurations) if is_shipped else ()

    @property
    def arm(self) -> Arm:
        """The compiled equations of the present robot without its configurations, compiled at first use."""
        robot = dataclasses.replace(self.robot, configurations=Configurations())
        if self._arm is None or self._arm.robot != robot:
            self._arm = Arm(robot)
        return self._arm


class OpenRobots(OpenFiles[OpenRobot]):
    """The open robots of one project folder; see :class:`.OpenFiles`."""

    def __init__(self, folder: ProjectFolder, state_folder: StateFolder) -> None:
        super().__init__(folder, state_folder, RobotKind(folder))

    def _create(self, key: str, document: RobotDocument) -> OpenRobot:
        return OpenRobot(key=key, document=document)
