"""What a page shows of a model: sheets, blocks, wires, the library, what the background check found."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from armblocks.studio.protocol.message import Event, Message, Request
from armblocks.studio.protocol.messages.documents import Content, ContentChange
from armblocks.studio.protocol.messages.sheet_edits import Place, SetMask, SheetNote, Wire


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
    """Values in the form of :func:`~armblocks.studio.sheet.parameter_values.parameter_json`."""
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


class DiagramContent(Content):
    """The sheet of a diagram that a page looks at, and how the diagram is run.

    ``inside``: names of the subsystems on the way to the sheet. ``settings`` go by the names of
    ``SimulationOptions``. ``run``: the key of the run that the server has of the diagram.
    """

    kind: Literal["diagram"] = "diagram"
    inside: list[str]
    sheet: Sheet
    settings: dict[str, float | str | None]
    run: str | None


class DiagramChange(ContentChange):
    """What changed on the sheet that a page looks at, and the settings of the diagram."""

    kind: Literal["diagram"] = "diagram"
    sheet: SheetChange
    settings: dict[str, float | str | None]


class Look(Request[None]):
    """Look at the sheet inside a subsystem; the empty path is the whole model."""

    kind: Literal["look"] = "look"
    document: str
    inside: list[str]


class AskOutline(Request[Outline]):
    """Ask for the tree of sheets, an :class:`Outline`."""

    kind: Literal["outline"] = "outline"
    document: str


class Copy(Request[str]):
    """Ask for blocks and notes of a sheet as text, which :class:`PasteBlocks` puts on a sheet again."""

    kind: Literal["copy"] = "copy"
    document: str
    inside: list[str] = Field(default_factory=list[str])
    blocks: list[str]
    notes: list[str] = Field(default_factory=list[str])


class AskMask(Request[SetMask]):
    """Ask for the mask of a subsystem, or of the sheet itself: the :class:`SetMask` that would make it."""

    kind: Literal["ask_mask"] = "ask_mask"
    document: str
    inside: list[str] = Field(default_factory=list[str])
    block: str = ""


class Find(Request[list[Found]]):
    """Ask for blocks of all sheets by words of their names, types and values: a list of :class:`Found`."""

    kind: Literal["find"] = "find"
    document: str
    text: Annotated[str, Field(max_length=200)]


class TypedValue(Request[Any]):
    """Ask what a text typed into a parameter's field means: its value, or what is wrong with it."""

    kind: Literal["typed"] = "typed"
    document: str = ""
    inside: list[str] = Field(default_factory=list[str])
    block: str = ""
    """The block, where it is on a sheet: formulas may name parameters of the sheet's mask."""
    type: str
    parameter: str
    text: str


class TypedSettings(Request[dict[str, str]]):
    """Ask what is wrong with settings while they are typed: a text for each that is, by name."""

    kind: Literal["typed_settings"] = "typed_settings"
    document: str
    values: dict[str, float | str | None]


class Checked(Event):
    """What the background check found in one version of a document; ``wires`` by source port."""

    kind: Literal["checked"] = "checked"
    document: str
    version: int
    findings: list[Finding]
    wires: dict[str, WireKind]
