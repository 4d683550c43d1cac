"""The robots that are open in the studio: their files, their edits, and what pages are told of them."""

from __future__ import annotations

import asyncio
import base64
import dataclasses
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path, PurePath
from typing import Protocol, TypeVar

from armblocks import formats
from armblocks.errors import ArmblocksWarning, FormatError, InputError
from armblocks.rendering.arm_drawing import arm_picture_svg
from armblocks.robot import Robot
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.documents.state_folder import StateFolder
from armblocks.studio.protocol.answers import Answers
from armblocks.studio.protocol.messages import robots as say
from armblocks.studio.protocol.messages.documents import Recover
from armblocks.studio.protocol.page import Page
from armblocks.studio.protocol.robot_scene import RobotScene
from armblocks.studio.robots.open_robots import OpenRobot, OpenRobots
from armblocks.studio.robots.readings import readings
from armblocks.studio.robots.scene import link_frames_of, scene_of
from armblocks.studio.robots.tables import robot_tables

Result = TypeVar("Result")
_PICTURE_SIZE = (760.0, 560.0)


class Drawings(Protocol):
    """What the desk needs of the open diagrams."""

    def block_robot(self, document: str, path: Sequence[str], block: str) -> Robot:
        """The robot that a block of an open diagram uses."""
        ...

    async def show_diagram(self, page: Page, data: bytes, name: str) -> str:
        """Open a diagram that has no file yet; its key."""
        ...

    async def robot_saved(self, robot: Robot) -> None:
        """The file that is the robot's source has changed: diagrams that use it take the robot anew."""
        ...


class RobotDesk:
    """Carries out what pages ask of robots, and tells every page that shows one what became of it."""

    def __init__(self, folder: ProjectFolder, kept: StateFolder, drawings: Drawings) -> None:
        self.robots = OpenRobots(folder, kept)
        self._folder = folder
        self._drawings = drawings
        self._shows: dict[Page, set[str]] = {}

    async def welcome(self, page: Page) -> None:
        """A page has come: it is told of every open robot, so that none is lost by a reload."""
        self._shows[page] = {found.key for found in self.robots}
        for found in self.robots:
            await page.tell(found.shown())

    def leave(self, page: Page) -> None:
        """A page has gone; the robots stay open."""
        self._shows.pop(page, None)

    def register(self, answers: Answers) -> None:
        """Register what answers the requests about robots."""
        answers.on(say.RobotOpen, self._open)
        answers.on(say.RobotOfBlock, self._open_of_block)
        answers.on(say.RobotAttach, self._attach)
        for alteration in (say.RobotChange, say.RobotUndo, say.RobotRedo, say.RobotReload):
            answers.on(alteration, self._change)
        answers.on(say.RobotKeepMine, self._keep_mine)
        answers.on(say.RobotSave, self._save)
        answers.on(say.RobotForm, self._form)
        answers.on(say.RobotBodies, self._bodies)
        answers.on(say.RobotPose, self._pose)
        answers.on(say.RobotRead, self._read)
        answers.on(say.RobotPicture, self._picture)
        answers.on(say.Drop, self._drop)

    async def tell(self, found: OpenRobot) -> None:
        """Tell every page that shows a robot how it stands."""
        event = found.shown()
        await asyncio.gather(*(page.tell(event) for page, keys in self._shows.items() if found.key in keys))

    # -- opening ---------------------------------------------------------------------------------------------

    async def recover(self, page: Page, request: Recover) -> str | None:
        """Do with a robot that its journal gives back what the user chose; its key where it is open now."""
        found = await self.robots.recover(request)
        if found is None:
            return None
        await self._show(page, [found])
        return found.key

    async def _show(
        self, page: Page, opened: Sequence[OpenRobot], notes: Sequence[str] = (), *, come: bool = True
    ) -> say.Opening:
        """Show a page robots that are open; ``come``: to its screen."""
        for found in opened:
            self._shows.setdefault(page, set()).add(found.key)
            await page.tell(found.shown())
        spots = [say.RobotSpot(robot=found.key, name=found.robot.name) for found in opened]
        opening = say.Opening(robots=spots, document="", notes=list(notes))
        if come:
            await page.tell(say.RobotOpened(opening=opening))
        return opening

    async def _attach(self, page: Page, request: say.RobotAttach) -> say.Opening:
        found = self.robots.attach(request.robot, request.path, request.shipped)
        return await self._show(page, [found], come=False)

    async def _open(self, page: Page, request: say.RobotOpen) -> say.Opening:
        if request.shipped:
            return await self._show(page, [self.robots.open_shipped(request.shipped)])
        if request.path:
            return await self.open_file(page, request.path)
        return await self._show(page, [self.robots.new()])

    async def open_file(self, page: Page, path: str) -> say.Opening:
        """Open a robot file of the project, or the one that is open already."""
        if path.lower().endswith(".json"):
            found, notes = _noted(lambda: self.robots.open_path(path))
            found.notes = notes or found.notes
            return await self._show(page, [found], found.notes)
        # A script is read, and saved as a file of ours.
        robots, notes = _read(self._folder.read(path), path)
        source = str(self._folder.path(path))
        return await self._show(
            page, self._add((dataclasses.replace(r, source=source) for r in robots.values()), notes), notes
        )

    def _add(self, robots: Iterable[Robot], notes: tuple[str, ...]) -> list[OpenRobot]:
        """Robots that have no file."""
        opened = [self.robots.bring(robot) for robot in robots]
        for found in opened:
            found.notes = notes
        return opened

    async def _open_of_block(self, page: Page, request: say.RobotOfBlock) -> say.Opening:
        robot = self._drawings.block_robot(request.document, request.inside, request.block)
        place = Path(robot.source)
        if place.suffix.lower() == ".json" and place.is_relative_to(self._folder.root) and place.is_file():
            return await self.open_file(page, place.relative_to(self._folder.root).as_posix())
        shipped = robot.source if robot.source in formats.list_robots() else ""
        found = self.robots.add(robot, origin=shipped) if shipped else self.robots.bring(robot)
        return await self._show(page, [found])

    async def _drop(self, page: Page, request: say.Drop) -> say.Opening:
        suffix = PurePath(request.name).suffix.lower()
        if suffix not in (".m", ".json"):
            raise FormatError(
                f"'{suffix or request.name[:40]}' is no kind of file that can be dropped here",
                where=request.name[:80],
                allowed=".m (a robot script of the toolbox) or .json (a robot or a diagram)",
                fix="save it as one of these",
            )
        try:
            data = base64.b64decode(request.content, validate=True)
        except ValueError:  # binascii.Error, or letters that are not ASCII
            raise InputError(
                "the content is not base64",
                where=request.name[:80],
                allowed="base64",
                fix="drop the file again",
            ) from None
        if len(data) > say.MOST_DROPPED:
            raise FormatError(
                f"the file has {len(data)} bytes",
                where=request.name[:80],
                allowed=f"at most {say.MOST_DROPPED}",
                fix="choose a smaller file",
            )
        if formats.kind_of_data(data, request.name) is not formats.DocumentKind.ROBOT:
            key = await self._drawings.show_diagram(page, data, request.name)
            return say.Opening(robots=[], document=key, notes=[])
        robots, notes = _read(data, request.name)
        return await self._show(page, self._add(robots.values(), notes), notes)

    # -- changing and saving ---------------------------------------------------------------------------------

    async def _keep_mine(self, _: Page, request: say.RobotKeepMine) -> None:
        found = self.robots[request.robot]
        self.robots.keep_mine(found)
        await self.tell(found)

    async def _change(
        self, _: Page, request: say.RobotChange | say.RobotUndo | say.RobotRedo | say.RobotReload
    ) -> int:
        found = self.robots[request.robot]
        if isinstance(request, say.RobotReload):
            self.robots.reload(found, request.key)
        elif not self.robots.perform(found, request):
            return found.document.version
        await self.tell(found)
        return found.document.version

    async def _save(self, _: Page, request: say.RobotSave) -> str:
        found = self.robots[request.robot]
        try:
            path = await self.robots.save(found, request.path, overwrite=request.overwrite)
        finally:
            await self.tell(found)
        source = str(self._folder.path(path))
        await self._drawings.robot_saved(dataclasses.replace(found.robot, source=source))
        return path

    # -- looking ---------------------------------------------------------------------------------------------

    async def _form(self, _: Page, request: say.RobotForm) -> say.RobotTables:
        return robot_tables()

    async def _bodies(self, _: Page, request: say.RobotBodies) -> RobotScene:
        return scene_of(self.robots[request.robot].robot)

    async def _pose(self, _: Page, request: say.RobotPose) -> list[list[list[float]]]:
        return link_frames_of(self.robots[request.robot].robot, request.q)

    async def _read(self, _: Page, request: say.RobotRead) -> say.Readings:
        found = self.robots[request.robot]
        async with found.reading:  # of many that come while one compiles, each finds it compiled
            arm = found.arm
            return await asyncio.to_thread(readings, arm, request.q, request.qd, request.qdd)

    async def _picture(self, _: Page, request: say.RobotPicture) -> str:
        robot = (
            self._drawings.block_robot(request.document, request.inside, request.block)
            if request.block
            else self.robots[request.robot].robot
        )
        link_frames_of(robot, request.q)  # refuses a wrong count
        return await asyncio.to_thread(arm_picture_svg, robot, request.q, _PICTURE_SIZE, request.theme)


def _read(data: bytes, name: str) -> tuple[Mapping[str, Robot], tuple[str, ...]]:
    """The robots of a file, and what was said while it was read."""
    robots, notes = _noted(lambda: formats.read_robots(data, name))
    if not robots:
        raise FormatError(
            "the file defines no robot",
            where=name,
            allowed="kuka = robot(L, …) or SerialLink(L, …)",
            fix="let the script make a robot, or choose another file",
        )
    return robots, notes


def _noted(read: Callable[[], Result]) -> tuple[Result, tuple[str, ...]]:
    """What is read, and what was warned of meanwhile."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ArmblocksWarning)
        result = read()
    said = [str(one.message) for one in caught if issubclass(one.category, ArmblocksWarning)]
    return result, tuple(dict.fromkeys(said))
