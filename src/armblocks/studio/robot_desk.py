"""The robots that are open in the studio: their files, their edits, and what pages are told of them."""

from __future__ import annotations

import asyncio
import base64
import dataclasses
import secrets
import warnings
from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, Protocol

from armblocks import formats
from armblocks.errors import ArmblocksWarning, FormatError, InputError, UnknownNameError
from armblocks.face.arm import Arm
from armblocks.report.arm_drawing import arm_picture_svg
from armblocks.robot import Robot, standard_dh
from armblocks.studio import robot_messages as say
from armblocks.studio.history import History
from armblocks.studio.project_folder import Fingerprint, ProjectFolder
from armblocks.studio.robot_edits import robot_applied, robot_summary
from armblocks.studio.robot_readings import readings
from armblocks.studio.robot_scene import link_frames_of, scene_of
from armblocks.studio.robot_tables import robot_shown, robot_tables

if TYPE_CHECKING:
    from armblocks.studio.hub import Page

MOST_ROBOTS = 100
MOST_KEYS = 1000
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


@dataclasses.dataclass(eq=False, kw_only=True)
class OpenRobot:
    """A robot with its past, its file, and the compiled arm of its present form."""

    key: str
    history: History[Robot]
    path: str | None = None
    on_disk: Fingerprint | None = None
    shipped: str = ""
    notes: tuple[str, ...] = ()
    seen: deque[str] = dataclasses.field(default_factory=lambda: deque(maxlen=MOST_KEYS))
    reading: asyncio.Lock = dataclasses.field(default_factory=asyncio.Lock)
    _arm: Arm | None = None

    @property
    def robot(self) -> Robot:
        """The robot as it is now."""
        return self.history.value

    @property
    def arm(self) -> Arm:
        """Its equations, compiled when first asked for."""
        if self._arm is None or self._arm.robot is not self.robot:
            self._arm = Arm(self.robot)
        return self._arm

    def shown(self) -> say.RobotShown:
        """How it stands, for pages."""
        return robot_shown(self.key, self.history, self.path, self.shipped, self.notes)


class RobotDesk:
    """Carries out what pages ask of robots, and tells every page that shows one what became of it."""

    def __init__(self, folder: ProjectFolder, drawings: Drawings) -> None:
        self.robots: dict[str, OpenRobot] = {}
        self._folder = folder
        self._drawings = drawings
        self._shows: dict[Page, set[str]] = {}

    async def welcome(self, page: Page) -> None:
        """A page has come: it is told of every open robot, so that none is lost by a reload."""
        self._shows[page] = set(self.robots)
        for found in self.robots.values():
            await page.tell(found.shown())

    def leave(self, page: Page) -> None:
        """A page has gone; the robots stay open."""
        self._shows.pop(page, None)

    async def carry_out(self, page: Page, request: say.RobotRequest) -> Any:
        """Do what a page asks; the value goes into the reply. Raises ``ArmblocksError``."""
        match request:
            case say.RobotOpen():
                return await self._open(page, request)
            case say.RobotOfBlock():
                return await self._open_of_block(page, request)
            case say.RobotAttach():
                return await self._show(page, [self._known(request.robot)])
            case say.RobotChange() | say.RobotUndo() | say.RobotRedo():
                return await self._change(request)
            case say.RobotSave():
                return await self._save(request)
            case say.RobotForm():
                return robot_tables()
            case say.RobotBodies():
                return scene_of(self._known(request.robot).robot)
            case say.RobotPose():
                return link_frames_of(self._known(request.robot).robot, request.q)
            case say.RobotRead():
                return await self._read(request)
            case say.RobotPicture():
                return await self._picture(request)
            case say.Drop():
                return await self._drop(page, request)

    async def _tell(self, found: OpenRobot) -> None:
        event = found.shown()
        await asyncio.gather(*(page.tell(event) for page, keys in self._shows.items() if found.key in keys))

    # -- opening ---------------------------------------------------------------------------------------------

    def _known(self, key: str) -> OpenRobot:
        if key not in self.robots:
            raise UnknownNameError("open robot", key, self.robots)
        return self.robots[key]

    def _add(self, robot: Robot, **facts: Any) -> OpenRobot:
        if len(self.robots) >= MOST_ROBOTS:
            raise InputError(
                f"{len(self.robots)} robots are open",
                allowed=f"at most {MOST_ROBOTS}",
                fix="restart the studio",
                where="studio",
            )
        found = OpenRobot(key=secrets.token_hex(8), history=History(robot), **facts)
        self.robots[found.key] = found
        return found

    async def _show(self, page: Page, opened: Sequence[OpenRobot], notes: Sequence[str] = ()) -> say.Opening:
        for found in opened:
            self._shows.setdefault(page, set()).add(found.key)
            await page.tell(found.shown())
        spots = [say.RobotSpot(robot=found.key, name=found.robot.name) for found in opened]
        opening = say.Opening(robots=spots, document="", notes=list(notes))
        await page.tell(say.RobotOpened(opening=opening))
        return opening

    async def _open(self, page: Page, request: say.RobotOpen) -> say.Opening:
        if request.shipped:
            robot = formats.load_robot(self._folder.robot_path(request.shipped, formats.list_robots()))
            return await self._show(page, [self._add(robot, shipped=request.shipped)])
        if request.path:
            return await self.open_file(page, request.path)
        return await self._show(page, [self._add(new_robot())])

    async def open_file(self, page: Page, path: str) -> say.Opening:
        """Open a robot file of the project, or the one that is open already."""
        for found in self.robots.values():
            if found.path == path:
                return await self._show(page, [found])
        data, on_disk = self._folder.read_known(path)
        robots, notes = _read(data, path)
        kept = path.lower().endswith(".json")  # a script is read, and saved as a file of ours
        opened = [
            self._add(
                dataclasses.replace(robot, source=str(self._folder.path(path))),
                path=path if kept else None,
                on_disk=on_disk if kept else None,
                notes=notes,
            )
            for robot in robots.values()
        ]
        return await self._show(page, opened, notes)

    async def _open_of_block(self, page: Page, request: say.RobotOfBlock) -> say.Opening:
        robot = self._drawings.block_robot(request.document, request.inside, request.block)
        place = Path(robot.source)
        if place.suffix.lower() == ".json" and place.is_relative_to(self._folder.root) and place.is_file():
            return await self.open_file(page, place.relative_to(self._folder.root).as_posix())
        shipped = robot.source if robot.source in formats.list_robots() else ""
        return await self._show(page, [self._add(robot, shipped=shipped)])

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
        return await self._show(page, [self._add(robot, notes=notes) for robot in robots.values()], notes)

    # -- changing and saving ---------------------------------------------------------------------------------

    async def _change(self, request: say.RobotChange | say.RobotUndo | say.RobotRedo) -> int:
        found = self._known(request.robot)
        history = found.history
        match request:
            case say.RobotChange():
                if request.key in found.seen:
                    return history.version
                with warnings.catch_warnings():  # what it warns of stands among the findings
                    warnings.simplefilter("ignore", ArmblocksWarning)
                    after = robot_applied(request.edit, found.robot)
                history.replace(robot_summary(request.edit), after, request.gesture)
                found.seen.append(request.key)
            case say.RobotUndo():
                history.undo()
            case say.RobotRedo():
                history.redo()
        await self._tell(found)
        return history.version

    async def _save(self, request: say.RobotSave) -> str:
        found = self._known(request.robot)
        path = request.path or found.path
        if not path:
            raise FormatError(
                "the robot has no file yet",
                allowed="a path",
                fix="save it under a name",
                where=f"robot '{found.robot.name}'",
            )
        disk, _ = self._folder.compared(path, found.on_disk)
        if path == found.path and disk == "changed" and not request.overwrite:
            raise FormatError(
                "the robot's file has changed on the disk since it was opened",
                where=path,
                allowed="to overwrite it, or to save under another name",
                fix="choose one of the two",
            )
        if path != found.path and disk != "gone" and not request.overwrite:
            raise FormatError(
                "there is a file of this name already", where=path, fix="overwrite it, or choose another"
            )
        place = self._folder.path(path)
        on_disk = self._folder.write(path, formats.write_robot(found.robot))
        found.history.saved = found.history.value
        found.path, found.on_disk, found.shipped = path, on_disk, ""
        await self._tell(found)
        await self._drawings.robot_saved(dataclasses.replace(found.robot, source=str(place)))
        return path

    # -- looking ---------------------------------------------------------------------------------------------

    async def _read(self, request: say.RobotRead) -> say.Readings:
        found = self._known(request.robot)
        async with found.reading:  # of many that come while one compiles, each finds it compiled
            arm = found.arm
            return await asyncio.to_thread(readings, arm, request.q, request.qd, request.qdd)

    async def _picture(self, request: say.RobotPicture) -> str:
        robot = (
            self._drawings.block_robot(request.document, request.inside, request.block)
            if request.block
            else self._known(request.robot).robot
        )
        link_frames_of(robot, request.q)  # refuses a wrong count
        return await asyncio.to_thread(arm_picture_svg, robot, request.q, _PICTURE_SIZE, request.theme)


def new_robot() -> Robot:
    """What a new robot begins as: two links of half a metre."""
    first = standard_dh("link1", a=0.5, mass=1.0, centre_of_mass=(-0.25, 0.0, 0.0))
    second = standard_dh("link2", parent="link1", a=0.5, mass=1.0, centre_of_mass=(-0.25, 0.0, 0.0))
    return Robot(name="new robot", links=(first, second))


def _read(data: bytes, name: str) -> tuple[Mapping[str, Robot], tuple[str, ...]]:
    """The robots of a file, and what was said while it was read."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ArmblocksWarning)
        robots = formats.read_robots(data, name)
    if not robots:
        raise FormatError(
            "the file defines no robot",
            where=name,
            allowed="kuka = robot(L, …) or SerialLink(L, …)",
            fix="let the script make a robot, or choose another file",
        )
    said = [str(one.message) for one in caught if issubclass(one.category, ArmblocksWarning)]
    return robots, tuple(dict.fromkeys(said))
