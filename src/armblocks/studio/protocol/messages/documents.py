"""Documents: requests that open, change, save, close and recover them, and events that describe them.

A document is a diagram or a robot. These requests and events apply to both kinds. Only edits, content and
content changes depend on the kind: see :class:`Content`.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from armblocks.studio.protocol.message import AnyOf, Edit, Event, Message, Request

DocumentKind = Literal["diagram", "robot"]
DiskState = Literal["same", "changed", "gone"]
MAX_DROPPED_BYTES = 5 * 2**20
"""Largest size of a file that is dropped on the studio, bytes."""

# -- data of documents ---------------------------------------------------------------------------------------


class DocumentState(Message):
    """File, version and save state of a document.

    ``origin`` is the shipped example or robot from which it was created. ``disk`` compares the file on disk
    with the version that was opened or saved. ``journaled`` is false if the journal cannot be written; the
    edits are then lost unless they are saved.
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
    disk: DiskState
    journaled: bool


class Recovery(Message):
    """An unsaved document of an earlier server that can be recovered from its journal.

    ``path`` is its file, or ``None`` if it was never saved. ``began`` and ``last`` are the times of the first
    and the last edit since the save (s since 1970), ``edits`` is their number, ``parts`` the number of blocks
    or links. ``disk`` states whether the file has changed since the edits. ``missing`` describes the edits
    that could not be recovered.
    """

    document: str
    kind: DocumentKind
    title: str
    path: str | None
    began: float
    last: float
    edits: int
    parts: int
    disk: DiskState
    missing: str


class Content(Message):
    """The displayed data of a document; one subclass for each kind of document."""


class ContentChange(Message):
    """The difference between the displayed data of two versions."""


# -- requests ------------------------------------------------------------------------------------------------


class Open(Request[list[str]]):
    """Open a file of the project: a diagram, a robot, or a script of robots.

    The reply contains the keys of the documents; the front end shows the first document.
    """

    kind: Literal["open"] = "open"
    path: str


class OpenShipped(Request[str]):
    """Open a copy of a shipped example or robot."""

    kind: Literal["open_shipped"] = "open_shipped"
    document_kind: DocumentKind
    name: str


class Drop(Request[list[str]]):
    """Open a file that was dropped on the studio: a diagram, a robot or a script (it is not executed)."""

    kind: Literal["drop"] = "drop"
    name: str = Field(max_length=255)
    content: str = Field(max_length=4 * MAX_DROPPED_BYTES // 3 + 4)
    """Content of the file, base64."""


class New(Request[str]):
    """Create a new document."""

    kind: Literal["new"] = "new"
    document_kind: DocumentKind


class Attach(Request[str]):
    """Show a document again: after a reload, after a lost connection, or in a second client.

    If the server does not have the document open after a restart, it recovers the document from its journal,
    or opens the file ``path`` or the shipped ``origin``. The document keeps its key, so that edits that the
    client sends again are applied to it. ``inside`` is the path of the displayed sheet of a diagram.
    """

    kind: Literal["attach"] = "attach"
    document: str = Field(pattern=r"^[0-9a-f]{16}$")
    document_kind: DocumentKind
    inside: list[str] = Field(default_factory=list[str])
    path: str | None = None
    origin: str = ""
    in_front: bool = True
    """Whether the client brings the document to the front."""


class Alteration(Request[int]):
    """A request that changes a document.

    Each request has a unique ``key``: a request that is sent again after a lost connection is applied once.
    ``base`` is the version that the client ``author`` showed; the request is refused if another client has
    changed the same aspects since. The reply is the new version.
    """

    does: ClassVar[Literal["change", "undo", "redo"]] = "change"
    document: str
    key: str = ""
    base: int | None = None
    author: str = ""


class Change(Alteration):
    """Apply an edit.

    ``inside``: names of the subsystems that lead to the edited sheet of a diagram. Consecutive changes with
    the same ``gesture`` (for example the letters typed into a cell) are one undo step.
    """

    kind: Literal["change"] = "change"
    inside: list[str] = Field(default_factory=list[str])
    gesture: str = ""
    edit: Annotated[Edit, AnyOf()]


class Undo(Alteration):
    """Revert the last edit."""

    does = "undo"
    kind: Literal["undo"] = "undo"


class Redo(Alteration):
    """Repeat the edit that was undone last."""

    does = "redo"
    kind: Literal["redo"] = "redo"


class Reload(Alteration):
    """Replace the document by the content of its file, as one undo step."""

    kind: Literal["reload"] = "reload"


class IgnoreFileChange(Request[None]):
    """Keep the document although its file has changed on disk; the next save overwrites the file."""

    kind: Literal["ignore_file_change"] = "ignore_file_change"
    document: str


class Save(Request[str]):
    """Write the file, under ``path`` if it is given. ``overwrite``: also if the file has changed on disk.

    The reply is the path.
    """

    kind: Literal["save"] = "save"
    document: str
    path: str = ""
    overwrite: bool = False


class Close(Request[bool]):
    """Close a document on this client; ``discard`` is required if it has unsaved edits.

    A document that another client shows stays open there, with its edits; the reply is then ``False``.
    """

    kind: Literal["close"] = "close"
    document: str
    discard: bool = False


class Recover(Request[str | None]):
    """Recover or discard a document of an earlier server.

    ``open`` opens it with its unsaved edits; ``keep_both`` saves it as a new file beside the original one and
    opens the new file; ``discard`` deletes the journal.
    """

    kind: Literal["recover"] = "recover"
    document: str
    action: Literal["open", "keep_both", "discard"]


# -- events --------------------------------------------------------------------------------------------------


class Documents(Event):
    """The open and the recoverable documents, sent when either list has changed."""

    kind: Literal["documents"] = "documents"
    documents: list[DocumentState]
    recoveries: list[Recovery]


class Opened(Event):
    """A complete document, for a client that shows it from now on.

    ``notes``: warnings issued while its file was read. ``in_front``: whether it is brought to the front.
    """

    kind: Literal["opened"] = "opened"
    state: DocumentState
    content: Annotated[Content, AnyOf()]
    notes: list[str]
    in_front: bool


class Changed(Event):
    """The change of a document from version ``before`` to the version in ``state``, which may be the same."""

    kind: Literal["changed"] = "changed"
    state: DocumentState
    before: int
    change: Annotated[ContentChange, AnyOf()]
