"""Diagrams: sheets, blocks, wires, the library, and the findings of the background check."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from armblocks.studio.protocol.message import Event, Message, Request
from armblocks.studio.protocol.messages.documents import Content, ContentChange
from armblocks.studio.protocol.messages.sheet_edits import (
    Place,
    Px,
    ScopeTriggerSettings,
    SetMask,
    SheetNote,
    SheetPart,
    Wire,
)


class SheetPort(Message):
    """A port on the edge of its block: position from the block's corner in px, and direction of its wire.

    The direction points out of the block for an output and into the block for an input. A frame port has a
    direction in both lists, each with the sign of its list.
    """

    name: str
    doc: str
    label: str
    unit: str
    x: float
    y: float
    dx: int
    dy: int
    frame: bool = False
    """Whether the port is a frame port. It is then among the inputs and the outputs, and its lines have no
    direction."""


class Outline(Message):
    """The sheets of a model as a tree."""

    name: str
    blocks: int
    subsystems: list[Outline]


class FoundBlock(Message):
    """A block or a bookmark found by a search.

    ``match`` is the matching value of the block, ``""`` if its name or type matches. ``part`` is the part of
    the sheet that a bookmark shows; ``title`` is then ``""``.
    """

    inside: list[str]
    name: str
    title: str
    match: str
    part: SheetPart | None = None


class ParameterRule(Message):
    """The declaration of one parameter of a block type, for its dialog."""

    name: str
    kind: str
    doc: str
    unit: str
    default: Any
    tunable: bool
    choices: list[str]
    allowed: str


class SheetBlock(Message):
    """A block as drawn on the sheet. ``face`` is SVG in the block's px; its colours are CSS classes."""

    name: str
    type: str
    title: str
    place: Place
    width: float
    height: float
    face: str
    inputs: list[SheetPort]
    outputs: list[SheetPort]
    opens: bool
    """Whether the block contains a diagram."""
    shown_name_side: Literal["below", "above", "left", "right", "corner", "hidden"]
    """The position of the name; ``corner`` is at the upper right corner."""
    parameters: dict[str, Any]
    """Values in the form of :func:`~armblocks.studio.sheet.parameter_values.parameter_json`."""
    formulas: dict[str, str]
    """The texts of the parameters that are formulas."""
    mask: list[ParameterRule]
    """The mask parameters of the diagram inside; ``default`` is their present value."""
    link: str
    """The library entry to which the block is linked, ``file#name``; ``""`` without a link."""
    comment: Literal["out", "through", ""] = ""


class WireLines(Message):
    """The lines of the wires from one output, px.

    ``paths``: the corner points of the line to each target, from the output or from a branch. A path without
    points means that there is no room for a line: output and target have ``label`` instead. ``dots``:
    branches.
    """

    paths: dict[str, list[tuple[float, float]]]
    dots: list[tuple[float, float]]
    label: str
    name: str = ""
    """The name of the signal."""
    propagated_name: str = ""
    """The name that the signal has before a From, In or subsystem, if it has no name here."""
    name_at: tuple[float, float, Literal["start", "middle"]] | None = None
    """Position of the displayed name on its baseline, and its anchor; ``None`` without a line or name."""


class Sheet(Message):
    """The complete drawing of a sheet."""

    name: str
    description: str
    blocks: dict[str, SheetBlock]
    wires: list[Wire]
    lines: dict[str, WireLines]
    """The lines of all wires, by output."""
    notes: dict[str, SheetNote]
    logged: list[str]
    """Logged outputs, ``block/port``: their signals are recorded without a Scope."""
    linked: list[str]
    """Path of the library block that contains the sheet; such a sheet cannot be edited."""
    link: str
    """The library entry of that block."""


class SheetChange(Message):
    """The difference between two versions of a sheet."""

    blocks: dict[str, SheetBlock | None]
    """New or changed blocks; ``None`` for removed blocks."""
    wires_added: list[Wire]
    wires_removed: list[Wire]
    lines: dict[str, WireLines | None]
    """New or changed lines, by output; ``None`` for outputs without wires."""
    notes: dict[str, SheetNote] | None = None
    description: str | None = None
    logged: list[str] | None = None


class Finding(Message):
    """A finding of the background check; ``block`` and ``port`` are ``""`` for the whole diagram."""

    severity: Literal["error", "warning"]
    block: str
    port: str
    what: str
    fix: str


class WireKind(Message):
    """Type and shape of the signal on the wires of an output port."""

    shape: list[int]
    unit: str
    bus: bool = False
    """Whether the signal is a bus."""


class BlockType(Message):
    """A block type in the library palette. ``face`` is the drawing with default parameters."""

    type: str
    title: str
    family: str
    summary: str
    documentation: str
    width: float
    height: float
    face: str
    inputs: list[str]
    input_y: list[float]
    """Positions of the inputs below the upper edge, px."""
    outputs: list[str]
    frames: list[str]
    """Inputs, outputs and frame ports with default parameters."""
    parameters: list[ParameterRule]


class OuterComment(Message):
    """The outermost commented subsystem that contains a sheet: its path, and its comment."""

    path: list[str]
    comment: Literal["out", "through"]


class DiagramContent(Content):
    """The displayed sheet of a diagram, and the run settings.

    ``inside``: names of the subsystems that lead to the sheet. ``settings`` use the names of
    ``SimulationOptions``. ``run``: key of the current or last run of the diagram.
    """

    kind: Literal["diagram"] = "diagram"
    inside: list[str]
    sheet: Sheet
    settings: dict[str, bool | float | str | None]
    scope_trigger: ScopeTriggerSettings | None
    run: str | None
    outer_comment: OuterComment | None


class DiagramChange(ContentChange):
    """Changes of the displayed sheet and of the run settings."""

    kind: Literal["diagram"] = "diagram"
    sheet: SheetChange
    settings: dict[str, bool | float | str | None]
    scope_trigger: ScopeTriggerSettings | None
    outer_comment: OuterComment | None
    renamed: dict[str, str] = Field(default_factory=dict[str, str])
    """Paths of blocks that the change has renamed: old to new, from the top sheet."""


class ShowSheet(Request[None]):
    """Display the sheet inside a subsystem; the empty path is the top sheet."""

    kind: Literal["show_sheet"] = "show_sheet"
    document: str
    inside: list[str]


class BlockCorner(Message):
    """The top left corner of a block, px."""

    x: Px
    y: Px


class RouteWires(Request[dict[str, WireLines]]):
    """Return the lines of a sheet during a drag that differ from the lines of the document.

    ``places``: positions of the dragged blocks. ``wires``: the displayed wires, if they differ from the wires
    of the document. ``passed``: a block that lines do not avoid, because it may be inserted into one.
    """

    kind: Literal["route"] = "route"
    document: str
    inside: list[str] = Field(default_factory=list[str])
    places: dict[str, BlockCorner]
    wires: list[Wire] | None = None
    passed: str | None = None


class AskOutline(Request[Outline]):
    """Return the tree of sheets."""

    kind: Literal["outline"] = "outline"
    document: str


class Copy(Request[str]):
    """Return blocks and notes of a sheet as text, for :class:`PasteBlocks`."""

    kind: Literal["copy"] = "copy"
    document: str
    inside: list[str] = Field(default_factory=list[str])
    blocks: list[str]
    notes: list[str] = Field(default_factory=list[str])


class AskMask(Request[SetMask]):
    """Return the mask of a subsystem or of the sheet, as the :class:`SetMask` that declares it."""

    kind: Literal["ask_mask"] = "ask_mask"
    document: str
    inside: list[str] = Field(default_factory=list[str])
    block: str = ""


class Find(Request[list[FoundBlock]]):
    """Search all sheets: blocks by words in names, types and values, bookmarks by words in names."""

    kind: Literal["find"] = "find"
    document: str
    text: Annotated[str, Field(max_length=200)]


class SheetBookmark(Message):
    """A bookmark of the sheet at a path. ``linked``: it belongs to a library block and cannot be edited."""

    inside: list[str]
    name: str
    part: SheetPart
    linked: bool


class AskBookmarks(Request[list[SheetBookmark]]):
    """Return the bookmarks of all sheets of a model."""

    kind: Literal["bookmarks"] = "bookmarks"
    document: str


class SetParameter(Message):
    """A parameter of parameter sets: its value in the model, and whether it may change during a run."""

    path: str
    unit: str
    doc: str
    value: Any
    tunable: bool


class ParameterSetTable(Message):
    """The parameter sets of a model: values by set and path, and the faults of values that are invalid."""

    parameters: list[SetParameter]
    sets: dict[str, dict[str, Any]]
    faults: dict[str, dict[str, str]]


class AskParameterSets(Request[ParameterSetTable]):
    """Return the parameter sets of a model.

    The reply also contains the model's values of all parameters in the sets and in ``also``.
    """

    kind: Literal["parameter_sets"] = "parameter_sets"
    document: str
    also: list[str] = Field(default_factory=list[str], max_length=1000)


class TypedValue(Request[Any]):
    """Parse a text typed into a parameter field; the reply is its value, a refusal describes the error."""

    kind: Literal["typed"] = "typed"
    document: str = ""
    inside: list[str] = Field(default_factory=list[str])
    block: str = ""
    """The block, if it is on a sheet: formulas may contain mask parameters of the sheet."""
    type: str
    parameter: str
    text: str


class TypedSettings(Request[dict[str, str]]):
    """Check settings while they are typed; the reply has an error text for each invalid setting, by name."""

    kind: Literal["typed_settings"] = "typed_settings"
    document: str
    values: dict[str, bool | float | str | None]


class Checked(Event):
    """The findings of the background check for one version of a document; ``wires`` by source port."""

    kind: Literal["checked"] = "checked"
    document: str
    version: int
    findings: list[Finding]
    wires: dict[str, WireKind]
