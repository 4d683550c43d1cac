"""Requests about the tables and Python functions of the project."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable
from importlib.util import decode_source
from inspect import Parameter
from pathlib import Path, PurePath

from armblocks.diagram.function_files import functions_of
from armblocks.errors import ArmblocksError, FormatError, InputError
from armblocks.files import read_bounded
from armblocks.formats.table_files import TABLE_SUFFIXES, columns_of
from armblocks.studio.documents.dropped import dropped_bytes
from armblocks.studio.documents.project_data import SOURCE_SUFFIXES, ProjectData
from armblocks.studio.documents.trusted_files import digest_of
from armblocks.studio.protocol.clients import StudioClient
from armblocks.studio.protocol.message import Fault
from armblocks.studio.protocol.messages import data_files as data_messages
from armblocks.studio.protocol.request_handlers import RequestHandlers
from armblocks.studio.sheet.table_preview import table_preview

_INVISIBLE = re.compile(
    "[\u0000-\u0008\u000b\u000c\u000e-\u001f\u007f-\u009f\u00ad\u061c\u200b-\u200f"
    "\u2028-\u202e\u2060-\u206f\ufeff\ufff9-\ufffb]"
)
"""Control characters, and characters that change the direction of text or have no width."""


class DataRequests:
    """Handles the requests about data files.

    ``recheck``: starts the check of all open diagrams after a change of a file.
    """

    def __init__(self, data: ProjectData, recheck: Callable[[], None]) -> None:
        self._data = data
        self._folder = data.folder
        self._recheck = recheck

    def register(self, handlers: RequestHandlers) -> None:
        """Register the handlers of the requests about data files."""
        handlers.on(data_messages.DataFileList, self._files)
        handlers.on(data_messages.PreviewTable, self._preview)
        handlers.on(data_messages.StoreFile, self._store)
        handlers.on(data_messages.ReadSource, self._source)
        handlers.on(data_messages.TrustSource, self._trust)

    async def _files(
        self, _: StudioClient, request: data_messages.DataFileList
    ) -> list[data_messages.DataFile]:
        suffixes = TABLE_SUFFIXES if request.holds == "table" else SOURCE_SUFFIXES
        return await asyncio.to_thread(self._files_with, suffixes)

    def _files_with(self, suffixes: tuple[str, ...]) -> list[data_messages.DataFile]:
        files: list[data_messages.DataFile] = []
        for path in self._folder.files(suffixes):
            try:
                files.append(
                    data_messages.DataFile(path=path, size=self._folder.path(path, suffixes).stat().st_size)
                )
            except (ArmblocksError, OSError):  # a link that leads outside, or a file that was removed
                continue
        return files

    async def _preview(
        self, _: StudioClient, request: data_messages.PreviewTable
    ) -> data_messages.TablePreview:
        path = self._folder.path(request.file, TABLE_SUFFIXES)

        def read() -> data_messages.TablePreview:
            try:
                file = self._data.columns(path)
            except ArmblocksError as error:
                raise _with_relative_path(error, request.file) from None
            return table_preview(file, request.file, request.time, request.columns)

        return await asyncio.to_thread(read)

    async def _store(self, _: StudioClient, request: data_messages.StoreFile) -> data_messages.StoredFile:
        data = dropped_bytes(request.content, request.name[:80])
        name = PurePath(request.name).name
        path = self._folder.path(name, TABLE_SUFFIXES)

        def store() -> bool:
            try:
                columns_of(data, path)
            except ArmblocksError as error:
                raise _with_relative_path(error, name) from None
            if path.exists() and not request.replace:
                return _has_content(path, data)
            self._folder.write_data(name, data, TABLE_SUFFIXES)
            return True

        stored = await asyncio.to_thread(store)
        if stored:
            self._recheck()
        return data_messages.StoredFile(path=name, stored=stored)

    async def _source(
        self, _: StudioClient, request: data_messages.ReadSource
    ) -> data_messages.FunctionSource:
        path = self._folder.path(request.file, SOURCE_SUFFIXES)
        source = self._data.source(path)
        fault: Fault | None = None
        functions: list[data_messages.SourceFunction] = []
        try:
            text = decode_source(source)  # as Python reads it, by the encoding that the file declares
        except (SyntaxError, UnicodeDecodeError) as error:
            raise FormatError(
                f"the file is not text: {error}"[:200], where=request.file, fix="save it as UTF-8"
            ) from None
        try:
            functions = [
                data_messages.SourceFunction(
                    name=function.name,
                    arguments=[_argument(entry) for entry in function.arguments],
                    line=function.line,
                    doc=function.doc,
                )
                for function in functions_of(source, request.file).values()
            ]
        except FormatError as error:
            fault = Fault(what=error.what, where=error.where, allowed=error.allowed, fix=error.fix)
        visible_text, hidden = _INVISIBLE.subn(lambda match: f"\\u{ord(match[0]):04x}", text)
        digest = digest_of(source)
        return data_messages.FunctionSource(
            text=visible_text,
            digest=digest,
            trusted=(self._data.shown(path), digest) in self._data.trusted,
            hidden=hidden,
            functions=functions,
            fault=fault,
        )

    async def _trust(self, _: StudioClient, request: data_messages.TrustSource) -> None:
        path = self._folder.path(request.file, SOURCE_SUFFIXES)
        shown_path = self._data.shown(path)
        if request.trusted and digest_of(self._data.source(path)) != request.digest:
            raise InputError(
                "the file has changed since it was shown",
                where=shown_path,
                allowed="the content that was shown",
                fix="load it again, read it, and then trust it",
            )
        self._data.trusted.set(shown_path, request.digest, trusted=request.trusted)
        self._recheck()


def _argument(argument: Parameter) -> str:
    """The text of an argument for the client; an argument with a default is not an input."""
    stars = {Parameter.VAR_POSITIONAL: "*", Parameter.VAR_KEYWORD: "**"}.get(argument.kind, "")
    return f"{stars}{argument.name}{'' if argument.default is Parameter.empty else '=…'}"


def _has_content(path: Path, data: bytes) -> bool:
    try:
        return read_bounded(path, len(data)) == data
    except FormatError:
        return False


def _with_relative_path(error: ArmblocksError, shown_path: str) -> FormatError:
    """The error with the path in the project instead of the absolute path."""
    return FormatError(error.what, where=shown_path, allowed=error.allowed, fix=error.fix)
