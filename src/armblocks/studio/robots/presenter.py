"""Opening and display of robots, with the warnings from reading their file."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Awaitable, Callable, Iterable, Mapping
from typing import TypeVar

from armblocks import formats
from armblocks.errors import ArmblocksWarning, FormatError
from armblocks.formats.file_findings import FileContext
from armblocks.robot import Robot
from armblocks.studio.documents.presenter import Opening, Place, Presenter
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.protocol.messages.robots import RobotChange, RobotContent
from armblocks.studio.robots.open_robots import OpenRobot, OpenRobots
from armblocks.studio.robots.tables import robot_content

Result = TypeVar("Result")


class RobotPresenter(Presenter[OpenRobot]):
    """Shows the tables of robots in clients; ``robot_saved`` is called with every saved robot."""

    def __init__(
        self,
        files: OpenRobots,
        folder: ProjectFolder,
        robot_saved: Callable[[Robot], Awaitable[None]],
    ) -> None:
        super().__init__(files)
        self._folder = folder
        self._robot_saved = robot_saved

    def open_file(self, path: str) -> Opening[OpenRobot]:
        """Open the robot of a file, or the robots of a script; robots of a script have no file yet."""
        if path.lower().endswith(".json"):
            open_file, notes = _with_warnings(lambda: self.files.open_path(path))
            open_file.notes = notes or open_file.notes
            return Opening([open_file], open_file.notes)
        place = FileContext(folder=self._folder.path(path).parent, root=self._folder.root)
        robots, notes = _read(self._folder.read(path), path, place)
        source = str(self._folder.path(path))
        return self._opened_without_file(
            (dataclasses.replace(robot, source=source) for robot in robots.values()), notes
        )

    def dropped(self, data: bytes, name: str) -> Opening[OpenRobot]:
        """Open the robots of a file or script from outside the project."""
        robots, notes = _read(data, name, FileContext())
        return self._opened_without_file(robots.values(), notes)

    def content(self, open_file: OpenRobot, place: Place) -> RobotContent:
        """Return the tables of a robot."""
        return _content(open_file)

    def change(self, open_file: OpenRobot, before: Robot, place: Place) -> RobotChange:
        """Return the complete robot; changes are not split."""
        return RobotChange(content=_content(open_file))

    async def on_saved(self, open_file: OpenRobot) -> None:
        """Update the diagrams that use the robot."""
        if open_file.path is not None:
            source = str(self._folder.path(open_file.path))
            await self._robot_saved(dataclasses.replace(open_file.robot, source=source))

    def _opened_without_file(self, robots: Iterable[Robot], notes: tuple[str, ...]) -> Opening[OpenRobot]:
        """Open robots that have no file."""
        opened = [self.files.open_value(robot) for robot in robots]
        for open_file in opened:
            open_file.notes = notes
        return Opening(opened, notes)


def _content(open_file: OpenRobot) -> RobotContent:
    return robot_content(open_file.robot, open_file.published if open_file.path is None else ())


def _read(data: bytes, name: str, context: FileContext) -> tuple[Mapping[str, Robot], tuple[str, ...]]:
    """Return the robots of a file, and the warnings issued while it was read."""
    robots, notes = _with_warnings(lambda: formats.read_robots(data, name, context))
    if not robots:
        raise FormatError(
            "the file defines no robot",
            where=name,
            allowed="kuka = robot(L, …) or SerialLink(L, …)",
            fix="define a robot in the script, or choose another file",
        )
    return robots, notes


def _with_warnings(read: Callable[[], Result]) -> tuple[Result, tuple[str, ...]]:
    """Return the result of ``read`` and the warnings that it issued."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ArmblocksWarning)
        result = read()
    texts = [str(warning.message) for warning in caught if issubclass(warning.category, ArmblocksWarning)]
    return result, tuple(dict.fromkeys(texts))
