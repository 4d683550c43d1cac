"""The open documents of both kinds: handlers of requests, and notifications to pages."""

from __future__ import annotations

import asyncio
import base64
import contextlib
from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Any

from armblocks import formats
from armblocks.errors import FormatError, InputError, UnknownNameError
from armblocks.studio.documents.open_files import OpenFile
from armblocks.studio.documents.presenter import Opening, Place, Presenter
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.protocol.answers import Answers
from armblocks.studio.protocol.messages import documents as say
from armblocks.studio.protocol.page import Page, Pages


class DocumentDesk:
    """Handles the requests about documents and notifies all pages that show a changed document."""

    def __init__(
        self, folder: ProjectFolder, pages: Pages, presenters: Mapping[say.DocumentKind, Presenter[Any]]
    ) -> None:
        self._folder = folder
        self._pages = pages
        self._presenters = presenters

    def register(self, answers: Answers) -> None:
        """Register the handlers of the requests about documents."""
        answers.on(say.Open, self._open)
        answers.on(say.OpenShipped, self._open_shipped)
        answers.on(say.Drop, self._drop)
        answers.on(say.New, self._new)
        answers.on(say.Attach, self._attach)
        for alteration in (say.Change, say.Undo, say.Redo, say.Reload):
            answers.on(alteration, self._alter)
        answers.on(say.KeepMine, self._keep_mine)
        answers.on(say.Save, self._save)
        answers.on(say.Close, self._close)
        answers.on(say.Recover, self._recover)

    def __contains__(self, key: str) -> bool:
        return any(key in presenter.files for presenter in self._presenters.values())

    def __getitem__(self, key: str) -> OpenFile[Any]:
        """Return the document with this key; raise ``UnknownNameError`` if there is none."""
        return self._found(key)[1]

    def states(self) -> list[say.DocumentState]:
        """The states of all open documents."""
        return [found.state() for presenter in self._presenters.values() for found in presenter.files]

    def recoveries(self) -> list[say.Recovery]:
        """The documents that can be recovered, the latest first."""
        offers = (offer for presenter in self._presenters.values() for offer in presenter.files.left.offers())
        return sorted(offers, key=lambda offer: -offer.last)

    def watch(self) -> list[asyncio.Task[None]]:
        """Start the tasks that watch the files of all documents for changes by other programs."""
        loop = asyncio.get_running_loop()
        watches = (presenter.files.watch(self.tell_state) for presenter in self._presenters.values())
        return [loop.create_task(watch) for watch in watches]

    def end(self) -> None:
        """Close all documents; journals of unsaved documents remain."""
        for presenter in self._presenters.values():
            presenter.files.end()

    async def show(
        self,
        page: Page,
        found: OpenFile[Any],
        place: Place = (),
        notes: Sequence[str] = (),
        *,
        in_front: bool = True,
    ) -> str:
        """Show a document on a page; return its key."""
        presenter, known = self._presenters[found.document.kind], found.key in page.shows
        page.shows[found.key] = place = presenter.place(found, place, known=known)
        content = presenter.content(found, place)
        event = say.Opened(state=found.state(), content=content, notes=list(notes), in_front=in_front)
        await page.tell(event)
        presenter.shown(page, found, known=known)
        await self.tell_list()
        return found.key

    async def replace(self, found: OpenFile[Any], title: str, value: Any) -> None:
        """Replace the value of a document as one undo step."""
        before, number = found.document.value, found.document.version
        self._presenters[found.document.kind].files.replace(found, title, value)
        await self._tell_change(found, before, number)

    # -- opening ---------------------------------------------------------------------------------------------

    async def _open(self, page: Page, request: say.Open) -> list[str]:
        return await self._show_all(page, self._presenter_of_file(request.path).open_file(request.path))

    async def _open_shipped(self, page: Page, request: say.OpenShipped) -> str:
        return await self.show(page, self._presenters[request.document_kind].files.open_shipped(request.name))

    async def _new(self, page: Page, request: say.New) -> str:
        return await self.show(page, self._presenters[request.document_kind].files.new())

    async def _attach(self, page: Page, request: say.Attach) -> str:
        files = self._presenters[request.document_kind].files
        found = files.attach(request.document, request.path, request.origin)
        return await self.show(page, found, tuple(request.inside), in_front=request.in_front)

    async def _drop(self, page: Page, request: say.Drop) -> list[str]:
        data = _dropped_data(request)
        is_robot = formats.kind_of_data(data, request.name) is formats.DocumentKind.ROBOT
        presenter = self._presenters["robot" if is_robot else "diagram"]
        return await self._show_all(page, presenter.dropped(data, request.name))

    async def _show_all(self, page: Page, opening: Opening[Any]) -> list[str]:
        """Show the first document of a file on the page; the others appear in its list of documents."""
        await self.show(page, opening.opened[0], notes=opening.notes)
        return [found.key for found in opening.opened]

    def _presenter_of_file(self, path: str) -> Presenter[Any]:
        with contextlib.suppress(FormatError):  # a file that can no longer be read may still be open
            if formats.kind_of_data(self._folder.read(path), path) is formats.DocumentKind.ROBOT:
                return self._presenters["robot"]
        return self._presenters["diagram"]

    # -- changing, saving, closing ---------------------------------------------------------------------------

    async def _alter(self, _: Page, request: say.Alteration) -> int:
        presenter, found = self._found(request.document)
        before, number = found.document.value, found.document.version
        if isinstance(request, say.Reload):
            presenter.files.reload(found, request.key)
        elif not presenter.files.perform(found, request):
            return number
        await self._tell_change(found, before, number)
        return found.document.version

    async def _keep_mine(self, _: Page, request: say.KeepMine) -> None:
        presenter, found = self._found(request.document)
        presenter.files.keep_mine(found)
        await self.tell_state(found)
        await self.tell_list()

    async def _save(self, _: Page, request: say.Save) -> str:
        presenter, found = self._found(request.document)
        try:
            path = await presenter.files.save(found, request.path, overwrite=request.overwrite)
        finally:
            await self.tell_state(found)
        await presenter.saved(found)
        await self.tell_list()
        return path

    async def _close(self, _: Page, request: say.Close) -> None:
        presenter, found = self._found(request.document)
        presenter.files.close(found, discard=request.discard)
        await self.tell_list()

    async def _recover(self, page: Page, request: say.Recover) -> str | None:
        files = [presenter.files for presenter in self._presenters.values()]
        holding = next((each for each in files if request.document in each.left), files[0])
        found = await holding.recover(request)
        if found is not None:
            return await self.show(page, found)
        await self.tell_list()
        return None

    def _found(self, key: str) -> tuple[Presenter[Any], OpenFile[Any]]:
        for presenter in self._presenters.values():
            if key in presenter.files:
                return presenter, presenter.files[key]
        raise UnknownNameError("open document", key, [state.document for state in self.states()])

    # -- notifications ---------------------------------------------------------------------------------------

    async def tell_list(self) -> None:
        """Notify all pages of the open and recoverable documents."""
        await self._pages.tell(say.Documents(documents=self.states(), recoveries=self.recoveries()))

    async def tell_state(self, found: OpenFile[Any]) -> None:
        """Notify the pages of a document of its state; its content has not changed."""
        await self._tell_versions(found, found.document.value, found.document.version)

    async def _tell_change(self, found: OpenFile[Any], before: Any, number: int) -> None:
        await self._tell_versions(found, before, number)
        self._presenters[found.document.kind].changed(found)

    async def _tell_versions(self, found: OpenFile[Any], before: Any, number: int) -> None:
        """Send each page of a document the changes in the part that the page shows."""
        presenter = self._presenters[found.document.kind]
        for page in self._pages.showing(found.key):
            try:
                change = presenter.change(found, before, page.shows[found.key])
            except UnknownNameError:  # the part was removed, or an undo has just restored it
                await self.show(page, found, in_front=False)
                continue
            await page.tell(say.Changed(state=found.state(), before=number, change=change))


def _dropped_data(request: say.Drop) -> bytes:
    where = request.name[:80]
    suffix = PurePath(request.name).suffix.lower()
    if suffix not in formats.ROBOT_SUFFIXES:
        raise FormatError(
            f"'{suffix or request.name[:40]}' is not a file type that can be dropped here",
            where=where,
            allowed=", ".join(f"{' '.join(form.suffixes)} ({form.name})" for form in formats.ROBOT_FORMATS),
            fix="save the file in one of these formats",
        )
    try:
        data = base64.b64decode(request.content, validate=True)
    except ValueError:  # binascii.Error, or characters outside ASCII
        raise InputError(
            "the content is not base64", where=where, allowed="base64", fix="drop the file again"
        ) from None
    if len(data) > say.MOST_DROPPED:
        raise FormatError(
            f"the file has {len(data)} bytes",
            where=where,
            allowed=f"at most {say.MOST_DROPPED}",
            fix="choose a smaller file",
        )
    return data
