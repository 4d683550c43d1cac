"""Where pages, documents and runs meet: one hub a server, on one event loop."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import secrets
import warnings
from collections import deque
from collections.abc import Awaitable, Callable, Sequence
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from starlette.websockets import WebSocketDisconnect

from armblocks import formats
from armblocks.blocks import BLOCKS
from armblocks.diagram import Diagram
from armblocks.errors import ArmblocksError, FormatError, InertiaWarning, InputError, UnknownNameError
from armblocks.robot import Robot
from armblocks.studio import messages as say
from armblocks.studio.check import check
from armblocks.studio.document import Document
from armblocks.studio.nesting import inside, with_inside, with_robot
from armblocks.studio.parameter_values import parameter_json, parameter_value
from armblocks.studio.project_folder import FileState, ProjectFolder
from armblocks.studio.robot_desk import RobotDesk
from armblocks.studio.robot_scene import link_frames_of, scene_of
from armblocks.studio.run_process import RunProcess, Worker
from armblocks.studio.run_settings import setting_rules, solver_choices
from armblocks.studio.sheet import arranged, library, placed, sheet, sheet_change
from armblocks.studio.typed_settings import setting_faults

MOST_DOCUMENTS = 100
MOST_KEYS = 1000
"""Keys of edits that are remembered, so that one sent twice is done once."""

GONE = (RuntimeError, ConnectionError, WebSocketDisconnect)
"""What sending to a page raises that has left."""
SendText = Callable[[str], Awaitable[None]]
SendBytes = Callable[[bytes], Awaitable[None]]


@dataclasses.dataclass(eq=False)
class Page:
    """One page that is connected: how to reach it, and what it shows."""

    send_text: SendText
    send_bytes: SendBytes
    shows: dict[str, tuple[str, ...]] = dataclasses.field(default_factory=dict[str, tuple[str, ...]])
    """Documents that it shows, and the path of the sheet that it looks at."""

    async def tell(self, event: say.Message) -> None:
        """Send an event; a page that is gone is nobody's trouble."""
        text = event.model_dump_json()
        with contextlib.suppress(*GONE):
            await self.send_text(text)


@dataclasses.dataclass(eq=False, kw_only=True)
class OpenDocument:
    """A document with its file and the background check that looks at it."""

    key: str
    document: Document
    path: str | None
    on_disk: FileState | None
    seen: deque[str] = dataclasses.field(default_factory=lambda: deque(maxlen=MOST_KEYS))
    checking: asyncio.Task[None] | None = None

    def state(self) -> say.DocumentState:
        """Where it stands, for pages."""
        document = self.document
        return say.DocumentState(
            document=self.key,
            version=document.version,
            title=document.diagram.name,
            path=self.path,
            dirty=document.dirty,
            undo=document.undo_title,
            redo=document.redo_title,
        )


class Hub:
    """Carries out what pages ask, and tells every page that shows a document what became of it."""

    def __init__(self, folder: ProjectFolder) -> None:
        self.folder = folder
        self.pages: set[Page] = set()
        self.documents: dict[str, OpenDocument] = {}
        self.runs: dict[str, RunProcess] = {}
        self.robots = RobotDesk(folder, self)
        self._spare: Worker | None = None

    def prepare(self) -> None:
        """Have a process ready for the first run."""
        self._spare = Worker()

    # -- pages -----------------------------------------------------------------------------------------------

    async def welcome(self, page: Page) -> None:
        """A page has come."""
        self.pages.add(page)
        await page.tell(
            say.Welcome(
                version=version("armblocks"),
                library=list(library()),
                robots=list(formats.list_robots()),
                solvers=solver_choices(),
                settings=setting_rules(),
                examples=_examples(),
                files=self.folder.files(),
                documents=[document.state() for document in self.documents.values()],
            )
        )

    def leave(self, page: Page) -> None:
        """A page has gone; what it showed stays open for when it returns."""
        self.pages.discard(page)
        self.robots.leave(page)

    async def answer(self, page: Page, text: str) -> None:
        """Carry out one request and reply to it, whatever becomes of it."""
        envelope = say.Envelope.model_validate_json(text)
        try:
            reply = say.Reply(number=envelope.number, value=await self.carry_out(page, envelope.request))
        except ArmblocksError as error:
            fault = say.Fault(what=error.what, where=error.where, allowed=error.allowed, fix=error.fix)
            reply = say.Reply(number=envelope.number, fault=fault)
        await page.tell(reply)

    async def carry_out(self, page: Page, request: say.Request) -> Any:
        """Do what a page asks; the value goes into the reply. Raises ``ArmblocksError``."""
        match request:
            case say.Open(path=path) if path and self._is_robot_file(path):
                return await self.robots.open_file(page, path)
            case say.Open():
                return await self._show(page, self._open(request))
            case say.New():
                return await self._show(page, self._add(Diagram(name="untitled", blocks={}), None))
            case say.Attach():
                return await self._show(page, self._known(request.document))
            case say.Look():
                return await self._show(page, self._known(request.document), tuple(request.inside))
            case say.Change() | say.Undo() | say.Redo() | say.ArrangeBlocks():
                return await self._change(request)
            case say.Save():
                return await self._save(request)
            case say.TypedValue():
                return self._typed(request)
            case say.TypedSettings():
                options = self._known(request.document).document.diagram.settings
                return setting_faults(options, request.values)
            case say.Scene():
                return scene_of(self.block_robot(request.document, request.inside, request.block))
            case say.Pose():
                robot = self.block_robot(request.document, request.inside, request.block)
                return link_frames_of(robot, request.q)
            case say.Run():
                return await self._run(request)
            case say.Control() | say.SetSpeed() | say.Rewind() | say.Tune():
                return self._known_run(request.run).obey(request)
            case _:
                return await self.robots.carry_out(page, request)

    async def tell_all(self, document: str, event: say.Message) -> None:
        """Tell every page that shows a document."""
        await asyncio.gather(*(page.tell(event) for page in self.pages if document in page.shows))

    # -- documents -------------------------------------------------------------------------------------------

    def _known(self, key: str) -> OpenDocument:
        if key not in self.documents:
            raise UnknownNameError("open document", key, self.documents)
        return self.documents[key]

    def _add(self, diagram: Diagram, path: str | None) -> OpenDocument:
        if len(self.documents) >= MOST_DOCUMENTS:
            raise InputError(
                f"{len(self.documents)} documents are open",
                allowed=f"at most {MOST_DOCUMENTS}",
                fix="restart the studio",
            )
        key = secrets.token_hex(8)
        found = OpenDocument(
            key=key,
            document=Document(placed(diagram), self.resolve_robot),
            path=path,
            on_disk=self.folder.state(path) if path else None,
        )
        self.documents[key] = found
        return found

    def _open(self, request: say.Open) -> OpenDocument:
        if request.example:
            known = formats.list_examples()
            if request.example not in known:
                raise UnknownNameError("example", request.example, known)
            return self._add(formats.load_diagram(request.example, BLOCKS), None)
        for open_document in self.documents.values():
            if open_document.path == request.path:
                return open_document
        data = self.folder.read(request.path)
        place = self.folder.path(request.path)
        diagram = formats.diagram_from_bytes(
            data, place.name, BLOCKS, self.resolve_robot, folder=place.parent, draft=True
        )
        return self._add(diagram, request.path)

    async def _show(self, page: Page, found: OpenDocument, path: tuple[str, ...] = ()) -> str:
        shown = inside(found.document.diagram, path)
        page.shows[found.key] = path
        await page.tell(say.Opened(state=found.state(), inside=list(path), sheet=sheet(shown)))
        self._check_later(found)
        return found.key

    async def _change(self, request: say.Change | say.Undo | say.Redo | say.ArrangeBlocks) -> int:
        found = self._known(request.document)
        document = found.document
        before, version_before = document.diagram, document.version
        match request:
            case say.Change():
                if request.key in found.seen:
                    return document.version
                document.edit(request.edit, request.inside)
                found.seen.append(request.key)
            case say.Undo():
                document.undo()
            case say.Redo():
                document.redo()
            case say.ArrangeBlocks():
                inner = arranged(inside(document.diagram, request.inside))
                document.replace("arrange", with_inside(document.diagram, request.inside, inner))
        for page in [page for page in self.pages if found.key in page.shows]:
            await self._tell_change(page, found, before, version_before)
        self._check_later(found)
        return document.version

    async def _tell_change(
        self, page: Page, found: OpenDocument, before: Diagram, version_before: int
    ) -> None:
        """Tell a page what changed on the sheet that it looks at."""
        path = page.shows[found.key]
        try:
            old, new = inside(before, path), inside(found.document.diagram, path)
        except UnknownNameError:  # the subsystem is gone, or has just come back
            await self._show(page, found)
            return
        change = sheet_change(old, new)
        await page.tell(say.Changed(state=found.state(), before=version_before, change=change))

    async def _save(self, request: say.Save) -> str:
        found = self._known(request.document)
        path = request.path or found.path
        if not path:
            raise FormatError("the drawing has no file yet", allowed="a path", fix="save it under a name")
        now = self.folder.state(path)
        if now != found.on_disk and path == found.path and not request.overwrite:
            raise FormatError(
                "the file has changed on the disk since it was opened",
                where=path,
                allowed="to overwrite it, or to save under another name",
                fix="choose one of the two",
            )
        if path != found.path and now is not None and not request.overwrite:
            raise FormatError(
                "there is such a file already", where=path, fix="overwrite it, or choose another"
            )
        diagram = found.document.diagram
        if path != found.path:
            diagram = dataclasses.replace(diagram, name=Path(path).stem)
            found.document.rename(diagram.name)
            diagram = found.document.diagram
        target = self.folder.path(path)
        self.folder.write(path, formats.diagram_to_bytes(diagram, self.resolve_robot, folder=target.parent))
        found.path, found.on_disk = path, self.folder.state(path)
        found.document.saved = diagram
        version_now = found.document.version
        event = say.Changed(state=found.state(), before=version_now, change=sheet_change(diagram, diagram))
        await self.tell_all(found.key, event)
        return path

    def resolve_robot(self, name: str) -> Robot:
        """A shipped robot or a robot file of the project."""
        with warnings.catch_warnings():  # the robot editor marks them
            warnings.simplefilter("ignore", InertiaWarning)
            return formats.load_robot(self.folder.robot_path(name, formats.list_robots()))

    # -- robots ----------------------------------------------------------------------------------------------

    def _is_robot_file(self, path: str) -> bool:
        return path.lower().endswith(".m") or formats.holds_robot(self.folder.read(path))

    def block_robot(self, document: str, path: Sequence[str], block: str) -> Robot:
        """The robot that a block of an open diagram uses."""
        level = inside(self._known(document).document.diagram, path)
        robot = getattr(level.block(block), "robot", None)
        if not isinstance(robot, Robot):
            raise InputError("the block has no robot", where=f"block '{block}'", allowed="a robot block")
        return robot

    async def show_diagram(self, page: Page, data: bytes, name: str) -> str:
        """Open a diagram that has no file yet; its key."""
        diagram = formats.diagram_from_bytes(
            data, name, BLOCKS, self.resolve_robot, folder=self.folder.root, draft=True
        )
        return await self._show(page, self._add(diagram, None))

    async def robot_saved(self, robot: Robot) -> None:
        """The file of a robot has changed: diagrams that use it take it anew, as a step of undo."""
        for found in self.documents.values():
            document = found.document
            before, version_before = document.diagram, document.version
            after = with_robot(before, robot)
            if after is before:
                continue
            document.replace(f"new form of {robot.name}", after)
            for page in [page for page in self.pages if found.key in page.shows]:
                await self._tell_change(page, found, before, version_before)
            self._check_later(found)

    def _typed(self, request: say.TypedValue) -> Any:
        rules = {rule.name: rule for rule in BLOCKS[request.type].parameters()}
        if request.parameter not in rules:
            raise UnknownNameError(f"parameter of {request.type}", request.parameter, rules)
        value = parameter_value(rules[request.parameter], request.text, request.type, self.resolve_robot)
        return parameter_json(value)

    # -- the background check --------------------------------------------------------------------------------

    def _check_later(self, found: OpenDocument) -> None:
        """Look at the drawing once it has stood still for a moment; what is under way is forgotten."""
        if found.checking is not None:
            found.checking.cancel()
        found.checking = asyncio.get_running_loop().create_task(self._check(found))

    async def _check(self, found: OpenDocument) -> None:
        await asyncio.sleep(0.15)
        diagram, version_now = found.document.diagram, found.document.version
        findings, wires = await asyncio.to_thread(check, diagram)
        if found.document.version == version_now:
            event = say.Checked(document=found.key, version=version_now, findings=findings, wires=wires)
            await self.tell_all(found.key, event)

    # -- runs ------------------------------------------------------------------------------------------------

    def _known_run(self, key: str) -> RunProcess:
        if key not in self.runs:
            raise UnknownNameError("run", key, self.runs)
        return self.runs[key]

    async def _run(self, request: say.Run) -> str:
        found = self._known(request.document)

        async def tell(event: say.Message | bytes) -> None:
            if isinstance(event, bytes):
                pages = [page for page in self.pages if found.key in page.shows]
                with contextlib.suppress(*GONE):
                    await asyncio.gather(*(page.send_bytes(event) for page in pages))
            else:
                await self.tell_all(found.key, event)

        for other in list(self.runs.values()):
            if other.document == found.key:
                other.end()
                del self.runs[other.key]
        job = {
            "diagram": formats.diagram_to_bytes(
                found.document.diagram, self.resolve_robot, folder=self.folder.root
            ).decode(),
            "folder": str(self.folder.root),
            "speed": request.speed,
            "tuned": request.tuned,
        }
        run = RunProcess(secrets.token_hex(8), found.key, self._spare or Worker(), tell)
        self.runs[run.key] = run
        run.start(job)
        self._spare = Worker()
        return run.key

    def close(self) -> None:
        """End every run."""
        for run in self.runs.values():
            run.end()
        if self._spare is not None:
            self._spare.end()


@lru_cache(maxsize=1)
def _examples() -> dict[str, str]:
    """What the examples show, by name; they are read once, and not for each page that comes."""
    return {name: formats.load_diagram(name, BLOCKS).description for name in formats.list_examples()}
