"""Creation, reading and writing of robot files in the studio."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

from armblocks import formats
from armblocks.errors import ArmblocksWarning
from armblocks.robot import Robot, standard_dh
from armblocks.studio.documents.file_kind import FileKind
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.robots.document import RobotDocument


class RobotKind(FileKind[Robot, RobotDocument]):
    """Robots in the form of the editor's tables."""

    name = "robot"

    def __init__(self, folder: ProjectFolder) -> None:
        self._folder = folder

    def new(self) -> Robot:
        """Two links of 0.5 m."""
        first = standard_dh("link1", a=0.5, mass=1.0, centre_of_mass=(-0.25, 0.0, 0.0))
        second = standard_dh("link2", parent="link1", a=0.5, mass=1.0, centre_of_mass=(-0.25, 0.0, 0.0))
        return Robot(name="new robot", links=(first, second))

    def shipped(self, name: str) -> Robot:
        """A shipped robot, or a robot file of the project."""
        return formats.load_robot(self._folder.robot_path(name, formats.list_robots()))

    def document(self, value: Robot, version: int = 0) -> RobotDocument:
        """A robot in the editor."""
        return RobotDocument(value, version=version)

    def from_file(self, data: bytes, place: Path) -> Robot:
        """The robot of a project file; it refers to its file."""
        (robot,) = formats.read_robots(data, place.name).values()
        return replace(robot, source=str(place))

    def to_file(self, value: Robot, place: Path) -> bytes:
        """The canonical document of the robot."""
        return formats.write_robot(value)

    def renamed(self, value: Robot, place: Path) -> Robot:
        """Return the robot unchanged: its name does not depend on its file name."""
        return value

    def from_text(self, text: str, where: str) -> Robot:
        """Read a robot from its journal."""
        with warnings.catch_warnings():  # the tables show these warnings as findings
            warnings.simplefilter("ignore", ArmblocksWarning)
            (robot,) = formats.read_robots(text.encode(), "journal.json").values()
        return robot

    def to_text(self, value: Robot) -> str:
        """The canonical document."""
        return formats.write_robot(value).decode()

    def parts(self, value: Robot) -> int:
        """Number of links."""
        return len(value.links)
