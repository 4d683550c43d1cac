"""Everything that page and server say to each other over the websocket; the page's types are made from here.

A page sends :data:`Request` with a number of its own choosing; the server answers each with a :class:`Reply`
of the same number, and sends :data:`Event` whenever something happened: also to the other pages that show
the same document. Samples of a run come as binary frames, see :mod:`armblocks.studio.frames`.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from armblocks.studio.alteration import Alteration
from armblocks.studio.edit_messages import Edit, Message, Place, SetMask, SheetNote, Wire
from armblocks.studio.robot_messages import (
    Opening,
    Readings,
    RobotOpened,
    RobotRequest,
    RobotShown,
    RobotTables,
)

# -- what a page shows ---------------------------------------------------------------------------------------


class PortSpot(Message):
    """A port on the edge of its block: px from the block's corner, and the direction of its wire."""

    name: str
    doc: str
    label: str
    unit: str
    x: float
    y: float
    dx: int
    dy: int


class Outline(Message):
    """The sheets of a model as a tree."""

    name: str
    blocks: int
    subsystems: list[Outline]


class Found(Message):
    """A block that was sought; ``match`` is the value that fits, ``""`` where name or type does."""

    inside: list[str]
    name: str
    title: str
    match: str


class ParameterRule(Message):
    """One parameter of a type of block, as its dialog needs it."""

    name: str
    kind: str
    doc: str
    unit: str
    default: Any
    tunable: bool
    choices: list[str]
    allowed: str


class SheetBlock(Message):
    """A block as it stands on the sheet. ``face`` is SVG in the block's own px; its colours are classes."""

    name: str
    type: str
    title: str
    place: Place
    width: float
    height: float
    face: str
    inputs: list[PortSpot]
    outputs: list[PortSpot]
    opens: bool
    """Whether there is a sheet inside."""
    parameters: dict[str, Any]
    """Values in the form of :func:`~armblocks.studio.parameter_values.parameter_json`."""
    formulas: dict[str, str]
    """The texts of those that are formulas."""
    mask: list[ParameterRule]
    """The parameters that the diagram inside declares; ``default`` is what they are here."""
    link: str
    """The entry of a library that the block is, ``file#name``; ``""`` for one of its own."""


class Sheet(Message):
    """The whole drawing."""

    name: str
    description: str
    blocks: dict[str, SheetBlock]
    wires: list[Wire]
    notes: dict[str, SheetNote]
    logged: list[str]
    """Outputs, ``block/port``, that are seen without a Scope."""
    linked: list[str]
    """The way to the library block that the sheet belongs to, so that it cannot be changed."""
    link: str
    """The entry of the library that this block is."""


class SheetChange(Message):
    """From one version of the drawing to the next."""

    blocks: dict[str, SheetBlock | None]
    """Blocks that are new or other than before; ``None`` for those that are gone."""
    wires_added: list[Wire]
    wires_removed: list[Wire]
    notes: dict[str, SheetNote] | None = None
    description: str | None = None
    logged: list[str] | None = None


class Finding(Message):
    """What the background check says; ``block`` and ``port`` are ``""`` where it is of the whole drawing."""

    severity: Literal["error", "warning"]
    block: str
    port: str
    what: str
    fix: str


class WireKind(Message):
    """What runs on the wires that leave a port."""

    shape: list[int]
    unit: str
    bus: bool = False
    """Whether it is a bundle of signals."""


class BlockType(Message):
    """A type of block in the library palette. ``face`` is the drawing of one with the default parameters."""

    type: str
    title: str
    family: str
    summary: str
    documentation: str
    width: float
    height: float
    face: str
    inputs: list[str]
    outputs: list[str]
    """Ports that it has with the default parameters."""
    parameters: list[ParameterRule]


class ViewOf(Message):
    """A picture that a sink asks for. ``robot`` is the key of its scene where the kind is ``robot``."""

    block: str
    kind: str
    signals: list[str]
    labels: list[str]
    title: str


class Channel(Message):
    """One recorded signal of a run and where its numbers lie in the columns of a frame."""

    name: str
    shape: list[int]
    unit: str


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


class Tunable(Message):
    """A parameter that can be changed while the run goes on; ``path`` is ``block.parameter``.

    ``low`` and ``high`` bound its numbers as the block declares it; ``None`` where nothing does.
    """

    path: str
    value: Any
    unit: str
    doc: str
    low: float | None
    high: float | None


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


class Run(Message):
    """Start the model. ``speed`` is simulated seconds per second, ``None`` as fast as possible.

    ``tuned``: values of tunable parameters, ``block.parameter``, that are tried without being in the model.
    """

    kind: Literal["run"] = "run"
    document: str
    speed: float | None = Field(default=None, gt=0, le=1000)
    tuned: dict[str, Any] = Field(default_factory=dict[str, Any])


class Control(Message):
    """Say how a run goes on. ``step`` and ``back`` go to the next and to the last recorded instant."""

    kind: Literal["control"] = "control"
    run: str
    action: Literal["pause", "resume", "step", "back", "stop"]


class Rewind(Message):
    """Pause a run and take it back to an instant (s): what came later is forgotten, tuned values stay."""

    kind: Literal["rewind"] = "rewind"
    run: str
    time: float


class SetSpeed(Message):
    """Change the speed of a run; ``None``: as fast as possible."""

    kind: Literal["speed"] = "speed"
    run: str
    speed: float | None = Field(default=None, gt=0, le=1000)


class Tune(Message):
    """Change a tunable parameter of a run that is under way."""

    kind: Literal["tune"] = "tune"
    run: str
    parameter: str
    value: Any


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


class Fault(Message):
    """Why a request was refused, in the parts of an ``ArmblocksError``."""

    what: str
    where: str
    allowed: str
    fix: str


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


class RunStarted(Message):
    """A run has begun: what it records and how it is to be shown."""

    kind: Literal["run_started"] = "run_started"
    document: str
    run: str
    stop_time: float
    channels: list[Channel]
    views: list[ViewOf]
    aliases: dict[str, str]
    tunables: list[Tunable]
    stride: int
    """Of so many recorded instants the page gets the extremes of each signal, as two; 1: it gets all."""


class RunTuned(Message):
    """From this instant (s) on a parameter of a run has this value."""

    kind: Literal["run_tuned"] = "run_tuned"
    run: str
    time: float
    parameter: str
    value: Any


class RunRewound(Message):
    """A run stands at an earlier instant (s) again: only the first ``count`` samples are still true."""

    kind: Literal["run_rewound"] = "run_rewound"
    run: str
    time: float
    count: int


class RunProgress(Message):
    """Where a run stands. ``solver`` and ``reason`` say at its end what worked it out, and why that."""

    kind: Literal["run_progress"] = "run_progress"
    run: str
    state: Literal["running", "paused", "done", "stopped", "failed"]
    time: float
    real_time_factor: float
    message: str
    fault: Fault | None = None
    solver: str = ""
    reason: str = ""


RunEvent = Annotated[RunStarted | RunTuned | RunRewound | RunProgress, Field(discriminator="kind")]
"""What the process of a run has to say, besides its samples."""
Event = Annotated[
    Reply | Welcome | Documents | Opened | Changed | Checked | RunEvent | RobotShown | RobotOpened,
    Field(discriminator="kind"),
]


class ServerMessage(Message):
    """Only for the page's types: everything that the server sends as text."""

    event: Event
    values: Opening | RobotTables | Readings | Outline | Found | SetMask | None = None
    """Some of what replies carry as their value."""
