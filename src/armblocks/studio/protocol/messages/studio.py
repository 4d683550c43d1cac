"""What a front end is told when it comes, and requests that are about no document."""

from __future__ import annotations

from typing import Literal

from armblocks.studio.protocol.message import Event, Message, Request
from armblocks.studio.protocol.messages.documents import DocumentState, Recovery
from armblocks.studio.protocol.messages.sheets import BlockType


class SettingRule(Message):
    """One setting of a run, as the dialog of configuration parameters needs it."""

    name: str
    title: str
    unit: str
    doc: str
    default: float | str | None


class SolverChoice(Message):
    """A solver that a model may ask for."""

    name: str
    title: str
    adaptive: bool
    stiff: bool


class Ping(Request[None]):
    """Ask for nothing but an answer: the page thereby knows that the line is up."""

    kind: Literal["ping"] = "ping"


class FileList(Message):
    """Files of the project folder; ``recent`` are those used last, the latest first."""

    files: list[str]
    recent: list[str]


class Files(Request[FileList]):
    """Ask for the files of the project folder as they are now."""

    kind: Literal["files"] = "files"


class Welcome(Event):
    """The first message: the library, the examples, the files and the documents that are open."""

    kind: Literal["welcome"] = "welcome"
    version: str
    library: list[BlockType]
    robots: list[str]
    solvers: list[SolverChoice]
    settings: list[SettingRule]
    examples: dict[str, str]
    files: list[str]
    recent: list[str]
    documents: list[DocumentState]
    recoveries: list[Recovery]
