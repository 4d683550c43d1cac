"""The open diagrams of a studio."""

from __future__ import annotations

import asyncio
import dataclasses
from pathlib import PurePath

from armblocks.studio.documents.open_files import OpenFile, OpenFiles
from armblocks.studio.documents.project_data import ProjectData
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.documents.state_folder import StateFolder
from armblocks.studio.documents.trusted_files import TrustedFiles
from armblocks.studio.sheet.diagram_kind import DiagramKind
from armblocks.studio.sheet.document import Document
from armblocks.studio.sheet.parameter_values import ResolveRobot


@dataclasses.dataclass(eq=False, kw_only=True)
class OpenDocument(OpenFile[Document]):
    """A diagram with its file, its journal and its background check."""

    checking: asyncio.Task[None] | None = None

    def cancel_tasks(self) -> None:
        """Cancel the pending tasks of the document, which is closed."""
        super().cancel_tasks()
        if self.checking is not None:
            self.checking.cancel()


class OpenDocuments(OpenFiles[OpenDocument]):
    """The open diagrams of one project folder; see :class:`.OpenFiles`."""

    def __init__(
        self,
        folder: ProjectFolder,
        state_folder: StateFolder,
        resolve_robot: ResolveRobot,
        data: ProjectData | None = None,
    ) -> None:
        data = data or ProjectData(folder, TrustedFiles(state_folder))
        super().__init__(folder, state_folder, DiagramKind(folder, resolve_robot, data))

    def open_bytes(self, data: bytes, name: str) -> OpenDocument:
        """Open the content of a file from outside the project as a new diagram."""
        return self.open_value(self.kind.from_file(data, self.folder.root / PurePath(name).name))

    def _create(self, key: str, document: Document) -> OpenDocument:
        return OpenDocument(key=key, document=document)
