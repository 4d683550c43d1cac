"""Documents: how they are opened, changed, saved, put away and recovered, and what is shown of them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from armblocks.studio.protocol.alteration import Alteration
from armblocks.studio.protocol.message import AnyOf, Event, Message, Request
from armblocks.studio.protocol.messages.robots import Opening
from armblocks.studio.protocol.messages.sheet_edits import DiagramEdit
from armblocks.studio.protocol.messages.sheets import Sheet, SheetChange


class DocumentState(Message):
    """Where a document stands.

    ``disk`` says how the file is now, compared with what was opened or saved. ``journaled`` is false where
    the journal cannot be written: then only a save keeps what is drawn.
    """

    document: str
    version: int
    title: str
    path: str | None
    example: str
    dirty: bool
    undo: str
    redo: str
    disk: Literal["same", "changed", "gone"] = "same"
    journaled: bool = True
    settings: dict[str, float | str | None]
    """How the model is run, by the names of ``SimulationOptions``."""


class Recovery(Message):
    """A drawing or a robot that was not saved when the studio ended, as its journal gives it back.

    ``path`` is the file that it came from, ``None`` where it never had one. ``began`` and ``last`` are when
    the first and the last edit since the save were made (s since 1970), ``edits`` how many there are,
    ``parts`` how many blocks or links it has. ``disk`` says whether the file is still the one that was
    edited. ``missing`` says what could not be read.
    """

    holds: Literal["diagram", "robot"]
    document: str
    title: str
    path: str | None
    began: float
    last: float
    edits: int
    parts: int
    disk: Literal["same", "changed", "gone"]
    missing: str


class Open(Request[Opening | str]):
    """Open a file of the project, or the shipped example of this name."""

    kind: Literal["open"] = "open"
    path: str = ""
    example: str = ""


class New(Request[str]):
    """Begin an empty drawing."""

    kind: Literal["new"] = "new"


class Attach(Request[str]):
    """Show a document again: after a reload, after the line was down, or in a second page.

    Where the server was started anew and does not know it, it comes from its journal, or else from the file
    or the example of these names, under the same key: edits that wait to be sent again find it.
    """

    kind: Literal["attach"] = "attach"
    document: str = Field(pattern=r"^[0-9a-f]{16}$")
    inside: list[str] = Field(default_factory=list[str])
    path: str | None = None
    example: str = ""


class DiagramAlteration(Alteration):
    """What changes a drawing."""

    document: str


class Change(DiagramAlteration):
    """Carry out an edit."""

    kind: Literal["change"] = "change"
    inside: list[str] = Field(default_factory=list[str])
    """Names of the subsystems on the way to the sheet that is edited."""
    edit: Annotated[DiagramEdit, AnyOf()]


class Undo(DiagramAlteration):
    """Take the last edit back."""

    does = "undo"
    kind: Literal["undo"] = "undo"


class Redo(DiagramAlteration):
    """Do again what was undone."""

    does = "redo"
    kind: Literal["redo"] = "redo"


class ArrangeBlocks(DiagramAlteration):
    """Lay the blocks out anew, from left to right."""

    kind: Literal["arrange"] = "arrange"
    inside: list[str] = Field(default_factory=list[str])


class Reload(DiagramAlteration):
    """Take what the file holds now, as one step that can be undone."""

    kind: Literal["reload"] = "reload"


class KeepMine(Request[None]):
    """Leave the file that has changed on the disk as it is until the next save, which overwrites it."""

    kind: Literal["keep_mine"] = "keep_mine"
    document: str


class Look(Request[str]):
    """Look at the sheet inside a subsystem; the empty path is the whole model."""

    kind: Literal["look"] = "look"
    document: str
    inside: list[str]


class Save(Request[str]):
    """Write the file; ``path`` gives it another. ``overwrite``: also where the disk has changed meanwhile."""

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
    """Say what becomes of a drawing or a robot that a journal gives back.

    ``open`` opens it as it was, not yet saved; ``keep_both`` saves it as a new file beside the one it came
    from and opens that; ``discard`` deletes the journal.
    """

    kind: Literal["recover"] = "recover"
    document: str
    action: Literal["open", "keep_both", "discard"]


class Documents(Event):
    """The documents that are open and those that wait to be recovered, whenever either has changed."""

    kind: Literal["documents"] = "documents"
    documents: list[DocumentState]
    recoveries: list[Recovery]


class Opened(Event):
    """A whole document, for a page that shows it from now on, and the run that the server has of it."""

    kind: Literal["opened"] = "opened"
    state: DocumentState
    inside: list[str]
    sheet: Sheet
    run: str | None = None


class Changed(Event):
    """A document went from one version to another."""

    kind: Literal["changed"] = "changed"
    state: DocumentState
    before: int
    change: SheetChange
