"""Everything that page and server say to each other over the websocket; the page's types are made from here.

A page sends :data:`Request` with a number of its own choosing; the server answers each with a :class:`Reply`
of the same number, and sends :data:`Event` whenever something happened: also to the other pages that show
the same document. Samples of a run come as binary frames, see :mod:`armblocks.studio.protocol.frames`.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from armblocks.studio.protocol.alteration import Alteration
from armblocks.studio.protocol.edit_messages import Edit, SetMask
from armblocks.studio.protocol.message import Fault, Message
from armblocks.studio.protocol.robot_messages import (
    Opening,
    Readings,
    RobotOpened,
    RobotRequest,
    RobotShown,
    RobotTables,
)
from armblocks.studio.protocol.run_messages import Control, Rewind, Run, RunEvent, SetSpeed, Tune
from armblocks.studio.protocol.sheet_messages import (
    BlockType,
    Finding,
    Found,
    Outline,
    Sheet,
    SheetChange,
    WireKind,
)

# -- what a page shows ---------------------------------------------------------------------------------------


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


# -- requests ------------------------------------------------------------------------------------------------


class Open(Message):
    """Open a file of the project, or the shipped example of this name."""

    kind: Literal["open"] = "open"
    path: str = ""
    example: str = ""


class New(Message):
    """Begin an empty drawing."""

    kind: Literal["new"] = "new"


class Attach(Message):
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
    edit: Edit


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


class KeepMine(Message):
    """Leave the file that has changed on the disk as it is until the next save, which overwrites it."""

    kind: Literal["keep_mine"] = "keep_mine"
    document: str


class Look(Message):
    """Look at the sheet inside a subsystem; the empty path is the whole model."""

    kind: Literal["look"] = "look"
    document: str
    inside: list[str]


class Save(Message):
    """Write the file; ``path`` gives it another. ``overwrite``: also where the disk has changed meanwhile."""

    kind: Literal["save"] = "save"
    document: str
    path: str = ""
    overwrite: bool = False


class Ping(Message):
    """Ask for nothing but an answer: the page thereby knows that the line is up."""

    kind: Literal["ping"] = "ping"


class Files(Message):
    """Ask for the files of the project folder as they are now, those used last first among ``recent``."""

    kind: Literal["files"] = "files"


class AskOutline(Message):
    """Ask for the tree of sheets, an :class:`Outline`."""

    kind: Literal["outline"] = "outline"
    document: str


class Copy(Message):
    """Ask for blocks and notes of a sheet as text, which :class:`PasteBlocks` puts on a sheet again."""

    kind: Literal["copy"] = "copy"
    document: str
    inside: list[str] = Field(default_factory=list[str])
    blocks: list[str]
    notes: list[str] = Field(default_factory=list[str])


class AskMask(Message):
    """Ask for the mask of a subsystem, or of the sheet itself: the :class:`SetMask` that would make it."""

    kind: Literal["ask_mask"] = "ask_mask"
    document: str
    inside: list[str] = Field(default_factory=list[str])
    block: str = ""


class Find(Message):
    """Ask for blocks of all sheets by words of their names, types and values: a list of :class:`Found`."""

    kind: Literal["find"] = "find"
    document: str
    text: Annotated[str, Field(max_length=200)]


class Close(Message):
    """Put a document away; ``discard`` where it has edits that no file holds."""

    kind: Literal["close"] = "close"
    document: str
    discard: bool = False


class Recover(Message):
    """Say what becomes of a drawing or a robot that a journal gives back.

    ``open`` opens it as it was, not yet saved; ``keep_both`` saves it as a new file beside the one it came
    from and opens that; ``discard`` deletes the journal.
    """

    kind: Literal["recover"] = "recover"
    document: str
    action: Literal["open", "keep_both", "discard"]


class TypedValue(Message):
    """Ask what a text typed into a parameter's field means: its value, or what is wrong with it."""

    kind: Literal["typed"] = "typed"
    document: str = ""
    inside: list[str] = Field(default_factory=list[str])
    block: str = ""
    """The block, where it is on a sheet: formulas may name parameters of the sheet's mask."""
    type: str
    parameter: str
    text: str


class TypedSettings(Message):
    """Ask what is wrong with settings while they are typed: a text for each that is, by name."""

    kind: Literal["typed_settings"] = "typed_settings"
    document: str
    values: dict[str, float | str | None]


class Scene(Message):
    """Ask for the bodies of the robot that a block shows."""

    kind: Literal["scene"] = "scene"
    document: str
    inside: list[str] = Field(default_factory=list[str])
    block: str


class Pose(Message):
    """Ask where the links of a block's robot are at joint coordinates ``q`` (rad, m)."""

    kind: Literal["pose"] = "pose"
    document: str
    inside: list[str] = Field(default_factory=list[str])
    block: str
    q: list[float]


Request = Annotated[
    Open
    | New
    | Attach
    | Look
    | Change
    | Undo
    | Redo
    | ArrangeBlocks
    | Reload
    | KeepMine
    | Save
    | Ping
    | Files
    | AskMask
    | AskOutline
    | Copy
    | Find
    | Close
    | Recover
    | Run
    | Control
    | SetSpeed
    | Rewind
    | Tune
    | TypedValue
    | TypedSettings
    | Scene
    | Pose
    | RobotRequest,
    Field(discriminator="kind"),
]


class Envelope(Message):
    """A request with its number."""

    number: int
    request: Request


# -- answers and events --------------------------------------------------------------------------------------


class Reply(Message):
    """The answer to a request: ``fault`` where it was refused."""

    kind: Literal["reply"] = "reply"
    number: int
    value: Any = None
    fault: Fault | None = None


class Welcome(Message):
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


class Documents(Message):
    """The documents that are open and those that wait to be recovered, whenever either has changed."""

    kind: Literal["documents"] = "documents"
    documents: list[DocumentState]
    recoveries: list[Recovery]


class Opened(Message):
    """A whole document, for a page that shows it from now on, and the run that the server has of it."""

    kind: Literal["opened"] = "opened"
    state: DocumentState
    inside: list[str]
    sheet: Sheet
    run: str | None = None


class Changed(Message):
    """A document went from one version to another."""

    kind: Literal["changed"] = "changed"
    state: DocumentState
    before: int
    change: SheetChange


class Checked(Message):
    """What the background check found in one version of a document; ``wires`` by source port."""

    kind: Literal["checked"] = "checked"
    document: str
    version: int
    findings: list[Finding]
    wires: dict[str, WireKind]


Event = Annotated[
    Reply | Welcome | Documents | Opened | Changed | Checked | RunEvent | RobotShown | RobotOpened,
    Field(discriminator="kind"),
]


class ServerMessage(Message):
    """Only for the page's types: everything that the server sends as text."""

    event: Event
    values: Opening | RobotTables | Readings | Outline | Found | SetMask | None = None
    """Some of what replies carry as their value."""
