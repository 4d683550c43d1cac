"""The edits of diagrams; :mod:`armblocks.studio.sheet.edits` carries them out."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from armblocks.studio.protocol.message import Edit, Message

Px = Annotated[float, Field(ge=-1e7, le=1e7)]
"""A place on the sheet; further out nothing could be drawn exactly."""
Size = Annotated[float, Field(gt=0, le=1e5)]


class Place(Message):
    """Where a block stands: top left corner and, if not its own, its size in px."""

    x: Px
    y: Px
    width: Size | None = None
    height: Size | None = None
    flipped: bool = False
    rotation: Literal[0, 90, 180, 270] = 0
    """Degrees clockwise."""


class SheetNote(Message):
    """Words on the sheet: their top left corner in px."""

    x: Px
    y: Px
    text: Annotated[str, Field(max_length=10_000)]


class NewBlock(Message):
    """A block to be put on the sheet. ``parameters`` states those that are not at their default."""

    name: str
    type: str
    parameters: dict[str, Any] = Field(default_factory=dict[str, Any])
    place: Place


class Wire(Message):
    """A wire between two ports, written ``block/port``.

    ``bends``: the way that somebody has drawn, see :func:`armblocks.drawing.wire_routing.bent`.
    """

    source: str
    target: str
    bends: tuple[Px, ...] = ()


class DiagramEdit(Edit):
    """An edit of a diagram: of the sheet on the screen, unless it is a :class:`ModelEdit`."""


class AddBlocks(DiagramEdit):
    """Put blocks on the sheet, with wires among them or to what is there: insert, paste and duplicate.

    ``instead``: wires that give way, as where a block is dropped on one.
    """

    kind: Literal["add"] = "add"
    blocks: list[NewBlock]
    wires: list[Wire] = Field(default_factory=list[Wire])
    instead: list[Wire] = Field(default_factory=list[Wire])


class PasteBlocks(DiagramEdit):
    """Put what was copied on the sheet: ``text`` is a diagram as a file holds it.

    ``names``: what its blocks and notes are to be called here, where that is not as there. ``shift``: px that
    they stand further right and down than there.
    """

    kind: Literal["paste"] = "paste"
    text: str
    names: dict[str, str] = Field(default_factory=dict[str, str])
    shift: Px = 0.0


class RemoveBlocks(DiagramEdit):
    """Take blocks, wires and notes off the sheet; the wires of the blocks go with them."""

    kind: Literal["remove"] = "remove"
    blocks: list[str] = Field(default_factory=list[str])
    wires: list[Wire] = Field(default_factory=list[Wire])
    notes: list[str] = Field(default_factory=list[str])


class Connect(DiagramEdit):
    """Draw a wire. With ``replace`` the input's present wire gives way."""

    kind: Literal["connect"] = "connect"
    wire: Wire
    replace: bool = False


class MoveBlocks(DiagramEdit):
    """Put blocks and notes elsewhere, or turn blocks: one drag is one edit, however much was in hand.

    Ways that are drawn between blocks that move alike move with them. ``wires`` are new, and those of
    ``instead`` give way: a block is put into a wire, or taken out of its wires.
    """

    kind: Literal["move"] = "move"
    places: dict[str, Place] = Field(default_factory=dict[str, Place])
    notes: dict[str, SheetNote] = Field(default_factory=dict[str, SheetNote])
    wires: list[Wire] = Field(default_factory=list[Wire])
    instead: list[Wire] = Field(default_factory=list[Wire])


class BendWires(DiagramEdit):
    """Lead wires along the bends that they have here; without any the way is chosen again."""

    kind: Literal["bend"] = "bend"
    wires: list[Wire]


class SetNotes(DiagramEdit):
    """Write notes, or change what they say."""

    kind: Literal["notes"] = "notes"
    notes: dict[Annotated[str, Field(pattern=r"^/\S+$", max_length=100)], SheetNote]


class Rename(DiagramEdit):
    """Give a block another name; its wires and its place go with it."""

    kind: Literal["rename"] = "rename"
    block: str
    name: str


class SetParameters(DiagramEdit):
    """Change parameters of one block. Wires to ports that thereby vanish are removed."""

    kind: Literal["parameters"] = "parameters"
    block: str
    values: dict[str, Any]


class MaskParameter(Message):
    """A parameter that a diagram declares. ``default`` as it is typed; ``was``: the name that it had before.

    ``minimum``, ``above`` and ``maximum`` bound its numbers, ``choices`` are what a choice may be.
    """

    name: Annotated[str, Field(max_length=100)]
    was: str = ""
    kind: Literal["number", "array", "integer", "boolean", "choice", "string", "robot"] = "number"
    default: Any
    unit: Annotated[str, Field(max_length=40)] = ""
    doc: Annotated[str, Field(max_length=2000)] = ""
    minimum: float | None = None
    above: float | None = None
    maximum: float | None = None
    choices: list[str] = Field(default_factory=list[str])


class SetMask(DiagramEdit):
    """Declare the parameters of a subsystem, or of the sheet itself where no block is named, in this order.

    ``name`` is what its face says; empty leaves that as it is.
    """

    kind: Literal["mask"] = "mask"
    block: str = ""
    name: Annotated[str, Field(max_length=100)] = ""
    parameters: Annotated[list[MaskParameter], Field(max_length=200)]


class ArrangeBlocks(DiagramEdit):
    """Lay the blocks of a sheet out anew, from left to right."""

    kind: Literal["arrange"] = "arrange"


class LogSignal(DiagramEdit):
    """Log an output ``block/port``, so that it is seen without a Scope; or log it no longer."""

    kind: Literal["log"] = "log"
    port: str
    logged: bool


class ModelEdit(DiagramEdit):
    """An edit of the whole model, whatever sheet of it is on the screen."""


class KeepTuned(ModelEdit):
    """Take values that were tried in a run, ``block.parameter``, into the model: one step for all of them."""

    kind: Literal["keep_tuned"] = "keep_tuned"
    values: dict[str, Any]


class GroupBlocks(DiagramEdit):
    """Put blocks into a subsystem of their own; its ports are the wires that are cut thereby."""

    kind: Literal["group"] = "group"
    blocks: list[str]
    name: str


class BreakLink(DiagramEdit):
    """Make a block that is linked to a library a copy of one's own, which may be changed inside."""

    kind: Literal["break_link"] = "break_link"
    block: str


class SetSettings(ModelEdit):
    """Change how the model is run, by the names of ``SimulationOptions``; ``None`` leaves it to armblocks."""

    kind: Literal["settings"] = "settings"
    values: dict[str, float | str | None]


class Describe(DiagramEdit):
    """Change the model's one-line description."""

    kind: Literal["describe"] = "describe"
    text: Annotated[str, Field(max_length=2000)]
