"""A project folder and a state folder as a studio finds them after another studio was killed."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import Callable, Coroutine, Iterable
from pathlib import Path
from typing import Any

from armblocks.errors import ArmblocksError
from armblocks.formats import load_robot
from armblocks.studio.documents.open_files import OpenedT, OpenFiles
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.documents.state_folder import StateFolder
from armblocks.studio.protocol.messages.documents import Alteration
from armblocks.studio.robots.open_robots import OpenRobots
from armblocks.studio.sheet.open_documents import OpenDocuments


class Disk:
    """A project folder and its state folder, as a starting studio finds them."""

    def __init__(self, root: Path) -> None:
        self.project = ProjectFolder(root / "project")
        self.state_folder = StateFolder(self.project.root)
        self.state_folder.root = root / "state"
        self.state_folder.journals = root / "state" / "journals"

    def documents(self) -> OpenDocuments:
        return OpenDocuments(self.project, self.state_folder, load_robot)

    def robots(self) -> OpenRobots:
        return OpenRobots(self.project, self.state_folder)

    def as_after_a_crash(self, root: Path) -> Disk:
        """A copy of the disk, as seen by a studio that starts after the present one was killed."""
        for name in ("project", "state"):
            if (self.project.root.parent / name).exists():
                shutil.copytree(self.project.root.parent / name, root / name)
        return Disk(root)


def run_async(scenario: Callable[[], Coroutine[Any, Any, None]]) -> None:
    asyncio.run(scenario())


def carry_out(files: OpenFiles[OpenedT], open_file: OpenedT, requests: Iterable[Alteration]) -> None:
    """Perform requests; those that are refused change nothing."""
    for request in requests:
        try:
            files.perform(open_file, request)
        except ArmblocksError:
            continue
