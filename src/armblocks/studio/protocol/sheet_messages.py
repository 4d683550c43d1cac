"""What a page shows of a model: sheets, blocks, wires, the library, what the background check found."""

from __future__ import annotations

from typing import Any, Literal

from armblocks.studio.protocol.edit_messages import Place, SheetNote, Wire
from armblocks.studio.protocol.message import Message


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
