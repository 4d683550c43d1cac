"""The first message to a front end, and requests that concern no document."""

from __future__ import annotations

from typing import Literal

from armblocks.studio.protocol.message import Event, Message, Request
from armblocks.studio.protocol.messages.documents import DocumentState, Recovery
from armblocks.studio.protocol.messages.sheets import BlockType


class SettingRule(Message):
    """One setting of a run, for the dialog of configuration parameters."""

    name: str
    title: str
    unit: str
    doc: str
    default: bool | float | str | None


class SolverChoice(Message):
    """A solver that a model may select."""

    name: str
    title: str
    adaptive: bool
    stiff: bool


class Ping(Request[None]):
    """Test the connection; the reply has no content."""

    kind: Literal["ping"] = "ping"


class FileList(Message):
    """Files of the project folder; ``recent``: recently used files, the latest first."""

    files: list[str]
    recent: list[str]


class Files(Request[FileList]):
    """Return the present files of the project folder."""

    kind: Literal["files"] = "files"


class Welcome(Event):
    """The first message: library, examples, files and open documents."""

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
