"""Creation, reading and writing of robot files in the studio."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

from armblocks import formats
from armblocks.errors import ArmblocksWarning
from armblocks.formats.robot_poses import read_poses
from armblocks.robot import Robot, standard_dh
from armblocks.studio.documents.file_kind import FileKind
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.robots.document import RobotDocument
from armblocks.studio.robots.taught_robot import TaughtRobot


class RobotKind(FileKind[TaughtRobot, RobotDocument]):
    """Robots in the form of the editor's tables."""

    name = "robot"

    def __init__(self, folder: ProjectFolder) -> None:
        self._folder = folder

    def new(self) -> TaughtRobot:
        """Two links of 0.5 m."""
        first = standard_dh("link1", a=0.5, mass=1.0, centre_of_mass=(-0.25, 0.0, 0.0))
        second = standard_dh("link2", parent="link1", a=0.5, mass=1.0, centre_of_mass=(-0.25, 0.0, 0.0))
        return TaughtRobot(robot=Robot(name="new robot", links=(first, second)))

    def shipped(self, name: str) -> TaughtRobot:
        """A shipped robot, or a robot file of the project."""
        robot = formats.load_robot(self._folder.robot_path(name, formats.list_robots()))
        return TaughtRobot(robot=robot)

    def edited(self, value: TaughtRobot, version: int = 0) -> RobotDocument:
        """A robot in the editor."""
        return RobotDocument(value, version=version)

    def from_file(self, data: bytes, place: Path) -> TaughtRobot:
        """The robot of a project file with its poses; the robot refers to its file."""
        (robot,) = formats.read_robots(data, place.name).values()
        poses = read_poses(data, place.name, robot.nq)
        return TaughtRobot(robot=replace(robot, source=str(place)), poses=poses)

    def to_file(self, value: TaughtRobot, place: Path) -> bytes:
        """The canonical document of the robot."""
        return formats.write_robot(value.robot, value.poses)

    def renamed(self, value: TaughtRobot, place: Path) -> TaughtRobot:
        """Return the robot unchanged: its name does not depend on its file name."""
        return value

    def from_text(self, text: str, where: str) -> TaughtRobot:
        """Read a robot from its journal."""
        with warnings.catch_warnings():  # the tables show these warnings as findings
            warnings.simplefilter("ignore", ArmblocksWarning)
            (robot,) = formats.read_robots(text.encode(), "journal.json").values()
        return TaughtRobot(robot=robot, poses=read_poses(text.encode(), "journal.json", robot.nq))

    def to_text(self, value: TaughtRobot) -> str:
        """The canonical document."""
        return formats.write_robot(value.robot, value.poses).decode()

    def parts(self, value: TaughtRobot) -> int:
        """Number of links."""
        return len(value.robot.links)
