"""Documents: requests that open, change, save, close and recover them, and events that show them.

A document is a diagram or a robot. The requests and events here are the same for both; only the edits, the
content and its changes are of one kind: see :class:`Content`.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from armblocks.studio.protocol.message import AnyOf, Edit, Event, Message, Request

DocumentKind = Literal["diagram", "robot"]
Disk = Literal["same", "changed", "gone"]
MOST_DROPPED = 5 * 2**20
"""Bytes of a file that is dropped on the page."""

# -- what is shown of documents ------------------------------------------------------------------------------


class DocumentState(Message):
    """Where a document stands.

    ``origin`` is the shipped example or robot that it began as. ``disk`` says how the file is now, compared
    with what was opened or saved. ``journaled`` is false where the journal cannot be written: then only a
    save keeps the edits.
    """

    document: str
    kind: DocumentKind
    version: int
    title: str
    path: str | None
    origin: str
    dirty: bool
    undo: str
    redo: str
    disk: Disk
    journaled: bool


class Recovery(Message):
    """A document that was not saved when the studio ended, as its journal gives it back.

    ``path`` is the file that it came from, ``None`` where it never had one. ``began`` and ``last`` are when
    the first and the last edit since the save were made (s since 1970), ``edits`` how many there are,
    ``parts`` how many blocks or links it has. ``disk`` says whether the file is still the one that was
    edited. ``missing`` says what could not be read.
    """

    document: str
    kind: DocumentKind
    title: str
    path: str | None
    began: float
    last: float
    edits: int
    parts: int
    disk: Disk
    missing: str


class Content(Message):
    """What a front end shows of a document: one class for each kind of documents."""


class ContentChange(Message):
    """How the content that a front end shows differs from that of an earlier version."""


# -- requests ------------------------------------------------------------------------------------------------


class Open(Request[list[str]]):
    """Open a file of the project: a diagram, a robot, or a script of robots.

    The reply has the keys of the documents; the first comes to the front.
    """

    kind: Literal["open"] = "open"
    path: str


class OpenShipped(Request[str]):
    """Open a copy of a shipped example or robot."""

    kind: Literal["open_shipped"] = "open_shipped"
    document_kind: DocumentKind
    name: str


class Drop(Request[list[str]]):
    """Open a file that was dropped on the page: a script, a robot or a diagram. Nothing of it is run."""

    kind: Literal["drop"] = "drop"
    name: str = Field(max_length=255)
    content: str = Field(max_length=4 * MOST_DROPPED // 3 + 4)
    """The bytes of the file as base64."""


class New(Request[str]):
    """Begin a new document."""

    kind: Literal["new"] = "new"
    document_kind: DocumentKind


class Attach(Request[str]):
    """Show a document again: after a reload, after the line was down, or in a second page.

    Where the server was started anew and does not know it, it comes from its journal, or else from the file
    or the shipped one of these names, under the same key: edits that wait to be sent again find it. Of a
    diagram the sheet at the path ``inside`` is shown.
    """

    kind: Literal["attach"] = "attach"
    document: str = Field(pattern=r"^[0-9a-f]{16}$")
    document_kind: DocumentKind
    inside: list[str] = Field(default_factory=list[str])
    path: str | None = None
    origin: str = ""
    in_front: bool = True
    """Whether it comes to the front of the page."""


class Alteration(Request[int]):
    """What changes a document.

    ``key`` is new for each: sent again after a broken line, it is done once. ``base`` is the version that the
    page ``author`` saw: where another page has changed the same things since, the request is refused. The
    reply is the version that the request makes.
    """

    does: ClassVar[Literal["change", "undo", "redo"]] = "change"
    document: str
    key: str = ""
    base: int | None = None
    author: str = ""


class Change(Alteration):
    """Carry out an edit.

    ``inside``: names of the subsystems on the way to the sheet of a diagram that is edited. Changes in a row
    of one ``gesture`` (the letters typed into one cell) are one step of undo.
    """

    kind: Literal["change"] = "change"
    inside: list[str] = Field(default_factory=list[str])
    gesture: str = ""
    edit: Annotated[Edit, AnyOf()]


class Undo(Alteration):
    """Take the last edit back."""

    does = "undo"
    kind: Literal["undo"] = "undo"


class Redo(Alteration):
    """Do again what was undone."""

    does = "redo"
    kind: Literal["redo"] = "redo"


class Reload(Alteration):
    """Take what the file holds now, as one step that can be undone."""

    kind: Literal["reload"] = "reload"


class KeepMine(Request[None]):
    """Leave the file that has changed on the disk as it is until the next save, which overwrites it."""

    kind: Literal["keep_mine"] = "keep_mine"
    document: str


class Save(Request[str]):
    """Write the file; ``path`` gives it another. ``overwrite``: also where the disk has changed meanwhile.

    The reply is the path.
    """

    kind: Literal["save"] = "save"
    document: str
    path: str = ""
    overwrite: bool = False


class Close(Request[None]):
    """Put a document away; ``discard`` where it has edits that no file holds."""

    kind: Literal["close"] = "close"
    document: str
    discard: bool = False


class Recover(Request[str | None]):
    """Say what becomes of a document that a journal gives back.

    ``open`` opens it as it was, not yet saved; ``keep_both`` saves it as a new file beside the one it came
    from and opens that; ``discard`` deletes the journal.
    """

    kind: Literal["recover"] = "recover"
    document: str
    action: Literal["open", "keep_both", "discard"]


# -- events --------------------------------------------------------------------------------------------------


class Documents(Event):
    """The documents that are open and those that wait to be recovered, whenever either has changed."""

    kind: Literal["documents"] = "documents"
    documents: list[DocumentState]
    recoveries: list[Recovery]


class Opened(Event):
    """A whole document, for a page that shows it from now on.

    ``notes``: what was said when its file was read. ``in_front``: whether it comes to the front of the page.
    """

    kind: Literal["opened"] = "opened"
    state: DocumentState
    content: Annotated[Content, AnyOf()]
    notes: list[str]
    in_front: bool


class Changed(Event):
    """A document went from version ``before`` to that of its state, which may be the same."""

    kind: Literal["changed"] = "changed"
    state: DocumentState
    before: int
    change: Annotated[ContentChange, AnyOf()]
