"""The open documents of both kinds: handlers of requests, and notifications to clients."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Any

from armblocks import formats
from armblocks.errors import FormatError, UnknownNameError
from armblocks.studio.documents.dropped import dropped_bytes
from armblocks.studio.documents.open_files import OpenFile
from armblocks.studio.documents.presenter import Opening, Place, Presenter
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.protocol.clients import Clients, StudioClient
from armblocks.studio.protocol.messages import documents as document_messages
from armblocks.studio.protocol.request_handlers import RequestHandlers


class DocumentRequests:
    """Handles the requests about documents and notifies all clients that show a changed document."""

    def __init__(
        self,
        folder: ProjectFolder,
        clients: Clients,
        presenters: Mapping[document_messages.DocumentKind, Presenter[Any]],
    ) -> None:
        self._folder = folder
        self._clients = clients
        self._presenters = presenters

    def register(self, handlers: RequestHandlers) -> None:
        """Register the handlers of the requests about documents."""
        handlers.on(document_messages.Open, self._open)
        handlers.on(document_messages.OpenShipped, self._open_shipped)
        handlers.on(document_messages.Drop, self._drop)
        handlers.on(document_messages.New, self._new)
        handlers.on(document_messages.Attach, self._attach)
        for alteration in (
            document_messages.Change,
            document_messages.Undo,
            document_messages.Redo,
            document_messages.Reload,
        ):
            handlers.on(alteration, self._alter)
        handlers.on(document_messages.IgnoreFileChange, self._ignore_file_change)
        handlers.on(document_messages.Save, self._save)
        handlers.on(document_messages.Close, self._close)
        handlers.on(document_messages.Recover, self._recover)

    def __contains__(self, key: str) -> bool:
        return any(key in presenter.files for presenter in self._presenters.values())

    def __getitem__(self, key: str) -> OpenFile[Any]:
        """Return the document with this key; raise ``UnknownNameError`` if there is none."""
        return self._with_key(key)[1]

    def states(self) -> list[document_messages.DocumentState]:
        """The states of all open documents."""
        return [open_file.state() for presenter in self._presenters.values() for open_file in presenter.files]

    def recoveries(self) -> list[document_messages.Recovery]:
        """The documents that can be recovered, the latest first."""
        descriptions = (
            offer
            for presenter in self._presenters.values()
            for offer in presenter.files.recoverable.descriptions()
        )
        return sorted(descriptions, key=lambda offer: -offer.last)

    def watch(self) -> list[asyncio.Task[None]]:
        """Start the tasks that watch the files of all documents for changes by other programs."""
        loop = asyncio.get_running_loop()
        watches = (presenter.files.watch(self.notify_state) for presenter in self._presenters.values())
        return [loop.create_task(watch) for watch in watches]

    def end(self) -> None:
        """Close all documents; journals of unsaved documents remain."""
        for presenter in self._presenters.values():
            presenter.files.close_all()

    async def show(
        self,
        client: StudioClient,
        open_file: OpenFile[Any],
        place: Place = (),
        notes: Sequence[str] = (),
        *,
        in_front: bool = True,
    ) -> str:
        """Show a document in a client; return the key of the document."""
        presenter, known = self._presenters[open_file.document.kind], open_file.key in client.shows
        client.shows[open_file.key] = place = presenter.place(open_file, place, known=known)
        content = presenter.content(open_file, place)
        event = document_messages.Opened(
            state=open_file.state(), content=content, notes=list(notes), in_front=in_front
        )
        await client.notify(event)
        presenter.on_shown(client, open_file, known=known)
        await self.notify_list()
        return open_file.key

    async def replace(self, open_file: OpenFile[Any], title: str, value: Any) -> None:
        """Replace the value of a document as one undo step."""
        before, number = open_file.document.value, open_file.document.version
        self._presenters[open_file.document.kind].files.replace(open_file, title, value)
        await self._notify_change(open_file, before, number)

    # -- opening ---------------------------------------------------------------------------------------------

    async def _open(self, client: StudioClient, request: document_messages.Open) -> list[str]:
        return await self._show_all(client, self._presenter_of_file(request.path).open_file(request.path))

    async def _open_shipped(self, client: StudioClient, request: document_messages.OpenShipped) -> str:
        return await self.show(
            client, self._presenters[request.document_kind].files.open_shipped(request.name)
        )

    async def _new(self, client: StudioClient, request: document_messages.New) -> str:
        return await self.show(client, self._presenters[request.document_kind].files.new())

    async def _attach(self, client: StudioClient, request: document_messages.Attach) -> str:
        files = self._presenters[request.document_kind].files
        open_file = files.attach(request.document, request.path, request.origin)
        return await self.show(client, open_file, tuple(request.inside), in_front=request.in_front)

    async def _drop(self, client: StudioClient, request: document_messages.Drop) -> list[str]:
        data = _dropped_data(request)
        is_robot = formats.kind_of_data(data, request.name) is formats.DocumentKind.ROBOT
        presenter = self._presenters["robot" if is_robot else "diagram"]
        return await self._show_all(client, presenter.dropped(data, request.name))

    async def _show_all(self, client: StudioClient, opening: Opening[Any]) -> list[str]:
        """Show the first document of a file in the client. The other documents are open, and appear in the
        client's list of documents."""
        await self.show(client, opening.opened[0], notes=opening.notes)
        return [open_file.key for open_file in opening.opened]

    def _presenter_of_file(self, path: str) -> Presenter[Any]:
        with contextlib.suppress(FormatError):  # a file that can no longer be read may still be open
            if formats.kind_of_data(self._folder.read(path), path) is formats.DocumentKind.ROBOT:
                return self._presenters["robot"]
        return self._presenters["diagram"]

    # -- changing, saving, closing ---------------------------------------------------------------------------

    async def _alter(self, _: StudioClient, request: document_messages.Alteration) -> int:
        presenter, open_file = self._with_key(request.document)
        before, number = open_file.document.value, open_file.document.version
        was_dirty = open_file.document.dirty
        if isinstance(request, document_messages.Reload):
            presenter.files.reload(open_file, request.key)
        elif not presenter.files.perform(open_file, request):
            return number
        await self._notify_change(open_file, before, number)
        if open_file.document.dirty != was_dirty:  # clients that do not show the document list it as changed
            await self.notify_list()
        return open_file.document.version

    async def _ignore_file_change(self, _: StudioClient, request: document_messages.IgnoreFileChange) -> None:
        presenter, open_file = self._with_key(request.document)
        presenter.files.ignore_file_change(open_file)
        await self.notify_state(open_file)
        await self.notify_list()

    async def _save(self, _: StudioClient, request: document_messages.Save) -> str:
        presenter, open_file = self._with_key(request.document)
        try:
            path = await presenter.files.save(open_file, request.path, overwrite=request.overwrite)
        finally:
            await self.notify_state(open_file)
        await presenter.on_saved(open_file)
        await self.notify_list()
        return path

    async def _close(self, client: StudioClient, request: document_messages.Close) -> bool:
        presenter, open_file = self._with_key(request.document)
        shared = any(other is not client for other in self._clients.showing(open_file.key))
        if not shared:
            presenter.files.close(open_file, discard=request.discard)
        client.shows.pop(open_file.key, None)
        await self.notify_list()
        return not shared

    async def _recover(self, client: StudioClient, request: document_messages.Recover) -> str | None:
        files = [presenter.files for presenter in self._presenters.values()]
        owner = next((of_kind for of_kind in files if request.document in of_kind.recoverable), files[0])
        open_file = await owner.recover(request)
        if open_file is not None:
            return await self.show(client, open_file)
        await self.notify_list()
        return None

    def _with_key(self, key: str) -> tuple[Presenter[Any], OpenFile[Any]]:
        for presenter in self._presenters.values():
            if key in presenter.files:
                return presenter, presenter.files[key]
        raise UnknownNameError("open document", key, [state.document for state in self.states()])

    # -- notifications ---------------------------------------------------------------------------------------

    async def notify_list(self) -> None:
        """Notify all clients of the open and recoverable documents."""
        await self._clients.notify(
            document_messages.Documents(documents=self.states(), recoveries=self.recoveries())
        )

    async def notify_state(self, open_file: OpenFile[Any]) -> None:
        """Send the state of a document, whose content has not changed, to the clients that show it."""
        await self._notify_versions(open_file, open_file.document.value, open_file.document.version)

    async def _notify_change(self, open_file: OpenFile[Any], before: Any, number: int) -> None:
        await self._notify_versions(open_file, before, number)
        await self._presenters[open_file.document.kind].on_edited(open_file, before)

    async def _notify_versions(self, open_file: OpenFile[Any], before: Any, number: int) -> None:
        """Send each client of a document the changes in the part that the client shows."""
        presenter = self._presenters[open_file.document.kind]
        for client in self._clients.showing(open_file.key):
            try:
                change = presenter.change(open_file, before, client.shows[open_file.key])
            except UnknownNameError:  # the part was removed or renamed, or an undo has just restored it
                place = presenter.place_after(open_file, before, client.shows[open_file.key])
                client.shows[open_file.key] = place
                await self.show(client, open_file, in_front=False)
                continue
            await client.notify(
                document_messages.Changed(state=open_file.state(), before=number, change=change)
            )


def _dropped_data(request: document_messages.Drop) -> bytes:
    where = request.name[:80]
    suffix = PurePath(request.name).suffix.lower()
    if suffix not in formats.ROBOT_SUFFIXES:
        raise FormatError(
            f"'{suffix or request.name[:40]}' is not a file type that can be dropped here",
            where=where,
            allowed=", ".join(f"{' '.join(form.suffixes)} ({form.name})" for form in formats.ROBOT_FORMATS),
            fix="save the file in one of these formats",
        )
    return dropped_bytes(request.content, where)
